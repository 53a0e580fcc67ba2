//! Conversions from and to numpy arrays.

use numpy::ndarray::{Array2, ArrayView2};
use numpy::{AllowTypeChange, IntoPyArray, PyArray1, PyArray2, PyArrayLike1, PyArrayLike2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::borrow::Cow;
use std::fmt::Display;

/// A list of numbers from Python: an array, a list or a tuple.
pub(super) type Numbers<'py> = PyArrayLike1<'py, f64, AllowTypeChange>;

/// A table of numbers with one row per configuration.
pub(super) type Rows<'py> = PyArrayLike2<'py, f64, AllowTypeChange>;

/// Converts an error to a Python `ValueError` with this crate's message.
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
