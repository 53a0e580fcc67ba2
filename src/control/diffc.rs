//! diffc: difference feedback in R⁸.

use crate::arm::ArmState;
use crate::dq::UnitDualQuaternion;

/// `θ̇ = K Jᵀ (q_d − q)` (eq. 16, 20) with the 8×n pose Jacobian J, which is never formed.
///
/// With error `e = (e_r, e_d)` and `q = r + ε d`, component i is `½K l·(N + F×p)` on the joint's axis line (direction l,
/// point p), where `N = vec(e_r r* + e_d d*)` and `F = vec(e_d r*)`.
pub(super) fn joint_velocity(
    gain: f64,
    arm: &ArmState,
    base_from_goal: &UnitDualQuaternion,
    theta_dot: &mut [f64],
) {
    let tool = arm.base_from_tool();
    let (error_real, error_dual) = (base_from_goal.real() - tool.real(), base_from_goal.dual() - tool.dual());
    let moment = (error_real * tool.real().conjugate() + error_dual * tool.dual().conjugate()).imag();
    let force = (error_dual * tool.real().conjugate()).imag();
    for (speed, (direction, point)) in theta_dot.iter_mut().zip(arm.axes()) {
        *speed = 0.5 * gain * direction.dot(&(moment + force.cross(&point)));
    }
}
