//! Memory requirements of an adjustment.

use std::collections::HashMap;

use super::system::{System, vectors};
use super::workspace::Workspace;

/// Size of a number in bytes.
const BYTES: usize = size_of::<f64>();
/// Bytes that do not depend on the size of the problem, including threads.
const BASE: usize = 8 << 20;
/// Size of the largest factor that is copied for hypotheses, in bytes.
const COPIED: usize = 128 << 20;

impl System {
    /// Estimates the maximum size of all phases in bytes, including the problem and its results: the factor, simultaneous fronts and
    /// vectors.
    pub fn memory(&self) -> usize {
        let mut buffers = Buffers::of(&self.workspace);
        self.walk_up(&mut buffers);
        self.walk_down(&mut buffers);
        let of_fronts = self.workspace.capacity(self.symbolic.values()) + buffers.most;
        BASE + BYTES * (of_fronts + vectors(&self.layout))
    }

    /// Estimates the size for a partial system, which is released after its formation.
    pub fn memory_of_part(&self) -> usize {
        let mut walks = [Buffers::of(&self.workspace), Buffers::of(&self.workspace)];
        self.walk_up(&mut walks[0]);
        self.walk_down(&mut walks[1]);
        let most = walks[0].most.max(walks[1].most);
        BASE + BYTES * (self.workspace.capacity(self.symbolic.values()) + most)
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

    /// Simulates the front buffers of the factorisation.
    fn walk_up(&self, buffers: &mut Buffers<'_>) {
        let supernodes = self.symbolic.supernodes();
        for s in supernodes {
            buffers.take(s.below().pow(2));
            s.children.iter().for_each(|&child| buffers.put_back(supernodes[child].below().pow(2)));
        }
        for root in supernodes.iter().filter(|s| s.parent.is_none()) {
            buffers.put_back(root.below().pow(2));
        }
    }

    /// Simulates the front buffers of the inversion.
    fn walk_down(&self, buffers: &mut Buffers<'_>) {
        let supernodes = self.symbolic.supernodes();
        for (index, s) in supernodes.iter().enumerate().rev() {
            buffers.take(s.height().pow(2));
            // A front is released by its last child, the first in the order.
            let parent = s.parent.map(|parent| &supernodes[parent]);
            if let Some(parent) = parent.filter(|parent| parent.children.first() == Some(&index)) {
                buffers.put_back(parent.height().pow(2));
            }
            // The inverse over the outer unknowns is given, not computed.
            if self.symbolic.open() != Some(index) {
                let products = [s.below() * s.width, s.width.pow(2)];
                products.iter().for_each(|&length| buffers.take(length));
                products.iter().for_each(|&length| buffers.put_back(length));
            }
            if s.children.is_empty() {
                buffers.put_back(s.height().pow(2));
            }
        }
    }
}

/// Simulated buffers of a workspace, by capacity.
struct Buffers<'a> {
    workspace: &'a Workspace,
    spare: HashMap<usize, usize>,
    /// Current and maximum number of elements in all buffers.
    made: usize,
    most: usize,
}

impl<'a> Buffers<'a> {
    fn of(workspace: &'a Workspace) -> Self {
        Self { workspace, spare: HashMap::new(), made: 0, most: 0 }
    }

    fn take(&mut self, length: usize) {
        let capacity = self.workspace.capacity(length);
        match self.spare.get_mut(&capacity).filter(|spare| **spare > 0) {
            Some(spare) => *spare -= 1,
            None => self.made += capacity,
        }
        self.most = self.most.max(self.made);
    }

    fn put_back(&mut self, length: usize) {
        let capacity = self.workspace.capacity(length);
        if self.workspace.gives_back(capacity) {
            self.made -= capacity;
        } else {
            *self.spare.entry(capacity).or_default() += 1;
        }
    }
}
