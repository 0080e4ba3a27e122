//! Solution of the normal equations.

use std::ops::ControlFlow;

use rayon::ThreadPool;
use rayon::prelude::*;

use super::equations::{Equations, Prior};
use super::factor::Factor;
use super::incidence::Stacks;
use super::stack::Stack;
use super::system::System;
use super::watch::{Between, Stopped, watched};
use super::workspace::zeros;

/// Stacks that a thread takes at a time.
const CHUNK: usize = 64;

impl System {
    /// Solves the normal equations for all unknowns, in the order of the layout: the kept blocks and the border from the factor, the
    /// local blocks one by one.
    ///
    /// `equations`, `prior` and `damping` must be those that the factor comes from.
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
            let solve = |stack: &mut Stack, stacks: Stacks<'_>| {
                let mut found = Vec::with_capacity(stacks.locals() * layout.local_dim());
                for run in stacks.iter().take_while(|_| !control.stopped()) {
                    stack.gather(self, equations, run);
                    stack.solve(self, prior, damping, &others, &mut found);
                    control.count(run.len());
                }
                found
            };
            let parts = self.incidence.stacks().parts(CHUNK);
            let found: Vec<Vec<f64>> = parts.into_par_iter().map_init(Stack::default, solve).collect();
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
}
