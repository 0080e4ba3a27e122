//! Effect of observation errors on residuals: products with R = I - A Q A^T, with equations A in unit weight.

use super::linearized::Linearized;
use super::problem::{AnyProblem, Problem};
use super::result::AdjustError;
use crate::Threads;
use crate::normals::{Between, SolveOptions};

impl<M: ?Sized> Problem<M> {
    /// Number of equations: rows of groups and of ties, then one per unknown as an observation of itself, which is empty unless weighted.
    pub fn equations(&self) -> usize {
        self.observation_sd.len() + self.sd.len()
    }
}

impl Linearized {
    /// Computes R z for columns z over the equations of [`Problem::equations`], one after the other: the residuals caused by errors z, in
    /// standard deviations. Bitwise identical for any number of threads; independent of the datum.
    ///
    /// # Errors
    /// Interruption or lack of memory.
    pub fn project(
        &self,
        problem: &AnyProblem<'_>,
        mut columns: Vec<f64>,
        threads: &Threads,
        between: Between<'_>,
    ) -> Result<Vec<f64>, AdjustError> {
        let (equations, terms) = (self.equations(problem, threads), problem.terms(&self.values));
        let (height, unknowns) = (problem.equations().max(1), problem.layout().unknowns().max(1));
        let count = columns.len() / height;
        let mut rights = equations.transposed(threads, count, |row, z| {
            z.iter_mut().zip(columns.chunks_exact(height)).for_each(|(z, column)| *z = column[row.number]);
        });
        equations.each_prior(&terms, 0..problem.sd.len(), |_, row| {
            for (right, z) in rights.chunks_exact_mut(unknowns).zip(columns.chunks_exact(height)) {
                row.taken().for_each(|(unknown, value)| right[unknown] += value * z[row.number]);
            }
        });
        let options = SolveOptions { rights: Some(&rights), ..SolveOptions::default() };
        let solutions = self.solve(&equations, &options, threads, between)?;
        drop(rights);
        let solutions: Vec<&[f64]> = solutions.chunks_exact(unknowns).collect();
        let changes = equations.times(threads, &terms, &solutions);
        for (row, changes) in changes.chunks_exact(count.max(1)).enumerate() {
            for (column, change) in columns.chunks_exact_mut(height).zip(changes) {
                column[row] -= change;
            }
        }
        Ok(columns)
    }

    /// Returns a flag per equation of [`Problem::equations`]: for unknowns, whether they are weighted and not constrained.
    pub fn is_equation(&self, problem: &AnyProblem<'_>) -> Vec<bool> {
        let mut found = vec![true; problem.observation_sd.len()];
        found.extend((0..problem.sd.len()).map(|i| problem.is_weighted(i) && !self.held.contains(&i)));
        found
    }
}
