//! Interface of a node to the larger network: checks, trajectories, and weights of outer blocks.

use photocore::network::{BlockOf, Network, NetworkError, Surroundings};

/// Returns an error for indices of missing blocks.
pub fn check_blocks(network: &Network, surroundings: &Surroundings) -> Result<(), NetworkError> {
    let there = |block: BlockOf| match block {
        BlockOf::Photo(photo) => photo < network.photos.len(),
        BlockOf::Camera(camera) => camera < network.cameras.len(),
        BlockOf::Common(common) => common < network.commons.len(),
        BlockOf::Point(point) => point < network.points.len(),
    };
    let held = surroundings.held.iter();
    if held.clone().any(|&(_, number)| number >= 6) {
        return Err(NetworkError::Node("a photo has six unknowns that may be held"));
    }
    let mut all = surroundings.all().chain(held.map(|&(photo, _)| BlockOf::Photo(photo)));
    let missing = all.find(|&block| !there(block));
    missing.map_or(Ok(()), |block| Err(NetworkError::NoBlock(block)))
}

/// Replaces photos on trajectories, whose own parameters are fixed, by the coefficients of their trajectories.
pub fn with_coefficients(network: &Network, given: Surroundings) -> Surroundings {
    let mut flown = vec![None; network.photos.len()];
    let of_photos = network.mounts.iter().map(|mount| (mount.photo(), mount.trajectory()));
    of_photos.for_each(|(photo, trajectory)| flown[photo] = flown[photo].or(trajectory));
    let coefficients = |block: &BlockOf| -> Vec<BlockOf> {
        let trajectory = if let BlockOf::Photo(photo) = *block { flown[photo] } else { None };
        let Some(trajectory) = trajectory else { return vec![*block] };
        let unknown = network.trajectories[trajectory].coefficients();
        unknown.filter(|&common| !network.commons[common].is_held()).map(BlockOf::Common).collect()
    };
    let all = |blocks: &Vec<BlockOf>| blocks.iter().flat_map(coefficients).collect();
    Surroundings { outer: all(&given.outer), below: given.below.iter().map(all).collect(), ..given }
}

/// Removes the weights of outer blocks, because they count in the node that eliminates them. Fixed parameters remain fixed.
pub fn release(network: &mut Network, surroundings: &Surroundings) {
    let outer = &surroundings.outer;
    let (films, _) = network.commons_by_block(&surroundings.indices(BlockOf::Common));
    let mut photos_of = vec![0; network.cameras.len()];
    network.photos.iter().for_each(|photo| photos_of[photo.camera] += 1);
    let named = |camera: usize| outer.contains(&BlockOf::Camera(camera));
    let mut cameras: Vec<usize> = (0..network.cameras.len()).filter(|&camera| named(camera)).collect();
    for block in outer {
        match *block {
            BlockOf::Photo(own) => {
                let photo = &mut network.photos[own];
                free(&mut photo.sd);
                cameras.extend(Some(photo.camera).filter(|&camera| photos_of[camera] == 1));
                let film = films.get(own).into_iter().flatten();
                film.for_each(|&common| free(&mut network.commons[common].sd));
            }
            BlockOf::Camera(_) => {}
            BlockOf::Common(common) => free(&mut network.commons[common].sd),
            BlockOf::Point(point) => free(&mut network.points[point].sd),
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
