//! Poses as unit dual quaternions.

use super::{DqError, DualQuaternion, Vector8, quaternion_from_angle_axis};
use nalgebra::{Isometry3, Matrix6, Point3, Quaternion, Unit, UnitQuaternion, Vector3};
use std::fmt::{self, Display, Formatter};
use std::ops::{Mul, MulAssign, Neg};

/// A pose `q = r + ε ½ t r` (eq. 13) with `q q* = 1`; `q` and `-q` are the same pose.
///
/// ```
/// use dq_algebra::UnitDualQuaternion;
/// use nalgebra::{UnitQuaternion, Vector3};
/// let base_from_a = UnitDualQuaternion::from_parts(UnitQuaternion::identity(), Vector3::new(1.0, 0.0, 0.0));
/// let a_from_b = UnitDualQuaternion::from_translation_angle_axis(Vector3::y(), 0.5, &Vector3::z_axis());
/// let base_from_b = base_from_a * a_from_b;
/// assert!((base_from_b.translation() - Vector3::new(1.0, 1.0, 0.0)).norm() < 1e-15);
/// ```
///
/// With the feature `serde` it is serialized as the eight numbers of [`to_vector8`](Self::to_vector8), and deserialized
/// by [`try_normalize`](Self::try_normalize).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "[f64; 8]", into = "[f64; 8]"))]
pub struct UnitDualQuaternion {
    inner: DualQuaternion,
}

impl Default for UnitDualQuaternion {
    /// Returns the identity.
    fn default() -> Self {
        Self::identity()
    }
}

impl UnitDualQuaternion {
    /// Returns the identity pose: no rotation and no translation.
    pub fn identity() -> Self {
        Self::from_parts(UnitQuaternion::identity(), Vector3::zeros())
    }

    /// Creates a pose from its rotation and its translation \[m\], both in the base frame (eq. 13).
    #[inline]
    pub fn from_parts(rotation: UnitQuaternion<f64>, translation: Vector3<f64>) -> Self {
        let (real, half) = (rotation.into_inner(), 0.5 * translation);
        let vector = real.imag();
        let dual = Quaternion::from_parts(-half.dot(&vector), real.w * half + half.cross(&vector));
        Self { inner: DualQuaternion { real, dual } }
    }

    /// Creates a pose that rotates by `angle` \[rad\] about `axis`, then translates by `translation` \[m\] (the paper's `unitdq`).
    #[doc(alias = "unitdq")]
    pub fn from_translation_angle_axis(
        translation: Vector3<f64>,
        angle: f64,
        axis: &Unit<Vector3<f64>>,
    ) -> Self {
        Self::from_parts(quaternion_from_angle_axis(angle, axis), translation)
    }

    /// Returns the unit dual quaternion nearest to `q`: scales the real part to norm 1, and removes the component of the dual part
    /// along the real part. If `q` is unit up to rounding, returns it unchanged, to the last bit.
    ///
    /// # Errors
    /// [`DqError::ZeroRealPart`] if the real part is zero. [`DqError::NonFinite`] if a number is not finite, or if the pose is so
    /// far away that its numbers overflow.
    pub fn try_normalize(q: &DualQuaternion) -> Result<Self, DqError> {
        check_finite(q)?;
        let rounding = 16.0 * f64::EPSILON;
        if (q.real.norm_squared() - 1.0).abs() <= rounding
            && q.real.dot(&q.dual).abs() <= rounding * q.dual.norm()
        {
            return Ok(Self { inner: *q });
        }
        let largest = q.real.coords.amax();
        if largest == 0.0 {
            return Err(DqError::ZeroRealPart);
        }
        // Scaling by a power of two is exact. It keeps the squares from overflow and underflow.
        let scale = largest.log2().floor().exp2();
        let real = q.real / scale;
        let norm = real.norm();
        let (real, dual) = (real / norm, q.dual / norm / scale);
        let inner = DualQuaternion { real, dual: dual - real * real.dot(&dual) };
        check_finite(&inner)?;
        Ok(Self { inner })
    }

    /// Wraps a dual quaternion that is unit by construction.
    pub(super) fn new_unchecked(inner: DualQuaternion) -> Self {
        Self { inner }
    }

    /// Returns the pose as a [`DualQuaternion`], the type for any norm.
    pub fn as_dual_quaternion(&self) -> &DualQuaternion {
        &self.inner
    }

    /// Returns the real part `r`.
    pub fn real(&self) -> Quaternion<f64> {
        self.inner.real
    }

    /// Returns the dual part `½ t r` \[m\].
    pub fn dual(&self) -> Quaternion<f64> {
        self.inner.dual
    }

    /// Returns the rotation `r`, with the sign of the real part.
    pub fn rotation(&self) -> UnitQuaternion<f64> {
        UnitQuaternion::new_unchecked(self.inner.real)
    }

    /// Returns the translation `t = 2 d r*` \[m\] (eq. 25).
    pub fn translation(&self) -> Vector3<f64> {
        2.0 * (self.inner.dual * self.inner.real.conjugate()).imag()
    }

    /// Returns `[real w x y z, dual w x y z]`.
    pub fn to_vector8(&self) -> Vector8 {
        self.inner.to_vector8()
    }

    /// Returns the distance \[m\] and the angle \[rad\] between this pose and `other`. The signs of the two quaternions do not
    /// matter.
    pub fn distances(&self, other: &Self) -> [f64; 2] {
        let way: Vector3<f64> = self.translation() - other.translation();
        [way.norm(), self.rotation().angle_to(&other.rotation())]
    }

    /// Returns the inverse pose. Because `q q* = 1`, the inverse is the conjugate `q*` (the paper's `cdualq`).
    #[doc(alias = "cdualq")]
    #[doc(alias = "conjugate")]
    #[must_use]
    pub fn inverse(&self) -> Self {
        Self { inner: self.inner.conjugate() }
    }

    /// Converts the coordinates of a point in this frame to coordinates in the base frame \[m\]: `r p r* + t`.
    pub fn transform_point(&self, point: &Point3<f64>) -> Point3<f64> {
        self.rotation() * point + self.translation()
    }

    /// Returns the pose as a frame: its rotation and its origin \[m\]. The columns of the rotation matrix are the axes of the frame.
    /// The paper's `frameplotter` draws this frame.
    #[doc(alias = "frameplotter")]
    pub fn frame(&self) -> Isometry3<f64> {
        Isometry3::from_parts(self.translation().into(), self.rotation())
    }

    /// Returns the 6×6 matrix that converts twists `(ω, v)` of the body to twists in the base frame: `[R 0; [t]×R R]`.
    /// R is the rotation matrix of this pose, t its translation, and `[t]×` the matrix of the cross product with t.
    pub fn adjoint(&self) -> Matrix6<f64> {
        let rotation = self.rotation().to_rotation_matrix().into_inner();
        let mut adjoint = Matrix6::zeros();
        adjoint.fixed_view_mut::<3, 3>(0, 0).copy_from(&rotation);
        adjoint.fixed_view_mut::<3, 3>(3, 3).copy_from(&rotation);
        adjoint.fixed_view_mut::<3, 3>(3, 0).copy_from(&(self.translation().cross_matrix() * rotation));
        adjoint
    }

    /// Removes rounding errors: scales the real part to norm 1 by one Newton step, and makes the dual part orthogonal to the real
    /// part. The remaining error is of the order of the square of the initial error, so errors do not accumulate over a chain of
    /// products.
    fn renormalize(q: DualQuaternion) -> Self {
        let scale = 0.5 * (3.0 - q.real.norm_squared());
        let (real, dual) = (q.real * scale, q.dual * scale);
        Self { inner: DualQuaternion { real, dual: dual - real * real.dot(&dual) } }
    }
}

/// Converts a frame to a pose. The real part is the frame's rotation, sign included. [`frame`](UnitDualQuaternion::frame) is the
/// inverse.
impl From<Isometry3<f64>> for UnitDualQuaternion {
    fn from(frame: Isometry3<f64>) -> Self {
        Self::from_parts(frame.rotation, frame.translation.vector)
    }
}

/// Converts a pose to a frame, like [`frame`](UnitDualQuaternion::frame).
impl From<UnitDualQuaternion> for Isometry3<f64> {
    fn from(pose: UnitDualQuaternion) -> Self {
        pose.frame()
    }
}

impl TryFrom<[f64; 8]> for UnitDualQuaternion {
    type Error = DqError;

    /// Converts `[real w x y z, dual w x y z]`, like [`try_normalize`](Self::try_normalize).
    fn try_from(numbers: [f64; 8]) -> Result<Self, DqError> {
        Self::try_normalize(&DualQuaternion::from_vector8(&numbers.into()))
    }
}

impl From<UnitDualQuaternion> for [f64; 8] {
    fn from(pose: UnitDualQuaternion) -> Self {
        pose.to_vector8().into()
    }
}

/// Creates a pose with this rotation and no translation. [`rotation`](UnitDualQuaternion::rotation) is the inverse.
impl From<UnitQuaternion<f64>> for UnitDualQuaternion {
    fn from(rotation: UnitQuaternion<f64>) -> Self {
        Self::from_parts(rotation, Vector3::zeros())
    }
}

impl Mul for UnitDualQuaternion {
    type Output = Self;
    fn mul(self, right: Self) -> Self {
        Self::renormalize(self.inner * right.inner)
    }
}

impl MulAssign for UnitDualQuaternion {
    fn mul_assign(&mut self, right: Self) {
        *self = *self * right;
    }
}

/// Writes the eight numbers, as [`DualQuaternion`] does.
impl Display for UnitDualQuaternion {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        self.inner.fmt(f)
    }
}

/// Returns `-q`, which represents the same pose as `q`.
impl Neg for UnitDualQuaternion {
    type Output = Self;
    fn neg(self) -> Self {
        Self { inner: DualQuaternion { real: -self.inner.real, dual: -self.inner.dual } }
    }
}

fn check_finite(q: &DualQuaternion) -> Result<(), DqError> {
    match q.to_vector8().iter().find(|x| !x.is_finite()) {
        Some(bad) => Err(DqError::NonFinite(*bad)),
        None => Ok(()),
    }
}
