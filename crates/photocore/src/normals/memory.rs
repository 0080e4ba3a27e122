//! How much memory an adjustment takes.

use super::symbolic::Supernode;
use super::system::System;

/// Of a number.
const BYTES: usize = size_of::<f64>();
/// Numbers for each unknown: values, steps, priors and their copies.
const PER_UNKNOWN: usize = 16;
/// Numbers for each equation beside its coefficients: observed value, standard deviation, residual, redundancy number.
const PER_EQUATION: usize = 8;

impl System {
    /// Bytes that forming, factoring, solving and inverting take at the most, the problem itself and its results counted: the
    /// factor, the fronts that wait for each other, and vectors.
    pub fn memory(&self) -> usize {
        let layout = &self.layout;
        let vectors = PER_UNKNOWN * layout.unknowns() + PER_EQUATION * layout.equations();
        let cofactors = 2 * layout.locals() * layout.local_dim().pow(2) + 2 * layout.equations();
        BYTES * (self.symbolic.values() + self.upward().max(self.downward()) + vectors + cofactors)
    }

    /// Numbers in the updates that wait for their parents, when the factorisation goes through the order of elimination.
    fn upward(&self) -> usize {
        let supernodes = self.symbolic.supernodes();
        let update = |s: &Supernode| s.below() * s.below();
        let (mut waiting, mut most) = (0, 0);
        for s in supernodes {
            most = most.max(waiting + update(s));
            waiting += update(s);
            waiting -= s.children.iter().map(|&child| update(&supernodes[child])).sum::<usize>();
        }
        most
    }

    /// Numbers in the fronts that wait for their children, when the inversion goes back through it.
    fn downward(&self) -> usize {
        let supernodes = self.symbolic.supernodes();
        let front = |s: &Supernode| s.height() * s.height();
        let (mut waiting, mut most) = (0, 0);
        for (index, s) in supernodes.iter().enumerate().rev() {
            // The front, and two parts of it for the products.
            most = most.max(waiting + front(s) + s.width * s.height());
            waiting += if s.children.is_empty() { 0 } else { front(s) };
            // The first child is the last to take the front of its parent.
            let parent = s.parent.map(|parent| &supernodes[parent]);
            let last = parent.filter(|parent| parent.children.first() == Some(&index));
            waiting -= last.map_or(0, front);
        }
        most
    }
}
