//! Parallel traversal of the elimination tree.

use std::sync::atomic::{AtomicUsize, Ordering::AcqRel};

use rayon::ScopeFifo;

use super::symbolic::Symbolic;

/// Elimination tree with two levels of tasks: subtrees for one thread each, and single supernodes above them. Supernodes in different
/// branches are independent, so that the order of visits does not change results.
#[derive(Debug)]
pub(super) struct Tree {
    parent: Vec<Option<usize>>,
    /// First supernode of each subtree: in a postorder, a subtree is contiguous.
    first: Vec<usize>,
    /// Task units, namely upper supernodes and roots of undivided subtrees; `roots` without parent, `below` under each upper supernode.
    roots: Vec<usize>,
    below: Vec<Vec<usize>>,
    /// Whether a supernode is above the undivided subtrees.
    above: Vec<bool>,
}

impl Tree {
    /// Maximum fraction of the total work in an undivided subtree.
    const SHARE: f64 = 1.0 / 32.0;
    /// Maximum work (multiply-adds) of an undivided tree.
    const SMALL: f64 = 1e6;

    /// Divides the tree by the work at each supernode (multiply-adds).
    pub fn new(symbolic: &Symbolic, mut work: Vec<f64>) -> Self {
        let most = (work.iter().sum::<f64>() * Self::SHARE).max(Self::SMALL);
        let parent: Vec<Option<usize>> = symbolic.supernodes().iter().map(|s| s.parent).collect();
        let mut first: Vec<usize> = (0..parent.len()).collect();
        for (index, parent) in parent.iter().enumerate() {
            if let Some(parent) = *parent {
                work[parent] += work[index];
                first[parent] = first[parent].min(first[index]);
            }
        }
        let above: Vec<bool> = work.iter().map(|&work| work > most).collect();
        let (mut roots, mut below) = (Vec::new(), vec![Vec::new(); parent.len()]);
        for (index, parent) in parent.iter().enumerate() {
            match *parent {
                None => roots.push(index),
                Some(parent) if above[parent] => below[parent].push(index),
                Some(_) => {}
            }
        }
        Self { parent, first, roots, below, above }
    }

    /// Visits every supernode after its descendants.
    pub fn upward(&self, visit: &(dyn Fn(usize) + Sync)) {
        let waiting: Vec<AtomicUsize> =
            self.below.iter().map(|units| AtomicUsize::new(units.len())).collect();
        let start = |unit: usize| {
            (self.first[unit]..unit).for_each(visit);
            let mut index = unit;
            visit(index);
            // The last finished child continues with the parent.
            while let Some(parent) = self.parent[index] {
                if waiting[parent].fetch_sub(1, AcqRel) > 1 {
                    break;
                }
                visit(parent);
                index = parent;
            }
        };
        let start = &start;
        let is_start = |&unit: &usize| !self.above[unit] || self.below[unit].is_empty();
        rayon::scope_fifo(|scope| {
            for unit in self.units().filter(is_start) {
                scope.spawn_fifo(move |_| start(unit));
            }
        });
    }

    /// Visits every supernode before its descendants.
    pub fn downward(&self, visit: &(dyn Fn(usize) + Sync)) {
        rayon::scope_fifo(|scope| self.roots.iter().for_each(|&root| self.descend(scope, root, visit)));
    }

    fn descend<'a>(&'a self, scope: &ScopeFifo<'a>, unit: usize, visit: &'a (dyn Fn(usize) + Sync)) {
        scope.spawn_fifo(move |scope| {
            let mut unit = unit;
            while self.above[unit] {
                visit(unit);
                let Some((&next, others)) = self.below[unit].split_last() else { return };
                others.iter().for_each(|&other| self.descend(scope, other, visit));
                unit = next;
            }
            (self.first[unit]..=unit).rev().for_each(visit);
        });
    }

    fn units(&self) -> impl Iterator<Item = usize> {
        (0..self.parent.len())
            .filter(|&index| self.above[index] || self.parent[index].is_none_or(|parent| self.above[parent]))
    }
}
