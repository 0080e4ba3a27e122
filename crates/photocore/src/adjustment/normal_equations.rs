//! The normal equations of a problem at given values of the unknowns, and what follows from them without adjusting.

use std::ops::ControlFlow;

use rayon::ThreadPool;

use super::problem::{Linearized, Model, Problem};
use super::result::AdjustError;
use super::run::unless_stopped;
use crate::normals::{Factor, Prior};

/// The normal equations of a problem at given values, factored.
pub struct NormalEquations<'a, M: Model> {
    problem: &'a Problem<M>,
    held: &'a [usize],
    pool: &'a ThreadPool,
    equations: Linearized<'a, M>,
    prior: Prior,
    factor: Factor,
}

impl<'a, M: Model> NormalEquations<'a, M> {
    /// Forms and factors the normal equations at the given values of the unknowns, some of them held there.
    ///
    /// Whether everything is determined is for the caller to ask.
    ///
    /// # Errors
    /// An interruption, no memory.
    pub fn form(
        problem: &'a Problem<M>,
        values: &[f64],
        held: &'a [usize],
        pool: &'a ThreadPool,
        between: &mut dyn FnMut(usize) -> ControlFlow<()>,
    ) -> Result<Self, AdjustError> {
        let equations = pool.install(|| Linearized::new(problem, values, held, None));
        let prior = problem.prior_equations(values, held);
        let factor = unless_stopped(problem.system.factor(pool, &equations, &prior, 0.0, between))?;
        Ok(Self { problem, held, pool, equations, prior, factor })
    }

    /// Local blocks that their observations do not determine, ascending.
    pub fn undetermined_locals(&self) -> &[usize] {
        &self.factor.deficient_locals
    }

    /// Combinations of unknowns, none of them local, that the observations do not determine: for each the unknowns that take part in
    /// it, ascending.
    pub fn undetermined(&self) -> Vec<Vec<usize>> {
        self.factor.deficiency().map_or(vec![], |found| found.unknowns(self.problem.layout()))
    }

    /// The unknowns, none of them local, that no observation and no weight touches, ascending.
    pub fn without_effect(&self) -> Vec<usize> {
        self.factor.without_effect(self.problem.layout())
    }

    /// Natural logarithm of the determinant, the local unknowns reduced out; None where it is zero.
    pub fn log_determinant(&self) -> Option<f64> {
        self.factor.log_determinant()
    }

    /// The corrections of all unknowns.
    ///
    /// # Errors
    /// An interruption, no memory.
    pub fn corrections(
        &self,
        between: &mut dyn FnMut(usize) -> ControlFlow<()>,
    ) -> Result<Vec<f64>, AdjustError> {
        let Self { problem, pool, equations, prior, factor, .. } = self;
        unless_stopped(problem.system.solve(pool, factor, equations, prior, 0.0, between))
    }

    /// Solves for other right-hand sides, each over all unknowns, one after the other; so are the solutions.
    ///
    /// # Errors
    /// An interruption, no memory.
    pub fn solve_for(
        &self,
        rights: &[f64],
        between: &mut dyn FnMut(usize) -> ControlFlow<()>,
    ) -> Result<Vec<f64>, AdjustError> {
        let Self { problem, pool, equations, prior, factor, .. } = self;
        unless_stopped(problem.system.solve_for(pool, factor, equations, prior, 0.0, rights, between))
    }

    /// The cofactors of every two of the given unknowns, row by row; zero for those that are fixed or held.
    ///
    /// # Errors
    /// An interruption, no memory.
    pub fn cofactors(
        &self,
        unknowns: &[usize],
        between: &mut dyn FnMut(usize) -> ControlFlow<()>,
    ) -> Result<Vec<f64>, AdjustError> {
        let count = self.problem.layout().unknowns();
        let mut rights = vec![0.0; count * unknowns.len()];
        for (column, &unknown) in unknowns.iter().enumerate() {
            // What is fixed or held stands in the normal equations by itself, with unit weight.
            if self.problem.sd[unknown] != 0.0 && !self.held.contains(&unknown) {
                rights[column * count + unknown] = 1.0;
            }
        }
        let columns = self.solve_for(&rights, between)?;
        Ok(columns.chunks_exact(count).flat_map(|column| unknowns.iter().map(|&row| column[row])).collect())
    }
}
