//! Linearized problem with factored normal equations, for steps, determinants, rank defects, solutions for any right-hand sides,
//! covariances of linear functions, and the selected inverse.

use std::time::Instant;

use thiserror::Error;

use super::datum::Basis;
use super::equations::ObservationEquations;
use super::loss::{Loss, Reweighting};
use super::problem::AnyProblem;
use super::result::{AdjustError, PhaseTimes, format_bytes};
use super::transformation::Transformation;
use crate::normals::{
    Cofactors, Factor, FactorOptions, Function, Inversion, InvertOptions, SelectedInverse, SolveOptions,
};
use crate::{Context, Threads};

/// Factored normal equations of a problem at given values, in the datum of the constrained unknowns or any other.
#[derive(Debug, Clone)]
pub struct Linearized {
    pub(super) values: Vec<f64>,
    pub(super) held: Vec<usize>,
    pub(super) reweighting: Option<Reweighting>,
    /// Factor of the normal equations.
    pub factor: Factor,
    /// Weighted sum of squares of observations and weighted unknowns at these values; not finite if an observation cannot be computed.
    pub sum_of_squares: f64,
    /// Datum for the cofactors.
    pub(super) basis: Option<Basis>,
    /// Transformation of cofactors to this datum.
    #[doc(hidden)]
    pub transformation: Option<Transformation>,
    /// Computing time so far.
    pub(super) seconds: PhaseTimes,
}

/// Selected inverse of the normal matrix of a problem at given values.
#[derive(Debug)]
pub struct Inverted {
    /// Linearization point.
    #[doc(hidden)]
    pub values: Vec<f64>,
    /// Constrained unknowns.
    #[doc(hidden)]
    pub held: Vec<usize>,
    pub(super) cofactors: Cofactors,
    /// Redundancy numbers of the unknowns as observations of themselves (zero unless weighted).
    pub(super) prior_redundancy: Vec<f64>,
    #[doc(hidden)]
    pub selected: SelectedInverse,
    /// Approximate relative rounding error of variances that were transformed to another datum. Large numbers cancel if the two datums are
    /// distant, or if a datum is weak.
    pub lost: Option<f64>,
    /// Computing time in total.
    pub(super) seconds: PhaseTimes,
}

/// Error of the computation of cofactors.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum CofactorError {
    /// The cofactors need more memory than allowed.
    #[error("these cofactors take {} of memory, and {} are free: ask for fewer at a time", format_bytes(*.needed), format_bytes(*.available))]
    Memory {
        /// Required bytes.
        needed: usize,
        /// Allowed bytes.
        available: usize,
    },
    /// Error of the adjustment.
    #[error(transparent)]
    Adjust(#[from] AdjustError),
}

impl Linearized {
    /// Forms and factors the normal equations at given values with some unknowns constrained; weights are modified by the loss.
    ///
    /// The caller must check whether all unknowns are determined.
    ///
    /// # Errors
    /// Lengths that contradict the layout, an interruption, or lack of memory.
    pub fn form(
        problem: &AnyProblem<'_>,
        loss: Option<Loss>,
        values: Vec<f64>,
        held: Vec<usize>,
        context: &mut Context<'_>,
    ) -> Result<Self, AdjustError> {
        problem.check_lengths(&values)?;
        let reweighting = loss.map(Reweighting::plain);
        let equations = ObservationEquations::new(problem, reweighting, &values, &held, context.threads);
        Self::of(&equations, values, held, &FactorOptions::UNCACHED, context)
    }

    /// Forms and factors given observation equations.
    #[doc(hidden)]
    pub fn of(
        equations: &ObservationEquations<'_>,
        values: Vec<f64>,
        held: Vec<usize>,
        options: &FactorOptions,
        context: &mut Context<'_>,
    ) -> Result<Self, AdjustError> {
        let (start, problem) = (Instant::now(), equations.problem());
        let factor = problem.system.factor(equations, options, context)?;
        let sum_of_squares = factor.sum_of_squares + equations.prior_terms().sum_of_squares(0..values.len());
        let (took, share) = (start.elapsed().as_secs_f64(), factor.formation_share);
        let seconds =
            PhaseTimes { form: took * share, factor: took * (1.0 - share), ..PhaseTimes::default() };
        Ok(Self {
            values,
            held,
            reweighting: equations.reweighting(),
            factor,
            sum_of_squares,
            basis: None,
            transformation: None,
            seconds,
        })
    }

    /// A copy of the factor for hypotheses, unless it is large.
    pub(super) fn small_factor(&self, threads: &Threads) -> Option<Factor> {
        self.factor.is_small().then(|| threads.install(|| self.factor.clone()))
    }

    /// A factor at the values of a negligible step later.
    pub(super) fn of_factor(factor: Factor, values: Vec<f64>, held: Vec<usize>) -> Self {
        Self {
            values,
            held,
            reweighting: None,
            sum_of_squares: factor.sum_of_squares,
            factor,
            basis: None,
            transformation: None,
            seconds: PhaseTimes::default(),
        }
    }

    /// Returns the linearization point.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Returns the constrained unknowns.
    pub fn held(&self) -> &[usize] {
        &self.held
    }

    /// Upper bound of the changes of all unknowns in a full step, in standard deviations.
    pub(super) fn change(&self) -> f64 {
        self.factor.decrease.sqrt()
    }

    /// Whether the second-order term of a loss is used.
    #[doc(hidden)]
    pub fn is_curved(&self) -> bool {
        self.reweighting.is_some_and(|reweighting| reweighting.curved)
    }

    /// Returns an error if the observations do not determine all unknowns.
    pub fn undetermined(&self) -> Option<AdjustError> {
        if !self.factor.deficient_locals.is_empty() {
            return Some(AdjustError::UndeterminedLocals(self.factor.deficient_locals.clone()));
        }
        self.factor.deficiency().map(|found| AdjustError::Undetermined(found.blocks()))
    }

    /// Returns itself if all unknowns are determined.
    ///
    /// # Errors
    /// Undetermined unknowns.
    pub fn determined(self) -> Result<Self, AdjustError> {
        self.undetermined().map_or(Ok(self), Err)
    }

    /// Returns undetermined combinations of retained unknowns: the unknowns in each, ascending.
    pub fn undetermined_unknowns(&self) -> Vec<Vec<usize>> {
        self.factor.deficiency().map_or(vec![], |found| found.unknowns())
    }

    /// Returns undetermined combinations of all unknowns, with components and diagonal elements of the normal equations.
    pub fn combinations(&self) -> Vec<Vec<(usize, f64, f64)>> {
        self.factor.deficiency().map_or(vec![], |found| found.combinations())
    }

    /// Whether an unknown is neither fixed nor constrained.
    #[doc(hidden)]
    pub fn is_free(&self, problem: &AnyProblem<'_>, unknown: usize) -> bool {
        problem.sd[unknown] != 0.0 && !self.held.contains(&unknown)
    }

    /// Computes the cofactors f^T Q g of linear functions of the unknowns (a priori unit weight), row by row: of all pairs in `rows`, or of
    /// `rows` with `columns`. Bitwise identical for any number of threads.
    ///
    /// # Errors
    /// More memory than allowed (None: unlimited), or an interruption.
    pub fn cofactors(
        &self,
        problem: &AnyProblem<'_>,
        rows: &[Function],
        columns: Option<&[Function]>,
        memory: Option<usize>,
        context: &mut Context<'_>,
    ) -> Result<Vec<f64>, CofactorError> {
        let unmoved = |functions: &[Function]| -> Vec<Function> {
            functions.iter().map(|function| self.unmoved(problem, function)).collect()
        };
        let (free, others) = (unmoved(rows), columns.map(unmoved));
        let reduced = {
            let equations = self.equations(problem, context.threads);
            let reduced = self.factor.reduce(&equations, &free, others.as_deref(), context);
            reduced.map_err(AdjustError::from)?
        };
        let needed = self.factor.memory_of(&reduced);
        if let Some(available) = memory.filter(|&available| needed > available) {
            return Err(CofactorError::Memory { needed, available });
        }
        let matrix = self.factor.cofactors_of(&reduced, context);
        let mut matrix = matrix.map_err(AdjustError::from)?;
        if let Some(transformation) = &self.transformation {
            transformation.apply_to_functions(rows, columns, &mut matrix);
        }
        Ok(matrix)
    }

    /// Computes the cofactors of all pairs of some unknowns, row by row; None if they need more memory than allowed. The cofactors of fixed or
    /// constrained unknowns are zero.
    ///
    /// # Errors
    /// Interruption or lack of memory.
    pub fn joint(
        &self,
        problem: &AnyProblem<'_>,
        unknowns: &[usize],
        memory: Option<usize>,
        context: &mut Context<'_>,
    ) -> Result<Option<Vec<f64>>, AdjustError> {
        let rows: Vec<Function> =
            unknowns.iter().map(|&unknown| std::iter::once((unknown, 1.0)).collect()).collect();
        match self.cofactors(problem, &rows, None, memory, context) {
            Ok(found) => Ok(Some(found)),
            Err(CofactorError::Memory { .. }) => Ok(None),
            Err(CofactorError::Adjust(error)) => Err(error),
        }
    }

    /// Removes fixed and constrained unknowns from a function: their cofactors are zero in this datum.
    fn unmoved(&self, problem: &AnyProblem<'_>, function: &Function) -> Function {
        let stays = |unknown: usize| self.transformation.as_ref().is_some_and(|to| to.stays(unknown));
        let moves = |unknown: usize| self.is_free(problem, unknown) && !stays(unknown);
        function.iter().filter(|&&(unknown, _)| moves(unknown)).copied().collect()
    }

    /// Solves for right-hand sides over all unknowns, one after the other; returns solutions in the same form.
    ///
    /// # Errors
    /// Interruption or lack of memory.
    pub fn solve_for(
        &self,
        problem: &AnyProblem<'_>,
        rights: &[f64],
        context: &mut Context<'_>,
    ) -> Result<Vec<f64>, AdjustError> {
        let options = SolveOptions { rights: Some(rights), ..SolveOptions::default() };
        self.solve(&self.equations(problem, context.threads), &options, context)
    }

    /// Computes R z for columns z over the equations of [`AnyProblem::equations`], one after the other: the residuals caused by errors z, in
    /// standard deviations. Bitwise identical for any number of threads; independent of the datum.
    ///
    /// # Errors
    /// Interruption or lack of memory.
    pub fn project(
        &self,
        problem: &AnyProblem<'_>,
        mut columns: Vec<f64>,
        context: &mut Context<'_>,
    ) -> Result<Vec<f64>, AdjustError> {
        let equations = self.equations(problem, context.threads);
        let (height, unknowns) = (problem.equations().max(1), problem.layout().unknowns().max(1));
        let count = columns.len() / height;
        let rights = equations.transposed(context.threads, count, |row, z| {
            z.iter_mut().zip(columns.chunks_exact(height)).for_each(|(z, column)| *z = column[row.number]);
        });
        let options = SolveOptions { rights: Some(&rights), ..SolveOptions::default() };
        let solutions = self.solve(&equations, &options, context)?;
        drop(rights);
        let solutions: Vec<&[f64]> = solutions.chunks_exact(unknowns).collect();
        let changes = equations.times(context.threads, &solutions);
        for (row, changes) in changes.chunks_exact(count.max(1)).enumerate() {
            for (column, change) in columns.chunks_exact_mut(height).zip(changes) {
                column[row] -= change;
            }
        }
        Ok(columns)
    }

    /// Returns a flag per equation of [`AnyProblem::equations`]: for unknowns, whether they are weighted and not constrained.
    pub fn is_equation(&self, problem: &AnyProblem<'_>) -> Vec<bool> {
        let mut found = vec![true; problem.observation_sd.len()];
        found.extend((0..problem.sd.len()).map(|i| problem.is_weighted(i) && !self.held.contains(&i)));
        found
    }

    /// Computes the step of all unknowns, or solves for the right-hand sides in the options.
    #[doc(hidden)]
    pub fn solve(
        &self,
        equations: &ObservationEquations<'_>,
        options: &SolveOptions<'_>,
        context: &mut Context<'_>,
    ) -> Result<Vec<f64>, AdjustError> {
        Ok(self.factor.solve(equations, options, context)?)
    }

    /// Computes the selected inverse in the requested datum.
    #[doc(hidden)]
    pub fn invert(
        self,
        equations: &ObservationEquations<'_>,
        options: &InvertOptions<'_>,
        context: &mut Context<'_>,
    ) -> Result<Inverted, AdjustError> {
        let (start, problem) = (Instant::now(), equations.problem());
        let Self { values, held, factor, transformation, mut seconds, .. } = self;
        let found = factor.invert(equations, options, context);
        let Inversion { mut cofactors, selected, inversion_share } = found?;
        let prior_redundancy = problem.finish_cofactors(&mut cofactors, &held, equations.prior_terms());
        let lost = transformation.map(|transformation| {
            context.threads.install(|| transformation.apply(problem.layout(), &mut cofactors))
        });
        let took = start.elapsed().as_secs_f64();
        (seconds.invert, seconds.cofactors) = (took * inversion_share, took * (1.0 - inversion_share));
        Ok(Inverted { values, held, cofactors, prior_redundancy, selected, lost, seconds })
    }

    /// Solves for the right-hand sides of the requested datum, if any, so that cofactors refer to it.
    pub(super) fn take_to_datum(
        &mut self,
        equations: &ObservationEquations<'_>,
        context: &mut Context<'_>,
    ) -> Result<(), AdjustError> {
        let Some(basis) = self.basis.take() else { return Ok(()) };
        let start = Instant::now();
        let rights = basis.rights(equations.problem(), &self.held);
        let options = SolveOptions { rights: Some(&rights), ..SolveOptions::default() };
        let columns = self.solve(equations, &options, context)?;
        self.transformation = Some(basis.transformation(&columns));
        self.seconds.solve += start.elapsed().as_secs_f64();
        Ok(())
    }

    /// Returns the observation equations again, reweighted by the loss: one pass over the unknowns instead of storage.
    #[doc(hidden)]
    pub fn equations<'a>(&self, problem: &'a AnyProblem<'a>, threads: &Threads) -> ObservationEquations<'a> {
        ObservationEquations::new(problem, self.reweighting, &self.values, &self.held, threads)
    }

    /// Releases its memory for the next linearization and returns its values.
    pub(super) fn recycle(self) -> Vec<f64> {
        self.factor.recycle();
        self.values
    }
}
