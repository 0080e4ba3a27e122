//! Cameras whose parameters are unknown: those of one photo are unknowns of that, those of several are blocks of their own.

use super::model::Bundle;
use super::precision::median;
use super::problem::Assembled;
use super::{AdjustedPhoto, Network};
use crate::adjustment::Adjustment;

/// An adjusted camera.
#[derive(Debug, Clone, PartialEq)]
pub struct AdjustedCamera {
    /// Its parameters.
    pub parameters: Vec<f64>,
    /// Their cofactors (a priori unit weight), row by row: zero for those that are held; NaN where there are none.
    pub cofactors: Vec<f64>,
    /// Redundancy numbers of the parameters as observations of themselves; zero unless weighted, NaN where there are no cofactors.
    pub redundancy: Vec<f64>,
    /// How many photos it has.
    pub photos: usize,
    /// How many images on these took part.
    pub images: usize,
}

impl Network {
    /// The cameras with unknown parameters that several photos share, ascending.
    pub(super) fn shared_cameras(&self) -> Vec<usize> {
        let mut photos = vec![0; self.cameras.len()];
        self.photos.iter().for_each(|photo| photos[photo.camera] += 1);
        (0..photos.len()).filter(|&camera| photos[camera] > 1 && !self.cameras[camera].is_held()).collect()
    }

    /// The adjusted cameras, in the order of the network; `photos` are the adjusted photos.
    pub(super) fn adjusted_cameras(
        &self,
        Assembled { problem, .. }: &Assembled,
        adjustment: &Adjustment,
        unknowns: &[f64],
        photos: &[AdjustedPhoto],
    ) -> Vec<AdjustedCamera> {
        let model = &problem.model;
        let given = |camera: &super::Camera| {
            let parameters = camera.camera.parameters();
            let count = parameters.len();
            // Nothing is asked of a camera without photos.
            let missing = if adjustment.cofactors.is_some() && camera.is_held() { 0.0 } else { f64::NAN };
            AdjustedCamera {
                parameters,
                cofactors: vec![missing; count * count],
                redundancy: vec![missing; count],
                photos: 0,
                images: 0,
            }
        };
        let mut cameras: Vec<AdjustedCamera> = self.cameras.iter().map(given).collect();
        for (index, (given, photo)) in self.photos.iter().zip(photos).enumerate() {
            let camera = &mut cameras[given.camera];
            camera.photos += 1;
            camera.images += photo.images;
            if model.has_own_camera(index) {
                camera.take_over(photo);
            }
        }
        for (shared, &index) in model.shared.iter().enumerate() {
            cameras[index].take_block(model, model.cameras.len() + shared, adjustment, unknowns);
        }
        cameras
    }
}

impl Bundle {
    /// The place of a shared camera: the median of those of its photos.
    pub(super) fn place_of_camera(&self, shared: usize, photos: &[[f64; 3]]) -> [f64; 3] {
        let block = Some(self.cameras.len() + shared);
        let own = || photos.iter().zip(&self.camera_block).filter(|(_, camera)| **camera == block);
        std::array::from_fn(|k| median(own().map(|(place, _)| place[k]).collect()).unwrap_or_default())
    }
}

impl AdjustedCamera {
    /// Takes over what was found of the camera of one photo, the last unknowns of that.
    fn take_over(&mut self, photo: &AdjustedPhoto) {
        let width = photo.redundancy.len();
        self.parameters.clone_from(&photo.camera);
        self.redundancy = photo.redundancy[6..].to_vec();
        self.cofactors =
            photo.cofactors.chunks_exact(width).skip(6).flat_map(|row| &row[6..]).copied().collect();
    }

    /// Takes what was found of a kept block.
    fn take_block(&mut self, model: &Bundle, block: usize, adjustment: &Adjustment, unknowns: &[f64]) {
        let range = model.of_block(block);
        self.parameters = unknowns[range.clone()].to_vec();
        if let Some(cofactors) = &adjustment.cofactors {
            let start: usize = (0..block).map(|block| model.of_block(block).len().pow(2)).sum();
            self.cofactors = cofactors.kept[start..start + range.len().pow(2)].to_vec();
        }
        if let Some(redundancy) = &adjustment.prior_redundancy {
            self.redundancy = redundancy[range].to_vec();
        }
    }
}
