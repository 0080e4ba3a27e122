//! Where the unknowns of photos, cameras and common unknowns are among the retained ones.

use std::collections::{BTreeMap, BTreeSet};

use super::commons::Common;
use super::in_block::InBlock;
use super::{Network, Photo, Trajectory};
use crate::geometry::POSE;

/// The retained blocks before those of points: photos (six of the pose, then those of a camera of their own, then those of their film; six
/// that are held where it is on a frame), then shared cameras, then common unknowns.
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
    /// The common unknowns of each photo, as they stand in its block behind pose and camera.
    pub of_photo: Vec<Vec<usize>>,
    /// The common unknowns of each block after those of cameras, as they stand in it.
    pub commons: Vec<Vec<usize>>,
}

impl Blocks {
    /// `shared` are the cameras that have a block of their own, ascending; so have the common unknowns `elsewhere`, which other nodes of a
    /// larger network touch, each.
    pub fn new(network: &Network, shared: Vec<usize>, elsewhere: &BTreeSet<usize>) -> Self {
        let mut first = vec![0];
        let mut add = |width: usize| first.push(first[first.len() - 1] + width);
        let photos = network.photos.len();
        let mut of_common = vec![None; network.commons.len()];
        // Behind so many unknowns of a block; returns how many it then has.
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
    /// The common unknowns of a block, as they stand in it: those of a photo behind pose and camera.
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
    /// The common unknowns that are not known: those in the blocks of photos, photo by photo, or none at all, and those of the blocks behind.
    ///
    /// Together are the coefficients of one trajectory by functions that are never zero, all of which every image of it touches, and what
    /// the same passages have everywhere: in the block of a photo where that is the only one to pass them.
    pub(super) fn commons_by_block(&self, elsewhere: &BTreeSet<usize>) -> (Vec<Vec<usize>>, Vec<Vec<usize>>) {
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
        for (passages, together) in self.passed_together(elsewhere) {
            // The block of an image with a mount is that of its frame or trajectory.
            let photo = self.passages[passages[0]].photo().filter(|_| self.mounts.is_empty());
            if let (Some(photo), [_]) = (photo, &*passages) {
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

    /// The common unknowns that are not known and that passages have everywhere, together those of which that is the same passages; but for
    /// those that are touched elsewhere.
    fn passed_together(&self, elsewhere: &BTreeSet<usize>) -> BTreeMap<Vec<usize>, Vec<usize>> {
        let mut having = vec![vec![]; self.commons.len()];
        let mut everywhere: Vec<bool> =
            (0..self.commons.len()).map(|own| !elsewhere.contains(&own)).collect();
        for (passage, own) in self.passages.iter().enumerate() {
            let all = own.everywhere();
            for (common, _) in own.unknowns() {
                having[common].push(passage);
                everywhere[common] &= all.contains(&common);
            }
        }
        let mut found: BTreeMap<Vec<usize>, Vec<usize>> = BTreeMap::new();
        for (common, passages) in having.into_iter().enumerate() {
            if !passages.is_empty() && everywhere[common] && !self.commons[common].is_held() {
                found.entry(passages).or_default().push(common);
            }
        }
        found
    }
}
