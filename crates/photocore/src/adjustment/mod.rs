//! Least squares: weighted unknowns and observations, iteration, convergence, statistics. Knows no photograph.
//!
//! A [`Model`] says how observations follow from unknowns; a [`Problem`] adds what is known beforehand: the standard
//! deviation of every observation and of every unknown, from free (infinite) to fixed (zero). [`adjust`] iterates to the
//! least-squares solution and computes the cofactors of all unknowns and the redundancy numbers of all observations.

mod datum;
mod distributions;
mod loss;
mod normal_equations;
mod options;
mod problem;
mod published;
mod result;
mod run;
mod statistics;
mod strict;
mod trust_region;
mod walk;

pub use datum::{Datum, InDatum, in_datum};
pub use distributions::{
    Tail, chi_square, chi_square_quantile, fisher, fisher_limit, student, student_limit,
};
pub use loss::Loss;
pub use normal_equations::NormalEquations;
pub use options::{Criterion, Event, Iteration, Options, Phase, Status};
pub use problem::{Model, Problem};
pub(crate) use result::gib;
pub use result::{AdjustError, Adjustment, Seconds};
pub use run::adjust;
pub use statistics::{Counts, Observed, leading_matrix, standardized};
