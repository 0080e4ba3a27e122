//! A node of the elimination tree of a network that is adjusted in parts: Helmert blocking (Helmert 1880; Wolf 1978).
//!
//! A node is a network of its own: the photos at home in it and those that other nodes eliminate after it, the points whose first photo in
//! the order of elimination is at home here, all their images, and the observations at home likewise. See
//! [`crate::adjustment::Linearized::of_part`] for what is done with it.

use super::problem::Assembled;
use super::solution::{observations, of_photo, sums_of_squares};
use super::surroundings::{BlockOf, Surroundings};
use super::{Dropped, Image, Network, NetworkError, Options, Point, Solution, SumsOfSquares};
use crate::Threads;
use crate::adjustment::{Adjustment, Counts, DatumOfPart, Linearized, Model, PartError, PartOptions, Watch};
use crate::normals::{Contribution, Operations, ReducedRights, packed};

/// A node, its blocks ordered; it has no values.
#[derive(Debug)]
pub struct Node {
    network: Network,
    options: Options,
    assembled: Assembled,
    outer: Vec<usize>,
    below: Vec<Vec<usize>>,
    /// Unknowns held for the datum of the larger network, outer ones among them.
    held: Vec<usize>,
}

/// A node at given values, what is at home in it eliminated.
#[derive(Debug)]
pub struct FormedNode {
    pub(super) part: Linearized,
    /// Right-hand sides for a datum of the larger network, on their way.
    pub(super) reduced: Option<ReducedRights>,
    /// The right-hand side of a chord, on its way.
    pub(super) chord: Option<ReducedRights<1>>,
}

/// What a node takes, from its pattern alone.
#[derive(Debug, Clone, Copy)]
pub struct NodePrediction {
    /// Unknowns of points that only images touch.
    pub points: usize,
    /// Unknowns of blocks that are eliminated here, and of outer ones.
    pub interior: usize,
    /// Unknowns of outer blocks.
    pub outer: usize,
    /// Image points, and equations in all.
    pub images: usize,
    /// Equations in all, weighted unknowns not counted.
    pub observations: usize,
    /// Multiply-adds of each phase.
    pub operations: Operations,
    /// Bytes that the node keeps by itself.
    pub node: usize,
    /// Bytes that it keeps beside while it is formed: the factor, what the points have left, and where that is.
    pub factor: usize,
    /// Bytes that forming, inverting or writing takes at the most, what it is given and the node itself counted.
    pub memory: usize,
}

/// Numbers that are found of an equation and its share of the unknowns: residual, redundancy number, test value, as they are found and as
/// they are written.
const FOUND: usize = 7;

impl Network {
    /// The unknowns that an adjustment of the whole network holds because nothing gives it a datum: photos, each with the number of one of
    /// its pose unknowns (see [`Surroundings::held`]); none where there is a datum.
    ///
    /// # Errors
    /// Those of [`Network::adjust`] before its first iteration.
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
        let in_photos = held.iter().map(|&unknown| of_photo(problem, unknown)).collect::<Option<Vec<_>>>();
        in_photos.ok_or(NetworkError::Node(
            "in parts trajectories take no datum: it would be held by their coefficients",
        ))
    }

    /// Takes the network as a node of a larger one.
    ///
    /// # Errors
    /// A network that contradicts itself, blocks that are not there or have no unknowns, more memory than the options give.
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

    /// Takes the weights of outer blocks away: they count where these are eliminated. What is fixed stays so.
    pub(super) fn release(&mut self, surroundings: &Surroundings) {
        let outer = &surroundings.outer;
        let (films, _) = self.commons_by_block(&surroundings.commons());
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

/// Makes weighted unknowns free.
fn free(sd: &mut [f64]) {
    sd.iter_mut().filter(|sd| **sd > 0.0).for_each(|sd| *sd = f64::INFINITY);
}

impl Node {
    /// Unknowns of a state: of points that only images touch, then of photos, shared cameras, common unknowns and other points.
    pub fn size(&self) -> usize {
        self.assembled.problem.initial.len()
    }

    /// Image points.
    pub fn images(&self) -> usize {
        self.network.images.len()
    }

    /// Where the outer unknowns stand in a state.
    pub fn outer(&self) -> &[usize] {
        &self.outer
    }

    /// Where the unknowns stand that each node below leaves something for.
    pub fn below(&self) -> &[Vec<usize>] {
        &self.below
    }

    /// Observations and unknowns at home here.
    pub fn counts(&self) -> Counts {
        self.assembled.problem.counts(&self.held)
    }

    /// Points that do not take part.
    pub fn dropped(&self) -> &[Dropped] {
        &self.assembled.dropped
    }

    /// The state to begin with: photos as they are given, points where their rays meet.
    pub fn initial(&self) -> &[f64] {
        &self.assembled.problem.initial
    }

    /// What it takes, from its pattern alone.
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

    /// Bytes of images and points, as they were given and as they were ordered, and of the pattern.
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

    /// The state after a step: attitudes step by rotation vectors.
    ///
    /// # Errors
    /// A state or step of another length.
    pub fn advance(&self, state: &[f64], step: &[f64]) -> Result<Vec<f64>, NetworkError> {
        self.check(&[state, step])?;
        let mut state = state.to_vec();
        self.assembled.problem.model.advance(&mut state, step);
        Ok(state)
    }

    /// The state with points that only images touch where their rays meet; as it is where some do not.
    ///
    /// # Errors
    /// A state of another length.
    pub fn relocate(&self, state: &[f64], threads: &Threads) -> Result<Vec<f64>, NetworkError> {
        self.check(&[state])?;
        let (model, mut moved) = (&self.assembled.problem.model, state.to_vec());
        if threads.install(|| model.relocate(&mut moved)) {
            let retained = 3 * model.locals;
            moved[retained..].copy_from_slice(&state[retained..]);
        }
        Ok(moved)
    }

    /// Weighted sums of squares of what is at home here, weights as a loss has changed them, and what is minimised: their sum, without one.
    ///
    /// # Errors
    /// A state of another length.
    pub fn objective(&self, state: &[f64], threads: &Threads) -> Result<(SumsOfSquares, f64), NetworkError> {
        self.check(&[state])?;
        let (problem, loss) = (&self.assembled.problem, self.options.adjustment.loss);
        let reached = Adjustment::between(problem, loss, &self.held, state, state.to_vec(), threads);
        let observed = observations(&self.network, problem, &reached);
        let sums = sums_of_squares(problem, &reached, state, &observed);
        Ok((sums, problem.any().objective(state, &reached.residuals, loss)))
    }

    /// Forms the normal equations at a state, with what the nodes below leave, and eliminates what is at home here.
    ///
    /// * `damping`: a fraction of the diagonal that is added to it;
    /// * `curved`: whether the second-order term of a loss is taken in.
    ///
    /// # Errors
    /// A state of another length, contributions over other unknowns, an interruption, no memory.
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
        Ok(FormedNode { part: part.map_err(|error| self.named(error))?, reduced: None, chord: None })
    }

    /// What the observations leave undetermined of what is at home here.
    pub fn undetermined(&self, formed: &FormedNode) -> Option<NetworkError> {
        formed.part.undetermined().map(|error| NetworkError::new(error, &self.assembled))
    }

    /// The step of all unknowns, given that of the outer ones.
    ///
    /// # Errors
    /// Another number of outer unknowns, an interruption, no memory.
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

    /// What is adjusted here, with its cofactors, and the cofactors that each node below needs for its own: lower triangles, column by column.
    ///
    /// * `outer`: those of the outer unknowns;
    /// * `state`: where the adjustment has ended;
    /// * `datum`: what takes the cofactors of this node to a datum of the larger network.
    ///
    /// # Errors
    /// Other numbers of unknowns, what is not determined, an interruption, no memory.
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

    /// What is adjusted here, without cofactors; `before` is the state before the last step.
    ///
    /// # Errors
    /// States of another length.
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

    /// Solves where right-hand sides were reduced, solutions for the outer unknowns being given.
    pub(super) fn solved<const C: usize>(
        &self,
        formed: &FormedNode,
        reduced: Option<ReducedRights<C>>,
        outer: &[f64],
        threads: &Threads,
        watch: Watch<'_>,
    ) -> Result<Vec<f64>, NetworkError> {
        let reduced = reduced.filter(|reduced| reduced.left().len() == outer.len());
        let reduced = reduced.ok_or(NetworkError::State)?;
        let found = formed.part.solve_reduced_rights(&self.assembled.problem, reduced, outer, threads, watch);
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
    /// What it leaves for the outer unknowns; empty the second time.
    pub fn take_contribution(&mut self) -> Contribution<'static> {
        self.part.take_contribution()
    }

    /// Weighted sum of squares of what is at home in the node.
    pub fn sum_of_squares(&self) -> f64 {
        self.part.sum_of_squares()
    }

    /// The share of the node in the decrease of the sum of squares that a full step predicts.
    pub fn decrease(&self) -> f64 {
        self.part.decrease()
    }
}
