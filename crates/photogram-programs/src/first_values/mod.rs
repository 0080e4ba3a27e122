//! Initial values: poses of photos from the available data, before any adjustment.
//!
//! The steps are: copy given poses, intersect rays of known photos, resect photos with four known points, use GNSS and inertial poses.
//! Photos without a-priori data are oriented relative to each other, first a pair, then further photos. The resulting model is transformed
//! by a similarity to the rest, or to control and observed positions. Without these, the first photo is the datum and the first base has
//! length 1. Finally all photos and points are adjusted with a robust loss.
//!
//! Observations are directions in the photos' axes, for any camera model; intermediate adjustments use the plane at unit distance. The
//! object space is cartesian.

mod chained;
mod find;
mod model;
mod resected;

use thiserror::Error;

use photocore::geometry::{Matrix3, Pose, Vector3};
use photocore::{Context, Stopped};

/// A-priori data of a photo.
#[derive(Debug, Clone, Copy, Default)]
pub struct KnownPhoto {
    /// Given pose.
    pub pose: Option<Pose>,
    /// Observed position of the projection centre.
    pub position: Option<Vector3>,
    /// Observed attitude, photo to object.
    pub attitude: Option<Matrix3>,
}

/// A-priori data of a point.
#[derive(Debug, Clone, Copy)]
pub struct KnownPoint {
    /// Coordinates; NaN if unknown.
    pub coordinates: [f64; 3],
    /// Standard deviations; infinite for free coordinates.
    pub sd: [f64; 3],
}

impl KnownPoint {
    /// Returns the position if all coordinates are weighted or fixed.
    pub(super) fn position(&self) -> Option<Vector3> {
        let full = self.sd.iter().chain(&self.coordinates).all(|value| value.is_finite());
        full.then(|| self.coordinates.into())
    }

    /// Returns a position with its weighted and fixed components replaced by the a-priori values, and their standard deviation.
    pub(super) fn at(&self, position: &Vector3) -> (Vector3, f64) {
        let held = |k: usize| self.sd[k].is_finite() && self.coordinates[k].is_finite();
        let own = Vector3::from_fn(|k, _| if held(k) { self.coordinates[k] } else { position[k] });
        (own, (0..3).filter(|&k| held(k)).map(|k| self.sd[k] * self.sd[k]).sum::<f64>().sqrt())
    }
}

/// Image observation of a point, as a direction.
#[derive(Debug, Clone, Copy)]
pub struct Sighting {
    /// Index of the photo.
    pub photo: usize,
    /// Index of the point.
    pub point: usize,
    /// Unit direction in the photo's axes; not finite outside of the camera's range.
    pub direction: Vector3,
    /// Standard deviation of the direction, radians.
    pub sd: f64,
}

/// Input of the search: a-priori data of photos and points, and image observations.
#[derive(Debug, Clone)]
pub struct FirstValues {
    /// Photos.
    pub photos: Vec<KnownPhoto>,
    /// Points.
    pub points: Vec<KnownPoint>,
    /// Image observations.
    pub sightings: Vec<Sighting>,
}

/// Source of the pose of a photo.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// Given.
    Given,
    /// Resection from known points.
    Resected,
    /// Observed position and attitude.
    Observed,
    /// Relative orientation to another photo with common points.
    Oriented,
}

/// Reason for a missing pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Missing {
    /// Number of points with positions, too few for a resection.
    Points(usize),
    /// Number of points with positions; every pose contradicts most of their observations.
    Misfit(usize),
    /// The photo belongs to a separate model with too few points and observed positions in common with the known ones.
    Apart {
        /// Number of photos of the model.
        photos: usize,
        /// Number of common points and positions.
        common: usize,
    },
}

/// Reference frame of the coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Frame {
    /// Given poses, control, observed positions.
    Known,
    /// First photo, and a base of length 1.
    FirstPhoto(usize),
}

/// Result of the search.
#[derive(Debug, Clone)]
pub struct Found {
    /// Poses of the photos.
    pub poses: Vec<Result<(Pose, Source), Missing>>,
    /// Positions of intersected points and of control.
    pub points: Vec<Option<Vector3>>,
    /// Whether an observation contradicts the poses and was rejected.
    pub set_aside: Vec<bool>,
    /// Whether the observations of a control point agree with each other but contradict its coordinates.
    pub contradicted: Vec<bool>,
    /// Reference frame of the coordinates.
    pub frame: Frame,
    /// Median of the angles between observed and computed directions, radians; None without any.
    pub misfit: Option<f64>,
}

/// Reason for a failed search.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum FirstValuesError {
    /// An observation has an invalid index of a photo or point.
    #[error("image {0} names a photo or point that is not there")]
    Index(usize),
    /// The computation was stopped by the caller, or lacks memory or threads.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

/// Minimum number of known points of a resection: three, and one for a check.
const RESECTED: usize = 4;

/// Input sorted by photo and by point, with the context of the adjustments.
struct Search<'a> {
    given: &'a FirstValues,
    of_photo: Vec<Vec<usize>>,
    of_point: Vec<Vec<usize>>,
    context: Context<'a>,
}
