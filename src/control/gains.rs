//! Gains, and what the literature derives them from.

use std::f64::consts::{PI, SQRT_2};

/// Gains of a law that feeds back an angular and a linear error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwistGains {
    /// `k_ω` [1/s].
    pub angular: f64,
    /// `k_v` [1/s].
    pub linear: f64,
}

/// Weights of the error in the cost `∫ eᵀ Q e + |ξ|² dt` of which the gains are the optimum.
///
/// Marinho, Figueredo & Adorno (IROS 2015) reduce the control of the error `e = 1 − q_d* q` to a linear system whose input
/// is the twist. For a goal that stands, `ė = −ξ` near it, and the Riccati equation `S² = Q` of an unbounded horizon gives
/// the gain `K = √Q`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LqWeights {
    /// Of the angular error, against an angular speed of 1 rad/s [1/s²].
    pub angular: f64,
    /// Of the linear error, against a speed of 1 m/s [1/s²].
    pub linear: f64,
}

impl LqWeights {
    /// The weights whose gains are `gain` for the rotation and twice that for the translation, the rates of the reference's
    /// figure 4.
    pub fn with_gain(gain: f64) -> Self {
        Self { angular: gain.powi(2), linear: (2.0 * gain).powi(2) }
    }

    /// The optimal gains.
    pub fn gains(&self) -> TwistGains {
        TwistGains { angular: self.angular.sqrt(), linear: self.linear.sqrt() }
    }
}

/// Bounds on the energy of the error by that of the disturbances (Figueredo, Adorno & Ishihara 2021, Definition 1).
///
/// The outputs are `O = sin(½φ) n` and p; disturbances are twists, one in the joints and one in the pose, and each bound
/// holds for both. With `ω = −κ_O O` and `ṗ = −κ_T p` the bounds hold where `κ_O ≥ 1/α + ¼α(γ⁻² + γ⁻²)`, and likewise for
/// κ_T (their eq. 18–20): the least gains are `√(γ⁻² + γ⁻²)`, at the best α.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attenuation {
    /// `γ_O` \[s\].
    pub angular: f64,
    /// `γ_T` \[s\].
    pub linear: f64,
}

impl Attenuation {
    /// The equal bounds whose gains are `½ gain` for the rotation and `gain` for the translation.
    pub fn with_gain(gain: f64) -> Self {
        Self { angular: SQRT_2 / gain, linear: SQRT_2 / gain }
    }

    /// The least gains that keep the bounds, for the error `2 sin(½φ) n`: `k_ω = ½κ_O`.
    pub fn gains(&self) -> TwistGains {
        TwistGains { angular: 0.5 * SQRT_2 / self.angular, linear: SQRT_2 / self.linear }
    }
}

/// A gain that depends on the error's size, so that the time to arrive is bounded.
///
/// `ẋ = −(π/T)(√x + x√x)` comes from x to 0 in `(2T/π) atan √x`, which is below T wherever it starts: the system of Aldana-López et al.
/// (2019) with exponents ½ and 3/2 and coefficients 1. The rate has no bound near 0; a sampled loop needs one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PredefinedTime {
    /// T \[s\]: the bound of the time to arrive.
    pub settling_time: f64,
    /// The largest gain [1/s].
    pub gain_limit: f64,
}

impl PredefinedTime {
    /// The gain [1/s] at an error of size `x` (rad and m taken alike).
    pub fn gain(&self, x: f64) -> f64 {
        let root = x.sqrt();
        (PI / self.settling_time * (1.0 / root + root)).min(self.gain_limit)
    }
}
