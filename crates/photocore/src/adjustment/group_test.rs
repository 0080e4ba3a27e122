//! Tests of groups of observations for a gross error, from the cofactor matrix of their residuals.
//!
//! ~v are the residuals of a group divided by their standard deviations, and R their cofactor matrix. The eigenvalues of R are redundancy
//! numbers of directions. Exclusion of the group lowers the sum of squares by T = ~v^T R^- ~v, and ~d = R^- ~v is the estimated error. T
//! has a chi-square distribution with rank(R) degrees of freedom (Cook and Weisberg 1982; Teunissen 2000). The rank is deficient if an
//! error in some direction leaves all residuals unchanged, for example across the only base of a point.

use nalgebra::{DMatrix, DVector, Matrix2, Vector2};
use smallvec::SmallVec;

/// Minimum redundancy of a direction in which an error is detectable.
pub const VISIBLE: f64 = 1e-6;

/// Values of a group, on the stack: nearly all groups have two rows, and there are as many groups as image observations.
pub type SmallVector = SmallVec<[f64; 4]>;

/// Test of the hypothesis that a group of observations has a gross error.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupTest {
    /// Number of directions in which an error is detectable.
    pub rank: usize,
    /// T: decrease of the sum of squares without the group.
    pub statistic: f64,
    /// Estimated error ~d in standard deviations; zero in undetectable directions.
    pub error: SmallVector,
    /// R^-, row by row: cofactors of the estimated error.
    pub cofactors: SmallVector,
    /// Smallest redundancy of a detectable direction; NaN if there is none.
    pub least: f64,
    /// Maximum fraction h of the redundancy of a direction that unknowns other than the own point absorb. It bounds correlations: |rho| <=
    /// root of the product of both h. NaN without `known`.
    pub shared: f64,
}

impl GroupTest {
    /// Tests residuals of unit weight with their cofactor matrix, row by row.
    ///
    /// * `known`: cofactor matrix with only the unknowns of the own point free, if h is requested.
    pub fn new(residuals: &[f64], cofactors: &[f64], known: Option<&[f64]>) -> Self {
        match residuals.len() {
            2 => Self::of_two(residuals, cofactors, known),
            _ => Self::of_any(residuals, cofactors, known),
        }
    }

    /// Tests a group of two rows in closed form.
    fn of_two(residuals: &[f64], cofactors: &[f64], known: Option<&[f64]>) -> Self {
        let v = Vector2::from_column_slice(residuals);
        let r = Matrix2::from_row_slice(cofactors);
        let (values, vectors) = eigen(&r);
        let shown = |k: usize| values[k] > VISIBLE;
        let along = vectors.tr_mul(&v);
        let scaled = |k: usize| if shown(k) { along[k] / values[k] } else { 0.0 };
        let error = vectors * Vector2::new(scaled(0), scaled(1));
        let inverse = values.map(|value| if value > VISIBLE { value.recip() } else { 0.0 });
        let inverse_matrix = vectors * Matrix2::from_diagonal(&inverse) * vectors.transpose();
        let shared = known.map_or(f64::NAN, |known| {
            let root = inverse.map(f64::sqrt);
            let half = vectors * Matrix2::from_diagonal(&root);
            let ratio = half.tr_mul(&(Matrix2::from_row_slice(known) - r)) * half;
            if shown(0) { eigen(&ratio).0[0].max(0.0) } else { f64::NAN }
        });
        Self {
            rank: (0..2).filter(|&k| shown(k)).count(),
            statistic: (0..2).map(|k| along[k] * scaled(k)).sum(),
            error: error.as_slice().into(),
            cofactors: inverse_matrix.as_slice().into(),
            least: (0..2).rev().find(|&k| shown(k)).map_or(f64::NAN, |k| values[k]),
            shared,
        }
    }

    fn of_any(residuals: &[f64], cofactors: &[f64], known: Option<&[f64]>) -> Self {
        let count = residuals.len();
        let r = DMatrix::from_row_slice(count, count, cofactors);
        let eigen = r.clone().symmetric_eigen();
        let shown: Vec<usize> = (0..count).filter(|&k| eigen.eigenvalues[k] > VISIBLE).collect();
        let values = DVector::from_iterator(shown.len(), shown.iter().map(|&k| eigen.eigenvalues[k]));
        let vectors = eigen.eigenvectors.select_columns(&shown);
        let along = vectors.tr_mul(&DVector::from_column_slice(residuals));
        let error = &vectors * along.component_div(&values);
        let root = DMatrix::from_diagonal(&values.map(|value| value.sqrt().recip()));
        let half = &vectors * root;
        let shared = known.filter(|_| !shown.is_empty()).map_or(f64::NAN, |known| {
            let entries = DMatrix::from_row_slice(count, count, known) - &r;
            (half.tr_mul(&entries) * &half).symmetric_eigenvalues().max().max(0.0)
        });
        Self {
            rank: shown.len(),
            statistic: along.component_div(&values).dot(&along),
            error: error.as_slice().into(),
            cofactors: (&half * half.transpose()).as_slice().into(),
            least: values.iter().copied().reduce(f64::min).unwrap_or(f64::NAN),
            shared,
        }
    }
}

/// Returns eigenvalues, larger first, and eigenvectors of a symmetric matrix.
fn eigen(matrix: &Matrix2<f64>) -> (Vector2<f64>, Matrix2<f64>) {
    let (a, b, c) = (matrix[(0, 0)], matrix[(0, 1)], matrix[(1, 1)]);
    let half = (((a - c) / 2.0).powi(2) + b * b).sqrt();
    let larger = f64::midpoint(a, c) + half;
    let smaller = if larger > 0.0 { (a * c - b * b) / larger } else { larger - 2.0 * half };
    // The row of matrix - larger without cancellation.
    let along = if a > c { Vector2::new(larger - c, b) } else { Vector2::new(b, larger - a) };
    let along = along.try_normalize(0.0).unwrap_or(Vector2::x());
    let vectors = Matrix2::from_columns(&[along, Vector2::new(-along.y, along.x)]);
    (Vector2::new(larger, smaller), vectors)
}

/// Relative rounding error of a bound of correlations.
const BARELY: f64 = 1e-9;

/// Returns h / (1 - h) for the leverage matrix H of a group, with its norm as upper bound of the largest eigenvalue h. Infinite if h may be
/// 1.
pub fn leverage_odds(leverages: impl Iterator<Item = f64>) -> f64 {
    let norm = leverages.map(|value| value.powi(2)).sum::<f64>().sqrt();
    if norm < 1.0 { norm / (1.0 - norm) } else { f64::INFINITY }
}

/// Whether the correlation of two tests may reach a limit: rho^2 <= h h' / ((1 - h) (1 - h')), from the odds of both.
pub fn may_correlate(odds: f64, other: f64, limit: f64) -> bool {
    limit <= 0.0 || odds * other >= limit * limit * (1.0 - BARELY)
}

/// Returns R_g^-1/2 of a group with the cofactor matrix R_g, given row by row.
pub fn whitening(cofactors: &[f64]) -> DMatrix<f64> {
    let count = cofactors.len().isqrt();
    let root = |value: f64| if value > VISIBLE { value.sqrt().recip() } else { 0.0 };
    if count == 2 {
        let (values, vectors) = eigen(&Matrix2::from_row_slice(cofactors));
        let half = vectors * Matrix2::from_diagonal(&values.map(root));
        return DMatrix::from_column_slice(2, 2, half.as_slice());
    }
    let eigen = DMatrix::from_row_slice(count, count, cofactors).symmetric_eigen();
    eigen.eigenvectors * DMatrix::from_diagonal(&eigen.eigenvalues.map(root))
}

/// Returns the largest canonical correlation of two groups of residuals: the largest singular value of R_g^-1/2 R_gh R_h^-1/2. It is 0 if it
/// cannot exceed a limit, because the sum of squares of all singular values does not.
///
/// An error in one group changes the test value of the other by this fraction. Groups with a value above 0.9 are not separable.
///
/// * `first`, `second`: R_g^-1/2 and R_h^-1/2, see [`whitening`];
/// * `between`: cofactors of the first with the second, row by row.
pub fn correlation_above(first: &DMatrix<f64>, second: &DMatrix<f64>, between: &[f64], limit: f64) -> f64 {
    let between = DMatrix::from_row_slice(first.nrows(), second.nrows(), between);
    let matrix = first.tr_mul(&between) * second;
    if matrix.norm_squared() <= limit * limit {
        return 0.0;
    }
    let largest = match matrix.shape() {
        (2, 2) => eigen(&Matrix2::from_fn(|i, j| matrix.column(i).dot(&matrix.column(j)))).0[0].sqrt(),
        _ => matrix.singular_values().max(),
    };
    largest.min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// R of a group as a block of a projector, and residuals in its range.
    fn block(rows: usize) -> (Vec<f64>, Vec<f64>) {
        let a = DMatrix::from_fn(9, 3, |i, j| ((3 * i + 7 * j + i * j) as f64).sin());
        let q = a.tr_mul(&a).try_inverse().unwrap();
        let r = DMatrix::identity(9, 9) - &a * q * a.transpose();
        let v = &r * DVector::from_fn(9, |i, _| (i as f64 * 1.7).cos());
        let own = r.view((0, 0), (rows, rows)).into_owned();
        (v.rows(0, rows).iter().copied().collect(), own.transpose().as_slice().to_vec())
    }

    #[test]
    fn closed_form_and_eigenvectors_agree() {
        let (v, r) = block(2);
        let known = [1.0 - 0.01, 0.02, 0.02, 1.0 - 0.03];
        let (two, any) = (GroupTest::of_two(&v, &r, Some(&known)), GroupTest::of_any(&v, &r, Some(&known)));
        assert_eq!(two.rank, any.rank);
        let pairs = [(two.statistic, any.statistic), (two.least, any.least), (two.shared, any.shared)];
        let vectors = two.error.iter().zip(&any.error).chain(two.cofactors.iter().zip(&any.cofactors));
        for (a, b) in pairs.into_iter().chain(vectors.map(|(a, b)| (*a, *b))) {
            assert!((a - b).abs() < 1e-12 * b.abs().max(1.0), "{a} {b}");
        }
    }

    #[test]
    fn an_error_that_shows_in_one_direction_has_rank_one() {
        let (c, s) = (0.8, 0.6);
        let r = [0.3 * c * c, 0.3 * c * s, 0.3 * c * s, 0.3 * s * s];
        let found = GroupTest::new(&[2.0 * c, 2.0 * s], &r, None);
        assert_eq!(found.rank, 1);
        assert!((found.statistic - 4.0 / 0.3).abs() < 1e-12);
        assert!((found.error[0] - 2.0 * c / 0.3).abs() < 1e-12 && (found.least - 0.3).abs() < 1e-15);
        let nothing = GroupTest::new(&[0.0, 0.0], &[0.0; 4], None);
        assert_eq!((nothing.rank, nothing.statistic), (0, 0.0));
        assert!(nothing.least.is_nan());
    }

    #[test]
    fn errors_that_cannot_be_told_apart_are_correlated_by_one() {
        let rho = |first: &[f64], second: &[f64], between: &[f64]| {
            correlation_above(&whitening(first), &whitening(second), between, 0.0)
        };
        assert!((rho(&[0.3], &[0.2], &[0.06_f64.sqrt()]) - 1.0).abs() < 1e-12);
        assert!((rho(&[0.5], &[0.5], &[-0.1]) - 0.2).abs() < 1e-12);
        // Two rows in closed form: the same with a third row that is independent of all others.
        let (r, between) = ([0.5, 0.1, 0.1, 0.4], [0.2, -0.1, 0.05, 0.1]);
        let wide = |own: &[f64], last: f64| [own[0], own[1], 0.0, own[2], own[3], 0.0, 0.0, 0.0, last];
        let (r3, between3) = (wide(&r, 1.0), wide(&between, 0.0));
        assert!((rho(&r, &r, &between) - rho(&r3, &r3, &between3)).abs() < 1e-12);
    }
}
