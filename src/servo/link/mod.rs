//! What connects the servo to its robot: whose joint states count, how late they are, whether the robot is there and follows.

mod commanded;
mod following;
mod latency;
mod presence;
mod samples;
mod sources;

pub use presence::Rearm;
pub(super) use presence::Return;

use super::{JointOrder, Limits, Rejection};
use commanded::Commanded;
use following::Following;
use latency::Latency;
use presence::Step;
use samples::Samples;
use sources::Sources;
use std::f64::consts::TAU;
use std::ops::Range;
use std::time::Duration;

/// A joint state without velocities tells how fast the arm is only together with another, at least so much later.
const TWO_STATES: Duration = Duration::from_millis(20);

/// A command may show in the joint states so much later.
const LATELY: Duration = Duration::from_millis(250);

/// Slower than this [rad/s] an arm stands: what velocities that are measured make of a standstill.
const STANDSTILL: f64 = 0.02;

/// Stamps may be so much ahead of our clock and still count as now.
const AHEAD_NS: i64 = 5_000_000;

/// A joint state as it came.
#[derive(Clone, Copy, Debug)]
pub struct JointReading<'a> {
    /// Joint names.
    pub names: &'a [String],
    /// Joint positions \[rad\], one a name.
    pub positions: &'a [f64],
    /// Joint velocities [rad/s], one a name, or none.
    pub velocities: &'a [f64],
    /// Who published it: a number for each publisher.
    pub source: u32,
    /// How old it is by its stamp; none where the stamp is no time of the past.
    pub stamp_age: Option<Duration>,
}

/// The age of what was stamped at `stamp` \[ns\] at the time `clock` \[ns\] of the same clock, as [`JointReading::stamp_age`].
pub fn stamp_age(clock: i64, stamp: i64) -> Option<Duration> {
    let age = clock.checked_sub(stamp).filter(|age| *age >= -AHEAD_NS)?;
    Some(Duration::from_nanos(age.max(0).unsigned_abs()))
}

/// What is known of how an arm follows its commands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Contact {
    /// It does.
    Following,
    /// It stands, or has not been seen to move yet: it is driven gently.
    Unseen,
    /// It did not when that was last seen, and is tried, gently.
    Lost,
    /// It did not, and gets zeros for a while.
    Resting,
    /// Nobody subscribes to its commands.
    Nobody,
}

/// What the link has found out of an arm for one cycle: with it, a recorded cycle can be repeated exactly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ArmFigures {
    /// The commands of so long before the last joint state came, and since, are not in it.
    pub lag: Duration,
    /// What the law's gain is held against: the time from a command to the joint state that shows it and to the next one.
    pub delay: Duration,
    /// How it follows.
    pub contact: Contact,
    /// The robot has come in this cycle: if it moves, it is braked from the speed that it has.
    pub came: bool,
}

impl Default for ArmFigures {
    fn default() -> Self {
        Self { lag: Duration::ZERO, delay: Duration::ZERO, contact: Contact::Unseen, came: false }
    }
}

/// What the link needs of the settings.
pub(super) struct LinkSettings<'a> {
    pub limits: &'a Limits,
    pub state_timeout: Duration,
    pub rearm_timeout: Duration,
    pub latency: Option<Duration>,
}

/// The joints of all arms: as measured, and as they should be by now.
pub(super) struct Link {
    arms: Vec<ArmLink>,
    commanded: Commanded,
    measured: Vec<f64>,
    predicted: Vec<f64>,
    velocity: Vec<f64>,
}

/// One arm.
struct ArmLink {
    order: JointOrder,
    joints: Range<usize>,
    sources: Sources,
    /// What came since the last cycle.
    newest: Option<Newest>,
    positions: Vec<f64>,
    velocities: Vec<f64>,
    /// How far the arm was commanded lately \[rad\].
    way: Vec<f64>,
    /// Where in the last message the arm's joints were.
    places: Vec<usize>,
    /// The last state: when it came, and for which time it was made.
    received: Option<Duration>,
    measured_at: Duration,
    figures: ArmFigures,
    /// Figures from a recording that the next cycle is to have.
    recorded: Option<ArmFigures>,
    /// When the first state of a robot without velocities came, and where it was.
    first: Option<(Duration, Vec<f64>)>,
    latency: Latency,
    samples: Samples,
    following: Following,
    listeners: bool,
}

/// A state that waits for the cycle; its numbers are in the arm's `positions` and `velocities`.
struct Newest {
    now: Duration,
    has_velocities: bool,
    stamp_age: Option<Duration>,
}

impl Link {
    /// Nothing heard yet of these arms, by a cycle of `period`.
    pub fn new(orders: Vec<JointOrder>, period: Duration) -> Self {
        let mut count = 0;
        let arms = orders.into_iter().map(|order| {
            let joints = count..count + order.names().len();
            count = joints.end;
            ArmLink::new(order, joints, period)
        });
        let arms = arms.collect();
        let zeros = vec![0.0; count];
        let commanded = Commanded::new(count, period);
        Self { arms, commanded, measured: zeros.clone(), predicted: zeros.clone(), velocity: zeros }
    }

    /// Takes a joint state received at `now`, for the next cycle; the last good one before it counts. True where it is of the
    /// publisher that is believed.
    pub fn take(
        &mut self,
        arm: usize,
        reading: &JointReading,
        now: Duration,
        silence: Duration,
    ) -> Result<bool, Rejection> {
        self.arms[arm].take(reading, now, silence)
    }

    /// Whether anyone subscribes to the commands for `arm`.
    pub fn set_listeners(&mut self, arm: usize, listeners: bool) {
        self.arms[arm].listeners = listeners;
    }

    /// Looks at what has come since the last cycle. Where the robot has returned: since when, and why.
    pub fn advance(&mut self, now: Duration, settings: &LinkSettings) -> Option<Return> {
        let mut returned = None;
        for arm in &mut self.arms {
            let came = arm.advance(settings, &mut self.measured, &mut self.velocity, &self.commanded);
            let rivals = arm.sources.rivals(now).map(|_| Return { since: now, why: Rearm::TwoSources });
            arm.sum_up(came, settings.latency);
            returned = rivals.or(came).or(returned);
        }
        self.predict(now);
        returned
    }

    fn predict(&mut self, now: Duration) {
        for arm in &self.arms {
            let since = arm.received.unwrap_or(now).saturating_sub(arm.figures.lag);
            let slots = &mut self.predicted[arm.joints.clone()];
            self.commanded.travel(arm.joints.clone(), since, now, slots);
            slots
                .iter_mut()
                .zip(&self.measured[arm.joints.clone()])
                .for_each(|(slot, measured)| *slot += measured);
        }
    }

    /// The joints are commanded to move at `command` [rad/s] from `now` on.
    pub fn command(&mut self, now: Duration, command: &[f64]) {
        self.commanded.hold(now, command);
        for arm in &mut self.arms {
            let joints = arm.joints.clone();
            arm.following.command(now, &command[joints.clone()], &self.measured[joints]);
        }
    }

    /// The positions as last measured \[rad\], arm after arm.
    pub fn measured(&self) -> &[f64] {
        &self.measured
    }

    /// Where the joints should be when the next command reaches them \[rad\]: as last measured, moved on by the commands since.
    pub fn predicted(&self) -> &[f64] {
        &self.predicted
    }

    /// The velocities as last measured [rad/s]; zeros for an arm that stands.
    pub fn velocity(&self) -> &[f64] {
        &self.velocity
    }

    /// How many joints each arm has.
    pub fn counts(&self) -> Vec<usize> {
        self.arms.iter().map(|arm| arm.joints.len()).collect()
    }

    /// When the arm that has been silent longest was last heard; none where it is not known of each where it is and how fast.
    pub fn received(&self) -> Option<Duration> {
        self.arms.iter().map(|arm| arm.received).min().flatten()
    }

    /// The two publishers that both give joint states of an arm, with the arm's number.
    pub fn rivals(&mut self, now: Duration) -> Option<Rivals> {
        let mut arms = self.arms.iter_mut().enumerate();
        arms.find_map(|(arm, link)| {
            let (first, second) = link.sources.rivals(now)?;
            Some(Rivals { arm, first, second })
        })
    }

    /// What the last cycle found out of each arm.
    pub fn figures(&self) -> impl Iterator<Item = &ArmFigures> {
        self.arms.iter().map(|arm| &arm.figures)
    }

    /// Lets the next cycle have these figures of `arm`.
    pub fn repeat_with(&mut self, arm: usize, figures: ArmFigures) {
        self.arms[arm].recorded = Some(figures);
    }

    /// The first arm that is one of `contacts`.
    pub fn find(&self, contacts: &[Contact]) -> Option<usize> {
        self.figures().position(|figures| contacts.contains(&figures.contact))
    }

    /// Whether all arms are there, and one has just come.
    pub fn came(&self) -> bool {
        self.received().is_some() && self.figures().any(|figures| figures.came)
    }

    /// Tries an arm that did not follow at once.
    pub fn try_again(&mut self) {
        self.arms.iter_mut().for_each(|arm| arm.following.try_again());
    }

    /// The factor for `target` [rad/s] so that an arm that has not been seen to follow is driven gently.
    pub fn probing_factor(&self, target: &[f64], accelerations: &[f64]) -> f64 {
        let factor = |arm: &ArmLink| {
            let fastest = target[arm.joints.clone()].iter().fold(0.0_f64, |a, b| a.max(b.abs()));
            let cap = following::probe_speed(&accelerations[arm.joints.clone()]);
            (arm.figures.contact != Contact::Following && fastest > cap).then(|| cap / fastest)
        };
        self.arms.iter().filter_map(factor).fold(1.0, f64::min)
    }

    /// From a command to the joint state that shows it \[s\], of the slowest arm.
    pub fn latency(&self, fixed: Option<Duration>) -> f64 {
        let estimated = self.arms.iter().map(|arm| arm.latency.total()).fold(0.0, f64::max);
        fixed.map_or(estimated, |latency| latency.as_secs_f64())
    }

    /// What the law's gain is held against \[s\], of the slowest arm.
    pub fn delay(&self) -> f64 {
        self.figures().map(|figures| figures.delay).max().unwrap_or_default().as_secs_f64()
    }
}

/// Two publishers of joint states of one arm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rivals {
    /// The arm's number.
    pub arm: usize,
    /// The publisher that was there first, as [`JointReading::source`].
    pub first: u32,
    /// The other one.
    pub second: u32,
}

impl ArmLink {
    fn new(order: JointOrder, joints: Range<usize>, period: Duration) -> Self {
        let zeros = vec![0.0; joints.len()];
        Self {
            order,
            sources: Sources::default(),
            newest: None,
            positions: zeros.clone(),
            way: zeros.clone(),
            velocities: zeros,
            places: vec![0; joints.len()],
            received: None,
            measured_at: Duration::ZERO,
            figures: ArmFigures::default(),
            recorded: None,
            first: None,
            latency: Latency::new(joints.len(), period),
            samples: Samples::new(joints.clone()),
            following: Following::new(joints.len()),
            listeners: true,
            joints,
        }
    }

    fn take(&mut self, reading: &JointReading, now: Duration, silence: Duration) -> Result<bool, Rejection> {
        // A message that is no state of this arm says nothing of who else is there.
        self.order.locate(reading.names, reading.positions, &mut self.places)?;
        if !self.sources.hear(reading.source, now, silence) {
            return Ok(false);
        }
        self.pick(reading.positions, |arm| &mut arm.positions);
        let has_velocities = reading.velocities.len() == reading.names.len();
        if has_velocities {
            self.pick(reading.velocities, |arm| &mut arm.velocities);
        }
        let has_velocities = has_velocities && self.velocities.iter().all(|speed| speed.is_finite());
        self.newest = Some(Newest { now, has_velocities, stamp_age: reading.stamp_age });
        Ok(true)
    }

    /// The arm's joints out of those of a message.
    fn pick(&mut self, values: &[f64], slots: impl Fn(&mut Self) -> &mut Vec<f64>) {
        for joint in 0..self.places.len() {
            let value = values[self.places[joint]];
            slots(self)[joint] = value;
        }
    }

    /// Looks at what came since the last cycle; `measured` and `velocity` are of all arms. Whether the robot has returned.
    fn advance(
        &mut self,
        settings: &LinkSettings,
        measured: &mut [f64],
        velocity: &mut [f64],
        commanded: &Commanded,
    ) -> Option<Return> {
        let Newest { now, has_velocities, stamp_age } = self.newest.take()?;
        let (measured, velocity) = (&mut measured[self.joints.clone()], &mut velocity[self.joints.clone()]);
        let lately = self.received.unwrap_or(now).saturating_sub(LATELY);
        commanded.travel(self.joints.clone(), lately, now, &mut self.way);
        let step = Step {
            commanded: &self.way,
            before: self.received,
            now,
            from: measured,
            to: &self.positions,
            speeds: &settings.limits.joint_velocity[self.joints.clone()],
            first_joint: self.joints.start + 1,
        };
        let returned = step.returned(settings.rearm_timeout);
        let is_new = returned.is_some_and(|it| !matches!(it.why, Rearm::IsElsewhere(..)));
        if has_velocities {
            velocity.copy_from_slice(&self.velocities);
        } else if is_new && !self.differentiate(now, settings.state_timeout, velocity) {
            return None;
        }
        if velocity.iter().all(|speed| speed.abs() < STANDSTILL) {
            velocity.fill(0.0);
        }
        if returned.is_some() {
            self.samples.clear();
            self.following = Following::new(self.joints.len());
        }
        measured.copy_from_slice(&self.positions);
        let age = self.latency.hear(now, self.received, stamp_age);
        (self.received, self.measured_at) = (Some(now), now.saturating_sub(age));
        self.watch(now, measured, settings.latency, commanded);
        returned
    }

    /// Puts together what this cycle is to know; `returned`: the robot has.
    fn sum_up(&mut self, returned: Option<Return>, fixed: Option<Duration>) {
        let age = self.received.unwrap_or_default().saturating_sub(self.measured_at);
        let latency = fixed.unwrap_or_else(|| seconds(self.latency.total()));
        let contact = match &self.following {
            _ if !self.listeners => Contact::Nobody,
            it if it.must_rest() => Contact::Resting,
            it if it.is_lost() => Contact::Lost,
            it if it.is_seen() => Contact::Following,
            _ => Contact::Unseen,
        };
        let found = ArmFigures {
            lag: fixed.unwrap_or_else(|| age + seconds(self.latency.response())),
            delay: latency + seconds(self.latency.interval()),
            contact,
            came: returned.is_some_and(|it| !matches!(it.why, Rearm::IsElsewhere(..))),
        };
        self.figures = self.recorded.take().unwrap_or(found);
    }

    /// The velocities by two states of a robot that has just come; false where there is only one.
    fn differentiate(&mut self, now: Duration, state_timeout: Duration, velocity: &mut [f64]) -> bool {
        let since = self.first.as_ref().map(|(at, _)| now.saturating_sub(*at));
        match (&self.first, since) {
            (Some((_, before)), Some(since))
                if since >= TWO_STATES && since <= TWO_STATES + state_timeout =>
            {
                for ((slot, from), to) in velocity.iter_mut().zip(before).zip(&self.positions) {
                    *slot = wrap(to - from) / since.as_secs_f64();
                }
                self.first = None;
                true
            }
            (Some(_), Some(since)) if since < TWO_STATES => false,
            _ => {
                self.first = Some((now, self.positions.clone()));
                false
            }
        }
    }

    /// Compares where the arm is with what it was commanded.
    fn watch(&mut self, now: Duration, measured: &[f64], fixed: Option<Duration>, commanded: &Commanded) {
        self.following.watch_start(now, measured, self.joints.clone(), commanded);
        if !self.samples.add(self.measured_at, measured) {
            return;
        }
        if let Some(motion) = self.samples.motion() {
            self.latency.compare(&motion, commanded);
            let response = fixed.unwrap_or_else(|| seconds(self.latency.response()));
            self.following.watch_motion(now, &motion, response, commanded);
        }
    }
}

fn seconds(seconds: f64) -> Duration {
    Duration::try_from_secs_f64(seconds).unwrap_or_default()
}

/// The angle \[rad\] from −π to π that is the same rotation: encoders wrap.
fn wrap(angle: f64) -> f64 {
    angle - TAU * (angle / TAU).round()
}
