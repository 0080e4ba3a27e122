//! The feature from which the squares of the points' distances sum to the least, and how it follows the points.
//!
//! With F(q, x) = 1/2 sum d^2 over all deviations, q the motions of the frame: the steps are Newton's, -F_qq^-1 F_q (Gauss-Newton's where
//! F_qq is not positive definite). At the end F_q = 0 for any points, so that dq/dx = -F_qq^-1 F_qx: exactly, also where the form
//! deviates much.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::form::{ByMotions, Curvature, MOTIONS, Partials};
use super::placed::Placed;
use super::start::starts;
use super::{FeatureError, Form};
use crate::geometry::Vector3;
use crate::sorting::sort_by;

/// Steps at the most, and the step below which the feature rests; lengths are those of points with a mean square distance of 1.
const STEPS: usize = 200;
const AT_REST: f64 = 1e-13;
/// A step of which rounding may be all, and the part of a sum of squares that is rounding.
const SMALL: f64 = 1e-9;
const SUMS_ROUND: f64 = 1e-12;
/// Halvings of a step that makes the sum larger.
const HALVINGS: usize = 30;
/// Pivots of the scaled normal equations below which points do not determine a feature.
const DETERMINED: f64 = 1e-10;
/// Another feature fits as well if its sum of squares is at most this many times that of the best one, or rounding.
const RIVAL: f64 = 4.0;
const ROUNDING: f64 = 1e-20;
/// The cosine of axes, above which two features are the same one.
const SAME: f64 = 1.0 - 1e-6;

/// Sums over the points.
struct Sums {
    gradient: ByMotions,
    gauss: Curvature,
    newton: Curvature,
}

/// Fits a feature to points that are counted from their mean and scaled to a mean square of 1.
pub fn fit(form: Form, points: &[Vector3]) -> Result<Placed, FeatureError> {
    let starts = starts(form, points);
    if starts.is_empty() {
        return Err(FeatureError::Undetermined(form));
    }
    let mut found: Vec<(f64, Placed)> = vec![];
    let mut failed = FeatureError::NotAtRest(form);
    for start in starts {
        match at_rest(form, points, start) {
            Ok(placed) => found.push((placed.square_sum(form, points), placed)),
            Err(error) => failed = error,
        }
    }
    sort_by(&mut found, &|a, b| a.0.total_cmp(&b.0));
    let mut found = found.into_iter();
    let Some((least, best)) = found.next() else { return Err(failed) };
    let limit = RIVAL * least + ROUNDING * points.len() as f64;
    if found.any(|(sum, other)| sum <= limit && other.axis().dot(&best.axis()).abs() < SAME) {
        return Err(FeatureError::Ambiguous(form));
    }
    Ok(best.oriented(form))
}

/// Where the steps from a start end.
fn at_rest(form: Form, points: &[Vector3], start: Placed) -> Result<Placed, FeatureError> {
    let mut at = start;
    let mut sum = at.square_sum(form, points);
    let mut before = f64::INFINITY;
    for _ in 0..STEPS {
        let sums = sums(&at.linearize(form, points));
        let factor = factored(form, &sums.newton).or_else(|| factored(form, &sums.gauss));
        let Some(factor) = factor else { return Err(FeatureError::Undetermined(form)) };
        let mut step = all_motions(form, &-factor.solve(&of_motions(form, &sums.gradient)));
        let mut after = at.moved(&step);
        for _ in 0..HALVINGS {
            if after.square_sum(form, points) <= sum * (1.0 + SUMS_ROUND) {
                break;
            }
            step *= 0.5;
            after = at.moved(&step);
        }
        at = after;
        sum = at.square_sum(form, points);
        if !sum.is_finite() {
            return Err(FeatureError::NotAtRest(form));
        }
        let size = step.amax();
        // Steps of rounding grow no smaller.
        if size <= AT_REST || (size < SMALL && size > 0.5 * before) {
            return Ok(at);
        }
        before = size;
    }
    Err(FeatureError::NotAtRest(form))
}

/// (7, 3n) how the motions follow the points, along the axes of the points; 0 for motions that change nothing.
pub fn by_points(form: Form, placed: &Placed, points: &[Vector3]) -> Result<DMatrix<f64>, FeatureError> {
    let partials = placed.linearize(form, points);
    let sums = sums(&partials);
    let factor = factored(form, &sums.newton).ok_or(FeatureError::Undetermined(form))?;
    let mut all = DMatrix::zeros(MOTIONS, 3 * points.len());
    for (k, own) in partials.chunks(form.deviations().len()).enumerate() {
        for each in own {
            let right = each.motions * each.point.transpose() + each.value * each.mixed;
            let mut place = all.fixed_columns_mut::<3>(3 * k);
            place -= right * placed.axes.transpose();
        }
    }
    let chosen = all.select_rows(form.motions());
    let solved = factor.solve(&chosen);
    all.fill(0.0);
    for (row, &motion) in form.motions().iter().enumerate() {
        all.set_row(motion, &solved.row(row));
    }
    Ok(all)
}

fn sums(partials: &[Partials]) -> Sums {
    let mut sums =
        Sums { gradient: ByMotions::zeros(), gauss: Curvature::zeros(), newton: Curvature::zeros() };
    for each in partials {
        let square = each.motions * each.motions.transpose();
        sums.gradient += each.value * each.motions;
        sums.gauss += square;
        sums.newton += square + each.value * each.curvature;
    }
    sums
}

/// The factor of the equations of the motions that count; None where they are not positive definite, by far more than rounding.
fn factored(form: Form, matrix: &Curvature) -> Option<Cholesky<f64, Dyn>> {
    let own = matrix.select_rows(form.motions()).select_columns(form.motions());
    let factor = Cholesky::new(own.clone())?;
    let lower = factor.l_dirty();
    (0..own.nrows()).all(|k| lower[(k, k)].powi(2) > DETERMINED * own[(k, k)]).then_some(factor)
}

fn of_motions(form: Form, all: &ByMotions) -> DVector<f64> {
    DVector::from_iterator(form.motions().len(), form.motions().iter().map(|&k| all[k]))
}

fn all_motions(form: Form, own: &DVector<f64>) -> ByMotions {
    let mut all = ByMotions::zeros();
    for (&motion, &value) in form.motions().iter().zip(own.iter()) {
        all[motion] = value;
    }
    all
}
