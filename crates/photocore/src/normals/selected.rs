//! The blocks of the inverse inside the pattern of the factor.

use super::panels::Panels;

/// The blocks of N^-1 inside the pattern of the factor: every retained block's own, and those of every two retained blocks that
/// share a local block.
#[derive(Debug)]
pub struct SelectedInverse {
    pub(super) panels: Panels,
}

impl SelectedInverse {
    /// Block (row, column) of the inverse, row by row; None outside the pattern. Kept blocks are counted as in the layout.
    pub fn block(&self, row: usize, column: usize) -> Option<Vec<f64>> {
        let symbolic = &*self.panels.symbolic;
        let (p, q) = (symbolic.position(row), symbolic.position(column));
        let (first, last) = (p.min(q), p.max(q));
        let supernode = symbolic.supernode_of(first);
        let at = symbolic.panel_row(supernode, last)?;
        let height = symbolic.supernodes()[supernode].height();
        let left = symbolic.range(first).start - symbolic.first_unknown(supernode);
        let panel = self.panels.panel(supernode);
        // The lower triangle, that is the row later in the order of elimination, carries the values.
        let value = |i: usize, j: usize| {
            let (high, low) = if p > q { (at + i, left + j) } else { (at + j, left + i) };
            if first == last {
                panel[low.min(high) * height + low.max(high)]
            } else {
                panel[low * height + high]
            }
        };
        let columns = symbolic.dim(q);
        Some((0..symbolic.dim(p) * columns).map(|k| value(k / columns, k % columns)).collect())
    }
}
