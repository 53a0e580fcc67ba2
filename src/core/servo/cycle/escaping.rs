//! Through singularities: when a law is stuck at one, and when it goes on by itself.

use super::Servo;
use super::robot::fastest_of;
use crate::servo::Stall;
use crate::servo::escape::{FoundEscape, Freedom};
use crate::servo::escape_phase::{EscapePhase, Phase};
use dq_algebra::UnitDualQuaternion;
use std::time::Duration;

/// A law is stuck where the joints can change less than this part of its error, `|Jᵀ e| < 0.01 |e|`, rad and m taken alike ...
const STUCK: f64 = 1e-2;

/// ... and it drives no joint faster than this [rad/s] ...
const STANDING: f64 = 0.05;

/// ... for so long.
const PATIENCE: Duration = Duration::from_millis(200);

/// A motion without progress is held up by a singularity where the joints can change less than this part of the law's error.
const HELD_UP: f64 = 0.1;

/// A joint that goes slower than commanded by no more than this [rad/s, prismatic: m/s] is not pulled at.
const PULLED: f64 = 1e-3;

/// Another escape begins only where the error has become smaller by this factor since the last one began: so none leads in circles.
const NEARER: f64 = 0.999;

impl Servo {
    /// Follows the motion through singularities, with what the law asks for in the velocity.
    pub(super) fn watch_escape(&mut self, now: Duration, goal: &UnitDualQuaternion, arrived: bool) {
        let Some(EscapePhase { phase, .. }) = self.mode.pursuit().map(|pursuit| pursuit.watch.escape) else {
            return;
        };
        let freedom = self.freedom(goal);
        let standing = self.output.velocity.iter().all(|speed| speed.abs() < STANDING);
        let watched = standing || matches!(phase, Phase::Escaping { .. });
        let phase = if arrived || !watched {
            Phase::Free
        } else {
            match phase {
                Phase::Free | Phase::Stuck { .. } if freedom.part >= STUCK => Phase::Free,
                Phase::Free => Phase::Stuck { since: now },
                Phase::Stuck { since } if now.saturating_sub(since) >= PATIENCE => {
                    let escapes = self.find_escape(goal) == FoundEscape::Open && self.leave(freedom.error);
                    if escapes { Phase::Escaping { travelled: 0.0 } } else { Phase::Closed }
                }
                Phase::Escaping { travelled } => Phase::escaping(
                    travelled,
                    self.escape.direction.along(&self.output.velocity),
                    freedom.fall,
                ),
                Phase::Closed if freedom.part >= HELD_UP => Phase::Free,
                same => same,
            }
        };
        if let Some(pursuit) = self.mode.pursuit_mut() {
            (pursuit.watch.escape.phase, pursuit.watch.law_error) = (phase, freedom.error);
        }
    }

    pub(super) fn freedom(&mut self, goal: &UnitDualQuaternion) -> Freedom {
        self.escape.freedom(self.robot.arms.state(), &self.settings.controller, goal)
    }

    /// Takes the escape that was found, where it leads from a smaller error than the last one.
    fn leave(&mut self, error: f64) -> bool {
        let Some(pursuit) = self.mode.pursuit_mut() else { return false };
        let escape = &mut pursuit.watch.escape;
        let nearer = error < NEARER * escape.began;
        if nearer {
            *escape = EscapePhase { phase: Phase::Escaping { travelled: 0.0 }, began: error };
        }
        nearer
    }

    fn find_escape(&mut self, goal: &UnitDualQuaternion) -> FoundEscape {
        let (theta, limits) = (self.robot.link.measured(), &self.settings.limits.position);
        self.escape.find(&self.settings.controller, goal, theta, limits)
    }

    /// That something pulls at the joints as much as the law does, where it does: most of what the joint that is pulled at most is commanded
    /// does not move it.
    fn sag(&self) -> Option<Stall> {
        let (joint, pull) = fastest_of(self.robot.link.pulls())?;
        // At an arm that stands all of the command is lost.
        let speed = self.output.command[joint];
        let is_lost = (speed - pull).abs() <= 0.5 * pull.abs();
        let (error, kind) = (self.mode.pursuit()?.watch.error, self.elsewhere.kinds[joint]);
        (speed.abs() >= PULLED && is_lost).then_some(Stall::Sagging { joint: joint + 1, speed, kind, error })
    }

    /// Why the motion to `goal` makes no progress; none where it was held up by a singularity and goes on now.
    pub(super) fn stall(&mut self, goal: &UnitDualQuaternion) -> Option<Stall> {
        if let Some(reach) = self.beyond_reach(&goal.translation()) {
            return Some(Stall::BeyondReach(reach));
        }
        if let Some(pair) = self.output.hindrance.pair {
            return Some(Stall::Constrained(pair));
        }
        if let Some(joint) = self.output.hindrance.at_limit {
            return Some(Stall::AtLimit { joint });
        }
        let freedom = self.freedom(goal);
        if freedom.part > HELD_UP {
            return Some(self.sag().unwrap_or(Stall::NoProgress));
        }
        match self.find_escape(goal) {
            FoundEscape::None => Some(Stall::Unreachable),
            FoundEscape::Barred(joint) => Some(Stall::AtLimit { joint: joint + 1 }),
            FoundEscape::Open if self.leave(freedom.error) => None,
            FoundEscape::Open => Some(Stall::Singular { sigma: self.smallest_singular_value() }),
        }
    }
}
