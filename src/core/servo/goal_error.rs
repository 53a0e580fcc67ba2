//! How far a tool is from its goal.

use super::Tolerance;
use dq_algebra::UnitDualQuaternion;
use dq_kinematics::arm::ArmState;
use dq_kinematics::control::Aim;
use serde::{Deserialize, Serialize};

/// How far from the goal, in what is asked for; 0 for what is left free.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GoalError {
    /// Distance \[m\].
    pub position: f64,
    /// Angle \[rad\].
    pub rotation: f64,
}

impl GoalError {
    /// How far the tool of `arm` is from `base_from_goal`, whose sign is chosen already.
    pub fn of(aim: Aim, arm: &ArmState, base_from_goal: &UnitDualQuaternion) -> Self {
        let tool = arm.base_from_tool();
        Self {
            position: (aim.point(base_from_goal, &tool.translation()) - tool.translation()).norm(),
            rotation: aim.angle(base_from_goal, &tool),
        }
    }

    /// Whether both parts are.
    pub fn is_within(&self, tolerance: &Tolerance) -> bool {
        self.position <= tolerance.linear && self.rotation <= tolerance.angular
    }
}
