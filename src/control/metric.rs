//! What is fed back: four ways to say how far the tool is from its goal.

use super::Aim;
use super::halves::Halves;
use super::law::Metric;
use crate::arm::ArmState;
use crate::dq::{UnitDualQuaternion, rotation_vector, screw_log};
use nalgebra::{Quaternion, Vector3, Vector6};

impl Metric {
    /// The twist `(ω, v)` [rad/s, m/s] that takes the tool to its goal at gain 1, as seen from the tool. All four agree to first
    /// order.
    ///
    /// With `g = q* q_d` the goal in the tool, the inverse of the pose error (eq. 28), φ and n its angle and axis, p its translation:
    /// - R⁸: `2 Im(g)`, what remains of `q*(q_d − q) = g − 1` when the tool moves by `q̇ = ½ q ξ`; least squares of `q_d − q` itself give another
    ///   twist, as multiplying by q* changes lengths in R⁸;
    /// - screw log: the logarithm of SE(3) of g (eq. 30), so that the tool moves on one screw;
    /// - decoupled log: `ω = φ n`, `v = p` (paper §10.1; Bullo & Murray 1995), so that the tool goes straight;
    /// - unit quaternion: `ω = 2 sin(½φ) n`, `v = p` (Chiaverini & Siciliano 1999).
    ///
    /// Turning the tool's axes turns the twist with them: a goal seen from the tool's place along other axes gives the same twist along
    /// those.
    pub fn twist(self, tool_from_goal: &UnitDualQuaternion) -> Vector6<f64> {
        let rotation = tool_from_goal.real();
        let (angular, linear) = self.error(&Place { rotation, translation: tool_from_goal.translation() });
        Vector6::new(angular.x, angular.y, angular.z, linear.x, linear.y, linear.z)
    }

    /// [`twist`](Self::twist) in two halves.
    #[inline(always)]
    pub(super) fn error(self, goal: &Place) -> Halves {
        let (rotation, translation) = (goal.rotation, goal.translation);
        match self {
            // Twice the vector part of `½ p r`.
            Self::R8 => {
                let vector = rotation.imag();
                (2.0 * vector, rotation.w * translation + translation.cross(&vector))
            }
            Self::ScrewLog => screw_log(&rotation, &translation),
            Self::DecoupledLog => (rotation_vector(&rotation), translation),
            Self::UnitQuaternion => (2.0 * rotation.imag(), translation),
        }
    }
}

/// Where the goal is, as seen from the tool's place along some axes.
pub(super) struct Place {
    rotation: Quaternion<f64>,
    translation: Vector3<f64>,
}

impl Place {
    /// Along the base's axes, as turned as `aim` asks for.
    ///
    /// Fast because one product of quaternions and one difference are all: the Jacobian along the same axes is a cross product for each
    /// joint, and nothing is turned into the tool's axes and back.
    #[inline(always)]
    pub fn of_goal(aim: Aim, arm: &ArmState, base_from_goal: &UnitDualQuaternion) -> Self {
        Self {
            rotation: aim.turn(base_from_goal, &arm.base_from_tool()),
            translation: base_from_goal.translation() - arm.tool_point(),
        }
    }
}
