//! A pose relative to another photo, and how well pairs of rays fit it.

use crate::geometry::{Matrix3, Vector3};

/// The part of the pairs that must fit: with a quarter of the images wrong, nearly half of the pairs are.
const JUDGED: f64 = 0.4;
/// Poses are alike whose direction cosines are as near as this.
const SAME: f64 = 0.02;

/// The pose of the second photo in the axes of the first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Oriented {
    /// From the first projection centre to the second, of unit length.
    pub base: Vector3,
    /// A, second photo to first.
    pub attitude: Matrix3,
}

impl Oriented {
    /// Distances along two rays to where they pass each other, in bases.
    pub fn distances(&self, [first, second]: &[Vector3; 2]) -> [f64; 2] {
        let turned = self.attitude * second;
        let normal = first.cross(&turned);
        let square = normal.norm_squared();
        [self.base.cross(&turned).dot(&normal) / square, self.base.cross(first).dot(&normal) / square]
    }

    /// The angle by which two rays miss each other, radians; 1 where they meet behind a photo.
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

    /// The angle at which two rays meet, radians.
    pub fn angle(&self, [first, second]: &[Vector3; 2]) -> f64 {
        first.angle(&(self.attitude * second))
    }

    /// What the part of the pairs that must fit is missed by at the most.
    pub(super) fn score(&self, pairs: &[[Vector3; 2]]) -> f64 {
        let mut misfits: Vec<f64> = pairs.iter().map(|pair| self.misfit(pair)).collect();
        let judge = (JUDGED * misfits.len() as f64) as usize;
        *misfits.select_nth_unstable_by(judge, f64::total_cmp).1
    }

    /// Whether two poses are one.
    pub(super) fn is_like(&self, other: &Self) -> bool {
        (self.attitude - other.attitude).amax() < SAME && (self.base - other.base).amax() < 5.0 * SAME
    }
}
