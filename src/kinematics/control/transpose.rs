//! The transposed Jacobian: the error acts as a force on the tool, and each joint moves in proportion to the moment about its axis
//! (prismatic: to the force along its axis).

use super::angular_linear::AngularLinear;
use crate::arm::ArmState;
use dq_algebra::UnitDualQuaternion;

/// Returns a moment and a force at the tool point. [`ArmState::apply_transpose`] turns them into the joint velocities
/// `K Jᵀ(q_d − q)`, with the 8×n pose Jacobian J (eq. 16–20). J itself is never computed.
///
/// Let the tool pose be `q = r + ε ½ t r`, the goal `q_d = g_r + ε g_d`, and the error `q_d − q = e_r + ε e_d`. Then
/// `e_r r* = g_r r* − 1` and `e_d r* = g_d r* − ½ t`. Let E be the scalar part and F the vector part of `e_d r*`. Then the force is
/// `½K F`. The moment is `½K (vec(e_r r*) + ½ (F×t − E t))`; it depends on the position of the base frame.
pub(super) fn difference(gain: f64, arm: &ArmState, base_from_goal: &UnitDualQuaternion) -> AngularLinear {
    let (back, point) = (arm.rotation().inverse().into_inner(), arm.tool_point());
    let (real, dual) = (base_from_goal.real() * back, base_from_goal.dual() * back);
    let force = dual.imag() - 0.5 * point;
    let moment = real.imag() + 0.5 * (force.cross(&point) - dual.w * point);
    (0.5 * gain * moment, 0.5 * gain * force)
}
