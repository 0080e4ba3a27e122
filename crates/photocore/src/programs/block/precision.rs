//! Coordinates and angles that double precision holds too coarsely.

use super::Block;
use super::model::CentralPerspective;
use crate::geometry::vector::{difference, square};
use crate::geometry::{self, Vector3};
use crate::programs::precision::{Coarse, is_coarse, is_coarser, median};

impl Block {
    /// Refuses coordinates and angles that rounding has changed by more than their standard deviations.
    ///
    /// # Errors
    /// There are any.
    pub(super) fn check_rounding(&self) -> Result<(), Coarse> {
        let coarse =
            |values: &Vector3, sd: &Vector3| values.iter().zip(sd).any(|(&value, &sd)| is_coarse(value, sd));
        let photo = |&i: &usize| {
            let photo = &self.photos[i];
            coarse(&photo.position, &photo.position_sd) || coarse(&photo.attitude, &photo.attitude_sd)
        };
        let point = |&i: &usize| coarse(&self.points[i].coordinates, &self.points[i].sd);
        Coarse::refuse((0..self.photos.len()).filter(photo), (0..self.points.len()).filter(point))
    }

    /// Refuses coordinates and angles that rounding has changed by more than image coordinates show: their standard deviation as
    /// an angle, and that at the distance of the points from the photographs.
    ///
    /// # Errors
    /// There are any.
    pub(super) fn check_resolution(&self, distance: Option<f64>) -> Result<(), Coarse> {
        let mut smallest = vec![f64::INFINITY; self.photos.len()];
        for image in &self.images {
            smallest[image.photo] = smallest[image.photo].min(image.sd[0]).min(image.sd[1]);
        }
        let angle = smallest.iter().zip(&self.photos).map(|(sd, photo)| sd / photo.principal_distance.abs());
        let angle = angle.fold(f64::INFINITY, f64::min);
        // Coordinates in the units of a length: those of geographic space stand on the ground at their distance from its centre.
        let length = |value: f64| is_coarser(value, angle * distance.unwrap_or(f64::INFINITY));
        let position = |coordinates: Vector3| self.space.cartesian(coordinates).into_iter().any(length);
        let photo = |&i: &usize| {
            let photo = &self.photos[i];
            position(photo.position) || photo.attitude.iter().any(|&value| is_coarser(value, angle))
        };
        let point = |&i: &usize| self.points[i].held() == [true; 3] && position(self.points[i].coordinates);
        Coarse::refuse((0..self.photos.len()).filter(photo), (0..self.points.len()).filter(point))
    }
}

impl CentralPerspective {
    /// Median distance of the points from their first photographs, at the given coordinates; of the photographs from the origin where
    /// there are none.
    pub fn middle_distance(
        &self,
        photos: &[geometry::Photo],
        coordinates: Option<&[Vector3]>,
    ) -> Option<f64> {
        let distances: Vec<f64> = match coordinates {
            Some(coordinates) => {
                let first = coordinates.iter().zip(&self.start);
                let distance = |(&at, &first): (&Vector3, &usize)| {
                    let image = self.images.get(first)?;
                    Some(difference(&self.space.cartesian(at), &photos[image.photo].centre()))
                };
                first.filter_map(distance).map(|offset| square(&offset).sqrt()).collect()
            }
            None => photos.iter().map(|photo| square(&photo.centre()).sqrt()).collect(),
        };
        median(distances)
    }
}
