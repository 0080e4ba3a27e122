//! Joint cofactors of the equations of one local block, from the selected inverse.

use std::collections::BTreeMap;
use std::ops::Range;

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

use super::batch::TieSums;
use super::equations::{Equations, GroupRows, Prior, TieBuffer};
use super::functions::Function;
use super::layout::LayoutError;
use super::panels::SelectedInverse;
use super::system::System;

/// Equations of one local block: A x_local + B x_others = l.
struct Own {
    local: Mat<f64>,
    others: Mat<f64>,
    /// First column in B of each other block.
    blocks: BTreeMap<usize, usize>,
}

/// Cofactors of equations a of one local block, included or excluded, with the inverse normal matrix Q.
#[derive(Debug, Clone)]
pub struct LocalCofactors {
    /// Leverages a Q a^T of all pairs of equations, square, row by row; NaN between groups of a fixed local block.
    pub equations: Vec<f64>,
    /// The same with only the unknowns of the local block free.
    pub by_local: Vec<f64>,
    /// Q a^T for the unknowns of the local block, one vector per equation.
    pub local: Vec<f64>,
    /// Q a^T for each retained block in the groups of the local block.
    pub others: Vec<(usize, Vec<f64>)>,
}

impl LocalCofactors {
    /// Number of equations.
    pub fn rows(&self) -> usize {
        self.equations.len().isqrt()
    }

    fn unknown(dim: usize, rows: usize, blocks: &BTreeMap<usize, usize>) -> Self {
        let others = blocks.keys().map(|&block| (block, vec![f64::NAN; rows])).collect();
        let square = vec![f64::NAN; rows * rows];
        Self { equations: square.clone(), by_local: square, local: vec![f64::NAN; rows * dim], others }
    }
}

impl System {
    /// Computes the cofactors of the equations of a local block: its groups and rows, then additional equations of its own unknowns. NaN if
    /// the local block is undetermined.
    ///
    /// The diagonal is also in [`super::Cofactors::equations`]; here, cofactors between x and y of an image point, or between all
    /// observations of a point, are added. Q_oo is the inverse over all coupled blocks, H = N_ll^-1 N_lo and C = B - A H. Then a Q a^T = C
    /// Q_oo C^T + A N_ll^-1 A^T. Q a^T is Q_oo C^T for the others, N_ll^-1 A^T - H Q_oo C^T for the local block.
    ///
    /// * `equations`, `prior`: equations and priors of the inverse;
    /// * `asked`: equations with requested cofactors, possibly with other weights;
    /// * `terms`: coefficients of additional equations of the local unknowns, one equation after the other.
    ///
    /// # Errors
    /// [`LayoutError::Block`] or [`LayoutError::Length`] if the inverse or the priors belong to another system.
    pub fn local_cofactors(
        &self,
        selected: &SelectedInverse,
        equations: &dyn Equations,
        prior: &Prior,
        asked: &dyn Equations,
        local: usize,
        terms: &[f64],
    ) -> Result<LocalCofactors, LayoutError> {
        prior.check(&self.layout)?;
        let groups = self.layout.groups_of(local);
        if self.layout.stands_apart(local) {
            return self.cofactors_apart(selected, asked, local, groups, terms.len());
        }
        let observed = groups.len() * self.layout.rows();
        // The same equations are formed once.
        let formed = (!std::ptr::addr_eq(equations, asked))
            .then(|| self.own_equations(equations, local, groups.clone(), &[]));
        let Own { local: a, others: b, blocks } = self.own_equations(asked, local, groups, terms);
        let (rows, dim) = (a.nrows(), a.ncols());
        let (formed_local, formed_others) = match &formed {
            Some(own) => (own.local.as_ref(), own.others.as_ref()),
            None => (a.subrows(0, observed), b.subrows(0, observed)),
        };
        let mut normal = formed_local.transpose() * formed_local;
        let of_ties = TieSums::of(equations, &self.layout, local, &mut TieBuffer::default()).normal;
        (0..dim * dim).for_each(|k| normal[(k / dim, k % dim)] += of_ties[k / dim][k % dim]);
        self.layout.local_range(local).enumerate().for_each(|(k, i)| normal[(k, k)] += prior.weight[i]);
        let Ok(factor) = normal.llt(Side::Lower) else {
            return Ok(LocalCofactors::unknown(dim, rows, &blocks));
        };
        let coupling = factor.solve(formed_local.transpose() * formed_others);
        let by_local = factor.solve(a.transpose());
        let c = &b - &a * &coupling;
        let others = selected.over(blocks.keys().copied())? * c.transpose();
        let alone = &a * &by_local;
        let found = &c * &others + &alone;
        let own = by_local - coupling * &others;
        let of_block = |(&block, &first): (&usize, &usize)| {
            let width = self.layout.retained_dim(block);
            (block, (0..rows * width).map(|k| others[(first + k % width, k / width)]).collect())
        };
        Ok(LocalCofactors {
            equations: (0..rows * rows).map(|k| found[(k / rows, k % rows)]).collect(),
            by_local: (0..rows * rows).map(|k| alone[(k / rows, k % rows)]).collect(),
            local: (0..rows * dim).map(|k| own[(k % dim, k / dim)]).collect(),
            others: blocks.iter().map(of_block).collect(),
        })
    }

    /// Computes the cofactors of a fixed local block, group by group; the cofactors of `terms` additional coefficients are zero.
    fn cofactors_apart(
        &self,
        selected: &SelectedInverse,
        asked: &dyn Equations,
        local: usize,
        groups: Range<usize>,
        terms: usize,
    ) -> Result<LocalCofactors, LayoutError> {
        let (rows, dim) = (self.layout.rows(), self.layout.local_dim());
        let (of_groups, count) = (groups.len() * rows, groups.len() * rows + terms / dim);
        let known = |k: usize| if k / count < of_groups && k % count < of_groups { f64::NAN } else { 0.0 };
        let mut equations: Vec<f64> = (0..count * count).map(known).collect();
        let mut others: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
        for (first, group) in (0..).step_by(rows).zip(groups) {
            let Own { others: b, blocks, .. } = self.own_equations(asked, local, group..group + 1, &[]);
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
        let [by_local, local] = [count * count, count * dim].map(|length| vec![0.0; length]);
        Ok(LocalCofactors { equations, by_local, local, others: others.into_iter().collect() })
    }

    /// Returns the equations of a local block as functions of the retained unknowns.
    pub fn local_functions(&self, equations: &dyn Equations, local: usize) -> Vec<Function> {
        let Own { others, blocks, .. } =
            self.own_equations(equations, local, self.layout.groups_of(local), &[]);
        let columns = blocks.keys().flat_map(|&block| self.layout.retained_range(block));
        let columns: Vec<usize> = columns.collect();
        let function = |row: usize| {
            let taken = columns.iter().enumerate().map(|(k, &unknown)| (unknown, others[(row, k)]));
            taken.filter(|&(_, value)| value != 0.0).collect()
        };
        (0..others.nrows()).map(function).collect()
    }

    /// Gathers the equations of some groups of a local block, and additional equations of its unknowns.
    fn own_equations(
        &self,
        equations: &dyn Equations,
        local: usize,
        groups: Range<usize>,
        terms: &[f64],
    ) -> Own {
        let layout = &self.layout;
        let (rows, l) = (layout.rows(), layout.local_dim());
        let touched = groups.clone().flat_map(|group| layout.blocks_of(group));
        let mut blocks: BTreeMap<usize, usize> = touched.map(|block| (block, 0)).collect();
        let mut width = 0;
        for (&block, first) in &mut blocks {
            *first = width;
            width += layout.retained_dim(block);
        }
        let count = groups.len() * rows + terms.len() / l;
        let mut own = Own { local: Mat::zeros(count, l), others: Mat::zeros(count, width), blocks };
        for (k, &value) in terms.iter().enumerate() {
            own.local[(groups.len() * rows + k / l, k % l)] = value;
        }
        let (mut constant, mut parts, mut columns) = (vec![0.0; rows], [vec![], vec![], vec![]], vec![]);
        for (index, group) in groups.enumerate() {
            let main = layout.retained_dim(layout.retained_of(group));
            let widths = [l, main, layout.shared_width(group)];
            parts.iter_mut().zip(widths).for_each(|(part, width)| part.resize(rows * width, 0.0));
            let [local_part, retained, shared] = &mut parts;
            let mut written = GroupRows { constant: &mut constant, local: local_part, retained, shared };
            equations.write(local, group, &mut written);
            columns.clear();
            columns.extend(layout.blocks_of(group).flat_map(|block| {
                let first = own.blocks[&block];
                first..first + layout.retained_dim(block)
            }));
            for row in 0..rows {
                let at = index * rows + row;
                let [local_part, retained, shared] =
                    [0, 1, 2].map(|k| &parts[k][row * widths[k]..][..widths[k]]);
                local_part.iter().enumerate().for_each(|(k, &value)| own.local[(at, k)] = value);
                let others = retained.iter().chain(shared).zip(&columns);
                others.for_each(|(&value, &column)| own.others[(at, column)] = value);
            }
        }
        own
    }
}
