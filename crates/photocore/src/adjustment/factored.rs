//! The normal equations at adjusted values, factored once for any number of questions: covariances of anything with anything.

use std::ops::ControlFlow;
use std::time::Instant;

use rayon::ThreadPool;
use thiserror::Error;

use super::loss::{Loss, Reweighting};
use super::problem::{Linearized, Model, Problem};
use super::result::{AdjustError, Seconds, gib, unless_stopped};
use super::transformation::Transformation;
use crate::normals::{Factor, Function, Inversion, Prior};

/// The normal equations of a problem at adjusted values, factored, in the datum of the unknowns that are held or in any other.
#[derive(Debug)]
pub struct Factored {
    pub(super) values: Vec<f64>,
    pub(super) held: Vec<usize>,
    pub(super) loss: Option<Loss>,
    prior: Prior,
    factor: Factor,
    pub(super) transformation: Option<Transformation>,
    /// What forming and factoring have taken.
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

impl Factored {
    /// Forms and factors the normal equations at adjusted values, some unknowns held there; weights are those that the loss has left.
    ///
    /// # Errors
    /// Unknowns that are not determined, an interruption, no memory.
    pub fn form<M: Model>(
        problem: &Problem<M>,
        loss: Option<Loss>,
        values: Vec<f64>,
        held: Vec<usize>,
        pool: &ThreadPool,
        between: &mut dyn FnMut(usize) -> ControlFlow<()>,
    ) -> Result<Self, AdjustError> {
        Self::form_with(problem, loss, values, held, &[], pool, between)
    }

    /// The same with right-hand sides over all unknowns that are to be solved for, one after the other.
    pub(super) fn form_with<M: Model>(
        problem: &Problem<M>,
        loss: Option<Loss>,
        values: Vec<f64>,
        held: Vec<usize>,
        rights: &[f64],
        pool: &ThreadPool,
        between: &mut dyn FnMut(usize) -> ControlFlow<()>,
    ) -> Result<Self, AdjustError> {
        let start = Instant::now();
        let prior = problem.prior_equations(&values, &held);
        let factor = {
            let equations = linearized(problem, loss, &values, &held, pool);
            unless_stopped(problem.system.factor_with(pool, &equations, &prior, rights, false, between))?
        };
        if !factor.deficient_locals.is_empty() {
            return Err(AdjustError::UndeterminedLocals(factor.deficient_locals.clone()));
        }
        if let Some(deficiency) = factor.deficiency() {
            return Err(AdjustError::Undetermined(deficiency.blocks()));
        }
        let took = start.elapsed().as_secs_f64();
        let (form, factored) = (took * factor.formation_share, took * (1.0 - factor.formation_share));
        let seconds = Seconds { form, factor: factored, ..Seconds::default() };
        Ok(Self { values, held, loss, prior, factor, transformation: None, seconds })
    }

    /// The values that the equations are of.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The cofactors f^T Q g of linear functions of the unknowns (a priori unit weight): a matrix row by row, of every two of `rows`, or
    /// of `rows` with `columns`. The same bits for any number of threads.
    ///
    /// # Errors
    /// More memory than there may be (None: any number of bytes); an interruption.
    pub fn cofactors<M: Model>(
        &self,
        problem: &Problem<M>,
        rows: &[Function],
        columns: Option<&[Function]>,
        memory: Option<usize>,
        pool: &ThreadPool,
        between: &mut dyn FnMut(usize) -> ControlFlow<()>,
    ) -> Result<Vec<f64>, CofactorError> {
        let unmoved = |functions: &[Function]| -> Vec<Function> {
            functions.iter().map(|function| self.unmoved(problem, function)).collect()
        };
        let (free, others) = (unmoved(rows), columns.map(unmoved));
        let system = &problem.system;
        let reduced = {
            let equations = linearized(problem, self.loss, &self.values, &self.held, pool);
            unless_stopped(system.reduce(pool, &equations, &self.prior, &free, others.as_deref(), between))?
        };
        let needed = system.memory_of(&reduced);
        if let Some(available) = memory.filter(|&available| needed > available) {
            return Err(CofactorError::Memory { needed, available });
        }
        let mut matrix = unless_stopped(system.cofactors_of(pool, &self.factor, &reduced, between))?;
        if let Some(transformation) = &self.transformation {
            transformation.apply_to_functions(rows, columns, &mut matrix);
        }
        Ok(matrix)
    }

    /// What a function takes of unknowns that are neither held nor fixed: the cofactors of others are zero in this datum.
    fn unmoved<M>(&self, problem: &Problem<M>, function: &Function) -> Function {
        let free = |unknown: usize| problem.sd[unknown] != 0.0 && !self.held.contains(&unknown);
        let stays = |unknown: usize| self.transformation.as_ref().is_some_and(|to| to.stays(unknown));
        function.iter().filter(|&&(unknown, _)| free(unknown) && !stays(unknown)).copied().collect()
    }

    /// Solves for right-hand sides over all unknowns, one after the other; so are the solutions.
    ///
    /// # Errors
    /// An interruption, no memory.
    pub fn solve_for<M: Model>(
        &self,
        problem: &Problem<M>,
        rights: &[f64],
        pool: &ThreadPool,
        between: &mut dyn FnMut(usize) -> ControlFlow<()>,
    ) -> Result<Vec<f64>, AdjustError> {
        let equations = linearized(problem, self.loss, &self.values, &self.held, pool);
        let system = &problem.system;
        unless_stopped(system.solve_for(pool, &self.factor, &equations, &self.prior, 0.0, rights, between))
    }

    /// Solves for the right-hand sides that it was formed with: the solutions, one after the other.
    pub(super) fn solve_further<M: Model>(
        &self,
        problem: &Problem<M>,
        rights: &[f64],
        pool: &ThreadPool,
        between: &mut dyn FnMut(usize) -> ControlFlow<()>,
    ) -> Result<Vec<f64>, AdjustError> {
        let equations = linearized(problem, self.loss, &self.values, &self.held, pool);
        let system = &problem.system;
        unless_stopped(system.solve_further(pool, &self.factor, &equations, &self.prior, rights, between))
    }

    /// The selected inverse in the datum of what is held, the redundancy numbers of the unknowns as observations of themselves, and the
    /// solutions for the right-hand sides that it was formed with.
    pub(super) fn invert<M: Model>(
        self,
        problem: &Problem<M>,
        rights: &[f64],
        pool: &ThreadPool,
        between: &mut dyn FnMut(usize) -> ControlFlow<()>,
    ) -> Result<(Inversion, Vec<f64>), AdjustError> {
        let equations = linearized(problem, self.loss, &self.values, &self.held, pool);
        let system = &problem.system;
        let found = system.invert_with(pool, self.factor, &equations, &self.prior, rights, between);
        let mut found = unless_stopped(found)?;
        let redundancy = problem.finish_cofactors(&mut found.cofactors, &self.held, &self.values);
        Ok((found, redundancy))
    }
}

/// The equations at some values: it takes a pass over unknowns, and is not kept.
pub(super) fn linearized<'a, M: Model>(
    problem: &'a Problem<M>,
    loss: Option<Loss>,
    values: &[f64],
    held: &[usize],
    pool: &ThreadPool,
) -> Linearized<'a, M> {
    let reweighting = loss.map(|loss| Reweighting { loss, curved: false });
    pool.install(|| Linearized::new(problem, values, held, reweighting))
}
