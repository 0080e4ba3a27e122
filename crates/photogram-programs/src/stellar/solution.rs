//! Result of a stellar calibration.

use super::model::{Root, Sight, StarImages, Tied};
use super::{Calibration, Options, StellarError};
use photocore::adjustment::{Adjustment, Problem, standardized};
use photocore::normals::Cofactors;

/// Test of an observation of two components with unit weight.
#[derive(Debug, Clone, Copy)]
pub struct Tested {
    /// Redundancy numbers of the two components; NaN if not requested.
    pub redundancy: [f64; 2],
    /// Weighted residual over the root of the redundancy number, for the expected mean error of unit weight; NaN without redundancy.
    pub standardized: [f64; 2],
}

impl Tested {
    pub(super) const NONE: Self = Self { redundancy: [f64::NAN; 2], standardized: [f64::NAN; 2] };
}

/// Adjusted stars, images and axis; cofactors are for the unit weight of the plate coordinates.
#[derive(Debug)]
pub struct Observations {
    /// Right ascension and declination of every star.
    pub places: Vec<[f64; 2]>,
    /// Cofactors of the directions; NaN if not requested.
    pub place_cofactors: Vec<[[f64; 2]; 2]>,
    /// Cofactors of the directions for error-free parameters; zero for fixed stars.
    pub place_inverses: Vec<[[f64; 2]; 2]>,
    /// Tests of the catalogue places.
    pub place_tests: Vec<Tested>,
    /// Measured minus computed plate coordinates.
    pub residuals: Vec<[f64; 2]>,
    /// Tests of the images.
    pub image_tests: Vec<Tested>,
    /// Measured minus computed plate coordinates of the axis.
    pub axis_residual: Option<[f64; 2]>,
    /// Weighted sums of squares: images, stars, parameters, axis.
    pub sums_of_squares: [f64; 4],
}

/// Cofactors of the parameters for the unit weight of the plate coordinates, row by row.
#[derive(Debug, Clone, Default)]
pub struct ParameterCofactors {
    /// Cofactors of each attitude (3 x 3).
    pub own: Vec<f64>,
    /// Cofactors of each attitude with the shared parameters (3 x shared).
    pub cross: Vec<f64>,
    /// Cofactors of the shared parameters.
    pub common: Vec<f64>,
}

/// Adjusted calibration.
#[derive(Debug)]
pub struct Solution {
    /// Attitudes three each, then the shared parameters.
    pub parameters: Vec<f64>,
    /// Stars and images.
    pub observations: Observations,
    /// Test of the axis.
    pub axis_test: Tested,
    /// Cofactors, if requested.
    pub cofactors: Option<ParameterCofactors>,
    /// Natural logarithm of the determinant of the normal equations reduced to the parameters, and the full cofactor matrix of the
    /// parameters. Both are for the unit weight of the plate coordinates, if requested.
    pub whole: Option<(f64, Vec<f64>)>,
    /// Status, iterations, times.
    pub adjustment: Adjustment,
}

impl Solution {
    /// Restores the order of the calibration for the results of an adjustment.
    pub(super) fn new(
        calibration: &Calibration,
        options: &Options,
        problem: &Problem<StarImages<'_>>,
        mut adjustment: Adjustment,
        whole: Option<(f64, Vec<f64>)>,
    ) -> Result<Self, StellarError> {
        let unknowns = std::mem::take(&mut adjustment.unknowns);
        let model = &problem.model;
        let sight = model.sight(&unknowns);
        let unit = options.unit * options.unit;
        let scaled = |values: Vec<f64>| values.into_iter().map(|value| value / unit).collect::<Vec<f64>>();
        let cofactors = adjustment.cofactors.take();
        let place_cofactors = place_cofactors(calibration, model, cofactors.as_ref(), unit);
        let attitudes = calibration.pointings.len();
        let free = problem.sd[problem.layout().all_locals().end..].iter().filter(|&&sd| sd != 0.0).count();
        let mut solution = Self {
            observations: calibration.observations(&sight, model, place_cofactors)?,
            parameters: sight.parameters,
            axis_test: Tested::NONE,
            cofactors: cofactors.map(|found| ParameterCofactors {
                own: scaled(found.retained[..9 * attitudes].to_vec()),
                // An attitude without observations is fixed.
                cross: scaled(
                    found.pairs.iter().map(|&value| if value.is_nan() { 0.0 } else { value }).collect(),
                ),
                common: scaled(found.retained[9 * attitudes..].to_vec()),
            }),
            whole: whole
                .map(|(logarithm, cofactors)| (logarithm + free as f64 * unit.ln(), scaled(cofactors))),
            adjustment,
        };
        solution.test(problem, options.unit);
        Ok(solution)
    }

    /// Distributes redundancy numbers and test values to images, stars and axis.
    fn test(&mut self, problem: &Problem<StarImages<'_>>, unit: f64) {
        let residuals = std::mem::take(&mut self.adjustment.residuals);
        let (model, redundancy) = (&problem.model, self.adjustment.redundancy.take());
        let of_rows = |first: usize| {
            let number = |row| redundancy.as_ref().map_or(f64::NAN, |all: &Vec<f64>| all[first + row]);
            tested([residuals[first], residuals[first + 1]], unit, [0, 1].map(number))
        };
        let Observations { places, place_tests, image_tests, .. } = &mut self.observations;
        for (group, &image) in model.images.iter().enumerate() {
            image_tests[image] = of_rows(2 * group);
        }
        for (local, &star) in model.stars.iter().enumerate() {
            if let Some(root) = model.catalogue[star] {
                let weighted = root_times(&root, model.off_catalogue(star, places[star]));
                place_tests[star] = tested(weighted, unit, self.adjustment.prior_redundancy(2 * local));
            }
        }
        if let Some(term) = model.terms.iter().position(|(tied, _)| matches!(tied, Tied::Axis(_))) {
            let layout = problem.layout();
            self.axis_test = of_rows(layout.equations_of_term(term).start);
        }
    }
}

fn tested(weighted: [f64; 2], unit: f64, redundancy: [f64; 2]) -> Tested {
    let standardized = std::array::from_fn(|row| standardized(weighted[row], unit, redundancy[row]));
    Tested { redundancy, standardized }
}

/// Returns R v.
pub(super) fn root_times(root: &Root, v: [f64; 2]) -> [f64; 2] {
    root.map(|row| row[0] * v[0] + row[1] * v[1])
}

fn square(v: [f64; 2]) -> f64 {
    v[0] * v[0] + v[1] * v[1]
}

/// Returns the cofactors of directions from the decorrelated coordinates (u, declination); right ascension is u - s declination.
fn place_cofactors(
    calibration: &Calibration,
    model: &StarImages<'_>,
    cofactors: Option<&Cofactors>,
    unit: f64,
) -> Vec<[[f64; 2]; 2]> {
    let Some(cofactors) = cofactors else {
        return vec![[[f64::NAN; 2]; 2]; calibration.stars.len()];
    };
    let mut found = vec![[[0.0; 2]; 2]; calibration.stars.len()];
    for (&star, values) in model.stars.iter().zip(cofactors.local.as_chunks::<4>().0) {
        if !calibration.stars[star].fixed {
            let ([uu, ud, _, dd], s) = (values.map(|value| value / unit), model.shear(star));
            let cross = ud - s * dd;
            found[star] = [[uu - s * (ud + cross), cross], [cross, dd]];
        }
    }
    found
}

impl Calibration {
    /// Returns stars and images before the tests.
    pub(super) fn observations(
        &self,
        sight: &Sight,
        model: &StarImages<'_>,
        place_cofactors: Vec<[[f64; 2]; 2]>,
    ) -> Result<Observations, StellarError> {
        let rows: Vec<_> = (0..self.images.len()).map(|image| model.image(sight, image)).collect();
        let residuals: Vec<[f64; 2]> = rows.iter().map(|rows| rows.constant).collect();
        let axis_residual = sight.axis(self).map(|rows| rows.constant);
        Ok(Observations {
            places: sight.places.clone(),
            place_cofactors,
            place_inverses: self.star_inverses(model, &rows)?,
            place_tests: vec![Tested::NONE; self.stars.len()],
            sums_of_squares: self.sums_of_squares(sight, model, &residuals, axis_residual),
            residuals,
            image_tests: vec![Tested::NONE; self.images.len()],
            axis_residual,
        })
    }

    /// Returns the weighted sums of squares: images, stars, parameters, axis.
    fn sums_of_squares(
        &self,
        sight: &Sight,
        model: &StarImages<'_>,
        residuals: &[[f64; 2]],
        axis_residual: Option<[f64; 2]>,
    ) -> [f64; 4] {
        let images = model.images.iter().zip(&model.roots);
        let stars = (0..self.stars.len()).filter_map(|star| {
            let off = model.off_catalogue(star, sight.places[star]);
            model.catalogue[star].map(|root| square(root_times(&root, off)))
        });
        let (mut parameters, mut axis) = (0.0, 0.0);
        for (tied, _) in &model.terms {
            match tied {
                Tied::Axis(root) => axis = axis_residual.map_or(0.0, |v| square(root_times(root, v))),
                Tied::Parameters(row) => parameters += self.off_given(sight, *row).powi(2),
            }
        }
        let images = images.map(|(&image, root)| square(root_times(root, residuals[image]))).sum();
        [images, stars.sum(), parameters, axis]
    }
}
