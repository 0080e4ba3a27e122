//! What keeps a network from moving as a whole, kind by kind.

use super::equations::ObservationEquations;
use super::motions::{Candidates, Sums};
use super::problem::AnyProblem;
use super::walk::Buffers;
use crate::Threads;

/// Kinds of observations, by their numbers: groups are of the first.
#[derive(Debug, Clone, Copy)]
pub struct Classes<'a> {
    /// How many kinds there are.
    pub count: usize,
    /// Of each tie.
    pub of_ties: &'a [usize],
    /// Of each unknown, as an observation of itself.
    pub of_unknowns: &'a [usize],
}

impl AnyProblem<'_> {
    /// For each kind of observation the share of what a motion changes in it that remains when all unknowns move together, the greatest
    /// of all motions: one for what is fixed, and rounding where the kind leaves all of them open.
    pub fn resistance(&self, values: &[f64], classes: &Classes<'_>, threads: &Threads) -> Vec<f64> {
        let none = vec![0.0; classes.count];
        let Some(motions) = threads.install(|| self.model.all_motions(values)) else { return none };
        let (layout, count) = (self.layout(), motions.vectors.len());
        let moved = Candidates::by_unknown(&motions, values.len());
        let free = vec![false; values.len()];
        let candidates = Candidates::new(&motions, &moved, &free);
        let equations = ObservationEquations::of_all(self, values, threads);
        let mut sums: Vec<Sums> = (0..classes.count).map(|_| candidates.sums()).collect();
        let mut buffers = Buffers::default();
        if let Some(groups) = sums.first_mut() {
            for local in 0..layout.locals() {
                equations.each_row(&mut buffers, local, |row| candidates.add_row(groups, row.taken()));
            }
        }
        self.for_ties(|tie, rows| {
            candidates.add_tie(&mut sums[classes.of_ties[tie]], &equations, tie, rows);
        });
        let mut observed: Vec<bool> = self.sd.iter().map(|&sd| sd == 0.0).collect();
        self.terms(values).within(0..values.len()).for_each(|term| observed[term.unknowns()].fill(true));
        let mut shares: Vec<f64> = sums.iter().map(|own| own.share(count)).collect();
        for (unknown, &class) in classes.of_unknowns.iter().enumerate() {
            if observed[unknown] && motions.vectors.iter().any(|vector| vector[unknown] != 0.0) {
                shares[class] = 1.0;
            }
        }
        shares
    }
}
