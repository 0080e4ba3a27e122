//! Block layout of a network, and positions of shared blocks for an elimination order by position.

use std::collections::BTreeSet;

use super::error::NetworkError;
use super::interface::{BlockId, Interface};
use super::model::Bundle;
use crate::adjustment::median;
use crate::normals::Layout;

/// Returns the block layout of a model at given positions, with its terms.
pub(super) fn layout(model: &Bundle, places: Vec<[f64; 3]>) -> Result<Layout, NetworkError> {
    let (groups, retained) = (model.point_images.start[model.locals], model.points.len() - model.locals);
    let widths = model.blocks.first.windows(2).map(|pair| pair[1] - pair[0]);
    let widths: Vec<usize> = widths.chain(vec![3; retained]).collect();
    let main_of = (0..groups).map(|image| model.main_block(image) as u32).collect();
    let mut layout = Layout::new(2, 3, &widths, model.point_images.start[..=model.locals].to_vec(), main_of)?;
    if !(model.blocks.shared.is_empty() && model.mounts.is_empty() && model.image_corrections.is_empty()) {
        let (mut shared_ptr, mut shared) = (Vec::with_capacity(groups + 1), Vec::with_capacity(groups));
        shared_ptr.push(0);
        let beside = |image| model.blocks_of_image(image).skip(1).map(|block| block as u32).collect();
        let mut of_photo: Vec<Option<Vec<u32>>> = vec![None; model.cameras.len()];
        for (index, image) in model.images[..groups].iter().enumerate() {
            if model.has_uniform_corrections(image.photo) {
                shared.extend_from_slice(of_photo[image.photo].get_or_insert_with(|| beside(index)));
            } else {
                shared.extend(beside(index));
            }
            shared_ptr.push(shared.len());
        }
        layout = layout.with_shared(shared_ptr, shared)?;
    }
    Ok(layout.with_places(places)?.with_terms(model.terms())?.with_pairs(model.pairs())?)
}

impl Interface {
    /// Returns the distinct retained blocks of the outer parameters, and of the contribution of each child node. Several shared parameters
    /// may be in one block.
    ///
    /// # Errors
    /// A block without parameters of its own here.
    pub(super) fn blocks(
        &self,
        model: &Bundle,
        points: &[usize],
    ) -> Result<(Vec<u32>, Vec<Vec<u32>>), NetworkError> {
        let (photos, retained) = (model.cameras.len(), &points[model.locals..]);
        let block = |&block: &BlockId| {
            let found = match block {
                BlockId::Photo(photo) => Some(photo),
                BlockId::Camera(camera) => {
                    model.blocks.shared.binary_search(&camera).ok().map(|shared| photos + shared)
                }
                BlockId::Common(common) => model.blocks.of_common[common].map(|own| own.block),
                BlockId::Point(point) => retained
                    .iter()
                    .position(|&own| own == point)
                    .map(|place| model.parameter_blocks() + place),
            };
            found.map(|block| block as u32).ok_or(NetworkError::NoBlock(block))
        };
        let blocks = |all: &Vec<BlockId>| -> Result<Vec<u32>, NetworkError> {
            let mut seen = BTreeSet::new();
            let mut found = all.iter().map(block).collect::<Result<Vec<u32>, NetworkError>>()?;
            found.retain(|&block| seen.insert(block));
            Ok(found)
        };
        Ok((blocks(&self.outer)?, self.below.iter().map(blocks).collect::<Result<_, _>>()?))
    }
}

impl Bundle {
    /// Returns the positions of the shared cameras: the medians of the positions of their photos.
    pub(super) fn places_of_cameras(&self, photos: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let mut of_cameras: Vec<Vec<[f64; 3]>> = vec![Vec::new(); self.blocks.shared.len()];
        for (place, block) in photos.iter().zip(&self.blocks.of_camera) {
            block.iter().for_each(|block| of_cameras[block - self.cameras.len()].push(*place));
        }
        of_cameras.into_iter().map(|places| middle(&places)).collect()
    }

    /// Returns the positions of the blocks of shared parameters: medians over their photos and points; `retained` are the points that are not
    /// local. Coefficients with local support have the position of the trajectory there.
    pub(super) fn places_of_commons(&self, photos: &[[f64; 3]], retained: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let mut of_commons: Vec<Vec<[f64; 3]>> = vec![Vec::new(); self.commons.len()];
        for (photo, &place) in photos.iter().enumerate() {
            self.mounts.always(photo).for_each(|common| of_commons[common].push(place));
        }
        self.mounts.places_of_coefficients().for_each(|(common, place)| of_commons[common].push(place));
        for (common, photo) in self.image_corrections.own() {
            of_commons[common].push(photos[photo]);
        }
        for touches in self.observations.iter().map(|active| &active.touches) {
            let points = touches
                .points
                .iter()
                .filter_map(|&point| retained.get(point.checked_sub(self.locals)?).copied());
            let places: Vec<[f64; 3]> =
                points.chain(touches.photos.iter().map(|&photo| photos[photo])).collect();
            touches.commons.iter().for_each(|&(common, _)| of_commons[common].extend(&places));
        }
        let of_block = |all: &Vec<usize>| {
            let places: Vec<[f64; 3]> = all.iter().flat_map(|&common| of_commons[common].clone()).collect();
            middle(&places)
        };
        self.blocks.commons.iter().map(of_block).collect()
    }
}

/// Returns the component-wise median of coordinates.
fn middle(places: &[[f64; 3]]) -> [f64; 3] {
    [0, 1, 2].map(|k| median(places.iter().map(|place| place[k]).collect()).unwrap_or_default())
}
