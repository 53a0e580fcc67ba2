//! The offset by which the goal yields.

use crate::Compliance;
use crate::compliance::angular_first;
use dq_algebra::UnitDualQuaternion;
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};
use serde::{Deserialize, Serialize};

/// The time constant with which stiffness, damping and mass follow their parameters \[s\].
const RAMP: f64 = 0.2;

/// A stiffness `k` is ramped as `k / (k + HALF)`, so that 0 and infinity are as good as all others \[N m/rad, N/m\].
const HALF: [f64; 2] = [50.0, 1000.0];

/// The largest stiffness. An infinite one counts as this \[N/m, N m/rad\].
const STIFF: f64 = 1e9;

/// The least damping, relative to the critical one. Above 1, the two exponents of the solution are never equal.
const OVERDAMPED: f64 = 1.001;

/// Below this size, an offset that no longer yields has ended \[m, rad; m/s, rad/s\].
const ENDED: f64 = 1e-7;

/// The offset from the goal to the goal that has yielded, `x ∈ SE(3)`, and its body twist `v`:
/// `M dv/dt + D v + J⁻ᵀ(log x) K log x = w`, with the screw logarithm and the wrench `w` in the frame of the yielded goal.
///
/// With `J⁻¹`, which turns the body twist into the rate of `log x`, the elastic wrench is the gradient of the energy
/// `½ (log x)ᵀ K log x`. So the offset is passive: it returns no more work than it took in. For motion along one axis, the elastic
/// wrench is `K log x`, as in Fonseca, Adorno and Fraisse (2020), "Coupled task-space admittance controller using dual quaternion
/// logarithmic mapping".
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Admittance {
    offset: UnitDualQuaternion,
    twist: Vector6<f64>,
    /// The present parameters; `None` while the goal does not yield.
    dynamics: Option<Dynamics>,
}

/// The parameters of motion along and about each axis, as they are ramped. Angular numbers come first.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Dynamics {
    /// The stiffness `k` as `k / (k + HALF)`.
    firmness: Vector6<f64>,
    damping: Vector6<f64>,
    mass: Vector6<f64>,
}

impl Dynamics {
    fn of(compliance: &Compliance, delay: f64) -> Self {
        let [along, about] = compliance.least_damping(delay);
        let least = Vector6::new(about, about, about, along, along, along);
        let stiffness = angular_first(&compliance.stiffness);
        Self {
            firmness: Vector6::from_fn(|i, _| {
                let half = HALF[i / 3];
                if stiffness[i].is_finite() { stiffness[i] / (stiffness[i] + half) } else { 1.0 }
            }),
            damping: angular_first(&compliance.damping).sup(&least),
            mass: angular_first(&compliance.mass),
        }
    }

    fn approach(&mut self, target: &Self, share: f64) {
        self.firmness += share * (target.firmness - self.firmness);
        self.damping += share * (target.damping - self.damping);
        self.mass += share * (target.mass - self.mass);
    }

    fn stiffness(&self) -> Vector6<f64> {
        Vector6::from_fn(|i, _| (HALF[i / 3] * self.firmness[i] / (1.0 - self.firmness[i])).min(STIFF))
    }
}

impl Default for Admittance {
    fn default() -> Self {
        Self { offset: UnitDualQuaternion::identity(), twist: Vector6::zeros(), dynamics: None }
    }
}

impl Admittance {
    /// Returns the offset from the goal to the goal that has yielded.
    pub fn offset(&self) -> &UnitDualQuaternion {
        &self.offset
    }

    /// Returns the body twist of the offset, `(ω, v)` [rad/s, m/s].
    pub fn twist(&self) -> &Vector6<f64> {
        &self.twist
    }

    /// Keeps the offset as it is, at rest.
    pub fn freeze(&mut self) {
        self.twist = Vector6::zeros();
    }

    /// Moves the offset by one step of `dt` \[s\] under the `wrench` on the tool, torque first \[N m, N\]. The tool follows `delay`
    /// \[s\] later. Without `compliance` the offset returns to the identity. A change of `compliance` never moves the offset at
    /// once.
    pub fn advance(&mut self, compliance: Option<&Compliance>, wrench: &Vector6<f64>, delay: f64, dt: f64) {
        let target = match (compliance, &self.dynamics) {
            (Some(compliance), _) => Dynamics::of(compliance, delay),
            (None, Some(now)) => Dynamics { firmness: Vector6::repeat(1.0), ..*now },
            (None, None) => return,
        };
        let rigid = Dynamics { firmness: Vector6::repeat(1.0), ..target };
        let mut dynamics = self.dynamics.unwrap_or(rigid);
        dynamics.approach(&target, -(-dt / RAMP).exp_m1());
        let log = self.offset.screw_log();
        let stiffness = dynamics.stiffness();
        let elastic = inverse_jacobian(&log).tr_mul(&stiffness.component_mul(&log));
        let force = wrench - elastic;
        let mut travel = Vector6::zeros();
        for i in 0..6 {
            let (mass, stiffness) = (dynamics.mass[i], stiffness[i]);
            let damping = dynamics.damping[i].max(OVERDAMPED * 2.0 * (stiffness * mass).sqrt());
            let rates = [damping / mass, stiffness / mass];
            (travel[i], self.twist[i]) = step(self.twist[i], force[i] / mass, rates, dt);
        }
        let before = self.offset;
        self.offset = before * UnitDualQuaternion::screw_exp(&travel);
        if let Some(compliance) = compliance {
            self.keep_within(compliance.largest_offset, &before, dt);
        }
        let is_over = |size: f64| size < ENDED;
        let ends =
            compliance.is_none() && is_over(self.offset.screw_log().norm()) && is_over(self.twist.norm());
        *self = if ends { Self::default() } else { Self { dynamics: Some(dynamics), ..*self } };
    }

    /// Lets neither the distance nor the angle of the offset grow beyond its limit \[m, rad\]. An offset that is already larger,
    /// because the limit was lowered, may only shrink.
    fn keep_within(&mut self, [distance, angle]: [f64; 2], before: &UnitDualQuaternion, dt: f64) {
        let (point, turn) = (self.offset.translation(), self.offset.rotation().scaled_axis());
        let [was_away, was_turned] = before.distances(&UnitDualQuaternion::identity());
        let (distance, angle) = (distance.max(was_away), angle.max(was_turned));
        if point.norm() <= distance && turn.norm() <= angle {
            return;
        }
        let shortened = |v: Vector3<f64>, most: f64| if v.norm() > most { most / v.norm() * v } else { v };
        let turn = nalgebra::UnitQuaternion::from_scaled_axis(shortened(turn, angle));
        self.offset = UnitDualQuaternion::from_parts(turn, shortened(point, distance));
        self.twist = (before.inverse() * self.offset).screw_log() / dt;
    }
}

/// Solves `d²y/dt² + 2a dy/dt + b y = u` from `y = 0` and speed `v` over the time `t`, with `[2a, b]` as given and `a² > b ≥ 0`.
/// Returns the travel `y` and the speed. The solution is exact, so it is stable for every `t`.
fn step(v: f64, u: f64, [twice_a, b]: [f64; 2], t: f64) -> (f64, f64) {
    let a = 0.5 * twice_a;
    let half = (a * a - b).max(0.0).sqrt();
    let fast = -(a + half);
    // The slow exponent is −(a − half), but without cancellation.
    let slow = b / fast;
    let apart = slow - fast;
    let integral = |rate: f64| if rate == 0.0 { t } else { (rate * t).exp_m1() / rate };
    let (e_slow, e_fast) = ((slow * t).exp(), (fast * t).exp());
    let response = (e_slow - e_fast) / apart;
    let travel = v * response + u * (integral(slow) - integral(fast)) / apart;
    (travel, v * (slow * e_slow - fast * e_fast) / apart + u * response)
}

/// Returns `J⁻¹`, which turns the body twist of `exp(log)` into the rate of `log` (6×6, angular first): the inverse of the right
/// Jacobian of SE(3). Its four terms are those of Bullo and Murray (1995), "Proportional derivative (PD) control on the Euclidean
/// group", with the sign of the body twist.
pub(crate) fn inverse_jacobian(log: &Vector6<f64>) -> Matrix6<f64> {
    let (angular, linear) = (log.fixed_rows::<3>(0).into_owned(), log.fixed_rows::<3>(3).into_owned());
    let [turn, shift]: [Matrix3<f64>; 2] = [angular, linear].map(|v| v.cross_matrix());
    let mut ad = Matrix6::zeros();
    ad.fixed_view_mut::<3, 3>(0, 0).copy_from(&turn);
    ad.fixed_view_mut::<3, 3>(3, 3).copy_from(&turn);
    ad.fixed_view_mut::<3, 3>(3, 0).copy_from(&shift);
    let [second, fourth] = coefficients(angular.norm());
    let square = ad * ad;
    Matrix6::identity() + 0.5 * ad + second * square + fourth * square * square
}

/// Returns the coefficients of `ad²` and `ad⁴` for this angle \[rad\].
fn coefficients(angle: f64) -> [f64; 2] {
    let square = angle * angle;
    if angle < 0.1 {
        return [1.0 / 12.0 - square * square / 30240.0, -1.0 / 720.0 - square / 15120.0];
    }
    let half = 0.5 * angle;
    let (alpha, beta) = (half / half.tan(), (half / half.sin()).powi(2));
    let mean = 0.5 * (alpha - beta);
    [(2.0 * (1.0 - alpha) + mean) / square, (1.0 - alpha + mean) / (square * square)]
}
