//! Coordinates and angles that double precision holds too coarsely.

use super::model::CentralPerspective;
use super::{Block, BlockError, Photo};
use crate::geometry;

/// The square of a larger coordinate, or the product of its partials, is not a number.
const LARGEST: f64 = 1e100;
/// The weight that belongs to a smaller standard deviation is not one either.
const SMALLEST: f64 = 1e-100;

/// By how much rounding may have changed a number: half its distance from the next one.
fn rounding(value: f64) -> f64 {
    (value.abs().next_up() - value.abs()) / 2.0
}

/// Whether a value that counts as an observation is rounded by more than its standard deviation, or that is too small to weight it.
fn is_coarse(value: f64, sd: f64) -> bool {
    sd > 0.0 && sd.is_finite() && rounding(value).max(SMALLEST) > sd
}

impl Block {
    /// Refuses coordinates and angles that rounding has changed by more than their standard deviations.
    ///
    /// # Errors
    /// [`BlockError::Coarse`].
    pub(super) fn check_rounding(&self) -> Result<(), BlockError> {
        let too_large = |value: f64| value.abs() > LARGEST;
        let coarse = |values: &[f64; 3], sd: &[f64; 3]| {
            values.iter().zip(sd).any(|(&value, &sd)| is_coarse(value, sd) || too_large(value))
        };
        self.refuse(
            |photo| {
                coarse(&photo.position, &photo.position_sd) || coarse(&photo.attitude, &photo.attitude_sd)
            },
            |point| coarse(&point.coordinates, &point.sd),
        )
    }

    /// Refuses coordinates and angles that rounding has changed by more than image coordinates show: their standard deviation as
    /// an angle, and that at the distance of the points from the photographs.
    ///
    /// # Errors
    /// [`BlockError::Coarse`].
    pub(super) fn check_resolution(&self, distance: Option<f64>) -> Result<(), BlockError> {
        let mut smallest = vec![f64::INFINITY; self.photos.len()];
        for image in &self.images {
            smallest[image.photo] = smallest[image.photo].min(image.sd[0]).min(image.sd[1]);
        }
        let angle = smallest.iter().zip(&self.photos).map(|(sd, photo)| sd / photo.principal_distance.abs());
        let angle = angle.fold(f64::INFINITY, f64::min);
        // Coordinates in the units of a length: those of geographic space stand on the ground at their distance from its centre.
        let length = |value: f64| angle * distance.unwrap_or(f64::INFINITY) < rounding(value).max(SMALLEST);
        let position = |coordinates: [f64; 3]| self.space.cartesian(coordinates).iter().copied().any(length);
        self.refuse(
            |photo| {
                position(photo.position)
                    || photo.attitude.iter().any(|&value| angle < rounding(value).max(SMALLEST))
            },
            |point| point.held() == [true; 3] && position(point.coordinates),
        )
    }

    fn refuse(
        &self,
        photo: impl Fn(&Photo) -> bool,
        point: impl Fn(&super::Point) -> bool,
    ) -> Result<(), BlockError> {
        let photos: Vec<usize> = (0..self.photos.len()).filter(|&i| photo(&self.photos[i])).collect();
        let points: Vec<usize> = (0..self.points.len()).filter(|&i| point(&self.points[i])).collect();
        if photos.is_empty() && points.is_empty() {
            Ok(())
        } else {
            Err(BlockError::Coarse { photos, points })
        }
    }
}

impl CentralPerspective {
    /// Median distance of the points from their first photographs, at the given coordinates; of the photographs from the origin where
    /// there are none.
    pub fn middle_distance(
        &self,
        photos: &[geometry::Photo],
        coordinates: Option<&[[f64; 3]]>,
    ) -> Option<f64> {
        let mut distances: Vec<f64> = match coordinates {
            Some(coordinates) => {
                let first = coordinates.iter().zip(&self.start);
                let distance = |(&at, &first): (&[f64; 3], &usize)| {
                    let image = self.images.get(first)?;
                    Some((self.space.cartesian(at) - photos[image.photo].centre()).norm())
                };
                first.filter_map(distance).collect()
            }
            None => photos.iter().map(|photo| photo.centre().norm()).collect(),
        };
        let middle = distances.len() / 2;
        (middle < distances.len()).then(|| *distances.select_nth_unstable_by(middle, f64::total_cmp).1)
    }
}
