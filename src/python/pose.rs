//! Poses as Python objects.

use super::arrays::{Numbers, Rows, array, exactly, matrix, rows, wrong};
use dq_algebra::{DualQuaternion, UnitDualQuaternion, Vector8, unit_rotation};
use nalgebra::{Isometry3, Matrix3, Rotation3, Unit, UnitQuaternion, Vector3, Vector6};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;

/// A 3×3 matrix `R` can be a rotation only if each element of `RᵀR` differs from the identity's by less than this.
const ORTHOGONAL: f64 = 1e-6;

/// A pose as a unit dual quaternion. `a * b` and `a @ b` compose two poses. `-a` is the same pose with all eight numbers negated.
#[pyclass(frozen, eq, module = "dq_servo", from_py_object)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pose(pub UnitDualQuaternion);

#[pymethods]
impl Pose {
    #[new]
    #[pyo3(signature = (translation, rotation))]
    fn new(translation: Numbers<'_>, rotation: Numbers<'_>) -> PyResult<Self> {
        let [w, x, y, z] = exactly(&rotation, "rotation")?;
        let rotation = unit_rotation([x, y, z, w]).map_err(wrong)?;
        Self::checked(UnitDualQuaternion::from_parts(rotation, exactly(&translation, "translation")?.into()))
    }

    /// Returns the identity pose: no rotation, and no translation.
    #[staticmethod]
    fn identity() -> Self {
        Self(UnitDualQuaternion::identity())
    }

    /// Creates a pose that rotates by `angle` [rad] about `axis`, then translates (the paper's unitdq).
    #[staticmethod]
    fn from_angle_axis(translation: Numbers<'_>, angle: f64, axis: Numbers<'_>) -> PyResult<Self> {
        let axis = Unit::try_new(Vector3::from(exactly::<3>(&axis, "axis")?), 0.0);
        let axis = axis.ok_or_else(|| wrong("the axis is 0, expected a direction"))?;
        let translation = exactly::<3>(&translation, "translation")?.into();
        Self::checked(UnitDualQuaternion::from_translation_angle_axis(translation, angle, &axis))
    }

    /// Creates a pose from a homogeneous 4×4 matrix.
    #[staticmethod]
    fn from_matrix(homogeneous: Rows<'_>) -> PyResult<Self> {
        let rows = rows(&homogeneous, 4, "the matrix")?;
        if rows.nrows() != 4 {
            return Err(wrong(format!("the matrix has {} rows, expected 4", rows.nrows())));
        }
        let rotation = Matrix3::from_fn(|row, column| rows[(row, column)]);
        let off = (rotation.transpose() * rotation - Matrix3::identity()).amax();
        if !(off < ORTHOGONAL && rotation.determinant() > 0.0) {
            return Err(wrong("the matrix does not rotate: expected orthogonal columns of length 1"));
        }
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
        let translation = Vector3::new(rows[(0, 3)], rows[(1, 3)], rows[(2, 3)]);
        Self::checked(Isometry3::from_parts(translation.into(), rotation).into())
    }

    /// Returns the pose nearest to eight numbers (the paper's R82dual).
    #[staticmethod]
    fn from_dual_quaternion(numbers: Numbers<'_>) -> PyResult<Self> {
        let q = DualQuaternion::from_vector8(&Vector8::from(exactly(&numbers, "the dual quaternion")?));
        UnitDualQuaternion::try_normalize(&q).map(Self).map_err(wrong)
    }

    /// Returns the pose that a constant twist (angular, linear) reaches in unit time: the exponential of SE(3).
    #[staticmethod]
    fn screw_exp(twist: Numbers<'_>) -> PyResult<Self> {
        Self::checked(UnitDualQuaternion::screw_exp(&Vector6::from(exactly(&twist, "the twist")?)))
    }

    /// Returns the pose with this `half_log` (the paper's explogdq).
    #[staticmethod]
    fn half_exp(log: Numbers<'_>) -> PyResult<Self> {
        Self::checked(UnitDualQuaternion::half_exp(&Vector6::from(exactly(&log, "the logarithm")?)))
    }

    /// The translation x, y, z [m] in the base frame.
    #[getter]
    fn translation<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array(py, self.0.translation().as_slice())
    }

    /// The unit quaternion (w, x, y, z).
    #[getter]
    fn rotation<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let r = self.0.real();
        array(py, &[r.w, r.i, r.j, r.k])
    }

    /// The eight numbers: real part, then dual part.
    #[getter]
    fn dual_quaternion<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array(py, self.0.to_vector8().as_slice())
    }

    /// Returns the homogeneous 4×4 matrix.
    fn matrix<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, &self.0.frame().to_homogeneous())
    }

    /// Returns the 6×6 matrix that maps twists in the frame of this pose to twists in the base frame.
    fn adjoint<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, &self.0.adjoint())
    }

    /// Returns the logarithm of SE(3): the twist (angular, linear) that reaches this pose in unit time.
    fn screw_log<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array(py, self.0.screw_log().as_slice())
    }

    /// Returns half the rotation vector, then half the translation (eq. 32, the paper's logdq).
    fn half_log<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array(py, self.0.half_log().as_slice())
    }

    /// Returns the inverse pose (the paper's cdualq).
    fn conjugate(&self) -> Self {
        Self(self.0.inverse())
    }

    /// Returns the inverse pose, like `conjugate`.
    fn inverse(&self) -> Self {
        Self(self.0.inverse())
    }

    /// Returns the pose at the fraction `t` of the screw motion from this pose to `other` (ScLERP), by the shorter way.
    fn sclerp(&self, other: &Self, t: f64) -> PyResult<Self> {
        Self::checked(self.0.sclerp(&other.0, t))
    }

    fn __mul__(&self, right: &Self) -> Self {
        Self(self.0 * right.0)
    }

    fn __matmul__(&self, right: &Self) -> Self {
        Self(self.0 * right.0)
    }

    /// Pickles the eight numbers. Unpickling gives exactly the same numbers.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, ([f64; 8],))> {
        let numbers = slf.get().0.to_vector8().into();
        Ok((slf.get_type().getattr("from_dual_quaternion")?, (numbers,)))
    }

    fn __neg__(&self) -> Self {
        Self(-self.0)
    }

    fn __repr__(&self) -> String {
        let (t, r) = (self.0.translation(), self.0.real());
        format!("Pose([{}, {}, {}], [{}, {}, {}, {}])", t.x, t.y, t.z, r.w, r.i, r.j, r.k)
    }
}

impl Pose {
    /// Returns the numbers of a pose parameter: x y z \[m\], then qx qy qz qw.
    pub fn numbers(&self) -> Vec<f64> {
        let (at, turn) = (self.0.translation(), self.0.real());
        vec![at.x, at.y, at.z, turn.i, turn.j, turn.k, turn.w]
    }

    /// Returns `pose` if all its numbers are finite, otherwise a `ValueError`.
    fn checked(pose: UnitDualQuaternion) -> PyResult<Self> {
        match pose.to_vector8().iter().find(|number| !number.is_finite()) {
            Some(number) => Err(wrong(format!("a pose with {number}: expected finite numbers"))),
            None => Ok(Self(pose)),
        }
    }
}
