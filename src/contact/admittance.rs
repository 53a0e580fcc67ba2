//! The offset by which the goal yields.

use crate::Compliance;
use crate::compliance::angular_first;
use dq_algebra::{UnitDualQuaternion, split, stack};
use nalgebra::{Matrix3, UnitQuaternion, Vector3, Vector6};
use serde::{Deserialize, Serialize};

/// The time constant with which stiffness, damping and mass follow their parameters \[s\].
const RAMP: f64 = 0.2;

/// The stiffness about and along an axis at which `k / (k + HALF)` is ½ \[N m/rad, N/m\]. This fraction is ramped in place of the
/// stiffness `k`, because it is finite even if `k` is infinite: the fraction is then 1. For a free direction, it is 0.
const HALF: [f64; 2] = [50.0, 1000.0];

/// The largest stiffness \[N/m, N m/rad\]. An infinite stiffness counts as this stiffness.
const STIFF: f64 = 1e9;

/// The least damping, relative to the critical damping. It exceeds 1, so that the two exponents of the solution are never equal.
const OVERDAMPED: f64 = 1.001;

/// An offset that returns to the identity ends when its distance, its angle and its rates are below this \[m, rad; m/s, rad/s\].
const ENDED: f64 = 1e-7;

/// The offset from the goal to the yielded goal: a translation `p` along the goal's axes, and a rotation vector `φ`. They obey
/// `M p″ + D p′ + K p = f` and `M dω/dt + D ω + J⁻ᵀ(φ) K φ = τ`, with diagonal matrices `M`, `D` and `K`. The force `f` is along the
/// goal's axes. The torque `τ` and the body rate `ω` are along the axes of the yielded goal.
///
/// `J⁻¹` turns the body rate into the rate of `φ`, so both elastic terms are gradients of the energy `½ pᵀ K p + ½ φᵀ K φ`. The offset
/// is therefore passive: the work that it returns never exceeds the work that it has taken in.
///
/// For a rotation about one axis, `J⁻ᵀ K φ` is `K φ`, as in Fonseca, Adorno and Fraisse (2020), "Coupled task-space admittance
/// controller using dual quaternion logarithmic mapping". `φ` and `p` are twice the
/// [`half_log`](UnitDualQuaternion::half_log) of the offset.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Admittance {
    offset: UnitDualQuaternion,
    /// The rates of the offset: the body rate `ω` along the axes of the yielded goal [rad/s], then `p′` along the axes of the goal
    /// [m/s].
    rates: Vector6<f64>,
    /// The present parameters; `None` while the goal does not yield.
    dynamics: Option<Dynamics>,
}

/// The parameters of the motion about and along each axis, in the form in which they are ramped. Angular numbers come first.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Dynamics {
    /// The fraction `k / (k + HALF)`, with the stiffness `k` (see [`HALF`]).
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
        Self { offset: UnitDualQuaternion::identity(), rates: Vector6::zeros(), dynamics: None }
    }
}

impl Admittance {
    /// Returns the offset from the goal to the yielded goal.
    pub fn offset(&self) -> &UnitDualQuaternion {
        &self.offset
    }

    /// Returns the body twist of the offset, `(ω, v)` [rad/s, m/s].
    pub fn twist(&self) -> Vector6<f64> {
        let (angular, linear) = split(&self.rates);
        stack(angular, self.offset.rotation().inverse() * linear)
    }

    /// Sets the rates of the offset to zero. The offset itself does not change.
    pub fn freeze(&mut self) {
        self.rates = Vector6::zeros();
    }

    /// Moves the offset by one step of `dt` \[s\] under the `wrench` in the frame of the yielded goal, torque first \[N m, N\]. The
    /// tool follows `delay` \[s\] later, so a longer delay raises the [least damping](Compliance::least_damping). Without
    /// `compliance`, the offset returns to the identity. A change of `compliance` does not make the offset jump.
    pub fn advance(&mut self, compliance: Option<&Compliance>, wrench: &Vector6<f64>, delay: f64, dt: f64) {
        let target = match (compliance, &self.dynamics) {
            (Some(compliance), _) => Dynamics::of(compliance, delay),
            (None, Some(now)) => Dynamics { firmness: Vector6::repeat(1.0), ..*now },
            (None, None) => return,
        };
        let rigid = Dynamics { firmness: Vector6::repeat(1.0), ..target };
        let mut dynamics = self.dynamics.unwrap_or(rigid);
        dynamics.approach(&target, -(-dt / RAMP).exp_m1());
        let (before, stiffness) = (self.offset, dynamics.stiffness());
        let (rotation, point) = (before.rotation(), before.translation());
        let turn = rotation.scaled_axis();
        let (torque, force) = split(wrench);
        let (about, along) = split(&stiffness);
        let torque = torque - inverse_jacobian(&turn).tr_mul(&about.component_mul(&turn));
        let force = rotation * force - along.component_mul(&point);
        let (wrench, mut travel) = (stack(torque, force), Vector6::zeros());
        for i in 0..6 {
            let (mass, stiffness) = (dynamics.mass[i], stiffness[i]);
            let damping = dynamics.damping[i].max(OVERDAMPED * 2.0 * (stiffness * mass).sqrt());
            let equation = [damping / mass, stiffness / mass];
            (travel[i], self.rates[i]) = step(self.rates[i], wrench[i] / mass, equation, dt);
        }
        let (turned, moved) = split(&travel);
        let rotation = rotation * UnitQuaternion::from_scaled_axis(turned);
        self.offset = UnitDualQuaternion::from_parts(rotation, point + moved);
        if let Some(compliance) = compliance {
            self.keep_within(compliance.largest_offset, &before, dt);
        }
        let is_over = |size: f64| size < ENDED;
        let [distance, angle] = self.offset.distances(&UnitDualQuaternion::identity());
        let ends = compliance.is_none() && [distance, angle, self.rates.norm()].into_iter().all(is_over);
        *self = if ends { Self::default() } else { Self { dynamics: Some(dynamics), ..*self } };
    }

    /// Limits the offset to a `distance` and an `angle` \[m, rad\]. `before` is the offset before this step, which took `dt` \[s\]. If
    /// it was already beyond a limit, because the limit was lowered, the offset may only shrink.
    fn keep_within(&mut self, [distance, angle]: [f64; 2], before: &UnitDualQuaternion, dt: f64) {
        let (point, turn) = (self.offset.translation(), self.offset.rotation().scaled_axis());
        let [was_away, was_turned] = before.distances(&UnitDualQuaternion::identity());
        let (distance, angle) = (distance.max(was_away), angle.max(was_turned));
        if point.norm() <= distance && turn.norm() <= angle {
            return;
        }
        let shortened = |v: Vector3<f64>, most: f64| if v.norm() > most { most / v.norm() * v } else { v };
        let turn = UnitQuaternion::from_scaled_axis(shortened(turn, angle));
        self.offset = UnitDualQuaternion::from_parts(turn, shortened(point, distance));
        let turned = (before.rotation().inverse() * turn).scaled_axis();
        self.rates = stack(turned, self.offset.translation() - before.translation()) / dt;
    }
}

/// Solves `d²y/dt² + 2a dy/dt + b y = u`, where `a² > b ≥ 0`. The third argument is `[2a, b]`. At time 0, `y` is 0 and `dy/dt` is
/// `v`. Returns `y` and `dy/dt` at time `t`. The solution is exact, so it is stable for every `t`.
fn step(v: f64, u: f64, [twice_a, b]: [f64; 2], t: f64) -> (f64, f64) {
    let a = 0.5 * twice_a;
    let half = (a * a - b).max(0.0).sqrt();
    let fast = -(a + half);
    // The slow exponent is −(a − half), but without cancellation.
    let slow = b / fast;
    let apart = slow - fast;
    // A tiny rate would underflow.
    let integral = |rate: f64| {
        if (rate * t).abs() < 1e-9 { t * (1.0 + 0.5 * rate * t) } else { (rate * t).exp_m1() / rate }
    };
    let (e_slow, e_fast) = ((slow * t).exp(), (fast * t).exp());
    let response = (e_slow - e_fast) / apart;
    let travel = v * response + u * (integral(slow) - integral(fast)) / apart;
    (travel, v * (slow * e_slow - fast * e_fast) / apart + u * response)
}

/// Returns the matrix `J⁻¹` for the rotation vector `turn` \[rad\], called `φ` below. The matrix turns the body rate of the rotation
/// into the rate of `φ`. It is `I + ½ [φ]× + (1 − α)/θ² [φ]×²`, with `θ = |φ|`, and with `α = (θ/2) cot(θ/2)` as in the logarithm of
/// SE(3).
pub(crate) fn inverse_jacobian(turn: &Vector3<f64>) -> Matrix3<f64> {
    let (angle, cross) = (turn.norm(), turn.cross_matrix());
    let half = 0.5 * angle;
    // The first two terms of the series are exact to rounding below this angle.
    let second = if angle < 1e-2 {
        1.0 / 12.0 + angle * angle / 720.0
    } else {
        (1.0 - half / half.tan()) / (angle * angle)
    };
    Matrix3::identity() + 0.5 * cross + second * cross * cross
}
