//! Solution of the normal equations.
//!
//! Forward and back substitution with the factor L of the reduced normal equations.

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::{Accum, MatMut, MatRef, Par};
use pulp::Simd;

use super::eliminated::Elimination;
use super::equations::{Equations, Prior};
use super::error::SystemError;
use super::factor::Factor;
use super::layout::{Layout, LayoutError};
use super::options::SolveOptions;
use super::panels::Panels;
use super::system::System;
use super::vectorised::{Kernel, LANES, dot_in_lanes, run_unsized};
use super::watch::{Between, Control, watched};
use super::workspace::{reserved, zeros};
use crate::{Threads, parallel};

/// Right-hand sides that go through the factor together.
const TOGETHER: usize = 16;

impl System {
    /// Solves the normal equations for all unknowns, in the order of the layout, for one right-hand side or several, the solutions one after
    /// the other: the retained blocks from the factor, the local blocks one by one. The same bits for any number of threads.
    ///
    /// `equations` and `prior` must be those that the factor comes from. The equations are written again where the factor has not cached
    /// what the elimination of the local blocks has left; those of local blocks whose right-hand sides are all zero once only.
    ///
    /// # Errors
    /// An interruption, no memory, lengths that contradict the layout.
    pub fn solve(
        &self,
        threads: &Threads,
        factor: &Factor,
        equations: &dyn Equations,
        prior: &Prior,
        options: &SolveOptions<'_>,
        between: Between<'_>,
    ) -> Result<Vec<f64>, SystemError> {
        prior.check(&self.layout)?;
        match options.rights {
            Some(rights) => self.layout.check_columns("SolveOptions::rights", rights.len())?,
            None => {
                let outer = self.symbolic.outer_unknowns();
                LayoutError::unless_of_length("SolveOptions::outer", options.outer.len(), outer)?;
            }
        }
        let solved = watched(threads, between, |control| {
            let elimination = self.elimination(factor, equations, prior, control);
            match options.rights {
                None => {
                    let mut others = factor.right.clone();
                    let first = others.len() - self.symbolic.outer_unknowns();
                    others[first..].iter_mut().zip(options.outer).for_each(|(x, given)| *x = *given);
                    factor.solve_backward(&mut others);
                    elimination.complete::<1>(None, &others, 1)
                }
                Some(rights) if rights.len() <= self.layout.unknowns() => {
                    elimination.solve_for::<1>(factor, rights)
                }
                Some(rights) => elimination.solve_for::<LANES>(factor, rights),
            }
        });
        Ok(solved?)
    }

    /// The elimination of the local blocks that a factor comes from.
    pub(super) fn elimination<'a>(
        &'a self,
        factor: &'a Factor,
        equations: &'a dyn Equations,
        prior: &'a Prior,
        control: &'a Control,
    ) -> Elimination<'a> {
        let Factor { eliminated: cached, damping, .. } = factor;
        Elimination { system: self, cached, equations, prior, damping: *damping, control }
    }

    /// The parts of right-hand sides that belong to unknowns that are not local, in the order of elimination; the bytes that there are not.
    pub(super) fn of_others(&self, rights: &[f64]) -> Result<Vec<f64>, usize> {
        let (layout, symbolic) = (&self.layout, &*self.symbolic);
        let unknowns = layout.unknowns().max(1);
        let mut others = reserved(symbolic.unknowns() * (rights.len() / unknowns))?;
        for right in rights.chunks_exact(unknowns) {
            for position in 0..symbolic.blocks() {
                others.extend_from_slice(&right[symbolic.unknowns_at(layout, position)]);
            }
        }
        Ok(others)
    }
}

impl Elimination<'_> {
    /// Solves for right-hand sides over all unknowns, C at a time; None without memory.
    fn solve_for<const C: usize>(&self, factor: &Factor, rights: &[f64]) -> Option<Vec<f64>> {
        let (unknowns, count) = (self.system.layout.unknowns().max(1), self.system.symbolic.unknowns());
        let mut others = self.control.allocated(self.system.of_others(rights))?;
        let found = self.reduce::<C>(rights);
        // One after the other in a fixed order, whichever thread has found them.
        found.iter().for_each(|found| found.add_to(&mut others, count));
        parallel::each_chunk(&mut others, TOGETHER * count, &|_, columns| {
            if !self.control.stopped() {
                factor.solve_columns(columns);
            }
        });
        let own = found.into_iter().map(|found| found.own).collect();
        self.complete(Some(own), &others, rights.len() / unknowns)
    }

    /// Solves for the local blocks, the others being solved for in the order of elimination, and puts all in the order of the layout; None
    /// without memory. There are so many columns.
    pub fn complete<const C: usize>(
        &self,
        own: Option<Vec<Vec<[f64; C]>>>,
        others: &[f64],
        columns: usize,
    ) -> Option<Vec<f64>> {
        let (layout, symbolic) = (&self.system.layout, &*self.system.symbolic);
        let (unknowns, count) = (layout.unknowns(), symbolic.unknowns().max(1));
        let rows = |first: usize| {
            let mut rows = vec![[0.0; C]; count];
            for (k, column) in others.chunks_exact(count).skip(first).take(C).enumerate() {
                rows.iter_mut().zip(column).for_each(|(row, value)| row[k] = *value);
            }
            rows
        };
        let blocks: Vec<Vec<[f64; C]>> = (0..columns).step_by(C).map(rows).collect();
        let found = self.solve(own, &blocks);
        let mut solutions = self.control.allocated(zeros(columns * unknowns))?;
        for (solution, others) in solutions.chunks_exact_mut(unknowns.max(1)).zip(others.chunks_exact(count))
        {
            for position in 0..symbolic.blocks() {
                solution[symbolic.unknowns_at(layout, position)]
                    .copy_from_slice(&others[symbolic.range(position)]);
            }
        }
        let l = layout.local_dim();
        for ((_, batches), found) in self.parts().into_iter().zip(&found) {
            let mut rows = found.chunks_exact(l);
            for locals in batches.iter() {
                for first in (0..columns).step_by(C) {
                    for (&local, own) in locals.iter().zip(&mut rows) {
                        let start = first * unknowns + layout.local_range(local as usize).start;
                        for k in 0..C.min(columns - first) {
                            let x = &mut solutions[start + k * unknowns..][..l];
                            x.iter_mut().zip(own).for_each(|(x, row)| *x = row[k]);
                        }
                    }
                }
            }
        }
        Some(solutions)
    }
}

impl Factor {
    /// The corrections of the unknowns that are not local, in the order of the layout; of a whole system.
    pub fn reduced_corrections(&self, layout: &Layout) -> Vec<f64> {
        let (first, mut x) = (layout.all_locals().end, self.right.clone());
        self.solve_backward(&mut x);
        let mut corrections = vec![0.0; x.len()];
        self.unknowns(layout).zip(&x).for_each(|(unknown, &x)| corrections[unknown - first] = x);
        corrections
    }

    /// Solves the reduced normal equations for right-hand sides over the unknowns that are not local, in the order of the layout, one
    /// after the other; so are the solutions. No equation is formed again.
    pub fn solve_reduced(&self, layout: &Layout, rights: &[f64]) -> Vec<f64> {
        let (first, order) = (layout.all_locals().end, self.unknowns(layout).collect::<Vec<usize>>());
        let columns = rights.chunks_exact(order.len().max(1));
        let mut sorted: Vec<f64> =
            columns.flat_map(|right| order.iter().map(|&unknown| right[unknown - first])).collect();
        self.solve_columns(&mut sorted);
        let mut solutions = vec![0.0; sorted.len()];
        let pairs =
            solutions.chunks_exact_mut(order.len().max(1)).zip(sorted.chunks_exact(order.len().max(1)));
        for (solution, sorted) in pairs {
            order.iter().zip(sorted).for_each(|(&unknown, &x)| solution[unknown - first] = x);
        }
        solutions
    }

    /// Replaces columns, in the order of elimination, by (L L^T)^-1 times them. Outer unknowns must be zero: they stay so only where the
    /// others leave nothing for them, so that this is for whole systems.
    pub(super) fn solve_columns(&self, columns: &mut [f64]) {
        self.forward_columns(columns);
        self.backward_columns(columns);
    }

    /// Replaces columns by L^-1 times them, and what they have of outer unknowns by what is left of it.
    pub(super) fn forward_columns(&self, columns: &mut [f64]) {
        let symbolic = &*self.panels.symbolic;
        let count = columns.len() / symbolic.unknowns().max(1);
        let mut x = MatMut::from_column_major_slice_mut(columns, symbolic.unknowns(), count);
        let mut below = Vec::new();
        for index in 0..symbolic.closed().len() {
            let (s, first) = (&symbolic.supernodes()[index], symbolic.first_unknown(index));
            let (top, rest) = self.panel(index);
            let mut own = x.as_mut().subrows_mut(first, s.width);
            solve_lower_triangular_in_place(top, own.as_mut(), Par::Seq);
            below.resize(s.below() * count, 0.0);
            let mut product = MatMut::from_column_major_slice_mut(&mut below, s.below(), count);
            matmul(product.as_mut(), Accum::Replace, rest, own.as_ref(), 1.0, Par::Seq);
            for (&row, &offset) in s.rows.iter().zip(&s.row_offset) {
                let range = symbolic.range(row);
                let mut target = x.as_mut().subrows_mut(range.start, range.len());
                target -= product.as_ref().subrows(offset - s.width, range.len());
            }
        }
    }

    /// Replaces columns by L^-T times them; outer unknowns stay as they are.
    pub(super) fn backward_columns(&self, columns: &mut [f64]) {
        let symbolic = &*self.panels.symbolic;
        let count = columns.len() / symbolic.unknowns().max(1);
        let mut x = MatMut::from_column_major_slice_mut(columns, symbolic.unknowns(), count);
        let mut below = Vec::new();
        for index in (0..symbolic.closed().len()).rev() {
            let (s, first) = (&symbolic.supernodes()[index], symbolic.first_unknown(index));
            let (top, rest) = self.panel(index);
            below.resize(s.below() * count, 0.0);
            let mut known = MatMut::from_column_major_slice_mut(&mut below, s.below(), count);
            for (&row, &offset) in s.rows.iter().zip(&s.row_offset) {
                let range = symbolic.range(row);
                let mut target = known.as_mut().subrows_mut(offset - s.width, range.len());
                target.copy_from(x.as_ref().subrows(range.start, range.len()));
            }
            let mut own = x.as_mut().subrows_mut(first, s.width);
            matmul(own.as_mut(), Accum::Add, rest.transpose(), known.as_ref(), -1.0, Par::Seq);
            solve_upper_triangular_in_place(top.transpose(), own.as_mut(), Par::Seq);
        }
    }

    /// The own and the coupled rows of the panel of a supernode.
    pub(super) fn panel(&self, index: usize) -> (MatRef<'_, f64>, MatRef<'_, f64>) {
        let s = &self.panels.symbolic.supernodes()[index];
        MatRef::from_column_major_slice(self.panels.panel(index), s.height(), s.width).split_at_row(s.width)
    }

    /// x := L^-T x; outer unknowns stay as they are.
    pub(super) fn solve_backward(&self, x: &mut [f64]) {
        run_unsized(Backward { panels: &self.panels, x });
    }
}

struct Backward<'a> {
    panels: &'a Panels,
    x: &'a mut [f64],
}

impl Kernel for Backward<'_> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const L: usize, const D: usize>(self, _: S) {
        let Self { panels, x } = self;
        let (symbolic, mut own) = (&*panels.symbolic, Vec::new());
        for (index, s) in symbolic.closed().iter().enumerate().rev() {
            let first = symbolic.first_unknown(index);
            own.clear();
            own.extend_from_slice(&x[first..first + s.width]);
            s.rows.iter().for_each(|&row| own.extend_from_slice(&x[symbolic.range(row)]));
            if own.iter().all(|&value| value == 0.0) {
                continue;
            }
            for (j, column) in panels.panel(index).chunks_exact(s.height()).enumerate().rev() {
                own[j] = (own[j] - dot_in_lanes(&column[j + 1..], &own[j + 1..])) / column[j];
            }
            x[first..first + s.width].copy_from_slice(&own[..s.width]);
        }
    }
}
