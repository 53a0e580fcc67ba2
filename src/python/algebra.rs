//! The algebra of quaternions and general dual quaternions, on arrays. A quaternion has four numbers, scalar first. A dual quaternion
//! has eight: its real part, then its dual part.

use super::arrays::{Numbers, array, exactly, matrix};
use dq_algebra::{DualQuaternion, Vector8};
use nalgebra::Quaternion;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;

fn quaternion(numbers: &Numbers<'_>) -> PyResult<Quaternion<f64>> {
    let [w, x, y, z] = exactly(numbers, "the quaternion")?;
    Ok(Quaternion::new(w, x, y, z))
}

fn dual_quaternion(numbers: &Numbers<'_>) -> PyResult<DualQuaternion> {
    Ok(DualQuaternion::from_vector8(&Vector8::from(exactly(numbers, "the dual quaternion")?)))
}

/// Returns H⁺(a), 4×4: `ab = H⁺(a) b` (eq. 9, the paper's Hp).
#[pyfunction]
pub(super) fn hamilton_plus<'py>(py: Python<'py>, a: Numbers<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
    matrix(py, &dq_algebra::hamilton_plus(&quaternion(&a)?))
}

/// Returns H⁻(b), 4×4: `ab = H⁻(b) a` (eq. 10, the paper's Hn).
#[pyfunction]
pub(super) fn hamilton_minus<'py>(py: Python<'py>, b: Numbers<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
    matrix(py, &dq_algebra::hamilton_minus(&quaternion(&b)?))
}

/// Returns H⁺ of a dual quaternion, 8×8 (the paper's dHp).
#[pyfunction]
pub(super) fn dual_hamilton_plus<'py>(
    py: Python<'py>,
    a: Numbers<'py>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    matrix(py, &dq_algebra::dual_hamilton_plus(&dual_quaternion(&a)?))
}

/// Returns H⁻ of a dual quaternion, 8×8 (the paper's dHn).
#[pyfunction]
pub(super) fn dual_hamilton_minus<'py>(
    py: Python<'py>,
    b: Numbers<'py>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    matrix(py, &dq_algebra::dual_hamilton_minus(&dual_quaternion(&b)?))
}

/// Returns the product of two dual quaternions of any norm (the paper's dqmult).
#[pyfunction]
pub(super) fn multiply<'py>(
    py: Python<'py>,
    a: Numbers<'py>,
    b: Numbers<'py>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    Ok(array(py, (dual_quaternion(&a)? * dual_quaternion(&b)?).to_vector8().as_slice()))
}

/// Returns the dual quaternion with both parts conjugated (eq. 6, the paper's cdualq).
#[pyfunction]
pub(super) fn conjugate<'py>(py: Python<'py>, a: Numbers<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
    Ok(array(py, dual_quaternion(&a)?.conjugate().to_vector8().as_slice()))
}
