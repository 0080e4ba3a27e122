//! Interface of a node to the larger network: checks, trajectories, and weights of outer blocks.

use photocore::network::{BlockId, Interface, Network, NetworkError};

/// Returns an error for indices of missing blocks.
pub fn check_blocks(network: &Network, interface: &Interface) -> Result<(), NetworkError> {
    let there = |block: BlockId| match block {
        BlockId::Photo(photo) => photo < network.photos.len(),
        BlockId::Camera(camera) => camera < network.cameras.len(),
        BlockId::Common(common) => common < network.commons.len(),
        BlockId::Point(point) => point < network.points.len(),
    };
    let held = interface.held.iter();
    if held.clone().any(|&(_, number)| number >= 6) {
        return Err(NetworkError::Node("a photo has six unknowns that may be held"));
    }
    let mut all = interface.all().chain(held.map(|&(photo, _)| BlockId::Photo(photo)));
    let missing = all.find(|&block| !there(block));
    missing.map_or(Ok(()), |block| Err(NetworkError::NoBlock(block)))
}

/// Replaces photos on trajectories, whose own parameters are fixed, by the coefficients of their trajectories.
pub fn with_coefficients(network: &Network, given: Interface) -> Interface {
    let mut flown = vec![None; network.photos.len()];
    let of_photos = network.mounts.iter().map(|mount| (mount.photo(), mount.trajectory()));
    of_photos.for_each(|(photo, trajectory)| flown[photo] = flown[photo].or(trajectory));
    let coefficients = |block: &BlockId| -> Vec<BlockId> {
        let trajectory = if let BlockId::Photo(photo) = *block { flown[photo] } else { None };
        let Some(trajectory) = trajectory else { return vec![*block] };
        let unknown = network.trajectories[trajectory].coefficients();
        unknown.filter(|&common| !network.commons[common].is_held()).map(BlockId::Common).collect()
    };
    let all = |blocks: &Vec<BlockId>| blocks.iter().flat_map(coefficients).collect();
    Interface { outer: all(&given.outer), below: given.below.iter().map(all).collect(), ..given }
}

/// Removes the weights of outer blocks, because they count in the node that eliminates them. Fixed parameters remain fixed.
pub fn release(network: &mut Network, interface: &Interface) {
    let outer = &interface.outer;
    let (films, _) = network.commons_by_block(&interface.indices(BlockId::Common));
    let mut photos_of = vec![0; network.cameras.len()];
    network.photos.iter().for_each(|photo| photos_of[photo.camera] += 1);
    let named = |camera: usize| outer.contains(&BlockId::Camera(camera));
    let mut cameras: Vec<usize> = (0..network.cameras.len()).filter(|&camera| named(camera)).collect();
    for block in outer {
        match *block {
            BlockId::Photo(own) => {
                let photo = &mut network.photos[own];
                free(&mut photo.sd);
                cameras.extend(Some(photo.camera).filter(|&camera| photos_of[camera] == 1));
                let film = films.get(own).into_iter().flatten();
                film.for_each(|&common| free(&mut network.commons[common].sd));
            }
            BlockId::Camera(_) => {}
            BlockId::Common(common) => free(&mut network.commons[common].sd),
            BlockId::Point(point) => free(&mut network.points[point].sd),
        }
    }
    for camera in cameras {
        free(&mut network.cameras[camera].sd);
        network.cameras[camera].covariance = None;
    }
}

/// Makes weighted parameters free.
fn free(sd: &mut [f64]) {
    sd.iter_mut().filter(|sd| **sd > 0.0).for_each(|sd| *sd = f64::INFINITY);
}
