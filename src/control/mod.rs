//! Control laws: from the pose error to joint velocities, one file per law.

mod cooperative;
mod damped_inverse;
mod diffc;
mod double_cover;
mod double_geodesic;
mod logc;
mod names;

pub use cooperative::{Cooperative, Feedback, Primitive};
pub use damped_inverse::Damping;
pub use double_cover::SignMemory;
pub use logc::body_twist as logc_twist;
pub use names::UnknownName;

use crate::arm::ArmState;
use crate::dq::{Matrix8, UnitDualQuaternion, Vector8};
use nalgebra::Vector6;
use names::named;

named! {
    /// Which law turns the pose error into joint velocities.
    "controller" Law {
        /// Difference feedback in R⁸ (eq. 16–20).
        Diffc = "diffc",
        /// Logarithmic feedback on SE(3) (eq. 28–30).
        Logc = "logc",
        /// Rotation and translation each on their own geodesic (paper §10.1; Bullo & Murray 1995).
        DoubleGeodesic = "double_geodesic",
    }
}

/// Gains of a law that feeds back an angular and a linear error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwistGains {
    /// `k_ω` [1/s].
    pub angular: f64,
    /// `k_v` [1/s].
    pub linear: f64,
}

/// A law with its gains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Controller {
    /// The law in force.
    pub law: Law,
    /// `K` of diffc [1/s].
    pub diffc_gain: f64,
    /// Gains of logc.
    pub logc: TwistGains,
    /// Gains of double_geodesic.
    pub double_geodesic: TwistGains,
    /// The damped inverse of logc and double_geodesic.
    pub damping: Damping,
}

impl Controller {
    /// Joint velocities [rad/s] that move `arm` towards `base_from_goal`, whose sign is chosen already; written to
    /// `theta_dot`, one a joint, without allocating.
    pub fn joint_velocity(&self, arm: &ArmState, base_from_goal: &UnitDualQuaternion, theta_dot: &mut [f64]) {
        let twist: Vector6<f64> = match self.law {
            Law::Diffc => return diffc::joint_velocity(self.diffc_gain, arm, base_from_goal, theta_dot),
            Law::Logc => logc::body_twist(&self.logc, &pose_error(arm, base_from_goal)),
            Law::DoubleGeodesic => {
                double_geodesic::body_twist(&self.double_geodesic, &pose_error(arm, base_from_goal))
            }
        };
        self.damping.joint_velocity(arm, &twist, theta_dot);
    }
}

impl Controller {
    /// The fastest rate [1/s] at which a small error decays with `arm` where it is: `K σ_max²` of the pose Jacobian for diffc,
    /// whose closed loop is `δθ̇ = −K JᵀJ δθ`, and the larger gain for the others.
    pub fn fastest_rate(&self, arm: &ArmState) -> f64 {
        match self.law {
            Law::Diffc => self.diffc_gain * largest_square(arm.pose_columns()),
            Law::Logc => self.logc.angular.max(self.logc.linear),
            Law::DoubleGeodesic => self.double_geodesic.angular.max(self.double_geodesic.linear),
        }
    }
}

/// `σ_max²` of a Jacobian with these columns.
fn largest_square(columns: impl Iterator<Item = Vector8>) -> f64 {
    let gram = columns.fold(Matrix8::zeros(), |sum, column| sum + column * column.transpose());
    gram.symmetric_eigenvalues().max()
}

/// The pose error `e = q_d* q` (eq. 28): `goal_from_tool`.
pub fn pose_error(arm: &ArmState, base_from_goal: &UnitDualQuaternion) -> UnitDualQuaternion {
    base_from_goal.conjugate() * arm.base_from_tool()
}
