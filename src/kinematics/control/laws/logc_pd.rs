//! The second-order logarithmic law.

use crate::control::control_law::{ControlLaw, LEAST, LawGains, ToolMotion};
use crate::control::{AngularLinear, PoseError, six_numbers};
use nalgebra::Vector3;
use std::f64::consts::FRAC_PI_2;

/// The PD law on SE(3), `V̇ = −K_p log(e) − K_d V` in the tool's axes (paper §10.2; Bullo & Murray 1995, theorem 5).
///
/// The law remembers V, the desired twist. V approaches the twist that logc has at the gain `K_p/K_d`; the difference decays at the
/// rate `K_d`. From rest, the tool moves on one screw. The distance x that remains to the goal along the screw obeys
/// `ẍ + K_d ẋ + K_p x = 0`. This is critically damped at `K_d = 2√K_p`, and overshoots at a lower K_d. A motion begins with the
/// acceleration `K_p x` instead of a step of the velocity. If limits keep the arm from moving with V, V does not wind up, because V
/// follows the error and not the arm.
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

    fn memory_size(&self) -> usize {
        6
    }

    /// Sets the remembered twist V to the twist with which the arm already moves, so that the velocity of the arm does not jump.
    /// Near a singularity the velocity may still jump, because the damped inverse slows the arm.
    fn begin(&self, motion: &ToolMotion, memory: &mut [f64]) {
        memory.copy_from_slice(&six_numbers(&motion.twist));
    }

    fn twist_with_memory(&self, motion: &ToolMotion, memory: &mut [f64]) -> AngularLinear {
        let wanted = six_numbers(&self.twist(motion.gains, &motion.error));
        let [_, k_d] = motion.gains;
        let left = (-k_d * motion.period).exp();
        for (v, wanted) in memory.iter_mut().zip(wanted) {
            *v = left * *v + (1.0 - left) * wanted;
        }
        (Vector3::new(memory[0], memory[1], memory[2]), Vector3::new(memory[3], memory[4], memory[5]))
    }

    /// Returns the rates with which a law without a memory becomes unstable at the same delay τ as this law.
    ///
    /// At the limit of stability, `s² + K_d s + K_p exp(−s τ)` has a root `i ω` with `tan(ω τ) = K_d/ω`. For a law without a
    /// memory, the delay at the limit is `½π` divided by the rate of that law.
    fn rates_for_delay(&self, [_, k_d]: [f64; 2], rates: [f64; 2]) -> [f64; 2] {
        rates.map(|rate| {
            if rate == 0.0 {
                return rate;
            }
            let (half_square, stiffness) = (0.5 * k_d.powi(2), k_d * rate);
            // ω² = −½K_d² + √(¼K_d⁴ + K_p²), without cancellation.
            let frequency = stiffness / (half_square + half_square.hypot(stiffness)).sqrt();
            FRAC_PI_2 * frequency / k_d.atan2(frequency)
        })
    }
}
