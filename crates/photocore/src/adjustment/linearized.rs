//! A problem linearized at given values, its normal equations factored once for any number of questions: steps, determinants, what is not
//! determined, solutions for any right-hand sides, covariances of anything with anything, the inverse where it has elements.

use std::time::Instant;

use thiserror::Error;

use super::datum::Basis;
use super::equations::ObservationEquations;
use super::loss::{Loss, Reweighting};
use super::problem::AnyProblem;
use super::result::{AdjustError, Seconds, gib};
use super::transformation::Transformation;
use crate::Threads;
use crate::normals::{
    Between, Cofactors, Factor, FactorOptions, Function, Inversion, InvertOptions, Layout, Prior,
    SelectedInverse, SolveOptions,
};

/// The normal equations of a problem at given values, factored, in the datum of the unknowns that are held or in any other.
#[derive(Debug)]
pub struct Linearized {
    pub(super) values: Vec<f64>,
    pub(super) held: Vec<usize>,
    pub(super) reweighting: Option<Reweighting>,
    pub(super) prior: Prior,
    pub(super) factor: Factor,
    pub(super) sum_of_squares: f64,
    /// The datum that cofactors are to be taken to.
    pub(super) basis: Option<Basis>,
    /// What takes cofactors there.
    pub(super) transformation: Option<Transformation>,
    /// What all that was done so far has taken.
    pub(super) seconds: Seconds,
}

/// The inverse normal matrix of a problem at given values, where it has elements.
#[derive(Debug)]
pub struct Inverted {
    /// The values that it is of.
    pub(super) values: Vec<f64>,
    /// The unknowns that were held there.
    pub(super) held: Vec<usize>,
    pub(super) cofactors: Cofactors,
    /// Redundancy numbers of the unknowns as observations of themselves (zero unless weighted).
    pub(super) prior_redundancy: Vec<f64>,
    pub(super) selected: SelectedInverse,
    /// About how large a part of a variance rounding may be, where cofactors were taken to another datum: large numbers cancel where the old
    /// one is far from the new one, or short.
    pub lost: Option<f64>,
    /// What all of it has taken.
    pub(super) seconds: Seconds,
}

/// Why there are no cofactors of what was asked for.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum CofactorError {
    /// They would take more memory than they may.
    #[error("these cofactors take {} of memory, and {} are free: ask for fewer at a time", gib(*.needed), gib(*.available))]
    Memory {
        /// Bytes that they would take.
        needed: usize,
        /// Bytes that they may take.
        available: usize,
    },
    /// What ends adjustments.
    #[error(transparent)]
    Adjust(#[from] AdjustError),
}

impl Linearized {
    /// Forms and factors the normal equations at given values, some unknowns held there; weights are those that the loss has left.
    ///
    /// Whether everything is determined is for the caller to ask.
    ///
    /// # Errors
    /// Lengths that contradict the layout, an interruption, no memory.
    pub fn form(
        problem: &AnyProblem<'_>,
        loss: Option<Loss>,
        values: Vec<f64>,
        held: Vec<usize>,
        threads: &Threads,
        between: Between<'_>,
    ) -> Result<Self, AdjustError> {
        problem.check_lengths(&values)?;
        let reweighting = loss.map(Reweighting::plain);
        let equations = ObservationEquations::new(problem, reweighting, &values, &held, threads);
        Self::of(&equations, values, held, &FactorOptions::UNCACHED, threads, between)
    }

    /// The same of equations that are there already.
    pub(super) fn of(
        equations: &ObservationEquations<'_>,
        values: Vec<f64>,
        held: Vec<usize>,
        options: &FactorOptions,
        threads: &Threads,
        between: Between<'_>,
    ) -> Result<Self, AdjustError> {
        let (start, problem) = (Instant::now(), equations.problem());
        let terms = problem.terms(&values);
        let prior = problem.prior_equations(&terms, &held);
        let factor = problem.system.factor(threads, equations, &prior, options, between)?;
        let sum_of_squares = factor.sum_of_squares + terms.sum_of_squares(0..values.len());
        let (took, share) = (start.elapsed().as_secs_f64(), factor.formation_share);
        let seconds = Seconds { form: took * share, factor: took * (1.0 - share), ..Seconds::default() };
        Ok(Self {
            values,
            held,
            reweighting: equations.reweighting(),
            prior,
            factor,
            sum_of_squares,
            basis: None,
            transformation: None,
            seconds,
        })
    }

    /// The values that the equations are of.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The unknowns that were held there.
    pub fn held(&self) -> &[usize] {
        &self.held
    }

    /// Weighted sum of squares of the observations at these values, weighted unknowns among them; not finite where some cannot be computed.
    pub fn sum_of_squares(&self) -> f64 {
        self.sum_of_squares
    }

    /// By how much a full step lowers it, as the linearized equations predict.
    pub fn decrease(&self) -> f64 {
        self.factor.decrease
    }

    /// No unknown changes by more than this multiple of its standard deviation in a full step.
    pub(super) fn change(&self) -> f64 {
        self.factor.decrease.sqrt()
    }

    /// The fraction of the diagonal that was added to it.
    pub(super) fn damping(&self) -> f64 {
        self.factor.damping
    }

    /// Whether the second-order term of a loss is taken in.
    pub(super) fn is_curved(&self) -> bool {
        self.reweighting.is_some_and(|reweighting| reweighting.curved)
    }

    /// Why the observations do not determine all unknowns.
    pub fn undetermined(&self) -> Option<AdjustError> {
        if !self.factor.deficient_locals.is_empty() {
            return Some(AdjustError::UndeterminedLocals(self.factor.deficient_locals.clone()));
        }
        self.factor.deficiency().map(|found| AdjustError::Undetermined(found.blocks()))
    }

    /// The same, of which all unknowns are determined.
    ///
    /// # Errors
    /// Unknowns that are not.
    pub fn determined(self) -> Result<Self, AdjustError> {
        self.undetermined().map_or(Ok(self), Err)
    }

    /// Combinations of unknowns, none of them local, that the observations do not determine: for each the unknowns that take part in
    /// it, ascending.
    pub fn undetermined_unknowns(&self, layout: &Layout) -> Vec<Vec<usize>> {
        self.factor.deficiency().map_or(vec![], |found| found.unknowns(layout))
    }

    /// The same with all unknowns, how each combination moves them, and their diagonal elements of the normal equations.
    pub fn combinations(&self, layout: &Layout) -> Vec<Vec<(usize, f64, f64)>> {
        self.factor.deficiency().map_or(vec![], |found| found.combinations(layout))
    }

    /// The unknowns, none of them local, that no observation and no weight touches, ascending.
    pub fn without_effect(&self, layout: &Layout) -> Vec<usize> {
        self.factor.without_effect(layout)
    }

    /// Natural logarithm of the determinant, the local unknowns reduced out; None where it is zero.
    pub fn log_determinant(&self) -> Option<f64> {
        self.factor.log_determinant()
    }

    /// The corrections of the unknowns that are not local, in the order of the layout.
    pub fn reduced_corrections(&self, layout: &Layout) -> Vec<f64> {
        self.factor.reduced_corrections(layout)
    }

    /// The cofactors of every two unknowns that are not local, in the order of the layout, row by row; zero for those that are fixed or
    /// held.
    pub fn reduced_cofactors(&self, problem: &AnyProblem<'_>) -> Vec<f64> {
        let layout = problem.layout();
        let (first, count) = (layout.all_locals().end, layout.unknowns() - layout.all_locals().end);
        let mut rights = vec![0.0; count * count];
        for k in 0..count {
            // What is fixed or held stands in the normal equations by itself, with unit weight.
            rights[k * (count + 1)] = f64::from(u8::from(self.is_free(problem, first + k)));
        }
        self.factor.solve_reduced(layout, &rights)
    }

    /// Whether an unknown is neither fixed nor held.
    pub(super) fn is_free(&self, problem: &AnyProblem<'_>, unknown: usize) -> bool {
        problem.sd[unknown] != 0.0 && !self.held.contains(&unknown)
    }

    /// The cofactors f^T Q g of linear functions of the unknowns (a priori unit weight): a matrix row by row, of every two of `rows`, or
    /// of `rows` with `columns`. The same bits for any number of threads.
    ///
    /// # Errors
    /// More memory than there may be (None: any number of bytes); an interruption.
    pub fn cofactors(
        &self,
        problem: &AnyProblem<'_>,
        rows: &[Function],
        columns: Option<&[Function]>,
        memory: Option<usize>,
        threads: &Threads,
        between: Between<'_>,
    ) -> Result<Vec<f64>, CofactorError> {
        let unmoved = |functions: &[Function]| -> Vec<Function> {
            functions.iter().map(|function| self.unmoved(problem, function)).collect()
        };
        let (free, others) = (unmoved(rows), columns.map(unmoved));
        let system = &problem.system;
        let reduced = {
            let equations = self.equations(problem, threads);
            let prior = &self.prior;
            let reduced = system.reduce(threads, &equations, prior, &free, others.as_deref(), between);
            reduced.map_err(AdjustError::from)?
        };
        let needed = system.memory_of(&reduced);
        if let Some(available) = memory.filter(|&available| needed > available) {
            return Err(CofactorError::Memory { needed, available });
        }
        let matrix = system.cofactors_of(threads, &self.factor, &reduced, between);
        let mut matrix = matrix.map_err(AdjustError::from)?;
        if let Some(transformation) = &self.transformation {
            transformation.apply_to_functions(rows, columns, &mut matrix);
        }
        Ok(matrix)
    }

    /// The cofactors of every two of some unknowns; None where they would take more memory than there may be.
    pub(super) fn joint(
        &self,
        problem: &AnyProblem<'_>,
        unknowns: &[usize],
        memory: Option<usize>,
        threads: &Threads,
        between: Between<'_>,
    ) -> Result<Option<Vec<f64>>, AdjustError> {
        let rows: Vec<Function> =
            unknowns.iter().map(|&unknown| std::iter::once((unknown, 1.0)).collect()).collect();
        match self.cofactors(problem, &rows, None, memory, threads, between) {
            Ok(found) => Ok(Some(found)),
            Err(CofactorError::Memory { .. }) => Ok(None),
            Err(CofactorError::Adjust(error)) => Err(error),
        }
    }

    /// What a function takes of unknowns that are neither held nor fixed: the cofactors of others are zero in this datum.
    fn unmoved(&self, problem: &AnyProblem<'_>, function: &Function) -> Function {
        let stays = |unknown: usize| self.transformation.as_ref().is_some_and(|to| to.stays(unknown));
        let moves = |unknown: usize| self.is_free(problem, unknown) && !stays(unknown);
        function.iter().filter(|&&(unknown, _)| moves(unknown)).copied().collect()
    }

    /// Solves for right-hand sides over all unknowns, one after the other; so are the solutions.
    ///
    /// # Errors
    /// An interruption, no memory.
    pub fn solve_for(
        &self,
        problem: &AnyProblem<'_>,
        rights: &[f64],
        threads: &Threads,
        between: Between<'_>,
    ) -> Result<Vec<f64>, AdjustError> {
        let options = SolveOptions { rights: Some(rights), ..SolveOptions::default() };
        self.solve(&self.equations(problem, threads), &options, threads, between)
    }

    /// The step of all unknowns, or what else the options ask for.
    pub(super) fn solve(
        &self,
        equations: &ObservationEquations<'_>,
        options: &SolveOptions<'_>,
        threads: &Threads,
        between: Between<'_>,
    ) -> Result<Vec<f64>, AdjustError> {
        let Self { factor, prior, .. } = self;
        Ok(equations.problem().system.solve(threads, factor, equations, prior, options, between)?)
    }

    /// The selected inverse, in the datum that it was taken to.
    pub(super) fn invert(
        self,
        equations: &ObservationEquations<'_>,
        options: &InvertOptions<'_>,
        threads: &Threads,
        between: Between<'_>,
    ) -> Result<Inverted, AdjustError> {
        let (start, problem) = (Instant::now(), equations.problem());
        let Self { values, held, prior, factor, transformation, mut seconds, .. } = self;
        let found = problem.system.invert(threads, factor, equations, &prior, options, between);
        let Inversion { mut cofactors, selected, inversion_share } = found?;
        let prior_redundancy = problem.finish_cofactors(&mut cofactors, &held, &values);
        let lost = transformation
            .map(|transformation| threads.install(|| transformation.apply(problem.layout(), &mut cofactors)));
        let took = start.elapsed().as_secs_f64();
        (seconds.invert, seconds.cofactors) = (took * inversion_share, took * (1.0 - inversion_share));
        Ok(Inverted { values, held, cofactors, prior_redundancy, selected, lost, seconds })
    }

    /// Solves for the right-hand sides of its datum, where it has one: cofactors are then those in it.
    pub(super) fn take_to_datum(
        &mut self,
        equations: &ObservationEquations<'_>,
        threads: &Threads,
        between: Between<'_>,
    ) -> Result<(), AdjustError> {
        let Some(basis) = self.basis.take() else { return Ok(()) };
        let start = Instant::now();
        let rights = basis.rights(equations.problem(), &self.held);
        let options = SolveOptions { rights: Some(&rights), ..SolveOptions::default() };
        let columns = self.solve(equations, &options, threads, between)?;
        self.transformation = Some(basis.transformation(&columns));
        self.seconds.solve += start.elapsed().as_secs_f64();
        Ok(())
    }

    /// The observation equations again, as a loss has weighted them: it takes a pass over unknowns, and they are not kept.
    pub(super) fn equations<'a>(
        &self,
        problem: &'a AnyProblem<'a>,
        threads: &Threads,
    ) -> ObservationEquations<'a> {
        ObservationEquations::new(problem, self.reweighting, &self.values, &self.held, threads)
    }

    /// Gives its memory back for the next ones; its values.
    pub(super) fn recycle(self, problem: &AnyProblem<'_>) -> Vec<f64> {
        self.factor.recycle(&problem.system);
        self.values
    }
}
