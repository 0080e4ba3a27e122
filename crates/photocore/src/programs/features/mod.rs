//! Features of measured objects: lines, planes, circles, spheres and cylinders through adjusted points, and distances.
//!
//! The feature is the one from which the squares of the distances of the points, at right angles, sum to the least: the Gaussian
//! associated feature of coordinate metrology (A. B. Forbes, *Least-squares best-fit geometric elements*, NPL report DITC 140/89, 1989;
//! C. M. Shakarji, J. Res. NIST 103, 1998). Points have no weights: what is reported as form is what they deviate by, and it does not
//! depend on how well a point was measured. How well the feature is known does: everything is propagated from the joint covariance of
//! the points with the exact derivatives of the feature by the points ([`fit`]).
//!
//! ```
//! use photocore::geometry::Vector3;
//! use photocore::nalgebra::DMatrix;
//! use photocore::programs::features::{Form, measure};
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

/// What goes through points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// A straight line.
    Line,
    /// A plane.
    Plane,
    /// A circle in space.
    Circle,
    /// A sphere.
    Sphere,
    /// A cylinder.
    Cylinder,
}

impl Form {
    /// The form of a name.
    pub fn named(name: &str) -> Option<Self> {
        [Self::Line, Self::Plane, Self::Circle, Self::Sphere, Self::Cylinder]
            .into_iter()
            .find(|form| form.name() == name)
    }

    /// What it is called.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Line => "line",
            Self::Plane => "plane",
            Self::Circle => "circle",
            Self::Sphere => "sphere",
            Self::Cylinder => "cylinder",
        }
    }

    /// How many points it takes. Six cylinders go through five points.
    pub const fn needed(self) -> usize {
        match self {
            Self::Line => 2,
            Self::Plane | Self::Circle => 3,
            Self::Sphere => 4,
            Self::Cylinder => 6,
        }
    }

    /// Where points lie that leave it open.
    const fn degenerate(self) -> &'static str {
        match self {
            Self::Line => "in one place",
            Self::Plane | Self::Circle => "on one line",
            Self::Sphere => "in one plane",
            Self::Cylinder => "in one plane, or on few lines or rings",
        }
    }
}

/// Why there is no feature.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum FeatureError {
    /// Fewer points than it takes.
    #[error("a {} takes {} points, not {given}", .form.name(), .form.needed())]
    TooFew {
        /// What was asked for.
        form: Form,
        /// The number of points.
        given: usize,
    },
    /// Coordinates or covariances that are no numbers.
    #[error("coordinates and covariances of the points are not all known")]
    NotFinite,
    /// A covariance matrix of another number of points.
    #[error("{points} points have {} x {} covariances, not {rows} x {columns}", 3 * points, 3 * points)]
    Shape {
        /// The number of points.
        points: usize,
        /// Rows of the matrix.
        rows: usize,
        /// Its columns.
        columns: usize,
    },
    /// A distance of two points in one place.
    #[error("the two points are in one place: their distance has no direction")]
    Coincident,
    /// The points leave it open.
    #[error("the points do not determine a {}: they are {}, or nearly so", .0.name(), .0.degenerate())]
    Undetermined(Form),
    /// The points leave it open within their standard deviations.
    #[error(
        "the points determine a {} too badly ({what} to {:.2} of itself): they are nearly {}",
        .form.name(), .sd, .form.degenerate()
    )]
    Loose {
        /// What was asked for.
        form: Form,
        /// What is known badly.
        what: &'static str,
        /// Its relative standard deviation; radians of a direction.
        sd: f64,
    },
    /// Several features fit alike.
    #[error("more than one {} fits the points as well: take points in other places", .0.name())]
    Ambiguous(Form),
    /// The iteration does not end.
    #[error("no {} is found that fits the points best", .0.name())]
    NotAtRest(Form),
}
