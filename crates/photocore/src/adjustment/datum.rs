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

use std::ops::ControlFlow;

use faer::{Mat, Side};
use rayon::ThreadPool;
use thiserror::Error;

use super::factored::{Factored, Inverted};
use super::loss::Loss;
use super::motions::Open;
use super::options::Options;
use super::problem::{Model, Motions, Problem};
use super::result::{AdjustError, Adjustment};
use super::transformation::Transformation;
use crate::normals::Cofactors;

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

/// An adjusted network in another datum.
#[derive(Debug, Clone)]
pub struct InDatum {
    /// The adjusted unknowns.
    pub unknowns: Vec<f64>,
    /// Their cofactors.
    pub cofactors: Cofactors,
    /// Redundancy numbers of the unknowns as observations of themselves (zero unless weighted).
    pub prior_redundancy: Vec<f64>,
    /// About how large a part of a variance rounding may be: large numbers cancel where the old datum is far from the new one, or short.
    pub lost: f64,
}

/// Why an adjusted network cannot be taken to a datum.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum DatumError {
    /// Observations and weights leave nothing open: there is one datum only, that which they give.
    #[error("the network is not free: its observations and weights give its datum")]
    NotFree,
    /// The adjustment ended without cofactors, or without a datum.
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
/// The network is moved until so many moves have not halved what the carriers are still to go: rounding then.
const STALLS: usize = 3;
/// Moves converge quadratically, near the end.
const MOST_MOVES: usize = 100;

/// Takes an adjusted network to another datum.
///
/// * `options`: those of the adjustment;
/// * `adjustment`: with cofactors, in the datum of the unknowns it held;
/// * `reference`: the values x_0 from which the carriers move least, usually the initial ones.
///
/// # Errors
/// A network that is not free, carriers that do not carry all null vectors, an adjustment without cofactors; an interruption.
pub fn in_datum<M: Model>(
    problem: &Problem<M>,
    options: &Options,
    adjustment: &Adjustment,
    datum: &Datum,
    reference: &[f64],
    pool: &ThreadPool,
    between: &mut dyn FnMut(usize) -> ControlFlow<()>,
) -> Result<InDatum, DatumError> {
    if adjustment.cofactors.is_none() {
        return Err(DatumError::NoCofactors);
    }
    let adjusted = Adjusted { unknowns: &adjustment.unknowns, held: &adjustment.datum, loss: options.loss };
    Factored::in_datum(problem, adjusted, datum, reference, pool, between)?.into_datum(problem, pool, between)
}

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

impl Factored {
    /// Moves an adjusted network to another datum, and factors its normal equations there.
    ///
    /// # Errors
    /// A network that is not free, carriers that do not carry all null vectors; what ends adjustments.
    pub fn in_datum<M: Model>(
        problem: &Problem<M>,
        adjusted: Adjusted<'_>,
        datum: &Datum,
        reference: &[f64],
        pool: &ThreadPool,
        between: &mut dyn FnMut(usize) -> ControlFlow<()>,
    ) -> Result<Self, DatumError> {
        let Adjusted { unknowns, held, loss } = adjusted;
        let (unknowns, basis) = moved(problem, unknowns, datum, reference, pool)?;
        let mut factored = Self::form(problem, loss, unknowns, held.to_vec(), pool, between)?;
        // Held unknowns stand in the normal equations with unit weight: their columns of Q are zero.
        let (count, d) = (factored.values.len(), basis.t.ncols());
        let mut rights = vec![0.0; count * d];
        let free = |unknown: usize| !held.contains(&unknown) && problem.sd[unknown] != 0.0;
        let carriers = datum.carriers.iter().enumerate();
        for (row, &(carrier, _)) in carriers.filter(|(_, carrier)| free(carrier.0)) {
            (0..d).for_each(|k| rights[k * count + carrier] = basis.b[(row, k)]);
        }
        let columns = factored.solve_for(problem, &rights, pool, between)?;
        let w = Mat::from_fn(count, d, |i, k| columns[k * count + i]);
        let of_carriers = Mat::from_fn(datum.carriers.len(), d, |row, k| w[(datum.carriers[row].0, k)]);
        let mut staying = vec![];
        if datum.carriers.len() == d {
            staying = datum.carriers.iter().map(|&(carrier, _)| carrier).collect();
            staying.sort_unstable();
        }
        let common = basis.b.transpose() * of_carriers;
        let Basis { t, condition, .. } = basis;
        factored.transformation = Some(Transformation { t, w, common, condition, staying });
        Ok(factored)
    }

    /// The unknowns and their cofactors in its datum.
    ///
    /// # Errors
    /// An interruption, no memory.
    pub fn into_datum<M: Model>(
        self,
        problem: &Problem<M>,
        pool: &ThreadPool,
        between: &mut dyn FnMut(usize) -> ControlFlow<()>,
    ) -> Result<InDatum, DatumError> {
        let unknowns = self.values.clone();
        let Inverted { cofactors, prior_redundancy, lost } = self.inverted(problem, pool, between)?;
        Ok(InDatum { unknowns, cofactors, prior_redundancy, lost: lost.unwrap_or(0.0) })
    }
}

/// B in the rows of the carriers, and T = G (B^T G)^-1, in the columns for which B divided by the factors is orthonormal.
struct Basis {
    b: Mat<f64>,
    t: Mat<f64>,
    /// Of B^T G, its columns scaled.
    condition: f64,
}

/// The basis, and how the carriers would come nearer to their references.
struct Carried {
    basis: Basis,
    /// Of each open combination.
    amounts: Vec<f64>,
    /// By how much they would, in units of length, all taken together.
    length: f64,
}

/// Moves a network as a whole to where its carriers are as near to their references as they come.
///
/// Gauss and Newton's method for least squares of the distances, with exact motions.
fn moved<M: Model>(
    problem: &Problem<M>,
    adjusted: &[f64],
    datum: &Datum,
    reference: &[f64],
    pool: &ThreadPool,
) -> Result<(Vec<f64>, Basis), DatumError> {
    let mut unknowns = adjusted.to_vec();
    let (mut before, mut stalls) = (f64::INFINITY, 0);
    for _ in 0..MOST_MOVES {
        let (motions, kept) = motions_of(problem, &unknowns, datum, pool).ok_or(DatumError::NotFree)?;
        if motions.vectors.is_empty() {
            return Err(DatumError::NotCarried);
        }
        let open = if datum.relative {
            Open::all(&motions)
        } else {
            problem.open(&unknowns, &motions, pool).ok_or(DatumError::NotFree)?
        };
        let apart = problem.model.step_between(&unknowns, reference);
        let Carried { basis, amounts, length } =
            carried(&open.vectors(&motions), datum, &apart).ok_or(DatumError::NotCarried)?;
        stalls += usize::from(length >= 0.5 * before);
        if length == 0.0 || stalls == STALLS {
            return Ok((unknowns, basis));
        }
        before = length;
        let mut along = vec![0.0; kept.1];
        for (row, &motion) in kept.0.iter().enumerate() {
            along[motion] = (0..amounts.len()).map(|k| open.combinations[(row, k)] * amounts[k]).sum();
        }
        problem.model.move_along(&mut unknowns, &along);
    }
    Err(DatumError::NotCarried)
}

/// The motions that the datum does not leave, their numbers, and how many there are in all.
fn motions_of<M: Model>(
    problem: &Problem<M>,
    unknowns: &[f64],
    datum: &Datum,
    pool: &ThreadPool,
) -> Option<(Motions, (Vec<usize>, usize))> {
    let model = &problem.model;
    let motions = || if datum.relative { model.all_motions(unknowns) } else { model.motions(unknowns) };
    let Motions { mut vectors, preferred } = pool.install(motions)?;
    let all = vectors.len();
    let kept: Vec<usize> = (0..all).filter(|number| !datum.left.contains(number)).collect();
    let vectors = kept.iter().map(|&number| std::mem::take(&mut vectors[number])).collect();
    Some((Motions { vectors, preferred }, (kept, all)))
}

/// The basis at some values for null vectors G, and by how much these still bring the carriers nearer to their references, which are the step
/// `apart` away: with F G = Q R, F the factors, B^T G = R^T R, so that in the columns of G R^-1 it is I. None where the carriers do not carry all null vectors.
fn carried(g: &Mat<f64>, datum: &Datum, apart: &[f64]) -> Option<Carried> {
    let d = g.ncols();
    let scaled_row = |row: usize, k: usize| datum.carriers[row].1 * g[(datum.carriers[row].0, k)];
    let b = Mat::from_fn(datum.carriers.len(), d, scaled_row);
    if b.nrows() < d {
        return None;
    }
    let product = b.transpose() * &b;
    let scale: Vec<f64> = (0..d).map(|k| product[(k, k)].sqrt().recip()).collect();
    let scaled = Mat::from_fn(d, d, |i, k| product[(i, k)] * scale[i] * scale[k]);
    let eigenvalues = scaled.self_adjoint_eigenvalues(Side::Lower).ok()?;
    let (least, most) = (*eigenvalues.first()?, *eigenvalues.last()?);
    if least.is_nan() || least <= SEPARABLE {
        return None;
    }
    let decomposed = b.qr();
    let (q, r) = (decomposed.compute_thin_Q(), decomposed.thin_R().to_owned());
    // G R^-1, column by column from the left.
    let mut t = g.clone();
    for k in 0..d {
        for i in 0..t.nrows() {
            let before: f64 = (0..k).map(|m| t[(i, m)] * r[(m, k)]).sum();
            t[(i, k)] = (t[(i, k)] - before) / r[(k, k)];
        }
    }
    let apart = |row: usize| {
        let (carrier, factor) = datum.carriers[row];
        factor * apart[carrier]
    };
    let mut amounts: Vec<f64> =
        (0..d).map(|k| (0..q.nrows()).map(|row| q[(row, k)] * apart(row)).sum()).collect();
    let length = amounts.iter().map(|amount| amount * amount).sum::<f64>().sqrt();
    for k in (0..d).rev() {
        let after: f64 = (k + 1..d).map(|m| r[(k, m)] * amounts[m]).sum();
        amounts[k] = (amounts[k] - after) / r[(k, k)];
    }
    let b = Mat::from_fn(q.nrows(), d, |row, k| datum.carriers[row].1 * q[(row, k)]);
    Some(Carried { basis: Basis { b, t, condition: most / least }, amounts, length })
}
