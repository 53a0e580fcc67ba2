//! The pose Jacobian in six rows.

use super::angular_linear::AngularLinear;
use crate::arm::ArmState;
use nalgebra::Vector3;

/// The six directions of R⁸ in which a pose can move, by a basis of length 1 each: the 8×n pose Jacobian J has no part along the other two.
///
/// Seen from the tool's rotation, column i of J is `½ (l, v + ½ t×l, −½ t·l)` without its zero: with the joint's axis direction l, the
/// velocity v that it gives the tool point, and the tool point t. Lengths stay the same where `−½ t·l` goes into the first part,
/// as `√(I + ¼ t tᵀ) l = l + (√(1 + ¼|t|²) − 1) t (t·l)/|t|²`.
#[derive(Clone, Copy)]
pub(super) struct PoseSpace {
    tool: Vector3<f64>,
    /// (√(1 + x) − 1)/|t|² with x = ¼|t|², without its quotient of zeros.
    stretch: f64,
}

impl PoseSpace {
    pub fn of(arm: &ArmState) -> Self {
        let tool = arm.tool_point();
        Self { tool, stretch: 0.25 / (1.0 + (1.0 + 0.25 * tool.norm_squared()).sqrt()) }
    }

    /// The column of J of a joint that does this to the tool.
    pub fn column(&self, (axis, velocity): &AngularLinear) -> AngularLinear {
        let angular = axis + self.tool * (self.stretch * self.tool.dot(axis));
        (0.5 * angular, 0.5 * (velocity + 0.5 * self.tool.cross(axis)))
    }
}
