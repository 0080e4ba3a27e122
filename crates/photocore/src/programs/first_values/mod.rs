//! First values: poses of photos from what is known, before any adjustment.
//!
//! In this order: given poses are taken; rays are intersected where photos are known; photos with four known points are resected; what
//! GNSS and inertial units observed gives poses; photos of which nothing but images is known are oriented relative to each other, pair
//! and chain, and the model is joined to the rest, or carried onto control and observed positions, by a similarity. Where there is
//! nothing to carry it onto, the first photo is the datum and the first base has length 1. At the end everything is adjusted with a
//! robust loss.
//!
//! Images come as directions in the photos' axes, so that any camera will do; the adjustments in between see them in the plane at unit
//! distance. Object space is cartesian.

mod chained;
mod find;
mod model;
mod resected;

use std::ops::ControlFlow;

use thiserror::Error;

use crate::adjustment::Event;
use crate::geometry::{Matrix3, Pose, Vector3};
use crate::{Stopped, Threads};

/// What is known of a photo.
#[derive(Debug, Clone, Copy, Default)]
pub struct KnownPhoto {
    /// Its pose.
    pub pose: Option<Pose>,
    /// The position of its projection centre as observed.
    pub position: Option<Vector3>,
    /// Its attitude, photo to object, as observed.
    pub attitude: Option<Matrix3>,
}

/// What is known of a point.
#[derive(Debug, Clone, Copy)]
pub struct KnownPoint {
    /// Its coordinates; NaN where nothing is known.
    pub coordinates: [f64; 3],
    /// Standard deviations; infinite where they are not held.
    pub sd: [f64; 3],
}

impl KnownPoint {
    /// Its position, where all of it is held.
    pub(super) fn position(&self) -> Option<Vector3> {
        let full = self.sd.iter().chain(&self.coordinates).all(|value| value.is_finite());
        full.then(|| self.coordinates.into())
    }

    /// A position with the components that are held, and the standard deviation of these.
    pub(super) fn at(&self, position: &Vector3) -> (Vector3, f64) {
        let held = |k: usize| self.sd[k].is_finite() && self.coordinates[k].is_finite();
        let own = Vector3::from_fn(|k, _| if held(k) { self.coordinates[k] } else { position[k] });
        (own, (0..3).filter(|&k| held(k)).map(|k| self.sd[k] * self.sd[k]).sum::<f64>().sqrt())
    }
}

/// The image of a point.
#[derive(Debug, Clone, Copy)]
pub struct Sighting {
    /// Index of its photo.
    pub photo: usize,
    /// Index of its point.
    pub point: usize,
    /// Unit direction in the photo's axes; not finite where the camera has none.
    pub direction: Vector3,
    /// Its standard deviation, radians.
    pub sd: f64,
}

/// What is known of photos and points, and what was seen.
#[derive(Debug, Clone)]
pub struct FirstValues {
    /// The photos.
    pub photos: Vec<KnownPhoto>,
    /// The points.
    pub points: Vec<KnownPoint>,
    /// The images.
    pub sightings: Vec<Sighting>,
}

/// Where the pose of a photo came from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// It was given.
    Given,
    /// From points whose positions were known.
    Resected,
    /// From its observed position and attitude.
    Observed,
    /// From another photo with common points.
    Oriented,
}

/// Why a photo has no pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Missing {
    /// So many of its points have positions, too few for a resection.
    Points(usize),
    /// So many of its points have positions, but no pose shows most of them where they are.
    Misfit(usize),
    /// It belongs to a model of so many photos that has so many points and observed positions in common with what is known.
    Apart {
        /// Photos of the model.
        photos: usize,
        /// What it has in common.
        common: usize,
    },
}

/// What coordinates refer to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Frame {
    /// Given poses, control, observed positions.
    Known,
    /// The first photo, and a base of length 1.
    FirstPhoto(usize),
}

/// What was found.
#[derive(Debug, Clone)]
pub struct Found {
    /// Poses of the photos.
    pub poses: Vec<Result<(Pose, Source), Missing>>,
    /// Positions of points whose rays meet, and of control.
    pub points: Vec<Option<Vector3>>,
    /// Whether an image does not fit the poses and was set aside.
    pub set_aside: Vec<bool>,
    /// Whether the images of a control point agree with each other but not with its coordinates.
    pub contradicted: Vec<bool>,
    /// What coordinates refer to.
    pub frame: Frame,
    /// Median of the angles between observed and computed directions, radians; None without any.
    pub misfit: Option<f64>,
}

/// Why nothing could be found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum FirstValuesError {
    /// An image names a photo or point that is not there.
    #[error("image {0} names a photo or point that is not there")]
    Index(usize),
    /// The work was stopped: by whoever watched it, or for want of memory or threads.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

/// Known points that it takes to resect a photo: three, and one to check.
const RESECTED: usize = 4;

/// What is given, arranged by photo and by point, with the means to adjust.
struct Search<'a> {
    given: &'a FirstValues,
    of_photo: Vec<Vec<usize>>,
    of_point: Vec<Vec<usize>>,
    threads: &'a Threads,
    watch: &'a mut dyn FnMut(Event) -> ControlFlow<()>,
}
