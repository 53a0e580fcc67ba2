//! Checks that each joint of an arm responds to its commands when it starts to move.
//!
//! A payload or gravity changes the speed of a joint by a constant amount (the pull), whatever the joint's command is. So the
//! monitor compares only changes since an earlier time, the anchor. Let u₀ and v₀ be a joint's command and speed at the anchor. In
//! the time Δt since then, the joint has moved by Δθ under the command u. The command has demanded the change X = ∫u dt − u₀ Δt,
//! and the joint has made the change Y = Δθ − v₀ Δt. A joint responds if Y follows X.

use crate::command_history::CommandHistory;
use crate::comparison::Comparison;
use dq_kinematics::arm::JointKind;
use serde::{Deserialize, Serialize};
use std::mem;
use std::ops::Range;
use std::time::Duration;

/// Each joint moves a fraction of its commanded distance. A joint follows if its fraction is at least `PART` times the fraction of
/// the arm's other joints.
pub(super) const PART: f64 = 0.2;

/// The least fraction of the commanded distance that a robot moves if it obeys at all. A robot that moves at least this fraction,
/// but not the whole distance, has a reduced speed scaling.
pub(super) const SLOWEST: f64 = 0.02;

/// A joint that moves this many times as far as commanded does not obey.
pub(super) const MUCH_TOO_FAR: f64 = 5.0;

/// Until a joint has responded, its command changes by at most `PROBE_SPEED` [rad/s, prismatic: m/s], and by at most its
/// acceleration limit times `PROBE_TIME` \[s\]. When the joint responds at last, it makes the whole change in one jump, so the change
/// must be small.
const PROBE_SPEED: f64 = 0.05;
const PROBE_TIME: f64 = 0.01;

/// How far a joint must move in the commanded direction to count as having responded \[rad, prismatic: m\]. Encoder noise at
/// standstill is smaller.
const SEEN: f64 = 2e-4;

/// A joint counts as not following in two cases. Either it has not responded within `PATIENCE` after it should have moved by
/// [`PROBE_DISTANCE`], or it has not responded to commands to move by `LONGEST_PROBE` \[rad, prismatic: m\].
const PATIENCE: Duration = Duration::from_millis(400);
const LONGEST_PROBE: f64 = 0.02;

/// The least commanded distance after which the monitor may conclude that a joint does not respond \[rad, prismatic: m\].
pub(super) const PROBE_DISTANCE: f64 = 2e-3;

/// A joint that has responded before counts as stuck if it stands for this long plus the response time. The time starts when the
/// joint should have moved by [`PROBE_DISTANCE`].
const STANDSTILL: Duration = Duration::from_millis(150);

/// From this speed on [rad/s, prismatic: m/s], a joint that has responded is no longer judged by this module.
/// `TrackingMonitor::watch_motion` then compares the joint's whole motion with its commands.
const SLOW: f64 = 0.1;

/// The monitor judges whether a slow joint has stopped responding only after its commands have demanded at least this change X
/// \[rad, prismatic: m\]. The documentation of the module defines X.
const SLOW_DISTANCE: f64 = 0.01;

/// Largest assumed error of the measured speed at an anchor [rad/s, prismatic: m/s]. It covers one count of an encoder with 8192
/// counts per turn in the window in which the speed is measured.
const NOISE: f64 = 0.02;

/// The least age at which the monitor replaces the [`Anchor`]s of a joint that is not commanded to move.
const MEMORY: Duration = Duration::from_secs(1);

/// Returns the largest change of a joint's command before the joint has responded [rad/s, prismatic: m/s]. `acceleration` is the
/// joint's acceleration limit [rad/s², prismatic: m/s²].
fn probe_speed(acceleration: f64) -> f64 {
    PROBE_SPEED.min(PROBE_TIME * acceleration)
}

/// Returns the displacement that a joint should at least have made \[rad, prismatic: m\] after a command to move by `asked`.
///
/// `pulled` is the part of the command that a payload or gravity may have canceled. If `pulled` has the sign of `asked`, it reduces
/// the result. Otherwise it has no effect.
pub(super) fn due(asked: f64, pulled: f64) -> f64 {
    let left = if asked * pulled > 0.0 { (asked.abs() - pulled.abs()).max(0.0) } else { asked.abs() };
    left.copysign(asked)
}

/// A joint that does not respond to its commands.
pub(super) struct Failure {
    /// The joint, counted from 0.
    pub joint: usize,
    /// When the joint should have moved.
    pub since: Duration,
    /// Whether the joint stopped following, or moves against its commands. Such a joint is tried again only a few times.
    pub counts: bool,
}

/// The estimates of how the arm responds to its commands.
pub(super) struct Answer<'a> {
    /// The fraction of the commanded distance that the arm moves.
    pub factor: f64,
    /// The time from a command to the state of the robot that shows its effect.
    pub response: Duration,
    /// The speed that a payload or gravity takes from each joint [rad/s, prismatic: m/s].
    pub pull: &'a [f64],
}

/// The state of a joint at one time. From that time on, the monitor compares the joint's motion with its commands.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct Anchor {
    time: Duration,
    /// The commanded displacement of the joint up to this time \[rad, prismatic: m\].
    asked: f64,
    /// The measured displacement of the joint up to this time \[rad, prismatic: m\].
    moved: f64,
    /// The joint's command at this time [rad/s, prismatic: m/s].
    command: f64,
    /// The joint's speed at this time [rad/s, prismatic: m/s].
    speed: f64,
}

impl Anchor {
    /// Returns the changes X and Y from this anchor to `now` \[rad, prismatic: m\], as defined in the module's documentation.
    ///
    /// X is the commanded displacement minus `command` times the elapsed time. Y is the measured displacement minus `speed` times the
    /// elapsed time. Both `command` and `speed` are those of this anchor.
    fn changes(&self, now: &Self) -> (f64, f64) {
        let passed = now.time.saturating_sub(self.time).as_secs_f64();
        (now.asked - self.asked - passed * self.command, now.moved - self.moved - passed * self.speed)
    }
}

/// The recent motion of one joint.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct JointResponse {
    /// Whether the joint has responded.
    seen: bool,
    /// The time since which the joint should have responded; `None` if no response is due.
    due: Option<Duration>,
    /// The last position of the joint \[rad, prismatic: m\].
    position: f64,
    now: Anchor,
    /// The first anchor: the state when the check of the joint began, or a later state if the command has hardly changed since then.
    stood: Anchor,
    /// A later anchor than `stood`. The pull may change after `stood`, so motion that follows the commands since `later` also counts
    /// as a response.
    later: Anchor,
    /// The time since which a joint that has responded has been stuck; `None` if the joint is not stuck.
    stands_since: Option<Duration>,
    /// How far the joint should have moved since it last moved as commanded \[rad, prismatic: m\].
    due_distance: f64,
    /// How far the joint has moved since it last moved as commanded \[rad, prismatic: m\].
    distance: f64,
    /// The range of the joint's displacement since the joint last moved as commanded \[rad, prismatic: m\].
    range: (f64, f64),
}

/// The responses of the joints of one arm since the arm last stood.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Departure {
    /// The indices of the arm's joints among the joints of all arms.
    joints: Range<usize>,
    responses: Vec<JointResponse>,
    begun: bool,
    asked: Vec<f64>,
}

impl Departure {
    /// Creates the monitor of an arm. `joints` are the indices of the arm's joints among the joints of all arms.
    pub fn new(joints: Range<usize>) -> Self {
        let count = joints.len();
        Self {
            responses: vec![JointResponse::default(); count],
            asked: vec![0.0; count],
            begun: false,
            joints,
        }
    }

    /// Forgets which joints have responded and which responses are due, because the arm stands.
    pub fn forget(&mut self) {
        self.responses.iter_mut().for_each(JointResponse::begin);
    }

    /// Restarts the check of each joint that has responded, because the arm is commanded to stand. At standstill, a joint can only
    /// have responded to a command that balances a payload or gravity. Joints that have not responded keep their state.
    pub fn rest(&mut self) {
        self.responses.iter_mut().filter(|it| it.seen).for_each(JointResponse::begin);
    }

    /// Begins to monitor the responses of the joints, because a command moves the arm from now on.
    pub fn begin(&mut self) {
        self.responses.iter_mut().filter(|it| it.due.is_none()).for_each(JointResponse::begin);
    }

    /// Yields, for each joint, whether it has responded.
    pub fn seen(&self) -> impl Iterator<Item = bool> + Clone + '_ {
        self.responses.iter().map(|it| it.seen)
    }

    /// Returns the largest allowed change of the command of joint number `joint` [rad/s, prismatic: m/s]; infinity after the joint
    /// has responded. `acceleration` is the joint's acceleration limit [rad/s², prismatic: m/s²].
    pub fn probe(&self, joint: usize, acceleration: f64) -> f64 {
        if self.responses[joint].seen { f64::INFINITY } else { probe_speed(acceleration) }
    }

    /// Stores the mean command and the mean measured speed of each joint in the last window [rad/s, prismatic: m/s].
    pub fn note_speeds(&mut self, speeds: impl Iterator<Item = (f64, f64)>) {
        for (it, (command, speed)) in self.responses.iter_mut().zip(speeds) {
            (it.now.command, it.now.speed) = (command, speed);
        }
    }

    /// Updates which joints respond. The joints are at `positions` \[rad, prismatic: m\] at `now`. Returns the first joint that has
    /// failed to respond for too long.
    pub fn watch(
        &mut self,
        now: Duration,
        positions: &[f64],
        kinds: &[JointKind],
        history: &CommandHistory,
        answer: &Answer,
    ) -> Option<Failure> {
        self.advance(now, positions, kinds, history, answer);
        let changes: Comparison = self.responses.iter().map(|it| it.stood.changes(&it.now)).collect();
        let factor = changes.factor().min(1.0);
        let mut failed = None;
        for (joint, it) in self.responses.iter_mut().enumerate() {
            let response = it.judge(now, factor, answer);
            let failure = it.stands(now, answer).map(|since| (since, true)).or(response);
            failed = failed.or(failure.map(|(since, counts)| Failure { joint, since, counts }));
        }
        failed
    }

    /// Updates the measured and the commanded displacement of each joint. The joints are at `positions` \[rad, prismatic: m\] at
    /// `now`.
    pub fn advance(
        &mut self,
        now: Duration,
        positions: &[f64],
        kinds: &[JointKind],
        history: &CommandHistory,
        answer: &Answer,
    ) {
        history.total(self.joints.clone(), now, &mut self.asked);
        let places = positions.iter().zip(kinds).zip(self.asked.iter().zip(answer.pull));
        for (it, ((position, kind), (asked, pull))) in self.responses.iter_mut().zip(places) {
            let last = mem::replace(&mut it.position, *position);
            // Adds up from state to state, because a displacement by more than half a turn is ambiguous.
            let moved = if self.begun { kind.displacement(last, *position) } else { 0.0 };
            let passed = now.saturating_sub(it.now.time).as_secs_f64();
            it.distance += moved;
            it.range = (it.range.0.min(it.distance), it.range.1.max(it.distance));
            it.due_distance += answer.factor * due(asked - it.now.asked, pull * passed);
            it.now = Anchor { time: now, asked: *asked, moved: it.now.moved + moved, ..it.now };
            if !self.begun {
                (it.stood, it.later) = (it.now, it.now);
            }
        }
        self.begun = true;
    }
}

impl JointResponse {
    /// Restarts the check of this joint, which then counts as a joint that has not responded yet.
    fn begin(&mut self) {
        (self.seen, self.due, self.stood, self.later) = (false, None, self.now, self.now);
    }

    /// Notes that the joint moved as commanded.
    fn follow(&mut self) {
        (self.due_distance, self.distance, self.range) = (0.0, 0.0, (0.0, 0.0));
    }

    /// Returns the time at which the joint got stuck: it has responded before, and now stands although it is commanded to move.
    /// Otherwise returns `None`.
    fn stands(&mut self, now: Duration, answer: &Answer) -> Option<Duration> {
        let asked = self.due_distance.abs();
        let moves = self.range.1 - self.range.0 >= SEEN + SLOWEST * asked;
        if moves || !self.seen {
            self.follow();
        }
        if moves || !self.seen || asked < PROBE_DISTANCE {
            self.stands_since = None;
            return None;
        }
        let since = *self.stands_since.get_or_insert(now);
        (now.saturating_sub(since) >= STANDSTILL + answer.response).then_some(since)
    }

    /// Checks whether the joint has failed to respond for too long. If so, returns the time at which the joint should have responded,
    /// and whether the joint moves backward. Otherwise returns `None`. `factor` is the fraction of its commanded distance that the
    /// whole arm moves.
    fn judge(&mut self, now: Duration, factor: f64, answer: &Answer) -> Option<(Duration, bool)> {
        let is_slow = self.now.command.abs().max(self.now.speed.abs()) < SLOW;
        let responds = |anchor: &Anchor, factor: f64| {
            let (asked, moved) = anchor.changes(&self.now);
            let (asked, moved) = (asked.abs(), moved * asked.signum());
            let most = MUCH_TOO_FAR * asked;
            factor >= SLOWEST && (SEEN.max(0.5 * PART * factor * asked)..=most).contains(&moved)
        };
        // The factor is known only relative to the time at which the arm stood.
        let is_late = self.due.is_some() && self.later.changes(&self.now).0.abs() >= PROBE_DISTANCE;
        let is_seen = responds(&self.stood, factor) || (is_late && responds(&self.later, 1.0));
        if is_seen || (self.seen && !is_slow) {
            self.begin();
            self.seen = true;
            return None;
        }
        let (asked, moved) = self.stood.changes(&self.now);
        let noise = NOISE * now.saturating_sub(self.stood.time).as_secs_f64();
        let enough = if self.seen { (SLOW_DISTANCE + noise) / answer.factor } else { PROBE_DISTANCE + noise };
        if asked.abs() < enough {
            self.wait(now);
            return None;
        }
        // The pull may have changed. So the motion is compared with a later anchor, too, and with a still later anchor if there is
        // no response.
        if is_late || self.due.is_none() {
            self.later = self.now;
        }
        let since = *self.due.get_or_insert(now);
        let is_over = now.saturating_sub(since) >= PATIENCE || (!self.seen && asked.abs() >= LONGEST_PROBE);
        is_over.then_some((since, moved * asked.signum() <= -PART * asked.abs()))
    }

    /// Replaces the anchors of a joint whose command has hardly changed since `stood`: `later` becomes `stood`, and the present state
    /// becomes `later`. This happens at most once per [`MEMORY`].
    fn wait(&mut self, now: Duration) {
        if self.due.take().is_some() {
            self.later = self.now;
        }
        if now.saturating_sub(self.later.time) >= MEMORY {
            (self.stood, self.later) = (self.later, self.now);
        }
    }
}
