//! Sparse rows of unit weight for all observation equations.

use super::equations::{ObservationEquations, Row};
use super::problem::AnyProblem;
use super::walk::Buffers;
use crate::{Threads, parallel};

/// Equations a x = l of unit weight: groups and rows first, then terms and rows, then one equation per unknown as an observation of itself,
/// empty unless weighted.
#[derive(Debug)]
pub struct ObservationRows {
    starts: Vec<usize>,
    unknowns: Vec<u32>,
    coefficients: Vec<f64>,
    constants: Vec<f64>,
}

impl ObservationRows {
    /// Creates the rows at given values, without columns of fixed or constrained unknowns.
    pub fn new(problem: &AnyProblem<'_>, values: &[f64], held: &[usize], threads: &Threads) -> Self {
        let equations = ObservationEquations::new(problem, None, values, held, threads);
        let add = |found: &mut Self, row: &Row<'_>| found.push(row.entries(), row.constant);
        let mut all = Self::empty();
        equations.fold_rows(threads, Self::empty, add).into_iter().for_each(|part| all.append(part));
        equations.each_prior(&mut Buffers::default(), 0..values.len(), |row| {
            all.starts.resize(row.number + 1, all.unknowns.len());
            all.constants.resize(row.number, 0.0);
            add(&mut all, row);
        });
        all.starts.resize(problem.equations() + 1, all.unknowns.len());
        all.constants.resize(problem.equations(), 0.0);
        all
    }

    /// Computes A x for several x without storing the rows; the result has one number per x for each row, in order.
    pub fn products(
        problem: &AnyProblem<'_>,
        values: &[f64],
        held: &[usize],
        xs: &[Vec<f64>],
        threads: &Threads,
    ) -> Vec<f64> {
        let equations = ObservationEquations::new(problem, None, values, held, threads);
        let xs: Vec<&[f64]> = xs.iter().map(Vec::as_slice).collect();
        equations.times(threads, &xs)
    }

    fn empty() -> Self {
        Self { starts: vec![0], unknowns: vec![], coefficients: vec![], constants: vec![] }
    }

    fn push(&mut self, row: impl Iterator<Item = (usize, f64)>, constant: f64) {
        for (unknown, value) in row.filter(|&(_, value)| value != 0.0) {
            self.unknowns.push(unknown as u32);
            self.coefficients.push(value);
        }
        self.starts.push(self.unknowns.len());
        self.constants.push(constant);
    }

    fn append(&mut self, part: Self) {
        let first = self.unknowns.len();
        self.starts.extend(part.starts[1..].iter().map(|start| first + start));
        self.unknowns.extend(part.unknowns);
        self.coefficients.extend(part.coefficients);
        self.constants.extend(part.constants);
    }

    /// Returns the misclosures (observed minus computed) of all rows.
    pub fn constants(&self) -> &[f64] {
        &self.constants
    }

    /// Returns the unknowns of a row, with their coefficients.
    pub fn row(&self, row: usize) -> impl Iterator<Item = (usize, f64)> {
        let range = self.starts[row]..self.starts[row + 1];
        self.unknowns[range.clone()]
            .iter()
            .zip(&self.coefficients[range])
            .map(|(&i, &value)| (i as usize, value))
    }

    /// Computes A x for some rows.
    pub fn times(&self, rows: &[usize], x: &[f64], threads: &Threads) -> Vec<f64> {
        let product = |&row: &usize| self.row(row).map(|(unknown, value)| value * x[unknown]).sum::<f64>();
        threads.install(|| parallel::map(rows.len(), 1024, |k| product(&rows[k])))
    }

    /// Returns one row as a right-hand side A^T e over all unknowns.
    pub fn right(&self, row: usize, unknowns: usize) -> Vec<f64> {
        let mut right = vec![0.0; unknowns];
        self.row(row).for_each(|(unknown, value)| right[unknown] += value);
        right
    }
}
