//! Passing through singularities. Begins an escape if a law is stuck at a singularity, and ends the escape when the law can continue
//! without it.

use super::Servo;
use super::robot::fastest_of;
use crate::servo::Stall;
use crate::servo::escape_phase::{EscapePhase, Phase};
use dq_algebra::UnitDualQuaternion;
use dq_search::{FoundEscape, Freedom};
use std::time::Duration;

/// A law counts as stuck only if the joints can reduce less than this fraction of its error: `|Jᵀ e| < 0.01 |e|`, with the law's
/// error `e` and its Jacobian `J`. 1 rad counts as much as 1 m.
const STUCK: f64 = 1e-2;

/// A law counts as stuck only if it drives no joint faster than this [rad/s, prismatic: m/s].
const STANDING: f64 = 0.05;

/// A law counts as stuck only after the conditions [`STUCK`] and [`STANDING`] have been true for this time.
const PATIENCE: Duration = Duration::from_millis(200);

/// A singularity counts as the cause of a stall if [`Freedom::part`], the part of the law's error that the joints can reduce, is
/// below this.
const HELD_UP: f64 = 0.1;

/// A payload or gravity counts as pulling at a joint only if the joint is commanded to move at least at this speed [rad/s,
/// prismatic: m/s].
const PULLED: f64 = 1e-3;

/// Another escape begins only if the error is below this factor times the error at the beginning of the last escape. So escapes
/// cannot lead in circles.
const NEARER: f64 = 0.999;

impl Servo {
    /// Updates the phase of the escape. `output.velocity` is the law's velocity.
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

    /// Begins the escape that was found, if the error is below [`NEARER`] times the error at the beginning of the last escape.
    /// Returns whether the escape begins.
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

    /// Returns [`Stall::Sagging`] if a payload or gravity cancels most of the commanded speed of the joint with the largest pull.
    /// Returns `None` otherwise. The pull at a joint is its commanded speed less its real speed.
    pub(super) fn sag(&self) -> Option<Stall> {
        let (joint, pull) = fastest_of(self.robot.link.pulls())?;
        // The joint's real speed is `speed - pull`. It is 0 if the arm stands.
        let speed = self.output.command[joint];
        let is_lost = (speed - pull).abs() <= 0.5 * pull.abs();
        let (error, kind) = (self.mode.pursuit()?.watch.error, self.joint_line.kinds[joint]);
        (speed.abs() >= PULLED && is_lost).then_some(Stall::Sagging { joint: joint + 1, speed, kind, error })
    }

    /// Returns the reason why the motion to `goal` makes no progress. If a singularity is the reason and there is an escape from it,
    /// begins the escape and returns `None`.
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
