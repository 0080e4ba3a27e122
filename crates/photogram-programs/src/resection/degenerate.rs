//! Configurations that do not determine a pose.

use photocore::geometry::Vector3;
use photocore::geometry::rotation::unit;

/// Distance of all points from a line, relative to their extent, below which they are collinear.
const COLLINEAR: f64 = 1e-7;
/// Distance of the projection centre from the danger cylinder, relative to the radius, below which it is on the cylinder.
const ON_CYLINDER: f64 = 1e-4;

/// Reason why the observations do not determine the pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Degeneracy {
    /// Fewer than three points.
    TooFewPoints,
    /// All points are on one line.
    Collinear,
    /// Three points, with the projection centre on the right cylinder over the circle through them.
    DangerCylinder,
    /// Another reason.
    Unnamed,
}

impl Degeneracy {
    /// Classifies points seen from a projection centre (cartesian).
    pub(super) fn of(points: &[Vector3], centre: &Vector3) -> Self {
        let on_cylinder = |(outside, radius): (f64, f64)| outside.abs() <= ON_CYLINDER * radius;
        if points.len() < 3 {
            Degeneracy::TooFewPoints
        } else if collinear(points) {
            Degeneracy::Collinear
        } else if outside_cylinder(points, centre).is_some_and(on_cylinder) {
            Degeneracy::DangerCylinder
        } else {
            Degeneracy::Unnamed
        }
    }
}

/// Returns whether all points are on one line.
pub(super) fn collinear(points: &[Vector3]) -> bool {
    let Some(&first) = points.first() else { return true };
    let offsets: Vec<Vector3> = points.iter().map(|point| point - first).collect();
    let farthest = offsets
        .iter()
        .copied()
        .max_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()))
        .unwrap_or_default();
    let limit = (COLLINEAR * farthest.norm_squared()).powi(2);
    offsets.iter().all(|offset| offset.cross(&farthest).norm_squared() <= limit)
}

/// Returns the distance of a position from the danger cylinder of three points (the right cylinder over the circle through them), negative
/// inside, and its radius. None unless there are exactly three points, and not on one line.
///
/// On the cylinder three points do not determine the pose: a small movement along it changes no angle between their rays to first order
/// (Finsterwalder 1903). With a fourth point the cylinder is harmless.
pub(super) fn outside_cylinder(points: &[Vector3], position: &Vector3) -> Option<(f64, f64)> {
    let &[first, second, third] = points else { return None };
    let (along, side) = (second - first, third - first);
    let normal = along.cross(&side);
    let axis = unit(&normal)?;
    // Circumcentre of a triangle relative to one corner: (|a|^2 (b x n) + |b|^2 (n x a)) / 2 |n|^2.
    let (p, q) = (side.cross(&normal), normal.cross(&along));
    let offset = (along.norm_squared() * p + side.norm_squared() * q) / (2.0 * normal.norm_squared());
    let radius = offset.norm();
    let from = position - first - offset;
    let height = from.dot(&axis);
    Some(((from.norm_squared() - height * height).max(0.0).sqrt() - radius, radius))
}
