//! Conversions from and to numpy arrays.

use numpy::ndarray::{Array2, ArrayView2, Dimension, Ix1, Ix2};
use numpy::{AllowTypeChange, IntoPyArray, PyArray1, PyArray2, PyArrayLike};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::borrow::Cow;
use std::fmt::Display;
use std::ops::Deref;

/// Numbers from Python in `D` dimensions: an array, or nested lists or tuples.
pub(super) struct Like<'py, D: Dimension>(PyArrayLike<'py, f64, D, AllowTypeChange>);

/// A list of numbers.
pub(super) type Numbers<'py> = Like<'py, Ix1>;

/// A table of numbers with one row per configuration.
pub(super) type Rows<'py> = Like<'py, Ix2>;

impl<'py, D: Dimension> Deref for Like<'py, D> {
    type Target = PyArrayLike<'py, f64, D, AllowTypeChange>;

    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

impl<'a, 'py, D: Dimension + 'py> FromPyObject<'a, 'py> for Like<'py, D> {
    type Error = PyErr;

    fn extract(object: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        object.extract().map(Self).map_err(|_| {
            let expected = if D::NDIM == Some(1) { "a list of numbers" } else { "a table of numbers" };
            let shape = object.getattr("shape").map(|shape| format!("an array of the shape {shape}"));
            let got = shape.or_else(|_| object.get_type().name().map(|name| name.to_string()));
            wrong(format!("expected {expected}, got {}", got.unwrap_or_default()))
        })
    }
}

/// Creates a Python `ValueError` whose message is `why`.
pub(super) fn wrong(why: impl Display) -> PyErr {
    PyValueError::new_err(why.to_string())
}

/// Returns the numbers of a list. Does not copy them if they are contiguous in memory.
pub(super) fn slice<'a>(numbers: &'a Numbers<'_>) -> Cow<'a, [f64]> {
    match numbers.as_slice() {
        Ok(numbers) => Cow::Borrowed(numbers),
        Err(_) => Cow::Owned(numbers.as_array().to_vec()),
    }
}

/// Returns the numbers of a list of length `N`. For any other length, returns an error that calls the list `what`.
pub(super) fn exactly<const N: usize>(numbers: &Numbers<'_>, what: &str) -> PyResult<[f64; N]> {
    let got = slice(numbers);
    <[f64; N]>::try_from(&*got).map_err(|_| wrong(format!("{what} has {} numbers, expected {N}", got.len())))
}

/// Returns the rows of a table of `width` columns. For any other width, returns an error that calls the table `what`.
pub(super) fn rows<'a>(table: &'a Rows<'_>, width: usize, what: &str) -> PyResult<ArrayView2<'a, f64>> {
    let rows = table.as_array();
    match rows.ncols() == width {
        true => Ok(rows),
        false => Err(wrong(format!("the rows of {what} have {} numbers, expected {width}", rows.ncols()))),
    }
}

/// Converts numbers to a numpy array.
pub(super) fn array<'py>(py: Python<'py>, numbers: &[f64]) -> Bound<'py, PyArray1<f64>> {
    PyArray1::from_slice(py, numbers)
}

/// Converts numbers to a table of `width` columns. The numbers are ordered row by row.
pub(super) fn table(py: Python<'_>, numbers: Vec<f64>, width: usize) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let rows = numbers.len() / width.max(1);
    Ok(Array2::from_shape_vec((rows, width), numbers).map_err(wrong)?.into_pyarray(py))
}

/// Converts a matrix of nalgebra to a numpy table.
pub(super) fn matrix<'py, R: nalgebra::Dim, C: nalgebra::Dim, S: nalgebra::RawStorage<f64, R, C>>(
    py: Python<'py>,
    matrix: &nalgebra::Matrix<f64, R, C, S>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let (rows, columns) = matrix.shape();
    let mut by_rows = Vec::with_capacity(rows * columns);
    for row in 0..rows {
        by_rows.extend((0..columns).map(|column| matrix[(row, column)]));
    }
    table(py, by_rows, columns)
}
