//! Calibration of a camera by stars (NOAA TR NOS 55): directions of stars, attitudes of the camera and its interior parameters
//! adjusted together.
//!
//! Stars are the local unknowns, two each; attitudes are a retained block each, and the interior parameters and coefficients of refraction
//! one that all images share. A direction of the axis and weights of parameters are ties. A star that is held ties no attitudes to each other: each
//! of its images has a local block of its own.
//!
//! Unit weight is that of the plate coordinates' weights: its mean error has their unit over the root of theirs.
//!
//! A camera of 300 mm whose principal distance and attitude are known to some millimetres and minutes of arc, and nine stars:
//!
//! ```
//! use photocore::adjustment;
//! use photocore::geometry::{Air, Station, sky::REFRACTION};
//! use photocore::programs::stellar::{
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

use crate::geometry::Station;
use crate::normals::LayoutError;
use crate::{Stopped, adjustment};

pub use camera::{Attitude, Camera, Decentering, Form, INTERIOR, Kind, PlateImage};
pub use hypotheses::{Agreement, Similarity, best_voted, hypotheses};
pub use model::{Rows, Tolerances};
pub use published::{Correction, PublishedRows};
pub use solution::{Observations, ParameterCofactors, Solution, Tested};

/// Number of coefficients of refraction.
pub const TAU: usize = 4;
/// Number of unknowns that all images share.
pub const COMMON: usize = INTERIOR + TAU;

/// A star as it is known beforehand.
#[derive(Debug, Clone, Copy)]
pub struct Star {
    /// Initial right ascension and declination in radians.
    pub place: [f64; 2],
    /// Those of the catalogue.
    pub catalogue: [f64; 2],
    /// Weights of right ascension and declination; None for a direction that is not known.
    pub weight: Option<[[f64; 2]; 2]>,
    /// Whether the initial place is held as it is.
    pub fixed: bool,
}

/// An image of a star.
#[derive(Debug, Clone, Copy)]
pub struct Image {
    /// Index of its star.
    pub star: usize,
    /// Index of its attitude.
    pub pointing: usize,
    /// Measured plate coordinates.
    pub xy: [f64; 2],
    /// Their weights.
    pub weight: [[f64; 2]; 2],
    /// Local apparent sidereal time in radians.
    pub sidereal_time: f64,
    /// The star's apparent place at the time of this image minus the place adjusted, in radians.
    pub shift: [f64; 2],
}

/// A direction of the camera's axis that is known from outside (equation 72).
#[derive(Debug, Clone, Copy)]
pub struct Axis {
    /// Index of the attitude.
    pub pointing: usize,
    /// Standard coordinates of the direction.
    pub standard: [f64; 2],
    /// Undistorted plate coordinates of its image.
    pub xy: [f64; 2],
    /// Their weights.
    pub weight: [[f64; 2]; 2],
}

/// Weighted parameters: given values and their weight matrix.
#[derive(Debug, Clone)]
pub struct Weights {
    /// Which parameters: attitudes three each, then the common ones.
    pub parameters: Vec<usize>,
    /// Their given values.
    pub values: Vec<f64>,
    /// Upper triangular root R of their weight matrix P = R^T R, row by row.
    pub root: Vec<f64>,
}

/// A calibration as it is known beforehand.
#[derive(Debug, Clone)]
pub struct Calibration {
    /// Where it is done.
    pub station: Station,
    /// What is estimated of the camera.
    pub kind: Kind,
    /// Initial alpha, omega, kappa of every attitude in radians.
    pub pointings: Vec<[f64; 3]>,
    /// Initial interior parameters, then coefficients of refraction in seconds of arc.
    pub common: [f64; COMMON],
    /// Which parameters are held: attitudes three each, then the common ones.
    pub fixed: Vec<bool>,
    /// Weights of parameters.
    pub weights: Weights,
    /// The stars.
    pub stars: Vec<Star>,
    /// Their images.
    pub images: Vec<Image>,
    /// The axis.
    pub axis: Option<Axis>,
}

/// How to adjust.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// When to stop, and what to compute.
    pub adjustment: adjustment::Options,
    /// Mean error of unit weight that is expected.
    pub unit: f64,
    /// Whether to compute the cofactors of every two parameters, where there are cofactors: so many further right-hand sides.
    pub whole: bool,
}

/// Why a calibration cannot be adjusted.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum StellarError {
    /// An image names a star or an attitude that is not there, or weights a parameter that is not.
    #[error("{0} names a star, an attitude or a parameter that is not there")]
    Index(String),
    /// A lens with more parameters than there is room for.
    #[error("the lens has more than {INTERIOR} parameters")]
    Lens,
    /// A weight matrix that is not positive definite.
    #[error("the weight matrix of {0} is not positive definite")]
    Weight(String),
    /// Stars without images enough.
    #[error("{} stars are not determined by their images", .0.len())]
    UndeterminedStars(Vec<usize>),
    /// Combinations that the stars do not determine: for each the parameters that take part in it.
    #[error("{} combinations of parameters are not determined by the stars", .0.len())]
    Undetermined(Vec<Vec<usize>>),
    /// Stars that the initial values put where they have no image.
    #[error("the initial values put a star below the horizon or behind the camera")]
    NotFinite(Vec<usize>),
    /// The work was stopped: by whoever watched it, or for want of memory or threads.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// More than can be numbered.
    #[error(transparent)]
    Layout(#[from] LayoutError),
}
