//! Checks that each joint of an arm follows its commands. All joints may move at one common fraction of the commanded speed,
//! because a robot may be set to move slowly.

mod departure;

use crate::command_history::CommandHistory;
use crate::comparison::Comparison;
use crate::samples::Displacement;
use departure::{Answer, Departure, MUCH_TOO_FAR, PART, SLOWEST, due};
use dq_kinematics::arm::JointKind;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::time::Duration;

/// A joint is judged in a window only if it is commanded to move at least this far in the window \[rad, prismatic: m\].
const LEAST_DISTANCE: f64 = 0.01;

/// The monitor reports a joint that moves at least this many times as far as commanded.
const TOO_FAR: f64 = 2.0;

/// An arm that has stopped following `LOSSES` times within `LOSSES_WITHIN` has disobeyed too often. This revokes consent.
const LOSSES: usize = 3;
const LOSSES_WITHIN: Duration = Duration::from_secs(10);

/// The monitor compares the motion with the commands three times: at the estimated delay plus each of these times. For each joint,
/// the most favorable of the three results counts.
const SLACK: [Duration; 3] = [Duration::ZERO, Duration::from_millis(50), Duration::from_millis(100)];

/// How long a joint must fail to follow its commands before the monitor reports that the arm does not follow.
const PERSISTENCE: Duration = Duration::from_millis(50);

/// Commands below this speed are too small to show whether the arm follows [rad/s, prismatic: m/s].
const CREEP: f64 = 1e-3;

/// After this time without a command above [`CREEP`], the arm must respond again before it counts as following.
const REST: Duration = Duration::from_millis(300);

/// How long the servo sends zeros to an arm that does not follow, before it tries the arm again.
const RETRY: Duration = Duration::from_millis(500);

/// The monitor updates its estimate of [`TrackingMonitor::factor()`] only while the commanded motion is at least this many times the
/// motion that a payload or gravity takes away.
const PULLED: f64 = 4.0;

/// The weight of the newest comparison of motion with commands in the smoothed [`TrackingMonitor::factor()`].
const SMOOTHING: f64 = 0.05;

/// The fraction of its commanded distance that a joint has moved. The fraction depends on the assumed delay, so this type has the
/// smallest and the largest fraction over the delays of [`SLACK`].
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Part {
    largest: f64,
    smallest: f64,
    /// The joint's distance divided by its commanded distance, for the delay of [`SLACK`] at which this ratio is smallest. The
    /// commanded distance counts as at least [`LEAST_DISTANCE`].
    excess: f64,
    /// The fraction of their commanded distance that the arm's other joints have moved; −∞ if their commands were too small to tell.
    others: f64,
}

impl Part {
    const UNKNOWN: Self = Self {
        largest: f64::NEG_INFINITY,
        smallest: f64::INFINITY,
        excess: f64::INFINITY,
        others: f64::NEG_INFINITY,
    };

    /// Adds a comparison for one delay: the joint was commanded to move by `asked` and moved by `moved` \[rad, prismatic: m\].
    /// `all` is the comparison of all joints for that delay.
    fn note(&mut self, asked: f64, moved: f64, all: &Comparison) {
        self.excess = self.excess.min(moved.abs() / asked.abs().max(LEAST_DISTANCE));
        // A small distance proves nothing, so it counts as followed exactly.
        let part = if asked.abs() >= LEAST_DISTANCE { moved / asked } else { 1.0 };
        (self.largest, self.smallest) = (self.largest.max(part), self.smallest.min(part));
        let others = all.square - asked * asked;
        if others >= LEAST_DISTANCE * LEAST_DISTANCE {
            self.others = self.others.max((all.product - asked * moved) / others);
        }
    }

    /// Returns whether the joint moves much less than the other joints, or much too far. If the commands of the other joints were too
    /// small to tell, compares with the fraction `common` instead.
    fn is_lost(&self, common: f64) -> bool {
        let others = if self.others.is_finite() { self.others.min(1.0) } else { common };
        self.largest < PART * others || self.excess >= MUCH_TOO_FAR
    }
}

/// What the arm is commanded to do.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
enum Phase {
    /// The arm stands. Its next command begins a new motion.
    Standing,
    /// The arm is commanded to move. `fails_since` is the time since which a joint has not followed its commands; `None` while all
    /// joints follow their commands.
    Driven { fails_since: Option<Duration> },
    /// The servo has sent zeros since this time, because the arm does not follow.
    Lost { since: Duration },
}

/// How an arm disobeys its commands. Joints are counted from 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Disobedience {
    /// This joint has not followed its commands for this time.
    For(usize, Duration),
    /// The arm stopped following its commands too often. This joint is the latest one that did not follow.
    Again(usize),
}

/// Monitors whether one arm follows its commands.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct TrackingMonitor {
    phase: Phase,
    departure: Departure,
    /// When the arm last obeyed, and the joint that does not obey; `None` while all joints obey.
    disobeys: Option<(Duration, usize)>,
    commanded: Option<Duration>,
    asked: Vec<f64>,
    /// For each joint, the fraction of its commanded distance that it has moved in the last window.
    parts: Vec<Part>,
    /// The fraction of the commanded speed at which the robot moves.
    factor: f64,
    /// The times at which the arm stopped following, the latest time first.
    losses: [Option<Duration>; LOSSES],
    /// When a joint began to move too far, the joint's number (from 0), and its distance divided by the commanded distance. `None`
    /// while no joint moves too far.
    too_far: Option<(Duration, usize, f64)>,
}

impl TrackingMonitor {
    /// Creates the monitor of an arm. `joints` are the indices of the arm's joints among the joints of all arms.
    pub fn new(joints: Range<usize>) -> Self {
        let joint_count = joints.len();
        Self {
            phase: Phase::Standing,
            departure: Departure::new(joints),
            disobeys: None,
            commanded: None,
            asked: vec![0.0; joint_count],
            parts: vec![Part::UNKNOWN; joint_count],
            factor: 1.0,
            losses: [None; LOSSES],
            too_far: None,
        }
    }

    /// Makes the servo try the arm again at once, because of a new request.
    pub fn try_again(&mut self) {
        if matches!(self.phase, Phase::Lost { .. }) {
            self.stand();
        }
        // The disobedience concerned an earlier request.
        self.disobeys = self.disobeys.filter(|_| matches!(self.phase, Phase::Driven { .. }));
    }

    fn stand(&mut self) {
        self.phase = Phase::Standing;
        self.departure.forget();
    }

    /// Returns whether the arm is known not to follow.
    pub fn is_lost(&self) -> bool {
        self.disobeys.is_some()
    }

    /// Returns the joint that does not obey, counted from 0; `None` if all joints obey.
    pub fn lost(&self) -> Option<usize> {
        self.disobeys.map(|(_, joint)| joint)
    }

    /// Returns whether the servo must send zeros to the arm now.
    pub fn must_rest(&self) -> bool {
        matches!(self.phase, Phase::Lost { .. })
    }

    /// Returns whether some joint has responded since the arm last stood, and the arm is not known to disobey.
    pub fn is_seen(&self) -> bool {
        self.departure.seen().any(|seen| seen) && !self.is_lost()
    }

    /// Returns the fraction of the commanded speed at which the robot moves, at most 1.
    pub fn factor(&self) -> f64 {
        self.factor
    }

    /// Returns how the arm has disobeyed, if this revokes consent; otherwise `None`. Consent is revoked if the arm has disobeyed for
    /// longer than `timeout`, or too often.
    pub fn disobedience(&self, now: Duration, timeout: Duration) -> Option<Disobedience> {
        let (since, joint) = self.disobeys?;
        let time = now.saturating_sub(since);
        let [_, .., oldest] = self.losses;
        let keeps_losing = oldest.is_some_and(|oldest| now.saturating_sub(oldest) <= LOSSES_WITHIN);
        match () {
            () if keeps_losing && self.must_rest() => Some(Disobedience::Again(joint)),
            () if time > timeout => Some(Disobedience::For(joint, time)),
            () => None,
        }
    }

    /// Forgets the times at which the arm stopped following. Each such time counts for one revocation of consent only.
    pub fn tell(&mut self) {
        self.losses = [None; LOSSES];
    }

    /// Returns the joint that moves too far, counted from 0, and its distance divided by the commanded distance. Returns `None` if
    /// no joint moves too far.
    pub fn too_far(&self, now: Duration) -> Option<(usize, f64)> {
        let (since, joint, factor) = self.too_far?;
        (now.saturating_sub(since) >= PERSISTENCE).then_some((joint, factor))
    }

    /// Returns the largest allowed change of the command of joint number `joint` [rad/s, prismatic: m/s]; infinity after the joint
    /// has responded. `acceleration` is the joint's acceleration limit [rad/s², prismatic: m/s²].
    pub fn probe(&self, joint: usize, acceleration: f64) -> f64 {
        self.departure.probe(joint, acceleration)
    }

    /// Notes the `motion` commanded from `now` on: one speed per joint [rad/s, prismatic: m/s].
    pub fn command(&mut self, now: Duration, motion: impl Iterator<Item = f64>) {
        let mut motion = motion;
        if motion.any(|speed| speed.abs() > CREEP) {
            self.commanded = Some(now);
            if self.phase == Phase::Standing {
                self.phase = Phase::Driven { fails_since: None };
                self.departure.begin();
            }
            return;
        }
        let rests = self.commanded.is_none_or(|last| now.saturating_sub(last) >= REST);
        match self.phase {
            Phase::Lost { since } if now.saturating_sub(since) >= RETRY => self.stand(),
            Phase::Driven { .. } if rests => {
                (self.phase, self.too_far) = (Phase::Standing, None);
                self.departure.rest();
            }
            Phase::Standing => self.departure.rest(),
            _ => {}
        }
    }

    /// Updates which joints respond. The joints are at `positions` \[rad, prismatic: m\] at `now`. By the estimates, the arm
    /// responds after the time `response`, and a payload or gravity slows each joint by `pull` [rad/s, prismatic: m/s].
    pub fn watch_responses(
        &mut self,
        now: Duration,
        positions: &[f64],
        kinds: &[JointKind],
        history: &CommandHistory,
        (response, pull): (Duration, &[f64]),
    ) {
        let answer = Answer { factor: self.factor, response, pull };
        if self.must_rest() {
            return self.departure.advance(now, positions, kinds, history, &answer);
        }
        match self.departure.watch(now, positions, kinds, history, &answer) {
            Some(failure) => self.lose(failure.since, now, failure.joint, failure.counts),
            None => {
                let seen = |joint| self.departure.seen().nth(joint) == Some(true);
                self.disobeys = self.disobeys.filter(|(_, joint)| !seen(*joint));
            }
        }
    }

    /// Checks at `now` that an arm in motion still follows. The arm has moved by `motion`. By the estimates, the arm responds after
    /// the time `response`, and a payload or gravity slows each joint by `pull` [rad/s, prismatic: m/s].
    pub fn watch_motion(
        &mut self,
        now: Duration,
        motion: &Displacement,
        history: &CommandHistory,
        (response, pull): (Duration, &[f64]),
    ) {
        let seconds = motion.to.saturating_sub(motion.from).as_secs_f64();
        self.note_speeds(motion, history, response, seconds);
        let Phase::Driven { fails_since } = self.phase else { return };
        self.parts.fill(Part::UNKNOWN);
        let (mut factor, mut most) = (f64::NEG_INFINITY, 0.0_f64);
        for slack in SLACK {
            let before = |time: Duration| time.saturating_sub(response + slack);
            history.travel(motion.joints.clone(), before(motion.from), before(motion.to), &mut self.asked);
            self.asked.iter_mut().zip(pull).for_each(|(asked, pull)| *asked = due(*asked, seconds * pull));
            let joints = self.asked.iter().zip(motion.moved);
            let all: Comparison = joints.map(|(asked, moved)| (*asked, *moved)).collect();
            for ((part, asked), moved) in self.parts.iter_mut().zip(&self.asked).zip(motion.moved) {
                part.note(*asked, *moved, &all);
            }
            most = most.max(all.square);
            factor = factor.max(all.factor());
        }
        let common = factor.min(1.0);
        let is_judged = most >= LEAST_DISTANCE * LEAST_DISTANCE && self.is_seen();
        let pulled = pull.iter().map(|pull| (seconds * pull).powi(2)).sum::<f64>();
        if is_judged && common >= SLOWEST && most >= PULLED * PULLED * pulled {
            self.factor += SMOOTHING * (common - self.factor);
        }
        self.watch_excess(now);
        let fails = |(part, seen): (&Part, bool)| seen && (common < SLOWEST || part.is_lost(common));
        let failed = self.parts.iter().zip(self.departure.seen()).position(fails).filter(|_| is_judged);
        let fails_since = failed.map(|_| fails_since.unwrap_or(now));
        self.phase = Phase::Driven { fails_since };
        if let (Some(joint), Some(fails)) = (failed, fails_since)
            && now.saturating_sub(fails) >= PERSISTENCE
        {
            self.lose(fails, now, joint, true);
        }
    }

    /// Notes the commanded and the measured speeds of the joints.
    fn note_speeds(
        &mut self,
        motion: &Displacement,
        history: &CommandHistory,
        response: Duration,
        seconds: f64,
    ) {
        let before = |time: Duration| time.saturating_sub(response);
        history.travel(motion.joints.clone(), before(motion.from), before(motion.to), &mut self.asked);
        let distances = self.asked.iter().zip(motion.moved);
        self.departure.note_speeds(distances.map(|(asked, moved)| (asked / seconds, moved / seconds)));
    }

    /// Stores in `too_far` the joint whose distance exceeds the commanded distance by the largest factor, if this factor is at
    /// least [`TOO_FAR`].
    fn watch_excess(&mut self, now: Duration) {
        let parts = self.parts.iter().map(|part| part.smallest).enumerate();
        let farthest = parts.max_by(|(_, one), (_, other)| one.total_cmp(other));
        let since = self.too_far.map_or(now, |(since, ..)| since);
        self.too_far =
            farthest.filter(|(_, part)| *part >= TOO_FAR).map(|(joint, part)| (since, joint, part));
    }

    /// Makes the servo send zeros for the time [`RETRY`], because `joint` has not obeyed since `since`. If `counts` is true, this event
    /// counts toward the limit [`LOSSES`].
    fn lose(&mut self, since: Duration, now: Duration, joint: usize, counts: bool) {
        self.phase = Phase::Lost { since: now };
        self.disobeys = Some((self.disobeys.map_or(since, |(first, _)| first), joint));
        if counts {
            self.losses.rotate_right(1);
            self.losses[0] = Some(now);
        }
    }
}
