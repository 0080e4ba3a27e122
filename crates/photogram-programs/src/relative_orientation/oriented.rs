//! Pose relative to another photo, and the fit of pairs of rays.

use photocore::geometry::{Matrix3, Vector3};

/// Fraction of the pairs that must fit: if a quarter of the observations is wrong, nearly half of the pairs are wrong.
const JUDGED: f64 = 0.4;
/// Largest difference of the direction cosines of equal poses.
const SAME: f64 = 0.02;

/// Pose of the second photo in the axes of the first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Oriented {
    /// Unit vector from the first projection centre to the second.
    pub base: Vector3,
    /// A, second photo to first.
    pub attitude: Matrix3,
}

impl Oriented {
    /// Returns the distances along two rays to their closest approach, in units of the base.
    pub fn distances(&self, [first, second]: &[Vector3; 2]) -> [f64; 2] {
        let turned = self.attitude * second;
        let normal = first.cross(&turned);
        let square = normal.norm_squared();
        [self.base.cross(&turned).dot(&normal) / square, self.base.cross(first).dot(&normal) / square]
    }

    /// Returns the angle by which two rays fail to intersect, radians; 1 if they intersect behind a photo.
    pub fn misfit(&self, pair: &[Vector3; 2]) -> f64 {
        let [first, second] = pair;
        let turned = self.attitude * second;
        let (in_first, in_second) = (self.base.cross(&turned), first.cross(&self.base));
        let size = (in_first.norm_squared() + in_second.norm_squared()).sqrt();
        if size == 0.0 || self.distances(pair).iter().any(|&distance| distance < 0.0) {
            return 1.0;
        }
        first.dot(&in_first).abs() / size
    }

    /// Returns the intersection angle of two rays, radians.
    pub fn angle(&self, [first, second]: &[Vector3; 2]) -> f64 {
        first.angle(&(self.attitude * second))
    }

    /// Returns the largest misfit of the fraction of the pairs that must fit.
    pub(super) fn score(&self, pairs: &[[Vector3; 2]]) -> f64 {
        let mut misfits: Vec<f64> = pairs.iter().map(|pair| self.misfit(pair)).collect();
        let judge = (JUDGED * misfits.len() as f64) as usize;
        *misfits.select_nth_unstable_by(judge, f64::total_cmp).1
    }

    /// Returns whether two poses are equal.
    pub(super) fn is_like(&self, other: &Self) -> bool {
        (self.attitude - other.attitude).amax() < SAME && (self.base - other.base).amax() < 5.0 * SAME
    }
}
