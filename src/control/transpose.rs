//! The transposed Jacobian: the error pulls at the tool, and each joint gives way by the moment about its axis, or
//! the force along it.

use super::halves::Halves;
use crate::arm::ArmState;
use crate::arm::pair::{put, twice};
use crate::dq::UnitDualQuaternion;
use nalgebra::Vector3;

/// A pull at the tool, as seen from the base frame's origin.
pub(super) struct Pull {
    /// About the origin.
    pub moment: Vector3<f64>,
    /// Along the base frame's axes.
    pub force: Vector3<f64>,
}

impl Pull {
    /// `K Jᵀ(q_d − q)` with the 8×n pose Jacobian J (eq. 16–20), which is never formed.
    ///
    /// With error `(e_r, e_d)` and `q = r + ε d`, component i is `½K l·(N + F×p)` on the joint's axis line (direction l,
    /// point p), prismatic: `½K l·F`, where `N = vec(e_r r* + e_d d*)` and `F = vec(e_d r*)`. N depends on where the base frame is.
    pub fn difference(gain: f64, arm: &ArmState, base_from_goal: &UnitDualQuaternion) -> Self {
        let tool = arm.base_from_tool();
        let (error_real, error_dual) =
            (base_from_goal.real() - tool.real(), base_from_goal.dual() - tool.dual());
        let moment = (error_real * tool.real().conjugate() + error_dual * tool.dual().conjugate()).imag();
        let force = (error_dual * tool.real().conjugate()).imag();
        Self { moment: 0.5 * gain * moment, force: 0.5 * gain * force }
    }

    /// A twist of the tool along the base's axes taken for a pull at the tool: then `θ̇ = Jᵀ ξ`.
    #[inline(always)]
    pub fn twist(arm: &ArmState, (moment, force): &Halves) -> Self {
        Self { moment: moment + arm.tool_point().cross(force), force: *force }
    }

    /// Joint velocities [rad/s]: the moment about each joint's axis; prismatic [m/s]: the force along it.
    #[inline]
    pub fn joint_velocity(&self, arm: &ArmState, theta_dot: &mut [f64]) {
        let (moment, force) = (twice(&self.moment), twice(&self.force));
        for (speeds, axes) in theta_dot.chunks_mut(2).zip(arm.axis_pairs()) {
            put(axes.give_way(&moment, &force), speeds);
        }
    }
}
