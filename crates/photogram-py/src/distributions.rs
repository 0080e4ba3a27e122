//! Distributions of test statistics; their documentation is in `_photocore.pyi`.

use photocore::adjustment::{self, Tail};
use pyo3::prelude::*;

/// Adds the functions to the extension module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(chi_square, module)?)?;
    module.add_function(wrap_pyfunction!(chi_square_quantile, module)?)?;
    module.add_function(wrap_pyfunction!(student, module)?)?;
    module.add_function(wrap_pyfunction!(student_limit, module)?)?;
    module.add_function(wrap_pyfunction!(fisher, module)?)?;
    module.add_function(wrap_pyfunction!(fisher_limit, module)?)
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
