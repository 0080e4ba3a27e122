//! Solution of the normal equations for any other right-hand sides.

use std::ops::ControlFlow;

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::{Accum, MatMut, MatRef, Par};
use rayon::ThreadPool;
use rayon::prelude::*;

use super::equations::{Equations, Prior};
use super::factor::Factor;
use super::further::{Known, Reduced, of_others, reduce};
use super::incidence::Stacks;
use super::layout::Layout;
use super::stack::Stack;
use super::system::System;
use super::vectorised::{LANES, Side};
use super::watch::{Between, Control, Stopped, watched};
use super::workspace::zeros;

/// Stacks that a thread takes at a time.
const CHUNK: usize = 64;
/// Right-hand sides that go through the factor together.
const TOGETHER: usize = 16;

impl System {
    /// Solves N x = r for further right-hand sides r, with the factor that there is: columns of the inverse, covariances between any two
    /// unknowns, propagated functions, other datums.
    ///
    /// * `rights`: right-hand sides over all unknowns in the order of the layout, one after the other.
    ///
    /// `equations`, `prior` and `damping` must be those that the factor comes from. Returns the solutions, one after the other; the
    /// same bits for any number of threads. Local blocks whose right-hand sides are all zero cost nothing on the way up.
    pub fn solve_for<E: Equations>(
        &self,
        pool: &ThreadPool,
        factor: &Factor,
        equations: &E,
        prior: &Prior,
        damping: f64,
        rights: &[f64],
        between: Between<'_>,
    ) -> ControlFlow<Stopped, Vec<f64>> {
        watched(pool, between, |control| {
            let work = Work { system: self, equations, prior, damping, control };
            let mut others = control.allocated(of_others(self, rights))?;
            work.reduce(rights, &mut others);
            work.complete(factor, rights, others)
        })
    }

    /// Solves N x = r for the right-hand sides that the factor was formed with (see [`System::factor_with`]): they are on their way
    /// already.
    pub fn solve_further<E: Equations>(
        &self,
        pool: &ThreadPool,
        factor: &Factor,
        equations: &E,
        prior: &Prior,
        rights: &[f64],
        between: Between<'_>,
    ) -> ControlFlow<Stopped, Vec<f64>> {
        watched(pool, between, |control| {
            let work = Work { system: self, equations, prior, damping: 0.0, control };
            work.complete(factor, rights, factor.further.clone())
        })
    }
}

struct Work<'a, E> {
    system: &'a System,
    equations: &'a E,
    prior: &'a Prior,
    damping: f64,
    control: &'a Control,
}

impl<E: Equations> Work<'_, E> {
    /// Takes what the local blocks say off the right-hand sides of the others.
    fn reduce(&self, rights: &[f64], others: &mut [f64]) {
        let layout = &self.system.layout;
        let (unknowns, count) = (layout.unknowns().max(1), self.system.symbolic.unknowns());
        let reduced = |stacks: Stacks<'_>| {
            let (mut stack, mut found) = (Stack::default(), Vec::new());
            for locals in stacks.iter().take_while(|_| !self.control.stopped()) {
                let ranges = || locals.iter().map(|&local| layout.local_range(local as usize));
                let columns = rights.chunks_exact(unknowns);
                let idle =
                    columns.clone().all(|right| ranges().all(|range| right[range].iter().all(|r| *r == 0.0)));
                if !idle {
                    self.eliminate(&mut stack, locals);
                    reduce(self.system, &stack, rights, &mut found);
                }
            }
            found
        };
        let parts = self.system.incidence.stacks().parts(CHUNK);
        // One after the other in a fixed order, whichever thread has found them.
        let found: Vec<Reduced> = parts.into_par_iter().flat_map_iter(reduced).collect();
        found.iter().for_each(|reduced| reduced.subtract_from(others, count));
    }

    /// Solves for the other unknowns, whose right-hand sides are reduced, then for the local ones; None without memory.
    fn complete(&self, factor: &Factor, rights: &[f64], mut others: Vec<f64>) -> Option<Vec<f64>> {
        let (layout, symbolic) = (&self.system.layout, &*self.system.symbolic);
        others.par_chunks_mut((TOGETHER * symbolic.unknowns()).max(1)).for_each(|columns| {
            if !self.control.stopped() {
                factor.solve_columns(columns);
            }
        });
        let mut solutions = self.control.allocated(zeros(rights.len()))?;
        let unknowns = layout.unknowns().max(1);
        for (column, others) in
            solutions.chunks_exact_mut(unknowns).zip(others.chunks_exact(symbolic.unknowns().max(1)))
        {
            for position in 0..symbolic.blocks() {
                column[symbolic.unknowns_at(layout, position)]
                    .copy_from_slice(&others[symbolic.range(position)]);
            }
        }
        let known = Known::new(self.system, rights, &others);
        drop(others);
        let solve = |stacks: Stacks<'_>| {
            let (mut stack, mut found) = (Stack::default(), Vec::new());
            for locals in stacks.iter().take_while(|_| !self.control.stopped()) {
                self.eliminate(&mut stack, locals);
                known.solve(self.system, &stack, &mut found);
                self.control.count(locals.len());
            }
            found
        };
        let stacks = self.system.incidence.stacks();
        let found: Vec<Vec<Side>> = stacks.parts(CHUNK).into_par_iter().map(solve).collect();
        known.hand_out(layout, stacks, found.iter().flatten(), |local, first, rows| {
            let columns = solutions.chunks_exact_mut(unknowns).skip(first).take(LANES);
            for (k, solution) in columns.enumerate() {
                solution[local.clone()].iter_mut().zip(rows).for_each(|(x, row)| *x = row[k]);
            }
        });
        Some(solutions)
    }

    fn eliminate(&self, stack: &mut Stack, locals: &[u32]) {
        stack.gather(self.system, self.equations, locals);
        stack.eliminate(&self.system.layout, self.prior, self.damping);
    }
}

impl Factor {
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
}
