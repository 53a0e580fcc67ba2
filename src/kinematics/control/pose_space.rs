//! The 8×n pose Jacobian, reduced to six rows.

use super::angular_linear::AngularLinear;
use crate::arm::ArmState;
use nalgebra::Vector3;

/// The six directions of R⁸ in which a pose can move, as an orthonormal basis. The 8×n pose Jacobian J has no component along the
/// other two directions of R⁸.
///
/// In the frame that turns with the tool, column i of J has the parts `½ l` (rotation), `½ (v + ½ t×l)` (dual vector) and `−¼ t·l`
/// (dual scalar). The scalar of its real part is 0 and is omitted. Here l is the direction of the joint's axis, v the velocity that
/// the joint gives the tool point, and t the tool point. To merge the dual scalar into the rotation, l in the rotation is replaced
/// by `√(I + ¼ t tᵀ) l = l + (√(1 + ¼|t|²) − 1) t (t·l)/|t|²`. This preserves lengths.
#[derive(Clone, Copy)]
pub(super) struct PoseSpace {
    tool: Vector3<f64>,
    /// The factor `(√(1 + ¼|t|²) − 1)/|t|²` for the tool point t, computed without a division by zero.
    stretch: f64,
}

impl PoseSpace {
    pub fn of(arm: &ArmState) -> Self {
        let tool = arm.tool_point();
        Self { tool, stretch: 0.25 / (1.0 + (1.0 + 0.25 * tool.norm_squared()).sqrt()) }
    }

    /// Returns the column of the pose Jacobian for a joint that gives the tool this twist, in the six directions of [`PoseSpace`].
    pub fn column(&self, (axis, velocity): &AngularLinear) -> AngularLinear {
        let angular = axis + self.tool * (self.stretch * self.tool.dot(axis));
        (0.5 * angular, 0.5 * (velocity + 0.5 * self.tool.cross(axis)))
    }
}
