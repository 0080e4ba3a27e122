//! Joint cofactors of the equations of one local block, from the selected inverse.

use std::collections::BTreeMap;
use std::ops::Range;

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use nalgebra::DMatrix;

use super::functions::Function;
use super::layout::{Layout, LayoutError};
use super::panels::SelectedInverse;
use super::system::System;

/// Equations of one local block: A x_local + B x_others = l.
struct Own {
    local: Mat<f64>,
    others: Mat<f64>,
}

/// First column in B of each retained block.
type Blocks = BTreeMap<usize, usize>;

impl Own {
    /// Returns the retained blocks of some rows.
    fn blocks(layout: &Layout, rows: &[Function]) -> Blocks {
        let (first, mut last, mut blocks) = (layout.all_locals().end, 0..0, Blocks::new());
        for &(unknown, _) in rows.iter().flatten().filter(|own| own.0 >= first) {
            if !last.contains(&unknown) {
                let block = layout.retained_with(unknown);
                last = layout.retained_range(block);
                blocks.insert(block, 0);
            }
        }
        let mut width = 0;
        for (&block, first) in &mut blocks {
            *first = width;
            width += layout.retained_dim(block);
        }
        blocks
    }

    fn new(layout: &Layout, rows: &[Function], local: usize, blocks: &Blocks) -> Self {
        let range = layout.local_range(local);
        let width = blocks.keys().map(|&block| layout.retained_dim(block)).sum();
        let mut own =
            Self { local: Mat::zeros(rows.len(), range.len()), others: Mat::zeros(rows.len(), width) };
        let (mut last, mut first) = (0..0, 0);
        for (i, row) in rows.iter().enumerate() {
            for &(unknown, value) in row {
                if range.contains(&unknown) {
                    own.local[(i, unknown - range.start)] = value;
                    continue;
                }
                if !last.contains(&unknown) {
                    let block = layout.retained_with(unknown);
                    (last, first) = (layout.retained_range(block), blocks[&block]);
                }
                own.others[(i, first + unknown - last.start)] = value;
            }
        }
        own
    }
}

/// Cofactors of some equations a, included or excluded, with the inverse normal matrix Q.
#[derive(Debug, Clone, Default)]
pub struct RowCofactors {
    /// Leverages a Q a^T of all pairs of equations, square, row by row; NaN between groups of a fixed local block.
    pub equations: Vec<f64>,
    /// The same with only the unknowns of the local block free; empty for equations without a local block.
    pub by_local: Vec<f64>,
    /// Q a^T for each block of the equations, one vector over its unknowns per equation; None for the local block.
    pub blocks: Vec<(Option<usize>, Vec<f64>)>,
}

impl RowCofactors {
    /// Number of equations.
    pub fn rows(&self) -> usize {
        self.equations.len().isqrt()
    }

    /// Selects some equations.
    #[must_use]
    pub fn selected(&self, rows: Range<usize>) -> Self {
        let count = self.rows();
        let some = |values: &[f64]| {
            let width = values.len() / count;
            values[rows.start * width..rows.end * width].to_vec()
        };
        let square =
            |all: &[f64]| rows.clone().flat_map(|i| all[i * count..][rows.clone()].to_vec()).collect();
        Self {
            equations: square(&self.equations),
            by_local: square(&self.by_local),
            blocks: self.blocks.iter().map(|(block, values)| (*block, some(values))).collect(),
        }
    }

    /// Returns the residual cofactor matrix P that all equations of an excluded local block would have if they were included. The
    /// cofactors must be those of included equations. Empty if the local block would be undetermined.
    ///
    /// With predicted cofactors C = I + b Q b^T and the coefficients a of the local block, P = C^-1 - C^-1 a^T (a C^-1 a^T)^-1 a C^-1. P l
    /// are residuals of unit weight and P their cofactors, as R for included observations. It is computed as (I + a' Q a'^T - H)^-1 - H. H
    /// is the leverage matrix of the local block alone, Q the cofactor matrix of the others.
    pub fn residuals_if_included(&self) -> Vec<f64> {
        let rows = self.rows();
        let [alone, all] =
            [&self.by_local, &self.equations].map(|values| DMatrix::from_row_slice(rows, rows, values));
        let factor = (DMatrix::identity(rows, rows) + all - &alone).cholesky();
        factor.map_or(vec![], |factor| (factor.inverse() - alone).as_slice().to_vec())
    }

    fn unknown(dim: usize, rows: usize, blocks: &Blocks) -> Self {
        let others = blocks.keys().map(|&block| (Some(block), vec![f64::NAN; rows]));
        let blocks = std::iter::once((None, vec![f64::NAN; rows * dim])).chain(others).collect();
        let square = vec![f64::NAN; rows * rows];
        Self { equations: square.clone(), by_local: square, blocks }
    }
}

impl System {
    /// Computes the cofactors of equations of a local block: rows of its groups, then of its unknowns alone. NaN if the local block is
    /// undetermined.
    ///
    /// The diagonal is also in [`super::Cofactors::equations`]; here, cofactors between x and y of an image point, or between all
    /// observations of a point, are added. Q_oo is the inverse over all coupled blocks, H = N_ll^-1 N_lo and C = B - A H. Then a Q a^T = C
    /// Q_oo C^T + A N_ll^-1 A^T. Q a^T is Q_oo C^T for the others, N_ll^-1 A^T - H Q_oo C^T for the local block.
    ///
    /// * `formed`, `weight`: all equations of the local block in the inverse, with those of its terms, and the prior weights of all unknowns;
    /// * `asked`: equations with requested cofactors, possibly with other weights.
    ///
    /// # Errors
    /// [`LayoutError::Block`] or [`LayoutError::Length`] if the inverse or the weights belong to another system.
    pub fn local_cofactors(
        &self,
        selected: &SelectedInverse,
        (formed, weight): (&[Function], &[f64]),
        asked: &[Function],
        local: usize,
    ) -> Result<RowCofactors, LayoutError> {
        LayoutError::unless_of_length("weight", weight.len(), self.layout.unknowns())?;
        if self.layout.has_uncoupled_groups(local) {
            return self.cofactors_apart(selected, asked, local);
        }
        let blocks = Own::blocks(&self.layout, asked);
        let formed = Own::new(&self.layout, formed, local, &blocks);
        let Own { local: a, others: b } = Own::new(&self.layout, asked, local, &blocks);
        let (rows, dim) = (a.nrows(), a.ncols());
        let mut normal = formed.local.transpose() * &formed.local;
        self.layout.local_range(local).enumerate().for_each(|(k, i)| normal[(k, k)] += weight[i]);
        let Ok(factor) = normal.llt(Side::Lower) else {
            return Ok(RowCofactors::unknown(dim, rows, &blocks));
        };
        let coupling = factor.solve(formed.local.transpose() * &formed.others);
        let by_local = factor.solve(a.transpose());
        let c = &b - &a * &coupling;
        let others = selected.over(blocks.keys().copied())? * c.transpose();
        let alone = &a * &by_local;
        let found = &c * &others + &alone;
        let own = by_local - coupling * &others;
        let of_block = |(&block, &first): (&usize, &usize)| {
            let width = self.layout.retained_dim(block);
            (Some(block), (0..rows * width).map(|k| others[(first + k % width, k / width)]).collect())
        };
        let of_local = (None, (0..rows * dim).map(|k| own[(k % dim, k / dim)]).collect());
        Ok(RowCofactors {
            equations: (0..rows * rows).map(|k| found[(k / rows, k % rows)]).collect(),
            by_local: (0..rows * rows).map(|k| alone[(k / rows, k % rows)]).collect(),
            blocks: std::iter::once(of_local).chain(blocks.iter().map(of_block)).collect(),
        })
    }

    /// Computes the cofactors of a fixed local block, group by group; those of other equations are zero.
    fn cofactors_apart(
        &self,
        selected: &SelectedInverse,
        asked: &[Function],
        local: usize,
    ) -> Result<RowCofactors, LayoutError> {
        let (rows, dim, count) = (self.layout.rows(), self.layout.local_dim(), asked.len());
        let of_groups = rows * self.layout.groups_of(local).len();
        let known = |k: usize| if k / count < of_groups && k % count < of_groups { f64::NAN } else { 0.0 };
        let mut equations: Vec<f64> = (0..count * count).map(known).collect();
        let mut others: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
        for (first, group) in (0..).step_by(rows).zip(asked[..of_groups].chunks_exact(rows)) {
            let blocks = Own::blocks(&self.layout, group);
            let Own { others: b, .. } = Own::new(&self.layout, group, local, &blocks);
            let along = selected.over(blocks.keys().copied())? * b.transpose();
            let found = &b * &along;
            for (i, j) in (0..rows * rows).map(|k| (k / rows, k % rows)) {
                equations[(first + i) * count + first + j] = found[(i, j)];
            }
            for (&block, &start) in &blocks {
                let width = self.layout.retained_dim(block);
                let of_block = others.entry(block).or_insert_with(|| vec![f64::NAN; count * width]);
                let own = &mut of_block[first * width..][..rows * width];
                own.iter_mut().enumerate().for_each(|(k, to)| *to = along[(start + k % width, k / width)]);
            }
        }
        let of_local = (None, vec![0.0; count * dim]);
        let others = others.into_iter().map(|(block, values)| (Some(block), values));
        let blocks = std::iter::once(of_local).chain(others).collect();
        Ok(RowCofactors { equations, by_local: vec![0.0; count * count], blocks })
    }
}
