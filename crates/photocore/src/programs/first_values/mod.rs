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

mod adjusted;
mod chained;
mod joined;
mod model;
mod resected;

use std::ops::ControlFlow;

use thiserror::Error;

use crate::adjustment::Event;
use crate::geometry::{Matrix3, Pose, Vector3};
use crate::network::median;
use crate::{Stopped, Threads};
use model::Model;

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

impl FirstValues {
    /// Finds first values of photos and points.
    ///
    /// `watch` is called on the calling thread while adjustments run; when it breaks, the search stops.
    ///
    /// # Errors
    /// Images of what is not there, an interruption, memory that is not to be had.
    pub fn find(
        &self,
        threads: &Threads,
        watch: &mut dyn FnMut(Event) -> ControlFlow<()>,
    ) -> Result<Found, FirstValuesError> {
        let (mut of_photo, mut of_point) = (vec![vec![]; self.photos.len()], vec![vec![]; self.points.len()]);
        for (index, sighting) in self.sightings.iter().enumerate() {
            let (Some(photo), Some(point)) =
                (of_photo.get_mut(sighting.photo), of_point.get_mut(sighting.point))
            else {
                return Err(FirstValuesError::Index(index));
            };
            // What lies at the side of the camera or behind it has no place in the plane at unit distance.
            if sighting.direction.iter().all(|u| u.is_finite()) && sighting.direction.z < -SIDE {
                photo.push(index);
                point.push(index);
            }
        }
        Search { given: self, of_photo, of_point, threads, watch }.run()
    }
}

/// Directions further than this from the plane of the projection centre are seen in front (radians).
const SIDE: f64 = 0.02;

impl Search<'_> {
    fn run(&mut self) -> Result<Found, FirstValuesError> {
        let mut object = Model::of_known(self);
        self.grow(&mut object, &|_| true)?;
        self.take_observed(&mut object);
        self.grow(&mut object, &|_| true)?;
        let mut apart: Vec<Model> = Vec::new();
        let mut frame = Frame::Known;
        loop {
            let taken = |photo: usize| {
                object.poses[photo].is_some() || apart.iter().any(|model| model.poses[photo].is_some())
            };
            let free: Vec<bool> = (0..self.given.photos.len()).map(|photo| !taken(photo)).collect();
            let Some(model) = self.relative_model(&free)? else { break };
            apart.push(model);
            self.join_all(&mut object, &mut apart)?;
        }
        self.join_among(&mut apart)?;
        self.join_all(&mut object, &mut apart)?;
        if object.is_empty() && !object.is_anchored(self) && !apart.is_empty() {
            let largest = (0..apart.len()).rev().max_by_key(|&k| apart[k].count()).unwrap_or(0);
            object = apart.remove(largest);
            frame = Frame::FirstPhoto(object.count_from_first_photo());
        }
        self.finish(&mut object)?;
        Ok(self.found(object, &apart, frame))
    }

    /// Poses of photos whose position and attitude were observed.
    fn take_observed(&self, object: &mut Model) {
        for (photo, known) in self.given.photos.iter().enumerate() {
            if let (None, Some(position), Some(attitude)) =
                (object.poses[photo], known.position, known.attitude)
            {
                object.poses[photo] = Some((Pose { position, attitude }, Source::Observed));
            }
        }
        object.intersect(self);
    }

    /// Everything together, robustly: twice, since what fits shows after the first time.
    fn finish(&mut self, object: &mut Model) -> Result<(), FirstValuesError> {
        for _ in 0..2 {
            if !object.is_empty() {
                self.adjust(object)?;
            }
        }
        self.leave_out_misfits(object);
        Ok(())
    }

    /// A pose that hardly any image fits is none.
    fn leave_out_misfits(&self, object: &mut Model) {
        let mut fitting = vec![0; self.given.photos.len()];
        object.misfits(self).iter().for_each(|(image, _)| fitting[self.given.sightings[*image].photo] += 1);
        for (pose, fitting) in object.poses.iter_mut().zip(fitting) {
            *pose = pose.filter(|(_, source)| {
                fitting >= RESECTED || matches!(source, Source::Given | Source::Observed)
            });
        }
    }

    fn found(&self, object: Model, apart: &[Model], frame: Frame) -> Found {
        let missing = |photo: usize| {
            if let Some(model) = apart.iter().find(|model| model.poses[photo].is_some()) {
                return Missing::Apart { photos: model.count(), common: self.common(&object, model).len() };
            }
            let known = self.known_points(&object, photo).len();
            if known < RESECTED { Missing::Points(known) } else { Missing::Misfit(known) }
        };
        let poses = object.poses.iter().enumerate();
        let misfit = median(object.misfits(self).into_iter().map(|(_, misfit)| misfit).collect());
        Found {
            poses: poses.map(|(photo, pose)| pose.ok_or_else(|| missing(photo))).collect(),
            points: object.points,
            set_aside: object.aside,
            frame,
            misfit,
        }
    }

    fn known_points(&self, model: &Model, photo: usize) -> Vec<usize> {
        let known = |&&image: &&usize| model.points[self.given.sightings[image].point].is_some();
        self.of_photo[photo].iter().filter(known).copied().collect()
    }
}
