//! A gain that depends on the size of the error, so that the time to arrive is bounded.

use crate::control::angular_linear::norm;
use crate::control::control_law::{ControlLaw, LawGains};
use crate::control::{AngularLinear, PoseError};
use std::f64::consts::PI;

/// logc with a gain that depends on the size x of the error, so that the time to arrive is less than T for any start. The
/// parameters are T \[s\] and the largest gain [1/s].
///
/// The gain `(π/T)(1/√x + √x)` is smallest at x = 1 and grows toward 0 and toward infinity. With this gain, the error obeys `ẋ =
/// −(π/T)(√x + x√x)`. It reaches 0 after the time `(2T/π) atan √x₀`, which is below T for any initial x₀. This is the system of
/// Aldana-López et al. (2019, arXiv 1809.07012) with the exponents ½ and 3/2 and coefficients of 1. The largest gain is necessary
/// because the loop is sampled, and the formula has no bound near x = 0.
pub struct PredefinedTime;

impl ControlLaw for PredefinedTime {
    fn name(&self) -> &'static str {
        "predefined_time"
    }

    #[inline(always)]
    fn error(&self, error: &PoseError) -> AngularLinear {
        error.screw_log()
    }

    fn gains(&self) -> LawGains {
        LawGains {
            names: &["settling_time", "gain_limit"],
            defaults: [5.0, 20.0],
            range: 0.1..=100.0,
            unit: "s, 1/s",
            about: "bound of the time to arrive, and the largest gain near the goal, where the law's own has no bound",
        }
    }

    /// Returns the same gain for `k_ω` and `k_v`. It depends on the size of the error, in which 1 rad counts as much as 1 m.
    fn twist_gains(&self, [settling_time, limit]: [f64; 2], error: &AngularLinear) -> [f64; 2] {
        let root = norm(error).sqrt();
        [(PI / settling_time * (1.0 / root + root)).min(limit); 2]
    }

    fn gains_at(&self, gain: f64, [_, limit]: [f64; 2]) -> [f64; 2] {
        [1.0 / gain, limit]
    }
}
