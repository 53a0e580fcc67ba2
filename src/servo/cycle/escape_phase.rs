//! Through singularities: when a law is stuck at one, and when it goes on by itself.

use super::Servo;
use super::tracking::{GoalTracking, Watch};
use crate::arm::ArmError;
use crate::dq::UnitDualQuaternion;
use crate::servo::escape::{Freedom, SPEED, Way};
use crate::servo::{Stall, Task};
use std::time::Duration;

/// A law is stuck where the joints can change less than this part of its error, `|Jᵀ e| < 0.01 |e|`, rad and m taken alike ...
const STUCK: f64 = 1e-2;

/// ... and it drives no joint faster than this [rad/s] ...
const STANDING: f64 = 0.05;

/// ... for so long.
const PATIENCE: Duration = Duration::from_millis(200);

/// A motion without progress is held up by a singularity where the joints can change less than this part of the law's error.
const HELD_UP: f64 = 0.1;

/// The escape is over where the error rises along it by more than this part of itself per rad: the law knows better.
const RISE: f64 = 1e-3;

/// An escape that has not ended after this \[rad\] leads nowhere.
const LONGEST: f64 = 3.0;

/// Another escape begins only where the error has become smaller by this factor since the last one began: so none leads in circles.
const NEARER: f64 = 0.999;

/// Where a motion is with respect to singularities.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct EscapePhase {
    phase: Phase,
    /// The error where the last escape began.
    began: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    Free,
    Stuck {
        since: Duration,
    },
    Escaping {
        /// \[rad\]
        travelled: f64,
    },
    /// Stuck, and there is no escape.
    Closed,
}

impl Phase {
    /// An escape so far \[rad\] goes on while it is not over: where the law goes along it by itself, at `speed` [rad/s], or the error
    /// rises, as it does by a negative `fall`, a part of itself per rad. NaN ends the escape.
    fn escaping(travelled: f64, speed: f64, fall: f64) -> Self {
        let leads_on = speed < SPEED && fall >= -RISE;
        match leads_on {
            false => Self::Free,
            true if travelled <= LONGEST => Self::Escaping { travelled },
            true => Self::Closed,
        }
    }
}

impl Default for EscapePhase {
    fn default() -> Self {
        Self { phase: Phase::Free, began: f64::INFINITY }
    }
}

impl EscapePhase {
    /// Whether the arm is being led out of a singularity.
    pub fn is_escaping(&self) -> bool {
        matches!(self.phase, Phase::Escaping { .. })
    }

    /// Adds what the arm goes along the escape in this cycle \[rad\].
    pub fn travel(&mut self, way: f64) {
        if let Phase::Escaping { travelled } = &mut self.phase {
            *travelled += way;
        }
    }
}

impl<T: Task> Servo<T> {
    /// Follows the motion through singularities, with what the law asks for in the velocity.
    pub(super) fn watch_escape(
        &mut self,
        now: Duration,
        goal: &UnitDualQuaternion,
        arrived: bool,
    ) -> Result<(), ArmError> {
        let Some(EscapePhase { phase, .. }) =
            self.goals.tracking.as_ref().map(|tracking| tracking.watch.escape)
        else {
            return Ok(());
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
                    let escapes = self.find_escape(goal)? == Way::Open && self.leave(freedom.error);
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
        if let Some(tracking) = &mut self.goals.tracking {
            (tracking.watch.escape.phase, tracking.watch.law_error) = (phase, freedom.error);
        }
        Ok(())
    }

    fn freedom(&mut self, goal: &UnitDualQuaternion) -> Freedom {
        self.escape.freedom(&self.robot.task, &self.settings.controller, goal)
    }

    /// Takes the escape that was found, where it leads from a smaller error than the last one.
    fn leave(&mut self, error: f64) -> bool {
        let Some(GoalTracking { watch: Watch { escape, .. }, .. }) = &mut self.goals.tracking else {
            return false;
        };
        let nearer = error < NEARER * escape.began;
        if nearer {
            *escape = EscapePhase { phase: Phase::Escaping { travelled: 0.0 }, began: error };
        }
        nearer
    }

    fn find_escape(&mut self, goal: &UnitDualQuaternion) -> Result<Way, ArmError> {
        let (theta, limits) = (self.robot.link.measured(), &self.settings.limits.position);
        self.escape.find(&self.settings.controller, goal, theta, limits)
    }

    /// Why the motion to `goal` makes no progress; none where it was held up by a singularity and is on its way now.
    pub(super) fn stall(&mut self, goal: &UnitDualQuaternion) -> Result<Option<Stall>, ArmError> {
        if let Some(reach) = self.beyond_reach(&goal.translation()) {
            return Ok(Some(Stall::BeyondReach(reach)));
        }
        if let Some(joint) = self.status.joint_at_limit {
            return Ok(Some(Stall::AtLimit { joint }));
        }
        let freedom = self.freedom(goal);
        if freedom.part > HELD_UP {
            return Ok(Some(Stall::NoProgress));
        }
        Ok(match self.find_escape(goal)? {
            Way::None => Some(Stall::Unreachable),
            Way::Barred(joint) => Some(Stall::AtLimit { joint: joint + 1 }),
            Way::Open if self.leave(freedom.error) => None,
            Way::Open => Some(Stall::Singular { sigma: self.smallest_singular_value() }),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_escape_ends_where_the_law_goes_by_itself_or_the_error_rises_or_it_is_too_long() {
        let (slow, fast, nan) = (0.9 * SPEED, SPEED, f64::NAN);
        for (travelled, speed, fall, expected) in [
            (1.0, slow, 0.0, Phase::Escaping { travelled: 1.0 }),
            (1.0, slow, -0.9 * RISE, Phase::Escaping { travelled: 1.0 }),
            (1.0, fast, 0.0, Phase::Free),
            (1.0, slow, -1.1 * RISE, Phase::Free),
            (1.1 * LONGEST, slow, 0.0, Phase::Closed),
            (1.1 * LONGEST, fast, 0.0, Phase::Free),
            (nan, slow, 0.0, Phase::Closed),
            (1.0, nan, 0.0, Phase::Free),
            (1.0, slow, nan, Phase::Free),
            (nan, nan, nan, Phase::Free),
        ] {
            assert_eq!(Phase::escaping(travelled, speed, fall), expected, "{travelled} {speed} {fall}");
        }
    }
}
