//! Control laws: from the pose error to joint velocities, one file per law.

mod damped_inverse;
mod diffc;
mod double_cover;
mod double_geodesic;
mod logc;

pub use damped_inverse::Damping;
pub use double_cover::SignMemory;

use crate::arm::ArmState;
use crate::dq::UnitDualQuaternion;
use nalgebra::Vector6;
use std::{fmt, str::FromStr};
use thiserror::Error;

/// A name that is no control law.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("unknown controller {0:?}: expected one of diffc, logc, double_geodesic")]
pub struct UnknownLaw(pub String);

/// Which law turns the pose error into joint velocities.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Law {
    /// Difference feedback in R⁸ (eq. 16–20).
    Diffc,
    /// Logarithmic feedback on SE(3) (eq. 28–30).
    Logc,
    /// Rotation and translation each on their own geodesic (paper §10.1; Bullo & Murray 1995).
    DoubleGeodesic,
}

impl Law {
    /// Every law's name, as the parameter `controller` takes it.
    pub const NAMES: &'static [&'static str] = &["diffc", "logc", "double_geodesic"];

    /// The name, as the parameter `controller` takes it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Diffc => "diffc",
            Self::Logc => "logc",
            Self::DoubleGeodesic => "double_geodesic",
        }
    }
}

impl fmt::Display for Law {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Law {
    type Err = UnknownLaw;
    fn from_str(name: &str) -> Result<Self, UnknownLaw> {
        match name {
            "diffc" => Ok(Self::Diffc),
            "logc" => Ok(Self::Logc),
            "double_geodesic" => Ok(Self::DoubleGeodesic),
            other => Err(UnknownLaw(other.to_owned())),
        }
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

/// The pose error `e = q_d* q` (eq. 28): `goal_from_tool`.
pub fn pose_error(arm: &ArmState, base_from_goal: &UnitDualQuaternion) -> UnitDualQuaternion {
    base_from_goal.conjugate() * arm.base_from_tool()
}
