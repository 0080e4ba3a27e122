//! The normal equations of a problem at given values of the unknowns, and what follows from them without adjusting.

use std::ops::ControlFlow;

use rayon::ThreadPool;

use super::problem::{Linearized, Model, Problem};
use super::result::{AdjustError, unless_stopped};
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
        let factor =
            unless_stopped(problem.system.factor_with(pool, &equations, &prior, &[], false, between))?;
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

    /// The same with all unknowns, how each combination moves them, and their diagonal elements of the normal equations.
    pub fn combinations(&self) -> Vec<Vec<(usize, f64, f64)>> {
        self.factor.deficiency().map_or(vec![], |found| found.combinations(self.problem.layout()))
    }

    /// The unknowns, none of them local, that no observation and no weight touches, ascending.
    pub fn without_effect(&self) -> Vec<usize> {
        self.factor.without_effect(self.problem.layout())
    }

    /// Natural logarithm of the determinant, the local unknowns reduced out; None where it is zero.
    pub fn log_determinant(&self) -> Option<f64> {
        self.factor.log_determinant()
    }

    /// Weighted sum of squares of the observations at these values; not finite where some cannot be computed.
    pub fn sum_of_squares(&self) -> f64 {
        self.factor.sum_of_squares
    }

    /// The corrections of the unknowns that are not local, in the order of the layout.
    pub fn corrections(&self) -> Vec<f64> {
        self.factor.reduced_corrections(self.problem.layout())
    }

    /// The cofactors of every two unknowns that are not local, in the order of the layout, row by row; zero for those that are fixed or
    /// held.
    pub fn cofactors(&self) -> Vec<f64> {
        let layout = self.problem.layout();
        let (first, count) = (layout.all_locals().end, layout.unknowns() - layout.all_locals().end);
        let mut rights = vec![0.0; count * count];
        for k in 0..count {
            // What is fixed or held stands in the normal equations by itself, with unit weight.
            let free = self.problem.sd[first + k] != 0.0 && !self.held.contains(&(first + k));
            rights[k * (count + 1)] = f64::from(u8::from(free));
        }
        self.factor.solve_reduced(layout, &rights)
    }

    /// a Q a^T of every two observations of some local blocks, in unit weight: for each block a square matrix, row by row, in the order of
    /// its groups and rows. One minus it is the cofactor matrix of their residuals: x and y of an image, all images of a point.
    ///
    /// One selected inverse serves all of them.
    ///
    /// # Errors
    /// An interruption, no memory.
    pub fn observation_blocks(
        self,
        locals: &[usize],
        between: &mut dyn FnMut(usize) -> ControlFlow<()>,
    ) -> Result<Vec<Vec<f64>>, AdjustError> {
        let Self { problem, pool, equations, prior, factor, .. } = self;
        let system = &problem.system;
        let selected = unless_stopped(system.invert(pool, factor, &equations, &prior, between))?.selected;
        let of =
            |&local: &usize| system.local_cofactors(&selected, &equations, &prior, &equations, local, &[]);
        Ok(locals.iter().map(|local| of(local).equations).collect())
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
}
