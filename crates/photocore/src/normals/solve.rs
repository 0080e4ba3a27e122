//! Solution of the normal equations.
//!
//! Forward and back substitution with the factor L of the reduced normal equations.

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::{Accum, MatMut, MatRef, Par};
use pulp::Simd;

use super::eliminated::Elimination;
use super::equations::Equations;
use super::factor::Factor;
use super::layout::LayoutError;
use super::panels::Panels;
use super::system::{System, SystemError};
use super::vectorised::{Kernel, LANES, dot_in_lanes, run_unsized};
use super::workspace::{reserved, zeros};
use crate::context::{Context, Control, Phase};
use crate::parallel;

/// Options of the solution.
#[derive(Debug, Clone, Copy, Default)]
pub struct SolveOptions<'a> {
    /// Right-hand sides over all unknowns in the order of the layout, one after the other, e.g. for columns of the inverse or other datums.
    /// None selects the right-hand side of the equations.
    pub rights: Option<&'a [f64]>,
    /// Values of the outer unknowns of a partial system, block by block, for the right-hand side of the equations.
    pub outer: &'a [f64],
}

/// Number of right-hand sides per multiple solution.
const TOGETHER: usize = 16;

impl Factor {
    /// Solves the normal equations for all unknowns, in the order of the layout, for one or several right-hand sides; solutions follow one
    /// another. Retained blocks are computed from the factor, then each local block. Bitwise identical for any number of threads.
    ///
    /// `equations` must be those of the factor. Without a cache the equations are evaluated again; for local blocks with zero
    /// right-hand sides only once.
    ///
    /// # Errors
    /// Interruption, lack of memory, or lengths that contradict the layout.
    pub fn solve(
        &self,
        equations: &dyn Equations,
        options: &SolveOptions<'_>,
        context: &mut Context<'_>,
    ) -> Result<Vec<f64>, SystemError> {
        let System { layout, symbolic, .. } = &*self.system;
        equations.prior().check(layout)?;
        match options.rights {
            Some(rights) => layout.check_columns("SolveOptions::rights", rights.len())?,
            None => {
                let outer = symbolic.outer_unknowns();
                LayoutError::unless_of_length("SolveOptions::outer", options.outer.len(), outer)?;
            }
        }
        let solved = context.run(Phase::Solve, layout.locals(), |control| {
            let elimination = self.elimination(equations, control);
            match options.rights {
                None => {
                    let mut others = self.right.clone();
                    let first = others.len() - symbolic.outer_unknowns();
                    others[first..].iter_mut().zip(options.outer).for_each(|(x, given)| *x = *given);
                    self.solve_backward(&mut others);
                    elimination.complete::<1>(None, &others, 1)
                }
                Some(rights) if rights.len() <= layout.unknowns() => elimination.solve_for::<1>(self, rights),
                Some(rights) => elimination.solve_for::<LANES>(self, rights),
            }
        });
        Ok(solved?)
    }

    /// Returns the local eliminations.
    pub(super) fn elimination<'a>(
        &'a self,
        equations: &'a dyn Equations,
        control: &'a Control,
    ) -> Elimination<'a> {
        let Self { system, eliminated: cached, damping, .. } = self;
        Elimination { system, cached, equations, damping: *damping, control }
    }
}

impl System {
    /// Returns the rows of retained unknowns in elimination order. `Err`: size of the failed allocation in bytes.
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
    /// Solves for right-hand sides over all unknowns, C at a time; None if memory is insufficient.
    fn solve_for<const C: usize>(&self, factor: &Factor, rights: &[f64]) -> Option<Vec<f64>> {
        let (unknowns, count) = (self.system.layout.unknowns().max(1), self.system.symbolic.unknowns());
        let mut others = self.control.allocated(self.system.of_others(rights))?;
        let found = self.reduce::<C>(rights);
        // In a fixed order, independent of the threads.
        found.iter().for_each(|found| found.add_to(&mut others, count));
        parallel::each_chunk(&mut others, TOGETHER * count, &|_, columns| {
            if !self.control.stopped() {
                factor.solve_columns(columns);
            }
        });
        let own = found.into_iter().map(|found| found.own).collect();
        self.complete(Some(own), &others, rights.len() / unknowns)
    }

    /// Solves for the local blocks from the solutions of the others in elimination order, for `columns` right-hand sides. Returns all in
    /// the order of the layout. None if memory is insufficient.
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
    /// Returns the corrections of the retained unknowns of a whole system, in the order of the layout.
    pub fn reduced_corrections(&self) -> Vec<f64> {
        let (first, mut x) = (self.system.layout.all_locals().end, self.right.clone());
        self.solve_backward(&mut x);
        let mut corrections = vec![0.0; x.len()];
        self.unknowns().zip(&x).for_each(|(unknown, &x)| corrections[unknown - first] = x);
        corrections
    }

    /// Solves the reduced normal equations for right-hand sides over the retained unknowns, in the order of the layout, one after the
    /// other. Returns solutions in the same form; equations are not formed again.
    pub fn solve_reduced(&self, rights: &[f64]) -> Vec<f64> {
        let (first, order) = (self.system.layout.all_locals().end, self.unknowns().collect::<Vec<usize>>());
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

    /// Multiplies columns in elimination order by (L L^T)^-1. Only for whole systems: outer unknowns must be zero and remain so.
    pub(super) fn solve_columns(&self, columns: &mut [f64]) {
        self.forward_columns(columns);
        self.backward_columns(columns);
    }

    /// Multiplies columns by L^-1; for outer unknowns computes the reduced right-hand side.
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

    /// Multiplies columns by L^-T; outer unknowns are unchanged.
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

    /// Returns the eliminated and the coupled rows of the panel of a supernode.
    pub(super) fn panel(&self, index: usize) -> (MatRef<'_, f64>, MatRef<'_, f64>) {
        let s = &self.panels.symbolic.supernodes()[index];
        MatRef::from_column_major_slice(self.panels.panel(index), s.height(), s.width).split_at_row(s.width)
    }

    /// Computes x := L^-T x; outer unknowns are unchanged.
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
