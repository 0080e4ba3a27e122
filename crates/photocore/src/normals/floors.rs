//! The elimination tree divided for parallel work.

use std::ops::Range;

use super::symbolic::Symbolic;

/// Supernodes on two floors: independent subtrees of similar cost, and what stands above them.
///
/// The division does not depend on the number of threads, nor does the order in which the children of a supernode are added.
pub(super) struct Floors {
    /// Ranges of supernodes, each a whole subtree, ascending.
    subtrees: Vec<Range<usize>>,
    /// The supernodes above, ascending.
    pub top: Vec<usize>,
}

/// One subtree with its panels and one item for each of its supernodes.
pub(super) struct Subtree<'a, T> {
    /// Its supernodes, the root last.
    pub supernodes: Range<usize>,
    /// One item for each supernode.
    pub items: &'a mut [T],
    values: &'a mut [f64],
    base: usize,
}

impl<T> Subtree<'_, T> {
    /// The panel of a supernode, and the items.
    pub fn parts(&mut self, symbolic: &Symbolic, supernode: usize) -> (&mut [f64], &mut [T]) {
        let panel = &symbolic.supernodes()[supernode].panel;
        (&mut self.values[panel.start - self.base..panel.end - self.base], self.items)
    }
}

impl Floors {
    /// Share of the whole cost above which a subtree is divided.
    const SHARE: f64 = 1.0 / 32.0;

    pub fn new(symbolic: &Symbolic) -> Self {
        let work = symbolic.subtree_operations();
        let supernodes = symbolic.supernodes();
        let roots = supernodes.iter().zip(&work).filter(|(s, _)| s.parent.is_none());
        let total: f64 = roots.map(|(_, work)| work).sum();
        let whole = |index: usize| work[index] <= total * Self::SHARE;
        let top = (0..supernodes.len()).filter(|&index| !whole(index)).collect();
        // A subtree is contiguous and ends with its root, because the order is a postorder of the tree.
        let mut first: Vec<usize> = (0..supernodes.len()).collect();
        for (index, supernode) in supernodes.iter().enumerate() {
            if let Some(&child) = supernode.children.first() {
                first[index] = first[child];
            }
        }
        let is_root =
            |&index: &usize| whole(index) && supernodes[index].parent.is_none_or(|parent| !whole(parent));
        let subtrees = (0..supernodes.len()).filter(is_root).map(|index| first[index]..index + 1).collect();
        Self { subtrees, top }
    }

    /// Hands each subtree its part of the panels and of a list with one item for each supernode.
    pub fn divide<'a, T>(
        &self,
        symbolic: &Symbolic,
        mut values: &'a mut [f64],
        mut items: &'a mut [T],
    ) -> Vec<Subtree<'a, T>> {
        let (mut values_done, mut items_done) = (0, 0);
        let mut division = Vec::with_capacity(self.subtrees.len());
        for subtree in &self.subtrees {
            let base = symbolic.supernodes()[subtree.start].panel.start;
            let end = symbolic.supernodes()[subtree.end - 1].panel.end;
            skip(&mut values, base - values_done);
            skip(&mut items, subtree.start - items_done);
            division.push(Subtree {
                supernodes: subtree.clone(),
                items: skip(&mut items, subtree.len()),
                values: skip(&mut values, end - base),
                base,
            });
            (values_done, items_done) = (end, subtree.end);
        }
        division
    }
}

/// Takes `count` elements off the front of a slice.
pub(super) fn skip<'a, T>(rest: &mut &'a mut [T], count: usize) -> &'a mut [T] {
    let (head, tail) = std::mem::take(rest).split_at_mut(count);
    *rest = tail;
    head
}
