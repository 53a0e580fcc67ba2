//! Whether each joint of an arm that stood begins to follow its commands.

use super::{MUCH_TOO_FAR, PART, SLOWEST};
use crate::command_history::CommandHistory;
use crate::comparison::Comparison;
use dq_kinematics::arm::JointKind;
use serde::{Deserialize, Serialize};
use std::mem;
use std::ops::Range;
use std::time::Duration;

/// Until it is seen to follow, a joint is driven no faster than this [rad/s], and no faster than its acceleration gives in
/// [`PROBE_ACCELERATION`] \[s\]: what it has to take in one step if it begins to follow only then.
const PROBE_SPEED: f64 = 0.05;
const PROBE_ACCELERATION: f64 = 0.01;

/// A joint that has moved so far \[rad\] as commanded follows: more than encoders make of a standstill.
const SEEN: f64 = 2e-4;

/// A joint that has not begun to move for so long after it was commanded to go [`PROBE_DISTANCE`], or so far \[rad\], does not follow.
const PATIENCE: Duration = Duration::from_millis(400);
const LONGEST_PROBE: f64 = 0.02;

/// The distance \[rad\] that must have been commanded from where a joint stood before it can be said not to follow.
const PROBE_DISTANCE: f64 = 2e-3;

/// The fastest that a joint of this acceleration [rad/s²] may be driven while it has not been seen to follow [rad/s].
fn probe_speed(acceleration: f64) -> f64 {
    PROBE_SPEED.min(PROBE_ACCELERATION * acceleration)
}

/// A joint that does not begin to move.
pub(super) struct Failure {
    /// Counted from 0.
    pub joint: usize,
    /// Since when it should have been seen to move.
    pub since: Duration,
    /// Whether it goes in the other direction.
    pub goes_back: bool,
}

/// What the joints of one arm have done since it stood.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Departure {
    /// Its joints among all.
    joints: Range<usize>,
    /// Which have been seen to follow, and since when each that has not was commanded to go far enough.
    seen: Vec<bool>,
    due: Vec<Option<Duration>>,
    /// How far all commands before should have taken each joint \[rad, prismatic: m\].
    before: Vec<f64>,
    /// How far each was commanded to go since, how far it has gone, and where it was last \[rad, prismatic: m\].
    asked: Vec<f64>,
    moved: Vec<f64>,
    last: Vec<f64>,
}

impl Departure {
    /// Of the arm whose joints are `joints` of all.
    pub fn new(joints: Range<usize>) -> Self {
        let zeros = vec![0.0; joints.len()];
        Self {
            seen: vec![false; joints.len()],
            due: vec![None; joints.len()],
            before: zeros.clone(),
            asked: zeros.clone(),
            moved: zeros.clone(),
            last: zeros,
            joints,
        }
    }

    /// The arm stands: no joint is seen to follow.
    pub fn forget(&mut self) {
        self.seen.fill(false);
        self.due.fill(None);
    }

    /// Its joints are commanded from `now` on, and are at `positions` \[rad, prismatic: m\].
    pub fn begin(&mut self, now: Duration, positions: &[f64], history: &CommandHistory) {
        history.total(self.joints.clone(), now, &mut self.before);
        self.moved.fill(0.0);
        self.last.copy_from_slice(positions);
    }

    /// Which joints have been seen to follow.
    pub fn seen(&self) -> &[bool] {
        &self.seen
    }

    /// The factor for `target` [rad/s] with which a joint of these `accelerations` [rad/s²] that was not seen to follow is driven gently.
    pub fn probing_factor(&self, target: &[f64], accelerations: &[f64]) -> f64 {
        let joints = target.iter().zip(accelerations).zip(&self.seen).filter(|(_, seen)| !**seen);
        joints.fold(1.0, |factor, ((speed, acceleration), _)| {
            factor.min(probe_speed(*acceleration) / speed.abs())
        })
    }

    /// Looks which joints have begun to move, and which has not: they are at `positions` \[rad, prismatic: m\] at `now`, and of these kinds.
    pub fn watch(
        &mut self,
        now: Duration,
        positions: &[f64],
        kinds: &[JointKind],
        history: &CommandHistory,
    ) -> Option<Failure> {
        if self.seen.iter().all(|seen| *seen) {
            return None;
        }
        self.advance(now, positions, kinds, history);
        let joints = self.asked.iter().zip(&self.moved);
        let all: Comparison = joints.map(|(asked, moved)| (*asked, *moved)).collect();
        let factor = all.factor().min(1.0);
        let mut failed = None;
        for joint in 0..positions.len() {
            let (asked, moved) = (self.asked[joint].abs(), self.moved[joint] * self.asked[joint].signum());
            let follows = factor >= SLOWEST && moved >= 0.5 * PART * factor * asked;
            self.seen[joint] |= follows && moved >= SEEN && moved <= MUCH_TOO_FAR * asked;
            if self.seen[joint] || asked < PROBE_DISTANCE {
                self.due[joint] = None;
                continue;
            }
            let since = *self.due[joint].get_or_insert(now);
            if asked >= LONGEST_PROBE || now.saturating_sub(since) >= PATIENCE {
                failed.get_or_insert(Failure { joint, since, goes_back: moved <= -PART * asked });
            }
        }
        failed
    }

    /// How far the joints were commanded to go, and have gone.
    fn advance(&mut self, now: Duration, positions: &[f64], kinds: &[JointKind], history: &CommandHistory) {
        history.total(self.joints.clone(), now, &mut self.asked);
        self.asked.iter_mut().zip(&self.before).for_each(|(asked, before)| *asked -= before);
        for (joint, position) in positions.iter().enumerate() {
            // State by state, because what is longer than half a turn is not seen at its ends.
            let last = mem::replace(&mut self.last[joint], *position);
            self.moved[joint] += kinds[joint].displacement(last, *position);
        }
    }
}
