//! How much memory an adjustment takes.

use std::collections::HashMap;

use super::room::vectors;
use super::system::System;
use super::workspace::capacity;

/// Of a number.
const BYTES: usize = size_of::<f64>();
/// Bytes for what does not grow with the problem, threads among them;
const BASE: usize = 8 << 20;
/// and where a whole network is adjusted, for what Python loads first and for room that the allocator keeps.
const AT_FIRST: usize = 40 << 20;

impl System {
    /// Bytes that forming, factoring, solving and inverting take at the most, the problem itself and its results counted: the
    /// factor, the fronts that wait for each other, and vectors.
    pub fn memory(&self) -> usize {
        AT_FIRST + self.memory_of_fronts() + BYTES * vectors(&self.layout)
    }

    /// Of these, those of the factor and the fronts, and what does not grow with the problem.
    pub fn memory_of_fronts(&self) -> usize {
        BASE + BYTES * (capacity(self.symbolic.values()) + self.fronts())
    }

    /// Bytes that what groups have to do with each other takes besides, as it is found and as it is handed out.
    pub fn memory_of_groups(&self) -> usize {
        let (groups, rows) = (self.layout.groups(), self.layout.rows());
        let alone = self.layout.locals() * self.layout.local_dim().pow(2);
        2 * BYTES * (2 * groups * rows * rows + alone)
    }

    /// Gives back what is kept for the next formation or inversion: where others need memory before it comes.
    pub fn release(&self) {
        self.workspace.clear();
    }

    /// Numbers in the buffers of fronts: the walks up and down the elimination tree take and give back what these do.
    fn fronts(&self) -> usize {
        let supernodes = self.symbolic.supernodes();
        let mut buffers = Buffers::default();
        for s in supernodes {
            buffers.take(s.below().pow(2));
            s.children.iter().for_each(|&child| buffers.put_back(supernodes[child].below().pow(2)));
        }
        for root in supernodes.iter().filter(|s| s.parent.is_none()) {
            buffers.put_back(root.below().pow(2));
        }
        for (index, s) in supernodes.iter().enumerate().rev() {
            buffers.take(s.height().pow(2));
            // A front lives until the last child, the first in the order, has taken its part.
            let parent = s.parent.map(|parent| &supernodes[parent]);
            if let Some(parent) = parent.filter(|parent| parent.children.first() == Some(&index)) {
                buffers.put_back(parent.height().pow(2));
            }
            let products = [s.below() * s.width, s.width.pow(2)];
            products.iter().for_each(|&length| buffers.take(length));
            products.iter().for_each(|&length| buffers.put_back(length));
            if s.children.is_empty() {
                buffers.put_back(s.height().pow(2));
            }
        }
        buffers.made
    }
}

/// The buffers of a workspace, by capacity.
#[derive(Default)]
struct Buffers {
    spare: HashMap<usize, usize>,
    /// Numbers in all that were ever made: none is given back to the system.
    made: usize,
}

impl Buffers {
    fn take(&mut self, length: usize) {
        let capacity = capacity(length);
        match self.spare.get_mut(&capacity).filter(|spare| **spare > 0) {
            Some(spare) => *spare -= 1,
            None => self.made += capacity,
        }
    }

    fn put_back(&mut self, length: usize) {
        *self.spare.entry(capacity(length)).or_default() += 1;
    }
}
