//! Solution of the normal equations.

use std::ops::ControlFlow;

use super::eliminated::Elimination;
use super::equations::{Equations, Prior};
use super::factor::Factor;
use super::options::SolveOptions;
use super::system::System;
use super::vectorised::LANES;
use super::watch::{Between, Control, watched};
use super::workspace::{reserved, zeros};
use crate::{Stopped, Threads, parallel};

/// Right-hand sides that go through the factor together.
const TOGETHER: usize = 16;

impl System {
    /// Solves the normal equations for all unknowns, in the order of the layout, for one right-hand side or several, the solutions one after
    /// the other: the retained blocks from the factor, the local blocks one by one. The same bits for any number of threads.
    ///
    /// `equations` and `prior` must be those that the factor comes from. The equations are written again where the factor has not cached
    /// what the elimination of the local blocks has left; those of local blocks whose right-hand sides are all zero once only.
    pub fn solve(
        &self,
        threads: &Threads,
        factor: &Factor,
        equations: &dyn Equations,
        prior: &Prior,
        options: &SolveOptions<'_>,
        between: Between<'_>,
    ) -> ControlFlow<Stopped, Vec<f64>> {
        watched(threads, between, |control| {
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
        })
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
