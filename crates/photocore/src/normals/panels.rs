//! Block-sparse symmetric matrices, stored as the dense panels of a [`Symbolic`] pattern.

use std::sync::Arc;

use super::symbolic::Symbolic;

/// The lower triangle of a symmetric matrix in the pattern of a factor: one column-major panel for each supernode.
/// The strict upper triangle of a panel's own blocks carries no meaning.
#[derive(Debug, Clone)]
pub(crate) struct Panels {
    pub symbolic: Arc<Symbolic>,
    pub values: Vec<f64>,
}

impl Panels {
    pub fn zeros(symbolic: Arc<Symbolic>) -> Self {
        let values = vec![0.0; symbolic.values()];
        Self { symbolic, values }
    }

    /// Multiplies row and column i by `scale[i]` (in the order of elimination).
    pub fn scale(&mut self, scale: &[f64]) {
        let symbolic = Arc::clone(&self.symbolic);
        for (index, supernode) in symbolic.supernodes().iter().enumerate() {
            let first = symbolic.first_unknown(index);
            let mut factors = scale[first..first + supernode.width].to_vec();
            for &row in &supernode.rows {
                factors.extend_from_slice(&scale[symbolic.range(row)]);
            }
            let panel = &mut self.values[supernode.panel.clone()];
            for (column, values) in panel.chunks_exact_mut(supernode.height()).enumerate() {
                for (value, factor) in values.iter_mut().zip(&factors) {
                    *value *= factor * factors[column];
                }
            }
        }
    }

    /// Block (row, column) by kept blocks, in either triangle, handed out entry by entry as `(i, j, value)`;
    /// nothing if it is outside the pattern.
    pub fn for_block(&self, row: usize, column: usize, mut take: impl FnMut(usize, usize, f64)) -> bool {
        let (p, q) = (self.symbolic.position(row), self.symbolic.position(column));
        let (low, high) = (p.max(q), p.min(q));
        let supernode = self.symbolic.supernode_of(high);
        let Some(start) = self.symbolic.panel_row(supernode, low) else { return false };
        let s = &self.symbolic.supernodes()[supernode];
        let panel = &self.values[s.panel.clone()];
        let first = self.symbolic.range(high).start - self.symbolic.first_unknown(supernode);
        for j in 0..self.symbolic.dim(high) {
            for i in 0..self.symbolic.dim(low) {
                let (i_low, j_low) = if p == q && i < j { (j, i) } else { (i, j) };
                let value = panel[(first + j_low) * s.height() + start + i_low];
                if p >= q { take(i, j, value) } else { take(j, i, value) }
            }
        }
        true
    }
}
