//! The pose Jacobian in six rows.

use super::angular_linear::AngularLinear;
use crate::arm::ArmState;
use crate::arm::pair::{dot, twice};
use nalgebra::Vector3;
use wide::f64x2;

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

    /// Two columns of J, of joints that do this to the tool.
    #[inline(always)]
    pub fn column_pair(&self, (axis, velocity): &AngularLinear<f64x2>) -> AngularLinear<f64x2> {
        let tool = twice(&self.tool);
        let angular = axis + tool * (self.stretch * dot(&tool, axis));
        (angular * f64x2::HALF, (velocity + tool.cross(axis) * f64x2::HALF) * f64x2::HALF)
    }
}
