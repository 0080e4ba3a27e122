//! Least squares: weighted unknowns and observations, iteration, convergence, statistics. Knows no photograph.
//!
//! A [`Model`] says how observations follow from unknowns; a [`Problem`] adds what is known beforehand: the standard
//! deviation of every observation and of every unknown, from free (infinite) to fixed (zero). [`adjust`] iterates to the
//! least-squares solution and computes the cofactors of all unknowns and the redundancy numbers of all observations.

mod iterate;
mod problem;
mod statistics;

pub use iterate::{
    AdjustError, Adjustment, Criterion, Event, Iteration, Options, Phase, Seconds, Status, adjust,
};
pub use problem::{Model, Problem};
pub use statistics::{Counts, leading_matrix, standardized};
