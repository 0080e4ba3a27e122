//! Where a network stands in a larger one that is adjusted in nodes (Helmert blocking).

use std::collections::BTreeSet;

use super::model::Bundle;
use super::screening::Screened;
use super::{Network, NetworkError};

/// What a block of unknowns that several nodes touch belongs to: indices into the network of the node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BlockOf {
    /// The pose of a photo, with a camera that is its alone.
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
}

impl Surroundings {
    fn all(&self) -> impl Iterator<Item = BlockOf> {
        self.outer.iter().chain(self.below.iter().flatten()).copied()
    }

    /// The points that have unknowns in other nodes.
    pub(super) fn points(&self) -> BTreeSet<usize> {
        self.all()
            .filter_map(|block| if let BlockOf::Point(point) = block { Some(point) } else { None })
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

    /// The kept blocks of a model that outer ones are, and those that each node below leaves something for.
    ///
    /// # Errors
    /// One that has no unknowns of its own here.
    pub(super) fn blocks(
        &self,
        model: &Bundle,
        screened: &Screened,
    ) -> Result<(Vec<u32>, Vec<Vec<u32>>), NetworkError> {
        let (photos, tied) = (model.cameras.len(), &screened.points[model.locals..]);
        let block = |&block: &BlockOf| {
            let found = match block {
                BlockOf::Photo(photo) => Some(photo),
                BlockOf::Camera(camera) => {
                    model.shared.binary_search(&camera).ok().map(|shared| photos + shared)
                }
                BlockOf::Common(common) => model.common_block[common],
                BlockOf::Point(point) => {
                    tied.iter().position(|&own| own == point).map(|place| model.stations() + place)
                }
            };
            found.map(|block| block as u32).ok_or(NetworkError::NoBlock(block))
        };
        let blocks = |all: &Vec<BlockOf>| all.iter().map(block).collect::<Result<Vec<u32>, NetworkError>>();
        Ok((blocks(&self.outer)?, self.below.iter().map(blocks).collect::<Result<_, _>>()?))
    }
}

impl Network {
    /// Refuses names of blocks that are not there.
    pub(super) fn check_blocks(&self, surroundings: &Surroundings) -> Result<(), NetworkError> {
        let there = |block: BlockOf| match block {
            BlockOf::Photo(photo) => photo < self.photos.len(),
            BlockOf::Camera(camera) => camera < self.cameras.len(),
            BlockOf::Common(common) => common < self.commons.len(),
            BlockOf::Point(point) => point < self.points.len(),
        };
        let missing = surroundings.all().find(|&block| !there(block));
        missing.map_or(Ok(()), |block| Err(NetworkError::NoBlock(block)))
    }

    /// Takes the weights of outer blocks away: they count where these are eliminated. What is fixed stays so.
    pub(super) fn release(&mut self, outer: &[BlockOf]) {
        let mut photos_of = vec![0; self.cameras.len()];
        self.photos.iter().for_each(|photo| photos_of[photo.camera] += 1);
        let named = |camera: usize| outer.contains(&BlockOf::Camera(camera));
        let mut cameras: Vec<usize> = (0..self.cameras.len()).filter(|&camera| named(camera)).collect();
        for block in outer {
            match *block {
                BlockOf::Photo(photo) => {
                    let photo = &mut self.photos[photo];
                    free(&mut photo.sd);
                    cameras.extend(Some(photo.camera).filter(|&camera| photos_of[camera] == 1));
                }
                BlockOf::Camera(_) => {}
                BlockOf::Common(common) => free(&mut self.commons[common].sd),
                BlockOf::Point(point) => free(&mut self.points[point].sd),
            }
        }
        for camera in cameras {
            free(&mut self.cameras[camera].sd);
            self.cameras[camera].covariance = None;
        }
    }
}

/// Makes weighted unknowns free.
fn free(sd: &mut [f64]) {
    sd.iter_mut().filter(|sd| **sd > 0.0).for_each(|sd| *sd = f64::INFINITY);
}
