//! Intersection of points from the rays of given photos.

use super::linearization_point::{LinearizationPoint, Mounted, PhotoState};
use super::model::Bundle;
use super::mounts::Composed;
use crate::adjustment::median;
use crate::geometry::rotation::solve;
use crate::geometry::{Matrix3, Point, Ray, Vector3};
use crate::parallel;

/// Determinant of the normal matrix, relative to its maximum, below which rays count as parallel (about a hundredth of a degree between two
/// rays).
const PARALLEL: f64 = 1e-8;

/// Minimum number of points per thread.
const TOGETHER: usize = 64;

impl Bundle {
    /// Returns the coordinates of all points: fixed or weighted components as given, others from the intersection of rays.
    ///
    /// Approximate photos may lead to parallel rays or intersections behind a camera. Such a point is set on its first ray, at the median
    /// distance of the others.
    ///
    /// # Errors
    /// The index of a point without usable rays.
    pub fn intersect(&self, placed: &LinearizationPoint) -> Result<Vec<[f64; 3]>, usize> {
        let met: Vec<Option<Vector3>> = parallel::by_parts(self.points.len(), TOGETHER, &|points| {
            let mut rays = Vec::new();
            let meeting = |point: usize| {
                rays.clear();
                rays.extend(self.rays(placed, point));
                meet(&rays)
            };
            points.map(meeting).collect()
        });
        // Rarely needed.
        let distance = if met.contains(&None) { self.median_distance(&placed.photos, &met) } else { None };
        let place = |point: usize| {
            let met = met[point];
            let position = met.or_else(|| Some(along(&self.rays(placed, point).next()?, distance?)));
            let start = match position {
                Some(position) => self.space.coordinates(position),
                None => self.points[point].coordinates,
            };
            let there = self.hold(placed, point, start);
            if there.iter().all(|value| value.is_finite()) { Ok(there) } else { Err(point) }
        };
        let all: Vec<Result<[f64; 3], usize>> = parallel::map(self.points.len(), TOGETHER, place);
        all.into_iter().collect()
    }

    /// Returns the rays of a point, each from the pose of its image.
    fn rays(&self, placed: &LinearizationPoint, point: usize) -> impl Iterator<Item = Ray> {
        let LinearizationPoint { photos, commons, mounted, films, .. } = placed;
        let ray = move |image: usize| {
            let (own, photo) = (&self.images[image], &photos[self.images[image].photo]);
            let xy = match films.get(own.photo) {
                Some(Some(film)) => film.place(own.xy, self.image_corrections.cell(image))?,
                _ => own.xy,
            };
            let mut pose = Composed::new(false);
            let compose = |mounted: &Mounted| self.compose(mounted, commons, image, &mut pose);
            let composed = mounted.as_ref().is_some_and(compose);
            let orientation = if composed { &pose.orientation } else { &photo.orientation };
            photo.camera.direction(xy).map(|direction| orientation.ray(&direction))
        };
        (self.point_images.start[point]..self.point_images.start[point + 1]).filter_map(ray)
    }

    /// Returns the median distance of the intersected points from their first photos.
    fn median_distance(&self, photos: &[PhotoState], met: &[Option<Vector3>]) -> Option<f64> {
        let distance = |(&first, met): (&usize, &Option<Vector3>)| {
            Some((met.as_ref()? - photos[self.images[first].photo].orientation.centre()).norm())
        };
        median(self.point_images.start.iter().zip(met).filter_map(distance).collect())
    }

    /// Sets the fixed and weighted components and computes the others by least squares of the distances from the rays. The problem is
    /// linear in rectangular space, and nearly linear in geographic space.
    fn hold(&self, placed: &LinearizationPoint, point: usize, start: [f64; 3]) -> [f64; 3] {
        let (held, given) = (self.points[point].held(), self.points[point].coordinates);
        // One ray and two given components determine the third without an initial value.
        let unknown = if held.contains(&true) { 0.0 } else { f64::NAN };
        let mut coordinates = std::array::from_fn(|k| match (held[k], start[k].is_finite()) {
            (true, _) => given[k],
            (false, true) => start[k],
            (false, false) => unknown,
        });
        if held == [false; 3] || held == [true; 3] {
            return coordinates;
        }
        let rays: Vec<Ray> = self.rays(placed, point).collect();
        let free = |k: &usize| !held[*k];
        for _ in 0..3 {
            let at = Point::new(self.space, coordinates);
            let columns = [0, 1, 2].map(|k| Vector3::from(at.partials().column(k)));
            let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
            for ray in &rays {
                let offset = across(&(ray.origin - at.position()), ray);
                for j in (0..3).filter(free) {
                    right[j] += columns[j].dot(&offset);
                    let turned = across(&columns[j], ray);
                    (0..3).filter(free).for_each(|i| normal[(i, j)] += columns[i].dot(&turned));
                }
            }
            (0..3).filter(|&i| held[i]).for_each(|i| normal[(i, i)] = 1.0);
            let Some(step) = solve(&normal, &right, PARALLEL) else { break };
            (0..3).for_each(|k| coordinates[k] += step[k]);
        }
        coordinates
    }
}

/// Returns the component of a vector perpendicular to a ray.
fn across(v: &Vector3, ray: &Ray) -> Vector3 {
    v - v.dot(&ray.direction) * ray.direction
}

fn along(ray: &Ray, distance: f64) -> Vector3 {
    ray.origin + distance * ray.direction
}

/// Returns the position nearest to all rays: sum of (I - d d^T)(P - O) = 0. None if the rays are parallel or intersect behind a camera.
#[inline]
pub fn meet(rays: &[Ray]) -> Option<Vector3> {
    let first = rays.first()?.origin;
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for ray in rays {
        right += across(&(ray.origin - first), ray);
        normal += Matrix3::identity() - ray.direction * ray.direction.transpose();
    }
    let position = first + solve(&normal, &right, PARALLEL)?;
    let in_front = |ray: &Ray| (position - ray.origin).dot(&ray.direction) > 0.0;
    rays.iter().all(in_front).then_some(position)
}
