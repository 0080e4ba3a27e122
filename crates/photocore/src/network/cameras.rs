//! Cameras whose parameters are unknown: those of one photo are unknowns of that, those of several are blocks of their own.

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
    /// Its parameters.
    pub parameters: Vec<f64>,
    /// Their cofactors (a priori unit weight): zero for those that are held; NaN where there are none.
    pub cofactors: DMatrix<f64>,
    /// Redundancy numbers of the parameters as observations of themselves; zero unless weighted, NaN where there are no cofactors.
    pub redundancy: Vec<f64>,
    /// Their diagonal of the normal equations, weights counted: the reciprocal cofactor that each would have if all other unknowns were
    /// known; zero for those that are held, NaN where there are no cofactors.
    pub information: Vec<f64>,
    /// How many photos it has.
    pub photos: usize,
    /// How many images on these took part.
    pub images: usize,
}

impl Network {
    /// The cameras with unknown parameters that several photos share, here or in other nodes, or one that is mounted has, ascending.
    pub(super) fn shared_cameras(&self, surroundings: &Surroundings) -> Vec<usize> {
        let mut photos = vec![0; self.cameras.len()];
        self.photos.iter().for_each(|photo| photos[photo.camera] += 1);
        // The unknowns of a photo that is mounted are of no camera.
        self.mounts.iter().for_each(|mount| photos[self.photos[mount.photo()].camera] += 1);
        surroundings.cameras().into_iter().for_each(|camera| photos[camera] += 2);
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
    /// The places of the shared cameras: the medians of those of their photos.
    pub(super) fn places_of_cameras(&self, photos: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let mut of_cameras: Vec<Vec<[f64; 3]>> = vec![Vec::new(); self.blocks.shared.len()];
        for (place, block) in photos.iter().zip(&self.blocks.of_camera) {
            block.iter().for_each(|block| of_cameras[block - self.cameras.len()].push(*place));
        }
        of_cameras.into_iter().map(|places| middle(&places)).collect()
    }

    /// The places of the common unknowns that have blocks: the medians of those of the photos and points that they belong to; `tied`
    /// are those of the points that are not local. Those of a trajectory that count at some times only are where it is then.
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
            let points = touches.points.iter().map(|&point| tied[point - self.locals]);
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

/// The medians of coordinates.
fn middle(places: &[[f64; 3]]) -> [f64; 3] {
    [0, 1, 2].map(|k| median(places.iter().map(|place| place[k]).collect()).unwrap_or_default())
}

impl AdjustedCamera {
    /// Takes over what was found of the camera of one photo, the last unknowns of that.
    fn take_over(&mut self, photo: &AdjustedPhoto) {
        let own = photo.camera.len();
        self.parameters.clone_from(&photo.camera);
        self.redundancy = photo.redundancy[6..].to_vec();
        self.cofactors = photo.cofactors.view((6, 6), (own, own)).into_owned();
    }

    /// Takes the diagonal of the normal equations of its unknowns; a held one has none.
    fn inform(&mut self, problem: &Problem<Bundle>, unknowns: Range<usize>, adjustment: &Adjustment) {
        let Some(all) = &adjustment.cofactors else { return };
        let first = problem.layout().all_retained().start;
        let of = |unknown: usize| {
            if problem.sd[unknown] == 0.0 { 0.0 } else { all.information[unknown - first] }
        };
        self.information = unknowns.map(of).collect();
    }

    /// Takes what was found of a retained block of its own.
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
