//! The second-order logarithmic law.

use crate::control::control_law::{ControlLaw, LEAST, LawGains};
use crate::control::{AngularLinear, PoseError};

/// The PD law on SE(3), `V̇ = −K_p log(e) − K_d V` in the tool's axes (paper §10.2; Bullo & Murray 1995, theorem 5).
///
/// The arm's velocity [approaches](ControlLaw::approach_rate) that of logc with the gain `K_p/K_d`, at the rate `K_d`. From rest,
/// the tool moves on one screw. Its distance x along the screw obeys `ẍ + K_d ẋ + K_p x = 0`: critically damped at `K_d = 2√K_p`,
/// with overshoot at a lower K_d. A motion begins with the acceleration `K_p x` instead of a step of the velocity.
pub struct LogcPd;

impl ControlLaw for LogcPd {
    fn name(&self) -> &'static str {
        "logc_pd"
    }

    #[inline(always)]
    fn error(&self, error: &PoseError) -> AngularLinear {
        error.screw_log()
    }

    fn gains(&self) -> LawGains {
        LawGains {
            names: &["k_p", "k_d"],
            defaults: self.gains_at(2.0, [0.0; 2]),
            range: LEAST..=1e4,
            unit: "1/s^2, 1/s",
            about: "k_p and k_d: gains of the error and of the velocity; without overshoot from k_d = 2 sqrt(k_p) on",
        }
    }

    fn twist_gains(&self, [k_p, k_d]: [f64; 2], _error: &AngularLinear) -> [f64; 2] {
        [k_p / k_d; 2]
    }

    /// Returns critically damped gains. Errors decay as `(1 + gain t) exp(−gain t)`.
    fn gains_at(&self, gain: f64, _before: [f64; 2]) -> [f64; 2] {
        [gain.powi(2), 2.0 * gain]
    }

    fn approach_rate(&self, [_, k_d]: [f64; 2]) -> f64 {
        k_d
    }
}
