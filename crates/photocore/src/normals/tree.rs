//! The elimination tree, walked by several threads.

use std::sync::atomic::{AtomicUsize, Ordering::AcqRel};

use rayon::ScopeFifo;

use super::symbolic::Symbolic;

/// The elimination tree on two floors: subtrees that one thread walks, and single supernodes above them. Supernodes of which neither
/// is below the other are independent, so that the order in which they are visited changes no bit of a result.
#[derive(Debug)]
pub(super) struct Tree {
    parent: Vec<Option<usize>>,
    /// First supernode of the subtree of each: the order is a postorder, so a subtree has no gaps.
    first: Vec<usize>,
    /// The units of work: supernodes above, and roots of undivided subtrees. Those without parent, and those below each supernode.
    roots: Vec<usize>,
    below: Vec<Vec<usize>>,
    /// Whether a supernode stands above the undivided subtrees.
    above: Vec<bool>,
}

impl Tree {
    /// Share of the whole work up to which a subtree is not divided.
    const SHARE: f64 = 1.0 / 32.0;
    /// Work (multiply-adds) up to which nothing is divided.
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

    /// Visits every supernode after all those below it.
    pub fn upward(&self, visit: &(dyn Fn(usize) + Sync)) {
        let waiting: Vec<AtomicUsize> =
            self.below.iter().map(|units| AtomicUsize::new(units.len())).collect();
        let start = |unit: usize| {
            (self.first[unit]..unit).for_each(visit);
            let mut index = unit;
            visit(index);
            // The last to arrive below a supernode goes on with it.
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

    /// Visits every supernode before all those below it.
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
