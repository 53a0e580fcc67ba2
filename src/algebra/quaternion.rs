//! Quaternions and their angle-axis form.

use nalgebra::{Quaternion, Unit, UnitQuaternion, Vector3};
use thiserror::Error;

/// The tolerance of tf2: a quaternion is invalid if its squared norm differs from 1 by more than this. A unit quaternion stays valid
/// if its numbers are rounded to three decimals.
const UNIT_TOLERANCE: f64 = 10e-3;

/// The error for a quaternion that is not an orientation.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[error("the orientation has norm {norm}: expected 1 ± {}", UNIT_TOLERANCE / 2.0)]
pub struct NotUnit {
    /// The norm of the quaternion.
    pub norm: f64,
}

/// Converts a quaternion (x, y, z, w), from a user or a message, to a rotation. The result is normalized, and keeps the sign of the
/// quaternion.
///
/// ```
/// use dq_algebra::unit_rotation;
/// assert!(unit_rotation([0.717, -0.46, 0.28, 0.44]).is_ok());
/// assert_eq!(unit_rotation([0.0, 0.0, 0.0, 2.0]).unwrap_err().norm, 2.0);
/// ```
///
/// # Errors
/// [`NotUnit`] if the squared norm is not 1 ± 0.01, or is NaN.
pub fn unit_rotation([x, y, z, w]: [f64; 4]) -> Result<UnitQuaternion<f64>, NotUnit> {
    let quaternion = Quaternion::new(w, x, y, z);
    match (quaternion.norm_squared() - 1.0).abs() <= UNIT_TOLERANCE {
        true => Ok(UnitQuaternion::new_normalize(quaternion)),
        false => Err(NotUnit { norm: quaternion.norm() }),
    }
}

/// Returns the unit quaternion that rotates by `angle` \[rad\] about `axis`: `(cos ½θ, k sin ½θ)` (eq. 8, the paper's `quat`).
///
/// The sign is kept: `angle` and `angle + 2π` give opposite quaternions of the same rotation.
///
/// ```
/// use dq_algebra::quaternion_from_angle_axis;
/// use nalgebra::Vector3;
/// let half_turn = quaternion_from_angle_axis(std::f64::consts::PI, &Vector3::z_axis());
/// assert!((half_turn.k - 1.0).abs() < 1e-15);
/// ```
#[doc(alias = "quat")]
pub fn quaternion_from_angle_axis(angle: f64, axis: &Unit<Vector3<f64>>) -> UnitQuaternion<f64> {
    let (sin, cos) = (0.5 * angle).sin_cos();
    UnitQuaternion::new_unchecked(Quaternion::from_parts(cos, axis.into_inner() * sin))
}

/// Returns the angle in `[0, 2π]` \[rad\] and the axis of a unit quaternion (the paper's `decq`).
///
/// The sign of the quaternion counts: a negative scalar part means an angle above π. If the vector part is zero, the axis is
/// undefined, and z is returned.
#[doc(alias = "decq")]
pub fn angle_axis(rotation: &UnitQuaternion<f64>) -> (f64, Unit<Vector3<f64>>) {
    let (vector, scalar) = (rotation.imag(), rotation.scalar());
    let angle = 2.0 * vector.norm().atan2(scalar);
    (angle, Unit::try_new(vector, 0.0).unwrap_or(Vector3::z_axis()))
}

/// Returns the rotation vector `θ l` \[rad\] of a unit quaternion with the scalar part `cos ½θ` and the vector part `l sin ½θ`. The
/// angle θ is in `[0, 2π)`, and l is a unit vector.
///
/// `atan2` keeps full relative precision at every angle. If the vector part is zero, the result is zero, even for the scalar part
/// −1, which means a full turn about an unknown axis.
#[inline(always)]
pub fn rotation_vector(rotation: &Quaternion<f64>) -> Vector3<f64> {
    rotation.imag() * angle_by_sine(rotation.imag().norm(), rotation.w)
}

/// Returns `θ / sin ½θ` for the angle θ in `[0, 2π)` with the given `half_sine` (`sin ½θ`) and `half_cosine` (`cos ½θ`). Returns the
/// limit 2 for a `half_sine` of 0.
#[inline(always)]
pub(super) fn angle_by_sine(half_sine: f64, half_cosine: f64) -> f64 {
    if half_sine > 0.0 { 2.0 * half_sine.atan2(half_cosine) / half_sine } else { 2.0 }
}

/// Returns the unit quaternion `(cos ½θ, ω sin(½θ)/θ)` for the rotation vector ω \[rad\] of length θ. This is the inverse of
/// [`rotation_vector`].
pub(super) fn from_rotation_vector(rotation_vector: &Vector3<f64>) -> Quaternion<f64> {
    let half_angle = 0.5 * rotation_vector.norm();
    Quaternion::from_parts(half_angle.cos(), rotation_vector * (0.5 * sinc(half_angle)))
}

/// Returns `sin(x)/x`, or 1 if x is 0.
pub(super) fn sinc(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { x.sin() / x }
}
