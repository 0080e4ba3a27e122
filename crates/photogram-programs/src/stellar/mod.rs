//! Stellar camera calibration (NOAA TR NOS 55): joint adjustment of star directions, camera attitudes and interior parameters.
//!
//! Stars are local blocks of two unknowns. Each attitude is a retained block; interior parameters and refraction coefficients are one
//! shared block. A direction of the axis and weights of parameters are constraints. A fixed star does not couple attitudes: each of its
//! images has a separate local block.
//!
//! Unit weight refers to the plate coordinates: its mean error has the unit of a coordinate times the root of a weight.
//!
//! Example: a camera of 300 mm with principal distance and attitude known to some millimetres and minutes of arc, and nine stars:
//!
//! ```
//! use photocore::adjustment;
//! use photogram_programs::sky::{Air, REFRACTION, Station};
//! use photogram_programs::stellar::{
//!     Attitude, COMMON, Calibration, Camera, Decentering, Form, Image, Kind, Options, Star, Weights,
//! };
//!
//! let station = Station::new(0.6, 0.0, Air::new(290.0, 750.0));
//! let kind = Kind { lens: None, form: Form::ScaleFirst, decentering: Decentering::Polar, common_scale: true };
//! let (attitude, time) = ([0.2, -0.1, 0.6], 1.0);
//! let mut common = [0.0; COMMON];
//! (common[3], common[4]) = (0.3, 0.3); // principal distances in metres
//! common[COMMON - 4..].copy_from_slice(&REFRACTION);
//! let camera = Camera::new(&kind, std::array::from_fn(|k| common[k]));
//!
//! let (mut stars, mut images) = (vec![], vec![]);
//! for star in 0..9 {
//!     // A grid of three by three around the zenith, where the camera sees it.
//!     let standard = [0.1 * (star % 3) as f64, 0.1 * (star / 3) as f64];
//!     let place = station.place(standard, time, &REFRACTION);
//!     stars.push(Star { place, catalogue: place, weight: None, fixed: true });
//!     let seen = station.standard(place, time, &REFRACTION);
//!     let xy = camera.linearize(&Attitude::new(attitude), seen.coordinates).xy;
//!     let weight = [[1.0, 0.0], [0.0, 1.0]];
//!     images.push(Image { star, pointing: 0, xy, weight, sidereal_time: time, shift: [0.0; 2] });
//! }
//! let initial = [attitude[0] + 1e-3, attitude[1] - 1e-3, attitude[2] + 2e-3];
//! let mut fixed = vec![true; 3 + COMMON];
//! fixed[..3].fill(false);
//! fixed[3 + 3] = false; // the principal distance, the same in x and y
//! (common[3], common[4]) = (0.303, 0.303);
//! let calibration = Calibration {
//!     station,
//!     kind,
//!     pointings: vec![initial],
//!     common,
//!     fixed,
//!     weights: Weights { parameters: vec![], values: vec![], root: vec![] },
//!     stars,
//!     images,
//!     axis: None,
//! };
//! let options = Options { adjustment: adjustment::Options::default(), unit: 1e-6, whole: false };
//! let solution = calibration.adjust(&options)?;
//! assert!((solution.parameters[3 + 3] - 0.3).abs() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod adjust;
mod camera;
mod cycle;
mod hypotheses;
mod model;
mod published;
mod solution;

use thiserror::Error;

use crate::sky::Station;
use photocore::normals::LayoutError;
use photocore::{Stopped, adjustment};

pub use camera::{Attitude, Camera, Decentering, Form, INTERIOR, Kind, PlateImage};
pub use hypotheses::{Agreement, Similarity, best_voted, hypotheses};
pub use model::{Rows, Tolerances};
pub use published::{Correction, PublishedRows};
pub use solution::{Observations, ParameterCofactors, Solution, Tested};

/// Number of coefficients of refraction.
pub const TAU: usize = 4;
/// Number of shared unknowns.
pub const COMMON: usize = INTERIOR + TAU;

/// A-priori star.
#[derive(Debug, Clone, Copy)]
pub struct Star {
    /// Initial right ascension and declination in radians.
    pub place: [f64; 2],
    /// Catalogue right ascension and declination in radians.
    pub catalogue: [f64; 2],
    /// Weights of right ascension and declination; None for an unknown direction.
    pub weight: Option<[[f64; 2]; 2]>,
    /// Whether the initial direction is fixed.
    pub fixed: bool,
}

/// Image of a star.
#[derive(Debug, Clone, Copy)]
pub struct Image {
    /// Index of the star.
    pub star: usize,
    /// Index of the attitude.
    pub pointing: usize,
    /// Measured plate coordinates.
    pub xy: [f64; 2],
    /// Weights of the plate coordinates.
    pub weight: [[f64; 2]; 2],
    /// Local apparent sidereal time in radians.
    pub sidereal_time: f64,
    /// Apparent direction of the star at the time of this image minus the adjusted direction, in radians.
    pub shift: [f64; 2],
}

/// Direction of the camera axis known from other sources (equation 72).
#[derive(Debug, Clone, Copy)]
pub struct Axis {
    /// Index of the attitude.
    pub pointing: usize,
    /// Standard coordinates of the direction.
    pub standard: [f64; 2],
    /// Undistorted plate coordinates of its image.
    pub xy: [f64; 2],
    /// Weights of the plate coordinates.
    pub weight: [[f64; 2]; 2],
}

/// Weighted parameters: given values and their weight matrix.
#[derive(Debug, Clone)]
pub struct Weights {
    /// Indices of the parameters: attitudes three each, then the shared ones.
    pub parameters: Vec<usize>,
    /// Given values.
    pub values: Vec<f64>,
    /// Upper triangular root R of the weight matrix P = R^T R, row by row.
    pub root: Vec<f64>,
}

/// Input of a calibration.
#[derive(Debug, Clone)]
pub struct Calibration {
    /// Observing station.
    pub station: Station,
    /// Camera model.
    pub kind: Kind,
    /// Initial alpha, omega, kappa of every attitude in radians.
    pub pointings: Vec<[f64; 3]>,
    /// Initial interior parameters, then coefficients of refraction in seconds of arc.
    pub common: [f64; COMMON],
    /// Whether each parameter is fixed: attitudes three each, then the shared ones.
    pub fixed: Vec<bool>,
    /// Weights of parameters.
    pub weights: Weights,
    /// Stars.
    pub stars: Vec<Star>,
    /// Images.
    pub images: Vec<Image>,
    /// Known axis direction.
    pub axis: Option<Axis>,
}

/// Options of the adjustment.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// Options of the engine: convergence and requested results.
    pub adjustment: adjustment::Options,
    /// Expected mean error of unit weight.
    pub unit: f64,
    /// Whether to compute the full cofactor matrix of the parameters, if cofactors are requested: one right-hand side per parameter.
    pub whole: bool,
}

/// Reason why a calibration cannot be adjusted.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum StellarError {
    /// Invalid index of a star, an attitude or a weighted parameter.
    #[error("{0} names a star, an attitude or a parameter that is not there")]
    Index(String),
    /// The lens has more parameters than the interior parameters can store.
    #[error("the lens has more than {INTERIOR} parameters")]
    Lens,
    /// A weight matrix is not positive definite.
    #[error("the weight matrix of {0} is not positive definite")]
    Weight(String),
    /// Stars with too few images.
    #[error("{} stars are not determined by their images", .0.len())]
    UndeterminedStars(Vec<usize>),
    /// Undetermined combinations of unknowns: the parameters of each combination.
    #[error("{} combinations of parameters are not determined by the stars", .0.len())]
    Undetermined(Vec<Vec<usize>>),
    /// Stars without an image at the initial values.
    #[error("the initial values put a star below the horizon or behind the camera")]
    NotFinite(Vec<usize>),
    /// The computation was stopped by the caller, or lacks memory or threads.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// The number of unknowns exceeds the index range.
    #[error(transparent)]
    Layout(#[from] LayoutError),
}
