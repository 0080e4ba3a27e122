//! Selection of the points that take part in the adjustment.

use super::error::NetworkError;
use super::input::{Network, State};
use super::interface::{BlockId, Interface};
use super::neighbourhood::{ByPoint, TOGETHER};
use super::observations::Touches;
use crate::parallel;

/// Minimum ratio of all objects to excluded ones, for which these count as few.
pub(super) const FEW: usize = 10;

/// An excluded point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Dropped {
    /// Index of the point.
    pub point: usize,
    /// Reason of the exclusion.
    pub reason: Reason,
}

/// Reason of the exclusion of a point: the first three before the adjustment (GIANT guide, sections 6 and 11), the others because of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reason {
    /// A point without images.
    NotPhotographed,
    /// A pass point on one photo only.
    PassPointOnOnePhoto,
    /// A control point on one photo only, with more than one free coordinate.
    ControlPointOnOnePhoto,
    /// The iterations have moved the point to the station of a photo that observes it, and it would harm all others.
    RanIntoStation,
    /// The rays do not determine the point: they are parallel or identical.
    NotDetermined,
    /// The rays do not intersect before the cameras: iterations without convergence have moved the point out of the network.
    RanOff,
    /// The given position of the point is a station that observes it: the ray is undefined.
    AtStation,
    /// The point is fixed or weighted near a station that observes it, and an image is wrong: the adjustment fails only with this point.
    NearStation,
}

impl Reason {
    /// Returns the code of the reason in results.
    pub fn code(self) -> &'static str {
        match self {
            Reason::NotPhotographed => "not-photographed",
            Reason::PassPointOnOnePhoto => "pass-point-on-one-photo",
            Reason::ControlPointOnOnePhoto => "control-point-on-one-photo",
            Reason::RanIntoStation => "ran-into-station",
            Reason::NotDetermined => "not-determined",
            Reason::RanOff => "ran-off",
            Reason::AtStation => "at-station",
            Reason::NearStation => "near-station",
        }
    }
}

#[derive(Debug, Clone)]
#[doc(hidden)]
pub struct LeftOut {
    pub points: Vec<bool>,
    pub photos: Vec<bool>,
}

impl Network {
    /// Returns the exclusions: the given photos, and the exclusions of an adjusted state.
    ///
    /// # Errors
    /// A state of another network.
    #[doc(hidden)]
    pub fn left_out(&self, photos: Vec<bool>, state: Option<&State>) -> Result<LeftOut, NetworkError> {
        let mut all = LeftOut { points: vec![false; self.points.len()], photos };
        if let Some(state) = state {
            for (own, left) in
                [(&mut all.points, &state.collapsed), (&mut all.photos, &state.undetermined_photos)]
            {
                for &index in left {
                    *own.get_mut(index).ok_or(NetworkError::State)? = true;
                }
            }
        }
        Ok(all)
    }

    /// Excludes points that their images and given coordinates cannot determine, and the points and photos of `left_out`.
    ///
    /// A point on one photo remains if at most one of its coordinates is free: then there are at least four equations for three parameters
    /// (specification, open point 21). Points with parameters in other nodes of a larger network always remain.
    ///
    /// Points that observations connect with other objects are the last ones. Images on excluded photos are ignored.
    #[doc(hidden)]
    pub fn select(&self, left_out: &LeftOut, interface: Interface) -> Selected {
        let undetermined_photos = &left_out.photos;
        let named = interface.indices(BlockId::Point);
        let all = self.point_images(undetermined_photos);
        let (mut points, mut dropped) = (Vec::new(), Vec::new());
        let along = self.along_curve(&all);
        let reason = |place: usize| self.reason(along[place], all.of(along[place]));
        let reasons: Vec<Option<Reason>> = parallel::map(along.len(), TOGETHER, reason);
        for (point, reason) in along.into_iter().zip(reasons).filter(|&(point, _)| !left_out.points[point]) {
            match reason.filter(|_| !named.contains(&point)) {
                Some(reason) => dropped.push(Dropped { point, reason }),
                None => points.push(point),
            }
        }
        dropped.sort_by_key(|own| own.point);
        let observations = self.observations_of(&points);
        let mut retained = Vec::new();
        if !(observations.is_empty() && named.is_empty()) {
            let mut touched = vec![false; self.points.len()];
            let touches = observations.iter().map(|&i| self.observations[i].touches());
            let connected =
                touches.filter(|touches| self.connects(touches)).flat_map(|touches| touches.points);
            connected.chain(named).for_each(|point| touched[point] = true);
            (retained, points) = points.into_iter().partition(|&point| touched[point]);
        }
        let locals = points.len();
        points.extend(retained);
        let mut images = ByPoint { start: vec![0], order: Vec::with_capacity(self.images.len()) };
        for &point in &points {
            images.order.extend(all.of(point));
            images.start.push(images.order.len());
        }
        let undetermined_photos =
            (0..undetermined_photos.len()).filter(|&photo| undetermined_photos[photo]).collect();
        Selected { points, locals, images, observations, dropped, undetermined_photos, interface }
    }

    /// Whether an observation connects its points with other points, photos or shared parameters that are not fixed.
    fn connects(&self, touches: &Touches) -> bool {
        let mut commons = touches.commons.iter();
        touches.points.len() > 1
            || !touches.photos.is_empty()
            || commons.any(|&(common, _)| !self.commons[common].is_held())
    }

    /// Returns the reason to exclude a point with the given images; None if it remains.
    fn reason(&self, point: usize, images: &[usize]) -> Option<Reason> {
        let first_photo = images.first().map(|&image| self.images[image].photo);
        let one_photo = images.iter().all(|&image| Some(self.images[image].photo) == first_photo);
        let held = self.points[point].held().into_iter().filter(|&held| held).count();
        match (first_photo, held) {
            (None, _) => Some(Reason::NotPhotographed),
            (_, 0) if one_photo => Some(Reason::PassPointOnOnePhoto),
            (_, 1) if one_photo => Some(Reason::ControlPointOnOnePhoto),
            _ => None,
        }
    }

    /// Returns the photos with free parameters that appear in neither an image nor an observation.
    #[doc(hidden)]
    pub fn untouched_photos(&self) -> Vec<bool> {
        let mut untouched: Vec<bool> =
            self.photos.iter().map(|photo| photo.sd.iter().any(|sd| sd.is_infinite())).collect();
        self.images.iter().for_each(|image| untouched[image.photo] = false);
        for mount in &self.mounts {
            let on_frame = mount.frame().into_iter().flat_map(|frame| [frame, mount.photo()]);
            on_frame.for_each(|photo| untouched[photo] = false);
        }
        let touched = self.observations.iter().flat_map(|each| each.touches().photos);
        touched.for_each(|photo| untouched[photo] = false);
        untouched
    }

    /// Returns the observations whose points are all among the given ones.
    fn observations_of(&self, points: &[usize]) -> Vec<usize> {
        if self.observations.is_empty() {
            return vec![];
        }
        let mut takes_part = vec![false; self.points.len()];
        points.iter().for_each(|&point| takes_part[point] = true);
        let all_there =
            |&index: &usize| self.observations[index].touches().points.iter().all(|&point| takes_part[point]);
        (0..self.observations.len()).filter(all_there).collect()
    }

    /// Returns the images of every point, without images on excluded photos.
    fn point_images(&self, undetermined_photos: &[bool]) -> ByPoint {
        let taken = self.images.iter().enumerate().filter(|(_, image)| !undetermined_photos[image.photo]);
        ByPoint::new(self.points.len(), taken.map(|(index, image)| (image.point, index)))
    }
}

/// Active objects, with neighbouring points in sequence, and exclusions.
#[doc(hidden)]
pub struct Selected {
    pub points: Vec<usize>,
    /// Number of points that no observation connects with other objects, which are the first ones.
    pub locals: usize,
    pub(super) images: ByPoint,
    pub observations: Vec<usize>,
    pub dropped: Vec<Dropped>,
    /// Photos whose images are excluded, ascending: they are fixed.
    pub undetermined_photos: Vec<usize>,
    /// Interface of the network to a larger one.
    pub interface: Interface,
}
