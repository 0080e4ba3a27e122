//! The datum of a network that is adjusted in parts: found of the whole, taken to by each node.
//!
//! The network is moved as a whole, and has B and T there ([`crate::adjustment::DatumColumns`]). Its nodes reduce B on the way up, and
//! are given W = Q B of the outer unknowns with the cofactors of these on the way down: each takes its own cofactors over.

use super::model::Owner;
use super::node::{FormedNode, Node};
use super::problem::Assembled;
use super::selection::Selected;
use super::surroundings::Surroundings;
use super::{InnerConstraints, Network, NetworkError, Options};
use crate::Threads;
use crate::adjustment::{Adjusted, DatumColumns, Watch, moved_with_columns};
use crate::sorting::order;

/// What an unknown belongs to (0: a photo, 1: a camera that photos share, 2: a common unknown, 3: a point), its index in the network, and
/// the number of the unknown there.
pub type UnknownName = [usize; 3];

/// A network that was adjusted in parts.
#[derive(Debug, Clone, Copy)]
pub struct AdjustedInParts<'a> {
    /// The middle that all nodes were given ([`Surroundings::middle`]).
    pub middle: Option<[f64; 3]>,
    /// Photos with the numbers of their unknowns that were held.
    pub held: &'a [(usize, usize)],
    /// All unknowns; those of several nodes may stand here several times.
    pub names: &'a [UnknownName],
    /// Where they have been adjusted to.
    pub values: &'a [f64],
}

impl Network {
    /// Moves a network that was adjusted in parts to the datum of inner constraints: values, B and T of the unknowns as they are named.
    ///
    /// # Errors
    /// Those of [`super::NetworkAdjustment::run`] with such a datum; names that are not those of all unknowns.
    pub fn parts_in_datum(
        &self,
        options: &Options,
        inner: &InnerConstraints,
        adjusted: AdjustedInParts<'_>,
        threads: &Threads,
    ) -> Result<(Vec<f64>, DatumColumns), NetworkError> {
        let selected = self.select_whole(adjusted.middle, threads)?;
        let assembled = threads.install(|| self.assemble(options, selected, None))?;
        self.check_carriers(inner, &assembled)?;
        let problem = &assembled.problem;
        let places = assembled.places_of(adjusted.names).ok_or(NetworkError::State)?;
        let mut unknowns = vec![f64::NAN; problem.initial.len()];
        places.iter().zip(adjusted.values).for_each(|(&place, &value)| unknowns[place] = value);
        if unknowns.iter().any(|value| value.is_nan()) {
            return Err(NetworkError::State);
        }
        let (datum, reference) = threads.install(|| assembled.datum(inner));
        let held: Vec<usize> = adjusted
            .held
            .iter()
            .map(|&(photo, number)| problem.model.of_block(photo).start + number)
            .collect();
        let whole = Adjusted { unknowns: &unknowns, held: &held, loss: None };
        let (moved, columns) = moved_with_columns(problem.any(), whole, &datum, &reference, threads)?;
        let named = |all: &[f64]| -> Vec<f64> {
            let columns = all.chunks_exact(moved.len().max(1));
            columns.flat_map(|column| places.iter().map(|&place| column[place])).collect()
        };
        let (b, t) = (named(&columns.b), named(&columns.t));
        Ok((named(&moved), DatumColumns { b, t, ..columns }))
    }

    /// What takes part of the whole network.
    pub(super) fn select_whole(
        &self,
        middle: Option<[f64; 3]>,
        threads: &Threads,
    ) -> Result<Selected, NetworkError> {
        self.check()?;
        let left_out = self.left_out(self.untouched_photos(), None)?;
        let surroundings = Surroundings { middle, ..Surroundings::default() };
        Ok(threads.install(|| self.select(&left_out, surroundings)))
    }
}

impl Assembled {
    /// What each unknown belongs to.
    fn names(&self) -> Vec<UnknownName> {
        let model = &self.problem.model;
        let mut names = vec![[0; 3]; self.problem.initial.len()];
        for (owner, range) in (0..model.stations()).flat_map(|block| model.owners(block)) {
            let (kind, index) = match owner {
                Owner::Photo(photo) => (0, photo),
                Owner::Camera(camera) => (1, camera),
                Owner::Common(common) => (2, common),
            };
            range.enumerate().for_each(|(number, unknown)| names[unknown] = [kind, index, number]);
        }
        for (place, &point) in self.points.iter().enumerate() {
            model.of_point(place).enumerate().for_each(|(k, unknown)| names[unknown] = [3, point, k]);
        }
        names
    }

    /// Where named unknowns stand; None where one is not there.
    fn places_of(&self, names: &[UnknownName]) -> Option<Vec<usize>> {
        let own = self.names();
        let order = order(own.len(), &|a, b| own[a].cmp(&own[b]));
        let place = |name: &UnknownName| order.binary_search_by_key(name, |&unknown| own[unknown]).ok();
        names.iter().map(|name| place(name).map(|at| order[at])).collect()
    }
}

impl Node {
    /// What each unknown of a state belongs to.
    pub fn names(&self) -> Vec<UnknownName> {
        self.assembled().names()
    }

    /// Reduces right-hand sides over the unknowns of a state, one after the other: B of what is at home here, with what nodes below have
    /// left. What is left for the outer unknowns, one right-hand side after the other, and the share of the node in B^T Q B, row by row.
    ///
    /// # Errors
    /// Another number of unknowns, an interruption, no memory.
    pub fn reduce_rights(
        &self,
        formed: &mut FormedNode,
        rights: Vec<f64>,
        threads: &Threads,
        watch: Watch<'_>,
    ) -> Result<(Vec<f64>, Vec<f64>), NetworkError> {
        if !rights.len().is_multiple_of(self.size().max(1)) {
            return Err(NetworkError::State);
        }
        let problem = &self.assembled().problem;
        let reduced = formed.part.reduce_rights(problem, rights, threads, watch);
        let reduced = formed.reduced.insert(reduced.map_err(|error| self.named(error))?);
        Ok((reduced.left(), reduced.products.clone()))
    }

    /// Solves for all unknowns where right-hand sides were reduced, W of the outer ones being given; once.
    ///
    /// # Errors
    /// Another number of unknowns, nothing that was reduced, an interruption, no memory.
    pub fn solve_reduced_rights(
        &self,
        formed: &mut FormedNode,
        outer: &[f64],
        threads: &Threads,
        watch: Watch<'_>,
    ) -> Result<Vec<f64>, NetworkError> {
        let reduced = formed.reduced.take();
        self.solved(formed, reduced, outer, threads, watch)
    }
}
