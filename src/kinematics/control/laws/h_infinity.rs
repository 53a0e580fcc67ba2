//! Gains that bound the effect of disturbances.

use crate::control::control_law::{ControlLaw, LawGains};
use crate::control::{AngularLinear, PoseError};
use std::f64::consts::SQRT_2;

/// unit_quaternion with the least gains that bound the energy of the error by the energy of the disturbances (Figueredo, Adorno &
/// Ishihara 2021, arXiv 1811.05436, Definition 1). Its parameters are the bounds `γ_O` and `γ_T` \[s\].
///
/// Let the error be a rotation by the angle φ about the axis n and a translation p. The outputs are `O = sin(½φ) n` and p. The
/// disturbances are two twists, one in the joints and one in the pose. Each bound applies to both disturbances, so
/// that `γ⁻²` counts twice. With `ω = −κ_O O` and `ṗ = −κ_T p`, the bounds hold if there is an `α > 0` with
/// `κ_O ≥ 1/α + ½α γ_O⁻²`, and likewise for κ_T with γ_T (eq. 18–20 of that article). At the best α, the least gains are `√2/γ_O`
/// and `√2/γ_T`. The error of this law is `2 sin(½φ) n`, twice O, so its gain is `k_ω = ½κ_O`.
pub struct HInfinity;

impl ControlLaw for HInfinity {
    fn name(&self) -> &'static str {
        "h_infinity"
    }

    #[inline(always)]
    fn error(&self, error: &PoseError) -> AngularLinear {
        error.vector_part()
    }

    fn gains(&self) -> LawGains {
        LawGains {
            names: &["attenuation_angular", "attenuation_linear"],
            defaults: self.gains_at(2.0, [0.0; 2]),
            range: 0.01..=1e3,
            unit: "s",
            about: "attenuation: bounds of the angular and of the linear error's energy by that of the disturbances",
        }
    }

    fn twist_gains(&self, [angular, linear]: [f64; 2], _error: &AngularLinear) -> [f64; 2] {
        [0.5 * SQRT_2 / angular, SQRT_2 / linear]
    }

    /// Returns the bounds `γ_O = γ_T` with which the law has half of `gain` for the rotation, and `gain` for the translation.
    fn gains_at(&self, gain: f64, _before: [f64; 2]) -> [f64; 2] {
        [SQRT_2 / gain; 2]
    }
}
