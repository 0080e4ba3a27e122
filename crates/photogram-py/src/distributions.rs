//! Distributions of test statistics; the documentation is in `_photocore.pyi`.

use crate::arrays::{Array, Vector, check_lengths, numbers};
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

/// Exports functions of arrays of equal length from the core.
macro_rules! array_functions {
    ($($name:ident($first:ident $(, $other:ident)*);)*) => {
        $(#[pyfunction]
        pub fn $name<'py>(
            py: Python<'py>, $first: Array<'py>, $($other: Array<'py>),*
        ) -> PyResult<Vector<'py>> {
            let $first = numbers(stringify!($first), &$first)?;
            $(let $other = numbers(stringify!($other), &$other)?;)*
            check_lengths((stringify!($first), $first.len()), &[$((stringify!($other), $other.len())),*])?;
            let value = |k: usize| adjustment::$name($first[k] $(, $other[k])*);
            Ok(PyArray1::from_vec(py, py.detach(|| (0..$first.len()).map(value).collect())))
        })*
    };
}

array_functions! {
    normal(z);
    log_chi_square(x, dof);
    log_fisher(x, first, second);
}
