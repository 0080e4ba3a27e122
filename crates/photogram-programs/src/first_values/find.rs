//! Search for initial values.

use super::model::Model;
use super::{FirstValues, FirstValuesError, Found, Frame, Missing, RESECTED, Search, Source};
use photocore::Context;
use photocore::geometry::Pose;
use photocore::internal::median;

/// Minimum inclination, radians, of a usable direction to the plane of the projection centre.
const SIDE: f64 = 0.02;
/// Maximum number of final adjustments.
const ROUNDS: usize = 6;

impl FirstValues {
    /// Finds initial values of photos and points, with progress during adjustments.
    ///
    /// # Errors
    /// Invalid indices of observations, an interruption, or lack of memory.
    pub fn find(&self, context: &mut Context<'_>) -> Result<Found, FirstValuesError> {
        let (mut of_photo, mut of_point) = (vec![vec![]; self.photos.len()], vec![vec![]; self.points.len()]);
        for (index, sighting) in self.sightings.iter().enumerate() {
            let (Some(photo), Some(point)) =
                (of_photo.get_mut(sighting.photo), of_point.get_mut(sighting.point))
            else {
                return Err(FirstValuesError::Index(index));
            };
            // Directions at the side of the camera or behind it cannot be projected to the plane at unit distance.
            if sighting.direction.iter().all(|u| u.is_finite()) && sighting.direction.z < -SIDE {
                photo.push(index);
                point.push(index);
            }
        }
        Search { given: self, of_photo, of_point, context: context.reborrow() }.run()
    }
}

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

    /// Adds the poses of photos with observed position and attitude.
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

    /// Adjusts all photos robustly: twice, to use the fit of the first time; more often while observations contradict control.
    fn finish(&mut self, object: &mut Model) -> Result<(), FirstValuesError> {
        for round in 0..ROUNDS {
            if !object.is_empty() && (round < 2 || object.contradicted.contains(&true)) {
                self.adjust(object)?;
            }
        }
        self.leave_out_misfits(object);
        Ok(())
    }

    /// Removes poses that fit hardly any observation.
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
            contradicted: object.contradicted,
            frame,
            misfit,
        }
    }

    pub(super) fn known_points(&self, model: &Model, photo: usize) -> Vec<usize> {
        let known = |&&image: &&usize| model.points[self.given.sightings[image].point].is_some();
        self.of_photo[photo].iter().filter(known).copied().collect()
    }
}
