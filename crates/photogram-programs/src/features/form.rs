//! Deviation of a point from a feature, with first and second partials.
//!
//! A feature is defined in its own frame: a plane is z = 0; lines, circles and cylinders have the axis z; spheres and circles are centred
//! at the origin. y is the point in the current frame. If the frame is shifted by t and rotated by a small w, the point is at
//!
//! v = exp(-\[w\]) (y - t) = y - t - w x (y - t) + 1/2 w x (w x y) + ...,
//!
//! A deviation is a coordinate of v, or the length of its first coordinates minus the radius. Feature types differ in the motions that
//! change them.

use nalgebra::{SMatrix, SVector};

use super::Form;
use photocore::geometry::{Matrix3, Vector3};

/// Number of motions of the frame: shifts along its axes, rotations about them, the radius.
pub const MOTIONS: usize = 7;
/// Index of the radius among the motions.
pub const RADIUS: usize = 6;

/// Partials of a number with respect to the motions.
pub type ByMotions = SVector<f64, MOTIONS>;
/// Second partials with respect to the motions.
pub type Curvature = SMatrix<f64, MOTIONS, MOTIONS>;

/// Type of a deviation in the frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Deviation {
    /// Coordinate along an axis.
    Along(usize),
    /// Length of the first n coordinates minus the radius.
    Round(usize),
}

impl Form {
    /// Returns the deviations of a point: their squares sum to its squared distance.
    pub const fn deviations(self) -> &'static [Deviation] {
        match self {
            Self::Line => &[Deviation::Along(0), Deviation::Along(1)],
            Self::Plane => &[Deviation::Along(2)],
            Self::Circle => &[Deviation::Round(2), Deviation::Along(2)],
            Self::Sphere => &[Deviation::Round(3)],
            Self::Cylinder => &[Deviation::Round(2)],
        }
    }

    /// Returns the motions that change the feature.
    pub const fn motions(self) -> &'static [usize] {
        match self {
            Self::Line => &[0, 1, 3, 4],
            Self::Plane => &[2, 3, 4],
            Self::Circle => &[0, 1, 2, 3, 4, RADIUS],
            Self::Sphere => &[0, 1, 2, RADIUS],
            Self::Cylinder => &[0, 1, 3, 4, RADIUS],
        }
    }
}

/// Deviation d with its partials.
#[derive(Debug, Clone)]
pub struct Partials {
    /// d.
    pub value: f64,
    /// With respect to the motions.
    pub motions: ByMotions,
    /// With respect to the point, along the axes of the frame.
    pub point: Vector3,
    /// Second partials with respect to the motions.
    pub curvature: Curvature,
    /// Second partials with respect to the motions and the point.
    pub mixed: SMatrix<f64, MOTIONS, 3>,
}

impl Deviation {
    /// Returns the deviation of a point y of the frame.
    pub fn value(self, y: &Vector3, radius: f64) -> f64 {
        match self {
            Self::Along(axis) => y[axis],
            Self::Round(count) => y.rows(0, count).norm() - radius,
        }
    }

    /// Returns the deviation with its partials; the partials of a zero length are 0.
    pub fn linearize(self, y: &Vector3, radius: f64) -> Partials {
        let (point, bending) = self.by_point(y);
        let units = [Vector3::x(), Vector3::y(), Vector3::z()];
        let moved: [Vector3; 6] =
            std::array::from_fn(|k| if k < 3 { -units[k] } else { y.cross(&units[k - 3]) });
        let mut motions = ByMotions::zeros();
        let mut curvature = Curvature::zeros();
        let mut mixed = SMatrix::<f64, MOTIONS, 3>::zeros();
        for a in 0..6 {
            motions[a] = point.dot(&moved[a]);
            let turned = if a < 3 { Vector3::zeros() } else { units[a - 3].cross(&point) };
            mixed.set_row(a, &(bending * moved[a] + turned).transpose());
            for b in 0..6 {
                let second = match (a < 3, b < 3) {
                    (true, true) => Vector3::zeros(),
                    (true, false) => units[b - 3].cross(&units[a]),
                    (false, true) => units[a - 3].cross(&units[b]),
                    (false, false) => {
                        let (a, b) = (units[a - 3], units[b - 3]);
                        0.5 * (a.cross(&b.cross(y)) + b.cross(&a.cross(y)))
                    }
                };
                curvature[(a, b)] = moved[a].dot(&(bending * moved[b])) + point.dot(&second);
            }
        }
        motions[RADIUS] = if matches!(self, Self::Round(_)) { -1.0 } else { 0.0 };
        Partials { value: self.value(y, radius), motions, point, curvature, mixed }
    }

    /// Returns first and second partials with respect to the point.
    fn by_point(self, y: &Vector3) -> (Vector3, Matrix3) {
        match self {
            Self::Along(axis) => (Vector3::ith(axis, 1.0), Matrix3::zeros()),
            Self::Round(count) => {
                let own = Vector3::from_fn(|k, _| if k < count { y[k] } else { 0.0 });
                let length = own.norm();
                if length == 0.0 {
                    return (own, Matrix3::zeros());
                }
                let unit = own / length;
                let across = Matrix3::from_fn(|i, j| if i == j && i < count { 1.0 } else { 0.0 });
                (unit, (across - unit * unit.transpose()) / length)
            }
        }
    }
}
