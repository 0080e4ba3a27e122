//! Right-hand sides that go through a system in parts: up, reduced by what each part eliminates, and down again as solutions.

use std::ops::ControlFlow;

use super::eliminated::Elimination;
use super::equations::{Equations, Prior};
use super::factor::Factor;
use super::system::System;
use super::vectorised::LANES;
use super::watch::{Between, watched};
use crate::{Stopped, Threads};

/// Right-hand sides of a part, reduced by the unknowns that it eliminates, C at a time: y = L^-1 r.
#[derive(Debug)]
pub struct ReducedRights<const C: usize = LANES> {
    /// Those of the local blocks, as [`Elimination::reduce`] has them.
    pub(super) own: Vec<Vec<[f64; C]>>,
    /// Those of the others in the order of elimination, one right-hand side after the other; of outer unknowns what is left for them.
    pub(super) others: Vec<f64>,
    /// y^T y of every two of them, outer unknowns not counted: over all parts that is r^T N^-1 r.
    pub products: Vec<f64>,
    /// How many unknowns are not local, and how many of them are outer ones.
    pub(super) counts: (usize, usize),
}

impl<const C: usize> ReducedRights<C> {
    /// What is left for the outer unknowns, one right-hand side after the other.
    pub fn left(&self) -> Vec<f64> {
        let (all, outer) = self.counts;
        self.others.chunks_exact(all.max(1)).flat_map(|column| &column[all - outer..]).copied().collect()
    }

    /// Puts solutions for the outer unknowns in the place of what is left for them.
    fn put(&mut self, solutions: &[f64]) {
        let (all, outer) = self.counts;
        let columns = self.others.chunks_exact_mut(all.max(1));
        for (column, given) in columns.zip(solutions.chunks_exact(outer.max(1))) {
            column[all - outer..].copy_from_slice(&given[..outer]);
        }
    }
}

impl System {
    /// Reduces right-hand sides over all unknowns of a part, one after the other. What its factor comes from is as in [`System::solve`].
    pub fn reduce_rights(
        &self,
        threads: &Threads,
        factor: &Factor,
        (equations, prior): (&dyn Equations, &Prior),
        rights: &[f64],
        between: Between<'_>,
    ) -> ControlFlow<Stopped, ReducedRights> {
        watched(threads, between, |control| {
            let elimination = self.elimination(factor, equations, prior, control);
            let counts = (self.symbolic.unknowns(), self.symbolic.outer_unknowns());
            let mut others = control.allocated(self.of_others(rights))?;
            let found = elimination.reduce::<LANES>(rights);
            found.iter().for_each(|found| found.add_to(&mut others, counts.0));
            factor.forward_columns(&mut others);
            let own = found.into_iter().map(|found| found.own).collect();
            let mut reduced = ReducedRights { own, others, products: vec![], counts };
            reduced.products = elimination.products(&reduced, rights.len() / self.layout.unknowns().max(1));
            Some(reduced)
        })
    }

    /// Solves for all unknowns of a part where right-hand sides were reduced, solutions for the outer ones being given.
    pub fn solve_reduced_rights<const C: usize>(
        &self,
        threads: &Threads,
        factor: &Factor,
        (equations, prior): (&dyn Equations, &Prior),
        mut reduced: ReducedRights<C>,
        outer: &[f64],
        between: Between<'_>,
    ) -> ControlFlow<Stopped, Vec<f64>> {
        watched(threads, between, |control| {
            let elimination = self.elimination(factor, equations, prior, control);
            reduced.put(outer);
            let ReducedRights { own, mut others, products, .. } = reduced;
            factor.backward_columns(&mut others);
            elimination.complete(Some(own), &others, products.len().isqrt())
        })
    }
}

impl Elimination<'_> {
    /// y^T y of so many right-hand sides, row by row.
    fn products(&self, reduced: &ReducedRights, columns: usize) -> Vec<f64> {
        let (mut sums, (all, outer)) = (vec![0.0; columns * columns], reduced.counts);
        let mut add = |y: &dyn Fn(usize) -> f64| {
            for (i, row) in sums.chunks_exact_mut(columns).enumerate() {
                row.iter_mut().enumerate().for_each(|(j, sum)| *sum += y(i) * y(j));
            }
        };
        for ((_, batches), own) in self.parts().into_iter().zip(&reduced.own) {
            let mut rest = &own[..];
            for locals in batches.iter() {
                let count = locals.len() * self.system.layout.local_dim();
                let (here, after) = rest.split_at(count * columns.div_ceil(LANES));
                (0..count).for_each(|row| add(&|k| here[k / LANES * count + row][k % LANES]));
                rest = after;
            }
        }
        (0..all - outer).for_each(|row| add(&|k| reduced.others[k * all + row]));
        sums
    }
}
