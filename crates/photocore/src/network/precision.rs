//! Values that double precision holds too coarsely.

use super::error::Coarse;
use super::median::median;
use super::model::Bundle;
use super::selection::{Selected, TOGETHER};
use super::stations::Station;
use super::{Network, Start};
use crate::geometry::PoseNumbers;
use crate::parallel;

/// The square of a larger coordinate, or the product of its partials, is not a number.
const LARGEST: f64 = 1e100;
/// The weight that belongs to a smaller standard deviation is not one either.
const SMALLEST: f64 = 1e-100;

/// Refuses photos, ascending, and points that are too coarse.
///
/// # Errors
/// There are any.
fn refuse(photos: impl Iterator<Item = usize>, points: impl Iterator<Item = usize>) -> Result<(), Coarse> {
    let (photos, mut points): (Vec<usize>, Vec<usize>) = (photos.collect(), points.collect());
    points.sort_unstable();
    if photos.is_empty() && points.is_empty() { Ok(()) } else { Err(Coarse { photos, points }) }
}

/// By how much rounding may have changed a number: half its distance from the next one, and more than would give no weight.
fn rounding(value: f64) -> f64 {
    ((value.abs().next_up() - value.abs()) / 2.0).max(SMALLEST)
}

/// Whether a value cannot be computed with; or counts as an observation, and is rounded by more than its standard deviation.
fn is_coarse(value: f64, sd: f64) -> bool {
    value.abs() > LARGEST || sd > 0.0 && sd.is_finite() && rounding(value) > sd
}

/// Whether rounding has changed a value by more than what shows; `shown` may be infinite or NaN where that is not known.
fn is_coarser(value: f64, shown: f64) -> bool {
    shown < rounding(value)
}

impl Network {
    /// Refuses photos and points whose values rounding has changed by more than their standard deviations; of those that take part.
    ///
    /// # Errors
    /// There are any.
    pub(super) fn check_rounding(
        &self,
        selected: &Selected,
        uses: impl Fn(usize) -> bool,
    ) -> Result<(), Coarse> {
        let coarse =
            |values: &[f64], sd: &[f64]| values.iter().zip(sd).any(|(&value, &sd)| is_coarse(value, sd));
        let photo = |&i: &usize| {
            let photo = &self.photos[i];
            let camera = &self.cameras[photo.camera];
            coarse(&photo.pose, &photo.sd) || coarse(&camera.camera.parameters(), &camera.sd)
        };
        let point = |&i: &usize| coarse(&self.points[i].coordinates, &self.points[i].sd);
        let photos = (0..self.photos.len()).filter(|&photo| uses(photo));
        let points = parallel::by_parts(selected.points.len(), TOGETHER, &|some| {
            selected.points[some].iter().copied().filter(&point).collect()
        });
        refuse(photos.filter(photo), points.into_iter())
    }

    /// Refuses photos and points whose values rounding has changed by more than image coordinates show: their standard deviation
    /// as an angle, and that at the distance of the points from the photos. `model` has the images that take part.
    ///
    /// # Errors
    /// There are any.
    pub(super) fn check_resolution(
        &self,
        selected: &Selected,
        model: &Bundle,
        distance: Option<f64>,
        start: Start,
    ) -> Result<(), Coarse> {
        let mut smallest = vec![f64::INFINITY; self.photos.len()];
        for image in &model.images {
            smallest[image.photo] = smallest[image.photo].min(image.sd[0]).min(image.sd[1]);
        }
        // Principal distances may be unknowns, and as wrong as anything: each says of its photo only, the median of the points.
        let angle = |photo: usize| smallest[photo] / self.cameras[self.photos[photo].camera].camera.scale();
        let used = (0..self.photos.len()).filter(|&photo| smallest[photo].is_finite());
        let middle_angle = median(used.map(angle).collect()).unwrap_or(f64::INFINITY);
        let distance = distance.unwrap_or(f64::INFINITY);
        // Coordinates in the units of a length: those of geographic space stand on the ground at their distance from its centre.
        let too_far = |coordinates: [f64; 3], angle: f64| {
            self.space.cartesian(coordinates).iter().any(|&value| is_coarser(value, angle * distance))
        };
        let photo = |&i: &usize| {
            let [a, b, c, d, e, f] = self.photos[i].pose;
            let (place, turns) = match self.poses {
                PoseNumbers::Angles(_) => ([a, b, c], [d, e, f]),
                PoseNumbers::Vectors => ([d, e, f], [a, b, c]),
            };
            too_far(place, angle(i)) || turns.iter().any(|&value| is_coarser(value, angle(i)))
        };
        let point = |&i: &usize| {
            let given = start == Start::Given || self.points[i].held() == [true; 3];
            given && too_far(self.points[i].coordinates, middle_angle)
        };
        refuse((0..self.photos.len()).filter(photo), selected.points.iter().copied().filter(point))
    }
}

impl Bundle {
    /// Median distance of the points from their first photos, at the given coordinates; of the photos from the origin where there
    /// are none.
    pub(super) fn middle_distance(
        &self,
        photos: &[Station],
        coordinates: Option<&[[f64; 3]]>,
    ) -> Option<f64> {
        let distances: Vec<f64> = match coordinates {
            Some(coordinates) => {
                let first = coordinates.iter().zip(&self.point_images.start);
                let distance = |(&at, &first): (&[f64; 3], &usize)| {
                    let image = self.images.get(first)?;
                    Some((self.space.cartesian(at) - photos[image.photo].orientation.centre()).norm())
                };
                first.filter_map(distance).collect()
            }
            None => photos.iter().map(|photo| photo.orientation.centre().norm()).collect(),
        };
        median(distances)
    }
}
