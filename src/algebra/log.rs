//! Logarithms and exponentials of poses.

use super::log_factors::log_factors;
use super::quaternion::{angle_by_sine, from_rotation_vector, rotation_vector, sinc};
use super::{DualQuaternion, UnitDualQuaternion};
use nalgebra::{Quaternion, Vector3, Vector6};

/// Below this angle \[rad\], quotients by θ² and θ³ are computed as series. The first omitted term of a series is below 1e-16.
const SERIES_ANGLE: f64 = 1e-2;

impl UnitDualQuaternion {
    /// Returns the paper's logarithm (eq. 32, `logdq`): half the rotation vector \[rad\], then half the translation \[m\].
    ///
    /// Rotation and translation are decoupled. This is not the logarithm of SE(3), which is [`screw_log`](Self::screw_log). The
    /// sign of the quaternion counts: the angle of rotation is in `[0, 2π)`.
    #[doc(alias = "logdq")]
    pub fn half_log(&self) -> Vector6<f64> {
        stack(0.5 * rotation_vector(&self.real()), 0.5 * self.translation())
    }

    /// Returns the pose with this [`half_log`](Self::half_log) (eq. 13, the paper's `explogdq`). The paper refers to eq. 31 for
    /// this function. But the product in eq. 31 also rotates the translation, so it gives another pose.
    #[doc(alias = "explogdq")]
    pub fn half_exp(half_log: &Vector6<f64>) -> Self {
        let (half_rotation, half_translation) = split(half_log);
        let real = from_rotation_vector(&(2.0 * half_rotation));
        Self::new_unchecked(DualQuaternion { real, dual: Quaternion::from_imag(half_translation) * real })
    }

    /// Returns the logarithm of SE(3): the twist `(ω, v)` \[rad, m\] of the screw that reaches this pose in unit time.
    ///
    /// Let `p` be the translation. Then `ω` is the rotation vector and `v = α p − ½ ω×p + β ω(ω·p)` with `α = ½θ cot ½θ` and `β =
    /// (1−α)/θ²` (Bullo & Murray 1995). The sign of the dual quaternion counts: a negative scalar part means an angle in (π, 2π).
    /// So a law that keeps the sign passes π without a jump.
    ///
    /// The result is accurate to rounding, except near 2π. There α grows as `2π/(θ − 2π)` and amplifies the rounding error of `p`.
    /// The error of the linear part is of the order of `1e-15/(2π − θ)`, about 1e-7 at 2π − 1e-8. At 2π the axis is undefined.
    pub fn screw_log(&self) -> Vector6<f64> {
        let (omega, linear) = screw_log(&self.real(), &self.translation());
        stack(omega, linear)
    }

    /// Returns the exponential of SE(3): the pose that the twist `(ω, v)` \[rad, m\] reaches in unit time. This is the inverse of
    /// [`screw_log`](Self::screw_log).
    ///
    /// The translation is `t = v + a ω×v + b ω×(ω×v)` with `a = (1−cos θ)/θ²` and `b = (θ−sin θ)/θ³`.
    pub fn screw_exp(twist: &Vector6<f64>) -> Self {
        let (omega, linear) = split(twist);
        let angle = omega.norm();
        let a = 0.5 * sinc(0.5 * angle).powi(2);
        let b = if angle < SERIES_ANGLE {
            let square = angle * angle;
            1.0 / 6.0 - square / 120.0 + square * square / 5040.0
        } else {
            (angle - angle.sin()) / angle.powi(3)
        };
        let turn = omega.cross(&linear);
        let translation = linear + a * turn + b * omega.cross(&turn);
        let real = from_rotation_vector(&omega);
        Self::new_unchecked(DualQuaternion { real, dual: Quaternion::from_imag(0.5 * translation) * real })
    }

    /// Returns the pose at the fraction `t` of the screw from this pose (`t` = 0) to `other` (`t` = 1). This is screw linear
    /// interpolation (Kavan et al. 2006): `q exp(t log(q* other))`, with this pose as q.
    ///
    /// Two screws lead from this pose to `other`. The function takes the screw with the smaller rotation, whatever the signs of the
    /// two quaternions are. At a half turn both rotations are equal, and the signs or rounding errors decide. For a `t` outside
    /// \[0, 1\], the result is on the continuation of the screw.
    #[must_use]
    pub fn sclerp(&self, other: &Self, t: f64) -> Self {
        let relative = self.inverse() * *other;
        let shorter = if relative.real().w < 0.0 { -relative } else { relative };
        *self * Self::screw_exp(&(t * shorter.screw_log()))
    }
}

/// Returns the [`screw_log`](UnitDualQuaternion::screw_log) `(ω, v)` of the pose with this rotation and this translation.
#[inline(always)]
pub fn screw_log(rotation: &Quaternion<f64>, translation: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let (by_sine, alpha, beta) = if rotation.w >= 0.0 {
        let [by_sine, beta] = log_factors(rotation.w);
        (by_sine, by_sine * rotation.w, beta)
    } else {
        beyond_pi(rotation)
    };
    let omega = rotation.imag() * (2.0 * by_sine);
    let linear = alpha * translation - 0.5 * omega.cross(translation) + beta * omega.dot(translation) * omega;
    (omega, linear)
}

/// Returns `½θ / sin ½θ` and the [coefficients](log_coefficients) α and β for `rotation`, whose angle θ is in (π, 2π].
#[cold]
fn beyond_pi(rotation: &Quaternion<f64>) -> (f64, f64, f64) {
    let sine = rotation.imag().norm();
    let angle_by_sine = angle_by_sine(sine, rotation.w);
    let (alpha, beta) = log_coefficients(sine * angle_by_sine, rotation.w / sine);
    (0.5 * angle_by_sine, alpha, beta)
}

/// Returns `α = ½θ cot ½θ` and `β = (1−α)/θ²` for the `angle` θ \[rad\] and the `half_cotangent` `cot ½θ`. Near θ = 0, the function
/// uses a series, and ignores the cotangent.
pub fn log_coefficients(angle: f64, half_cotangent: f64) -> (f64, f64) {
    let square = angle * angle;
    if angle < SERIES_ANGLE {
        let beta = 1.0 / 12.0 + square / 720.0 + square * square / 30240.0;
        (1.0 - beta * square, beta)
    } else {
        let alpha = 0.5 * angle * half_cotangent;
        (alpha, (1.0 - alpha) / square)
    }
}

/// Returns the six numbers of a logarithm, a twist or a wrench: first the angular vector `upper`, then the linear vector `lower`.
pub fn stack(upper: Vector3<f64>, lower: Vector3<f64>) -> Vector6<f64> {
    Vector6::new(upper.x, upper.y, upper.z, lower.x, lower.y, lower.z)
}

/// Returns the angular and the linear vector of six numbers, as [`stack`] has them.
pub fn split(vector: &Vector6<f64>) -> (Vector3<f64>, Vector3<f64>) {
    (vector.fixed_rows::<3>(0).into(), vector.fixed_rows::<3>(3).into())
}
