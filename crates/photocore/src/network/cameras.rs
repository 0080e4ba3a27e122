//! Cameras with free parameters: in the block of a single photo, or in a block of their own.

use std::ops::Range;

use nalgebra::DMatrix;

use super::median::median;
use super::model::Bundle;
use super::problem::Assembled;
use super::surroundings::Surroundings;
use super::{AdjustedPhoto, Network};
use crate::adjustment::{Adjustment, Problem};

/// An adjusted camera.
#[derive(Debug, Clone, PartialEq)]
pub struct AdjustedCamera {
    /// Adjusted parameters.
    pub parameters: Vec<f64>,
    /// Cofactors of the parameters (a priori unit weight): zero for fixed ones, NaN without cofactors.
    pub cofactors: DMatrix<f64>,
    /// Redundancy numbers of the parameters as their own observations; zero unless weighted, NaN without cofactors.
    pub redundancy: Vec<f64>,
    /// Diagonal of the normal equations including weights: the reciprocal cofactors if all other parameters were fixed. Zero for fixed
    /// parameters, NaN without cofactors.
    pub information: Vec<f64>,
    /// Number of photos.
    pub photos: usize,
    /// Number of active images of these photos.
    pub images: usize,
}

impl Network {
    /// Returns the free cameras of several photos (here or in other nodes) or of a mounted photo, ascending.
    pub(super) fn shared_cameras(&self, surroundings: &Surroundings) -> Vec<usize> {
        let mut photos = vec![0; self.cameras.len()];
        self.photos.iter().for_each(|photo| photos[photo.camera] += 1);
        // The block of a mounted photo cannot contain camera parameters.
        self.mounts.iter().for_each(|mount| photos[self.photos[mount.photo()].camera] += 1);
        surroundings.cameras().into_iter().for_each(|camera| photos[camera] += 2);
        (0..photos.len()).filter(|&camera| photos[camera] > 1 && !self.cameras[camera].is_held()).collect()
    }

    /// Returns the adjusted cameras, in the order of the network; `photos` are the adjusted photos.
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
            // Results of a camera without photos are undefined.
            let missing = if adjustment.cofactors.is_some() && camera.is_held() { 0.0 } else { f64::NAN };
            AdjustedCamera {
                parameters,
                cofactors: DMatrix::repeat(count, count, missing),
                redundancy: vec![missing; count],
                information: vec![missing; count],
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
                let own = model.of_photo(index);
                camera.inform(problem, own.start + 6..own.end, adjustment);
            }
        }
        for (shared, &index) in model.blocks.shared.iter().enumerate() {
            let block = model.cameras.len() + shared;
            cameras[index].take_block(model, block, adjustment, unknowns);
            cameras[index].inform(problem, model.of_block(block), adjustment);
        }
        for (camera, given) in cameras.iter_mut().zip(&self.cameras) {
            if let Some(redundancy) = given.redundancy(&camera.cofactors) {
                camera.redundancy = redundancy;
            }
        }
        cameras
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

impl AdjustedCamera {
    /// Copies the results of the camera of one photo, the last parameters of its block.
    fn take_over(&mut self, photo: &AdjustedPhoto) {
        let own = photo.camera.len();
        self.parameters.clone_from(&photo.camera);
        self.redundancy = photo.redundancy[6..].to_vec();
        self.cofactors = photo.cofactors.view((6, 6), (own, own)).into_owned();
    }

    /// Copies the diagonal of the normal equations; zero for fixed parameters.
    fn inform(&mut self, problem: &Problem<Bundle>, unknowns: Range<usize>, adjustment: &Adjustment) {
        let Some(all) = &adjustment.cofactors else { return };
        let first = problem.layout().all_retained().start;
        let of = |unknown: usize| {
            if problem.sd[unknown] == 0.0 { 0.0 } else { all.information[unknown - first] }
        };
        self.information = unknowns.map(of).collect();
    }

    /// Copies the results of a retained block.
    fn take_block(&mut self, model: &Bundle, block: usize, adjustment: &Adjustment, unknowns: &[f64]) {
        let own = model.of_block(block);
        self.parameters = unknowns[own.clone()].to_vec();
        if let Some(all) = &adjustment.cofactors {
            self.cofactors =
                DMatrix::from_row_slice(own.len(), own.len(), model.cofactors_of_block(all, block));
        }
        if let Some(all) = &adjustment.prior_redundancy {
            self.redundancy = all[own].to_vec();
        }
    }
}
