//! Resection: position and attitude of one photo from control points, with or without initial values.
//!
//! Unknowns are the position and attitude of the photo and the coordinates of the control points, each weighted from free (the photo) to
//! fixed; observations are image coordinates. Positions are X, Y, Z or longitude, latitude, height. Without initial values the adjustment
//! starts from poses computed directly from three points ([`three_points`]).
//!
//! ```
//! use photocore::adjustment::Options;
//! use photocore::geometry::{ObjectSpace, View, Point, RotationSense};
//! use photogram_programs::resection::{ControlPoint, Known, Partials, Resection};
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

use photocore::Stopped;
use photocore::geometry::{ObjectSpace, RotationSense};
use photocore::normals::LayoutError;

pub use degenerate::Degeneracy;
pub use solution::{AdjustedControl, AdjustedImage, Alternative, Solution, linearize_at_measured};
pub use three_points::{Placement, three_points};

/// A-priori values of three unknowns.
#[derive(Debug, Clone, Copy)]
pub struct Known {
    /// Observed values; NaN if unknown.
    pub value: [f64; 3],
    /// Standard deviations: infinite free, zero fixed.
    pub sd: [f64; 3],
}

/// Control point and its image observation.
#[derive(Debug, Clone, Copy)]
pub struct ControlPoint {
    /// Coordinates in the object space.
    pub coordinates: [f64; 3],
    /// Standard deviations of the coordinates, finite: zero fixed.
    pub sd: [f64; 3],
    /// Image coordinates in millimetres.
    pub xy: [f64; 2],
    /// Standard deviations of the image coordinates in millimetres.
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
    /// Converts the six unknowns of a photo to a pose.
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

    /// Returns the pose with a position relative to an origin.
    fn counted_from(&self, origin: [f64; 3]) -> Self {
        let position = std::array::from_fn(|k| self.position[k] - origin[k]);
        Self { position, attitude: self.attitude }
    }
}

/// Evaluation point of the partials of the image coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Partials {
    /// Computed image positions: least squares.
    #[default]
    AtComputed,
    /// Measured image positions, as in program W5344 (USGS Computer Contribution 2, 1969, equations 4 and 5). The relative difference from
    /// the least-squares solution, in standard deviations, is the ratio of residuals to image size.
    AtMeasured,
}

/// Photo and its control points.
#[derive(Debug, Clone)]
pub struct Resection {
    /// Object space of positions and points.
    pub space: ObjectSpace,
    /// Direction of the rotation matrix of the attitude angles.
    pub sense: RotationSense,
    /// Signed principal distance in millimetres: negative for the positive plane.
    pub principal_distance: f64,
    /// Control points.
    pub points: Vec<ControlPoint>,
    /// A-priori position.
    pub position: Known,
    /// A-priori attitude, omega, phi, kappa in radians.
    pub attitude: Known,
    /// Initial values; None for a direct solution.
    pub start: Option<Pose>,
    /// Evaluation point of the partials.
    pub partials: Partials,
}

/// Reason for a failed resection.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum ResectionError {
    /// Fewer than three points.
    #[error("{0} points do not determine a pose; it takes three")]
    TooFewPoints(usize),
    /// All points on one line.
    #[error("the points are on one line, about which the photo can turn")]
    Collinear,
    /// No position has all points in front of the camera in the observed directions.
    #[error("no position sees the points in front of the camera as the image shows them")]
    NoPlacement,
    /// The observations do not determine all unknowns.
    #[error("the observations do not determine the pose")]
    Undetermined(Degeneracy),
    /// With the initial values a point is in the plane of the projection centre.
    #[error("the initial values give image coordinates that are not finite")]
    NotFinite,
    /// The computation was stopped by the caller, or lacks memory or threads.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// The number of points exceeds the index range.
    #[error("too many points")]
    TooManyPoints,
}

impl From<LayoutError> for ResectionError {
    fn from(_: LayoutError) -> Self {
        ResectionError::TooManyPoints
    }
}
