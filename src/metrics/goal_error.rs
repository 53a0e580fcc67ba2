//! The error of a tool with respect to its goal, and the tolerance within which the tool has arrived.

use dq_algebra::UnitDualQuaternion;
use dq_kinematics::arm::ArmState;
use dq_kinematics::control::Aim;
use dq_limits::POSITIVE;
use dq_params::Parameters;
use serde::{Deserialize, Serialize};

/// The goal tolerance within which the arm counts as arrived.
#[derive(Clone, Copy, Debug, PartialEq, Parameters)]
#[parameters(prefix = "goal_tolerance.")]
pub struct Tolerance {
    /// distance to the goal that counts as arrived \[m\]
    #[parameter(default = 0.001, range = POSITIVE..=1.0)]
    pub linear: f64,
    /// angle to the goal that counts as arrived \[rad\]
    #[parameter(default = 0.01, range = POSITIVE..=3.0)]
    pub angular: f64,
}

/// The distance of the tool from its goal, and the angle between them. Components that the [`Aim`] leaves free do not count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GoalError {
    /// Distance \[m\].
    pub position: f64,
    /// Angle \[rad\].
    pub rotation: f64,
}

impl GoalError {
    /// Returns the error of the tool of `arm` with respect to `base_from_goal`, in the components of `aim` only. The sign of the
    /// goal's quaternion matters: if it demands the longer rotation, the angle exceeds π.
    pub fn of(aim: Aim, arm: &ArmState, base_from_goal: &UnitDualQuaternion) -> Self {
        let tool = arm.base_from_tool();
        Self {
            position: (aim.point(base_from_goal, &tool.translation()) - tool.translation()).norm(),
            rotation: aim.angle(base_from_goal, &tool),
        }
    }

    /// Returns whether both errors are within `tolerance`.
    pub fn is_within(&self, tolerance: &Tolerance) -> bool {
        self.position <= tolerance.linear && self.rotation <= tolerance.angular
    }
}
