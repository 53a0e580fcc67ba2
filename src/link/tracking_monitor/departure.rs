//! Whether each joint of an arm that stands, or stood, responds to its commands.
//!
//! What pulls at a joint moves it at a constant speed, whatever it is commanded. So the change of its motion counts: a joint that responds
//! moves by Y = Δθ − v₀ Δt if its command asks it to move by X = ∫u dt − u₀ Δt, where u₀ and v₀ are command and speed before.

use crate::command_history::CommandHistory;
use crate::comparison::Comparison;
use dq_kinematics::arm::JointKind;
use serde::{Deserialize, Serialize};
use std::mem;
use std::ops::Range;
use std::time::Duration;

/// A joint follows that goes at least this part of the distance that the others go for it.
pub(super) const PART: f64 = 0.2;

/// A robot that goes less than this part of its commanded distance obeys no command; one that goes more was told to be slow.
pub(super) const SLOWEST: f64 = 0.02;

/// A joint that goes so many times as far as commanded obeys no command.
pub(super) const MUCH_TOO_FAR: f64 = 5.0;

/// Until a joint is seen to respond, its command changes by no more than this [rad/s], and by no more than its acceleration gives in
/// [`PROBE_ACCELERATION`] \[s\]: what the joint must take in one step if it begins to respond only then.
const PROBE_SPEED: f64 = 0.05;
const PROBE_ACCELERATION: f64 = 0.01;

/// A joint that moved this far \[rad\] as commanded responds: more than encoders make of a standstill.
const SEEN: f64 = 2e-4;

/// A joint that has not responded for this long after it was commanded to go [`PROBE_DISTANCE`], or this far \[rad\], does not follow.
const PATIENCE: Duration = Duration::from_millis(400);
const LONGEST_PROBE: f64 = 0.02;

/// The distance \[rad\] that must have been commanded before a joint can be said not to respond.
pub(super) const PROBE_DISTANCE: f64 = 2e-3;

/// A joint that was seen to respond stands if it does not move for this long, besides the delay, after it was commanded to go
/// [`PROBE_DISTANCE`].
const STANDSTILL: Duration = Duration::from_millis(150);

/// Faster than this [rad/s, prismatic: m/s] a joint that was seen to respond is compared with its commands themselves.
const SLOW: f64 = 0.1;

/// The change of a slow joint's way \[rad, prismatic: m\] that must have been commanded before it can be said not to respond any more.
const SLOW_DISTANCE: f64 = 0.01;

/// The speed before is measured with this error at most [rad/s, prismatic: m/s]: one count of 8192 a turn, forth and back in a window.
const NOISE: f64 = 0.02;

/// A joint that was asked for nothing is compared with its last seconds only.
const MEMORY: Duration = Duration::from_secs(1);

/// The largest change [rad/s] of the command of a joint with this acceleration [rad/s²] that was not seen to respond.
fn probe_speed(acceleration: f64) -> f64 {
    PROBE_SPEED.min(PROBE_ACCELERATION * acceleration)
}

/// How far a joint should have moved that was asked to move by `asked`, of which the pull takes `pulled` \[rad, prismatic: m\]. An estimate of the pull
/// excuses a joint that moves less. It never asks one to move.
pub(super) fn due(asked: f64, pulled: f64) -> f64 {
    let left = if asked * pulled > 0.0 { (asked.abs() - pulled.abs()).max(0.0) } else { asked.abs() };
    left.copysign(asked)
}

/// A joint that does not respond.
pub(super) struct Failure {
    /// Counted from 0.
    pub joint: usize,
    /// Since when it should have been seen to move.
    pub since: Duration,
    /// Whether it has ceased to follow, or moves in the other direction: such a joint is not tried for ever.
    pub counts: bool,
}

/// What is known of the arm's answer to its commands.
pub(super) struct Answer<'a> {
    /// The part of its commanded distance that it moves.
    pub factor: f64,
    /// From a command to the state of the robot that shows it.
    pub response: Duration,
    /// What pulls at each joint [rad/s, prismatic: m/s].
    pub pull: &'a [f64],
}

/// A time with which the motion of a joint is compared.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct Anchor {
    time: Duration,
    /// How far its commands should have taken the joint, and how far it has moved \[rad, prismatic: m\].
    asked: f64,
    moved: f64,
    /// Its command and its speed then [rad/s, prismatic: m/s].
    command: f64,
    speed: f64,
}

impl Anchor {
    /// By how much the joint, which is at `now`, was asked to move besides, and did \[rad, prismatic: m\].
    fn changes(&self, now: &Self) -> (f64, f64) {
        let passed = now.time.saturating_sub(self.time).as_secs_f64();
        (now.asked - self.asked - passed * self.command, now.moved - self.moved - passed * self.speed)
    }
}

/// What one joint did.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct JointResponse {
    /// It was seen to respond.
    seen: bool,
    /// Since when it should have been seen to.
    due: Option<Duration>,
    /// Where it was last \[rad, prismatic: m\].
    position: f64,
    now: Anchor,
    /// When the arm stood, and a time since then.
    stood: Anchor,
    later: Anchor,
    /// Since when a joint that was seen to respond stands although it is commanded to move.
    stands_since: Option<Duration>,
    /// How far it should have moved since it last did, has moved, and between which distances it was \[rad, prismatic: m\].
    due_distance: f64,
    distance: f64,
    range: (f64, f64),
}

/// What the joints of one arm have done since it stood.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Departure {
    /// Its joints among all.
    joints: Range<usize>,
    responses: Vec<JointResponse>,
    begun: bool,
    asked: Vec<f64>,
}

impl Departure {
    /// Of the arm whose joints are `joints` of all.
    pub fn new(joints: Range<usize>) -> Self {
        let count = joints.len();
        Self {
            responses: vec![JointResponse::default(); count],
            asked: vec![0.0; count],
            begun: false,
            joints,
        }
    }

    /// The arm stands: no joint was seen to respond since.
    pub fn forget(&mut self) {
        self.responses.iter_mut().for_each(JointResponse::begin);
    }

    /// The arm goes on to stand: what held joints responded to is in the past.
    pub fn rest(&mut self) {
        self.responses.iter_mut().filter(|it| it.seen).for_each(JointResponse::begin);
    }

    /// The arm is commanded to move from now on.
    pub fn begin(&mut self) {
        self.responses.iter_mut().filter(|it| it.due.is_none()).for_each(JointResponse::begin);
    }

    /// Which joints were seen to respond.
    pub fn seen(&self) -> impl Iterator<Item = bool> + Clone + '_ {
        self.responses.iter().map(|it| it.seen)
    }

    /// The largest change of the command of joint `joint` of that `acceleration` [rad/s²]: any, once it was seen to respond.
    pub fn probe(&self, joint: usize, acceleration: f64) -> f64 {
        if self.responses[joint].seen { f64::INFINITY } else { probe_speed(acceleration) }
    }

    /// Takes the commands and speeds of the joints in the last window [rad/s, prismatic: m/s].
    pub fn note_speeds(&mut self, speeds: impl Iterator<Item = (f64, f64)>) {
        for (it, (command, speed)) in self.responses.iter_mut().zip(speeds) {
            (it.now.command, it.now.speed) = (command, speed);
        }
    }

    /// Looks which joints respond, and which do not: they are at `positions` \[rad, prismatic: m\] at `now`, and of these kinds. The first that
    /// has not for too long is returned.
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

    /// Notes where the joints are and how far they were commanded.
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
            // State by state, because more than half a turn is not seen at its ends.
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
    /// Was not seen to respond yet.
    fn begin(&mut self) {
        (self.seen, self.due, self.stood, self.later) = (false, None, self.now, self.now);
    }

    /// Was seen to move as it is commanded.
    fn follow(&mut self) {
        (self.due_distance, self.distance, self.range) = (0.0, 0.0, (0.0, 0.0));
    }

    /// Since when the joint, which was seen to respond, stands although it is commanded to move, if it does.
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

    /// Since when the joint should have responded and whether it goes back, if it has not for too long. The arm goes the part `factor` of its
    /// commanded distance.
    fn judge(&mut self, now: Duration, factor: f64, answer: &Answer) -> Option<(Duration, bool)> {
        let is_slow = self.now.command.abs().max(self.now.speed.abs()) < SLOW;
        let responds = |anchor: &Anchor, factor: f64| {
            let (asked, moved) = anchor.changes(&self.now);
            let (asked, moved) = (asked.abs(), moved * asked.signum());
            let most = MUCH_TOO_FAR * asked;
            factor >= SLOWEST && (SEEN.max(0.5 * PART * factor * asked)..=most).contains(&moved)
        };
        // Since a later time than when the arm stood the factor is not known.
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
        // What pulls at it may have changed: it is compared with a later time too, and with the next one where that shows no response.
        if is_late || self.due.is_none() {
            self.later = self.now;
        }
        let since = *self.due.get_or_insert(now);
        let is_over = now.saturating_sub(since) >= PATIENCE || (!self.seen && asked.abs() >= LONGEST_PROBE);
        is_over.then_some((since, moved * asked.signum() <= -PART * asked.abs()))
    }

    /// Goes on from a later time if the joint was asked for nothing for long.
    fn wait(&mut self, now: Duration) {
        if self.due.take().is_some() {
            self.later = self.now;
        }
        if now.saturating_sub(self.later.time) >= MEMORY {
            (self.stood, self.later) = (self.later, self.now);
        }
    }
}
