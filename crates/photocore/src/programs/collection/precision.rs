//! Values of a collection that double precision holds too coarsely.

use super::{Collection, Image, Used};
use crate::geometry::vector::{difference, square};
use crate::geometry::{BundlerPhoto, Vector3};
use crate::programs::precision::{Coarse, is_coarse, is_coarser, median};

impl Collection {
    /// Refuses photos and points whose values rounding has changed by more than their standard deviations, or than image coordinates
    /// show: their standard deviation as an angle, and that at the distance of the points from the photos. Of the photos and points
    /// that take part.
    ///
    /// # Errors
    /// There are any.
    pub(super) fn check_precision(&self, used: &Used) -> Result<(), Coarse> {
        let photos = || (0..self.photos.len()).filter(|&photo| used.images_on[photo] > 0);
        let points = || used.points.iter().copied();
        let coarse =
            |values: &[f64], sd: &[f64]| values.iter().zip(sd).any(|(&value, &sd)| is_coarse(value, sd));
        Coarse::refuse(
            photos().filter(|&i| coarse(&self.photos[i].parameters, &self.photos[i].sd)),
            points().filter(|&i| coarse(&self.points[i].position, &self.points[i].sd)),
        )?;
        let mut smallest = vec![f64::INFINITY; self.photos.len()];
        for &image in &used.images {
            let Image { photo, sd, .. } = self.images[image];
            smallest[photo] = smallest[photo].min(sd[0]).min(sd[1]);
        }
        // Focal lengths are unknowns, and may be as wrong as anything: each says of its photo only, the median of the points.
        let angle = |photo: usize| smallest[photo] / self.photos[photo].parameters[6].abs();
        let middle_angle = median(photos().map(angle).collect()).unwrap_or(f64::INFINITY);
        let distance = self.middle_distance(used);
        let photo = |&i: &usize| {
            let [w1, w2, w3, t1, t2, t3, ..] = self.photos[i].parameters;
            [w1, w2, w3].into_iter().any(|value| is_coarser(value, angle(i)))
                || [t1, t2, t3].into_iter().any(|value| is_coarser(value, angle(i) * distance))
        };
        let point = |&i: &usize| {
            self.points[i].position.iter().any(|&value| is_coarser(value, middle_angle * distance))
        };
        Coarse::refuse(photos().filter(photo), points().filter(point))
    }

    /// Median distance of the points from their first photos.
    fn middle_distance(&self, used: &Used) -> f64 {
        let centres: Vec<Vector3> =
            self.photos.iter().map(|photo| BundlerPhoto::new(photo.parameters).centre()).collect();
        let distance = |(&point, &first): (&usize, &usize)| {
            let photo = self.images[used.images[first]].photo;
            square(&difference(&self.points[point].position, &centres[photo])).sqrt()
        };
        median(used.points.iter().zip(&used.start).map(distance).collect()).unwrap_or(f64::INFINITY)
    }
}
