//! Distributions of test statistics; their documentation is in `_photocore.pyi`.

use crate::arrays;
use numpy::{PyArray1, PyReadonlyArrayDyn};
use photocore::adjustment::{self, Tail};
use pyo3::prelude::*;

/// Adds the functions to the extension module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(chi_square, module)?)?;
    module.add_function(wrap_pyfunction!(chi_square_quantile, module)?)?;
    module.add_function(wrap_pyfunction!(normal, module)?)?;
    module.add_function(wrap_pyfunction!(student, module)?)?;
    module.add_function(wrap_pyfunction!(student_limit, module)?)?;
    module.add_function(wrap_pyfunction!(fisher, module)?)?;
    module.add_function(wrap_pyfunction!(fisher_limit, module)?)?;
    module.add_function(wrap_pyfunction!(log_chi_square, module)?)?;
    module.add_function(wrap_pyfunction!(log_fisher, module)?)?;
    module.add_function(wrap_pyfunction!(noncentral_chi_square, module)?)?;
    module.add_function(wrap_pyfunction!(noncentral_fisher, module)?)?;
    module.add_function(wrap_pyfunction!(detectable_noncentrality, module)?)?;
    module.add_function(wrap_pyfunction!(level_of_equal_power, module)?)
}

fn tail(upper: bool) -> Tail {
    if upper { Tail::Upper } else { Tail::Lower }
}

#[pyfunction]
#[pyo3(signature = (x, dof, *, upper = true))]
fn chi_square(x: f64, dof: f64, upper: bool) -> f64 {
    adjustment::chi_square(x, dof, tail(upper))
}

#[pyfunction]
#[pyo3(signature = (probability, dof, *, upper = true))]
fn chi_square_quantile(probability: f64, dof: f64, upper: bool) -> f64 {
    adjustment::chi_square_quantile(probability, dof, tail(upper))
}

#[pyfunction]
fn normal<'py>(py: Python<'py>, z: PyReadonlyArrayDyn<'py, f64>) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let z = arrays::numbers("z", &z)?;
    Ok(PyArray1::from_vec(py, py.detach(|| z.iter().map(|&z| adjustment::normal(z)).collect())))
}

#[pyfunction]
fn student(t: f64, dof: f64) -> f64 {
    adjustment::student(t, dof)
}

#[pyfunction]
fn student_limit(probability: f64, dof: f64) -> f64 {
    adjustment::student_limit(probability, dof)
}

#[pyfunction]
fn fisher(x: f64, first: f64, second: f64) -> f64 {
    adjustment::fisher(x, first, second)
}

#[pyfunction]
fn fisher_limit(probability: f64, first: f64, second: f64) -> f64 {
    adjustment::fisher_limit(probability, first, second)
}

#[pyfunction]
fn log_chi_square<'py>(
    py: Python<'py>,
    x: PyReadonlyArrayDyn<'py, f64>,
    dof: PyReadonlyArrayDyn<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let (x, dof) = (arrays::numbers("x", &x)?, arrays::numbers("dof", &dof)?);
    let found =
        py.detach(|| x.iter().zip(&dof).map(|(&x, &dof)| adjustment::log_chi_square(x, dof)).collect());
    Ok(PyArray1::from_vec(py, found))
}

#[pyfunction]
fn log_fisher<'py>(
    py: Python<'py>,
    x: PyReadonlyArrayDyn<'py, f64>,
    first: PyReadonlyArrayDyn<'py, f64>,
    second: PyReadonlyArrayDyn<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let (x, first, second) =
        (arrays::numbers("x", &x)?, arrays::numbers("first", &first)?, arrays::numbers("second", &second)?);
    let found = py.detach(|| {
        let dof = first.iter().zip(&second);
        x.iter().zip(dof).map(|(&x, (&first, &second))| adjustment::log_fisher(x, first, second)).collect()
    });
    Ok(PyArray1::from_vec(py, found))
}

#[pyfunction]
fn noncentral_chi_square(x: f64, dof: f64, noncentrality: f64) -> f64 {
    adjustment::noncentral_chi_square(x, dof, noncentrality)
}

#[pyfunction]
fn noncentral_fisher(x: f64, first: f64, second: f64, noncentrality: f64) -> f64 {
    adjustment::noncentral_fisher(x, first, second, noncentrality)
}

#[pyfunction]
fn detectable_noncentrality(level: f64, power: f64, first: f64, second: f64) -> f64 {
    adjustment::detectable_noncentrality(level, power, first, second)
}

#[pyfunction]
fn level_of_equal_power(noncentrality: f64, power: f64, dof: f64) -> (f64, f64) {
    adjustment::level_of_equal_power(noncentrality, power, dof)
}
