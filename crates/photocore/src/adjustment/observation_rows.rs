//! Sparse rows of unit weight for all observation equations.

use super::equations::ObservationEquations;
use super::problem::AnyProblem;
use crate::{Threads, parallel};

/// Equations a x = l of unit weight: groups and rows first, then ties and rows, then one equation per unknown as an observation of itself,
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
        let of_locals = problem.for_locals(threads, |buffers, local| {
            let mut found = Self::empty();
            equations.each_row(buffers, local, |row| found.push(row.taken(), row.constant));
            found
        });
        let mut all = Self::empty();
        of_locals.into_iter().for_each(|part| all.append(part));
        equations.each_row_of_ties(|_, row| all.push(row.taken(), row.constant));
        let terms = problem.terms(values);
        let fixed = problem.fixed(held);
        for unknown in 0..values.len() {
            let (row, constant) = terms.row(unknown);
            all.push(row.into_iter().filter(|&(column, _)| !fixed[column]), constant);
        }
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
        let of_locals = problem.for_locals(threads, |buffers, local| {
            let mut found = vec![];
            equations.each_row(buffers, local, |row| multiply(row.taken(), xs, &mut found));
            found
        });
        let mut all = of_locals.concat();
        equations.each_row_of_ties(|_, row| multiply(row.taken(), xs, &mut all));
        let (terms, fixed) = (problem.terms(values), problem.fixed(held));
        for unknown in 0..values.len() {
            let (row, _) = terms.row(unknown);
            multiply(row.into_iter().filter(|&(column, _)| !fixed[column]), xs, &mut all);
        }
        all
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

/// Appends the products of a row with each x.
fn multiply(row: impl Iterator<Item = (usize, f64)>, xs: &[Vec<f64>], found: &mut Vec<f64>) {
    let start = found.len();
    found.resize(start + xs.len(), 0.0);
    for (unknown, value) in row {
        found[start..].iter_mut().zip(xs).for_each(|(sum, x)| *sum += value * x[unknown]);
    }
}
