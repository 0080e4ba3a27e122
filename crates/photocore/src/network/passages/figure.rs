//! Points whose places follow from a few numbers: a board that bends.

use nalgebra::Matrix3x2;

use super::{Facts, PassageModel};
use crate::geometry::{ObjectSpace, Vector3};
use crate::network::commons::CommonKind;

/// Points that stand where they are given, and beside it by `w_1 e_1 + w_2 e_2`: w is a common unknown, e of each point given. A
/// chessboard that bends has the deflection of its middle along x and along y for w (mrcal: two parabolas).
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// w, a common unknown.
    pub common: usize,
    /// The points: given, in rectangular space.
    pub points: Vec<usize>,
    /// e_1, e_2 of each, as columns.
    pub shifts: Vec<Matrix3x2<f64>>,
}

impl Figure {
    /// The name under which [`super::Passage::from_numbers`] knows it.
    pub const NAME: &'static str = "figure";

    /// w, the points, and of each e_1 and e_2.
    pub(super) fn from_numbers(commons: &[usize], of: &[usize], numbers: &[f64]) -> Option<Self> {
        let (&[common], (shifts, [])) = (commons, numbers.as_chunks::<6>()) else { return None };
        let shifts: Vec<_> = shifts.iter().map(|own| Matrix3x2::from_column_slice(own)).collect();
        (shifts.len() == of.len()).then(|| Self { common, points: of.to_vec(), shifts })
    }

    /// How far the k-th of its points is from where it is given.
    pub(in crate::network) fn shift(&self, k: usize, w: &Vector3) -> Vector3 {
        self.shifts[k] * w.xy()
    }
}

impl PassageModel for Figure {
    fn unknowns(&self) -> Vec<(usize, CommonKind)> {
        vec![(self.common, CommonKind::Bend)]
    }

    /// A point that observations touch would have to move for these, too.
    fn is_of(&self, network: &Facts<'_>) -> bool {
        network.space == ObjectSpace::Rectangular
            && self.points.len() == self.shifts.len()
            && self.points.iter().all(|&point| network.given.get(point) == Some(&true))
            && self.shifts.iter().all(|own| own.iter().all(|value| value.is_finite()))
    }
}
