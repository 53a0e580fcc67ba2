//! What is fed back: four ways to say how far the tool is from its goal.

use super::law::Metric;
use crate::dq::UnitDualQuaternion;
use nalgebra::{Vector3, Vector6};

impl Metric {
    /// The twist `(ω, v)` [rad/s, m/s] that takes the tool to its goal at gain 1, as seen from the tool. All four agree to first
    /// order.
    ///
    /// With `g = q* q_d` the goal in the tool, the inverse of the pose error (eq. 28), φ and n its angle and axis, p its translation:
    /// - R⁸: `2 Im(g)`, what remains of `q*(q_d − q)` when the tool moves by `q̇ = ½ q ξ`;
    /// - screw log: the logarithm of SE(3) of g (eq. 30), so that the tool moves on one screw;
    /// - decoupled log: `ω = φ n`, `v = p` (paper §10.1; Bullo & Murray 1995), so that the tool goes straight;
    /// - unit quaternion: `ω = 2 sin(½φ) n`, `v = p` (Chiaverini & Siciliano 1999).
    ///
    /// Turning the tool's axes turns the twist with them: a goal seen from the tool's place along other axes gives the same twist along
    /// those.
    pub fn twist(self, tool_from_goal: &UnitDualQuaternion) -> Vector6<f64> {
        match self {
            Self::R8 => stack(2.0 * tool_from_goal.real().imag(), 2.0 * tool_from_goal.dual().imag()),
            Self::ScrewLog => tool_from_goal.screw_log(),
            Self::DecoupledLog => 2.0 * tool_from_goal.half_log(),
            Self::UnitQuaternion => stack(2.0 * tool_from_goal.real().imag(), tool_from_goal.translation()),
        }
    }
}

fn stack(angular: Vector3<f64>, linear: Vector3<f64>) -> Vector6<f64> {
    Vector6::new(angular.x, angular.y, angular.z, linear.x, linear.y, linear.z)
}
