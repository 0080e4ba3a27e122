//! Weighted angles of photos, if the attitude steps by a rotation vector.

use super::model::Bundle;
use super::observations::misalignment;
use crate::adjustment::PriorTerms;
use crate::geometry::{AttitudeNumbers, Matrix3, RotationSense, Vector3};

/// Distance of phi from 90 degrees, in standard deviations, below which angles are treated as an observed rotation.
const REACH: f64 = 3.0;
/// Cosine of phi at 5 degrees from 90, with the same treatment. There omega and kappa rotate about nearly the same axis. Their sum of
/// squares is too nonlinear for the steps.
const STEEP: f64 = 0.087;

impl Bundle {
    /// Adds the equations of weighted angles of photos that step by a rotation vector, at given parameter values.
    ///
    /// With rho = K d(angles), an angle a, observed as a0 with standard deviation s, has its row of K^-1 / s and the constant (a0 - a) / s.
    /// The sum of squares equals the one for angles as parameters.
    pub(super) fn add_weighted_angles(
        &self,
        values: &[f64],
        prior: &[f64],
        sd: &[f64],
        prior_terms: &mut PriorTerms,
    ) {
        for photo in 0..self.cameras.len() {
            let Some(sense) = self.rotation_vector_sense(photo) else { continue };
            let first = self.of_block(photo).start + 3;
            let three = |all: &[f64]| -> [f64; 3] { std::array::from_fn(|k| all[first + k]) };
            let (angles, observed, sd) = (three(values), three(prior), Vector3::from(three(sd)));
            // A fixed attitude of an excluded photo is not an observation.
            if sd.iter().all(|sd| sd.is_infinite()) || sd.iter().any(|&sd| sd == 0.0) {
                continue;
            }
            let is_steep = observed[1].cos().abs() < STEEP.max(REACH * sd.max());
            let (constant, coefficients) = if is_steep && sd.iter().all(|sd| sd.is_finite()) {
                rotation_equations(sense, angles, observed, &sd)
            } else {
                angle_equations(sense, angles, observed, &sd)
            };
            prior_terms.push(first, constant.as_slice(), coefficients.transpose().as_slice());
        }
    }
}

/// Returns the equations of the angles; rows of free angles are zero.
fn angle_equations(
    sense: RotationSense,
    angles: [f64; 3],
    observed: [f64; 3],
    sd: &Vector3,
) -> (Vector3, Matrix3) {
    let numbers = AttitudeNumbers::OmegaPhiKappa(sense);
    let (root, weighted) = (sd.map(f64::recip), sd.map(f64::is_finite));
    let difference = |k: usize| if weighted[k] { observed[k] - angles[k] } else { 0.0 };
    let constant = Vector3::from_fn(|k, _| difference(k)).component_mul(&root);
    // At a singular attitude, the angles do not restrict the step.
    (constant, Matrix3::from_diagonal(&root) * numbers.by_step(angles).unwrap_or_else(Matrix3::zeros))
}

/// Returns the equations of v = Log(A^T A0), the rotation to the observed attitude about the photo's axes, with its partials. The
/// covariance matrix is K0 S K0^T with the covariance S of the angles. If a variance is nearly zero because omega and kappa rotate about
/// the same axis, the least standard deviation replaces it.
fn rotation_equations(
    sense: RotationSense,
    angles: [f64; 3],
    observed: [f64; 3],
    sd: &Vector3,
) -> (Vector3, Matrix3) {
    let numbers = AttitudeNumbers::OmegaPhiKappa(sense);
    let (residual, by_step) = misalignment(&numbers.attitude(angles), &numbers.attitude(observed));
    let rates = numbers.rates(observed) * Matrix3::from_diagonal(sd);
    let eigen = (rates * rates.transpose()).symmetric_eigen();
    let least = if observed[1].cos().abs() < STEEP { sd.min() } else { 0.0 };
    let root = eigen.eigenvalues.map(|variance| variance.sqrt().max(least).recip());
    let root = eigen.eigenvectors * Matrix3::from_diagonal(&root) * eigen.eigenvectors.transpose();
    (root * residual, root * by_step)
}
