//! Arrays in and out.

use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1};
use pyo3::prelude::*;
use slipstick::design::ElementValues;

/// Densities of all elements; the package has checked their number and range.
pub fn densities(values: &PyReadonlyArray1<'_, f64>) -> ElementValues {
    values.as_array().iter().copied().collect()
}

/// A table with rows of equal length.
pub fn table<'py, const N: usize>(py: Python<'py>, rows: &[[f64; N]]) -> Bound<'py, PyArray2<f64>> {
    matrix(py, rows.as_flattened().to_vec(), N)
}

/// A table with `columns` columns from its entries, row by row.
pub fn matrix<T: numpy::Element>(py: Python<'_>, entries: Vec<T>, columns: usize) -> Bound<'_, PyArray2<T>> {
    let rows = entries.len() / columns.max(1);
    Array2::from_shape_vec((rows, columns), entries).expect("whole rows").into_pyarray(py)
}

/// Node or element numbers as numpy indexes them.
pub fn numbers(py: Python<'_>, numbers: impl IntoIterator<Item = u32>) -> Bound<'_, PyArray1<i64>> {
    numbers.into_iter().map(i64::from).collect::<Vec<_>>().into_pyarray(py)
}
