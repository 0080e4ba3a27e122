//! Solution of the normal equations for any other right-hand sides.

use std::ops::ControlFlow;

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::{Accum, MatMut, MatRef, Par};
use pulp::Simd;
use rayon::ThreadPool;
use rayon::prelude::*;

use super::equations::{Equations, Prior};
use super::factor::Factor;
use super::incidence::Stacks;
use super::layout::Layout;
use super::stack::{Stack, dot};
use super::system::System;
use super::vectorised::{Kernel, run};
use super::watch::{Between, Control, Stopped, watched};
use super::workspace::reserved;

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
        let (layout, symbolic) = (&self.layout, &*self.symbolic);
        watched(pool, between, |control| {
            let work = Work { system: self, equations, prior, damping, control };
            let count = rights.len() / layout.unknowns().max(1);
            let mut solutions = control.allocated(reserved(rights.len()))?;
            solutions.extend_from_slice(rights);
            let mut others = control.allocated(reserved(symbolic.unknowns() * count))?;
            for right in rights.chunks_exact(layout.unknowns().max(1)) {
                for position in 0..symbolic.blocks() {
                    others.extend_from_slice(&right[symbolic.unknowns_at(layout, position)]);
                }
            }
            work.reduce(rights, &mut others);
            others.par_chunks_mut((TOGETHER * symbolic.unknowns()).max(1)).for_each(|columns| {
                if !control.stopped() {
                    factor.solve_columns(columns);
                }
            });
            work.solve_locals(&others, &mut solutions);
            let columns = solutions.chunks_exact_mut(layout.unknowns().max(1));
            for (column, others) in columns.zip(others.chunks_exact(symbolic.unknowns().max(1))) {
                for position in 0..symbolic.blocks() {
                    column[symbolic.unknowns_at(layout, position)]
                        .copy_from_slice(&others[symbolic.range(position)]);
                }
            }
            Some(solutions)
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
    /// Takes N_ol N_ll^-1 r_l off the right-hand sides of the others: with N_ll = L L^T and V = L^-1 N_lo, that is V^T L^-1 r_l.
    fn reduce(&self, rights: &[f64], others: &mut [f64]) {
        let layout = &self.system.layout;
        let (unknowns, count) = (layout.unknowns().max(1), self.system.symbolic.unknowns());
        let reduce = |stacks: Stacks<'_>| {
            let (mut stack, mut found) = (Stack::default(), Vec::new());
            for locals in stacks.iter().take_while(|_| !self.control.stopped()) {
                let ranges = || locals.iter().map(|&local| layout.local_range(local as usize));
                let columns = rights.chunks_exact(unknowns);
                let idle =
                    columns.clone().all(|right| ranges().all(|range| right[range].iter().all(|r| *r == 0.0)));
                if !idle {
                    self.eliminate(&mut stack, locals);
                    run(
                        layout,
                        stack.kept_dim(),
                        Reduce { work: self, stack: &stack, rights, found: &mut found },
                    );
                }
            }
            found
        };
        let parts = self.system.incidence.stacks().parts(CHUNK);
        // One after the other in a fixed order, whichever thread has found them.
        for (column, first, values) in parts.into_par_iter().flat_map_iter(reduce).collect::<Vec<_>>() {
            let target = &mut others[column * count + first..][..values.len()];
            target.iter_mut().zip(values).for_each(|(right, value)| *right -= value);
        }
    }

    /// Solves the local blocks, the others being known: x_l = L^-T (L^-1 r_l - V x_o).
    fn solve_locals(&self, others: &[f64], solutions: &mut [f64]) {
        let layout = &self.system.layout;
        let rights = &*solutions;
        let solve = |stacks: Stacks<'_>| {
            let (mut stack, mut found) = (Stack::default(), Vec::new());
            for locals in stacks.iter().take_while(|_| !self.control.stopped()) {
                self.eliminate(&mut stack, locals);
                run(
                    layout,
                    stack.kept_dim(),
                    Solve { work: self, stack: &stack, rights, others, found: &mut found },
                );
                self.control.count(locals.len());
            }
            found
        };
        let parts = self.system.incidence.stacks().parts(CHUNK);
        let found: Vec<(usize, Vec<f64>)> = parts.into_par_iter().flat_map_iter(solve).collect();
        for (first, values) in found {
            solutions[first..][..values.len()].copy_from_slice(&values);
        }
    }

    fn eliminate(&self, stack: &mut Stack, locals: &[u32]) {
        stack.gather(self.system, self.equations, locals);
        stack.eliminate(&self.system.layout, self.prior, self.damping);
    }
}

/// Computes V^T L^-1 r of a stack for every right-hand side: column, first of the coupled unknowns, values.
struct Reduce<'a, E> {
    work: &'a Work<'a, E>,
    stack: &'a Stack,
    rights: &'a [f64],
    found: &'a mut Vec<(usize, usize, Vec<f64>)>,
}

impl<E: Equations> Kernel for Reduce<'_, E> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const L: usize, const D: usize>(self, _: S) {
        let layout = &self.work.system.layout;
        for (column, right) in self.rights.chunks_exact(layout.unknowns()).enumerate() {
            let mut reduced = Vec::with_capacity(self.stack.locals.len() * L);
            for (t, &local) in self.stack.locals.iter().enumerate() {
                let mut own = [0.0; L];
                own.copy_from_slice(&right[layout.local_range(local as usize)]);
                self.stack.triangles[t].forward::<L>(&mut own, 1);
                reduced.extend_from_slice(&own);
            }
            if reduced.iter().all(|&value| value == 0.0) {
                continue;
            }
            for (range, v) in self.stack.couplings::<L, D>(&self.work.system.symbolic) {
                let mut sums = vec![0.0; range.len()];
                for (row, factor) in v.values.chunks_exact(range.len().max(1)).zip(&reduced) {
                    sums.iter_mut().zip(row).for_each(|(sum, value)| *sum += factor * value);
                }
                self.found.push((column, range.start, sums));
            }
        }
    }
}

/// Solves the local blocks of a stack for every right-hand side: where a block stands in the solutions, and its values.
struct Solve<'a, E> {
    work: &'a Work<'a, E>,
    stack: &'a Stack,
    rights: &'a [f64],
    others: &'a [f64],
    found: &'a mut Vec<(usize, Vec<f64>)>,
}

impl<E: Equations> Kernel for Solve<'_, E> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const L: usize, const D: usize>(self, _: S) {
        let layout = &self.work.system.layout;
        let columns = self.rights.chunks_exact(layout.unknowns());
        let count = self.work.system.symbolic.unknowns();
        for (index, right) in columns.enumerate() {
            let others = &self.others[index * count..][..count];
            for (t, &local) in self.stack.locals.iter().enumerate() {
                let range = layout.local_range(local as usize);
                let mut own = [0.0; L];
                own.copy_from_slice(&right[range.clone()]);
                self.stack.triangles[t].forward::<L>(&mut own, 1);
                for (coupled, v) in self.stack.couplings::<L, D>(&self.work.system.symbolic) {
                    let x = &others[coupled];
                    let rows = v.values[t * L * x.len()..].chunks_exact(x.len().max(1));
                    own.iter_mut().zip(rows).for_each(|(value, row)| *value -= dot(row, x));
                }
                self.stack.triangles[t].backward::<L>(&mut own, 1);
                self.found.push((index * layout.unknowns() + range.start, own.to_vec()));
            }
        }
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

    /// Replaces columns, in the order of elimination, by (L L^T)^-1 times them.
    pub(super) fn solve_columns(&self, columns: &mut [f64]) {
        let symbolic = &*self.panels.symbolic;
        let count = columns.len() / symbolic.unknowns().max(1);
        let mut x = MatMut::from_column_major_slice_mut(columns, symbolic.unknowns(), count);
        let mut below = Vec::new();
        for index in 0..symbolic.supernode_count() {
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
        for index in (0..symbolic.supernode_count()).rev() {
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
