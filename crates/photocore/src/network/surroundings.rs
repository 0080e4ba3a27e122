//! Interface of a network to the larger one, which is adjusted in nodes (Helmert blocking).

use std::collections::BTreeSet;

use super::input::Network;
use super::mounts::Trajectory;

/// Owner of a parameter block that several nodes share: indices into the network of the node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BlockOf {
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
pub struct Surroundings {
    /// Blocks that a parent node eliminates.
    pub outer: Vec<BlockOf>,
    /// Blocks to which each child node contributes.
    pub below: Vec<Vec<BlockOf>>,
    /// Median position of all photos of the larger network; None for the median of this network.
    pub middle: Option<[f64; 3]>,
    /// Photos with the numbers of the pose parameters that are fixed for the datum of the larger network
    /// ([`super::Network::held_for_datum`]), in this node and its parents.
    pub held: Vec<(usize, usize)>,
}

impl Surroundings {
    pub(super) fn all(&self) -> impl Iterator<Item = BlockOf> {
        self.outer.iter().chain(self.below.iter().flatten()).copied()
    }

    /// Returns the indices of the blocks of one type that other nodes share: `of` is the variant of [`BlockOf`].
    pub(super) fn indices(&self, of: fn(usize) -> BlockOf) -> BTreeSet<usize> {
        let index = |block: BlockOf| match block {
            BlockOf::Photo(own) | BlockOf::Camera(own) | BlockOf::Common(own) | BlockOf::Point(own) => own,
        };
        self.all().filter(|&block| of(index(block)) == block).map(index).collect()
    }
}

impl Network {
    /// Replaces photos on trajectories, whose own parameters are fixed, by the coefficients of their trajectories.
    pub(super) fn told_by_coefficients(&self, given: Surroundings) -> Surroundings {
        let mut flown = vec![None; self.photos.len()];
        let of_photos = self.mounts.iter().map(|mount| (mount.photo(), mount.trajectory()));
        of_photos.for_each(|(photo, trajectory)| flown[photo] = flown[photo].or(trajectory));
        let told = |block: &BlockOf| -> Vec<BlockOf> {
            let trajectory = if let BlockOf::Photo(photo) = *block { flown[photo] } else { None };
            let Some(trajectory) = trajectory else { return vec![*block] };
            let Trajectory { position, rotation, .. } = &self.trajectories[trajectory];
            let unknown = position.iter().chain(rotation).filter(|&&common| !self.commons[common].is_held());
            unknown.map(|&common| BlockOf::Common(common)).collect()
        };
        let all = |blocks: &Vec<BlockOf>| blocks.iter().flat_map(told).collect();
        Surroundings { outer: all(&given.outer), below: given.below.iter().map(all).collect(), ..given }
    }
}
