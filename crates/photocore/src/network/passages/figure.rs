//! Points whose positions depend on few parameters: a bent board.

use nalgebra::Matrix3x2;

use super::{Facts, PassageModel};
use crate::geometry::{ObjectSpace, Vector3};
use crate::network::commons::CommonKind;

/// Points at their given positions plus `w_1 e_1 + w_2 e_2`: w is a shared parameter, and each point has a given e. For a bent chessboard,
/// w is the deflection of its centre along x and y (mrcal: two parabolas).
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Shared parameter w.
    pub common: usize,
    /// Points with fixed coordinates, in rectangular space.
    pub points: Vec<usize>,
    /// e_1 and e_2 of each point, as columns.
    pub shifts: Vec<Matrix3x2<f64>>,
}

impl Figure {
    /// Name in [`super::Passage::from_numbers`].
    pub const NAME: &'static str = "figure";

    /// Indices: w, points; numbers: e_1 and e_2 of each point.
    pub(super) fn from_numbers(commons: &[usize], of: &[usize], numbers: &[f64]) -> Option<Self> {
        let (&[common], (shifts, [])) = (commons, numbers.as_chunks::<6>()) else { return None };
        let shifts: Vec<_> = shifts.iter().map(|own| Matrix3x2::from_column_slice(own)).collect();
        (shifts.len() == of.len()).then(|| Self { common, points: of.to_vec(), shifts })
    }

    /// Returns the displacement of its k-th point.
    pub(in crate::network) fn shift(&self, k: usize, w: &Vector3) -> Vector3 {
        self.shifts[k] * w.xy()
    }
}

impl PassageModel for Figure {
    fn unknowns(&self) -> Vec<(usize, CommonKind)> {
        vec![(self.common, CommonKind::Bend)]
    }

    /// Points with additional observations are excluded: these would also depend on w.
    fn is_of(&self, network: &Facts<'_>) -> bool {
        network.space == ObjectSpace::Rectangular
            && self.points.len() == self.shifts.len()
            && self.points.iter().all(|&point| network.given.get(point) == Some(&true))
            && self.shifts.iter().all(|own| own.iter().all(|value| value.is_finite()))
    }
}
