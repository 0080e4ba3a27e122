//! Node of the elimination tree of a network that is adjusted in parts.
//!
//! A node is a network with its own photos and the photos that later nodes eliminate. Its points are those whose first photo in the
//! elimination order is its own, with all their images. Additional observations are assigned likewise.
//!
//! A node has inner parameters, which only it and its child nodes involve, and outer parameters, which parent nodes eliminate. It forms its
//! normal equations from its observations and the contributions of its children. It eliminates the inner parameters and passes a
//! [`Contribution`] to its parent. From the step and cofactors of the outer parameters it then computes those for the inner ones. The root
//! has zero outer parameters.

use photocore::adjustment::{AdjustError, Adjustment, AnyProblem, Counts, Linearized};
use photocore::internal::{Assembled, ObservationEquations, Reweighting};
use photocore::network::{
    Dropped, Image, Interface, Network, NetworkError, Options, Point, Solution, SumsByType,
};
use photocore::normals::{
    Contribution, Equations, FactorOptions, InvertOptions, Operations, ReducedRights, SolveOptions, packed,
};
use photocore::{Context, Threads};

use crate::datum::{DatumOfPart, UnknownName};
use crate::interface::{check_blocks, release, with_coefficients};

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
    linearized: Linearized,
    /// Reduced right-hand sides, until they are solved.
    reduced: Option<Reduced>,
}

/// Reduced right-hand sides of a node.
#[derive(Debug)]
enum Reduced {
    /// For a datum of the larger network.
    Datum(ReducedRights),
    /// Of a chord step.
    Chord(ReducedRights<1>),
}

/// Numbers stored per equation and its share of the parameters: residual, redundancy number and test value, in the results and in their
/// output.
const FOUND: usize = 7;

impl Node {
    /// Creates the node of a network in a larger one.
    ///
    /// # Errors
    /// An inconsistent network, missing blocks or blocks without free parameters, insufficient memory.
    pub fn new(
        network: &Network,
        options: &Options,
        interface: Interface,
        threads: &Threads,
    ) -> Result<Self, NetworkError> {
        network.check()?;
        check_blocks(network, &interface)?;
        let interface = with_coefficients(network, interface);
        let mut network = network.clone();
        release(&mut network, &interface);
        let in_photos = interface.held.clone();
        let none = network.left_out(vec![false; network.photos.len()], None)?;
        let selected = threads.install(|| network.select(&none, interface));
        let assembled = threads.install(|| network.assemble(options, selected, None))?;
        assembled.check_memory(options, threads)?;
        let layout = assembled.problem().layout();
        let outer = layout.unknowns_of(layout.outer()).collect();
        let below =
            layout.contributions().iter().map(|blocks| layout.unknowns_of(blocks).collect()).collect();
        let held = assembled.of_photos(&in_photos);
        Ok(Self { network, options: *options, assembled, outer, below, held })
    }

    fn problem(&self) -> &AnyProblem<'_> {
        self.assembled.problem()
    }

    /// Returns the number of parameters of a state: local points, then photos, shared cameras, shared parameters and other points.
    pub fn size(&self) -> usize {
        self.problem().initial.len()
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
        self.problem().counts(&self.held)
    }

    /// Returns the excluded points.
    pub fn dropped(&self) -> &[Dropped] {
        &self.assembled.dropped
    }

    /// Returns the initial state: given photos, points from the intersection of their rays.
    pub fn initial(&self) -> &[f64] {
        &self.problem().initial
    }

    /// Returns the predicted cost by name, computed from the sparsity pattern: numbers of parameters, images and equations, multiply-adds
    /// of each phase, and bytes. `factor_bytes` are those of a formed node in addition to `node_bytes`; `memory_bytes` is the peak of
    /// forming, inverting or writing with a number of threads, including the input and the node.
    pub fn prediction(&self, threads: usize) -> [(&'static str, f64); 14] {
        let system = &self.problem().system;
        let (layout, symbolic) = (system.layout(), system.symbolic());
        let outer = symbolic.outer_unknowns();
        let handed = packed(outer) + self.below.iter().map(|own| packed(own.len())).sum::<usize>();
        let Operations { reduction, factor, inverse, .. } = symbolic.operations(layout);
        let (count, bytes) = (|count: usize| count as f64, |count: usize| (size_of::<f64>() * count) as f64);
        let node = count(self.bytes());
        [
            ("points", count(layout.all_locals().len())),
            ("interior", count(layout.all_retained().len() - outer)),
            ("outer", count(outer)),
            ("images", count(self.assembled.images())),
            ("observations", count(layout.equations())),
            ("reduction", reduction),
            ("factor", factor),
            ("inverse", inverse),
            ("node_bytes", node),
            ("factor_bytes", bytes(system.numbers_in_factor() - outer * outer + 3 * self.size())),
            (
                "memory_bytes",
                node + count(system.memory_of_part(threads)) + bytes(handed + FOUND * layout.equations()),
            ),
            ("contribution_bytes", bytes(packed(outer) + 2 * outer)),
            ("cofactor_bytes", bytes(packed(outer))),
            ("step_bytes", bytes(outer)),
        ]
    }

    /// Returns the bytes of images and points, in input and in model order, and of the sparsity pattern.
    fn bytes(&self) -> usize {
        let (numbers, indices) = (size_of::<f64>(), size_of::<u32>());
        let network = &self.network;
        let of_image = size_of::<Image>() + size_of::<usize>() + 2 * numbers + 3 * indices;
        let of_point = size_of::<Point>() + size_of::<usize>() + 2 * indices;
        size_of::<Image>() * network.images.len()
            + size_of::<Point>() * network.points.len()
            + of_image * self.assembled.images()
            + of_point * self.assembled.points.len()
            + 3 * numbers * self.size()
    }

    /// Returns the state after a step: attitudes step by rotation vectors.
    ///
    /// # Errors
    /// The state or step has a wrong length.
    pub fn advance(&self, state: &[f64], step: &[f64]) -> Result<Vec<f64>, NetworkError> {
        self.check(&[state, step])?;
        let mut state = state.to_vec();
        self.problem().model.advance(&mut state, step);
        Ok(state)
    }

    /// Returns the state with local points at the intersection of their rays; unchanged if an intersection fails.
    ///
    /// # Errors
    /// The state has a wrong length.
    pub fn relocate(&self, state: &[f64], threads: &Threads) -> Result<Vec<f64>, NetworkError> {
        self.check(&[state])?;
        let (problem, mut moved) = (self.problem(), state.to_vec());
        if threads.install(|| problem.model.relocate(&mut moved)) {
            let retained = problem.layout().all_locals().end;
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
        let (problem, loss) = (self.problem(), self.options.adjustment.loss);
        let reached = Adjustment::between(problem, loss, &self.held, state, state.to_vec(), threads);
        let sums = threads.install(|| self.assembled.sums_of_squares(&self.network, &reached, state));
        Ok((sums, problem.objective(state, &reached.residuals, loss)))
    }

    /// Forms the normal equations at a state, adds the contributions of child nodes and eliminates the parameters of this node.
    ///
    /// * `contributions`: of the child nodes, in the order of [`Node::below`], which is also the order of summation;
    /// * `damping`: fraction of the diagonal that is added to it;
    /// * `curved`: whether the second-order term of the loss is included, as for short steps; cofactors are computed without it.
    ///
    /// # Errors
    /// A state of wrong length, contributions for other parameters, an interruption, insufficient memory.
    pub fn form(
        &self,
        state: &[f64],
        contributions: &[Contribution<'_>],
        (damping, curved): (f64, bool),
        context: &mut Context<'_>,
    ) -> Result<FormedNode, NetworkError> {
        self.check(&[state])?;
        let fit = |(given, places): (&Contribution<'_>, &Vec<usize>)| given.is_over(places.len());
        let all = contributions.len() == self.below.len();
        require(all && contributions.iter().zip(&self.below).all(fit))?;
        let (problem, loss) = (self.problem(), self.options.adjustment.loss);
        let reweighting = loss.map(|loss| Reweighting { loss, curved });
        let equations = ObservationEquations::new(problem, reweighting, state, &self.held, context.threads)
            .with_contributions(contributions);
        let options = FactorOptions { damping, ..FactorOptions::default() };
        let (values, held) = (state.to_vec(), self.held.clone());
        let formed = Linearized::of(&equations, values, held, &options, context);
        let mut linearized = formed.map_err(|error| self.named(error))?;
        if loss.is_some() {
            let residuals = problem.residuals_at(context.threads, equations.at());
            linearized.sum_of_squares = problem.objective(state, &residuals, loss);
        }
        // The factor is stored until back-substitution, possibly with many others.
        problem.system.release();
        Ok(FormedNode { linearized, reduced: None })
    }

    /// Returns the undetermined parameters of this node as an error; None if all are determined.
    pub fn undetermined(&self, formed: &FormedNode) -> Option<NetworkError> {
        formed.linearized.undetermined().map(|error| self.named(error))
    }

    /// Returns the step of all parameters for a given step of the outer ones.
    ///
    /// # Errors
    /// A wrong number of outer parameters, an interruption, insufficient memory.
    pub fn solve(
        &self,
        formed: &FormedNode,
        outer: &[f64],
        context: &mut Context<'_>,
    ) -> Result<Vec<f64>, NetworkError> {
        require(outer.len() == self.outer.len())?;
        let equations = formed.linearized.equations(self.problem(), context.threads);
        let options = SolveOptions { outer, ..SolveOptions::default() };
        let step = formed.linearized.solve(&equations, &options, context);
        step.map_err(|error| self.named(error))
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
        context: &mut Context<'_>,
    ) -> Result<(Solution, Vec<Vec<f64>>), NetworkError> {
        self.check(&[state])?;
        if !datum.as_ref().is_none_or(|datum| datum.is_over(self.size())) {
            return Err(NetworkError::State);
        }
        let outer_cofactors = packed(self.outer.len());
        let FormedNode { linearized, .. } = formed;
        require(
            outer.len() == outer_cofactors && linearized.factor.damping == 0.0 && !linearized.is_curved(),
        )?;
        let mut linearized = linearized.determined().map_err(|error| self.named(error))?;
        let (problem, loss) = (self.problem(), self.options.adjustment.loss);
        linearized.transformation = datum.map(|datum| datum.transformation(self.size()));
        let inverted = {
            let equations = linearized.equations(problem, context.threads);
            let options = InvertOptions { outer, ..InvertOptions::default() };
            let inverted = linearized.invert(&equations, &options, context);
            inverted.map_err(|error| self.named(error))?
        };
        problem.system.release();
        let of_blocks = |blocks: &Vec<u32>| inverted.selected.triangle(problem.layout(), blocks);
        let below = problem.layout().contributions().iter().map(of_blocks).collect::<Result<_, _>>()?;
        let before = datum.map(|datum| state.iter().zip(datum.last).map(|(x, dx)| x - dx).collect());
        let before: &Vec<f64> = before.as_ref().unwrap_or(&inverted.values);
        let mut adjustment =
            Adjustment::between(problem, loss, &inverted.held, before, state.to_vec(), context.threads);
        adjustment.put(problem, inverted);
        let lost = adjustment.lost.unwrap_or(0.0);
        let mut solution = self.solution_of(adjustment, context.threads);
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
        let problem = self.problem();
        let loss = self.options.adjustment.loss;
        let adjustment = Adjustment::between(problem, loss, &self.held, before, state.to_vec(), threads);
        Ok(self.solution_of(adjustment, threads))
    }

    fn solution_of(&self, adjustment: Adjustment, threads: &Threads) -> Solution {
        let make = || Solution::new(&self.network, &self.options, &self.assembled, adjustment, vec![]);
        threads.install(make)
    }

    fn check(&self, states: &[&[f64]]) -> Result<(), NetworkError> {
        let fit = states.iter().all(|state| state.len() == self.size());
        if fit { Ok(()) } else { Err(NetworkError::State) }
    }

    /// Returns true if the last steps may converge slowly, so that a chord step pays.
    pub fn converges_linearly(&self) -> bool {
        self.problem().model.converges_linearly()
    }

    /// Reduces the right-hand side of a chord step, a second step with the existing factors, at a state with the contributions
    /// `left` of the child nodes. Returns the contribution to outer parameters, and the decrease of the sum of squares by this node; None if
    /// the factor lacks the required cache.
    ///
    /// # Errors
    /// Wrong numbers of parameters, an interruption, insufficient memory.
    pub fn reduce_chord(
        &self,
        formed: &mut FormedNode,
        state: &[f64],
        left: &[&[f64]],
        context: &mut Context<'_>,
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
        let FormedNode { linearized, .. } = formed;
        if !linearized.factor.has_cached() {
            return Ok(None);
        }
        let problem = self.problem();
        let equations = ObservationEquations::new(problem, None, state, &self.held, context.threads);
        self.zero_fixed(formed, &mut rights);
        rights.iter_mut().zip(&equations.prior().right).for_each(|(right, own)| *right += own);
        let reduced = formed.linearized.factor.reduce_chord(&equations, &rights, context);
        let reduced = reduced.map_err(|error| self.named(error.into()))?;
        let found = (reduced.left(), reduced.products[0]);
        formed.reduced = Some(Reduced::Chord(reduced));
        Ok(Some(found))
    }

    /// Reduces right-hand sides over a state (B of this node), with the contributions of child nodes. Returns the right-hand sides of outer
    /// parameters, and the node's share of B^T Q B, row by row.
    ///
    /// # Errors
    /// A wrong number of parameters, an interruption, insufficient memory.
    pub fn reduce_rights(
        &self,
        formed: &mut FormedNode,
        mut rights: Vec<f64>,
        context: &mut Context<'_>,
    ) -> Result<(Vec<f64>, Vec<f64>), NetworkError> {
        if !rights.len().is_multiple_of(self.size().max(1)) {
            return Err(NetworkError::State);
        }
        self.zero_fixed(formed, &mut rights);
        let FormedNode { linearized, .. } = formed;
        let problem = self.problem();
        let equations = linearized.equations(problem, context.threads);
        let reduced = linearized.factor.reduce_rights(&equations, &rights, context);
        let reduced = reduced.map_err(|error| self.named(error.into()))?;
        let found = (reduced.left(), reduced.products.clone());
        formed.reduced = Some(Reduced::Datum(reduced));
        Ok(found)
    }

    /// Zeroes right-hand sides of constrained or fixed parameters, whose normal equations are decoupled.
    fn zero_fixed(&self, formed: &FormedNode, rights: &mut [f64]) {
        let free = |unknown: &usize| formed.linearized.is_free(self.problem(), *unknown);
        let fixed: Vec<usize> = (0..self.size()).filter(|unknown| !free(unknown)).collect();
        for right in rights.chunks_exact_mut(self.size().max(1)) {
            fixed.iter().for_each(|&unknown| right[unknown] = 0.0);
        }
    }

    /// Solves the reduced right-hand sides, or the reduced chord step, for all parameters, given the solutions of the outer ones; only once.
    ///
    /// # Errors
    /// A wrong number of parameters, a missing reduction, an interruption, insufficient memory.
    pub fn solve_reduced(
        &self,
        formed: &mut FormedNode,
        outer: &[f64],
        context: &mut Context<'_>,
    ) -> Result<Vec<f64>, NetworkError> {
        let (linearized, problem) = (&formed.linearized, self.problem());
        let equations = linearized.equations(problem, context.threads);
        let factor = &linearized.factor;
        let found = match formed.reduced.take() {
            Some(Reduced::Chord(reduced)) if reduced.left().len() == outer.len() => {
                factor.solve_reduced_rights(&equations, reduced, outer, context)
            }
            Some(Reduced::Datum(reduced)) if reduced.left().len() == outer.len() => {
                factor.solve_reduced_rights(&equations, reduced, outer, context)
            }
            _ => return Err(NetworkError::State),
        };
        found.map_err(|error| self.named(error.into()))
    }

    /// Returns the name of each parameter of a state.
    pub fn names(&self) -> Vec<UnknownName> {
        self.assembled.names()
    }

    fn named(&self, error: AdjustError) -> NetworkError {
        NetworkError::new(error, &self.assembled)
    }
}

/// Returns an error unless contributions, steps or cofactors fit the parameters, and equations are not damped.
fn require(fit: bool) -> Result<(), NetworkError> {
    let error = NetworkError::Node("what a node is given is over other unknowns, or damped");
    if fit { Ok(()) } else { Err(error) }
}

impl FormedNode {
    /// Returns true if a reduced chord step is still to be solved.
    pub fn has_chord(&self) -> bool {
        matches!(self.reduced, Some(Reduced::Chord(_)))
    }

    /// Returns the contribution to the outer parameters; empty at the second call.
    pub fn take_contribution(&mut self) -> Contribution<'static> {
        self.linearized.factor.take_contribution()
    }

    /// Returns the weighted sum of squares of this node.
    pub fn sum_of_squares(&self) -> f64 {
        self.linearized.sum_of_squares
    }

    /// Returns the node's share of the decrease of the sum of squares predicted for a full step.
    pub fn decrease(&self) -> f64 {
        self.linearized.factor.decrease
    }
}
