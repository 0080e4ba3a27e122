//! Where a network stands in a larger one that is adjusted in nodes (Helmert blocking).

use std::collections::BTreeSet;

use super::{Network, Trajectory};

/// What a block of unknowns that several nodes touch belongs to: indices into the network of the node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BlockOf {
    /// The pose of a photo, with a camera that is its alone, and with its film; all coefficients of the trajectory that it is on.
    Photo(usize),
    /// A camera that several photos of the larger network share.
    Camera(usize),
    /// A common unknown.
    Common(usize),
    /// A point that observations beside images touch.
    Point(usize),
}

/// What a node has in common with others.
#[derive(Debug, Clone, Default)]
pub struct Surroundings {
    /// The blocks that a node above eliminates.
    pub outer: Vec<BlockOf>,
    /// The blocks that each node below leaves something for.
    pub below: Vec<Vec<BlockOf>>,
    /// The median of the positions of all photos of the larger network; None for those of this one.
    pub middle: Option<[f64; 3]>,
    /// Photos with the numbers of those of their pose unknowns that are held for the datum of the larger network
    /// ([`super::Network::held_for_datum`]), here and above.
    pub held: Vec<(usize, usize)>,
}

impl Surroundings {
    pub(super) fn all(&self) -> impl Iterator<Item = BlockOf> {
        self.outer.iter().chain(self.below.iter().flatten()).copied()
    }

    /// The points that have unknowns in other nodes.
    pub(super) fn points(&self) -> BTreeSet<usize> {
        self.all()
            .filter_map(|block| if let BlockOf::Point(point) = block { Some(point) } else { None })
            .collect()
    }

    /// The photos that have unknowns in other nodes.
    pub(super) fn photos(&self) -> BTreeSet<usize> {
        self.all()
            .filter_map(|block| if let BlockOf::Photo(photo) = block { Some(photo) } else { None })
            .collect()
    }

    /// The cameras that photos of other nodes share.
    pub(super) fn cameras(&self) -> BTreeSet<usize> {
        self.all()
            .filter_map(|block| if let BlockOf::Camera(own) = block { Some(own) } else { None })
            .collect()
    }

    /// The common unknowns that other nodes touch.
    pub(super) fn commons(&self) -> BTreeSet<usize> {
        self.all()
            .filter_map(|block| if let BlockOf::Common(own) = block { Some(own) } else { None })
            .collect()
    }
}

impl Network {
    /// With the coefficients of trajectories in the place of photos on them, which have no unknowns of their own.
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
