//! The adjusted calibration.

use super::model::{Group, Sight, StarImages};
use super::{COMMON, Calibration, Options};
use crate::adjustment::{Adjustment, Problem, standardized};

/// What an equation of unit weight shows after the adjustment.
#[derive(Debug, Clone, Copy)]
pub struct Tested {
    /// Redundancy numbers of its two rows; NaN when not asked for.
    pub redundancy: [f64; 2],
    /// Weighted residual over the root of the redundancy number, for the expected mean error of unit weight; NaN without
    /// redundancy.
    pub standardized: [f64; 2],
}

impl Tested {
    const NONE: Self = Self { redundancy: [f64::NAN; 2], standardized: [f64::NAN; 2] };
}

/// An adjusted calibration; cofactors are for the unit weight of the plate coordinates.
#[derive(Debug)]
pub struct Solution {
    /// Right ascension and declination of every star.
    pub places: Vec<[f64; 2]>,
    /// Their cofactors; NaN when not asked for.
    pub place_cofactors: Vec<[[f64; 2]; 2]>,
    /// Tests of their catalogue places.
    pub place_tests: Vec<Tested>,
    /// Attitudes three each, then the common parameters.
    pub parameters: Vec<f64>,
    /// Cofactors of all parameters where the attitudes are few; else of each attitude with itself and the common parameters,
    /// 3 x (3 + common) each, then of the common parameters. Row by row; empty when not asked for.
    pub cofactors: Vec<f64>,
    /// Measured minus computed plate coordinates.
    pub residuals: Vec<[f64; 2]>,
    /// Tests of the images.
    pub image_tests: Vec<Tested>,
    /// Test of the axis.
    pub axis_test: Tested,
    /// Measured minus computed plate coordinates of the axis.
    pub axis_residual: Option<[f64; 2]>,
    /// Weighted sums of squares: images, stars, parameters, axis.
    pub sums_of_squares: [f64; 4],
    /// Status, iterations, times.
    pub adjustment: Adjustment,
}

impl Solution {
    /// Puts the pieces of an adjustment back into the order of the calibration.
    pub(super) fn new(
        calibration: &Calibration,
        options: &Options,
        problem: &Problem<StarImages<'_>>,
        mut adjustment: Adjustment,
    ) -> Self {
        let unknowns = std::mem::take(&mut adjustment.unknowns);
        let (places, parameters) = unknowns.split_at(2 * calibration.stars.len() + 2);
        let sight = Sight::new(calibration, &unknowns);
        let unit = options.unit * options.unit;
        let mut solution = Self {
            places: places.as_chunks().0[..calibration.stars.len()].to_vec(),
            place_cofactors: vec![[[f64::NAN; 2]; 2]; calibration.stars.len()],
            place_tests: vec![Tested::NONE; calibration.stars.len()],
            parameters: parameters.to_vec(),
            cofactors: vec![],
            residuals: (0..calibration.images.len()).map(|i| sight.image(calibration, i).constant).collect(),
            image_tests: vec![Tested::NONE; calibration.images.len()],
            axis_test: Tested::NONE,
            axis_residual: sight.axis(calibration).map(|rows| rows.constant),
            sums_of_squares: [0.0; 4],
            adjustment,
        };
        solution.test(problem, options.unit);
        if let Some(cofactors) = solution.adjustment.cofactors.take() {
            for (own, values) in solution.place_cofactors.iter_mut().zip(cofactors.local.as_chunks::<4>().0) {
                let [a, b, c, d] = values.map(|value| value / unit);
                *own = [[a, b], [c, d]];
            }
            let scaled = |values: &[f64]| values.iter().map(|value| value / unit).collect::<Vec<f64>>();
            solution.cofactors = if cofactors.border.is_empty() {
                scaled(&cofactors.kept)
            } else {
                let own = cofactors.kept.chunks_exact(9).zip(cofactors.kept_border.chunks_exact(3 * COMMON));
                let rows = own.flat_map(|(own, cross)| {
                    (0..3).flat_map(|i| [&own[3 * i..][..3], &cross[COMMON * i..][..COMMON]].concat())
                });
                scaled(&rows.chain(cofactors.border.iter().copied()).collect::<Vec<f64>>())
            };
        }
        solution
    }

    /// Hands redundancy numbers, test values and sums of squares to images, stars, axis and parameters.
    fn test(&mut self, problem: &Problem<StarImages<'_>>, unit: f64) {
        let residuals = std::mem::take(&mut self.adjustment.residuals);
        let redundancy = self.adjustment.redundancy.take();
        for (group, kind) in problem.model.groups.iter().enumerate() {
            let weighted = [residuals[2 * group], residuals[2 * group + 1]];
            let redundancy: [f64; 2] =
                std::array::from_fn(|row| redundancy.as_ref().map_or(f64::NAN, |all| all[2 * group + row]));
            let standardized = std::array::from_fn(|row| standardized(weighted[row], unit, redundancy[row]));
            let tested = Tested { redundancy, standardized };
            let square = weighted[0] * weighted[0] + weighted[1] * weighted[1];
            match *kind {
                Group::Image(image) => {
                    (self.image_tests[image], self.sums_of_squares[0]) =
                        (tested, self.sums_of_squares[0] + square)
                }
                Group::Star(star) => {
                    (self.place_tests[star], self.sums_of_squares[1]) =
                        (tested, self.sums_of_squares[1] + square)
                }
                Group::Parameters(_) => self.sums_of_squares[2] += square,
                Group::Axis => (self.axis_test, self.sums_of_squares[3]) = (tested, square),
            }
        }
    }
}
