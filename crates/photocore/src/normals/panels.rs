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
}
