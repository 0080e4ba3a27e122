//! Effect of observation errors on residuals: products with R = I - A Q A^T, with equations A in unit weight.

use std::ops::Range;

use super::equations::ObservationEquations;
use super::linearized::Linearized;
use super::problem::{AnyProblem, Problem};
use super::result::AdjustError;
use super::walk::Buffers;
use crate::normals::{Between, SolveOptions};
use crate::{Threads, parallel};

/// Number of parts of the loop over local blocks, for sums that are independent of the number of threads.
const PARTS: usize = 16;

/// Unknowns of an equation with their coefficients.
type ProjectedRow = Vec<(usize, f64)>;

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
        let rows = ProjectionRows::new(self, problem, threads);
        let rights = threads.install(|| rows.transposed(&columns));
        let options = SolveOptions { rights: Some(&rights), ..SolveOptions::default() };
        let solutions = self.solve(&rows.equations, &options, threads, between)?;
        drop(rights);
        threads.install(|| rows.subtract(&solutions, &mut columns));
        Ok(columns)
    }

    /// Returns a flag per equation of [`Problem::equations`]: for unknowns, whether they are weighted and not constrained.
    pub fn is_equation(&self, problem: &AnyProblem<'_>) -> Vec<bool> {
        let mut found = vec![true; problem.observation_sd.len()];
        found.extend((0..problem.sd.len()).map(|i| problem.is_weighted(i) && !self.held.contains(&i)));
        found
    }
}

/// Equations at adjusted values, in unit weight.
struct ProjectionRows<'a> {
    problem: &'a AnyProblem<'a>,
    equations: ObservationEquations<'a>,
    values: &'a [f64],
    /// Flags of fixed or constrained unknowns.
    fixed: Vec<bool>,
}

impl<'a> ProjectionRows<'a> {
    fn new(linearized: &'a Linearized, problem: &'a AnyProblem<'a>, threads: &Threads) -> Self {
        let Linearized { values, held, .. } = linearized;
        let equations = linearized.equations(problem, threads);
        Self { problem, equations, values, fixed: problem.fixed(held) }
    }

    /// Returns the local blocks of a part.
    fn locals(&self, part: usize) -> Range<usize> {
        let locals = self.problem.layout().locals();
        part * locals / PARTS..(part + 1) * locals / PARTS
    }

    /// Returns A^T z for every column, over all unknowns.
    fn transposed(&self, columns: &[f64]) -> Vec<f64> {
        let (layout, height) = (self.problem.layout(), self.problem.equations());
        let (unknowns, others) = (layout.unknowns(), layout.all_locals().end);
        let count = columns.len() / height.max(1);
        let part = |part: usize| {
            let locals = self.locals(part);
            let (first, width) = (layout.local_dim() * locals.start, layout.local_dim() * locals.len());
            let mut own = vec![0.0; count * width];
            let mut shared = vec![0.0; count * (unknowns - others)];
            self.each_row_of(locals, |row, taken| {
                for (column, z) in columns.chunks_exact(height).map(|all| all[row]).enumerate() {
                    for &(unknown, value) in taken.iter().filter(|_| z != 0.0) {
                        match unknown.checked_sub(others) {
                            None => own[column * width + unknown - first] += value * z,
                            Some(other) => shared[column * (unknowns - others) + other] += value * z,
                        }
                    }
                }
            });
            (first, width, own, shared)
        };
        let parts: Vec<_> = parallel::map(PARTS, 1, part);
        let mut rights = vec![0.0; count * unknowns];
        for (first, width, own, shared) in parts {
            for (column, right) in rights.chunks_exact_mut(unknowns.max(1)).enumerate() {
                right[first..first + width].copy_from_slice(&own[column * width..][..width]);
                let sums = &shared[column * (unknowns - others)..][..unknowns - others];
                right[others..].iter_mut().zip(sums).for_each(|(right, sum)| *right += sum);
            }
        }
        self.each_other_row(|row, taken| {
            for (right, z) in rights.chunks_exact_mut(unknowns).zip(columns.chunks_exact(height)) {
                taken.iter().for_each(|&(unknown, value)| right[unknown] += value * z[row]);
            }
        });
        rights
    }

    /// Computes z - A x for every column.
    fn subtract(&self, solutions: &[f64], columns: &mut [f64]) {
        let (unknowns, height) = (self.problem.layout().unknowns().max(1), self.problem.equations());
        let along = |taken: &ProjectedRow, x: &[f64]| {
            taken.iter().map(|&(unknown, value)| value * x[unknown]).sum::<f64>()
        };
        let part = |part: usize| {
            let mut found = Vec::new();
            self.each_row_of(self.locals(part), |_, taken| {
                found.extend(solutions.chunks_exact(unknowns).map(|x| along(taken, x)));
            });
            found
        };
        let parts: Vec<Vec<f64>> = parallel::map(PARTS, 1, part);
        let count = solutions.len() / unknowns;
        for (row, products) in parts.iter().flat_map(|part| part.chunks_exact(count.max(1))).enumerate() {
            products
                .iter()
                .enumerate()
                .for_each(|(column, product)| columns[column * height + row] -= product);
        }
        self.each_other_row(|row, taken| {
            for (column, x) in columns.chunks_exact_mut(height).zip(solutions.chunks_exact(unknowns)) {
                column[row] -= along(taken, x);
            }
        });
    }

    /// Calls `take` with the index and the unknowns of each row of some local blocks.
    fn each_row_of(&self, locals: Range<usize>, mut take: impl FnMut(usize, &ProjectedRow)) {
        let (mut buffers, mut taken) = (Buffers::default(), ProjectedRow::new());
        for local in locals {
            self.equations.each_row(&mut buffers, local, |row| {
                taken.clear();
                taken.extend(row.taken());
                take(row.number, &taken);
            });
        }
    }

    /// Calls `take` with the rows of ties and priors.
    fn each_other_row(&self, mut take: impl FnMut(usize, &ProjectedRow)) {
        self.equations.each_row_of_ties(|_, row| take(row.number, &row.taken().collect()));
        let (problem, first) = (self.problem, self.problem.observation_sd.len());
        problem.terms(self.values).each_row(|unknown, row, _| {
            take(first + unknown, &row.filter(|&(other, _)| !self.fixed[other]).collect());
        });
    }
}
