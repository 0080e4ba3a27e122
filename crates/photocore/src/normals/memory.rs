//! Memory requirements of an adjustment.

use super::symbolic::Supernode;
use super::system::{System, vectors};
use super::workspace::capacity;

/// Size of a number in bytes.
const BYTES: usize = size_of::<f64>();
/// Bytes that do not depend on the size of the problem, including threads.
const BASE: usize = 8 << 20;
/// Size of the largest factor that is copied for hypotheses, in bytes.
const COPIED: usize = 128 << 20;

/// Size of a front in progress, and size that waits in it during the visit of each child, for one or several threads.
type Sizes<'a> = dyn Fn(usize, &Supernode, bool) -> (usize, Vec<usize>) + 'a;

impl System {
    /// Estimates the maximum size of all phases with a number of threads in bytes, including the problem and its results: the factor,
    /// simultaneous fronts and vectors.
    pub fn memory(&self, threads: usize) -> usize {
        self.memory_of_part(threads) + BYTES * vectors(&self.layout)
    }

    /// Estimates the maximum size without vectors: that of a partial system, which is released after its formation.
    pub fn memory_of_part(&self, threads: usize) -> usize {
        BASE + BYTES * (self.symbolic.values() + self.fronts(threads))
    }

    /// Extra bytes for group tests and hypotheses: the leverage matrices of groups, their computation, and a copy of the factor.
    pub fn memory_of_groups(&self) -> usize {
        let copy = if self.copies_factor() { self.bytes_of_factor() } else { 0 };
        2 * BYTES * self.layout.groups() * self.layout.rows().pow(2) + copy
    }

    /// Whether the factor is copied for hypotheses before it is inverted. If it is large, the normal equations are formed again, which takes
    /// time, but no memory.
    pub fn copies_factor(&self) -> bool {
        self.bytes_of_factor() <= COPIED
    }

    fn bytes_of_factor(&self) -> usize {
        BYTES * self.symbolic.values()
    }

    /// Releases the buffers for the next formation or inversion, if other code needs memory before.
    pub fn release(&self) {
        self.workspace.clear();
    }

    /// Starts a traversal of the elimination tree by the current threads.
    pub(super) fn start(&self) {
        self.workspace.start(self.fronts(rayon::current_num_threads()));
    }

    /// Returns the maximum number of elements in the fronts of a factorisation or an inversion.
    fn fronts(&self, threads: usize) -> usize {
        let square = |order: usize| capacity(order.pow(2));
        let (mut updates, mut fronts) = (vec![], vec![]);
        for s in self.symbolic.supernodes() {
            updates.push(square(s.below()));
            fronts.push(square(s.height()));
        }
        let upward = |index: usize, s: &Supernode, alone: bool| {
            let all: usize = s.children.iter().map(|&child| updates[child]).sum();
            let mut before = 0;
            let waiting = s.children.iter().map(|&child| {
                before += updates[child];
                if alone { before - updates[child] } else { all - updates[child] }
            });
            let waiting = waiting.collect();
            (updates[index] + all, waiting)
        };
        let downward = |index: usize, s: &Supernode, alone: bool| {
            // The inverse over the outer unknowns is given, not computed.
            let is_open = self.symbolic.open() == Some(index);
            let products = if is_open { 0 } else { capacity(s.below() * s.width) + square(s.width) };
            let of_child = s.children.iter().map(|&child| fronts[child]).max().unwrap_or(0);
            // The last child takes over the front.
            let last = |k: usize| if alone { k == 0 } else { s.children.len() == 1 };
            let waiting = |k: usize| if last(k) { 0 } else { fronts[index] };
            (fronts[index] + products.max(of_child), (0..s.children.len()).map(waiting).collect())
        };
        let upward = self.most(threads, &|child| updates[child], &upward);
        upward.max(self.most(threads, &|_| 0, &downward))
    }

    /// Returns the maximum size of all fronts in progress and of those that wait for others.
    ///
    /// The threads walk depth-first, so that fronts wait only on the ways from the roots to the fronts in progress. The union of these ways
    /// consists of one chain per thread that branches off a longer one. The largest of all chains are an upper bound. It is exact for one
    /// thread, since the order of its visits is known.
    ///
    /// * `kept`: size that waits after the visits of a subtree;
    /// * `sizes`: sizes of a supernode by index; the last argument is true for one thread.
    fn most(&self, threads: usize, kept: &dyn Fn(usize) -> usize, sizes: &Sizes<'_>) -> usize {
        let (mut most, mut chains) = (Vec::<usize>::new(), vec![]);
        for (index, s) in self.symbolic.supernodes().iter().enumerate() {
            let alone = threads == 1 || !self.tree.is_above(index);
            let (own, waiting) = sizes(index, s, alone);
            let with_child = |(waiting, &child): (usize, &usize)| waiting + most[child];
            let of_children = waiting.into_iter().zip(&s.children).map(with_child).max();
            if !alone {
                let mut added: Vec<usize> =
                    s.children.iter().map(|&child| most[child] - kept(child)).collect();
                added.sort_unstable();
                added.pop();
                chains.extend(added);
            }
            most.push(own.max(of_children.unwrap_or(0)));
            chains.extend(s.parent.is_none().then_some(most[index]));
        }
        chains.sort_unstable();
        chains.iter().rev().take(threads).sum()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::sync::Arc;

    use proptest::prelude::*;

    use super::*;
    use crate::normals::{
        Equations, FactorOptions, GroupRows, InvertOptions, Layout, Ordering, Prior, SelectedInverse,
    };
    use crate::{Context, Threads};

    struct Irregular {
        prior: Prior,
    }

    impl Equations for Irregular {
        fn write(&self, local: usize, group: usize, rows: &mut GroupRows<'_>) {
            let numbers = rows.local.iter_mut().chain(&mut *rows.retained).enumerate();
            numbers.for_each(|(k, value)| *value = ((7 * local + 3 * group + k) as f64).sin());
            rows.constant.fill(1.0);
        }

        fn prior(&self) -> &Prior {
            &self.prior
        }
    }

    /// Returns a system whose local blocks have observations with some of `count` retained blocks.
    fn system(count: usize, locals: &[Vec<usize>]) -> Arc<System> {
        let ends = locals.iter().scan(0, |end, blocks| {
            *end += blocks.len();
            Some(*end)
        });
        let starts = std::iter::once(0).chain(ends).collect();
        let retained = locals.iter().flatten().map(|&block| block as u32).collect();
        let layout = Layout::new(2, 1, &vec![6; count], starts, retained).unwrap();
        System::new(layout, Ordering::Auto).unwrap()
    }

    /// Returns the predicted and the counted number of elements in fronts, and the selected inverse.
    fn fronts(system: &Arc<System>, threads: usize) -> (usize, usize, SelectedInverse) {
        let threads = Threads::new(threads).unwrap();
        let unknowns = system.layout.unknowns();
        let prior = Prior { weight: vec![1.0; unknowns], right: vec![0.0; unknowns], between: vec![] };
        let mut context = Context::new(&threads);
        let equations = Irregular { prior };
        system.release();
        let factor = system.factor(&equations, &FactorOptions::UNCACHED, &mut context).unwrap();
        let options = InvertOptions::default();
        let inverse = factor.invert(&equations, &options, &mut context).unwrap();
        (system.fronts(threads.count()), system.workspace.most(), inverse.selected)
    }

    /// Checks the prediction for several numbers of threads, and that they compute the same bits.
    fn check(system: &Arc<System>) {
        let (predicted, counted, serial) = fronts(system, 1);
        assert!(counted <= predicted && 2 * predicted <= 3 * counted, "{predicted}, counted {counted}");
        for threads in [2, 3, 8] {
            let (predicted, counted, inverse) = fronts(system, threads);
            assert!(counted <= predicted, "{threads} threads: {predicted}, counted {counted}");
            let bits = |inverse: &SelectedInverse| {
                let blocks = 0..system.symbolic.blocks();
                blocks.flat_map(|block| inverse.block(block, block).unwrap()).map(f64::to_bits).collect()
            };
            let (one, several): (Vec<u64>, Vec<u64>) = (bits(&serial), bits(&inverse));
            assert!(one == several, "{threads} threads");
        }
    }

    /// Returns the grid cells with their corners.
    fn grid(columns: usize, rows: usize) -> Vec<Vec<usize>> {
        let corners = |cell: usize| {
            let first = cell / (columns - 1) * columns + cell % (columns - 1);
            vec![first, first + 1, first + columns, first + columns + 1]
        };
        (0..(columns - 1) * (rows - 1)).map(corners).collect()
    }

    #[test]
    fn the_prediction_is_an_upper_bound_for_a_large_grid() {
        check(&system(40 * 40, &grid(40, 40)));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]

        #[test]
        fn the_prediction_is_an_upper_bound_for_grids(columns in 2_usize..30, rows in 2_usize..30) {
            check(&system(columns * rows, &grid(columns, rows)));
        }

        #[test]
        fn the_prediction_is_an_upper_bound_for_chains(count in 4_usize..2000, length in 2_usize..4) {
            let links: Vec<Vec<usize>> =
                (0..count - length).map(|first| (first..first + length).collect()).collect();
            check(&system(count, &links));
        }

        #[test]
        fn the_prediction_is_an_upper_bound_for_blocks(
            count in 10_usize..300,
            far in prop::collection::vec((0_usize..1000, 1_usize..1000, 0_usize..20), 30..600),
        ) {
            let images = |&(first, further, near): &(usize, usize, usize)| {
                let mut photos = vec![first % count, (first + near) % count];
                photos.extend((further % 7 == 0).then_some(further % count));
                photos.sort_unstable();
                photos.dedup();
                photos
            };
            let points: Vec<Vec<usize>> = far.iter().map(images).collect();
            check(&system(count, &points));
        }
    }
}
