//! Whether the arm follows its commands.

use super::CommandHistory;
use super::samples::Displacement;
use super::way;
use crate::arm::JointKind;
use std::ops::Range;
use std::time::Duration;

/// Until it is seen to follow, the arm is driven no faster than this [rad/s], and no faster than its acceleration gives in
/// [`PROBE_ACCELERATION`] \[s\]: what it has to take in one step if it begins to follow only then.
const PROBE_SPEED: f64 = 0.05;
const PROBE_ACCELERATION: f64 = 0.01;

/// An arm that has moved so far \[rad\] as commanded follows: more than encoders make of a standstill.
const SEEN: f64 = 2e-4;

/// An arm follows that goes at least this part of the way.
const PART: f64 = 0.2;

/// An arm that has not begun to move within this time does not follow.
const PATIENCE: Duration = Duration::from_millis(400);

/// The way \[rad\] that must have been commanded before an arm can be said to follow or not: in a probe, in which each joint is judged
/// that has this share of the way, and within a window.
const PROBE_WAY: f64 = 2e-3;
const PROBE_SHARE: f64 = 0.1;
const WAY: f64 = 0.01;

/// A joint that goes so much farther than commanded is reported.
const TOO_FAR: f64 = 2.0;

/// An arm that has ceased to follow, or gone elsewhere when it was tried, so often within this time is not tried again.
const LOSSES: usize = 3;
const LOSSES_WITHIN: Duration = Duration::from_secs(10);

/// Commands may take effect so much later than estimated.
const SLACK: [Duration; 3] = [Duration::ZERO, Duration::from_millis(50), Duration::from_millis(100)];

/// The arm does not follow when it has not for so long.
const PERSISTENCE: Duration = Duration::from_millis(50);

/// Commands below this [rad/s] are too small to see whether they are followed.
const CREEP: f64 = 1e-3;

/// After so long without a command to be seen the arm must be seen to follow anew.
const REST: Duration = Duration::from_millis(300);

/// An arm that does not follow is tried again after so long.
const RETRY: Duration = Duration::from_secs(1);

/// The fastest that an arm with joints of these accelerations [rad/s²] may be driven while it has not been seen to follow [rad/s].
pub(super) fn probe_speed(accelerations: &[f64]) -> f64 {
    accelerations.iter().fold(PROBE_SPEED, |cap, most| cap.min(PROBE_ACCELERATION * most))
}

/// What is known of one arm.
#[derive(Clone, Debug, PartialEq)]
enum Phase {
    /// It stands: the next command is the first.
    Standing,
    /// It has been commanded since, and not been seen to move yet.
    Probing { since: Duration },
    /// It follows.
    Following { fails_since: Option<Duration> },
    /// It is not driven, since.
    Lost { since: Duration },
}

/// Watches one arm.
#[derive(Clone, Debug)]
pub(super) struct TrackingMonitor {
    phase: Phase,
    /// It did not follow when that was last seen.
    lost: bool,
    commanded: Option<Duration>,
    start: Vec<f64>,
    way: Vec<f64>,
    /// The largest and the smallest part of its way that each joint may have gone.
    parts: Vec<[f64; 2]>,
    /// When it last ceased to follow, newest first.
    losses: [Option<Duration>; LOSSES],
    keeps_losing: bool,
    /// Since when a joint goes too far, which one, and how many times as far as commanded.
    too_far: Option<(Duration, usize, f64)>,
}

impl TrackingMonitor {
    pub fn new(joint_count: usize) -> Self {
        let zeros = vec![0.0; joint_count];
        Self {
            phase: Phase::Standing,
            lost: false,
            commanded: None,
            start: zeros.clone(),
            way: zeros,
            parts: vec![[0.0; 2]; joint_count],
            losses: [None; LOSSES],
            keeps_losing: false,
            too_far: None,
        }
    }

    /// Tries at once, as for a new goal.
    pub fn try_again(&mut self) {
        if matches!(self.phase, Phase::Lost { .. }) {
            self.phase = Phase::Standing;
        }
    }

    /// Whether the arm does not follow, as far as is known.
    pub fn is_lost(&self) -> bool {
        self.lost
    }

    /// Whether it must not be commanded now.
    pub fn must_rest(&self) -> bool {
        matches!(self.phase, Phase::Lost { .. })
    }

    /// Whether it has just ceased to follow once too often; asked once.
    pub fn keeps_losing(&mut self) -> bool {
        std::mem::take(&mut self.keeps_losing)
    }

    /// The joint, counted from 0, that goes too far, and how many times as far as commanded.
    pub fn too_far(&self, now: Duration) -> Option<(usize, f64)> {
        let (since, joint, factor) = self.too_far?;
        (now.saturating_sub(since) >= PERSISTENCE).then_some((joint, factor))
    }

    /// Whether it has been seen to follow since it last stood.
    pub fn is_seen(&self) -> bool {
        matches!(self.phase, Phase::Following { .. })
    }

    /// Notes what the arm is commanded from `now` on, and where it is: `positions` \[rad\].
    pub fn command(&mut self, now: Duration, command: &[f64], positions: &[f64]) {
        if command.iter().any(|speed| speed.abs() > CREEP) {
            self.commanded = Some(now);
            if self.phase == Phase::Standing {
                self.phase = Phase::Probing { since: now };
                self.start.copy_from_slice(positions);
            }
            return;
        }
        let rests = self.commanded.is_none_or(|last| now.saturating_sub(last) >= REST);
        match self.phase {
            Phase::Lost { since } if now.saturating_sub(since) >= RETRY => self.phase = Phase::Standing,
            Phase::Probing { .. } | Phase::Following { .. } if rests => {
                (self.phase, self.too_far) = (Phase::Standing, None);
            }
            _ => {}
        }
    }

    /// Looks whether an arm that is tried has begun to move: its joints, `range` of all, are at `positions`
    /// \[rad, prismatic: m\] at `now`, and of these kinds.
    pub fn watch_start(
        &mut self,
        now: Duration,
        (positions, kinds): (&[f64], &[JointKind]),
        range: Range<usize>,
        commanded: &CommandHistory,
    ) {
        let Phase::Probing { since } = self.phase else { return };
        commanded.travel(range, since, now, &mut self.way);
        let asked = norm(&self.way);
        let moves = self.start.iter().zip(positions).zip(kinds);
        let moves = moves.map(|((from, to), kind)| way(*kind, *from, *to));
        let (mut along, mut least) = (0.0, f64::INFINITY);
        for (commanded, moved) in self.way.iter().zip(moves) {
            along += commanded * moved;
            if commanded.abs() >= PROBE_SHARE * asked {
                least = f64::min(least, moved / commanded);
            }
        }
        let moved = if asked > 0.0 { along / asked } else { 0.0 };
        if asked < PROBE_WAY {
            return;
        }
        if moved >= SEEN.max(0.5 * PART * asked) && least >= 0.5 * PART {
            (self.phase, self.lost) = (Phase::Following { fails_since: None }, false);
        } else if now.saturating_sub(since) >= PATIENCE {
            // One that goes the other way is not to be tried for ever.
            self.lose(now, least <= -PART);
        }
    }

    /// Looks at `now` whether an arm in motion goes on to follow: it has gone the way of `motion`, and answers after `response`.
    pub fn watch_motion(
        &mut self,
        now: Duration,
        motion: &Displacement,
        response: Duration,
        commanded: &CommandHistory,
    ) {
        let Phase::Following { fails_since } = self.phase else { return };
        self.parts.fill([f64::NEG_INFINITY, f64::INFINITY]);
        for slack in SLACK {
            let before = |time: Duration| time.saturating_sub(response + slack);
            commanded.travel(motion.joints.clone(), before(motion.from), before(motion.to), &mut self.way);
            for (([largest, smallest], way), moved) in self.parts.iter_mut().zip(&self.way).zip(motion.moved)
            {
                // Of a small way nothing can be said: it may have been followed, and not too far.
                let part = (way.abs() >= WAY).then(|| moved / way);
                (*largest, *smallest) = (largest.max(part.unwrap_or(1.0)), smallest.min(part.unwrap_or(1.0)));
            }
        }
        let fails = self.parts.iter().any(|[largest, _]| *largest < PART);
        let fails_since = fails.then(|| fails_since.unwrap_or(now));
        self.phase = Phase::Following { fails_since };
        self.watch_excess(now);
        if fails_since.is_some_and(|since| now.saturating_sub(since) >= PERSISTENCE) {
            self.lose(now, true);
        }
    }

    /// Notes the joint that goes farthest beyond its way.
    fn watch_excess(&mut self, now: Duration) {
        let parts = self.parts.iter().map(|[_, smallest]| *smallest).enumerate();
        let farthest = parts.max_by(|(_, one), (_, other)| one.total_cmp(other));
        let since = self.too_far.map_or(now, |(since, ..)| since);
        self.too_far =
            farthest.filter(|(_, part)| *part >= TOO_FAR).map(|(joint, part)| (since, joint, part));
    }

    /// Drives it no more for a while, nor again before somebody asks for it where a loss `counts` and is one too many.
    fn lose(&mut self, now: Duration, counts: bool) {
        (self.phase, self.lost) = (Phase::Lost { since: now }, true);
        if counts {
            self.losses.rotate_right(1);
            self.losses[0] = Some(now);
            let oldest = self.losses[LOSSES - 1];
            self.keeps_losing = oldest.is_some_and(|oldest| now.saturating_sub(oldest) <= LOSSES_WITHIN);
            if self.keeps_losing {
                self.losses = [None; LOSSES];
            }
        }
    }
}

fn norm(vector: &[f64]) -> f64 {
    vector.iter().map(|x| x * x).sum::<f64>().sqrt()
}
