//! The error of a tool with respect to its goal.

use super::Tolerance;
use dq_algebra::UnitDualQuaternion;
use dq_kinematics::arm::ArmState;
use dq_kinematics::control::Aim;
use serde::{Deserialize, Serialize};

/// The distance from the goal. Components that the [`Aim`] leaves free do not count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GoalError {
    /// Distance \[m\].
    pub position: f64,
    /// Angle \[rad\].
    pub rotation: f64,
}

impl GoalError {
    /// Returns the error of the tool of `arm` with respect to `base_from_goal`, whose sign is already chosen. Only the components
    /// of `aim` count.
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
