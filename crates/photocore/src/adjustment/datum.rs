//! Datums of free networks: solution and cofactors taken from one to another without adjusting again (S-transformation, Baarda 1973,
//! "S-transformations and criterion matrices").
//!
//! Where observations leave d degrees of freedom of a network open (its position, its orientation, its scale), the columns of G, the
//! *null vectors*, say how the unknowns move along them: A G = 0. A datum is a choice of d conditions; here B^T dx = 0, B being G
//! in the rows of the unknowns that carry the datum and zero elsewhere: these unknowns move least (inner constraints over all of
//! them, Meissl 1969). With x and Q in any datum,
//!
//! S = I - G (B^T G)^-1 B^T,    x_S = x_0 + S (x - x_0),    Q_S = S Q S^T,
//!
//! and with F = G (B^T G)^-1 and P = Q B, which takes d further right-hand sides, a block of it is
//! Q_ij - F_i P_j^T - P_i F_j^T + F_i (B^T P) F_j^T. Redundancy numbers and residuals are the same in every datum.

use std::ops::{ControlFlow, Range};

use faer::linalg::solvers::DenseSolveCore;
use faer::{Mat, Side};
use rayon::ThreadPool;

use super::normal_equations::NormalEquations;
use super::problem::{Model, Problem};
use super::result::{AdjustError, Adjustment};
use crate::normals::{Cofactors, Layout};

/// A datum of a network whose observations leave one open.
#[derive(Debug, Clone)]
pub struct Datum {
    /// The null vectors G at the adjusted values, each of the length of the vector of unknowns.
    pub vectors: Vec<Vec<f64>>,
    /// The unknowns that carry the datum.
    pub carriers: Vec<usize>,
}

/// An adjusted network in another datum.
#[derive(Debug, Clone)]
pub struct InDatum {
    /// The adjusted unknowns.
    pub unknowns: Vec<f64>,
    /// Their cofactors.
    pub cofactors: Cofactors,
}

/// Null vectors that the carriers tell apart by less than this share are not carried.
const SEPARABLE: f64 = 1e-10;

/// Takes an adjusted network to another datum.
///
/// * `adjustment`: with cofactors, in the datum of the unknowns it held;
/// * `reference`: the values x_0 from which the carriers move least, usually the initial ones.
///
/// # Errors
/// An adjustment without cofactors, or carriers that do not carry all null vectors: [`AdjustError::Undetermined`]; an interruption.
pub fn in_datum<M: Model>(
    problem: &Problem<M>,
    adjustment: &Adjustment,
    datum: &Datum,
    reference: &[f64],
    pool: &ThreadPool,
    between: &mut dyn FnMut(usize) -> ControlFlow<()>,
) -> Result<InDatum, AdjustError> {
    let undetermined = || AdjustError::Undetermined(vec![]);
    let mut cofactors = adjustment.cofactors.clone().ok_or_else(undetermined)?;
    let held = &adjustment.datum;
    let (count, vectors) = (problem.layout().unknowns(), datum.vectors.len());
    let g = Mat::from_fn(count, vectors, |i, k| datum.vectors[k][i]);
    let mut b = Mat::<f64>::zeros(count, vectors);
    for &carrier in &datum.carriers {
        (0..vectors).for_each(|k| b[(carrier, k)] = g[(carrier, k)]);
    }
    let f = inverted(&b, &g).ok_or_else(undetermined)?;

    // Held unknowns stand in the normal equations with unit weight: their columns of Q are zero.
    let mut rights = vec![0.0; count * vectors];
    for k in 0..vectors {
        let free = |carrier: &&usize| !held.contains(carrier) && problem.sd[**carrier] != 0.0;
        datum.carriers.iter().filter(free).for_each(|&carrier| rights[k * count + carrier] = b[(carrier, k)]);
    }
    let unknowns = &adjustment.unknowns;
    let normal = NormalEquations::form(problem, unknowns, held, pool, between)?;
    let columns = normal.solve_for(&rights, between)?;
    let p = Mat::from_fn(count, vectors, |i, k| columns[k * count + i]);
    let common = b.transpose() * &p;

    let transformation = Transformation { f: &f, p: &p, common: &common };
    transformation.apply(problem.layout(), &mut cofactors);
    let moved = Mat::from_fn(count, 1, |i, _| unknowns[i] - reference[i]);
    let back = &f * (b.transpose() * moved);
    let step: Vec<f64> = (0..count).map(|i| -back[(i, 0)]).collect();
    Ok(InDatum { unknowns: problem.advanced(unknowns, &step), cofactors })
}

/// G (B^T G)^-1; None where the carriers do not carry all null vectors. B^T G is the sum over the carriers of the squares of G,
/// symmetric: its columns are brought to one scale before.
fn inverted(b: &Mat<f64>, g: &Mat<f64>) -> Option<Mat<f64>> {
    let product = b.transpose() * g;
    let scale: Vec<f64> = (0..product.nrows()).map(|k| product[(k, k)].sqrt().recip()).collect();
    let scaled = Mat::from_fn(product.nrows(), product.ncols(), |i, k| product[(i, k)] * scale[i] * scale[k]);
    let least = scaled.self_adjoint_eigenvalues(Side::Lower).ok()?.first().copied()?;
    if least.is_nan() || least <= SEPARABLE {
        return None;
    }
    let inverse = scaled.llt(Side::Lower).ok()?.inverse();
    let unscaled =
        Mat::from_fn(inverse.nrows(), inverse.ncols(), |i, k| inverse[(i, k)] * scale[i] * scale[k]);
    Some(g * unscaled)
}

struct Transformation<'a> {
    f: &'a Mat<f64>,
    p: &'a Mat<f64>,
    common: &'a Mat<f64>,
}

impl Transformation<'_> {
    fn apply(&self, layout: &Layout, cofactors: &mut Cofactors) {
        let l = layout.local_dim();
        for (local, block) in cofactors.local.chunks_exact_mut(l * l).enumerate() {
            self.block(layout.local_range(local), layout.local_range(local), block);
        }
        let border = layout.border_range();
        let (mut own, mut tied) = (&mut cofactors.kept[..], &mut cofactors.kept_border[..]);
        for kept in 0..layout.kept() {
            let range = layout.kept_range(kept);
            let (block, rest) = std::mem::take(&mut own).split_at_mut(range.len().pow(2));
            self.block(range.clone(), range.clone(), block);
            own = rest;
            if !border.is_empty() {
                let (block, rest) = std::mem::take(&mut tied).split_at_mut(range.len() * border.len());
                self.block(range, border.clone(), block);
                tied = rest;
            }
        }
        if !border.is_empty() {
            self.block(border.clone(), border, &mut cofactors.border);
        }
    }

    /// Transforms one block of Q, row by row.
    fn block(&self, rows: Range<usize>, columns: Range<usize>, block: &mut [f64]) {
        let d = self.common.nrows();
        let width = columns.len();
        for (i, row) in rows.enumerate() {
            let f_common: Vec<f64> =
                (0..d).map(|k| (0..d).map(|m| self.f[(row, m)] * self.common[(m, k)]).sum()).collect();
            for (j, column) in columns.clone().enumerate() {
                block[i * width + j] += (0..d)
                    .map(|k| {
                        (f_common[k] - self.p[(row, k)]) * self.f[(column, k)]
                            - self.f[(row, k)] * self.p[(column, k)]
                    })
                    .sum::<f64>();
            }
        }
    }
}
