//! Configurations that do not determine a pose.

use super::three_points::{square, unit};
use crate::geometry::Vector3;
use crate::geometry::vector::{cross, difference, dot};

/// Distances of all points from a line, relative to their extent, below which they count as collinear.
const COLLINEAR: f64 = 1e-7;
/// Distance of the projection centre from the danger cylinder, relative to its radius, at which it counts as on it.
const ON_CYLINDER: f64 = 1e-4;

/// Why the observations do not determine the pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Degeneracy {
    /// Fewer than three points.
    TooFewPoints,
    /// All points are on one line.
    Collinear,
    /// All points are on a circle, and the projection centre is on the right cylinder over it.
    DangerCylinder,
    /// None of these.
    Unnamed,
}

impl Degeneracy {
    /// Names what is wrong with points seen from a projection centre (cartesian).
    pub(super) fn of(points: &[Vector3], centre: &Vector3) -> Self {
        let on_cylinder =
            |circle: Circle| circle.outside_cylinder(centre).abs() <= ON_CYLINDER * circle.radius;
        if points.len() < 3 {
            Degeneracy::TooFewPoints
        } else if collinear(points) {
            Degeneracy::Collinear
        } else if Circle::through(points).is_some_and(on_cylinder) {
            Degeneracy::DangerCylinder
        } else {
            Degeneracy::Unnamed
        }
    }
}

/// Whether all points are on one line.
pub(super) fn collinear(points: &[Vector3]) -> bool {
    let Some(&first) = points.first() else { return true };
    let offsets: Vec<Vector3> = points.iter().map(|point| difference(point, &first)).collect();
    let farthest = offsets.iter().copied().max_by(|a, b| square(a).total_cmp(&square(b))).unwrap_or_default();
    let limit = (COLLINEAR * square(&farthest)).powi(2);
    offsets.iter().all(|offset| square(&cross(offset, &farthest)) <= limit)
}

/// The circle through points of a plane, if they are on one: centre, radius, normal of the plane.
pub(super) struct Circle {
    centre: Vector3,
    radius: f64,
    normal: Vector3,
}

impl Circle {
    /// Largest distance from plane and circle, relative to the radius.
    const TOLERANCE: f64 = 1e-6;

    /// The circle through three or more points; None where they are not on one.
    pub fn through(points: &[Vector3]) -> Option<Self> {
        let (&first, rest) = points.split_first()?;
        let second = *rest
            .iter()
            .max_by(|a, b| square(&difference(a, &first)).total_cmp(&square(&difference(b, &first))))?;
        let along = difference(&second, &first);
        let across = |point: &Vector3| square(&cross(&along, &difference(point, &first)));
        let third = *rest.iter().max_by(|a, b| across(a).total_cmp(&across(b)))?;
        let side = difference(&third, &first);
        let normal = cross(&along, &side);
        let size = square(&normal);
        // The circumcentre of a triangle from one corner: (|a|^2 (b x n) + |b|^2 (n x a)) / 2 |n|^2.
        let (p, q) = (cross(&side, &normal), cross(&normal, &along));
        let offset: Vector3 =
            std::array::from_fn(|k| (square(&along) * p[k] + square(&side) * q[k]) / (2.0 * size));
        let radius = square(&offset).sqrt();
        let centre = std::array::from_fn(|k| first[k] + offset[k]);
        let circle = Self { centre, radius, normal: unit(&normal)? };
        let on_circle = |point: &Vector3| {
            let from = difference(point, &circle.centre);
            let height = dot(&from, &circle.normal).abs();
            height.max((square(&from).sqrt() - radius).abs()) <= Self::TOLERANCE * radius
        };
        points.iter().all(on_circle).then_some(circle)
    }

    /// Distance of a position from the danger cylinder, the right cylinder over the circle: negative inside.
    pub fn outside_cylinder(&self, position: &Vector3) -> f64 {
        let from = difference(position, &self.centre);
        let height = dot(&from, &self.normal);
        (square(&from) - height * height).max(0.0).sqrt() - self.radius
    }
}
