//! Chord steps of a network that is adjusted in parts: a second step with the existing factors of its nodes
//! ([`crate::adjustment::Linearized::reduce_chord`]).

use super::error::NetworkError;
use super::node::{FormedNode, Node};
use crate::Threads;
use crate::adjustment::{Model, Watch};

impl Node {
    /// Returns true if the last steps may converge slowly, so that a chord step pays.
    pub fn ends_slowly(&self) -> bool {
        self.assembled().problem.model.ends_slowly()
    }

    /// Reduces the right-hand side at a state with the contributions of the child nodes. Returns the contribution to outer parameters, and
    /// the decrease of the sum of squares by this node; None if the factor lacks the required cache.
    ///
    /// # Errors
    /// Wrong numbers of parameters, an interruption, insufficient memory.
    pub fn reduce_chord(
        &self,
        formed: &mut FormedNode,
        state: &[f64],
        left: &[&[f64]],
        threads: &Threads,
        watch: Watch<'_>,
    ) -> Result<Option<(Vec<f64>, f64)>, NetworkError> {
        self.check(&[state])?;
        let fit = left.iter().zip(self.below()).all(|(left, places)| left.len() == places.len());
        if !fit || left.len() != self.below().len() {
            return Err(NetworkError::State);
        }
        let mut rights = vec![0.0; self.size()];
        for (left, places) in left.iter().zip(self.below()) {
            places.iter().zip(*left).for_each(|(&place, value)| rights[place] += value);
        }
        let problem = &self.assembled().problem;
        let found = formed.part.reduce_chord(problem, state, rights, threads, watch);
        formed.chord = found.map_err(|error| self.named(error))?;
        Ok(formed.chord.as_ref().map(|reduced| (reduced.left(), reduced.products[0])))
    }

    /// Solves the reduced chord step of all parameters, given the step of the outer ones; only once.
    ///
    /// # Errors
    /// A wrong number of parameters, a missing reduction, an interruption, insufficient memory.
    pub fn solve_chord(
        &self,
        formed: &mut FormedNode,
        outer: &[f64],
        threads: &Threads,
        watch: Watch<'_>,
    ) -> Result<Vec<f64>, NetworkError> {
        let reduced = formed.chord.take();
        self.solved(formed, reduced, outer, threads, watch)
    }
}

impl FormedNode {
    /// Returns true if a reduced chord step is still to be solved.
    pub fn has_chord(&self) -> bool {
        self.chord.is_some()
    }
}
