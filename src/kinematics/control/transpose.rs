//! The transposed Jacobian: the error pulls at the tool, and each joint gives way by the moment about its axis, or
//! the force along it.

use super::angular_linear::AngularLinear;
use crate::arm::ArmState;
use dq_algebra::UnitDualQuaternion;

/// `K Jᵀ(q_d − q)` with the 8×n pose Jacobian J (eq. 16–20), which is never formed: a moment about the tool's point and a force there,
/// of which the joints follow the [transpose](ArmState::apply_transpose).
///
/// With error `(e_r, e_d)`, tool pose `q = r + ε ½ t r` and `(E, F) = e_d r*`, scalar and vector part, the force is `½K F`, and the moment
/// `½K (vec(e_r r*) + ½ (F×t − E t))`, which depends on where the base frame is.
pub(super) fn difference(gain: f64, arm: &ArmState, base_from_goal: &UnitDualQuaternion) -> AngularLinear {
    let (tool, point) = (arm.base_from_tool(), arm.tool_point());
    let back = tool.real().conjugate();
    let real = (base_from_goal.real() - tool.real()) * back;
    let dual = (base_from_goal.dual() - tool.dual()) * back;
    let moment = real.imag() + 0.5 * (dual.imag().cross(&point) - dual.w * point);
    (0.5 * gain * moment, 0.5 * gain * dual.imag())
}
