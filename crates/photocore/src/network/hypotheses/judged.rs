//! Test and internal reliability of one hypothesis, from its score and redundancy.

use nalgebra::{DMatrix, DVector};

use super::facts::Facts;
use crate::adjustment::{Tail, VISIBLE, chi_square, detectable_noncentrality, fisher};

/// Degrees of freedom from which on an estimated unit weight counts as known for the MDB.
const LARGE_FREEDOM: f64 = 50.0;

/// Parameters that a hypothesis has at most.
const MOST: usize = 7;

/// What all hypotheses of a network are judged by.
pub(super) struct Criteria {
    /// lambda0 of tests of 1, 2 ... parameters.
    noncentrality: Vec<f64>,
    /// Sum of squares and degrees of freedom if the unit weight is estimated.
    estimated: Option<(f64, f64)>,
}

impl Criteria {
    pub fn new(facts: &Facts) -> Self {
        let noncentrality = (1..=MOST).map(|count| noncentrality(count, facts)).collect();
        Self { noncentrality, estimated: facts.estimated }
    }
}

/// Test and internal reliability of a hypothesis with k parameters d.
///
/// With score u = C^T P v, S = C^T P C and redundancy R: T = u^T R^- u, d = R^- u; directions with a redundancy r below 1e-6, r an eigenvalue
/// of S^-1 R, are combinations of unknowns or of the datum, and are left out.
#[derive(Debug, Clone)]
pub struct Judged {
    /// Directions that are tested.
    pub rank: usize,
    /// T, in units of a known variance of unit weight.
    pub statistic: f64,
    /// Probability of a statistic that is at least as large without the error: chi-square, or F if the unit weight is estimated.
    pub probability: f64,
    /// d.
    pub estimate: Vec<f64>,
    /// R^-, row by row: cofactors of the estimate.
    pub cofactors: Vec<f64>,
    /// r, the smallest redundancy of a direction.
    pub redundancy: f64,
    /// The minimal detectable bias along the direction of r, its largest component positive; None if r is below 1e-6.
    pub mdb: Option<Vec<f64>>,
    /// The error whose effect is reported: the MDB or, if there is none, the plausible size along that direction. None if neither is known.
    pub error: Option<Vec<f64>>,
    /// lambda0: noncentrality of a statistic that is detected with the given level and power.
    pub noncentrality: f64,
    /// By how many standard deviations this error changes the function of the unknowns that it changes most.
    pub bias_to_noise: f64,
}

impl Judged {
    pub(super) fn new(
        score: &DVector<f64>,
        squares: &DMatrix<f64>,
        redundancy: &DMatrix<f64>,
        plausible: &[f64],
        criteria: &Criteria,
    ) -> Self {
        let count = score.len();
        // Parameters in units in which each has unit weight: S = D s D. Its factor exists unless two parameters are the same one.
        let scale = squares.diagonal().map(|value| value.sqrt().recip());
        let unit = DMatrix::from_diagonal(&scale);
        let root =
            (&unit * squares * &unit).cholesky().map_or(DMatrix::identity(count, count), |own| own.l());
        let back = root.solve_lower_triangular(&unit).unwrap_or(unit);
        let eigen = (&back * redundancy * back.transpose()).symmetric_eigen();
        let along = eigen.eigenvectors.tr_mul(&(&back * score));
        // Columns: directions of parameters.
        let directions = back.transpose() * &eigen.eigenvectors;
        let shown: Vec<usize> = (0..count).filter(|&k| eigen.eigenvalues[k] > VISIBLE).collect();
        let statistic = shown.iter().map(|&k| along[k] * along[k] / eigen.eigenvalues[k]).sum();
        let mut estimate = DVector::zeros(count);
        let mut cofactors = DMatrix::zeros(count, count);
        for &k in &shown {
            let direction = directions.column(k);
            estimate += direction * (along[k] / eigen.eigenvalues[k]);
            cofactors += direction * direction.transpose() / eigen.eigenvalues[k];
        }
        let least = eigen.eigenvalues.imin();
        let share = eigen.eigenvalues[least];
        let taken = squares - redundancy;
        let hidden: Vec<usize> = (0..count).filter(|&k| eigen.eigenvalues[k] <= VISIBLE).collect();
        let mut direction = match hidden.len() {
            0 | 1 => directions.column(least).into_owned(),
            _ => worst_hidden(&directions.select_columns(&hidden), &taken, plausible),
        };
        if direction[direction.iamax()] < 0.0 {
            direction.neg_mut();
        }
        let noncentrality = criteria.noncentrality[count.clamp(1, MOST) - 1];
        let mdb = (share > VISIBLE).then(|| &direction * (noncentrality / share).sqrt());
        let error = mdb.clone().or_else(|| {
            let size = |own: &[f64]| (0..count).map(|k| (direction[k] / own[k]).powi(2)).sum::<f64>().sqrt();
            (plausible.len() == count).then(|| &direction / size(plausible))
        });
        let ratio = |error: &DVector<f64>| (error.transpose() * &taken * error)[0].max(0.0).sqrt();
        let listed = |own: DVector<f64>| own.as_slice().to_vec();
        Self {
            rank: shown.len(),
            statistic,
            probability: probability(statistic, shown.len(), criteria.estimated),
            estimate: listed(estimate),
            cofactors: cofactors.transpose().as_slice().to_vec(),
            redundancy: share.max(0.0),
            noncentrality,
            bias_to_noise: error.as_ref().map_or(f64::INFINITY, ratio),
            mdb: mdb.map(listed),
            error: error.map(listed),
        }
    }
}

impl Judged {
    /// The same with other units: what leads from errors to errors in these.
    pub(super) fn in_units(mut self, units: &DMatrix<f64>) -> Self {
        let count = self.estimate.len();
        let to = |own: &Vec<f64>| (units * DVector::from_column_slice(own)).as_slice().to_vec();
        let (estimate, mdb, error) =
            (to(&self.estimate), self.mdb.as_ref().map(to), self.error.as_ref().map(to));
        (self.estimate, self.mdb, self.error) = (estimate, mdb, error);
        let cofactors = units * DMatrix::from_row_slice(count, count, &self.cofactors) * units.transpose();
        self.cofactors = cofactors.transpose().as_slice().to_vec();
        self
    }
}

/// Difference of two effects that rounding may cause.
const ROUNDING: f64 = 1e-6;

/// The worst of several undetected directions, which have no order of their own: the error of a single parameter, as far as it is undetected,
/// that changes functions of the unknowns most in relation to plausible sizes. The last of equal ones: heights, if there are any.
fn worst_hidden(span: &DMatrix<f64>, taken: &DMatrix<f64>, plausible: &[f64]) -> DVector<f64> {
    let count = span.nrows();
    let weights =
        DVector::from_fn(count, |k, _| if plausible.len() == count { plausible[k].powi(-2) } else { 1.0 });
    let weighted = DMatrix::from_diagonal(&weights) * span;
    let inverse = span.tr_mul(&weighted).pseudo_inverse(f64::EPSILON).unwrap_or_default();
    let effect = |direction: &DVector<f64>| {
        (direction.transpose() * taken * direction)[0] / direction.map(|own| own * own).dot(&weights)
    };
    let mut worst = (f64::NEG_INFINITY, DVector::zeros(count));
    for axis in 0..count {
        let direction = span * (&inverse * weighted.row(axis).transpose());
        let own = effect(&direction);
        // A parameter that is detected has only rounding errors in the span.
        if direction[axis] > ROUNDING && own >= worst.0 * (1.0 - ROUNDING) {
            worst = (own.max(worst.0), direction);
        }
    }
    worst.1
}

/// lambda0 of a test of k degrees of freedom.
fn noncentrality(count: usize, facts: &Facts) -> f64 {
    let (level, power) = facts.detection;
    let count = count as f64;
    let rest = facts.estimated.map_or(f64::INFINITY, |(_, freedom)| freedom - count);
    let second = if rest + count < LARGE_FREEDOM { rest } else { f64::INFINITY };
    detectable_noncentrality(level, power, count, second)
}

fn probability(statistic: f64, rank: usize, estimated: Option<(f64, f64)>) -> f64 {
    if rank == 0 {
        return f64::NAN;
    }
    let rank = rank as f64;
    match estimated {
        None => chi_square(statistic, rank, Tail::Upper),
        Some((sum, freedom)) => {
            let rest = freedom - rank;
            fisher((statistic / rank) / ((sum - statistic) / rest), rank, rest)
        }
    }
}
