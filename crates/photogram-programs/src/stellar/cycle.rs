//! Corrections of the stars, residuals and their tests for final parameters and given cofactors: the v-cycle of the report's program
//! (equations 64 to 71 of the report; section 5.6 of its specification).

use faer::{Mat, MatRef};

use super::model::{Partials, Root, Rows, Sight, StarImages, Tolerances};
use super::solution::{Observations, Tested};
use super::{COMMON, Calibration, StellarError};

type Matrix2 = [[f64; 2]; 2];

fn matrix(values: &Matrix2) -> MatRef<'_, f64> {
    MatRef::from_row_major_slice(values.as_flattened(), 2, 2)
}

fn array(matrix: &Mat<f64>) -> Matrix2 {
    [0, 1].map(|i| [0, 1].map(|j| matrix[(i, j)]))
}

fn column([a, b]: [f64; 2]) -> Mat<f64> {
    Mat::from_fn(2, 1, |i, _| [a, b][i])
}

/// Returns the inverse of a symmetric matrix; None if the determinant underflows or overflows.
fn inverse([[a, b], [_, d]]: Matrix2) -> Option<Matrix2> {
    let determinant = a * d - b * b;
    let regular = determinant.abs() > f64::MIN_POSITIVE && determinant.is_finite();
    regular.then(|| [[d, -b], [-b, a]].map(|row| row.map(|value| value / determinant)))
}

/// Returns redundancy numbers and standardized residuals of an observation from its weights P, residuals v and the cofactors of the
/// computed values.
fn tested(weight: Matrix2, computed: &Mat<f64>, v: [f64; 2]) -> Tested {
    let taken = computed * matrix(&weight);
    let redundancy = [0, 1].map(|i| 1.0 - taken[(i, i)]);
    let own = inverse(weight).unwrap_or([[f64::NAN; 2]; 2]);
    let standardized = [0, 1].map(|i| {
        let left = (own[i][i] - computed[(i, i)]).max(0.0);
        // For zero redundancy a test value would be rounding noise.
        if redundancy[i] > 1e-10 { v[i] / left.sqrt() } else { f64::NAN }
    });
    Tested { redundancy, standardized }
}

/// Elimination of a star for known parameters: inverse of its normal matrix, H = N_ss^-1 N_sp, and correction.
struct EliminatedRows {
    inverse: Matrix2,
    tied: Mat<f64>,
    correction: [f64; 2],
}

impl Calibration {
    /// Corrects the stars with the equations of the report's program at the initial values, and computes residuals and their tests.
    ///
    /// * `cofactors`: full cofactor matrix of the parameters, row by row, for the unit weight of the plate coordinates.
    ///
    /// # Errors
    /// Stars without images or with zero weights; a wrong number of cofactors.
    pub fn residual_cycle(
        &self,
        tolerances: &Tolerances,
        cofactors: &[f64],
    ) -> Result<Observations, StellarError> {
        self.check()?;
        let count = self.parameters();
        if cofactors.len() != count * count {
            return Err(StellarError::Index("the cofactors".into()));
        }
        let cofactors = MatRef::from_row_major_slice(cofactors, count, count);
        let model = StarImages::new(self, Partials::Published(*tolerances))?;
        let sight = self.initial();
        let rows: Vec<Rows> = (0..self.images.len()).map(|image| model.image(&sight, image)).collect();
        let unseen = self.unseen(&rows);
        if !unseen.is_empty() {
            return Err(StellarError::NotFinite(unseen));
        }
        let stars = self.eliminated(&model, &sight, &rows)?;
        let places = sight.places.iter().zip(&stars);
        let places = places.map(|(place, star)| [0, 1].map(|k| place[k] + star.correction[k])).collect();
        let corrected = Sight::new(self, places, &sight.parameters);
        let of_place = |star: &EliminatedRows| {
            array(&(matrix(&star.inverse) + &star.tied * cofactors * star.tied.transpose()))
        };
        let mut found = self.observations(&corrected, &model, stars.iter().map(of_place).collect())?;
        for (index, image) in self.images.iter().enumerate() {
            let (star, by_star) = (&stars[image.star], matrix(&rows[index].star));
            let all = self.by_parameters(&rows[index], image.pointing) - by_star * &star.tied;
            let own = by_star * matrix(&star.inverse) * by_star.transpose();
            let computed = &all * cofactors * all.transpose() + own;
            found.image_tests[index] = tested(image.weight, &computed, found.residuals[index]);
        }
        for (index, star) in self.stars.iter().enumerate() {
            if let (Some(weight), Some(_)) = (star.weight, model.catalogue[index]) {
                let computed = matrix(&found.place_cofactors[index]).to_owned();
                let off = model.off_catalogue(index, found.places[index]);
                found.place_tests[index] = tested(weight, &computed, off);
            }
        }
        found.place_inverses = stars.iter().map(|star| star.inverse).collect();
        Ok(found)
    }

    fn eliminated(
        &self,
        model: &StarImages<'_>,
        sight: &Sight,
        rows: &[Rows],
    ) -> Result<Vec<EliminatedRows>, StellarError> {
        let inverses = self.star_inverses(model, rows)?;
        let mut coupling = vec![Mat::<f64>::zeros(2, self.parameters()); self.stars.len()];
        let mut right = vec![Mat::<f64>::zeros(2, 1); self.stars.len()];
        for (index, star) in self.stars.iter().enumerate() {
            if let (Some(weight), Some(_)) = (star.weight, model.catalogue[index]) {
                right[index] = matrix(&weight) * column(model.off_catalogue(index, sight.places[index]));
            }
        }
        for (image, rows) in self.images.iter().zip(rows) {
            let weighted = matrix(&rows.star).transpose() * matrix(&image.weight);
            coupling[image.star] += &weighted * self.by_parameters(rows, image.pointing);
            right[image.star] += weighted * column(rows.constant);
        }
        let all = inverses.into_iter().zip(coupling).zip(right);
        Ok(all
            .map(|((inverse, coupling), right)| {
                let correction = matrix(&inverse) * right;
                EliminatedRows {
                    tied: matrix(&inverse) * coupling,
                    correction: [correction[(0, 0)], correction[(1, 0)]],
                    inverse,
                }
            })
            .collect())
    }

    /// Returns the partials of an image with respect to all parameters.
    fn by_parameters(&self, rows: &Rows, pointing: usize) -> Mat<f64> {
        let mut all = Mat::zeros(2, self.parameters());
        for i in 0..2 {
            (0..3).for_each(|k| all[(i, 3 * pointing + k)] = rows.pointing[i][k]);
            (0..COMMON).for_each(|k| all[(i, 3 * self.pointings.len() + k)] = rows.common[i][k]);
        }
        all
    }

    /// Returns the inverses of the stars' own normal matrices, the report's (1)^-1; zero for fixed stars.
    pub(super) fn star_inverses(
        &self,
        model: &StarImages<'_>,
        rows: &[Rows],
    ) -> Result<Vec<Matrix2>, StellarError> {
        let mut normals: Vec<Matrix2> =
            self.stars.iter().map(|star| star.weight.unwrap_or_default()).collect();
        for (&image, root) in model.images.iter().zip(&model.roots) {
            add_square(&mut normals[self.images[image].star], root, &rows[image].star);
        }
        let inverses: Vec<Option<Matrix2>> = (normals.into_iter().zip(&self.stars))
            .map(|(normal, star)| if star.fixed { Some([[0.0; 2]; 2]) } else { inverse(normal) })
            .collect();
        let singular: Vec<usize> = (0..inverses.len()).filter(|&star| inverses[star].is_none()).collect();
        if singular.is_empty() {
            Ok(inverses.into_iter().flatten().collect())
        } else {
            Err(StellarError::UndeterminedStars(singular))
        }
    }
}

/// Adds (R J)^T R J.
fn add_square(normal: &mut Matrix2, root: &Root, partials: &Matrix2) {
    for row in root {
        let weighted = [0, 1].map(|k| row[0] * partials[0][k] + row[1] * partials[1][k]);
        (0..4).for_each(|k| normal[k / 2][k % 2] += weighted[k / 2] * weighted[k % 2]);
    }
}
