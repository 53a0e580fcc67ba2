//! double_geodesic: the shortest rotation and a straight line, each with its own gain.

use super::TwistGains;
use crate::dq::UnitDualQuaternion;
use nalgebra::Vector6;

/// Body twist `ω = −k_ω` rotation vector of e, `v = −k_v Rᵀp`, with R and p the rotation and translation of the pose error
/// (paper §10.1; Bullo & Murray 1995): the tool goes straight.
pub(super) fn body_twist(gains: &TwistGains, goal_from_tool: &UnitDualQuaternion) -> Vector6<f64> {
    let half_log = goal_from_tool.half_log();
    let rotation_vector = 2.0 * half_log.fixed_rows::<3>(0);
    let to_goal = goal_from_tool.rotation().inverse() * goal_from_tool.translation();
    let mut twist = Vector6::zeros();
    twist.fixed_rows_mut::<3>(0).copy_from(&(-gains.angular * rotation_vector));
    twist.fixed_rows_mut::<3>(3).copy_from(&(-gains.linear * to_goal));
    twist
}
