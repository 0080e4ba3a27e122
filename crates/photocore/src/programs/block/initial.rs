//! Coordinates of points by intersection of their rays from given photographs.

use super::model::CentralPerspective;
use crate::geometry::vector::{difference, dot, solve, square};
use crate::geometry::{Photo, Point, Ray, Vector3};

/// Determinant of the normal matrix, relative to its largest possible value, below which rays count as parallel
/// (about a hundredth of a degree between two rays).
const PARALLEL: f64 = 1e-8;

impl CentralPerspective {
    /// Coordinates of all points from given photographs: held components as they are, the others where the rays meet.
    ///
    /// Rays from coarse photographs may be parallel or meet behind a camera; such a point stands on its first ray, as far out
    /// as the median of the others.
    ///
    /// # Errors
    /// The point whose rays give it no place.
    pub fn intersect(&self, photos: &[Photo]) -> Result<Vec<Vector3>, usize> {
        let points = 0..self.points.len();
        let met: Vec<Option<Vector3>> = points.clone().map(|point| meet(&self.rays(photos, point))).collect();
        let distance = self.median_distance(photos, &met);
        let mut coordinates = Vec::with_capacity(self.points.len());
        for (point, met) in points.zip(met) {
            let position = met.or_else(|| Some(along(self.rays(photos, point).first()?, distance?)));
            let start = match position {
                Some(position) => self.space.coordinates(position),
                None => self.points[point].coordinates,
            };
            let placed = self.hold(photos, point, start);
            if placed.iter().any(|value| !value.is_finite()) {
                return Err(point);
            }
            coordinates.push(placed);
        }
        Ok(coordinates)
    }

    fn rays(&self, photos: &[Photo], point: usize) -> Vec<Ray> {
        let own = &self.images[self.start[point]..self.start[point + 1]];
        own.iter().map(|image| photos[image.photo].ray(image.xy)).collect()
    }

    /// Median distance of the intersected points from their first photographs.
    fn median_distance(&self, photos: &[Photo], met: &[Option<Vector3>]) -> Option<f64> {
        let distance = |(&first, met): (&usize, &Option<Vector3>)| {
            let offset = difference(met.as_ref()?, &photos[self.images[first].photo].centre());
            Some(square(&offset).sqrt())
        };
        let mut distances: Vec<f64> = self.start.iter().zip(met).filter_map(distance).collect();
        distances.sort_unstable_by(f64::total_cmp);
        distances.get(distances.len() / 2).copied()
    }

    /// Puts the held components in place and moves the others to where the rays then pass nearest: least squares of the distances
    /// from the rays, linear in rectangular space and all but linear in geographic space.
    fn hold(&self, photos: &[Photo], point: usize, start: Vector3) -> Vector3 {
        let (held, given) = (self.points[point].held(), self.points[point].coordinates);
        // One ray and two held components need no start for the third.
        let unknown = if held.contains(&true) { 0.0 } else { f64::NAN };
        let mut coordinates = std::array::from_fn(|k| match (held[k], start[k].is_finite()) {
            (true, _) => given[k],
            (false, true) => start[k],
            (false, false) => unknown,
        });
        if held == [false; 3] || held == [true; 3] {
            return coordinates;
        }
        let rays = self.rays(photos, point);
        for _ in 0..3 {
            let at = Point::new(self.space, coordinates);
            let column = |k: usize| -> Vector3 { std::array::from_fn(|i| at.partials()[i][k]) };
            let mut normal = [[0.0; 3]; 3];
            let mut right = [0.0; 3];
            for ray in &rays {
                let offset = across(&difference(&ray.origin, &at.position()), ray);
                for i in (0..3).filter(|&i| !held[i]) {
                    right[i] += dot(&column(i), &offset);
                    for j in (0..3).filter(|&j| !held[j]) {
                        normal[i][j] += dot(&column(i), &across(&column(j), ray));
                    }
                }
            }
            (0..3).filter(|&i| held[i]).for_each(|i| normal[i][i] = 1.0);
            let Some(step) = solve(&normal, &right, PARALLEL) else { break };
            (0..3).for_each(|k| coordinates[k] += step[k]);
        }
        coordinates
    }
}

/// The part of a vector across a ray.
fn across(v: &Vector3, ray: &Ray) -> Vector3 {
    let along = dot(v, &ray.direction);
    std::array::from_fn(|k| v[k] - along * ray.direction[k])
}

fn along(ray: &Ray, distance: f64) -> Vector3 {
    std::array::from_fn(|k| ray.origin[k] + distance * ray.direction[k])
}

/// The position nearest to all rays, in front of every camera: sum of (I - d d^T)(P - O) = 0. None when the rays are parallel or
/// meet behind a camera.
fn meet(rays: &[Ray]) -> Option<Vector3> {
    let first = rays.first()?.origin;
    let mut normal = [[0.0; 3]; 3];
    let mut right = [0.0; 3];
    for ray in rays {
        let offset = across(&difference(&ray.origin, &first), ray);
        for i in 0..3 {
            right[i] += offset[i];
            for j in 0..3 {
                normal[i][j] += f64::from(u8::from(i == j)) - ray.direction[i] * ray.direction[j];
            }
        }
    }
    let from_first = solve(&normal, &right, PARALLEL)?;
    let position = std::array::from_fn(|k| first[k] + from_first[k]);
    let in_front = |ray: &Ray| dot(&difference(&position, &ray.origin), &ray.direction) > 0.0;
    rays.iter().all(in_front).then_some(position)
}
