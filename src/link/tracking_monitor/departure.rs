//! Checks that each joint of an arm responds to its commands when it starts to move.
//!
//! A pull moves a joint at a constant speed, whatever its command is. So the change of its motion counts: a joint that responds moves by
//! Y = Δθ − v₀ Δt if its command asks it to move by X = ∫u dt − u₀ Δt, where u₀ and v₀ are its command and speed before.

use crate::command_history::CommandHistory;
use crate::comparison::Comparison;
use dq_kinematics::arm::JointKind;
use serde::{Deserialize, Serialize};
use std::mem;
use std::ops::Range;
use std::time::Duration;

/// A joint follows if it moves at least this fraction of the distance that the other joints would move for its command.
pub(super) const PART: f64 = 0.2;

/// A robot that moves less than this fraction of the commanded distance does not obey at all. One that moves more was told to be slow.
pub(super) const SLOWEST: f64 = 0.02;

/// A joint that moves this many times as far as commanded does not obey.
pub(super) const MUCH_TOO_FAR: f64 = 5.0;

/// Until a joint is seen to respond, its command changes by no more than this [rad/s], and by no more than its acceleration gives in
/// [`PROBE_ACCELERATION`] \[s\]: the joint makes this change in one step if it begins to respond only then.
const PROBE_SPEED: f64 = 0.05;
const PROBE_ACCELERATION: f64 = 0.01;

/// A joint that moved this far \[rad\] as commanded responds. Encoder noise at standstill is less.
const SEEN: f64 = 2e-4;

/// A joint does not follow if it has not responded for `PATIENCE` after it was commanded to move by [`PROBE_DISTANCE`], or when it has been
/// commanded to move by `LONGEST_PROBE` \[rad\].
const PATIENCE: Duration = Duration::from_millis(400);
const LONGEST_PROBE: f64 = 0.02;

/// The distance \[rad\] that must be commanded before a joint is judged not to respond.
pub(super) const PROBE_DISTANCE: f64 = 2e-3;

/// A joint that has responded counts as stuck if it does not move for this time plus the delay, after a command to move
/// [`PROBE_DISTANCE`].
const STANDSTILL: Duration = Duration::from_millis(150);

/// Above this speed [rad/s, prismatic: m/s] the monitor compares a joint that has responded with its commands themselves.
const SLOW: f64 = 0.1;

/// The change of a slow joint's travel \[rad, prismatic: m\] that must be commanded before the joint is judged to have stopped responding.
const SLOW_DISTANCE: f64 = 0.01;

/// Largest error of the measured speed before [rad/s, prismatic: m/s]: one count of 8192 per turn, forth and back in a window.
const NOISE: f64 = 0.02;

/// The motion of a joint without commands is compared over this last time only.
const MEMORY: Duration = Duration::from_secs(1);

/// Returns the largest change [rad/s] of the command of a joint with this acceleration limit [rad/s²] that has not responded yet.
fn probe_speed(acceleration: f64) -> f64 {
    PROBE_SPEED.min(PROBE_ACCELERATION * acceleration)
}

/// Returns how far a joint should have moved that was commanded to move by `asked` \[rad, prismatic: m\], of which the pull takes `pulled`. The
/// estimated pull excuses a joint that moves less, but never demands motion.
pub(super) fn due(asked: f64, pulled: f64) -> f64 {
    let left = if asked * pulled > 0.0 { (asked.abs() - pulled.abs()).max(0.0) } else { asked.abs() };
    left.copysign(asked)
}

/// A joint that does not respond.
pub(super) struct Failure {
    /// The joint, counted from 0.
    pub joint: usize,
    /// When it should have moved.
    pub since: Duration,
    /// Whether it stopped following, or moves in the other direction. Such a joint is retried only a few times.
    pub counts: bool,
}

/// The estimates of how the arm responds.
pub(super) struct Answer<'a> {
    /// The fraction of its commanded distance that it moves.
    pub factor: f64,
    /// The time from a command to the state of the robot that shows it.
    pub response: Duration,
    /// The pull at each joint [rad/s, prismatic: m/s].
    pub pull: &'a [f64],
}

/// A time from which the motion of a joint is compared with its commands.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct Anchor {
    time: Duration,
    /// The commanded and the measured displacement of the joint until then \[rad, prismatic: m\].
    asked: f64,
    moved: f64,
    /// Its command and its speed at that time [rad/s, prismatic: m/s].
    command: f64,
    speed: f64,
}

impl Anchor {
    /// Returns the change of the commanded and of the measured motion since this anchor (X and Y above) \[rad, prismatic: m\].
    fn changes(&self, now: &Self) -> (f64, f64) {
        let passed = now.time.saturating_sub(self.time).as_secs_f64();
        (now.asked - self.asked - passed * self.command, now.moved - self.moved - passed * self.speed)
    }
}

/// The recent motion of one joint.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct JointResponse {
    /// Whether it has responded.
    seen: bool,
    /// When it should have responded.
    due: Option<Duration>,
    /// Its last position \[rad, prismatic: m\].
    position: f64,
    now: Anchor,
    /// An anchor at which the arm stood, and a later one.
    stood: Anchor,
    later: Anchor,
    /// When a joint that has responded got stuck.
    stands_since: Option<Duration>,
    /// How far it should have moved since it last moved, how far it has, and the range of its distances \[rad, prismatic: m\].
    due_distance: f64,
    distance: f64,
    range: (f64, f64),
}

/// The responses of the joints of one arm since it stood.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Departure {
    /// The indices of its joints among all.
    joints: Range<usize>,
    responses: Vec<JointResponse>,
    begun: bool,
    asked: Vec<f64>,
}

impl Departure {
    /// Creates the monitor of the arm whose joints have the indices `joints` among all.
    pub fn new(joints: Range<usize>) -> Self {
        let count = joints.len();
        Self {
            responses: vec![JointResponse::default(); count],
            asked: vec![0.0; count],
            begun: false,
            joints,
        }
    }

    /// Forgets the responses, because the arm stands.
    pub fn forget(&mut self) {
        self.responses.iter_mut().for_each(JointResponse::begin);
    }

    /// Forgets the responses of joints that the hold moved, because the arm goes on standing.
    pub fn rest(&mut self) {
        self.responses.iter_mut().filter(|it| it.seen).for_each(JointResponse::begin);
    }

    /// The arm is commanded to move from now on.
    pub fn begin(&mut self) {
        self.responses.iter_mut().filter(|it| it.due.is_none()).for_each(JointResponse::begin);
    }

    /// Yields for each joint whether it was seen to respond.
    pub fn seen(&self) -> impl Iterator<Item = bool> + Clone + '_ {
        self.responses.iter().map(|it| it.seen)
    }

    /// Returns the largest change of the command of joint `joint` with this `acceleration` limit [rad/s²]; infinity once it has responded.
    pub fn probe(&self, joint: usize, acceleration: f64) -> f64 {
        if self.responses[joint].seen { f64::INFINITY } else { probe_speed(acceleration) }
    }

    /// Takes each joint's command and speed in the last window [rad/s, prismatic: m/s].
    pub fn note_speeds(&mut self, speeds: impl Iterator<Item = (f64, f64)>) {
        for (it, (command, speed)) in self.responses.iter_mut().zip(speeds) {
            (it.now.command, it.now.speed) = (command, speed);
        }
    }

    /// Updates which joints respond; they are at `positions` \[rad, prismatic: m\] at `now`. Returns the first one that has failed for too long.
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

    /// Notes the positions and the commanded displacements of the joints.
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
            // From state to state, because a turn by more than half would be ambiguous.
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
    /// Starts again: the joint has not responded yet.
    fn begin(&mut self) {
        (self.seen, self.due, self.stood, self.later) = (false, None, self.now, self.now);
    }

    /// Notes that the joint moved as commanded.
    fn follow(&mut self) {
        (self.due_distance, self.distance, self.range) = (0.0, 0.0, (0.0, 0.0));
    }

    /// Returns when the joint got stuck, if it has responded before and stands although it is commanded to move.
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

    /// Returns when the joint should have responded and whether it moves backwards, if it has failed for too long. The arm moves the fraction
    /// `factor` of its commanded distance.
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
        // The pull may have changed, so the motion is compared with a later anchor too, and with the next one if that shows no response.
        if is_late || self.due.is_none() {
            self.later = self.now;
        }
        let since = *self.due.get_or_insert(now);
        let is_over = now.saturating_sub(since) >= PATIENCE || (!self.seen && asked.abs() >= LONGEST_PROBE);
        is_over.then_some((since, moved * asked.signum() <= -PART * asked.abs()))
    }

    /// Moves the anchors on if the joint has had no command for long.
    fn wait(&mut self, now: Duration) {
        if self.due.take().is_some() {
            self.later = self.now;
        }
        if now.saturating_sub(self.later.time) >= MEMORY {
            (self.stood, self.later) = (self.later, self.now);
        }
    }
}
