//! Resection: position and attitude of one photo from control points, with or without initial values.
//!
//! Unknowns are the position and attitude of the photo and the coordinates of the control points, each weighted from free
//! (the photo) to fixed; observations are image coordinates. Positions are X, Y, Z or longitude, latitude, height. Without
//! initial values the adjustment starts from poses that three points give directly ([`three_points`]).
//!
//! ```
//! use photocore::adjustment::Options;
//! use photocore::geometry::{ObjectSpace, View, Point, RotationSense};
//! use photocore::programs::resection::{ControlPoint, Known, Partials, Resection};
//!
//! let (space, sense) = (ObjectSpace::Rectangular, RotationSense::GroundToPhoto);
//! let truth = View::new(space, sense, [520.0, 480.0, 1600.0], [0.05, -0.03, 2.0], -150.0);
//! let control = [[0.0, 0.0, 20.0], [1000.0, 0.0, 90.0], [1000.0, 1000.0, 0.0], [0.0, 1000.0, 60.0], [500.0, 300.0, 140.0]];
//! let point = |coordinates| {
//!     let xy = truth.project(&Point::new(space, coordinates));
//!     ControlPoint { coordinates, sd: [0.0; 3], xy, xy_sd: [0.01; 2] }
//! };
//! let unknown = Known { value: [f64::NAN; 3], sd: [f64::INFINITY; 3] };
//! let resection = Resection {
//!     space,
//!     sense,
//!     principal_distance: -150.0,
//!     points: control.map(point).to_vec(),
//!     position: unknown,
//!     attitude: unknown,
//!     start: None,
//!     partials: Partials::AtComputed,
//! };
//! let solution = resection.adjust(&Options::default())?;
//! assert!((solution.pose.position[2] - 1600.0).abs() < 1e-6);
//! assert_eq!(solution.degrees_of_freedom, 4);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod adjust;
mod degenerate;
mod solution;
mod start;
mod three_points;

use thiserror::Error;

use crate::Stopped;
use crate::geometry::{ObjectSpace, RotationSense};
use crate::normals::LayoutError;

pub use degenerate::Degeneracy;
pub use solution::{AdjustedControl, AdjustedImage, Alternative, Solution};
pub use three_points::{Placement, three_points};

/// Three values as they are known beforehand.
#[derive(Debug, Clone, Copy)]
pub struct Known {
    /// Observed values; NaN where nothing is known.
    pub value: [f64; 3],
    /// Standard deviations: infinite free, zero fixed.
    pub sd: [f64; 3],
}

/// A control point and its image.
#[derive(Debug, Clone, Copy)]
pub struct ControlPoint {
    /// Coordinates in the object space.
    pub coordinates: [f64; 3],
    /// Their standard deviations, finite: zero fixed.
    pub sd: [f64; 3],
    /// Image coordinates in millimetres.
    pub xy: [f64; 2],
    /// Their standard deviations in millimetres.
    pub xy_sd: [f64; 2],
}

/// Position and attitude of a photo.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Coordinates in the object space.
    pub position: [f64; 3],
    /// Omega, phi, kappa in radians.
    pub attitude: [f64; 3],
}

impl Pose {
    /// The six unknowns of a photo as a pose.
    fn from_unknowns(values: &[f64]) -> Self {
        Self {
            position: std::array::from_fn(|k| values[k]),
            attitude: std::array::from_fn(|k| values[3 + k]),
        }
    }

    fn unknowns(&self) -> [f64; 6] {
        let ([x, y, z], [omega, phi, kappa]) = (self.position, self.attitude);
        [x, y, z, omega, phi, kappa]
    }

    /// The same pose, its position counted from an origin.
    fn counted_from(&self, origin: [f64; 3]) -> Self {
        let position = std::array::from_fn(|k| self.position[k] - origin[k]);
        Self { position, attitude: self.attitude }
    }
}

/// Where the partials of the image coordinates are formed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Partials {
    /// At the computed image positions: least squares.
    #[default]
    AtComputed,
    /// At the measured image positions, as program W5344 does (USGS Computer Contribution 2, 1969, equations 4 and 5). Its
    /// solution differs from least squares by residuals relative to the size of the image, in standard deviations.
    AtMeasured,
}

/// One photo and its control.
#[derive(Debug, Clone)]
pub struct Resection {
    /// Coordinates of positions and points.
    pub space: ObjectSpace,
    /// Sense of the attitude angles.
    pub sense: RotationSense,
    /// Signed principal distance in millimetres: negative for the positive plane.
    pub principal_distance: f64,
    /// The points.
    pub points: Vec<ControlPoint>,
    /// What is known of the position.
    pub position: Known,
    /// What is known of the attitude, omega, phi, kappa in radians.
    pub attitude: Known,
    /// Initial values; without them a direct method finds some.
    pub start: Option<Pose>,
    /// Where the partials are formed.
    pub partials: Partials,
}

/// Why there is no resection.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum ResectionError {
    /// Fewer than three points.
    #[error("{0} points do not determine a pose; it takes three")]
    TooFewPoints(usize),
    /// All points on one line.
    #[error("the points are on one line, about which the photo can turn")]
    Collinear,
    /// No position in front of which the points lie as they are seen.
    #[error("no position sees the points in front of the camera as the image shows them")]
    NoPlacement,
    /// The observations leave unknowns undetermined.
    #[error("the observations do not determine the pose")]
    Undetermined(Degeneracy),
    /// The initial values put a point into the plane of the projection centre.
    #[error("the initial values give image coordinates that are not finite")]
    NotFinite,
    /// The work was stopped: by whoever watched it, or for want of memory or threads.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// More than can be numbered.
    #[error("too many points")]
    TooManyPoints,
}

impl From<LayoutError> for ResectionError {
    fn from(_: LayoutError) -> Self {
        ResectionError::TooManyPoints
    }
}
