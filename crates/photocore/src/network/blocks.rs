//! Positions of the parameters of photos, cameras and shared parameters among the retained ones.

use std::collections::{BTreeMap, BTreeSet};

use super::commons::{Common, InBlock};
use super::input::{Network, Photo};
use super::interface::{BlockId, Interface};
use super::mounts::Trajectory;
use crate::geometry::POSE;

/// Retained blocks, except points: photos (pose, own camera, own film parameters), then shared cameras, then shared parameters. The pose of
/// a photo on a frame is fixed.
#[derive(Debug)]
pub(super) struct Blocks {
    /// Block i contains the retained parameters `first[i]..first[i + 1]`.
    pub first: Vec<usize>,
    /// Start of the cofactors of each block among the cofactors of all retained blocks.
    pub squares: Vec<usize>,
    /// Indices of the shared cameras in the network.
    pub shared: Vec<usize>,
    /// Block of each photo's camera if it is shared.
    pub of_camera: Vec<Option<usize>>,
    /// Position of each shared parameter, None if it is fixed.
    pub of_common: Vec<Option<InBlock>>,
    /// Shared parameters in the block of each photo, in their order behind pose and camera.
    pub of_photo: Vec<Vec<usize>>,
    /// Shared parameters of each block behind the cameras, in their order.
    pub commons: Vec<Vec<usize>>,
}

impl Blocks {
    /// Numbers the blocks. `shared` lists the cameras with own blocks, ascending. Shared parameters `elsewhere`, used by other nodes of a
    /// larger network, have individual blocks.
    pub fn new(network: &Network, shared: Vec<usize>, elsewhere: &BTreeSet<usize>) -> Self {
        let mut first = vec![0];
        let mut add = |width: usize| first.push(first[first.len() - 1] + width);
        let photos = network.photos.len();
        let mut of_common = vec![None; network.commons.len()];
        // Appends parameters behind the first ones of a block; returns the resulting width.
        let mut place = |block: usize, behind: usize, together: &[usize]| {
            let dim = |common: usize| network.commons[common].sd.len();
            let width = behind + together.iter().map(|&common| dim(common)).sum::<usize>();
            let mut first = behind;
            for &common in together {
                of_common[common] = Some(InBlock { block, first, width });
                first += dim(common);
            }
            width
        };
        let (of_photo, commons) = network.commons_by_block(elsewhere);
        for (index, photo) in network.photos.iter().enumerate() {
            let camera = network.camera(photo);
            let own = !camera.is_held() && shared.binary_search(&photo.camera).is_err();
            let behind = POSE + if own { camera.sd.len() } else { 0 };
            add(of_photo.get(index).map_or(behind, |films| place(index, behind, films)));
        }
        shared.iter().for_each(|&camera| add(network.cameras[camera].sd.len()));
        for (block, together) in (photos + shared.len()..).zip(&commons) {
            add(place(block, 0, together));
        }
        let mut squares = vec![0];
        let widths = first.windows(2).map(|ends| ends[1] - ends[0]);
        widths.for_each(|width| squares.push(squares[squares.len() - 1] + width.pow(2)));
        let of_camera = |photo: &Photo| Some(photos + shared.binary_search(&photo.camera).ok()?);
        let of_camera = network.photos.iter().map(of_camera).collect();
        Self { of_camera, first, squares, shared, of_common, of_photo, commons }
    }
}

impl Blocks {
    /// Returns the shared parameters of a block in their order; in the block of a photo they follow pose and camera.
    pub fn commons_of(&self, block: usize) -> &[usize] {
        let photos = self.of_camera.len();
        let own = match block.checked_sub(photos + self.shared.len()) {
            Some(place) => self.commons.get(place),
            None => self.of_photo.get(block),
        };
        own.map_or(&[], Vec::as_slice)
    }
}

impl Network {
    /// Returns the free shared parameters: lists by photo (or an empty list), and lists by block behind the cameras.
    ///
    /// Coefficients with global support of one trajectory share a block, because every image of it depends on all of them. So do parameters
    /// of the same corrections, which are in the block of a photo if only its images depend on them.
    #[doc(hidden)]
    pub fn commons_by_block(&self, elsewhere: &BTreeSet<usize>) -> (Vec<Vec<usize>>, Vec<Vec<usize>>) {
        let mut leader: Vec<usize> = (0..self.commons.len()).collect();
        let mut uses = vec![0; self.commons.len()];
        self.trajectories.iter().flat_map(Trajectory::everywhere).for_each(|common| uses[common] += 1);
        for trajectory in &self.trajectories {
            let alone = |&common: &usize| !self.commons[common].is_held() && uses[common] == 1;
            let together: Vec<usize> = trajectory.everywhere().filter(alone).collect();
            together.iter().for_each(|&common| leader[common] = together[0]);
        }
        let mut of_photo = vec![];
        let mut placed: Vec<bool> = self.commons.iter().map(Common::is_held).collect();
        for (image_corrections, together) in self.commons_of_corrections(elsewhere) {
            // The block of an image with a mount is its frame or trajectory.
            let photo =
                self.image_corrections[image_corrections[0]].photo().filter(|_| self.mounts.is_empty());
            if let (Some(photo), [_]) = (photo, &*image_corrections) {
                together.iter().for_each(|&common| placed[common] = true);
                of_photo.resize(self.photos.len(), vec![]);
                of_photo[photo] = together;
            } else {
                together.iter().for_each(|&common| leader[common] = together[0]);
            }
        }
        let mut members = vec![vec![]; self.commons.len()];
        for (common, &leader) in leader.iter().enumerate().filter(|&(own, _)| !placed[own]) {
            members[leader].push(common);
        }
        (of_photo, members.into_iter().filter(|own| !own.is_empty()).collect())
    }

    /// Returns the free shared parameters that all images of a correction depend on, grouped by equal lists of corrections. Parameters that
    /// are used elsewhere are excluded.
    fn commons_of_corrections(&self, elsewhere: &BTreeSet<usize>) -> BTreeMap<Vec<usize>, Vec<usize>> {
        let mut having = vec![vec![]; self.commons.len()];
        let mut everywhere: Vec<bool> =
            (0..self.commons.len()).map(|own| !elsewhere.contains(&own)).collect();
        for (passage, own) in self.image_corrections.iter().enumerate() {
            let all = own.everywhere();
            for (common, _) in own.unknowns() {
                having[common].push(passage);
                everywhere[common] &= all.contains(&common);
            }
        }
        let mut found: BTreeMap<Vec<usize>, Vec<usize>> = BTreeMap::new();
        for (common, image_corrections) in having.into_iter().enumerate() {
            if !image_corrections.is_empty() && everywhere[common] && !self.commons[common].is_held() {
                found.entry(image_corrections).or_default().push(common);
            }
        }
        found
    }
}

impl Network {
    /// Returns the free cameras of several photos (here or in other nodes) or of a mounted photo, ascending.
    pub(super) fn shared_cameras(&self, interface: &Interface) -> Vec<usize> {
        let mut photos = vec![0; self.cameras.len()];
        self.photos.iter().for_each(|photo| photos[photo.camera] += 1);
        // The block of a mounted photo cannot contain camera parameters.
        self.mounts.iter().for_each(|mount| photos[self.photos[mount.photo()].camera] += 1);
        interface.indices(BlockId::Camera).into_iter().for_each(|camera| photos[camera] += 2);
        (0..photos.len()).filter(|&camera| photos[camera] > 1 && !self.cameras[camera].is_held()).collect()
    }
}
