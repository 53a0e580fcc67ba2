//! The largest rate at which a law is stable, for a given delay.

use std::f64::consts::PI;
use std::time::Duration;

/// Returns the largest rate λ at which a law is stable [1/s]. The law runs once per `period` T. The `latency` τ is the time from a
/// command to the measured positions that show its effect. The rate is `(2/T) sin(π T / (2 (2 τ + T)))`, which for short periods is
/// `π / (2 (τ + T/2))`.
///
/// Let δ(k) be the error in cycle k. The law reduces the error at the rate λ, so `δ(k+1) = δ(k) − λ T δ(k−d)` with τ = d T. At
/// the limit of stability, the characteristic polynomial `z^(d+1) − z^d + λ T` has a root `exp(i φ)`. The smallest such φ is
/// π/(2d + 1), with λ T = 2 sin(φ/2).
///
/// A period of 0 stands for a law in continuous time: the rate is `π / (2 τ)`, and infinite if the latency is 0, too.
pub fn largest_rate(latency: Duration, period: Duration) -> f64 {
    let (latency, period) = (latency.as_secs_f64(), period.as_secs_f64());
    if period == 0.0 {
        return 0.5 * PI / latency;
    }
    2.0 / period * (0.5 * PI * period / (2.0 * latency + period)).sin()
}

/// The law's rate at the present pose, and the largest rate that the present delay allows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RateBound {
    /// The fastest rate at which the law reduces an error [1/s].
    pub rate: f64,
    /// The largest stable rate, by [`largest_rate`] [1/s].
    pub largest: f64,
    /// The time from a command to the joint state that shows its effect, as known to the servo \[s\].
    pub latency: f64,
    /// The interval of joint states, or the control period if that is longer \[s\].
    pub period: f64,
}

impl RateBound {
    /// Returns whether the law alone would oscillate with a growing amplitude.
    pub fn is_too_much(&self) -> bool {
        self.rate > self.largest
    }
}
