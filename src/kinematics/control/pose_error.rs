//! How far the tool is from its goal, in the ways in which laws say that.

use super::Aim;
use super::angular_linear::AngularLinear;
use crate::arm::ArmState;
use dq_algebra::{UnitDualQuaternion, rotation_vector, screw_log};
use nalgebra::{Quaternion, Vector3};

/// Where the goal is, as seen from the tool's place along some axes.
///
/// With the goal `g = q* q_d` as seen from the tool, the inverse of the pose error (eq. 28), each of the errors is the twist `(ω, v)` that
/// takes the tool there at gain 1; all agree to first order. Seen along other axes the same goal gives the same twist along those.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseError {
    /// The rotation r that the tool lacks.
    pub rotation: Quaternion<f64>,
    /// The translation p that it lacks \[m\].
    pub translation: Vector3<f64>,
}

impl From<&UnitDualQuaternion> for PoseError {
    /// Of the goal as seen from the tool, along the tool's axes.
    fn from(tool_from_goal: &UnitDualQuaternion) -> Self {
        Self { rotation: tool_from_goal.real(), translation: tool_from_goal.translation() }
    }
}

impl PoseError {
    /// Along the base's axes, as turned as `aim` asks for.
    ///
    /// Fast because one product of quaternions and one difference are all: the Jacobian along the same axes is a cross product for each
    /// joint, and nothing is turned into the tool's axes and back.
    #[inline(always)]
    pub fn of(aim: Aim, arm: &ArmState, base_from_goal: &UnitDualQuaternion) -> Self {
        let point = arm.tool_point();
        Self {
            rotation: aim.turn(base_from_goal, &arm.rotation()),
            translation: aim.point(base_from_goal, &point) - point,
        }
    }

    /// `2 Im(g)`: what remains of `q*(q_d − q) = g − 1` when the tool moves by `q̇ = ½ q ξ`, twice the vector part of `½ p r`. Least squares of
    /// `q_d − q` itself give another twist, as multiplying by q* changes lengths in R⁸.
    #[inline(always)]
    pub fn difference(&self) -> AngularLinear {
        let (vector, p) = (self.rotation.imag(), self.translation);
        (2.0 * vector, self.rotation.w * p + p.cross(&vector))
    }

    /// The logarithm of SE(3) of g (eq. 30): the tool moves on one screw.
    #[inline(always)]
    pub fn screw_log(&self) -> AngularLinear {
        screw_log(&self.rotation, &self.translation)
    }

    /// `ω = φ n`, `v = p`: the tool goes straight (paper §10.1; Bullo & Murray 1995).
    #[inline(always)]
    pub fn decoupled_log(&self) -> AngularLinear {
        (rotation_vector(&self.rotation), self.translation)
    }

    /// `ω = 2 sin(½φ) n`, `v = p`: the quaternion's vector part (Chiaverini & Siciliano 1999).
    #[inline(always)]
    pub fn vector_part(&self) -> AngularLinear {
        (2.0 * self.rotation.imag(), self.translation)
    }
}
