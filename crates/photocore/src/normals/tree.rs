//! Parallel traversal of the elimination tree.

use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering::AcqRel};

use rayon::Scope;

use super::symbolic::Symbolic;
use crate::parallel::lock;

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
        let starts = self.units().filter(|&unit| !self.above[unit] || self.below[unit].is_empty());
        let mut ready: Vec<usize> = starts.collect();
        ready.reverse();
        walk(ready, &|unit| {
            self.subtree(unit).for_each(visit);
            // The last finished child makes the parent ready.
            let parent = self.parent[unit].filter(|&parent| waiting[parent].fetch_sub(1, AcqRel) == 1);
            parent.into_iter().collect()
        });
    }

    /// Visits every supernode before its descendants.
    pub fn downward(&self, visit: &(dyn Fn(usize) + Sync)) {
        walk(self.roots.clone(), &|unit| {
            self.subtree(unit).rev().for_each(visit);
            self.below[unit].clone()
        });
    }

    fn units(&self) -> impl Iterator<Item = usize> {
        (0..self.parent.len())
            .filter(|&index| self.above[index] || self.parent[index].is_none_or(|parent| self.above[parent]))
    }

    /// Whether a supernode is above the undivided subtrees.
    pub fn is_above(&self, supernode: usize) -> bool {
        self.above[supernode]
    }

    /// Returns the supernodes of a unit, children before parents.
    fn subtree(&self, unit: usize) -> Range<usize> {
        if self.above[unit] { unit..unit + 1 } else { self.first[unit]..unit + 1 }
    }
}

/// Visits units in the order of their readiness; a visit returns the units that it makes ready. There are as many walkers as threads, and
/// each visits one unit at a time. This limits the units in progress, although a thread that waits inside a visit may begin another one.
fn walk(ready: Vec<usize>, visit: &(dyn Fn(usize) -> Vec<usize> + Sync)) {
    let idle: Vec<usize> = (0..rayon::current_num_threads()).collect();
    let mut stacks = vec![Vec::new(); idle.len()];
    stacks[0] = ready;
    let walkers = Mutex::new(Walkers { stacks, idle });
    rayon::scope(|scope| Walkers::go_on(&walkers, scope, visit));
}

/// Walkers through a tree. Each continues with the unit that became ready last in its own part of the tree, so that it walks depth-first:
/// fronts wait only on the ways from the roots to the units in progress.
struct Walkers {
    /// Ready units of each walker, the next one last.
    stacks: Vec<Vec<usize>>,
    idle: Vec<usize>,
}

impl Walkers {
    /// Starts the idle walkers for which a unit is ready.
    fn go_on<'a>(
        walkers: &'a Mutex<Self>,
        scope: &Scope<'a>,
        visit: &'a (dyn Fn(usize) -> Vec<usize> + Sync),
    ) {
        for (walker, unit) in lock(walkers).next() {
            scope.spawn(move |scope| {
                let ready = visit(unit);
                let mut all = lock(walkers);
                all.stacks[walker].extend(ready);
                all.idle.push(walker);
                drop(all);
                Self::go_on(walkers, scope, visit);
            });
        }
    }

    /// Takes the next unit for each idle walker: its own, or one of another walker.
    fn next(&mut self) -> Vec<(usize, usize)> {
        let mut next = vec![];
        while let Some(&walker) = self.idle.last() {
            let own = self.stacks[walker].pop();
            let Some(unit) = own.or_else(|| self.stacks.iter_mut().find_map(Vec::pop)) else { break };
            self.idle.pop();
            next.push((walker, unit));
        }
        next
    }
}
