//! Gains that minimize a quadratic cost.

use crate::control::control_law::{ControlLaw, LEAST, LawGains};
use crate::control::{AngularLinear, PoseError};

/// diffc_inverse with the gains that minimize the cost `∫ eᵀ Q e + |ξ|² dt` of the error e and the twist ξ. Its parameters are the
/// weights Q.
///
/// Marinho, Figueredo & Adorno (IROS 2015) reduce the control of the error `e = 1 − q_d* q` to a linear system whose input is the
/// twist. For a fixed goal, `ė = −ξ` near the goal, and the Riccati equation `S² = Q` of an infinite horizon gives the gain `K =
/// √Q`.
pub struct Lq;

impl ControlLaw for Lq {
    fn name(&self) -> &'static str {
        "lq"
    }

    #[inline(always)]
    fn error(&self, error: &PoseError) -> AngularLinear {
        error.difference()
    }

    fn gains(&self) -> LawGains {
        LawGains {
            names: &["weight_angular", "weight_linear"],
            defaults: self.gains_at(1.0, [0.0; 2]),
            range: LEAST..=1e4,
            unit: "1/s^2",
            about: "weights of the angular and of the linear error against speeds of 1 rad/s and 1 m/s: k_omega and k_v are their roots",
        }
    }

    fn twist_gains(&self, weights: [f64; 2], _error: &AngularLinear) -> [f64; 2] {
        weights.map(f64::sqrt)
    }

    /// Returns the weights with which the law has `gain` for the rotation and twice `gain` for the translation. These are the rates
    /// of decay in figure 4 of the reference work (Sathuluri 2018).
    fn gains_at(&self, gain: f64, _before: [f64; 2]) -> [f64; 2] {
        [gain.powi(2), (2.0 * gain).powi(2)]
    }
}
