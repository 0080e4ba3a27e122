//! Positions of shared cameras and shared parameters, for an elimination order by position.

use super::model::Bundle;
use crate::sorting::median;

impl Bundle {
    /// Returns the positions of the shared cameras: the medians of the positions of their photos.
    pub(super) fn places_of_cameras(&self, photos: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let mut of_cameras: Vec<Vec<[f64; 3]>> = vec![Vec::new(); self.blocks.shared.len()];
        for (place, block) in photos.iter().zip(&self.blocks.of_camera) {
            block.iter().for_each(|block| of_cameras[block - self.cameras.len()].push(*place));
        }
        of_cameras.into_iter().map(|places| middle(&places)).collect()
    }

    /// Returns the positions of the blocks of shared parameters: medians over their photos and points; `tied` are the points that are not
    /// local. Coefficients with local support have the position of the trajectory there.
    pub(super) fn places_of_commons(&self, photos: &[[f64; 3]], tied: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let mut of_commons: Vec<Vec<[f64; 3]>> = vec![Vec::new(); self.commons.len()];
        for (photo, &place) in photos.iter().enumerate() {
            self.mounts.always(photo).for_each(|common| of_commons[common].push(place));
        }
        self.mounts.places_of_coefficients().for_each(|(common, place)| of_commons[common].push(place));
        for (common, photo) in self.passages.own() {
            of_commons[common].push(photos[photo]);
        }
        for touches in self.observations.iter().map(|tied| &tied.touches) {
            let points =
                touches.points.iter().filter_map(|&point| tied.get(point.checked_sub(self.locals)?).copied());
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
