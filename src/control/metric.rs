//! What is fed back: four ways to say how far the tool is from its goal.

use super::law::Metric;
use crate::dq::UnitDualQuaternion;
use nalgebra::{Vector3, Vector6};

impl Metric {
    /// The body twist `(ω, v)` [rad/s, m/s] that takes the tool to its goal, at gain 1. All four agree to first order.
    ///
    /// With `e = q_d* q` the pose error (eq. 28), R and p its rotation and translation, φ and n its angle and axis:
    /// - R⁸: `2 Im(q* q_d) = −2 Im(e)`, what remains of `q*(q_d − q)` when the tool moves by `q̇ = ½ q ξ`;
    /// - screw log: `−X`, X the logarithm of SE(3) (eq. 30), so that the tool moves on one screw;
    /// - decoupled log: `ω = −φ n`, `v = −Rᵀp` (paper §10.1; Bullo & Murray 1995), so that the tool goes straight;
    /// - unit quaternion: `ω = −2 sin(½φ) n`, `v = −Rᵀp` (Chiaverini & Siciliano 1999).
    pub fn twist(self, goal_from_tool: &UnitDualQuaternion) -> Vector6<f64> {
        match self {
            Self::R8 => stack(-2.0 * goal_from_tool.real().imag(), -2.0 * goal_from_tool.dual().imag()),
            Self::ScrewLog => -goal_from_tool.screw_log(),
            Self::DecoupledLog => stack(-rotation_vector(goal_from_tool), straight(goal_from_tool)),
            Self::UnitQuaternion => stack(-2.0 * goal_from_tool.real().imag(), straight(goal_from_tool)),
        }
    }
}

fn rotation_vector(goal_from_tool: &UnitDualQuaternion) -> Vector3<f64> {
    2.0 * goal_from_tool.half_log().fixed_rows::<3>(0)
}

/// The way to the goal, seen from the tool.
fn straight(goal_from_tool: &UnitDualQuaternion) -> Vector3<f64> {
    -(goal_from_tool.rotation().inverse() * goal_from_tool.translation())
}

fn stack(angular: Vector3<f64>, linear: Vector3<f64>) -> Vector6<f64> {
    Vector6::new(angular.x, angular.y, angular.z, linear.x, linear.y, linear.z)
}
