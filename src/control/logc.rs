//! logc: logarithmic feedback on SE(3).

use super::TwistGains;
use crate::dq::UnitDualQuaternion;
use nalgebra::Vector6;

/// Body twist `ξ = −diag(k_ω I₃, k_v I₃) X` with X the screw log of the pose error (eq. 30): with equal gains X decays
/// as `exp(−k t)` and the tool moves on one screw.
pub fn body_twist(gains: &TwistGains, goal_from_tool: &UnitDualQuaternion) -> Vector6<f64> {
    let mut twist = goal_from_tool.screw_log();
    twist.fixed_rows_mut::<3>(0).scale_mut(-gains.angular);
    twist.fixed_rows_mut::<3>(3).scale_mut(-gains.linear);
    twist
}
