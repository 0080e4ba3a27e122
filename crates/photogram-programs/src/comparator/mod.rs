//! Calibration of a two-axis comparator from a grid plate measured in several placements (cases), in one adjustment.
//!
//! Unknowns are the coordinates of the grid points (each weighted from free to fixed), rotation and translation of every case, and the
//! comparator: two scales, nonorthogonality, and two polynomials. The polynomials (NOAA TR NOS 57, equations 36 and 59) exclude degrees 0
//! and 1, which equal the linear transformation. Observations are measured coordinates.
//!
//! Example: nine points of a plate, measured in two placements by a comparator whose x scale is wrong by ten millionths:
//!
//! ```
//! use photocore::adjustment::Options;
//! use photogram_programs::comparator::{
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

mod adjust;
mod measure;

use thiserror::Error;

use photocore::Stopped;
use photocore::adjustment::Adjustment;
use photocore::normals::LayoutError;

pub use measure::{Basis, Comparator, Measured, Placement};

/// A-priori placement of a plate.
#[derive(Debug, Clone, Copy)]
pub struct Case {
    /// Initial rotation and translation.
    pub placement: Placement,
    /// Whether the comparator is left-handed against the plate, so that X and Y of the grid are swapped.
    pub left_handed: bool,
}

/// A-priori point of a plate.
#[derive(Debug, Clone, Copy)]
pub struct GridPoint {
    /// Coordinates in the axes of the plate.
    pub xy: [f64; 2],
    /// Standard deviations: infinite free, zero fixed.
    pub sd: [f64; 2],
}

/// Mean of the pointings on a point in one case.
#[derive(Debug, Clone, Copy)]
pub struct Measurement {
    /// Index of the case.
    pub case: usize,
    /// Index of the grid point.
    pub point: usize,
    /// Measured coordinates.
    pub xy: [f64; 2],
    /// Standard deviations of the coordinates.
    pub sd: [f64; 2],
}

/// Calibration data of one comparator. All lengths, including the coefficients, have the same unit.
#[derive(Debug, Clone)]
pub struct Calibration {
    /// Initial scales, nonorthogonality and coefficients.
    pub comparator: Comparator,
    /// Standard deviations of the coefficients about their initial values: infinite free, zero fixed.
    pub coefficient_sd: [Vec<f64>; 2],
    /// Cases.
    pub cases: Vec<Case>,
    /// Grid points of all plates.
    pub points: Vec<GridPoint>,
    /// Measurements.
    pub measurements: Vec<Measurement>,
}

/// Reason why a calibration cannot be adjusted. Cases and points are indices into the calibration.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum CalibrationError {
    /// A measurement has an invalid index of a case or point.
    #[error("measurement {0} names a case or point that is not in the calibration")]
    Index(usize),
    /// Wrong number of coefficients or of their standard deviations.
    #[error("the polynomials have {expected} coefficients each, not {found}")]
    Coefficients {
        /// Number of functions of the basis.
        expected: usize,
        /// Number of coefficients or standard deviations given.
        found: usize,
    },
    /// Points that are not determined by their measurements.
    #[error("{} grid points are not determined by their measurements", .0.len())]
    UndeterminedPoints(Vec<usize>),
    /// Undetermined combinations of unknowns: the cases that each combination moves, and whether it changes the comparator.
    #[error("{} combinations of the unknowns are not determined", .0.len())]
    Undetermined(Vec<(Vec<usize>, bool)>),
    /// The initial values give coordinates that are not finite.
    #[error("the initial values give coordinates that are not finite")]
    NotFinite,
    /// The computation was stopped by the caller, or lacks memory or threads.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// The number of unknowns exceeds the index range.
    #[error(transparent)]
    Layout(#[from] LayoutError),
}

/// Adjusted calibration. Cofactors are for a priori unit weight.
#[derive(Debug)]
pub struct Solution {
    /// Scales, nonorthogonality, coefficients of x, coefficients of y.
    pub comparator: Vec<f64>,
    /// Cofactors of the comparator parameters, square, row by row.
    pub comparator_cofactors: Vec<f64>,
    /// Rotation and translation of each case.
    pub cases: Vec<Placement>,
    /// Cofactors of rotation and translation of each case.
    pub case_cofactors: Vec<[[f64; 3]; 3]>,
    /// Coordinates of each grid point.
    pub points: Vec<[f64; 2]>,
    /// Cofactors of each grid point.
    pub point_cofactors: Vec<[[f64; 2]; 2]>,
    /// Redundancy numbers of the coordinates of each grid point as observations.
    pub point_redundancy: Vec<[f64; 2]>,
    /// Observed minus computed, per measurement.
    pub residuals: Vec<[f64; 2]>,
    /// Redundancy numbers of the measured coordinates.
    pub redundancy: Vec<[f64; 2]>,
    /// Weighted sum of squares of measurements and grid points.
    pub sum_of_squares: f64,
    /// Number of measurements and weighted unknowns minus number of unknowns.
    pub degrees_of_freedom: i64,
    /// Status, iterations and times.
    pub adjustment: Adjustment,
}
