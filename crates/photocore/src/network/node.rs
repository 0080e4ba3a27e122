//! Node of the elimination tree of a network that is adjusted in parts: Helmert blocking (Helmert 1880; Wolf 1978).
//!
//! A node is a network with its own photos and the photos that later nodes eliminate. Its points are those whose first photo in the
//! elimination order is its own, with all their images. Additional observations are assigned likewise. See
//! [`crate::adjustment::Linearized::of_part`] for the algorithm.

use super::error::NetworkError;
use super::input::{Image, Network, Options, Point};
use super::model::Owner;
use super::problem::Assembled;
use super::selection::{Dropped, Selected};
use super::solution::{Solution, SumsByType, observations, owned, sums_of_squares};
use super::surroundings::{BlockOf, Surroundings};
use crate::Threads;
use crate::adjustment::{Adjustment, Counts, DatumOfPart, Linearized, Model, PartError, PartOptions, Watch};
use crate::normals::{Contribution, Operations, ReducedRights, packed};

/// A node with ordered blocks; parameter values are separate.
#[derive(Debug)]
pub struct Node {
    network: Network,
    options: Options,
    assembled: Assembled,
    outer: Vec<usize>,
    below: Vec<Vec<usize>>,
    /// Parameters fixed for the datum of the larger network, including outer ones.
    held: Vec<usize>,
}

/// A node linearized at given values, with its own parameters eliminated.
#[derive(Debug)]
pub struct FormedNode {
    pub(super) part: Linearized,
    /// Reduced right-hand sides, until they are solved.
    pub(super) reduced: Option<ReducedNode>,
}

/// Reduced right-hand sides of a node.
#[derive(Debug)]
pub(super) enum ReducedNode {
    /// For a datum of the larger network.
    Datum(ReducedRights),
    /// Of a chord step.
    Chord(ReducedRights<1>),
}

/// Predicted cost of a node, computed from its sparsity pattern.
#[derive(Debug, Clone, Copy)]
pub struct NodePrediction {
    /// Number of coordinates of points without additional observations.
    pub points: usize,
    /// Number of parameters of blocks that are eliminated in this node.
    pub interior: usize,
    /// Number of parameters of outer blocks.
    pub outer: usize,
    /// Number of image observations.
    pub images: usize,
    /// Number of observation equations, without weighted parameters.
    pub observations: usize,
    /// Multiply-adds of each phase.
    pub operations: Operations,
    /// Bytes of the node itself.
    pub node: usize,
    /// Additional bytes while it is formed: the factor, the reduced points and their indices.
    pub factor: usize,
    /// Peak bytes of forming, inverting or writing, including the input and the node itself.
    pub memory: usize,
}

/// Numbers stored per equation and its share of the parameters: residual, redundancy number and test value, in the results and in their
/// output.
const FOUND: usize = 7;

impl Network {
    /// Returns the active parts of the whole network.
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

    /// Returns the parameters that an adjustment of the whole network fixes as its datum: photo and number of the pose parameter (see
    /// [`Surroundings::held`]). The list is empty if the network defines a datum.
    ///
    /// # Errors
    /// Errors of [`Network::adjust`] before its first iteration.
    pub fn held_for_datum(
        &self,
        options: &Options,
        threads: &Threads,
    ) -> Result<Vec<(usize, usize)>, NetworkError> {
        let selected = self.select_whole(None, threads)?;
        if self.is_placed(&selected) {
            return Ok(vec![]);
        }
        let assembled = threads.install(|| self.assemble(options, selected, None))?;
        let problem = &assembled.problem;
        let held = problem.any().to_hold(&problem.initial, threads);
        let in_photos = owned(problem, &held, Owner::Photo);
        (in_photos.len() == held.len()).then_some(in_photos).ok_or(NetworkError::Node(
            "in parts trajectories take no datum: it would be held by their coefficients",
        ))
    }

    /// Converts the network to a node of a larger one.
    ///
    /// # Errors
    /// An inconsistent network, missing blocks or blocks without free parameters, insufficient memory.
    pub fn node(
        &self,
        options: &Options,
        surroundings: Surroundings,
        threads: &Threads,
    ) -> Result<Node, NetworkError> {
        self.check()?;
        self.check_blocks(&surroundings)?;
        let surroundings = self.told_by_coefficients(surroundings);
        let mut network = self.clone();
        network.release(&surroundings);
        let in_photos = surroundings.held.clone();
        let none = self.left_out(vec![false; self.photos.len()], None)?;
        let selected = threads.install(|| network.select(&none, surroundings));
        let assembled = threads.install(|| network.assemble(options, selected, None))?;
        assembled.check_memory(options)?;
        let layout = assembled.problem.layout();
        let outer = layout.unknowns_of(layout.outer()).collect();
        let below =
            layout.contributions().iter().map(|blocks| layout.unknowns_of(blocks).collect()).collect();
        let model = &assembled.problem.model;
        let held = in_photos.iter().map(|&(photo, number)| model.of_block(photo).start + number).collect();
        Ok(Node { network, options: *options, assembled, outer, below, held })
    }

    /// Removes the weights of outer blocks, because they count in the node that eliminates them. Fixed parameters remain fixed.
    pub(super) fn release(&mut self, surroundings: &Surroundings) {
        let outer = &surroundings.outer;
        let (films, _) = self.commons_by_block(&surroundings.indices(BlockOf::Common));
        let mut photos_of = vec![0; self.cameras.len()];
        self.photos.iter().for_each(|photo| photos_of[photo.camera] += 1);
        let named = |camera: usize| outer.contains(&BlockOf::Camera(camera));
        let mut cameras: Vec<usize> = (0..self.cameras.len()).filter(|&camera| named(camera)).collect();
        for block in outer {
            match *block {
                BlockOf::Photo(own) => {
                    let photo = &mut self.photos[own];
                    free(&mut photo.sd);
                    cameras.extend(Some(photo.camera).filter(|&camera| photos_of[camera] == 1));
                    let film = films.get(own).into_iter().flatten();
                    film.for_each(|&common| free(&mut self.commons[common].sd));
                }
                BlockOf::Camera(_) => {}
                BlockOf::Common(common) => free(&mut self.commons[common].sd),
                BlockOf::Point(point) => free(&mut self.points[point].sd),
            }
        }
        for camera in cameras {
            free(&mut self.cameras[camera].sd);
            self.cameras[camera].covariance = None;
        }
    }
}

/// Makes weighted parameters free.
fn free(sd: &mut [f64]) {
    sd.iter_mut().filter(|sd| **sd > 0.0).for_each(|sd| *sd = f64::INFINITY);
}

impl Node {
    /// Returns the number of parameters of a state: local points, then photos, shared cameras, shared parameters and other points.
    pub fn size(&self) -> usize {
        self.assembled.problem.initial.len()
    }

    /// Returns the number of image observations.
    pub fn images(&self) -> usize {
        self.network.images.len()
    }

    /// Returns the indices of the outer parameters in a state.
    pub fn outer(&self) -> &[usize] {
        &self.outer
    }

    /// Returns, for each child node, the indices of the parameters of its contribution.
    pub fn below(&self) -> &[Vec<usize>] {
        &self.below
    }

    /// Returns the numbers of observations and parameters that are assigned to this node.
    pub fn counts(&self) -> Counts {
        self.assembled.problem.counts(&self.held)
    }

    /// Returns the excluded points.
    pub fn dropped(&self) -> &[Dropped] {
        &self.assembled.dropped
    }

    /// Returns the initial state: given photos, points from the intersection of their rays.
    pub fn initial(&self) -> &[f64] {
        &self.assembled.problem.initial
    }

    /// Returns the predicted cost, computed from the sparsity pattern.
    pub fn prediction(&self) -> NodePrediction {
        let system = &self.assembled.problem.system;
        let (layout, symbolic) = (system.layout(), system.symbolic());
        let outer = symbolic.outer_unknowns();
        let handed = packed(outer) + self.below.iter().map(|own| packed(own.len())).sum::<usize>();
        NodePrediction {
            points: layout.all_locals().len(),
            interior: layout.all_retained().len() - outer,
            outer,
            images: self.assembled.problem.model.images.len(),
            observations: layout.equations(),
            operations: symbolic.operations(layout),
            node: self.bytes(),
            factor: size_of::<f64>() * (system.numbers_in_factor() - outer * outer + 3 * self.size()),
            memory: self.bytes()
                + system.memory_of_part()
                + size_of::<f64>() * (handed + FOUND * layout.equations()),
        }
    }

    /// Returns the bytes of images and points, in input and in model order, and of the sparsity pattern.
    fn bytes(&self) -> usize {
        let (numbers, indices) = (size_of::<f64>(), size_of::<u32>());
        let (network, problem) = (&self.network, &self.assembled.problem);
        let of_image = size_of::<Image>() + size_of::<usize>() + 2 * numbers + 3 * indices;
        let of_point = size_of::<Point>() + size_of::<usize>() + 2 * indices;
        size_of::<Image>() * network.images.len()
            + size_of::<Point>() * network.points.len()
            + of_image * problem.model.images.len()
            + of_point * problem.model.points.len()
            + 3 * numbers * problem.initial.len()
    }

    /// Returns the state after a step: attitudes step by rotation vectors.
    ///
    /// # Errors
    /// The state or step has a wrong length.
    pub fn advance(&self, state: &[f64], step: &[f64]) -> Result<Vec<f64>, NetworkError> {
        self.check(&[state, step])?;
        let mut state = state.to_vec();
        self.assembled.problem.model.advance(&mut state, step);
        Ok(state)
    }

    /// Returns the state with local points at the intersection of their rays; unchanged if an intersection fails.
    ///
    /// # Errors
    /// The state has a wrong length.
    pub fn relocate(&self, state: &[f64], threads: &Threads) -> Result<Vec<f64>, NetworkError> {
        self.check(&[state])?;
        let (model, mut moved) = (&self.assembled.problem.model, state.to_vec());
        if threads.install(|| model.relocate(&mut moved)) {
            let retained = 3 * model.locals;
            moved[retained..].copy_from_slice(&state[retained..]);
        }
        Ok(moved)
    }

    /// Returns the weighted sums of squares of this node (weights as modified by the loss) and the objective. Without a loss, the objective
    /// is their sum.
    /// # Errors
    /// The state has a wrong length.
    pub fn objective(&self, state: &[f64], threads: &Threads) -> Result<(SumsByType, f64), NetworkError> {
        self.check(&[state])?;
        let (problem, loss) = (&self.assembled.problem, self.options.adjustment.loss);
        let reached = Adjustment::between(problem, loss, &self.held, state, state.to_vec(), threads);
        let observed = threads.install(|| observations(&self.network, problem, &reached));
        let sums = sums_of_squares(problem, &reached, state, &observed);
        Ok((sums, problem.any().objective(state, &reached.residuals, loss)))
    }

    /// Forms the normal equations at a state, adds the contributions of child nodes and eliminates the parameters of this node.
    ///
    /// * `damping`: fraction of the diagonal that is added to it;
    /// * `curved`: whether the second-order term of the loss is included.
    ///
    /// # Errors
    /// A state of wrong length, contributions for other parameters, an interruption, insufficient memory.
    pub fn form(
        &self,
        state: &[f64],
        contributions: &[Contribution<'_>],
        (damping, curved): (f64, bool),
        threads: &Threads,
        watch: Watch<'_>,
    ) -> Result<FormedNode, NetworkError> {
        self.check(&[state])?;
        let problem = &self.assembled.problem;
        let loss = self.options.adjustment.loss;
        let options = PartOptions { held: self.held.clone(), damping, loss, curved };
        let part = Linearized::of_part(problem, state.to_vec(), contributions, options, threads, watch);
        Ok(FormedNode { part: part.map_err(|error| self.named(error))?, reduced: None })
    }

    /// Returns the undetermined parameters of this node as an error; None if all are determined.
    pub fn undetermined(&self, formed: &FormedNode) -> Option<NetworkError> {
        formed.part.undetermined().map(|error| NetworkError::new(error, &self.assembled))
    }

    /// Returns the step of all parameters for a given step of the outer ones.
    ///
    /// # Errors
    /// A wrong number of outer parameters, an interruption, insufficient memory.
    pub fn solve(
        &self,
        formed: &FormedNode,
        outer: &[f64],
        threads: &Threads,
        watch: Watch<'_>,
    ) -> Result<Vec<f64>, NetworkError> {
        formed
            .part
            .solve_part(&self.assembled.problem, outer, threads, watch)
            .map_err(|error| self.named(error))
    }

    /// Returns the solution with cofactors, and the cofactors for each child node: lower triangles, column by column.
    ///
    /// * `outer`: cofactors of the outer parameters;
    /// * `state`: final state of the adjustment;
    /// * `datum`: transformation of the cofactors of this node to a datum of the larger network.
    ///
    /// # Errors
    /// Wrong numbers of parameters, undetermined parameters, an interruption, insufficient memory.
    pub fn invert(
        &self,
        formed: FormedNode,
        outer: &[f64],
        state: &[f64],
        datum: Option<DatumOfPart<'_>>,
        threads: &Threads,
        watch: Watch<'_>,
    ) -> Result<(Solution, Vec<Vec<f64>>), NetworkError> {
        self.check(&[state])?;
        let size = |datum: &DatumOfPart<'_>| {
            let d = datum.common.len().isqrt();
            let columns = [datum.t.len(), datum.w.len()] == [d * self.size(); 2];
            columns && datum.common.len() == d * d && datum.last.len() == self.size()
        };
        if !datum.as_ref().is_none_or(size) {
            return Err(NetworkError::State);
        }
        let problem = &self.assembled.problem;
        let found = formed.part.invert_part(problem, outer, state.to_vec(), datum, threads, watch);
        let (adjustment, below) = found.map_err(|error| self.named(error))?;
        let lost = adjustment.lost.unwrap_or(0.0);
        let mut solution = self.solution_of(adjustment, threads);
        solution.datum.relative_error = lost;
        Ok((solution, below))
    }

    /// Returns the solution without cofactors; `before` is the state before the last step.
    ///
    /// # Errors
    /// A state has a wrong length.
    pub fn solution(
        &self,
        state: &[f64],
        before: &[f64],
        threads: &Threads,
    ) -> Result<Solution, NetworkError> {
        self.check(&[state, before])?;
        let problem = &self.assembled.problem;
        let loss = self.options.adjustment.loss;
        let adjustment = Adjustment::between(problem, loss, &self.held, before, state.to_vec(), threads);
        Ok(self.solution_of(adjustment, threads))
    }

    fn solution_of(&self, adjustment: Adjustment, threads: &Threads) -> Solution {
        let make = || Solution::new(&self.network, &self.options, &self.assembled, adjustment, vec![]);
        threads.install(make)
    }

    pub(super) fn check(&self, states: &[&[f64]]) -> Result<(), NetworkError> {
        let fit = states.iter().all(|state| state.len() == self.size());
        if fit { Ok(()) } else { Err(NetworkError::State) }
    }

    /// Returns true if the last steps may converge slowly, so that a chord step pays.
    pub fn ends_slowly(&self) -> bool {
        self.assembled.problem.model.ends_slowly()
    }

    /// Reduces the right-hand side of a chord step, a second step with the existing factors ([`Linearized::reduce_chord`]), at a state with the contributions of the child nodes. Returns the contribution to outer parameters, and
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
        let problem = &self.assembled.problem;
        let found = formed.part.reduce_chord(problem, state, rights, threads, watch);
        let reduced = found.map_err(|error| self.named(error))?;
        let found = reduced.as_ref().map(|reduced| (reduced.left(), reduced.products[0]));
        formed.reduced = reduced.map(ReducedNode::Chord);
        Ok(found)
    }

    /// Solves the reduced right-hand sides, or the reduced chord step, for all parameters, given the solutions of the outer ones; only once.
    ///
    /// # Errors
    /// A wrong number of parameters, a missing reduction, an interruption, insufficient memory.
    pub fn solve_reduced(
        &self,
        formed: &mut FormedNode,
        outer: &[f64],
        threads: &Threads,
        watch: Watch<'_>,
    ) -> Result<Vec<f64>, NetworkError> {
        let (part, problem) = (&formed.part, &self.assembled.problem);
        let found = match formed.reduced.take() {
            Some(ReducedNode::Chord(reduced)) if reduced.left().len() == outer.len() => {
                part.solve_reduced_rights(problem, reduced, outer, threads, watch)
            }
            Some(ReducedNode::Datum(reduced)) if reduced.left().len() == outer.len() => {
                part.solve_reduced_rights(problem, reduced, outer, threads, watch)
            }
            _ => return Err(NetworkError::State),
        };
        found.map_err(|error| self.named(error))
    }

    pub(super) fn assembled(&self) -> &Assembled {
        &self.assembled
    }

    pub(super) fn named(&self, error: PartError) -> NetworkError {
        match error {
            PartError::Foreign => {
                NetworkError::Node("what a node is given is over other unknowns, or damped")
            }
            PartError::Adjust(error) => NetworkError::new(error, &self.assembled),
        }
    }
}

impl FormedNode {
    /// Returns true if a reduced chord step is still to be solved.
    pub fn has_chord(&self) -> bool {
        matches!(self.reduced, Some(ReducedNode::Chord(_)))
    }

    /// Returns the contribution to the outer parameters; empty at the second call.
    pub fn take_contribution(&mut self) -> Contribution<'static> {
        self.part.take_contribution()
    }

    /// Returns the weighted sum of squares of this node.
    pub fn sum_of_squares(&self) -> f64 {
        self.part.sum_of_squares()
    }

    /// Returns the node's share of the decrease of the sum of squares predicted for a full step.
    pub fn decrease(&self) -> f64 {
        self.part.decrease()
    }
}
