//! A chord of a network that is adjusted in parts: a second step with the factors that its nodes have
//! ([`crate::adjustment::Linearized::reduce_chord`]).

use super::NetworkError;
use super::node::{FormedNode, Node};
use crate::Threads;
use crate::adjustment::{Model, Watch};

impl Node {
    /// Whether the last steps of the larger network may fall slowly, so that a chord pays.
    pub fn ends_slowly(&self) -> bool {
        self.assembled().problem.model.ends_slowly()
    }

    /// Reduces the right-hand side that the equations have at a state, with what each node below has left. What is left for the outer
    /// unknowns, and by how much the node lowers the sum of squares there; None where the factor has not cached what that takes.
    ///
    /// # Errors
    /// Other numbers of unknowns, an interruption, no memory.
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

    /// The chord of all unknowns where its right-hand side was reduced, that of the outer ones being given; once.
    ///
    /// # Errors
    /// Another number of unknowns, nothing that was reduced, an interruption, no memory.
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
    /// Whether the right-hand side of a chord was reduced, and is not solved for.
    pub fn has_chord(&self) -> bool {
        self.chord.is_some()
    }
}
