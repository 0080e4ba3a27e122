//! Values too large for double precision.

use super::error::Coarse;
use super::input::{Network, Start};
use super::linearization_point::PhotoState;
use super::model::Bundle;
use super::neighbourhood::TOGETHER;
use super::selection::Selected;
use crate::adjustment::median;
use crate::geometry::PoseNumbers;
use crate::parallel;

/// Maximum coordinate for which its square, or the product of its partials, is finite.
const LARGEST: f64 = 1e100;
/// Minimum standard deviation for which its weight is finite.
const SMALLEST: f64 = 1e-100;

/// Returns an error with the given photos (ascending) and points, if there are any.
///
/// # Errors
/// At least one photo or point is given.
fn refuse(photos: impl Iterator<Item = usize>, points: impl Iterator<Item = usize>) -> Result<(), Coarse> {
    let (photos, mut points): (Vec<usize>, Vec<usize>) = (photos.collect(), points.collect());
    points.sort_unstable();
    if photos.is_empty() && points.is_empty() { Ok(()) } else { Err(Coarse { photos, points }) }
}

/// Returns the rounding error of a number: half the distance to the next one, but at least [`SMALLEST`].
fn rounding(value: f64) -> f64 {
    ((value.abs().next_up() - value.abs()) / 2.0).max(SMALLEST)
}

/// Returns true if a value is too large, or is an observation with a rounding error above its standard deviation.
fn is_coarse(value: f64, sd: f64) -> bool {
    value.abs() > LARGEST || sd > 0.0 && sd.is_finite() && rounding(value) > sd
}

/// Returns true if the rounding error of a value exceeds `shown`, which may be infinite or NaN if it is undefined.
fn is_coarser(value: f64, shown: f64) -> bool {
    shown < rounding(value)
}

impl Network {
    /// Returns an error for active photos and points whose rounding errors exceed their standard deviations.
    ///
    /// # Errors
    /// At least one rounding error is too large.
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

    /// Returns an error for photos and points whose rounding errors are visible in image coordinates. The limits are the image precision as
    /// an angle, and its length at the distance of the points. `model` has the active images.
    ///
    /// # Errors
    /// At least one rounding error is too large.
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
        // Principal distances may be wrong parameters: each affects only its own photo, their median the points.
        let angle = |photo: usize| smallest[photo] / self.cameras[self.photos[photo].camera].camera.scale();
        let used = (0..self.photos.len()).filter(|&photo| smallest[photo].is_finite());
        let middle_angle = median(used.map(angle).collect()).unwrap_or(f64::INFINITY);
        let distance = distance.unwrap_or(f64::INFINITY);
        // Coordinates are compared in units of length; geographic ones are converted to Cartesian ones.
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
    /// Returns the median distance of the points from their first photos at given coordinates; of the photos from the origin without
    /// coordinates.
    pub(super) fn middle_distance(
        &self,
        photos: &[PhotoState],
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
