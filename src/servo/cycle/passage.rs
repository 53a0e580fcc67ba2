//! Through singularities: when a law is stuck at one, and when it goes on by itself.

use super::Servo;
use super::pursuit::{Pursuit, Watch};
use crate::arm::ArmError;
use crate::dq::UnitDualQuaternion;
use crate::servo::way_out::{SPEED, Way};
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

/// The way out is over where the error rises along it by more than this part of itself per rad: the law knows better.
const RISE: f64 = 1e-3;

/// A way out that has not ended after this \[rad\] leads nowhere.
const LONGEST: f64 = 3.0;

/// Another way out begins only where the error has become smaller by this factor since the last one began: so none leads in circles.
const NEARER: f64 = 0.999;

/// Where a motion is with respect to singularities.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Passage {
    phase: Phase,
    /// The error where the last way out began.
    began: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    Free,
    Stuck {
        since: Duration,
    },
    Leaving {
        /// \[rad\]
        travelled: f64,
    },
    /// Stuck, and there is no way out.
    Closed,
}

impl Phase {
    /// A way out so far \[rad\] goes on while it is not over: where the law goes along it by itself, at `speed` [rad/s], or the error
    /// rises, as it does by a negative `fall`, a part of itself per rad. What is no number keeps no way out going.
    fn leaving(travelled: f64, speed: f64, fall: f64) -> Self {
        let leads_on = speed < SPEED && fall >= -RISE;
        match leads_on {
            false => Self::Free,
            true if travelled <= LONGEST => Self::Leaving { travelled },
            true => Self::Closed,
        }
    }
}

impl Default for Passage {
    fn default() -> Self {
        Self { phase: Phase::Free, began: f64::INFINITY }
    }
}

impl Passage {
    /// Whether the arm is being led out of a singularity.
    pub fn is_leaving(&self) -> bool {
        matches!(self.phase, Phase::Leaving { .. })
    }

    /// Adds what the arm goes along the way out in this cycle \[rad\].
    pub fn travel(&mut self, way: f64) {
        if let Phase::Leaving { travelled } = &mut self.phase {
            *travelled += way;
        }
    }
}

impl<T: Task> Servo<T> {
    /// Follows the motion through singularities, with the law's own velocities in the target.
    pub(super) fn watch_passage(
        &mut self,
        now: Duration,
        goal: &UnitDualQuaternion,
        arrived: bool,
    ) -> Result<(), ArmError> {
        let Some(Passage { phase, .. }) = self.pursuit.as_ref().map(|pursuit| pursuit.watch.passage) else {
            return Ok(());
        };
        let (freedom, error) = self.freedom(goal);
        let standing = self.target.iter().all(|speed| speed.abs() < STANDING);
        let watched = standing || matches!(phase, Phase::Leaving { .. });
        let phase = if arrived || !watched {
            Phase::Free
        } else {
            match phase {
                Phase::Free | Phase::Stuck { .. } if freedom >= STUCK => Phase::Free,
                Phase::Free => Phase::Stuck { since: now },
                Phase::Stuck { since } if now.saturating_sub(since) >= PATIENCE => {
                    let leaving = self.find_way_out(goal)? == Way::Open && self.leave(error);
                    if leaving { Phase::Leaving { travelled: 0.0 } } else { Phase::Closed }
                }
                Phase::Leaving { travelled } => {
                    let along = |values| self.way_out.along(values);
                    Phase::leaving(travelled, along(&self.target), along(&self.ahead_target) / error)
                }
                Phase::Closed if freedom >= HELD_UP => Phase::Free,
                same => same,
            }
        };
        if let Some(pursuit) = &mut self.pursuit {
            (pursuit.watch.passage.phase, pursuit.watch.law_error) = (phase, error);
        }
        Ok(())
    }

    /// The part of the law's error that the joints can change, `|Jᵀ e| / |e|`, and `|e|`.
    fn freedom(&mut self, goal: &UnitDualQuaternion) -> (f64, f64) {
        let error = self.task.steepest_descent(&self.settings.controller, goal, &mut self.ahead_target);
        let descent = self.ahead_target.iter().map(|slope| slope * slope).sum::<f64>().sqrt();
        // Of no error they can change all: it is not they that hold the arm.
        (if error > 0.0 { descent / error } else { 1.0 }, error)
    }

    /// Takes the way out that was found, where it leads from a smaller error than the last one.
    fn leave(&mut self, error: f64) -> bool {
        let Some(Pursuit { watch: Watch { passage, .. }, .. }) = &mut self.pursuit else { return false };
        let nearer = error < NEARER * passage.began;
        if nearer {
            *passage = Passage { phase: Phase::Leaving { travelled: 0.0 }, began: error };
        }
        nearer
    }

    fn find_way_out(&mut self, goal: &UnitDualQuaternion) -> Result<Way, ArmError> {
        let (theta, limits) = (self.link.measured(), &self.settings.limits.position);
        self.way_out.find(&mut self.ahead, &self.settings.controller, goal, theta, limits)
    }

    /// Why the motion to `goal` makes no progress; none where it was held up by a singularity and is on its way out now.
    pub(super) fn stall(&mut self, goal: &UnitDualQuaternion) -> Result<Option<Stall>, ArmError> {
        if let Some(reach) = self.beyond_reach(&goal.translation()) {
            return Ok(Some(Stall::BeyondReach(reach)));
        }
        if let Some(joint) = self.status.joint_at_limit {
            return Ok(Some(Stall::AtLimit { joint }));
        }
        let (freedom, error) = self.freedom(goal);
        if freedom > HELD_UP {
            return Ok(Some(Stall::NoProgress));
        }
        Ok(match self.find_way_out(goal)? {
            Way::None => Some(Stall::Unreachable),
            Way::Barred(joint) => Some(Stall::AtLimit { joint: joint + 1 }),
            Way::Open if self.leave(error) => None,
            Way::Open => Some(Stall::Singular { sigma: self.smallest_singular_value() }),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_way_out_ends_where_the_law_goes_by_itself_or_the_error_rises_or_it_is_too_long() {
        let (slow, fast, nan) = (0.9 * SPEED, SPEED, f64::NAN);
        for (travelled, speed, fall, expected) in [
            (1.0, slow, 0.0, Phase::Leaving { travelled: 1.0 }),
            (1.0, slow, -0.9 * RISE, Phase::Leaving { travelled: 1.0 }),
            (1.0, fast, 0.0, Phase::Free),
            (1.0, slow, -1.1 * RISE, Phase::Free),
            (1.1 * LONGEST, slow, 0.0, Phase::Closed),
            (1.1 * LONGEST, fast, 0.0, Phase::Free),
            (nan, slow, 0.0, Phase::Closed),
            (1.0, nan, 0.0, Phase::Free),
            (1.0, slow, nan, Phase::Free),
            (nan, nan, nan, Phase::Free),
        ] {
            assert_eq!(Phase::leaving(travelled, speed, fall), expected, "{travelled} {speed} {fall}");
        }
    }
}
