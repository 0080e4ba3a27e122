//! Features of measured objects: lines, planes, circles, spheres and cylinders through adjusted points, and distances.
//!
//! The fitted feature minimizes the sum of squared orthogonal distances of the points: the Gaussian associated feature of coordinate
//! metrology (A. B. Forbes, *Least-squares best-fit geometric elements*, NPL report DITC 140/89, 1989; C. M. Shakarji, J. Res. NIST 103,
//! 1998). Points have equal weights, so that the reported form deviation is independent of the precision of the points. The precision of
//! the feature is propagated from the joint covariance of the points, with exact derivatives ([`fit`]).
//!
//! ```
//! use photocore::geometry::Vector3;
//! use photocore::nalgebra::DMatrix;
//! use photogram_programs::features::{Form, measure};
//!
//! let point = |degrees: f64| Vector3::new(degrees.to_radians().cos(), degrees.to_radians().sin(), 5.0);
//! let points = [0.0, 60.0, 120.0, 180.0, 240.0, 300.0].map(point);
//! let covariance = DMatrix::identity(18, 18) * 1e-8;
//! let circle = measure(Form::Circle, &points, &covariance).unwrap();
//! assert!((circle.of("diameter").unwrap().value - 2.0).abs() < 1e-12);
//! // The radius is the mean of six.
//! assert!((circle.of("diameter").unwrap().sd - 2e-4 / 6f64.sqrt()).abs() < 1e-12);
//! assert!(measure(Form::Circle, &points[..2], &DMatrix::identity(6, 6)).is_err());
//! ```

pub mod fit;
pub mod form;
mod measured;

pub use measured::{FormTest, Measured, PointDeviation, Quantity, distance, measure};

use thiserror::Error;

/// Type of a feature.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Straight line.
    Line,
    /// Plane.
    Plane,
    /// Circle in space.
    Circle,
    /// Sphere.
    Sphere,
    /// Cylinder.
    Cylinder,
}

impl Form {
    /// Returns the form with a name.
    pub fn named(name: &str) -> Option<Self> {
        [Self::Line, Self::Plane, Self::Circle, Self::Sphere, Self::Cylinder]
            .into_iter()
            .find(|form| form.name() == name)
    }

    /// Returns the name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Line => "line",
            Self::Plane => "plane",
            Self::Circle => "circle",
            Self::Sphere => "sphere",
            Self::Cylinder => "cylinder",
        }
    }

    /// Returns the minimum number of points. Six cylinders pass through five points.
    pub const fn needed(self) -> usize {
        match self {
            Self::Line => 2,
            Self::Plane | Self::Circle => 3,
            Self::Sphere => 4,
            Self::Cylinder => 6,
        }
    }

    /// Describes the degenerate configuration of the points.
    const fn degenerate(self) -> &'static str {
        match self {
            Self::Line => "in one place",
            Self::Plane | Self::Circle => "on one line",
            Self::Sphere => "in one plane",
            Self::Cylinder => "in one plane, or on few lines or rings",
        }
    }
}

/// Reason why a feature cannot be fitted.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum FeatureError {
    /// Fewer points than the form needs.
    #[error("a {} takes {} points, not {given}; add points", .form.name(), .form.needed())]
    TooFew {
        /// Requested form.
        form: Form,
        /// Number of points.
        given: usize,
    },
    /// Coordinates or covariances that are not finite.
    #[error("coordinates and covariances of the points must all be known; add the missing ones")]
    NotFinite,
    /// Covariance matrix for another number of points.
    #[error("{points} points have {} x {} covariances, not {rows} x {columns}", 3 * points, 3 * points)]
    Shape {
        /// Number of points.
        points: usize,
        /// Number of rows of the matrix.
        rows: usize,
        /// Number of columns of the matrix.
        columns: usize,
    },
    /// Distance of two coincident points.
    #[error("the two points are in one place: a direction requires two places, so choose other points")]
    Coincident,
    /// The points do not determine the form.
    #[error("the points do not determine a {}: they are {}, or nearly so; add points elsewhere", .0.name(), .0.degenerate())]
    Undetermined(Form),
    /// The points do not determine the form within their standard deviations.
    #[error(
        "the points determine a {} too badly ({what} to {:.2} of itself): they are nearly {}; add points elsewhere",
        .form.name(), .sd, .form.degenerate()
    )]
    Loose {
        /// Requested form.
        form: Form,
        /// Name of the imprecise quantity.
        what: &'static str,
        /// Relative standard deviation; radians for a direction.
        sd: f64,
    },
    /// Several features fit equally well.
    #[error("more than one {} fits the points as well: add points elsewhere", .0.name())]
    Ambiguous(Form),
    /// The iteration does not converge.
    #[error("the points must fit one {}, but the iteration does not converge; check them", .0.name())]
    NotAtRest(Form),
}
