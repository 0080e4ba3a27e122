//! Solution of the normal equations.

use std::ops::ControlFlow;

use rayon::ThreadPool;
use rayon::prelude::*;

use super::eliminated::{self, Coupled, OfHome};
use super::equations::{Equations, Prior};
use super::factor::Factor;
use super::further::of_others;
use super::incidence::Stacks;
use super::stack::Stack;
use super::system::System;
use super::vectorised::dot;
use super::watch::{Between, Control, Stopped, watched};
use super::workspace::{Eliminated, zeros};

/// Stacks that a thread takes at a time.
const CHUNK: usize = 64;

impl System {
    /// Solves the normal equations for all unknowns, in the order of the layout: the kept blocks and the border from the factor, the
    /// local blocks one by one.
    ///
    /// `equations`, `prior` and `damping` must be those that the factor comes from. The equations are written again where the factor has
    /// not kept what the elimination of the local blocks has left.
    pub fn solve<E: Equations>(
        &self,
        pool: &ThreadPool,
        factor: &Factor,
        equations: &E,
        prior: &Prior,
        damping: f64,
        between: Between<'_>,
    ) -> ControlFlow<Stopped, Vec<f64>> {
        self.solve_below(pool, factor, equations, prior, damping, &[], between)
    }

    /// The same of a part of a larger system, with the outer unknowns, block by block, as they are given.
    pub fn solve_below<E: Equations>(
        &self,
        pool: &ThreadPool,
        factor: &Factor,
        equations: &E,
        prior: &Prior,
        damping: f64,
        outer: &[f64],
        between: Between<'_>,
    ) -> ControlFlow<Stopped, Vec<f64>> {
        let symbolic = &*self.symbolic;
        watched(pool, between, |control| {
            let mut others = factor.right.clone();
            let first = others.len() - symbolic.outer_unknowns();
            others[first..].iter_mut().zip(outer).for_each(|(x, given)| *x = *given);
            factor.solve_backward(&mut others);
            let found = match factor.eliminated.is_empty() {
                false => self.kept_locals(&factor.eliminated, None, &others, control),
                true => self.written_locals(equations, prior, damping, &others, control),
            };
            self.in_order_of_layout(&found, &others, control)
        })
    }

    /// Solves the normal equations for another right-hand side over all unknowns, with what the factor has kept of the local blocks; as
    /// [`System::solve_for`] does where it has kept nothing.
    ///
    /// `equations`, `prior` and `damping` must be those that the factor comes from.
    pub fn solve_again<E: Equations>(
        &self,
        pool: &ThreadPool,
        factor: &Factor,
        equations: &E,
        prior: &Prior,
        damping: f64,
        right: &[f64],
        between: Between<'_>,
    ) -> ControlFlow<Stopped, Vec<f64>> {
        if factor.eliminated.is_empty() {
            return self.solve_for(pool, factor, equations, prior, damping, right, between);
        }
        watched(pool, between, |control| {
            let others = control.allocated(of_others(self, right))?;
            let reduced = |coupled: &mut Coupled, (index, kept): (usize, &Vec<f64>)| {
                let mut kept = &kept[..];
                let mut found = OfHome::default();
                for run in self.incidence.stacks_at(index).iter().take_while(|_| !control.stopped()) {
                    let ranges = run.iter().map(|&local| self.layout.local_range(local as usize));
                    ranges.for_each(|range| found.own.extend_from_slice(&right[range]));
                    eliminated::reduce(self, run, coupled, &mut kept, &mut found);
                }
                found
            };
            let homes = factor.eliminated.par_iter().enumerate();
            let found = homes.map_init(Coupled::default, reduced).collect();
            self.solve_reduced(factor, found, others, control).map(|(solution, _)| solution)
        })
    }

    /// Solves N x = r for a right-hand side that the local blocks have reduced; `others` without what they leave, in the order of elimination.
    /// The solution, and r^T x.
    pub(super) fn solve_reduced(
        &self,
        factor: &Factor,
        found: Vec<OfHome>,
        mut others: Vec<f64>,
        control: &Control,
    ) -> Option<(Vec<f64>, f64)> {
        // One after the other in a fixed order, whichever thread has found them.
        found.iter().for_each(|found| found.add_to(&mut others));
        let reduced = others.clone();
        factor.solve_columns(&mut others);
        let own: Vec<Vec<f64>> = found.into_iter().map(|found| found.own).collect();
        // With N = L L^T, r^T x is the square of L^-1 r, of which the local blocks have their parts.
        let product = dot(&reduced, &others) + own.iter().map(|own| dot(own, own)).sum::<f64>();
        let found = self.kept_locals(&factor.eliminated, Some(&own), &others, control);
        Some((self.in_order_of_layout(&found, &others, control)?, product))
    }

    /// The local blocks in the order of the incidence, from what was kept of them; `own`: with other right-hand sides.
    fn kept_locals(
        &self,
        eliminated: &Eliminated,
        own: Option<&[Vec<f64>]>,
        others: &[f64],
        control: &Control,
    ) -> Vec<Vec<f64>> {
        let solve = |coupled: &mut Coupled, (index, kept): (usize, &Vec<f64>)| {
            let (stacks, mut kept) = (self.incidence.stacks_at(index), &kept[..]);
            let mut own = own.map(|own| &own[index][..]);
            let mut found = Vec::with_capacity(stacks.locals() * self.layout.local_dim());
            for run in stacks.iter().take_while(|_| !control.stopped()) {
                eliminated::solve(self, run, coupled, &mut kept, own.as_mut(), others, &mut found);
            }
            control.count(stacks.locals());
            found
        };
        eliminated.par_iter().enumerate().map_init(Coupled::default, solve).collect()
    }

    /// The same from their equations.
    fn written_locals<E: Equations>(
        &self,
        equations: &E,
        prior: &Prior,
        damping: f64,
        others: &[f64],
        control: &Control,
    ) -> Vec<Vec<f64>> {
        let solve = |stack: &mut Stack, stacks: Stacks<'_>| {
            let mut found = Vec::with_capacity(stacks.locals() * self.layout.local_dim());
            for run in stacks.iter().take_while(|_| !control.stopped()) {
                stack.gather(self, equations, run);
                stack.solve(self, prior, damping, others, &mut found);
                control.count(run.len());
            }
            found
        };
        let parts = self.incidence.stacks().parts(CHUNK);
        parts.into_par_iter().map_init(Stack::default, solve).collect()
    }

    /// Puts local blocks in the order of the incidence, and the others in that of elimination, in the order of the layout; None without
    /// memory.
    fn in_order_of_layout(&self, found: &[Vec<f64>], others: &[f64], control: &Control) -> Option<Vec<f64>> {
        let (layout, symbolic) = (&self.layout, &*self.symbolic);
        let mut values = control.allocated(zeros(layout.unknowns()))?;
        for position in 0..symbolic.blocks() {
            let range = symbolic.unknowns_at(layout, position);
            values[range].copy_from_slice(&others[symbolic.range(position)]);
        }
        let found = found.iter().flat_map(|part| part.chunks_exact(layout.local_dim()));
        for (&local, x) in self.incidence.locals().iter().zip(found) {
            values[layout.local_range(local as usize)].copy_from_slice(x);
        }
        Some(values)
    }
}
