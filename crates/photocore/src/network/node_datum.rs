//! Datum of a network that is adjusted in parts: defined for the whole network, applied by each node.
//!
//! The whole network is transformed and yields B and T ([`crate::adjustment::DatumColumns`]). Its nodes reduce B from children to parents.
//! Then W = Q B and the cofactors of outer parameters are passed from parents to children, and each node transforms its own cofactors.

use super::error::NetworkError;
use super::input::{InnerConstraints, Network, Options};
use super::model::Owner;
use super::node::{FormedNode, Node, ReducedNode};
use super::problem::Assembled;
use crate::Threads;
use crate::adjustment::{Adjusted, DatumColumns, Watch, moved_with_columns};

/// Owner of a parameter (0: photo, 1: shared camera, 2: shared parameter, 3: point), its index in the network, and the number of the
/// parameter there.
pub type UnknownName = [usize; 3];

/// Results of a network that was adjusted in parts.
#[derive(Debug, Clone, Copy)]
pub struct AdjustedInParts<'a> {
    /// Centre that was passed to all nodes ([`super::Surroundings::middle`]).
    pub middle: Option<[f64; 3]>,
    /// Photos with the numbers of their fixed parameters.
    pub held: &'a [(usize, usize)],
    /// Names of all parameters; parameters of several nodes may be repeated.
    pub names: &'a [UnknownName],
    /// Adjusted values.
    pub values: &'a [f64],
}

impl Network {
    /// Transforms a network that was adjusted in parts to inner constraints; returns values, B and T in the order of the names.
    ///
    /// # Errors
    /// Errors of [`super::NetworkAdjustment::run`] with such a datum; names that do not cover all parameters.
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
}

impl Assembled {
    /// Returns the name of each parameter.
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

    /// Returns the indices of named parameters; None if one is missing.
    fn places_of(&self, names: &[UnknownName]) -> Option<Vec<usize>> {
        let own = self.names();
        let mut order: Vec<usize> = (0..own.len()).collect();
        order.sort_by_key(|&unknown| own[unknown]);
        let place = |name: &UnknownName| order.binary_search_by_key(name, |&unknown| own[unknown]).ok();
        names.iter().map(|name| place(name).map(|at| order[at])).collect()
    }
}

impl Node {
    /// Returns the name of each parameter of a state.
    pub fn names(&self) -> Vec<UnknownName> {
        self.assembled().names()
    }

    /// Reduces right-hand sides over a state (B of this node), with the contributions of child nodes. Returns the right-hand sides of outer
    /// parameters, and the node's share of B^T Q B, row by row.
    ///
    /// # Errors
    /// A wrong number of parameters, an interruption, insufficient memory.
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
        let reduced = reduced.map_err(|error| self.named(error))?;
        let found = (reduced.left(), reduced.products.clone());
        formed.reduced = Some(ReducedNode::Datum(reduced));
        Ok(found)
    }
}
