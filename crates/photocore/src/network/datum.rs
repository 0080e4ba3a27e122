//! Datum parameters of free networks.

use std::collections::{BTreeSet, HashMap};

use super::error::NetworkError;
use super::input::{InnerConstraints, Network};
use super::model::{MOST_PARTS, MOTIONS};
use super::problem::Assembled;
use super::rigid_motions::SCALE;
use crate::Threads;
use crate::adjustment::Datum;
use crate::geometry::{Point, PoseNumbers, Vector3};

impl Network {
    /// Returns an error for photos that cannot define a datum.
    #[doc(hidden)]
    pub fn check_carriers(
        &self,
        inner: &InnerConstraints,
        assembled: &Assembled,
    ) -> Result<(), NetworkError> {
        if self.poses == PoseNumbers::Vectors && !(inner.photos.is_empty() && inner.attitudes.is_empty()) {
            return Err(NetworkError::Vectors);
        }
        let bad = inner.attitudes.iter().find(|&&photo| !assembled.turns(photo));
        bad.map_or(Ok(()), |&photo| Err(NetworkError::Attitude(photo)))
    }
}

impl Assembled {
    /// Returns the datum parameters and their reference values.
    #[doc(hidden)]
    pub fn datum(&self, inner: &InnerConstraints) -> (Datum, Vec<f64>) {
        let model = &self.problem.model;
        let mut reference = self.problem.initial.clone();
        for (point, given) in model.points.iter().enumerate() {
            let places = reference[model.of_point(point)].iter_mut().zip(given.coordinates);
            places.filter(|(_, given)| !given.is_nan()).for_each(|(x, given)| *x = given);
        }
        let of = self.points.iter().enumerate();
        let first: HashMap<usize, usize> =
            of.map(|(index, &point)| (point, model.of_point(index).start)).collect();
        let points = inner.points.iter().filter_map(|point| first.get(point).copied());
        // The pose of a photo on a frame is the pose of the frame.
        let starts = |photos: &[usize]| {
            let photos = photos.iter().filter(|&&photo| photo < model.cameras.len());
            let frames: BTreeSet<usize> = photos.map(|&photo| model.carrier(photo)).collect();
            frames.into_iter().map(|photo| model.of_block(photo).start)
        };
        let photos = starts(&inner.photos);
        let lengths = |first: usize| {
            let at = std::array::from_fn(|k| self.problem.initial[first + k]);
            let partials = Point::new(model.space, at).partials();
            [0, 1, 2].map(|k| (first + k, partials.column(k).norm()))
        };
        let mut carriers: Vec<(usize, f64)> = points.chain(photos).flat_map(lengths).collect();
        if !inner.attitudes.is_empty() {
            let radius = inner.radius.unwrap_or_else(|| self.radius());
            let turns = starts(&inner.attitudes);
            carriers.extend(turns.flat_map(|first| [3, 4, 5].map(|k| (first + k, radius))));
        }
        let left = self.left(&carriers, !inner.scale);
        (Datum { carriers, left, relative: false }, reference)
    }

    /// Returns true if the attitude of a photo, or of its frame, steps by a rotation about its own axes.
    pub(super) fn turns(&self, photo: usize) -> bool {
        let model = &self.problem.model;
        photo >= model.cameras.len() || model.rotation_vector_sense(model.carrier(photo)).is_some()
    }

    /// Returns the root mean square distance of all points and photos from their centre, at the initial values.
    fn radius(&self) -> f64 {
        let (model, unknowns) = (&self.problem.model, &self.problem.initial);
        let points = model.coordinates(unknowns).map(|&at| model.space.cartesian(at));
        let photos = model.photos(&unknowns[model.parameter_unknowns()]);
        let places: Vec<Vector3> =
            points.chain(photos.iter().map(|station| station.orientation.centre())).collect();
        let count = places.len().max(1) as f64;
        let middle = places.iter().sum::<Vector3>() / count;
        (places.iter().map(|place| (place - middle).norm_squared()).sum::<f64>() / count).sqrt()
    }

    /// Returns the weighted and fixed parameters of points and poses, ascending: possible datum information besides observations.
    pub(super) fn controlled(&self) -> Vec<usize> {
        let model = &self.problem.model;
        let photos = (0..model.cameras.len()).filter(|&photo| !model.is_carried(photo));
        let poses =
            photos.filter(|&photo| model.images_on[photo] > 0).flat_map(|p| model.of_block(p).take(6));
        let points = (0..model.points.len()).flat_map(|point| model.of_point(point));
        let mut all: Vec<usize> =
            poses.chain(points).filter(|&unknown| self.problem.sd[unknown].is_finite()).collect();
        all.sort_unstable();
        all
    }

    /// Returns true if control and weights of poses are a minimal datum: without them, the datum defect equals their number. Then their
    /// redundancy numbers are zero, and they only select a datum.
    pub(super) fn is_minimal(&self, values: &[f64], threads: &Threads) -> bool {
        let (controlled, model) = (self.controlled(), &self.problem.model);
        let some = !controlled.is_empty() && controlled.len() <= MOTIONS * MOST_PARTS;
        // Control alone determines a point with a single image.
        let seen =
            |point: usize| model.points[point].held() == [false; 3] || model.images_of(point).len() > 1;
        some && (0..model.points.len()).all(seen)
            && self.problem.any().open_if_free(values, &controlled, threads) == controlled.len()
    }

    /// Returns the datum in which cofactors are relative to some parameters, with unchanged scale.
    pub(super) fn relative(&self, carriers: Vec<(usize, f64)>) -> Datum {
        let left = self.left(&carriers, true);
        Datum { carriers, left, relative: true }
    }

    /// Returns the excluded transformations: all of components without datum parameters and, if requested, the scale of others.
    fn left(&self, carriers: &[(usize, f64)], scale: bool) -> Vec<usize> {
        let (model, parts) = (&self.problem.model, self.problem.model.parts());
        let mut carried = vec![false; parts.all.len()];
        let mut unknown_of = vec![None; self.problem.layout().unknowns()];
        for (point, part) in parts.of_point.iter().enumerate() {
            unknown_of[model.of_point(point)].fill(*part);
        }
        for (photo, part) in parts.of_photo.iter().enumerate() {
            unknown_of[model.of_block(photo)].fill(*part);
        }
        for &(carrier, _) in carriers {
            unknown_of[carrier].into_iter().for_each(|part| carried[part] = true);
        }
        let stays = |&number: &usize| !carried[number / MOTIONS] || scale && number % MOTIONS == SCALE;
        (0..MOTIONS * carried.len()).filter(stays).collect()
    }
}
