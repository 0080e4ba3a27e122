//! The equations of a tie in the front that it goes to.

use super::equations::{Equations, TieRows};
use super::system::System;

/// The equations of one tie, their columns in the order of the front of its node.
#[derive(Debug, Default)]
pub(super) struct TieEquations {
    constant: Vec<f64>,
    coefficients: Vec<f64>,
    columns: Vec<usize>,
    /// The coefficients as they are written, and where the column of each stands among `columns`.
    written: Vec<f64>,
    order: Vec<usize>,
}

impl TieEquations {
    /// Gathers the equations of a tie that is assembled in supernode `node`.
    pub fn gather(&mut self, system: &System, equations: &dyn Equations, node: usize, tie: usize) {
        let layout = &system.layout;
        self.place(system, node, tie);
        let (rows, width) = (layout.ties()[tie].rows, self.columns.len());
        self.constant.resize(rows, 0.0);
        self.written.resize(rows * width, 0.0);
        self.coefficients.resize(rows * width, 0.0);
        let mut written = TieRows { constant: &mut self.constant, coefficients: &mut self.written };
        equations.write_tie(tie, &mut written);
        let rows = self.written.chunks_exact(width).zip(self.coefficients.chunks_exact_mut(width));
        for (written, sorted) in rows {
            self.order.iter().zip(written).for_each(|(&to, &value)| sorted[to] = value);
        }
    }

    /// Finds the columns in the front.
    fn place(&mut self, system: &System, node: usize, tie: usize) {
        let (layout, symbolic) = (&system.layout, &*system.symbolic);
        let each = &layout.ties()[tie];
        let mut columns = Vec::new();
        for &block in &each.retained {
            let position = symbolic.position(block as usize);
            let row = symbolic.row_of(node, position);
            columns.extend(row..row + symbolic.dim(position));
        }
        self.columns.clone_from(&columns);
        self.columns.sort_unstable();
        self.order.clear();
        self.order.extend(columns.iter().map(|column| self.columns.partition_point(|other| other < column)));
    }

    /// The columns of the front, ascending.
    pub fn columns(&self) -> &[usize] {
        &self.columns
    }

    /// Coefficients in the order of the columns, and right-hand side, of each equation.
    pub fn rows(&self) -> impl Iterator<Item = (&[f64], f64)> {
        self.coefficients.chunks_exact(self.columns.len()).zip(self.constant.iter().copied())
    }
}
