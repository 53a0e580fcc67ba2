//! Connects the servo to its robot: takes joint states, estimates delays and pulls, and checks that the robot is present and follows.
#![warn(clippy::unwrap_used, clippy::expect_used)]
// Both panic if nobody reads: results go through cli::print, everything else through stderr.
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod arbiter;
mod arm;
mod command_history;
mod comparison;
mod joint_order;
mod latency;
mod lateness;
mod parts;
mod presence;
mod pull;
mod samples;
mod state_error;
mod tracking_monitor;

pub use joint_order::JointOrder;
pub use presence::{Return, Returned, longest_travel};
pub use pull::Hold;
pub use state_error::StateError;
pub use tracking_monitor::Disobedience;

use arm::ArmLink;
use command_history::CommandHistory;
use dq_kinematics::arm::JointKind;
use dq_limits::{Braking, Interface, Limits, ratio};
use lateness::Cycles;
use pull::Room;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::time::Duration;

/// A stamp that is ahead of our clock by no more than this counts as now.
const AHEAD_NS: i64 = 5_000_000;

/// A joint state as received.
#[derive(Clone, Copy, Debug)]
pub struct JointReading<'a> {
    /// Joint names.
    pub names: &'a [String],
    /// Joint positions \[rad, prismatic: m\], one per name.
    pub positions: &'a [f64],
    /// Joint velocities [rad/s, prismatic: m/s], one per name, or empty.
    pub velocities: &'a [f64],
    /// The number of its publisher.
    pub source: u32,
    /// Its age by its stamp; `None` if the stamp is not in the past.
    pub stamp_age: Option<Duration>,
}

/// Returns the age, at time `clock` \[ns\], of a message with time stamp `stamp` \[ns\] of the same clock: see [`JointReading::stamp_age`].
pub fn stamp_age(clock: i64, stamp: i64) -> Option<Duration> {
    let age = clock.checked_sub(stamp).filter(|age| *age >= -AHEAD_NS)?;
    Some(Duration::from_nanos(age.max(0).unsigned_abs()))
}

/// How an arm follows its commands, as far as is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Contact {
    /// It follows them.
    Following,
    /// It stands, or was not yet seen to respond: it is driven gently.
    Unseen,
    /// It did not follow before, and is being tried gently.
    Lost,
    /// It did not follow, and gets zeros for a while.
    Resting,
    /// Nobody subscribes to its commands.
    Nobody,
    /// Another publisher sends it commands too.
    Contended,
}

/// The estimates about one arm in one control period.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ArmFigures {
    /// Commands sent later than this before the last joint state arrived do not show in it yet.
    pub lag: Duration,
    /// The delay that bounds the law's gain: from a command to the joint state that shows it, plus one interval between joint states.
    pub delay: Duration,
    /// The largest lateness of a cycle or of a joint state in the last seconds.
    pub lateness: Duration,
    /// The time between cycles that a stop in the last seconds would have seen at worst; never less than the period.
    pub cycle: Duration,
    /// How the arm follows.
    pub contact: Contact,
    /// The fraction of the commanded speed at which the arm moves, at most 1.
    pub factor: f64,
    /// In this cycle the robot appeared, or the servo came back after a gap: the next command starts at the arm's present speed.
    pub came: bool,
}

impl Default for ArmFigures {
    fn default() -> Self {
        Self {
            lag: Duration::ZERO,
            delay: Duration::ZERO,
            lateness: Duration::ZERO,
            cycle: Duration::ZERO,
            contact: Contact::Unseen,
            factor: 1.0,
            came: false,
        }
    }
}

/// The settings that the link uses.
pub struct LinkSettings<'a> {
    /// The limits of the commands.
    pub limits: &'a Limits,
    /// The age at which a joint state is stale.
    pub state_timeout: Duration,
    /// A robot that is silent for longer than this was away.
    pub rearm_timeout: Duration,
    /// The time from a command to the joint state that shows it; `None` to estimate it.
    pub latency: Option<Duration>,
    /// The rate at which the pull at the joints is balanced [1/s]; 0 not to balance it.
    pub integral: f64,
}

/// The joints of all arms: their measured and their predicted positions.
#[derive(Serialize, Deserialize)]
pub struct Link {
    arms: Vec<ArmLink>,
    history: CommandHistory,
    cycles: Cycles,
    measured: Vec<f64>,
    predicted: Vec<f64>,
    velocity: Vec<f64>,
    /// The part of each joint's command that balances the pull, and the part of it that the joint was seen to respond to [rad/s].
    hold: Vec<f64>,
    proven: Vec<f64>,
}

impl Link {
    /// Creates the link to arms with joints `orders` of these `kinds`, commanded through `interface` once per `period`.
    pub fn new(orders: Vec<JointOrder>, kinds: &[JointKind], period: Duration, interface: Interface) -> Self {
        let mut count = 0;
        let arms = orders.into_iter().map(|order| {
            let joints = count..count + order.names().len();
            count = joints.end;
            ArmLink::new(order, kinds[joints.clone()].to_vec(), joints, period)
        });
        let arms = arms.collect();
        let zeros = vec![0.0; count];
        let history = CommandHistory::new(count, period, interface);
        Self {
            arms,
            history,
            cycles: Cycles::new(period),
            measured: zeros.clone(),
            predicted: zeros.clone(),
            velocity: zeros.clone(),
            hold: zeros.clone(),
            proven: zeros,
        }
    }

    /// Takes a joint state received at `now` for the next cycle; the last good one counts. Returns whether it came from the publisher in
    /// charge, which another one replaces after a `silence`.
    pub fn take(
        &mut self,
        arm: usize,
        reading: &JointReading,
        now: Duration,
        silence: Duration,
    ) -> Result<bool, StateError> {
        self.arms[arm].take(reading, now, silence)
    }

    /// Returns the joint names of `arm`, and their indices among all joints.
    pub fn order(&self, arm: usize) -> (JointOrder, Range<usize>) {
        self.arms[arm].order()
    }

    /// Sets whether anyone subscribes to the commands for `arm`.
    pub fn set_listeners(&mut self, arm: usize, listeners: bool) {
        self.arms[arm].listeners = listeners;
    }

    /// Sets whether another publisher sends commands to `arm`.
    pub fn set_rival(&mut self, arm: usize, rival: bool) {
        self.arms[arm].rival = rival;
    }

    /// Processes the joint states that arrived since the last cycle.
    pub fn advance(&mut self, now: Duration, settings: &LinkSettings) {
        self.cycles.note(now);
        for arm in &mut self.arms {
            if self.cycles.has_gap() && arm.received.is_some() {
                arm.blind_since = Some(now);
            }
            arm.advance(settings, &mut self.measured, &mut self.velocity, &self.history);
            arm.sum_up(now, settings.latency, &self.cycles);
            if arm.returned.is_some_and(|it| it.is_of_newcomer()) {
                // Nothing holds a robot that has just appeared.
                self.hold[arm.joints.clone()].fill(0.0);
            }
        }
        self.predict(now);
    }

    /// Returns the events of this cycle that revoke consent, such as a robot that appeared or jumped.
    pub fn returns(&self) -> impl Iterator<Item = Return> + '_ {
        self.arms.iter().filter_map(|arm| arm.returned)
    }

    /// Returns why a request is not obeyed, if the arm has disobeyed for longer than `timeout` or too often.
    pub fn disobedience(&self, now: Duration, timeout: Duration) -> Option<Disobedience> {
        self.arms.iter().find_map(|arm| {
            let first = arm.joints.start;
            Some(match arm.following.disobedience(now, timeout)? {
                Disobedience::For(joint, time) => Disobedience::For(first + joint, time),
                Disobedience::Again(joint) => Disobedience::Again(first + joint),
            })
        })
    }

    /// Notes that consent was revoked.
    pub fn tell(&mut self) {
        for arm in &mut self.arms {
            if arm.following.is_lost() {
                arm.pull.release();
            }
            arm.following.tell();
        }
    }

    /// Returns whether an arm is known not to follow.
    pub fn is_lost(&self) -> bool {
        self.arms.iter().any(|arm| arm.following.is_lost())
    }

    /// Notes the fraction of its speed at which `arm` says at `now` that it moves.
    pub fn set_factor(&mut self, arm: usize, factor: f64, now: Duration) {
        self.arms[arm].told_factor = factor.is_finite().then_some((factor.clamp(0.0, 1.0), now));
    }

    /// Returns the fraction of the commanded speed at which the slowest arm moves.
    pub fn factor(&self) -> f64 {
        self.figures().map(|figures| figures.factor).fold(1.0, f64::min)
    }

    /// Returns whether the cycles had a gap after which some arm's state is not known yet: then nothing may be sent.
    pub fn is_blind(&self) -> bool {
        self.arms.iter().any(|arm| arm.blind_since.is_some())
    }

    /// Returns the joints whose next command must start at their present speed, each with that speed [rad/s].
    pub fn coasting(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        let came = self.arms.iter().filter(|arm| arm.figures.came && self.received().is_some());
        came.flat_map(|arm| arm.joints.clone()).map(|joint| (joint, self.velocity[joint]))
    }

    fn predict(&mut self, now: Duration) {
        for arm in &self.arms {
            let since = arm.received.unwrap_or(now).saturating_sub(arm.figures.lag);
            let slots = &mut self.predicted[arm.joints.clone()];
            self.history.travel(arm.joints.clone(), since, now, slots);
            let passed = now.saturating_sub(since).as_secs_f64();
            let joints = self.measured[arm.joints.clone()].iter().zip(&self.hold[arm.joints.clone()]);
            slots.iter_mut().zip(joints).for_each(|(slot, (measured, hold))| {
                *slot = measured + arm.figures.factor * (*slot - passed * hold);
            });
        }
    }

    /// Notes the `command` [rad/s] in force from `now` on. It contains the hold, which moves nothing.
    pub fn command(&mut self, now: Duration, command: &[f64]) {
        self.history.note(now, command, &self.hold);
        for arm in &mut self.arms {
            let joints = arm.joints.clone();
            let parts = command[joints.clone()].iter().zip(&self.hold[joints]);
            arm.following.command(now, parts.map(|(command, hold)| command - hold));
        }
    }

    /// Moves the hold of each joint towards the estimated pull, or towards 0 if nothing is to be held. `jerks` are the joints' jerk limits
    /// [rad/s³], `period` the control period \[s\].
    pub fn balance(&mut self, what: Hold, limits: &Limits, jerks: &[f64], period: f64) {
        let room = Room { limits, positions: &self.predicted, jerks, period };
        for arm in &mut self.arms {
            let range = arm.joints.clone();
            arm.balance(what, &room, &mut self.proven[range.clone()], &mut self.hold[range]);
        }
    }

    /// Returns the part of each joint's command that balances the pull [rad/s, prismatic: m/s].
    pub fn hold(&self) -> &[f64] {
        &self.hold
    }

    /// Returns by how much each joint moves slower than commanded [rad/s, prismatic: m/s].
    pub fn pulls(&self) -> impl Iterator<Item = f64> + '_ {
        self.arms.iter().flat_map(|arm| arm.pull.speeds().iter().copied())
    }

    /// Returns whether no joint was commanded to move since `time`.
    pub fn stood_after(&self, time: Duration) -> bool {
        self.history.stood_after(time)
    }

    /// Returns the joint positions as last measured \[rad, prismatic: m\], arm after arm.
    pub fn measured(&self) -> &[f64] {
        &self.measured
    }

    /// Returns the joint positions predicted for the time at which the next command takes effect \[rad, prismatic: m\].
    pub fn predicted(&self) -> &[f64] {
        &self.predicted
    }

    /// Returns when the arm that has been silent longest was last heard; `None` until the state of each arm is known.
    pub fn received(&self) -> Option<Duration> {
        self.arms.iter().map(|arm| arm.received).min().flatten()
    }

    /// Returns the arm that has been silent longest.
    pub fn quietest(&self) -> usize {
        let arms = self.arms.iter().enumerate();
        arms.min_by_key(|(_, arm)| arm.received).map_or(0, |(arm, _)| arm)
    }

    /// Returns an arm with two publishers of joint states, and the numbers of both, the earlier one first.
    pub fn rivals(&mut self, now: Duration) -> Option<(usize, [u32; 2])> {
        let mut arms = self.arms.iter_mut().enumerate();
        arms.find_map(|(arm, link)| Some((arm, link.sources.rivals(now)?)))
    }

    /// Returns the estimates of the last cycle about each arm.
    pub fn figures(&self) -> impl Iterator<Item = &ArmFigures> {
        self.arms.iter().map(|arm| &arm.figures)
    }

    /// Returns the first arm whose contact is one of `contacts`.
    pub fn find(&self, contacts: &[Contact]) -> Option<usize> {
        self.figures().position(|figures| contacts.contains(&figures.contact))
    }

    /// Returns the joint that does not follow, counted from 1 arm after arm.
    pub fn lost(&self) -> Option<usize> {
        self.arms.iter().find_map(|arm| Some(arm.joints.start + arm.following.lost()? + 1))
    }

    /// Returns the joint that goes too far, counted from 1 arm after arm, and how many times as far as commanded it goes.
    pub fn too_far(&self, now: Duration) -> Option<(usize, f64)> {
        self.arms.iter().find_map(|arm| {
            let (joint, factor) = arm.following.too_far(now)?;
            Some((arm.joints.start + joint + 1, factor))
        })
    }

    /// Tries arms that did not follow again, without waiting.
    pub fn try_again(&mut self) {
        self.arms.iter_mut().for_each(|arm| arm.following.try_again());
    }

    /// Returns the factor by which to scale `target` [rad/s], so that joints not yet seen to respond are driven gently.
    pub fn probing_factor(&self, target: &[f64], accelerations: &[f64]) -> f64 {
        let factors = self.arms.iter().flat_map(|arm| {
            arm.joints.clone().map(|joint| {
                let probe = arm.following.probe(joint - arm.joints.start, accelerations[joint]);
                // The hold uses up a part of the allowed change.
                let left = (probe - (self.hold[joint] - self.proven[joint]).abs()).max(0.0);
                ratio(left, target[joint].abs())
            })
        });
        factors.fold(1.0, f64::min)
    }

    /// Returns the time from a command to the joint state that shows it \[s\], for the slowest arm.
    pub fn latency(&self, fixed: Option<Duration>) -> f64 {
        let estimated = self.arms.iter().map(|arm| arm.latency.total()).fold(0.0, f64::max);
        fixed.map_or(estimated, |latency| latency.as_secs_f64())
    }

    /// Returns what braking before a position limit depends on. The servo has the control period `period` \[s\]; the joints have these
    /// decelerations [rad/s²], jerks [rad/s³] and last steps of their commands [rad/s].
    ///
    /// A command may stay in force for as long as the latest one of the last seconds did. Such single delays do not bound the law's gain.
    pub fn braking<'a>(&self, [decelerations, jerks, steps]: [&'a [f64]; 3], period: f64) -> Braking<'a> {
        let slowest = |of: fn(&ArmFigures) -> Duration| self.figures().map(of).max().unwrap_or_default();
        let delay = slowest(|figures| figures.delay + figures.lateness).as_secs_f64();
        let cycle = slowest(|figures| figures.cycle).as_secs_f64().max(period);
        Braking { decelerations, jerks, steps, period, cycle, delay }
    }

    /// Returns the delay that bounds the law's gain \[s\], for the slowest arm.
    pub fn delay(&self) -> f64 {
        self.figures().map(|figures| figures.delay).max().unwrap_or_default().as_secs_f64()
    }
}

/// Converts seconds to a duration; values that are not a time become zero.
pub fn seconds(seconds: f64) -> Duration {
    Duration::try_from_secs_f64(seconds).unwrap_or_default()
}
