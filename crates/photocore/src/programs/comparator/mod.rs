//! Calibration of a two-axis comparator from a grid plate measured in several placements (cases), all adjusted together.
//!
//! Unknowns are the coordinates of the grid points (each weighted from free to fixed), rotation and translation of every case, and
//! the comparator itself: two scales, lack of orthogonality, and two polynomials (NOAA TR NOS 57, equations 36 and 59, without the
//! terms of first and zeroth degree, which those of the linear transformation repeat). Observations are measured coordinates.
//!
//! Nine points of a plate, measured in two placements by a comparator whose x is too short by ten millionths:
//!
//! ```
//! use photocore::adjustment::Options;
//! use photocore::programs::comparator::{
//!     Basis, Calibration, Case, Comparator, GridPoint, Measurement, Placement,
//! };
//!
//! let comparator = |x_scale: f64| Comparator {
//!     scale: [x_scale, 1.0],
//!     nonorthogonality: 0.0,
//!     basis: Basis { degree: 1, centre: [0.0; 2], half_range: [1e5; 2] },
//!     coefficients: [vec![], vec![]],
//! };
//! let placements = [0.0, 1.5].map(|rotation| Placement { rotation, translation: [0.0; 2] });
//! let xy = |i: usize| [1e5 * (i % 3) as f64 - 1e5, 1e5 * (i / 3) as f64 - 1e5];
//! let measured = |(case, point): (usize, usize)| {
//!     let xy = comparator(1.0 + 10e-6).measure(xy(point), &placements[case]).xy;
//!     Measurement { case, point, xy, sd: [1.0; 2] }
//! };
//! let calibration = Calibration {
//!     comparator: comparator(1.0),
//!     coefficient_sd: [vec![], vec![]],
//!     cases: placements.map(|placement| Case { placement, left_handed: false }).to_vec(),
//!     points: (0..9).map(|i| GridPoint { xy: xy(i), sd: [0.25; 2] }).collect(),
//!     measurements: (0..18).map(|i| measured((i / 9, i % 9))).collect(),
//! };
//! let solution = calibration.adjust(&Options::default())?;
//! assert!((solution.comparator[0] - 1.0 - 10e-6).abs() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod measure;
mod model;

use std::ops::{ControlFlow, Range};

use thiserror::Error;

use crate::adjustment::{self, AdjustError, Adjustment, Event, Problem, leading_matrix};
use crate::normals::{Layout, LayoutError, Ordering, System};
use crate::{Stopped, Threads};

pub use measure::{Basis, Comparator, Measured, Placement};
use model::Comparison;

/// A placement of a plate as it is known beforehand.
#[derive(Debug, Clone, Copy)]
pub struct Case {
    /// Initial rotation and translation.
    pub placement: Placement,
    /// Whether the comparator is left-handed against the plate, so that X and Y of the grid change places.
    pub left_handed: bool,
}

/// A point of a plate as it is known beforehand.
#[derive(Debug, Clone, Copy)]
pub struct GridPoint {
    /// Coordinates in the axes of the plate.
    pub xy: [f64; 2],
    /// Standard deviations: infinite free, zero fixed.
    pub sd: [f64; 2],
}

/// The mean of the pointings on a point in one case.
#[derive(Debug, Clone, Copy)]
pub struct Measurement {
    /// Index of the case.
    pub case: usize,
    /// Index of the grid point.
    pub point: usize,
    /// Measured coordinates.
    pub xy: [f64; 2],
    /// Their standard deviations.
    pub sd: [f64; 2],
}

/// Everything measured on one comparator. All lengths are in one unit, that of the coefficients too.
#[derive(Debug, Clone)]
pub struct Calibration {
    /// Initial scales, lack of orthogonality and coefficients.
    pub comparator: Comparator,
    /// Standard deviations of the coefficients, about their initial values: infinite free, zero fixed.
    pub coefficient_sd: [Vec<f64>; 2],
    /// The cases.
    pub cases: Vec<Case>,
    /// The grid points, of all plates.
    pub points: Vec<GridPoint>,
    /// The measurements.
    pub measurements: Vec<Measurement>,
}

/// Why a calibration cannot be adjusted. Cases and points are indices into the calibration.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum CalibrationError {
    /// A measurement names a case or point that is not there.
    #[error("measurement {0} names a case or point that is not in the calibration")]
    Index(usize),
    /// Coefficients or their standard deviations are not as many as the basis has functions.
    #[error("the polynomials have {expected} coefficients each, not {found}")]
    Coefficients {
        /// Functions of the basis.
        expected: usize,
        /// Coefficients or standard deviations given.
        found: usize,
    },
    /// Points whose measurements do not determine them.
    #[error("{} grid points are not determined by their measurements", .0.len())]
    UndeterminedPoints(Vec<usize>),
    /// Combinations of unknowns that the measurements do not determine; for each the cases it moves, and whether it changes
    /// the comparator.
    #[error("{} combinations of the unknowns are not determined", .0.len())]
    Undetermined(Vec<(Vec<usize>, bool)>),
    /// The initial values give coordinates that are not finite.
    #[error("the initial values give coordinates that are not finite")]
    NotFinite,
    /// The work was stopped: by whoever watched it, or for want of memory or threads.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// More than can be numbered.
    #[error(transparent)]
    Layout(#[from] LayoutError),
}

/// An adjusted calibration. Cofactors are for a priori unit weight.
#[derive(Debug)]
pub struct Solution {
    /// Scales, lack of orthogonality, coefficients of x, coefficients of y.
    pub comparator: Vec<f64>,
    /// Their cofactors, square, row by row.
    pub comparator_cofactors: Vec<f64>,
    /// Rotation and translation of each case.
    pub cases: Vec<Placement>,
    /// Cofactors of rotation and translation of each case.
    pub case_cofactors: Vec<[[f64; 3]; 3]>,
    /// Coordinates of each grid point.
    pub points: Vec<[f64; 2]>,
    /// Cofactors of each grid point.
    pub point_cofactors: Vec<[[f64; 2]; 2]>,
    /// Redundancy numbers of the coordinates of each grid point as observations of themselves.
    pub point_redundancy: Vec<[f64; 2]>,
    /// Observed minus computed, measurement by measurement.
    pub residuals: Vec<[f64; 2]>,
    /// Redundancy numbers of the measured coordinates.
    pub redundancy: Vec<[f64; 2]>,
    /// Weighted sum of squares of measurements and grid points.
    pub sum_of_squares: f64,
    /// Measurements and weighted unknowns less unknowns.
    pub degrees_of_freedom: i64,
    /// Status, iterations and times.
    pub adjustment: Adjustment,
}

impl Calibration {
    /// Adjusts everything together by least squares. `watch` is called on the calling thread; when it breaks, the adjustment stops, on threads of its own.
    ///
    /// # Errors
    /// Those of [`Calibration::adjust_on`]; threads that cannot be started.
    pub fn adjust(&self, options: &adjustment::Options) -> Result<Solution, CalibrationError> {
        self.adjust_on(options, &Threads::new(options.threads)?, &mut adjustment::go_on)
    }

    /// The same on threads of the caller.
    ///
    /// # Errors
    /// A calibration that contradicts itself or leaves unknowns undetermined; an interruption.
    pub fn adjust_on(
        &self,
        options: &adjustment::Options,
        threads: &Threads,
        watch: &mut dyn FnMut(Event) -> ControlFlow<()>,
    ) -> Result<Solution, CalibrationError> {
        self.check()?;
        let problem = threads.install(|| self.problem())?;
        let cases = self.cases.len();
        let adjusted =
            adjustment::adjust(&problem, options, threads, watch).map_err(|error| match error {
                AdjustError::UndeterminedLocals(points) => CalibrationError::UndeterminedPoints(points),
                AdjustError::Undetermined(combinations) => CalibrationError::Undetermined(
                    combinations
                        .into_iter()
                        .map(|blocks| {
                            let (cases, comparator): (Vec<_>, Vec<_>) =
                                blocks.into_iter().partition(|&block| block < cases);
                            (cases, !comparator.is_empty())
                        })
                        .collect(),
                ),
                AdjustError::NotFinite => CalibrationError::NotFinite,
                AdjustError::Stopped(stopped) => CalibrationError::Stopped(stopped),
            })?;
        Ok(Solution::new(&problem, adjusted))
    }

    fn check(&self) -> Result<(), CalibrationError> {
        let expected = self.comparator.basis.functions();
        let lengths = self.comparator.coefficients.iter().chain(&self.coefficient_sd).map(Vec::len);
        if let Some(found) = lengths.into_iter().find(|&found| found != expected) {
            return Err(CalibrationError::Coefficients { expected, found });
        }
        let outside = |m: &Measurement| m.case >= self.cases.len() || m.point >= self.points.len();
        match self.measurements.iter().position(outside) {
            Some(measurement) => Err(CalibrationError::Index(measurement)),
            None => Ok(()),
        }
    }

    /// The least-squares problem: grid points are local blocks of two, cases retained blocks of three, the comparator one that all share.
    fn problem(&self) -> Result<Problem<Comparison>, CalibrationError> {
        let mut order: Vec<usize> = (0..self.measurements.len()).collect();
        order.sort_by_key(|&i| self.measurements[i].point);
        let measurements: Vec<Measurement> = order.iter().map(|&i| self.measurements[i]).collect();
        let start =
            (0..=self.points.len()).map(|point| measurements.partition_point(|m| m.point < point)).collect();
        let comparator = self.comparator.unknowns();
        let dims: Vec<usize> = self.cases.iter().map(|_| 3).chain([comparator.len()]).collect();
        let case_of = measurements.iter().map(|m| m.case as u32).collect();
        let shared = vec![self.cases.len() as u32; measurements.len()];
        let layout = Layout::new(2, 2, &dims, start, case_of)?
            .with_shared((0..=measurements.len()).collect(), shared)?;
        let points = self.points.iter().flat_map(|point| point.xy);
        let cases = self.cases.iter().flat_map(|case| {
            let Placement { rotation, translation: [x, y] } = case.placement;
            [rotation, x, y]
        });
        let initial: Vec<f64> = points.chain(cases).chain(comparator).collect();
        let free = vec![f64::INFINITY; 3 * self.cases.len() + 3];
        let sd = self.points.iter().flat_map(|point| point.sd).chain(free);
        Ok(Problem {
            observation_sd: measurements.iter().flat_map(|m| m.sd).collect(),
            system: System::new(layout, Ordering::Auto)?,
            prior: initial.clone(),
            initial,
            sd: sd.chain(self.coefficient_sd.iter().flatten().copied()).collect(),
            model: Comparison {
                basis: self.comparator.basis,
                left_handed: self.cases.iter().map(|case| case.left_handed).collect(),
                measurements,
                order,
            },
        })
    }
}

impl Solution {
    fn new(problem: &Problem<Comparison>, mut adjustment: Adjustment) -> Self {
        let unknowns = std::mem::take(&mut adjustment.unknowns);
        let layout = problem.layout();
        let cofactors = adjustment.cofactors.take();
        let prior_redundancy = adjustment.prior_redundancy.take();
        let residuals = std::mem::take(&mut adjustment.residuals);
        let redundancy = adjustment.redundancy.take();
        let sum_of_squares = problem.sum_of_squares(&residuals)
            + problem.any().terms(&unknowns).sum_of_squares(0..unknowns.len());
        let cases = problem.model.left_handed.len();
        let (placements, comparator) =
            (layout.all_retained().start..layout.retained_range(cases).start, layout.retained_range(cases));
        let missing = || vec![f64::NAN; comparator.len().pow(2)];
        let (case_cofactors, comparator_cofactors) = match &cofactors {
            Some(all) => (Some(&all.retained[..9 * cases]), all.retained[9 * cases..].to_vec()),
            None => (None, missing()),
        };
        Self {
            comparator: unknowns[comparator].to_vec(),
            comparator_cofactors,
            cases: unknowns[placements].as_chunks().0.iter().map(|&v| Placement::from(v)).collect(),
            case_cofactors: squares(case_cofactors, cases),
            points: unknowns[layout.all_locals()].as_chunks().0.to_vec(),
            point_cofactors: squares(cofactors.as_ref().map(|all| &all.local[..]), layout.locals()),
            point_redundancy: pairs(prior_redundancy.as_deref(), 0..layout.locals()),
            residuals: problem.model.in_given_order(pairs(Some(&residuals), 0..layout.groups())),
            redundancy: problem.model.in_given_order(pairs(redundancy.as_deref(), 0..layout.groups())),
            sum_of_squares,
            degrees_of_freedom: adjustment.counts.degrees_of_freedom(),
            adjustment,
        }
    }
}

fn pairs(values: Option<&[f64]>, range: Range<usize>) -> Vec<[f64; 2]> {
    range.map(|i| values.map_or([f64::NAN; 2], |values| [values[2 * i], values[2 * i + 1]])).collect()
}

fn squares<const N: usize>(values: Option<&[f64]>, count: usize) -> Vec<[[f64; N]; N]> {
    (0..count).map(|k| leading_matrix(values.map(|all| &all[N * N * k..]))).collect()
}
