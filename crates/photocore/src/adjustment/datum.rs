//! Datums of free networks: solution and cofactors taken from one to another without adjusting again (S-transformation, Baarda 1973,
//! "S-transformations and criterion matrices").
//!
//! Where observations leave d degrees of freedom of a network open (its position, its orientation, its scale), the columns of G, the
//! *null vectors*, say how the unknowns move along them: A G = 0 (see [`Motions`]). A datum is a choice of d conditions; here
//! B^T (x - x_0) = 0, B being G in the rows of the unknowns that carry the datum and zero elsewhere: these unknowns move least (inner
//! constraints over all of them, Meissl 1969), their rows of B being multiplied by the squares of their factors. The network is moved
//! there as a whole, exactly; with Q in any datum there,
//!
//! S = I - G (B^T G)^-1 B^T,    Q_S = S Q S^T,
//!
//! and with T = G (B^T G)^-1 and W = Q B, which takes d further right-hand sides, a block of it is
//! Q_ij - T_i W_j^T - W_i T_j^T + T_i (B^T W) T_j^T. Redundancy numbers and residuals are the same in every datum.

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::{Accum, Mat, MatRef, Par, Side};
use thiserror::Error;

use super::loss::Loss;
use super::problem::{AnyProblem, Motions};
use super::result::AdjustError;
use super::transformation::Transformation;
use crate::Threads;

/// A datum of a network whose observations leave one open.
#[derive(Debug, Clone, Default)]
pub struct Datum {
    /// The unknowns that carry it, each with the factor that makes its changes comparable with those of the others: units of length in
    /// one of its own.
    pub carriers: Vec<(usize, f64)>,
    /// Those of the model's motions that stay with the unknowns that are held: their numbers. A network keeps its scale so.
    pub left: Vec<usize>,
    /// Whether the other motions are taken, all of them, whether or not the observations leave them open: cofactors are then those of
    /// the unknowns relative to the carriers.
    pub relative: bool,
}

impl Datum {
    /// A vector over all unknowns in the rows of the carriers, times their factors.
    fn of_carriers<'a>(&'a self, vector: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
        self.carriers.iter().map(|&(carrier, factor)| factor * vector[carrier])
    }
}

/// Why an adjusted network cannot be taken to a datum.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum DatumError {
    /// Observations and weights leave nothing open: there is one datum only, that which they give.
    #[error("the network is not free: its observations and weights give its datum")]
    NotFree,
    /// The adjustment ended where unknowns are not determined.
    #[error("the adjusted network has no cofactors")]
    NoCofactors,
    /// The carriers do not tell all motions apart: too few, on one line, in one place.
    #[error("what is to carry the datum does not determine it")]
    NotCarried,
    /// What ends adjustments.
    #[error(transparent)]
    Adjust(#[from] AdjustError),
}

/// Null vectors that the carriers tell apart by less than this share are not carried.
const SEPARABLE: f64 = 1e-10;
/// The network is moved until so many moves have left the carriers no nearer than any before: rounding then.
const STALLS: usize = 3;
/// Moves converge quadratically where carriers come near to their places; where these contradict what they are to each other, by a few
/// per cent each.
const MOST_MOVES: usize = 1000;

/// Where an adjustment has ended.
#[derive(Debug, Clone, Copy)]
pub struct Adjusted<'a> {
    /// The adjusted unknowns.
    pub unknowns: &'a [f64],
    /// Those held for a datum.
    pub held: &'a [usize],
    /// What has weighted the observations.
    pub loss: Option<Loss>,
}

/// The datum that an adjustment is to end in, and the values from which its carriers move least.
#[derive(Debug, Clone, Copy)]
pub(super) struct Target<'a> {
    pub datum: &'a Datum,
    pub reference: &'a [f64],
}

/// What a network that is adjusted in parts is taken to a datum by: columns over all unknowns, one after the other.
#[derive(Debug)]
pub struct DatumColumns {
    /// B.
    pub b: Vec<f64>,
    /// T = G (B^T G)^-1.
    pub t: Vec<f64>,
    /// Of B^T G, its columns scaled.
    pub condition: f64,
    /// Whether there are no more carriers than columns: they do not move in this datum.
    pub exact: bool,
}

/// Moves a network to a datum, as it is adjusted, with what takes its cofactors there.
///
/// # Errors
/// A network that is not free, carriers that do not carry all null vectors.
pub fn moved_with_columns(
    problem: &AnyProblem<'_>,
    adjusted: Adjusted<'_>,
    datum: &Datum,
    reference: &[f64],
    threads: &Threads,
) -> Result<(Vec<f64>, DatumColumns), DatumError> {
    let (unknowns, basis) = moved(problem, adjusted, datum, reference, threads)?;
    Ok((unknowns, basis.columns()))
}

/// B in the rows of the carriers, and T = G (B^T G)^-1, in the columns for which B divided by the factors is orthonormal.
#[derive(Debug)]
pub(super) struct Basis {
    carriers: Vec<usize>,
    b: Mat<f64>,
    /// A row for each unknown, one after the other.
    t: Vec<f64>,
    /// How many columns there are.
    d: usize,
    /// Of B^T G, its columns scaled.
    condition: f64,
}

impl Basis {
    /// Both over all unknowns.
    fn columns(self) -> DatumColumns {
        let Self { carriers, b: of_carriers, t, d, condition } = self;
        let (count, mut b) = (t.len() / d.max(1), vec![0.0; t.len()]);
        for (row, &carrier) in carriers.iter().enumerate() {
            (0..d).for_each(|k| b[k * count + carrier] = of_carriers[(row, k)]);
        }
        let t = (0..d).flat_map(|k| t.iter().skip(k).step_by(d)).copied().collect();
        DatumColumns { b, t, condition, exact: carriers.len() == d }
    }

    /// The right-hand sides B, over all unknowns, one after the other. Held unknowns stand in the normal equations with unit weight: their
    /// columns of Q are zero.
    pub fn rights(&self, problem: &AnyProblem<'_>, held: &[usize]) -> Vec<f64> {
        let (count, mut rights) = (problem.layout().unknowns(), vec![0.0; self.t.len()]);
        let free = |unknown: usize| !held.contains(&unknown) && problem.sd[unknown] != 0.0;
        let carriers = self.carriers.iter().enumerate();
        for (row, &carrier) in carriers.filter(|(_, carrier)| free(**carrier)) {
            (0..self.d).for_each(|k| rights[k * count + carrier] = self.b[(row, k)]);
        }
        rights
    }

    /// Takes a step, in whatever datum it is, to this one: S dx = dx - T B^T dx.
    pub fn take(&self, step: &mut [f64]) {
        let mut along = vec![0.0; self.d];
        for (row, &carrier) in self.carriers.iter().enumerate() {
            (0..self.d).for_each(|k| along[k] += self.b[(row, k)] * step[carrier]);
        }
        for (value, t) in step.iter_mut().zip(self.t.chunks_exact(self.d.max(1))) {
            *value -= t.iter().zip(&along).map(|(t, along)| t * along).sum::<f64>();
        }
    }

    /// The transformation, with the columns of W = Q B, one after the other.
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

/// Moves a network as a whole to where its carriers are as near to their references as they come.
///
/// Gauss and Newton's method for least squares of the distances, with exact motions.
pub(super) fn moved(
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
    // What was found to leave all motions open leaves them open wherever it is moved to.
    let mut all_open = datum.relative;
    for _ in 0..MOST_MOVES {
        let (motions, retained) =
            motions_of(problem, &unknowns, datum, threads).ok_or(DatumError::NotFree)?;
        let count = motions.vectors.len();
        if count == 0 {
            return Err(DatumError::NotCarried);
        }
        all_open |= adjusted.held.len() == retained.1;
        // Coefficients of trajectories follow turns exactly at first only: what was held for is open to the end.
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
        let apart = problem.model.step_between(&unknowns, reference);
        let carried = threads.install(|| Carried::new(&motions, combinations, datum, &apart));
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

/// The motions that the datum does not leave, their numbers, and how many there are in all.
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

/// How carriers would come nearer to their references.
struct Carried {
    /// Motions (rows) in each of the open ones (columns): G is that of the motions, times these.
    combinations: Mat<f64>,
    /// F G, the rows of the carriers, F being their factors.
    rows: Mat<f64>,
    /// The reciprocal lengths of its columns.
    scale: Vec<f64>,
    /// The Cholesky factor of its normal matrix, the columns being scaled.
    factor: Mat<f64>,
    condition: f64,
    /// Of each open combination.
    amounts: Mat<f64>,
    /// By how much they would, in units of length, all taken together.
    length: f64,
}

impl Carried {
    /// The carriers are the step `apart` away from their references. Without combinations all motions are open. None where the carriers do
    /// not carry all open motions.
    fn new(motions: &Motions, combinations: Option<Mat<f64>>, datum: &Datum, apart: &[f64]) -> Option<Self> {
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
        let distances = by_columns(carriers.len(), 1, |_| datum.of_carriers(apart));
        let right = product(rows.transpose(), distances.as_ref());
        let mut amounts = Mat::from_fn(d, 1, |k, _| scale[k] * right[(k, 0)]);
        solve_lower_triangular_in_place(factor.as_ref(), amounts.as_mut(), Par::Seq);
        let length = amounts.norm_l2();
        solve_upper_triangular_in_place(factor.transpose(), amounts.as_mut(), Par::Seq);
        (0..d).for_each(|k| amounts[(k, 0)] *= scale[k]);
        Some(Self { combinations, rows, scale, factor, condition: most / least, amounts, length })
    }

    /// By how much to go along each motion.
    fn along(&self) -> Vec<f64> {
        let along = product(self.combinations.as_ref(), self.amounts.as_ref());
        along.col(0).iter().copied().collect()
    }

    /// With F G C orthonormal, B^T G C = I for B = F F G C, and T = G C. C comes from two Cholesky factors, the second of what the first
    /// has left.
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

/// A matrix of columns that are filled one by one.
fn by_columns<I: Iterator<Item = f64>>(rows: usize, columns: usize, values: impl Fn(usize) -> I) -> Mat<f64> {
    let mut found = Mat::zeros(rows, columns);
    for column in 0..columns {
        found.col_mut(column).iter_mut().zip(values(column)).for_each(|(to, value)| *to = value);
    }
    found
}

/// A product on one thread: the same bits for any number of threads.
fn product(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Mat<f64> {
    let mut found = Mat::zeros(a.nrows(), b.ncols());
    matmul(found.as_mut(), Accum::Replace, a, b, 1.0, Par::Seq);
    found
}
