//! Where the unknowns of photos, cameras and common unknowns are among the retained ones.

use super::{Network, Photo};
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
    /// The block of each common unknown, unless it is known.
    pub of_common: Vec<Option<usize>>,
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
        let unknown = network.commons.iter().enumerate().filter(|(_, common)| !common.is_held());
        for (block, (index, common)) in (photos + shared.len()..).zip(unknown) {
            of_common[index] = Some(block);
            add(common.sd.len());
        }
        let mut squares = vec![0];
        let widths = first.windows(2).map(|ends| ends[1] - ends[0]);
        widths.for_each(|width| squares.push(squares[squares.len() - 1] + width.pow(2)));
        let of_camera = |photo: &Photo| Some(photos + shared.binary_search(&photo.camera).ok()?);
        Self { of_camera: network.photos.iter().map(of_camera).collect(), first, squares, shared, of_common }
    }
}
