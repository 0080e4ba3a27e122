//! Assembly of the front of a supernode: local blocks, terms, contributions of child systems, and priors.

use std::sync::Arc;

use super::batch::Batch;
use super::equations::{Equations, Prior, RowBuffer};
use super::front::Front;
use super::incidence::Batches;
use super::panels::PerSupernode;
use super::system::System;
use super::vectorised::LANES;
use super::workspace::reserved;
use crate::context::Control;
use crate::parallel;

/// Input of a formation.
pub(super) struct Formation<'a> {
    pub system: &'a Arc<System>,
    pub equations: &'a dyn Equations,
    pub damping: f64,
    /// Whether to cache the local eliminations for [`Factor::solve`](super::Factor::solve).
    pub caches: bool,
    pub control: &'a Control,
}

/// Sums of the formation at one supernode.
#[derive(Default)]
pub(super) struct Sums {
    pub sum_of_squares: f64,
    pub decrease: f64,
    pub deficient: Vec<usize>,
    /// Cached local eliminations.
    pub cached: Vec<f64>,
}

/// Minimum number of local blocks at a supernode for several threads.
const MANY: usize = 256;
/// Number of batches that are gathered in parallel before they are added to the front.
const WAVE: usize = 64;

impl Formation<'_> {
    /// Adds the contributions of the local blocks of a supernode, in order; None if memory is insufficient.
    pub(super) fn assemble(
        &self,
        front: &mut Front<'_>,
        index: usize,
        cached: &PerSupernode<Vec<f64>>,
    ) -> Option<Sums> {
        let Self { system, control, .. } = self;
        let layout = &system.layout;
        let batches = system.incidence.batches_at(index);
        let mut sums = Sums::default();
        if self.caches {
            sums.cached = cached.take(index).unwrap_or_default();
            let numbers = system.cached[index] + LANES;
            if sums.cached.capacity() < numbers {
                sums.cached = control.allocated(reserved(numbers))?;
            }
        }
        if batches.units() < MANY || rayon::current_num_threads() == 1 {
            self.assemble_in_turn(front, batches, &mut sums);
            return Some(sums);
        }
        sums.cached.clear();
        let mut filled: Vec<Batch> = (0..WAVE).map(|_| system.workspace.batch()).collect();
        let starts = self.shares(index);
        for wave in batches.parts(WAVE).into_iter().take_while(|_| !control.stopped()) {
            let runs: Vec<&[u32]> = wave.iter().collect();
            let filled = &mut filled[..runs.len()];
            let pairs = filled.iter_mut().zip(runs).collect();
            parallel::each_of(pairs, &|_, (batch, run): (&mut Batch, &[u32])| self.fill(batch, run));
            parallel::each_of(front.parts(&starts), &|_, mut columns| {
                for batch in &*filled {
                    batch.add_to(&mut columns, layout);
                }
            });
            for batch in filled {
                sums.add(batch);
                if self.caches && !batch.uncoupled {
                    batch.cache(layout, &mut sums.cached);
                }
            }
        }
        filled.into_iter().for_each(|batch| system.workspace.put_back_batch(batch));
        // Vector loads read beyond the end.
        sums.cached.resize(sums.cached.len() + LANES, 0.0);
        Some(sums)
    }

    /// Assembles batch by batch on one thread, and writes the cache directly.
    fn assemble_in_turn(&self, front: &mut Front<'_>, batches: Batches<'_>, sums: &mut Sums) {
        let layout = &self.system.layout;
        let mut batch = self.system.workspace.batch();
        if self.caches {
            std::mem::swap(&mut batch.coupling, &mut sums.cached);
        }
        for run in batches.iter().take_while(|_| !self.control.stopped()) {
            self.fill(&mut batch, run);
            batch.add_to(&mut front.columns(), layout);
            sums.add(&mut batch);
            if self.caches && !batch.uncoupled {
                batch.cache_in_place(layout);
            }
        }
        if self.caches {
            std::mem::swap(&mut batch.coupling, &mut sums.cached);
            batch.start = 0;
        }
        self.system.workspace.put_back_batch(batch);
    }

    fn fill(&self, batch: &mut Batch, run: &[u32]) {
        batch.gather(self.equations, self.system, run);
        batch.eliminate(&self.system.layout, self.equations.prior(), self.damping);
        self.system.count(run, self.control);
    }

    /// Returns the first columns of the shares of a front for several threads, each a few blocks.
    fn shares(&self, index: usize) -> Vec<usize> {
        let symbolic = &*self.system.symbolic;
        let Some(s) = symbolic.supernodes().get(index) else { return Vec::new() };
        let first = symbolic.first_unknown(index);
        let own = s.blocks.clone().map(|position| symbolic.range(position).start - first);
        let starts: Vec<usize> = own.chain(s.row_offset[..s.rows.len()].iter().copied()).collect();
        let few = starts.len().div_ceil(8 * rayon::current_num_threads());
        starts.into_iter().step_by(few).collect()
    }

    /// Adds the terms of a supernode; returns the sum of squares of their right-hand sides.
    pub(super) fn add_terms(&self, front: &mut Front<'_>, index: usize) -> f64 {
        let (mut sum_of_squares, mut buffer) = (0.0, RowBuffer::default());
        for &term in self.system.terms.at(index) {
            let (columns, rows) =
                self.system.term_in_front(index, self.equations, term as usize, &mut buffer);
            for (coefficients, constant) in rows {
                front.add_equation(&columns, &coefficients, constant);
                sum_of_squares += constant * constant;
            }
        }
        sum_of_squares
    }

    /// Adds the contributions of child systems, in the order of the layout.
    pub(super) fn add_contributions(&self, front: &mut Front<'_>, index: usize) {
        for &below in self.system.contributions.at(index) {
            let blocks = &self.system.layout.contributions()[below as usize];
            if let Some(given) = self.equations.contribution(below as usize) {
                front.add_contribution(given, &self.system.rows_of(index, blocks));
            }
        }
    }

    /// Adds the priors and the damping to the eliminated blocks of a supernode.
    pub(super) fn add_prior(&self, front: &mut Front<'_>, index: usize) {
        let (layout, symbolic) = (&self.system.layout, &*self.system.symbolic);
        let Prior { weight, right, between } = self.equations.prior();
        let positions = symbolic.supernodes()[index].blocks.clone();
        let unknowns = positions.flat_map(|position| symbolic.unknowns_at(layout, position));
        for (column, unknown) in unknowns.enumerate() {
            let weight = weight[unknown];
            front.diagonal[column] += weight;
            front.right[column] += right[unknown];
            front.panel[column * (front.height + 1)] += weight + self.damping * front.diagonal[column];
            front.diagonal[column] *= 1.0 + self.damping;
            let own = between.partition_point(|&(i, ..)| i < unknown);
            for &(_, other, weight) in between[own..].iter().take_while(|&&(i, ..)| i == unknown) {
                front.panel[(column - (unknown - other)) * front.height + column] += weight;
            }
        }
    }
}

impl Sums {
    fn add(&mut self, batch: &mut Batch) {
        self.sum_of_squares += batch.sum_of_squares;
        self.decrease += batch.decrease;
        self.deficient.append(&mut batch.deficient);
    }
}

/// Ascending columns of a front, and the coefficients with the right-hand side of each equation of a term.
pub(super) type TermInFront = (Vec<usize>, Vec<(Vec<f64>, f64)>);

impl System {
    /// Returns the equations of a term that is assembled in supernode `node`: the columns of the front, ascending, and the coefficients with
    /// the right-hand side of each equation.
    pub(super) fn term_in_front(
        &self,
        node: usize,
        equations: &dyn Equations,
        term: usize,
        buffer: &mut RowBuffer,
    ) -> TermInFront {
        let mut rows = buffer.term(&self.layout, term);
        equations.write_term(term, &mut rows);
        let at = self.rows_of(node, &self.layout.terms()[term].retained);
        let mut order: Vec<usize> = (0..at.len()).collect();
        order.sort_unstable_by_key(|&k| at[k]);
        let sorted = |row: &[f64]| order.iter().map(|&k| row[k]).collect();
        let found = rows.shared.chunks_exact(at.len()).zip(&*rows.constant);
        (
            order.iter().map(|&k| at[k]).collect(),
            found.map(|(row, &constant)| (sorted(row), constant)).collect(),
        )
    }
}
