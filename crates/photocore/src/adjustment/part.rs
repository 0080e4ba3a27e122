//! Part of a partitioned problem: a node of its elimination tree (Helmert 1880; Wolf 1978).
//!
//! A part has inner unknowns, which only it and its child parts involve, and outer unknowns, which parent parts eliminate. It forms its
//! normal equations from its observations and the contributions of its children. It eliminates the inner unknowns and passes a
//! [`Contribution`] to its parent. From the step and cofactors of the outer unknowns it then computes those for the inner ones. The root
//! part has zero outer unknowns.

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

/// Error of the formation, solution or inversion of a part.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum PartError {
    /// Contributions, steps or cofactors of other unknowns than required, or damped equations.
    #[error("what a part was given by others is over other unknowns, or its equations are damped")]
    Foreign,
    /// Error of the adjustment.
    #[error(transparent)]
    Adjust(#[from] AdjustError),
}

/// Options of the formation of a part.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PartOptions {
    /// Unknowns constrained for the datum of the whole problem, including outer ones.
    pub held: Vec<usize>,
    /// Fraction of the diagonal of the normal equations that is added to it.
    pub damping: f64,
    /// Robust loss of the observations.
    pub loss: Option<Loss>,
    /// Whether to use its second-order term, as for short steps; cofactors are computed without it.
    pub curved: bool,
}

impl Linearized {
    /// Forms the normal equations of a part at given values and eliminates its inner unknowns.
    ///
    /// * `contributions`: contributions of the child parts, in the order of the layout, which is also the order of summation.
    ///
    /// # Errors
    /// Contributions of other unknowns, lengths that contradict the layout, an interruption, lack of memory.
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
        // The factor is stored until back-substitution, possibly with many others.
        problem.system.release();
        Ok(formed)
    }

    /// Returns the contribution to the outer unknowns; empty at the second call.
    pub fn take_contribution(&mut self) -> Contribution<'static> {
        self.factor.take_contribution()
    }

    /// Computes the step of all unknowns of a part from the step of the outer ones.
    ///
    /// # Errors
    /// Interruption, lack of memory, or a wrong number of outer unknowns.
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

    /// Reduces right-hand sides over the unknowns of a part, one after the other, including contributions of child parts.
    ///
    /// # Errors
    /// Interruption or lack of memory.
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

    /// Reduces the right-hand side of a part for a chord: its equations at other values, plus the contributions `left` of child parts. None
    /// if the factor lacks the cache.
    ///
    /// # Errors
    /// Interruption or lack of memory.
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

    /// Zeroes right-hand sides of constrained or fixed unknowns, whose normal equations are decoupled.
    fn of_free(&self, problem: &AnyProblem<'_>, mut rights: Vec<f64>) -> Vec<f64> {
        let unknowns = problem.layout().unknowns();
        let fixed: Vec<usize> = (0..unknowns).filter(|&unknown| !self.is_free(problem, unknown)).collect();
        for right in rights.chunks_exact_mut(unknowns.max(1)) {
            fixed.iter().for_each(|&unknown| right[unknown] = 0.0);
        }
        rights
    }

    /// Solves for all unknowns, from reduced right-hand sides and the solutions of the outer unknowns.
    ///
    /// # Errors
    /// Interruption or lack of memory.
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

    /// Computes the adjustment of the inner unknowns and the cofactors for each child part: lower triangles, column by column.
    ///
    /// * `outer`: cofactors of the outer unknowns, in the same form;
    /// * `reached`: values after the last step; cofactors refer to the values before it;
    /// * `datum`: transformation to a datum of the whole. Cofactors for child parts are not transformed.
    ///
    /// # Errors
    /// Undetermined unknowns, an interruption, lack of memory, or a wrong number of outer unknowns.
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
