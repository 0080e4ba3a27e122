//! The front of outer unknowns, which stays unfactored (see [`Contribution`]).

use super::contribution::{Contribution, packed};
use super::factor::Factor;
use super::panels::Panels;

impl Factor {
    /// Takes what is left for the outer unknowns, in the order of the layout, and the memory of its front; empty for a whole system,
    /// and the second time.
    pub fn take_contribution(&mut self) -> Contribution<'static> {
        let symbolic = &*self.panels.symbolic;
        let Some(open) = symbolic.open() else { return Contribution::default() };
        let (s, first) = (&symbolic.supernodes()[open], symbolic.first_unknown(open));
        if self.panels.values.len() < s.panel.end {
            return Contribution::default();
        }
        let mut matrix = Vec::with_capacity(packed(s.width));
        for (j, column) in self.panels.panel(open).chunks_exact(s.width.max(1)).enumerate() {
            matrix.extend_from_slice(&column[j..]);
        }
        self.panels.values.truncate(s.panel.start);
        self.panels.values.shrink_to_fit();
        Contribution {
            matrix: matrix.into(),
            right: self.right[first..].to_vec().into(),
            diagonal: self.diagonal[first..].to_vec().into(),
        }
    }
}

impl Panels {
    /// Makes room again for the front of outer unknowns that was taken.
    pub fn reopen(&mut self) {
        self.values.resize(self.symbolic.values(), 0.0);
    }
}
