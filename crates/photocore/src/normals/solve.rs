//! Solution of the normal equations.

use std::ops::ControlFlow;

use rayon::ThreadPool;
use rayon::prelude::*;

use super::eliminated::{self, Coupled, Eliminated};
use super::equations::{Equations, Prior};
use super::factor::Factor;
use super::incidence::Stacks;
use super::stack::Stack;
use super::system::System;
use super::watch::{Between, Control, Stopped, watched};
use super::workspace::zeros;

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
        let (layout, symbolic) = (&self.layout, &*self.symbolic);
        watched(pool, between, |control| {
            let mut others = factor.right.clone();
            let first = others.len() - symbolic.outer_unknowns();
            others[first..].iter_mut().zip(outer).for_each(|(x, given)| *x = *given);
            factor.solve_backward(&mut others);
            let found = match factor.eliminated.is_empty() {
                false => self.kept_locals(&factor.eliminated, &others, control),
                true => self.written_locals(equations, prior, damping, &others, control),
            };
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
        })
    }

    /// The local blocks in the order of the incidence, from what was kept of them.
    fn kept_locals(&self, eliminated: &Eliminated, others: &[f64], control: &Control) -> Vec<Vec<f64>> {
        let solve = |coupled: &mut Coupled, (index, kept): (usize, &Vec<f64>)| {
            let (stacks, mut kept) = (self.incidence.stacks_at(index), &kept[..]);
            let mut found = Vec::with_capacity(stacks.locals() * self.layout.local_dim());
            for run in stacks.iter().take_while(|_| !control.stopped()) {
                eliminated::solve(self, run, coupled, &mut kept, others, &mut found);
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
}
