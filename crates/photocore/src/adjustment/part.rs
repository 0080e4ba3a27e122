//! A part of a problem that is adjusted in parts: a node of its elimination tree (Helmert 1880; Wolf 1978).
//!
//! A part has observations of its own, unknowns that nothing outside of it and the parts below touches, and outer ones, which parts above
//! eliminate. With what the parts below leave it forms its normal equations, eliminates its own unknowns and leaves the rest for the
//! part above ([`Contribution`]); from the step of the outer unknowns follow those of its own, and from the cofactors of the outer
//! unknowns its own. The part of a problem without outer unknowns is the last one.

use thiserror::Error;

use super::equations::ObservationEquations;
use super::linearized::Linearized;
use super::loss::{Loss, Reweighting};
use super::options::Phase;
use super::problem::AnyProblem;
use super::result::{AdjustError, Adjustment};
use super::run::{Watch, between};
use super::transformation::{DatumOfPart, Transformation};
use crate::Threads;
use crate::normals::{
    Contribution, Equations, FactorOptions, InvertOptions, ReducedRights, SolveOptions, packed,
};

/// Why a part is not formed, solved or inverted.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum PartError {
    /// What it was given is not over its outer unknowns, or those of the parts below; or its own equations are damped.
    #[error("what a part was given by others is over other unknowns, or its equations are damped")]
    Foreign,
    /// What ends adjustments.
    #[error(transparent)]
    Adjust(#[from] AdjustError),
}

/// How a part is formed.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PartOptions {
    /// Unknowns held for the datum of the whole, outer ones among them.
    pub held: Vec<usize>,
    /// A fraction of the diagonal of the normal equations that is added to it.
    pub damping: f64,
    /// What weights the observations.
    pub loss: Option<Loss>,
    /// Whether its second-order term is taken in, as close to the end it may be; cofactors are had without.
    pub curved: bool,
}

impl Linearized {
    /// Forms the normal equations of a part at given values and eliminates what is at home here.
    ///
    /// * `contributions`: what the parts below leave, in the order of the layout: they are added in this order.
    ///
    /// # Errors
    /// Contributions of other unknowns, lengths that contradict the layout, an interruption, no memory.
    pub fn of_part(
        problem: &AnyProblem<'_>,
        values: Vec<f64>,
        contributions: &[Contribution<'_>],
        options: PartOptions,
        threads: &Threads,
        watch: Watch<'_>,
    ) -> Result<Self, PartError> {
        let layout = problem.layout();
        let blocks = layout.contributions();
        let fit = |(given, blocks): (&Contribution<'_>, &Vec<u32>)| {
            given.is_over(layout.unknowns_of(blocks).count())
        };
        if contributions.len() != blocks.len() || !contributions.iter().zip(blocks).all(fit) {
            return Err(PartError::Foreign);
        }
        problem.check_lengths(&values).map_err(AdjustError::from)?;
        let PartOptions { held, damping, loss, curved } = options;
        let reweighting = loss.map(|loss| Reweighting { loss, curved });
        let equations = ObservationEquations::new(problem, reweighting, &values, &held, threads)
            .with_contributions(contributions);
        let options = FactorOptions { damping, ..FactorOptions::default() };
        let mut between = between(watch, Phase::Form, layout.locals());
        let mut formed = Self::of(&equations, values, held, &options, threads, &mut between)?;
        if loss.is_some() {
            let residuals = problem.residuals_at(threads, equations.at());
            formed.sum_of_squares = problem.objective(&formed.values, &residuals, loss);
        }
        // The factor waits for the way down, perhaps with those of many others.
        problem.system.release();
        Ok(formed)
    }

    /// What a part leaves for its outer unknowns; empty the second time.
    pub fn take_contribution(&mut self) -> Contribution<'static> {
        self.factor.take_contribution()
    }

    /// The step of all unknowns of a part, those of the outer ones being given.
    ///
    /// # Errors
    /// An interruption, no memory; another number of outer unknowns.
    pub fn solve_part(
        &self,
        problem: &AnyProblem<'_>,
        outer: &[f64],
        threads: &Threads,
        watch: Watch<'_>,
    ) -> Result<Vec<f64>, PartError> {
        if outer.len() != problem.system.symbolic().outer_unknowns() {
            return Err(PartError::Foreign);
        }
        let mut between = between(watch, Phase::Solve, problem.layout().locals());
        let options = SolveOptions { outer, ..SolveOptions::default() };
        Ok(self.solve(&self.equations(problem, threads), &options, threads, &mut between)?)
    }

    /// Reduces right-hand sides over the unknowns of a part, one after the other: those at home here, with what the parts below have left.
    ///
    /// # Errors
    /// An interruption, no memory.
    pub fn reduce_rights(
        &self,
        problem: &AnyProblem<'_>,
        rights: Vec<f64>,
        threads: &Threads,
        watch: Watch<'_>,
    ) -> Result<ReducedRights, PartError> {
        let rights = self.of_free(problem, rights);
        let mut between = between(watch, Phase::Solve, problem.layout().locals());
        let equations = self.equations(problem, threads);
        let of = (&equations as &dyn Equations, &self.prior);
        let found = problem.system.reduce_rights(threads, &self.factor, of, &rights, &mut between);
        Ok(found.map_err(AdjustError::from)?)
    }

    /// Reduces the right-hand side that the equations of a part have at other values, `left` of the parts below in it: a chord, over all parts.
    /// None where the factor has not cached what that takes.
    ///
    /// # Errors
    /// An interruption, no memory.
    pub fn reduce_chord(
        &self,
        problem: &AnyProblem<'_>,
        values: &[f64],
        left: Vec<f64>,
        threads: &Threads,
        watch: Watch<'_>,
    ) -> Result<Option<ReducedRights<1>>, PartError> {
        if !self.factor.has_cached() {
            return Ok(None);
        }
        let equations = ObservationEquations::new(problem, None, values, &self.held, threads);
        let prior = problem.prior_equations(&problem.terms(values), &self.held);
        let mut rights = self.of_free(problem, left);
        rights.iter_mut().zip(&prior.right).for_each(|(right, own)| *right += own);
        let mut between = between(watch, Phase::Solve, problem.layout().locals());
        let of = (&equations as &dyn Equations, &prior);
        let found = problem.system.reduce_chord(threads, &self.factor, of, &rights, &mut between);
        Ok(Some(found.map_err(AdjustError::from)?))
    }

    /// Right-hand sides, zero where unknowns are held or fixed: these stand in the normal equations by themselves.
    fn of_free(&self, problem: &AnyProblem<'_>, mut rights: Vec<f64>) -> Vec<f64> {
        let unknowns = problem.layout().unknowns();
        let fixed: Vec<usize> = (0..unknowns).filter(|&unknown| !self.is_free(problem, unknown)).collect();
        for right in rights.chunks_exact_mut(unknowns.max(1)) {
            fixed.iter().for_each(|&unknown| right[unknown] = 0.0);
        }
        rights
    }

    /// Solves where right-hand sides were reduced, the solutions for the outer unknowns being given.
    ///
    /// # Errors
    /// An interruption, no memory.
    pub fn solve_reduced_rights<const C: usize>(
        &self,
        problem: &AnyProblem<'_>,
        reduced: ReducedRights<C>,
        outer: &[f64],
        threads: &Threads,
        watch: Watch<'_>,
    ) -> Result<Vec<f64>, PartError> {
        let mut between = between(watch, Phase::Solve, problem.layout().locals());
        let equations = self.equations(problem, threads);
        let of = (&equations as &dyn Equations, &self.prior);
        let system = &problem.system;
        let found = system.solve_reduced_rights(threads, &self.factor, of, reduced, outer, &mut between);
        Ok(found.map_err(AdjustError::from)?)
    }

    /// The adjustment of what is at home in a part, and the cofactors of the unknowns of each part below: lower triangles, column by column.
    ///
    /// * `outer`: the same of the outer unknowns;
    /// * `reached`: the values after the last step; cofactors are those of the values before it;
    /// * `datum`: what takes them to a datum of the whole. Those of the parts below are not taken there.
    ///
    /// # Errors
    /// Unknowns that are not determined, an interruption, no memory; another number of outer unknowns.
    pub fn invert_part(
        self,
        problem: &AnyProblem<'_>,
        outer: &[f64],
        reached: Vec<f64>,
        datum: Option<DatumOfPart<'_>>,
        threads: &Threads,
        watch: Watch<'_>,
    ) -> Result<(Adjustment, Vec<Vec<f64>>), PartError> {
        let (layout, mut part) = (problem.layout(), self.determined()?);
        part.transformation = datum.map(|datum| Transformation::of_part(&datum, layout.unknowns()));
        let outer_cofactors = packed(problem.system.symbolic().outer_unknowns());
        if outer.len() != outer_cofactors || part.damping() != 0.0 || part.is_curved() {
            return Err(PartError::Foreign);
        }
        let loss = part.reweighting.map(|reweighting| reweighting.loss);
        let inverted = {
            let equations = part.equations(problem, threads);
            let mut between = between(watch, Phase::Invert, layout.locals());
            let options = InvertOptions { outer, ..InvertOptions::default() };
            part.invert(&equations, &options, threads, &mut between)?
        };
        problem.system.release();
        let below = layout.contributions().iter().map(|blocks| inverted.selected.triangle(layout, blocks));
        let below = below.collect::<Result<_, _>>().map_err(AdjustError::from)?;
        let before = datum.map(|datum| reached.iter().zip(datum.last).map(|(x, dx)| x - dx).collect());
        let before: &Vec<f64> = before.as_ref().unwrap_or(&inverted.values);
        let mut adjustment = Adjustment::between(problem, loss, &inverted.held, before, reached, threads);
        adjustment.put(problem, inverted);
        Ok((adjustment, below))
    }
}
