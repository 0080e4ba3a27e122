//! Datums of free networks: transformation of solution and cofactors to another datum without a new adjustment (S-transformation, Baarda
//! 1973, "S-transformations and criterion matrices").
//!
//! If the observations leave d degrees of freedom (position, orientation, scale), the columns of G are the *null vectors*: A G = 0 (see
//! [`Motions`]). A datum is a set of d conditions B^T (x - x_0) = 0. B has the rows of G for the unknowns that carry the datum, times their
//! squared factors, and zeros elsewhere. Changes of these carriers are minimal (inner constraints if all unknowns are carriers, Meissl
//! 1969). The network is transformed exactly, as a whole. From the cofactors Q in any datum at these values,
//!
//! S = I - G (B^T G)^-1 B^T,    Q_S = S Q S^T.
//!
//! W = Q B requires d additional right-hand sides. With T = G (B^T G)^-1, a block of Q_S is Q_ij - T_i W_j^T - W_i T_j^T + T_i (B^T W)
//! T_j^T. Redundancy numbers and residuals are the same in every datum.

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::{Accum, Mat, MatRef, Par, Side};
use thiserror::Error;

use super::loss::Loss;
use super::problem::{AnyProblem, Motions};
use super::result::AdjustError;
use super::transformation::Transformation;
use crate::Threads;

/// Datum of a free network.
#[derive(Debug, Clone, Default)]
pub struct Datum {
    /// Unknowns that carry the datum, each with a scale factor that converts its changes to a common unit of length.
    pub carriers: Vec<(usize, f64)>,
    /// Indices of motions that remain defined by the constrained unknowns, such as the scale of a network.
    pub left: Vec<usize>,
    /// Whether all other motions are transformed, even those that the observations define. Cofactors are then relative to the carriers.
    pub relative: bool,
}

impl Datum {
    /// Returns the elements of a vector over all unknowns at the carriers, times their factors.
    fn of_carriers<'a>(&'a self, vector: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
        self.carriers.iter().map(|&(carrier, factor)| factor * vector[carrier])
    }
}

/// Error of a transformation to a datum.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum DatumError {
    /// Observations and weights define a unique datum.
    #[error("the network is not free: its observations and weights give its datum")]
    NotFree,
    /// The adjustment ended with undetermined unknowns.
    #[error("the adjusted network has no cofactors")]
    NoCofactors,
    /// The carriers do not separate all motions: they are too few, collinear or coincident.
    #[error("what is to carry the datum does not determine it")]
    NotCarried,
    /// Error of the adjustment.
    #[error(transparent)]
    Adjust(#[from] AdjustError),
}

/// Minimum eigenvalue of the scaled normal matrix of the carriers, for separable null vectors.
const SEPARABLE: f64 = 1e-10;
/// Maximum number of transformations without approach of the carriers; later changes are rounding errors.
const STALLS: usize = 3;
/// Maximum number of transformations. They converge quadratically if carriers approach their references, otherwise linearly, by a few per
/// cent each.
const MOST_MOVES: usize = 1000;

/// Result of an adjustment, as input of a datum transformation.
#[derive(Debug, Clone, Copy)]
pub struct Adjusted<'a> {
    /// The adjusted unknowns.
    pub unknowns: &'a [f64],
    /// Unknowns constrained for a datum.
    pub held: &'a [usize],
    /// Robust loss of the observations.
    pub loss: Option<Loss>,
}

/// Rows of B for the carriers, and T = G (B^T G)^-1, with columns such that B without the factors is orthonormal.
#[derive(Debug, Clone)]
#[doc(hidden)]
pub struct Basis {
    pub carriers: Vec<usize>,
    pub b: Mat<f64>,
    /// One row per unknown.
    pub t: Vec<f64>,
    /// Number of columns.
    d: usize,
    /// Condition of B^T G with scaled columns.
    pub condition: f64,
}

impl Basis {
    /// Returns the right-hand sides B over all unknowns, one after the other. They are zero for constrained and fixed unknowns, whose
    /// normal equations have unit weight.
    pub fn rights(&self, problem: &AnyProblem<'_>, held: &[usize]) -> Vec<f64> {
        let (count, mut rights) = (problem.layout().unknowns(), vec![0.0; self.t.len()]);
        let free = |unknown: usize| !held.contains(&unknown) && problem.sd[unknown] != 0.0;
        let carriers = self.carriers.iter().enumerate();
        for (row, &carrier) in carriers.filter(|(_, carrier)| free(**carrier)) {
            (0..self.d).for_each(|k| rights[k * count + carrier] = self.b[(row, k)]);
        }
        rights
    }

    /// Transforms a step of any datum to this one: S dx = dx - T B^T dx.
    pub fn take(&self, step: &mut [f64]) {
        let mut along = vec![0.0; self.d];
        for (row, &carrier) in self.carriers.iter().enumerate() {
            (0..self.d).for_each(|k| along[k] += self.b[(row, k)] * step[carrier]);
        }
        for (value, t) in step.iter_mut().zip(self.t.chunks_exact(self.d.max(1))) {
            *value -= t.iter().zip(&along).map(|(t, along)| t * along).sum::<f64>();
        }
    }

    /// Returns the transformation, from the columns of W = Q B, one after the other.
    pub fn transformation(self, columns: &[f64]) -> Transformation {
        let Self { carriers, b, t, d, condition } = self;
        let count = t.len() / d.max(1);
        let row = |unknown: usize| (0..d).map(move |k| k * count + unknown);
        let w: Vec<f64> = (0..count).flat_map(row).map(|at| columns[at]).collect();
        let of_carrier = |row: usize| w[carriers[row] * d..][..d].iter().copied();
        let of_carriers = by_columns(d, carriers.len(), of_carrier);
        let common = product(b.transpose(), of_carriers.transpose());
        let mut staying = if carriers.len() == d { carriers } else { vec![] };
        staying.sort_unstable();
        Transformation { t, w, common, condition, staying }
    }
}

/// Transforms a network as a whole so that its carriers are as near to their references as possible.
///
/// Uses the Gauss-Newton method for the sum of squared distances, with exact motions.
#[doc(hidden)]
pub fn moved(
    problem: &AnyProblem<'_>,
    adjusted: Adjusted<'_>,
    datum: &Datum,
    reference: &[f64],
    threads: &Threads,
) -> Result<(Vec<f64>, Basis), DatumError> {
    let mut unknowns = adjusted.unknowns.to_vec();
    let (mut least, mut stalls) = (f64::INFINITY, 0);
    let square = |&(carrier, factor): &(usize, f64)| (factor * reference[carrier]).powi(2);
    let rounding = f64::EPSILON * datum.carriers.iter().map(square).sum::<f64>().sqrt();
    // If all motions are free at first, they remain free at all transformed values.
    let mut all_open = datum.relative;
    for _ in 0..MOST_MOVES {
        let (motions, retained) =
            motions_of(problem, &unknowns, datum, threads).ok_or(DatumError::NotFree)?;
        let count = motions.vectors.len();
        if count == 0 {
            return Err(DatumError::NotCarried);
        }
        all_open |= adjusted.held.len() == retained.1;
        // Trajectory coefficients follow rotations exactly only at first; constrained motions therefore remain free to the end.
        let were_open = if datum.left.is_empty() { adjusted.held.len() } else { 0 };
        let combinations = match all_open {
            true => None,
            false => Some(
                problem
                    .open(&unknowns, &motions, were_open, threads)
                    .ok_or(DatumError::NotFree)?
                    .combinations,
            ),
        };
        let difference = problem.model.step_between(&unknowns, reference);
        let carried = threads.install(|| Carried::new(&motions, combinations, datum, &difference));
        let carried = carried.ok_or(DatumError::NotCarried)?;
        stalls += usize::from(carried.length >= least);
        if carried.length <= rounding || stalls == STALLS {
            let basis = threads.install(|| carried.basis(&motions, datum)).ok_or(DatumError::NotCarried)?;
            return Ok((unknowns, basis));
        }
        least = least.min(carried.length);
        let mut along = vec![0.0; retained.1];
        for (&motion, amount) in retained.0.iter().zip(carried.along()) {
            along[motion] = amount;
        }
        problem.model.move_along(&mut unknowns, &along);
    }
    Err(DatumError::NotCarried)
}

/// Returns the motions of the datum, their indices and the total number of motions.
fn motions_of(
    problem: &AnyProblem<'_>,
    unknowns: &[f64],
    datum: &Datum,
    threads: &Threads,
) -> Option<(Motions, (Vec<usize>, usize))> {
    let model = &problem.model;
    let motions = || if datum.relative { model.all_motions(unknowns) } else { model.motions(unknowns) };
    let Motions { mut vectors, preferred } = threads.install(motions)?;
    let all = vectors.len();
    let retained: Vec<usize> = (0..all).filter(|number| !datum.left.contains(number)).collect();
    let vectors = retained.iter().map(|&number| std::mem::take(&mut vectors[number])).collect();
    Some((Motions { vectors, preferred }, (retained, all)))
}

/// Least-squares fit of the carriers to their references.
struct Carried {
    /// Motions (rows) in each free combination (columns): G is the matrix of the motions times this one.
    combinations: Mat<f64>,
    /// F G for the carriers, with their factors F.
    rows: Mat<f64>,
    /// Reciprocal norms of its columns.
    scale: Vec<f64>,
    /// Cholesky factor of its normal matrix, with scaled columns.
    factor: Mat<f64>,
    condition: f64,
    /// Amount of each free combination.
    amounts: Mat<f64>,
    /// Norm of the change of the carriers, in units of length.
    length: f64,
}

impl Carried {
    /// Fits carriers whose step to their references is `difference`. Without combinations all motions are free. None if the carriers do not
    /// separate all free motions.
    fn new(
        motions: &Motions,
        combinations: Option<Mat<f64>>,
        datum: &Datum,
        difference: &[f64],
    ) -> Option<Self> {
        let (count, carriers) = (motions.vectors.len(), &datum.carriers);
        let d = combinations.as_ref().map_or(count, Mat::ncols);
        if carriers.len() < d {
            return None;
        }
        let rows = by_columns(carriers.len(), count, |motion| datum.of_carriers(&motions.vectors[motion]));
        let rows = match &combinations {
            Some(own) => product(rows.as_ref(), own.as_ref()),
            None => rows,
        };
        let normal = product(rows.transpose(), rows.as_ref());
        let scale: Vec<f64> = (0..d).map(|k| normal[(k, k)].sqrt().recip()).collect();
        let scaled = Mat::from_fn(d, d, |i, k| normal[(i, k)] * scale[i] * scale[k]);
        let eigenvalues = scaled.self_adjoint_eigenvalues(Side::Lower).ok()?;
        let (least, most) = (*eigenvalues.first()?, *eigenvalues.last()?);
        if least.is_nan() || least <= SEPARABLE {
            return None;
        }
        let factor = scaled.llt(Side::Lower).ok()?.L().to_owned();
        let combinations = combinations.unwrap_or_else(|| Mat::identity(count, count));
        let distances = by_columns(carriers.len(), 1, |_| datum.of_carriers(difference));
        let right = product(rows.transpose(), distances.as_ref());
        let mut amounts = Mat::from_fn(d, 1, |k, _| scale[k] * right[(k, 0)]);
        solve_lower_triangular_in_place(factor.as_ref(), amounts.as_mut(), Par::Seq);
        let length = amounts.norm_l2();
        solve_upper_triangular_in_place(factor.transpose(), amounts.as_mut(), Par::Seq);
        (0..d).for_each(|k| amounts[(k, 0)] *= scale[k]);
        Some(Self { combinations, rows, scale, factor, condition: most / least, amounts, length })
    }

    /// Returns the amount of each motion.
    fn along(&self) -> Vec<f64> {
        let along = product(self.combinations.as_ref(), self.amounts.as_ref());
        along.col(0).iter().copied().collect()
    }

    /// Returns the basis. With F G C orthonormal, B^T G C = I for B = F F G C, and T = G C. C is the product of two inverse Cholesky
    /// factors; the second removes the rounding errors of the first.
    fn basis(self, motions: &Motions, datum: &Datum) -> Option<Basis> {
        let Self { combinations, rows, scale, factor, condition, .. } = self;
        let d = scale.len();
        let mut first = Mat::identity(d, d);
        solve_upper_triangular_in_place(factor.transpose(), first.as_mut(), Par::Seq);
        let first = Mat::from_fn(d, d, |i, k| scale[i] * first[(i, k)]);
        let nearly = product(rows.as_ref(), first.as_ref());
        let left = product(nearly.transpose(), nearly.as_ref()).llt(Side::Lower).ok()?.L().to_owned();
        let mut second = Mat::identity(d, d);
        solve_upper_triangular_in_place(left.transpose(), second.as_mut(), Par::Seq);
        let mut b = product(nearly.as_ref(), second.as_ref());
        for k in 0..d {
            let column = b.col_mut(k).iter_mut().zip(&datum.carriers);
            column.for_each(|(value, &(_, factor))| *value *= factor);
        }
        let by_motion = product(combinations.as_ref(), product(first.as_ref(), second.as_ref()).as_ref());
        let count = motions.vectors.first().map_or(0, Vec::len);
        let mut t = vec![0.0; count * d];
        for (unknown, row) in t.chunks_exact_mut(d.max(1)).enumerate() {
            for (motion, vector) in motions.vectors.iter().enumerate().filter(|(_, own)| own[unknown] != 0.0)
            {
                row.iter_mut().enumerate().for_each(|(k, t)| *t += vector[unknown] * by_motion[(motion, k)]);
            }
        }
        let carriers = datum.carriers.iter().map(|&(carrier, _)| carrier).collect();
        Some(Basis { carriers, b, t, d, condition })
    }
}

/// Creates a matrix from its columns.
fn by_columns<I: Iterator<Item = f64>>(rows: usize, columns: usize, values: impl Fn(usize) -> I) -> Mat<f64> {
    let mut found = Mat::zeros(rows, columns);
    for column in 0..columns {
        found.col_mut(column).iter_mut().zip(values(column)).for_each(|(to, value)| *to = value);
    }
    found
}

/// Multiplies on one thread, for bitwise identical results with any number of threads.
fn product(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Mat<f64> {
    let mut found = Mat::zeros(a.nrows(), b.ncols());
    matmul(found.as_mut(), Accum::Replace, a, b, 1.0, Par::Seq);
    found
}
