//! Least-squares adjustment: weighted unknowns and observations, iteration, convergence, statistics. Independent of photogrammetry.
//!
//! A [`Model`] computes observations from unknowns. A [`Problem`] adds the priors and the standard deviation of every observation and every
//! unknown, from free (infinite) to fixed (zero). [`Problem::adjust`] iterates to the least-squares solution. It computes the cofactors of
//! all unknowns and the redundancy numbers of all observations.
//!
//! Example: a levelling network with heights of points (local blocks of one unknown) and instruments (retained blocks of one unknown). The
//! first point is a fixed benchmark.
//!
//! ```
//! use photocore::adjustment::{Evaluated, Model, Options, Problem, Status};
//! use photocore::normals::{GroupRows, Layout, Ordering, System};
//!
//! struct Levelling {
//!     /// Each reading with its instrument, point by point.
//!     readings: Vec<(f64, usize)>,
//! }
//!
//! /// The net at given heights.
//! struct At<'a> {
//!     net: &'a Levelling,
//!     heights: Vec<f64>,
//! }
//!
//! impl Model for Levelling {
//!     fn at<'a>(&'a self, heights: &[f64]) -> Box<dyn Evaluated + 'a> {
//!         Box::new(At { net: self, heights: heights.to_vec() })
//!     }
//! }
//!
//! impl Evaluated for At<'_> {
//!     fn observe(&self, point: usize, reading: usize, rows: &mut GroupRows<'_>) {
//!         let (value, instrument) = self.net.readings[reading];
//!         rows.constant[0] = value - (self.heights[point] - self.heights[3 + instrument]);
//!         rows.local[0] = 1.0;
//!         rows.retained[0] = -1.0;
//!     }
//! }
//!
//! // Three points, each read from two instruments.
//! let readings = vec![(1.001, 0), (2.0, 1), (1.5, 0), (2.498, 1), (0.3, 0), (1.301, 1)];
//! let layout = Layout::new(1, 1, &[1, 1], vec![0, 2, 4, 6], vec![0, 1, 0, 1, 0, 1])?;
//! let problem = Problem {
//!     model: Levelling { readings },
//!     system: System::new(layout, Ordering::Auto)?,
//!     observation_sd: vec![0.001; 6],
//!     initial: vec![100.0, 0.0, 0.0, 0.0, 0.0],
//!     prior: vec![0.0; 5],
//!     sd: [vec![0.0], vec![f64::INFINITY; 4]].concat(),
//! };
//! let adjusted = problem.adjust(&Options::default())?;
//! assert_eq!(adjusted.status, Status::Converged);
//! assert!((adjusted.unknowns[1] - 100.4985).abs() < 1e-9);
//! assert_eq!(adjusted.counts.degrees_of_freedom(), 2);
//! let redundancy: f64 = adjusted.redundancy.iter().flatten().sum();
//! assert!((redundancy - 2.0).abs() < 1e-12);
//! // Its cofactor: half the variance of a reading from each end, for each of two ways.
//! assert!((adjusted.cofactors.expect("asked for").local[1] - 1e-6).abs() < 1e-15);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod acceleration;
mod additional;
mod alone;
mod anderson;
mod control;
mod datum;
mod distributions;
mod end;
mod equations;
mod final_results;
mod group_test;
mod leverages;
mod linearized;
mod loss;
mod motions;
mod noncentral;
mod observation_rows;
mod options;
mod prior_terms;
mod problem;
mod result;
mod run;
mod score_parts;
mod statistics;
mod steps;
mod traces;
mod transformation;
mod walk;

pub use additional::{Additional, AdditionalParameters, Equation, Shared};
pub use alone::Alone;
pub use control::step_rules;
#[doc(hidden)]
pub use datum::moved;
pub use datum::{Adjusted, Datum, DatumError};
pub use distributions::{
    Tail, chi_square, chi_square_quantile, fisher, fisher_limit, log_chi_square, log_fisher, normal, student,
    student_limit,
};
pub use equations::EquationOf;
#[doc(hidden)]
pub use equations::ObservationEquations;
pub use group_test::{
    GroupTest, SmallVector, VISIBLE, correlation_above, leverage_odds, may_correlate, whitening,
};
pub use leverages::Leverages;
pub use linearized::{CofactorError, Inverted, Linearized};
pub use loss::Loss;
#[doc(hidden)]
pub use loss::Reweighting;
pub use motions::Classes;
pub use noncentral::{
    detectable_noncentrality, level_of_equal_power, noncentral_chi_square, noncentral_fisher,
};
pub use observation_rows::ObservationRows;
pub use options::{History, Method, Options, Published, Status, Stop};
pub use prior_terms::{PriorTerm, PriorTerms};
pub use problem::{AnyProblem, Evaluated, Model, Motions, Problem};
pub(crate) use result::format_bytes;
pub use result::{AdjustError, Adjustment, PhaseTimes, SolverStats};
pub use run::{Requests, adjust, adjust_with};
pub use score_parts::{Groups, ScoreParts};
#[doc(hidden)]
pub use statistics::median;
pub use statistics::{Counts, Observed, leading_matrix, standardized};
pub(crate) use statistics::{middle, weighted};
pub use traces::{EquationGroups, GroupSquares, Probing};
#[doc(hidden)]
pub use transformation::Transformation;
