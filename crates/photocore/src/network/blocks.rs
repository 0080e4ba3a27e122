//! Where the unknowns of photos, cameras and common unknowns are among the retained ones.

use super::in_block::InBlock;
use super::{Network, Photo, Trajectory};
use crate::geometry::POSE;

/// The retained blocks before those of points: photos (six of the pose, then those of a camera of their own; six that are held where it is
/// on a frame), then shared cameras, then common unknowns.
#[derive(Debug)]
pub(super) struct Blocks {
    /// The unknowns of block i are `first[i]..first[i + 1]` of the retained ones.
    pub first: Vec<usize>,
    /// Where the cofactors of each block start among those of all retained ones.
    pub squares: Vec<usize>,
    /// The cameras that several photos share, as the network numbers them.
    pub shared: Vec<usize>,
    /// The block of each photo's camera where that is shared.
    pub of_camera: Vec<Option<usize>>,
    /// Where each common unknown is, unless it is known.
    pub of_common: Vec<Option<InBlock>>,
    /// The common unknowns of each block after those of cameras, as they stand in it.
    pub commons: Vec<Vec<usize>>,
}

impl Blocks {
    /// `shared` are the cameras that have a block of their own, ascending.
    pub fn new(network: &Network, shared: Vec<usize>) -> Self {
        let mut first = vec![0];
        let mut add = |width: usize| first.push(first[first.len() - 1] + width);
        for photo in &network.photos {
            let camera = network.camera(photo);
            let own = !camera.is_held() && shared.binary_search(&photo.camera).is_err();
            add(POSE + if own { camera.sd.len() } else { 0 });
        }
        shared.iter().for_each(|&camera| add(network.cameras[camera].sd.len()));
        let photos = network.photos.len();
        let mut of_common = vec![None; network.commons.len()];
        let commons = network.commons_by_block();
        for (block, together) in (photos + shared.len()..).zip(&commons) {
            let ends: Vec<usize> = together
                .iter()
                .scan(0, |end, &common| {
                    *end += network.commons[common].sd.len();
                    Some(*end)
                })
                .collect();
            let width = ends[ends.len() - 1];
            for (&common, end) in together.iter().zip(ends) {
                let first = end - network.commons[common].sd.len();
                of_common[common] = Some(InBlock { block, first, width });
            }
            add(width);
        }
        let mut squares = vec![0];
        let widths = first.windows(2).map(|ends| ends[1] - ends[0]);
        widths.for_each(|width| squares.push(squares[squares.len() - 1] + width.pow(2)));
        let of_camera = |photo: &Photo| Some(photos + shared.binary_search(&photo.camera).ok()?);
        let of_camera = network.photos.iter().map(of_camera).collect();
        Self { of_camera, first, squares, shared, of_common, commons }
    }
}

impl Network {
    /// The common unknowns that are not known, together those that are one block: the coefficients of one trajectory by functions that are
    /// never zero, all of which every image of it touches, and those of the film of a photo.
    fn commons_by_block(&self) -> Vec<Vec<usize>> {
        let mut leader: Vec<usize> = (0..self.commons.len()).collect();
        let mut uses = vec![0; self.commons.len()];
        self.trajectories.iter().flat_map(Trajectory::everywhere).for_each(|common| uses[common] += 1);
        for trajectory in &self.trajectories {
            let alone = |&common: &usize| !self.commons[common].is_held() && uses[common] == 1;
            let together: Vec<usize> = trajectory.everywhere().filter(alone).collect();
            together.iter().for_each(|&common| leader[common] = together[0]);
        }
        for group in self.passages.iter().flat_map(|own| own.together()) {
            let together: Vec<usize> =
                group.into_iter().filter(|&common| !self.commons[common].is_held()).collect();
            together.iter().for_each(|&common| leader[common] = together[0]);
        }
        let mut members = vec![vec![]; self.commons.len()];
        for (common, &leader) in leader.iter().enumerate().filter(|&(own, _)| !self.commons[own].is_held()) {
            members[leader].push(common);
        }
        members.into_iter().filter(|own| !own.is_empty()).collect()
    }
}
