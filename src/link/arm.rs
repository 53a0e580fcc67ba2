//! The link to one arm: its last joint state, its delay, and whether it follows.

use crate::arbiter::Arbiter;
use crate::command_history::CommandHistory;
use crate::latency::Latency;
use crate::lateness::{Cycles, Lateness};
use crate::parts::Parts;
use crate::presence::{Return, Step};
use crate::pull::{Hold, Observed, Pull, Room, observed_at};
use crate::rarity::Rarity;
use crate::samples::Samples;
use crate::tracking_monitor::TrackingMonitor;
use crate::{ArmFigures, Contact, JointOrder, JointReading, LinkSettings, StateError, seconds};
use dq_kinematics::arm::JointKind;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::time::Duration;

/// Least time between two positions from which a speed is computed.
const TWO_STATES: Duration = Duration::from_millis(20);

/// The largest assumed time from a command to the joint state that shows its effect.
const LATELY: Duration = Duration::from_millis(250);

/// How long the link uses a speed scaling after the robot has reported it. Afterwards the link uses the speed scaling that it has
/// measured.
const TOLD: Duration = Duration::from_secs(1);

/// Measured speeds below this [rad/s, prismatic: m/s] count as standstill.
const STANDSTILL: f64 = 0.02;

/// The link to one arm.
#[derive(Serialize, Deserialize)]
pub(crate) struct ArmLink {
    order: JointOrder,
    pub joints: Range<usize>,
    kinds: Vec<JointKind>,
    pub sources: Arbiter,
    parts: Parts,
    /// The joint state that has arrived since the last cycle; `None` if no joint state has arrived.
    newest: Option<Newest>,
    positions: Vec<f64>,
    velocities: Vec<f64>,
    /// A buffer for the displacement that was commanded to each joint between two times \[rad, prismatic: m\].
    asked: Vec<f64>,
    /// The mean commanded speed of each joint in the last comparison of motion with commands [rad/s, prismatic: m/s]. The mean is over
    /// the time [`LATELY`] up to the newest compared command.
    means: Vec<f64>,
    /// The index of each joint of the arm in the last message.
    places: Vec<usize>,
    /// When the last joint state arrived.
    pub received: Option<Duration>,
    /// When the last joint state was measured.
    measured_at: Duration,
    pub figures: ArmFigures,
    /// The event of this cycle that revokes consent; `None` if there is none.
    pub returned: Option<Return>,
    /// Whether joint states arrive too rarely.
    pub rarity: Rarity,
    /// The speed scaling that the robot has reported, and the time of that report; `None` if it has reported nothing.
    pub told_factor: Option<(f64, Duration)>,
    /// A robot that has just appeared, and may be moving; `None` when its speed is known.
    newcomer: Option<Newcomer>,
    /// When the cycles resumed after a gap; `None` once the arm's state after the gap is known.
    pub blind_since: Option<Duration>,
    /// Whether the next command must start at the arm's present speed. This is true when that speed becomes known, after the arm
    /// appeared or after a gap in the cycles. It stays true until the states of all arms are known, because no command is sent before.
    came: bool,
    pub latency: Latency,
    lateness: Lateness,
    samples: Samples,
    pub following: TrackingMonitor,
    pub pull: Pull,
    pub listeners: bool,
    /// Whether another publisher sends commands to the arm.
    pub rival: bool,
}

/// A joint state that the next cycle will process. Its numbers are in the arm's `positions` and `velocities`.
#[derive(Serialize, Deserialize)]
struct Newest {
    now: Duration,
    has_velocities: bool,
    stamp_age: Option<Duration>,
}

/// A robot that has just appeared, and whose speed is not known yet.
#[derive(Serialize, Deserialize)]
struct Newcomer {
    since: Duration,
    /// The positions at the time `since` \[rad, prismatic: m\].
    positions: Vec<f64>,
    /// The mean velocities measured up to the time `since` [rad/s, prismatic: m/s]; `None` if there are no earlier positions to
    /// compare with.
    velocity: Option<Vec<f64>>,
}

impl ArmLink {
    /// Creates the link to an arm. `order` has the names of the arm's joints, `kinds` has their kinds, and `joints` has their
    /// indices among the joints of all arms. `period` is the control period.
    pub fn new(order: JointOrder, kinds: Vec<JointKind>, joints: Range<usize>, period: Duration) -> Self {
        let zeros = vec![0.0; joints.len()];
        Self {
            order,
            sources: Arbiter::default(),
            parts: Parts::default(),
            newest: None,
            positions: zeros.clone(),
            asked: zeros.clone(),
            means: zeros.clone(),
            velocities: zeros,
            places: vec![0; joints.len()],
            received: None,
            measured_at: Duration::ZERO,
            figures: ArmFigures::default(),
            returned: None,
            rarity: Rarity::default(),
            told_factor: None,
            newcomer: None,
            blind_since: None,
            came: false,
            latency: Latency::new(joints.len(), period),
            lateness: Lateness::default(),
            samples: Samples::new(joints.clone()),
            following: TrackingMonitor::new(joints.clone()),
            pull: Pull::new(joints.len()),
            listeners: true,
            rival: false,
            joints,
            kinds,
        }
    }

    /// Returns the arm's joint names, and their indices among the joints of all arms.
    pub fn order(&self) -> (JointOrder, Range<usize>) {
        (self.order.clone(), self.joints.clone())
    }

    /// Takes a joint state received at `now`, as [`Link::take`](crate::Link::take) does.
    pub fn take(
        &mut self,
        reading: &JointReading,
        now: Duration,
        silence: Duration,
    ) -> Result<bool, StateError> {
        // A message that has none of this arm's joints does not count as a message of another publisher.
        match self.order.locate(reading.names, reading.positions, &mut self.places) {
            Err(StateError::MissingJoint { .. }) if self.order.has_any_of(reading.names) => {
                return self.take_part(reading, now, silence);
            }
            located => located?,
        }
        self.parts.clear();
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

    /// Takes a message with some of the arm's joints. A joint state is complete when each joint has a reading that is newer than
    /// the last complete joint state. Returns an error if some joint has no reading within the last `silence`.
    fn take_part(
        &mut self,
        reading: &JointReading,
        now: Duration,
        silence: Duration,
    ) -> Result<bool, StateError> {
        if self.parts.is_of_another(&self.order, reading, now, silence) {
            return Ok(self.sources.hear(reading.source, now, silence));
        }
        self.parts.take(&self.order, reading, now)?;
        if let Some(joint) = self.parts.missing(now, silence) {
            return Err(StateError::missing(&self.order.names()[joint], reading.names));
        }
        let Some(parts) = self.parts.whole() else { return Ok(true) };
        // All parts count as messages of the publisher of the first joint.
        if let Some(first) = parts.clone().next()
            && !self.sources.hear(first.source, now, silence)
        {
            return Ok(false);
        }
        let has_velocities = parts.clone().all(|part| part.velocity.is_some());
        let stamp_age =
            parts.clone().try_fold(Duration::ZERO, |oldest, part| Some(oldest.max(part.age(now)?)));
        for ((position, velocity), part) in self.positions.iter_mut().zip(&mut self.velocities).zip(parts) {
            (*position, *velocity) = (part.position, part.velocity.unwrap_or(0.0));
        }
        self.newest = Some(Newest { now, has_velocities, stamp_age });
        Ok(true)
    }

    /// Copies the values of the arm's joints from the `values` of a message.
    fn pick(&mut self, values: &[f64], slots: impl Fn(&mut Self) -> &mut Vec<f64>) {
        for joint in 0..self.places.len() {
            let value = values[self.places[joint]];
            slots(self)[joint] = value;
        }
    }

    /// Processes the joint state that has arrived since the last cycle, and updates the arm's part of `measured` and `velocity`. These
    /// two lists have one number per joint of all arms. `is_known` is whether the states of all arms were known in the last cycle.
    pub fn advance(
        &mut self,
        settings: &LinkSettings,
        measured: &mut [f64],
        velocity: &mut [f64],
        history: &CommandHistory,
        is_known: bool,
    ) {
        // Until the states of all arms are known, nothing is sent. The first command then begins at the speed of every arm.
        let waits = self.came && !is_known;
        (self.returned, self.came) = (None, waits);
        let Some(Newest { now, has_velocities, stamp_age }) = self.newest.take() else { return };
        if let Some(before) = self.received {
            self.rarity.hear(now.saturating_sub(before), settings.state_timeout);
        }
        let (measured, velocity) = (&mut measured[self.joints.clone()], &mut velocity[self.joints.clone()]);
        let lately = self.received.unwrap_or(now).saturating_sub(LATELY);
        history.travel(self.joints.clone(), lately, now, &mut self.asked);
        let step = Step {
            commanded: &self.asked,
            before: self.received,
            now,
            from: measured,
            to: &self.positions,
            speeds: &settings.limits.joint_velocity[self.joints.clone()],
            kinds: &self.kinds,
            first_joint: self.joints.start + 1,
        };
        let returned = step.returned(settings.rearm_timeout);
        self.came = returned.is_some_and(|it| it.is_of_newcomer()) || self.blind_since.is_some();
        if self.came {
            let made = stamp_age.filter(|_| self.latency.is_stamped()).map(|age| now.saturating_sub(age));
            let is_old = made.is_some_and(|made| self.blind_since.is_some_and(|since| made < since));
            self.came = !is_old && self.find_velocity(now, has_velocities, settings.state_timeout, velocity);
            if !self.came {
                return;
            }
        } else {
            self.follow_velocity(has_velocities, now, measured, velocity);
        }
        self.blind_since = None;
        if returned.is_some() {
            self.samples.clear();
            self.following = TrackingMonitor::new(self.joints.clone());
            self.pull.forget();
        }
        let was_stamped = self.latency.is_stamped();
        let age = self.latency.hear(now, self.received, stamp_age);
        let times = self.measured_at..now.saturating_sub(age);
        if self.latency.is_stamped() != was_stamped {
            // The samples have times of the earlier clock.
            self.samples.clear();
        }
        if self.came {
            // For a part of the time since the last state, the robot stood because of its own timeout.
            self.pull.compared = None;
        } else if self.received.is_some() && returned.is_none() {
            self.watch_pull(times.clone(), measured, settings, history);
        }
        measured.copy_from_slice(&self.positions);
        (self.received, self.measured_at) = (Some(now), times.end);
        self.watch(now, measured, settings.latency, history);
        self.returned = returned;
        self.came |= waits;
    }

    /// Computes the [`ArmFigures`] of the cycle at `now`. `fixed` is the latency that a parameter sets, or `None` to use the
    /// estimated latency. `cycles` has the lateness of the cycles.
    pub fn sum_up(&mut self, now: Duration, fixed: Option<Duration>, cycles: &Cycles) {
        let due = self.received.unwrap_or(now) + seconds(self.latency.interval());
        self.lateness.note(now, now.saturating_sub(due));
        let age = self.received.unwrap_or_default().saturating_sub(self.measured_at);
        let latency = fixed.unwrap_or_else(|| seconds(self.latency.total()));
        let contact = match &self.following {
            _ if self.rival => Contact::Contended,
            _ if !self.listeners => Contact::Nobody,
            it if it.must_rest() => Contact::Resting,
            it if it.is_lost() => Contact::Lost,
            it if it.is_seen() => Contact::Following,
            _ => Contact::Unseen,
        };
        self.figures = ArmFigures {
            lag: fixed.unwrap_or_else(|| age + seconds(self.latency.response())),
            delay: latency + seconds(self.latency.interval()),
            lateness: cycles.latest().max(self.lateness.worst()),
            cycle: cycles.slowest(),
            contact,
            factor: match self.told_factor {
                Some((factor, told)) if now.saturating_sub(told) <= TOLD => factor,
                _ => self.following.factor(),
            },
            came: self.came,
        };
    }

    /// Sets `velocity` to the present joint velocities of this arm [rad/s, prismatic: m/s].
    ///
    /// - If the robot reports velocities, uses these, or 0 if all of them are below [`STANDSTILL`].
    /// - Otherwise, computes the velocities from the last two joint states, or uses 0 if these are less than [`TWO_STATES`] apart.
    fn follow_velocity(&self, has_velocities: bool, now: Duration, measured: &[f64], velocity: &mut [f64]) {
        let moves = has_velocities && self.velocities.iter().any(|speed| speed.abs() >= STANDSTILL);
        let passed = now.saturating_sub(self.received.unwrap_or(now));
        match () {
            () if moves => velocity.copy_from_slice(&self.velocities),
            () if has_velocities || passed < TWO_STATES => velocity.fill(0.0),
            () => self.rates(measured, passed.as_secs_f64(), velocity),
        }
    }

    /// Sets `velocity` to the joint velocities after a robot has appeared, or after missed cycles [rad/s, prismatic: m/s]. Returns
    /// false if this needs another joint state.
    ///
    /// The first joint states may be old, so the link determines each velocity twice: from the change of the position, and from the
    /// reported velocity or an earlier change of the position. It uses the smaller result, or 0 if the two have different signs.
    fn find_velocity(
        &mut self,
        now: Duration,
        has_velocities: bool,
        state_timeout: Duration,
        velocity: &mut [f64],
    ) -> bool {
        velocity.fill(0.0);
        if has_velocities && self.velocities.iter().all(|speed| speed.abs() < STANDSTILL) {
            self.newcomer = None;
            return true;
        }
        let time = self.newcomer.as_ref().map_or(Duration::MAX, |it| now.saturating_sub(it.since));
        if time < TWO_STATES {
            return false;
        }
        let newcomer = self.newcomer.take().filter(|_| time <= TWO_STATES + state_timeout);
        let measured = newcomer.as_ref().map(|it| {
            let mut rates = vec![0.0; self.positions.len()];
            self.rates(&it.positions, time.as_secs_f64(), &mut rates);
            rates
        });
        let other = match has_velocities {
            true => Some(self.velocities.clone()),
            false => newcomer.and_then(|it| it.velocity),
        };
        if let (Some(measured), Some(other)) = (&measured, other) {
            for ((slot, one), other) in velocity.iter_mut().zip(measured).zip(other) {
                let agrees = one * other > 0.0 && one.abs() >= STANDSTILL;
                *slot = if agrees { one.signum() * one.abs().min(other.abs()) } else { 0.0 };
            }
            return true;
        }
        self.newcomer = Some(Newcomer { since: now, positions: self.positions.clone(), velocity: measured });
        false
    }

    /// Sets `rates` to the mean joint velocities [rad/s, prismatic: m/s] of a motion that took `time` \[s\], from the positions
    /// `from` to the present positions.
    fn rates(&self, from: &[f64], time: f64, rates: &mut [f64]) {
        let pairs = from.iter().zip(&self.positions).zip(&self.kinds);
        rates
            .iter_mut()
            .zip(pairs)
            .for_each(|(rate, ((from, to), kind))| *rate = kind.displacement(*from, *to) / time);
    }

    /// Updates the estimated [`Pull`]: compares the arm's displacement during `time` with the commands that caused it. `measured`
    /// has the positions at the start of `time`. The arm's present positions are those at the end of `time`.
    fn watch_pull(
        &mut self,
        time: Range<Duration>,
        measured: &[f64],
        settings: &LinkSettings,
        history: &CommandHistory,
    ) {
        let (joints, passed) = (self.joints.clone(), time.end.saturating_sub(time.start));
        let response = settings.latency.unwrap_or_else(|| seconds(self.latency.response()));
        let [from_then, to_then] = [time.start, time.end].map(|time| time.saturating_sub(response));
        // Starts where the last comparison ended, so that a change of the estimated delay skips no command.
        let from_then = self.pull.compared.replace(to_then).unwrap_or(from_then);
        let lately = LATELY.as_secs_f64();
        history.travel(joints.clone(), to_then.saturating_sub(LATELY), to_then, &mut self.asked);
        let means = self.asked.iter().map(|asked| asked / lately);
        self.means.clear();
        self.means.extend(means);
        history.travel(joints.clone(), from_then, to_then, &mut self.asked);
        let factor = self.figures.factor;
        let moved = self.kinds.iter().zip(measured.iter().zip(&self.positions));
        let moved = moved.map(|(kind, (from, to))| kind.displacement(*from, *to));
        let observed = moved.zip(&self.asked).zip(&self.means).map(|((moved, asked), mean)| Observed {
            moved,
            asked: *asked,
            change: asked / passed.as_secs_f64().max(f64::MIN_POSITIVE) - mean,
        });
        let rate = observed_at(settings.integral, self.figures.delay.as_secs_f64());
        self.pull.observe(observed, (passed, factor), rate, &settings.limits.joint_velocity[joints]);
    }

    /// Updates `hold`, the part of the arm's command that balances a payload or gravity, as [`Link::balance`](crate::Link::balance)
    /// does. `proven` is the part of `hold` to which the joints have responded.
    pub fn balance(&mut self, what: Hold, room: &Room, proven: &mut [f64], hold: &mut [f64]) {
        let rests = self.following.must_rest() || !self.listeners || self.rival;
        let first = self.joints.start;
        let probe = |joint| self.following.probe(joint, room.limits.joint_acceleration[first + joint]);
        for (joint, (proven, hold)) in proven.iter_mut().zip(&*hold).enumerate() {
            *proven = match probe(joint) {
                _ if rests => 0.0,
                f64::INFINITY => *hold,
                // The proven part is never more than the hold: a hold that has ended proves nothing for the next hold.
                _ => proven.max(hold.min(0.0)).min(hold.max(0.0)),
            };
        }
        let within = |joint| (proven[joint] - probe(joint), proven[joint] + probe(joint));
        self.pull.balance(if rests { Hold::Nothing } else { what }, room, first, within, hold);
    }

    /// Compares the arm's motion with its commands. `fixed` is the latency that a parameter sets, or `None` to use the estimated
    /// response time.
    fn watch(&mut self, now: Duration, measured: &[f64], fixed: Option<Duration>, history: &CommandHistory) {
        let response = |latency: &Latency| fixed.unwrap_or_else(|| seconds(latency.response()));
        let answer = (response(&self.latency), self.pull.speeds());
        self.following.watch_responses(now, measured, &self.kinds, history, answer);
        if !self.samples.add(self.measured_at, measured, &self.kinds) {
            return;
        }
        if let Some(motion) = self.samples.displacement() {
            self.latency.compare(&motion, history);
            let answer = (response(&self.latency), self.pull.speeds());
            self.following.watch_motion(now, &motion, history, answer);
        }
    }
}
