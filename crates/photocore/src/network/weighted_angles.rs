//! Angles of photos that are weighted, while the attitude steps by a rotation vector.

use smallvec::SmallVec;

use super::model::Bundle;
use super::observations::misalignment;
use crate::adjustment::Term;
use crate::geometry::{AttitudeNumbers, Matrix3, RotationSense, Vector3};

/// Angles are the observation of a rotation where their phi may well be 90 degrees: by so many of their standard deviations, or
const REACH: f64 = 3.0;
/// within 5 degrees (cosine of phi). Omega and kappa turn about nearly the same axis there, and the sum of their squares is so far from a
/// quadratic one that steps would not follow it.
const STEEP: f64 = 0.087;

impl Bundle {
    /// The equations of weighted angles of photos that step by a rotation vector, at given values of the unknowns.
    ///
    /// With rho = K d(angles) the row of an angle a, observed as a0 with the standard deviation s, is that of K^-1, and its constant
    /// a0 - a, both divided by s: the sum of squares is that of a program whose unknowns are the angles.
    pub(super) fn weighted_angles(&self, values: &[f64], prior: &[f64], sd: &[f64]) -> Vec<Term> {
        let of_photo = |photo: usize| {
            let sense = self.turning_sense(photo)?;
            let first = self.of_block(photo).start + 3;
            let three = |all: &[f64]| -> [f64; 3] { std::array::from_fn(|k| all[first + k]) };
            let (angles, observed, sd) = (three(values), three(prior), Vector3::from(three(sd)));
            // An attitude that is held, of a photo that is tried without for one, is no observation.
            if sd.iter().all(|sd| sd.is_infinite()) || sd.iter().any(|&sd| sd == 0.0) {
                return None;
            }
            let is_steep = observed[1].cos().abs() < STEEP.max(REACH * sd.max());
            let (constant, coefficients) = if is_steep && sd.iter().all(|sd| sd.is_finite()) {
                rotation_equations(sense, angles, observed, &sd)
            } else {
                angle_equations(sense, angles, observed, &sd)
            };
            Some(Term {
                first,
                constant: SmallVec::from_buf(constant.into()),
                coefficients: SmallVec::from_slice(coefficients.transpose().as_slice()),
            })
        };
        (0..self.cameras.len()).filter_map(of_photo).collect()
    }
}

/// Of the angles themselves; those that are free have a row of zeros.
fn angle_equations(
    sense: RotationSense,
    angles: [f64; 3],
    observed: [f64; 3],
    sd: &Vector3,
) -> (Vector3, Matrix3) {
    let numbers = AttitudeNumbers::OmegaPhiKappa(sense);
    let (root, weighted) = (sd.map(f64::recip), sd.map(f64::is_finite));
    let apart = |k: usize| if weighted[k] { observed[k] - angles[k] } else { 0.0 };
    let constant = Vector3::from_fn(|k, _| apart(k)).component_mul(&root);
    // An attitude on the way may be singular: there the angles say nothing of the step.
    (constant, Matrix3::from_diagonal(&root) * numbers.by_step(angles).unwrap_or_else(Matrix3::zeros))
}

/// Of v = Log(A^T A0), the rotation that is left to the observed attitude, about the photo's axes: its partials are those of an observed
/// attitude. Its covariance matrix is K0 S K0^T, S being that of the angles. Where that leaves nearly nothing about an axis, since omega and
/// kappa turn about another, the least of the standard deviations stands.
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
