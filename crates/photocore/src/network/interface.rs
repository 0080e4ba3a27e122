//! Interface of a network to the larger one, which is adjusted in nodes (Helmert blocking).

use std::collections::BTreeSet;

/// Owner of a parameter block that several nodes share: indices into the network of the node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BlockId {
    /// Pose of a photo, with its own camera and film; all coefficients of its trajectory.
    Photo(usize),
    /// Camera that several photos of the larger network share.
    Camera(usize),
    /// Shared parameter.
    Common(usize),
    /// Point with additional observations.
    Point(usize),
}

/// Interface of a node to the other nodes.
#[derive(Debug, Clone, Default)]
pub struct Interface {
    /// Blocks that a parent node eliminates.
    pub outer: Vec<BlockId>,
    /// Blocks to which each child node contributes.
    pub below: Vec<Vec<BlockId>>,
    /// Median position of all photos of the larger network; None for the median of this network.
    pub middle: Option<[f64; 3]>,
    /// Photos with the numbers of the pose parameters that are fixed for the datum of the larger network
    /// in this node and its parents.
    pub held: Vec<(usize, usize)>,
}

impl Interface {
    #[doc(hidden)]
    pub fn all(&self) -> impl Iterator<Item = BlockId> {
        self.outer.iter().chain(self.below.iter().flatten()).copied()
    }

    /// Returns the indices of the blocks of one type that other nodes share: `of` is the variant of [`BlockId`].
    #[doc(hidden)]
    pub fn indices(&self, of: fn(usize) -> BlockId) -> BTreeSet<usize> {
        let index = |block: BlockId| match block {
            BlockId::Photo(own) | BlockId::Camera(own) | BlockId::Common(own) | BlockId::Point(own) => own,
        };
        self.all().filter(|&block| of(index(block)) == block).map(index).collect()
    }
}
