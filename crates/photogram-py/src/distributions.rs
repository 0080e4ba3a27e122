//! Distributions of test statistics; the documentation is in `_photocore.pyi`.

use crate::arrays::{self, Array, Vector};
use numpy::PyArray1;
use photocore::adjustment::{self, Tail};
use pyo3::prelude::*;

fn tail(upper: bool) -> Tail {
    if upper { Tail::Upper } else { Tail::Lower }
}

/// Exports functions of floating-point numbers from the core.
macro_rules! functions {
    ($($name:ident($($argument:ident),*) -> $found:ty;)*) => {
        $(#[pyfunction]
        pub fn $name($($argument: f64),*) -> $found {
            adjustment::$name($($argument),*)
        })*
    };
}

functions! {
    student(t, dof) -> f64;
    student_limit(probability, dof) -> f64;
    fisher(x, first, second) -> f64;
    fisher_limit(probability, first, second) -> f64;
    noncentral_chi_square(x, dof, noncentrality) -> f64;
    noncentral_fisher(x, first, second, noncentrality) -> f64;
    detectable_noncentrality(level, power, first, second) -> f64;
    level_of_equal_power(noncentrality, power, dof) -> (f64, f64);
}

#[pyfunction]
#[pyo3(signature = (x, dof, *, upper = true))]
pub fn chi_square(x: f64, dof: f64, upper: bool) -> f64 {
    adjustment::chi_square(x, dof, tail(upper))
}

#[pyfunction]
#[pyo3(signature = (probability, dof, *, upper = true))]
pub fn chi_square_quantile(probability: f64, dof: f64, upper: bool) -> f64 {
    adjustment::chi_square_quantile(probability, dof, tail(upper))
}

#[pyfunction]
pub fn normal<'py>(py: Python<'py>, z: Array<'py>) -> PyResult<Vector<'py>> {
    let z = arrays::numbers("z", &z)?;
    Ok(PyArray1::from_vec(py, py.detach(|| z.iter().map(|&z| adjustment::normal(z)).collect())))
}

#[pyfunction]
pub fn log_chi_square<'py>(py: Python<'py>, x: Array<'py>, dof: Array<'py>) -> PyResult<Vector<'py>> {
    let (x, dof) = (arrays::numbers("x", &x)?, arrays::numbers("dof", &dof)?);
    let found =
        py.detach(|| x.iter().zip(&dof).map(|(&x, &dof)| adjustment::log_chi_square(x, dof)).collect());
    Ok(PyArray1::from_vec(py, found))
}

#[pyfunction]
pub fn log_fisher<'py>(
    py: Python<'py>,
    x: Array<'py>,
    first: Array<'py>,
    second: Array<'py>,
) -> PyResult<Vector<'py>> {
    let (x, first, second) =
        (arrays::numbers("x", &x)?, arrays::numbers("first", &first)?, arrays::numbers("second", &second)?);
    let found = py.detach(|| {
        let dof = first.iter().zip(&second);
        x.iter().zip(dof).map(|(&x, (&first, &second))| adjustment::log_fisher(x, first, second)).collect()
    });
    Ok(PyArray1::from_vec(py, found))
}
