//! The error of the tool with respect to its goal, in the forms that laws use.

use super::Aim;
use super::angular_linear::AngularLinear;
use crate::arm::ArmState;
use dq_algebra::{UnitDualQuaternion, rotation_vector, screw_log};
use nalgebra::{Quaternion, Vector3};

/// The goal relative to the tool: a rotation and a translation, along the axes of the tool or of the base.
///
/// The goal relative to the tool is `g = q* q_d`, the inverse of the pose error of eq. 28. Each form of the error is a twist `(ω, v)`,
/// along the same axes as the rotation and the translation. At gain 1, this twist moves the tool toward the goal. All forms agree to
/// first order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseError {
    /// The rotation r from the tool to the goal.
    pub rotation: Quaternion<f64>,
    /// The translation p from the tool to the goal \[m\].
    pub translation: Vector3<f64>,
}

impl From<&UnitDualQuaternion> for PoseError {
    /// Creates the error along the tool's axes. `tool_from_goal` is the goal relative to the tool.
    fn from(tool_from_goal: &UnitDualQuaternion) -> Self {
        Self { rotation: tool_from_goal.real(), translation: tool_from_goal.translation() }
    }
}

impl PoseError {
    /// Computes the error along the base's axes. It leads from the tool to the pose that meets `aim` and is nearest to the tool.
    ///
    /// This is fast because it takes one product of quaternions and one difference. The Jacobian along the same axes takes one
    /// cross product per joint, and nothing is rotated into the tool's axes and back.
    #[inline(always)]
    pub fn of(aim: Aim, arm: &ArmState, base_from_goal: &UnitDualQuaternion) -> Self {
        let point = arm.tool_point();
        Self {
            rotation: aim.turn(base_from_goal, &arm.rotation()),
            translation: aim.point(base_from_goal, &point) - point,
        }
    }

    /// Returns the twist `ξ = 2 Im(g)` for the goal `g = r + ε ½ p r` relative to the tool. The angular part is twice the vector
    /// part of r, the linear part twice the vector part of `½ p r`.
    ///
    /// `½ ξ` is `q*(q_d − q) = g − 1` without the two scalar parts. They are left out because `q* q̇ = ½ ξ` has no scalar parts for
    /// any motion of the tool. The least-squares solution of `J θ̇ = q_d − q` gives a different twist, because multiplication by q*
    /// changes lengths in R⁸.
    #[inline(always)]
    pub fn difference(&self) -> AngularLinear {
        let (vector, p) = (self.rotation.imag(), self.translation);
        (2.0 * vector, self.rotation.w * p + p.cross(&vector))
    }

    /// Returns the logarithm in SE(3) of the goal relative to the tool (eq. 30). With this twist the tool moves on one screw.
    #[inline(always)]
    pub fn screw_log(&self) -> AngularLinear {
        screw_log(&self.rotation, &self.translation)
    }

    /// Returns the twist with `ω = φ n` and `v = p` for the translation p and a rotation by the angle φ about the axis n. With this
    /// twist the tool moves along a straight line (paper §10.1; Bullo & Murray 1995).
    #[inline(always)]
    pub fn decoupled_log(&self) -> AngularLinear {
        (rotation_vector(&self.rotation), self.translation)
    }

    /// Returns the twist with `ω = 2 sin(½φ) n` and `v = p` for the translation p and a rotation by the angle φ about the axis n
    /// (Chiaverini & Siciliano 1999). The vector part of the rotation's quaternion is `sin(½φ) n`.
    #[inline(always)]
    pub fn vector_part(&self) -> AngularLinear {
        (2.0 * self.rotation.imag(), self.translation)
    }
}
