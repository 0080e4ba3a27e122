//! Conversion of NumPy arrays; shapes are checked, and errors name the argument.

use std::borrow::Cow;

use nalgebra::DMatrix;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use photocore::geometry::Matrix3;
use pyo3::import_exception;
use pyo3::prelude::*;

/// Floating-point numbers and indices from Python, of any shape.
pub type Array<'py> = PyReadonlyArrayDyn<'py, f64>;
pub type Indices<'py> = PyReadonlyArrayDyn<'py, i64>;
/// Floating-point arrays for Python: (n,), (n, N), (n, M, N).
pub type Vector<'py> = Bound<'py, PyArray1<f64>>;
pub type Matrix<'py> = Bound<'py, PyArray2<f64>>;
pub type Blocks<'py> = Bound<'py, PyArray3<f64>>;

// A ValueError of the package, so that handlers of its errors catch it.
import_exception!(photogram.errors, InputError);

/// Returns the rows of an (n, N) array.
pub fn rows<const N: usize>(name: &str, array: &Array<'_>) -> PyResult<Vec<[f64; N]>> {
    rows_in_place(name, array).map(Cow::into_owned)
}

/// Returns the rows of an (n, N) array, without a copy if it is contiguous.
pub fn rows_in_place<'a, const N: usize>(name: &str, array: &'a Array<'_>) -> PyResult<Cow<'a, [[f64; N]]>> {
    match array.shape() {
        [_, columns] if *columns == N => Ok(match array.as_array().to_slice() {
            Some(values) => Cow::Borrowed(values.as_chunks().0),
            None => Cow::Owned(chunks(values(array))),
        }),
        shape => Err(wrong_shape(name, &format!("(n, {N})"), shape)),
    }
}

/// Returns the rows of an (n, `columns`) array.
pub fn slices(name: &str, array: &Array<'_>, columns: usize) -> PyResult<Vec<Vec<f64>>> {
    match array.shape() {
        [_, found] if *found == columns => Ok(values(array).chunks(columns).map(<[f64]>::to_vec).collect()),
        shape => Err(wrong_shape(name, &format!("(n, {columns})"), shape)),
    }
}

/// Returns the matrices of an (n, N, N) array.
pub fn matrices<const N: usize>(name: &str, array: &Array<'_>) -> PyResult<Vec<[[f64; N]; N]>> {
    match array.shape() {
        [_, rows, columns] if [*rows, *columns] == [N, N] => Ok(chunks(chunks(values(array)))),
        shape => Err(wrong_shape(name, &format!("(n, {N}, {N})"), shape)),
    }
}

/// Returns the numbers of an (n,) array.
pub fn numbers(name: &str, array: &Array<'_>) -> PyResult<Vec<f64>> {
    match array.shape() {
        [_] => Ok(values(array)),
        shape => Err(wrong_shape(name, "(n,)", shape)),
    }
}

/// Returns the nonnegative indices of an (n,) array.
pub fn indices(name: &str, array: &Indices<'_>) -> PyResult<Vec<usize>> {
    Ok(indices_in_place(name, array)?.iter().map(|&index| index as usize).collect())
}

/// Returns the nonnegative indices of an (n,) array, without a copy if it is contiguous.
pub fn indices_in_place<'a>(name: &str, array: &'a Indices<'_>) -> PyResult<Cow<'a, [i64]>> {
    let [_] = array.shape() else { return Err(wrong_shape(name, "(n,)", array.shape())) };
    let view = array.as_array();
    let all = view.to_slice().map_or_else(|| Cow::Owned(view.iter().copied().collect()), Cow::Borrowed);
    match all.iter().find(|index| **index < 0) {
        Some(index) => Err(InputError::new_err(format!("{name} holds the negative index {index}"))),
        None => Ok(all),
    }
}

/// Returns the rows of an (n, N) array of group numbers; negative numbers (without group) become the largest number.
pub fn group_rows<const N: usize>(name: &str, array: &Indices<'_>) -> PyResult<Vec<[usize; N]>> {
    let number = |&group: &i64| usize::try_from(group).unwrap_or(usize::MAX);
    match array.shape() {
        [_, columns] if *columns == N => {
            let numbers: Vec<usize> = array.as_array().iter().map(number).collect();
            Ok(numbers.as_chunks().0.to_vec())
        }
        shape => Err(wrong_shape(name, &format!("(n, {N})"), shape)),
    }
}

/// Converts rows to an (n, N) array.
pub fn table<const N: usize>(py: Python<'_>, rows: Vec<[f64; N]>) -> PyResult<Matrix<'_>> {
    let count = rows.len();
    PyArray1::from_vec(py, rows.into_flattened()).reshape([count, N])
}

/// Converts matrices to an (n, M, N) array.
pub fn blocks<const M: usize, const N: usize>(
    py: Python<'_>,
    matrices: Vec<[[f64; N]; M]>,
) -> PyResult<Blocks<'_>> {
    let count = matrices.len();
    PyArray1::from_vec(py, matrices.into_flattened().into_flattened()).reshape([count, M, N])
}

/// Returns the rows of a matrix.
pub fn row_major(matrix: &Matrix3) -> [[f64; 3]; 3] {
    matrix.transpose().data.0
}

/// Returns the matrix of given rows.
pub fn from_rows(rows: [[f64; 3]; 3]) -> Matrix3 {
    Matrix3::from(rows).transpose()
}

/// Checks that arrays have the length of the first one.
pub fn check_lengths(first: (&str, usize), others: &[(&str, usize)]) -> PyResult<()> {
    match others.iter().find(|(_, length)| *length != first.1) {
        None => Ok(()),
        Some((name, length)) => {
            Err(InputError::new_err(format!("{name} has {length} rows, but {} has {}", first.0, first.1)))
        }
    }
}

pub fn values(array: &Array<'_>) -> Vec<f64> {
    let view = array.as_array();
    view.as_slice().map_or_else(|| view.iter().copied().collect(), <[f64]>::to_vec)
}

fn chunks<T: Copy, const N: usize>(values: Vec<T>) -> Vec<[T; N]> {
    values.as_chunks().0.to_vec()
}

fn wrong_shape(name: &str, expected: &str, shape: &[usize]) -> PyErr {
    let shape = shape.iter().map(usize::to_string).collect::<Vec<_>>().join(", ");
    InputError::new_err(format!("{name} has the shape ({shape}), not {expected}"))
}

/// Converts a matrix to an array (rows, columns); a symmetric matrix is not copied.
pub fn matrix(py: Python<'_>, found: DMatrix<f64>, symmetric: bool) -> PyResult<Matrix<'_>> {
    let shape = [found.nrows(), found.ncols()];
    let rows = if symmetric { found } else { found.transpose() };
    PyArray1::from_vec(py, rows.data.into()).reshape(shape)
}
