//! How far a point is from a feature, with first and second partials.
//!
//! A feature stands in a frame of its own: a plane is z = 0, lines, circles and cylinders have z as their axis, spheres and circles the
//! origin as their centre. With y the point in the frame at its present place, and the frame moved by t, turned by w (small), the point
//! is at
//!
//! v = exp(-\[w\]) (y - t) = y - t - w x (y - t) + 1/2 w x (w x y) + ...,
//!
//! and a deviation is a coordinate of v, or the length of its first coordinates less the radius. What kinds of features differ in is
//! which motions change them.

use nalgebra::{SMatrix, SVector};

use super::Form;
use crate::geometry::{Matrix3, Vector3};

/// Motions of the frame: shifts along its axes, rotations about them, the radius.
pub const MOTIONS: usize = 7;
/// The place of the radius among the motions.
pub const RADIUS: usize = 6;

/// Of one number by the motions.
pub type ByMotions = SVector<f64, MOTIONS>;
/// Second partials by the motions.
pub type Curvature = SMatrix<f64, MOTIONS, MOTIONS>;

/// What a deviation is, in the frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Deviation {
    /// The coordinate along an axis.
    Along(usize),
    /// The length of so many coordinates less the radius.
    Round(usize),
}

impl Form {
    /// The deviations of a point: their squares sum to the square of its distance.
    pub const fn deviations(self) -> &'static [Deviation] {
        match self {
            Self::Line => &[Deviation::Along(0), Deviation::Along(1)],
            Self::Plane => &[Deviation::Along(2)],
            Self::Circle => &[Deviation::Round(2), Deviation::Along(2)],
            Self::Sphere => &[Deviation::Round(3)],
            Self::Cylinder => &[Deviation::Round(2)],
        }
    }

    /// The motions that change the feature.
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

/// A deviation d with its partials.
#[derive(Debug, Clone)]
pub struct Partials {
    /// d.
    pub value: f64,
    /// By the motions.
    pub motions: ByMotions,
    /// By the point, along the axes of the frame.
    pub point: Vector3,
    /// Second ones by the motions.
    pub curvature: Curvature,
    /// Second ones by the motions and the point.
    pub mixed: SMatrix<f64, MOTIONS, 3>,
}

impl Deviation {
    /// The deviation of a point y of the frame.
    pub fn value(self, y: &Vector3, radius: f64) -> f64 {
        match self {
            Self::Along(axis) => y[axis],
            Self::Round(count) => y.rows(0, count).norm() - radius,
        }
    }

    /// The same with its partials; those of a length of 0 are 0.
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

    /// First and second partials by the point.
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
