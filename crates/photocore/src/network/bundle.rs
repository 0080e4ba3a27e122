//! Conversion of a network to observation equations.

use std::sync::OnceLock;

use super::blocks::Blocks;
use super::camera_priors::CameraPrior;
use super::commons::CartesianCommon;
use super::error::NetworkError;
use super::image_corrections::ImageCorrections;
use super::input::{Camera, Image, Network, Photo, Point, Screens};
use super::interface::BlockId;
use super::model::{Bundle, GivenDatum};
use super::mounts::{AT_PHOTO, Mounts};
use super::neighbourhood::TOGETHER;
use super::observations::{AssembledObservation, Fault, Observation, Touches};
use super::selection::Selected;
use crate::geometry::{Matrix3, ObjectSpace, POSE, PoseNumbers, Refraction, local_vertical};
use crate::parallel;

impl Network {
    /// Returns the observation equations of the active points; `images` are their images, `images_on` counts images by photo.
    pub(super) fn bundle(
        &self,
        selected: &mut Selected,
        images: Vec<Image>,
        images_on: Vec<usize>,
        middle: [f64; 3],
    ) -> Result<Bundle, NetworkError> {
        let origin = self.origin(middle);
        let points = parallel::map_in_place(selected.points.len(), TOGETHER, &|place| {
            let Point { coordinates, sd } = self.points[selected.points[place]];
            Point { coordinates: std::array::from_fn(|k| coordinates[k] - origin[k]), sd }
        });
        let mounts = self.placed_mounts(origin);
        let of_images = &selected.images.order;
        let image_times: Vec<f64> = match self.image_times[..] {
            [] => vec![],
            _ => of_images.iter().map(|&image| self.image_times[image]).collect(),
        };
        let mut bundle = Bundle {
            space: self.space,
            poses: self.poses,
            // Coordinates are relative to the origin; heights are not.
            refraction: self
                .refraction
                .map(|refraction| Refraction { datum: refraction.datum + origin[2], ..refraction }),
            cameras: self.photos.iter().map(|photo| self.camera(photo).camera.clone()).collect(),
            blocks: Blocks::new(
                self,
                self.shared_cameras(&selected.interface),
                &selected.interface.indices(BlockId::Common),
            ),
            camera_priors: vec![],
            commons: self.cartesian_commons(selected, &mounts, (&images, &image_times), middle),
            datum: self.given_datum(selected, &mounts),
            mounts,
            image_times,
            image_corrections: ImageCorrections::new(
                &self.image_corrections,
                (&selected.points, self.points.len()),
                self.photos.iter().map(|photo| photo.camera),
            ),
            origin,
            locals: selected.locals,
            points,
            images,
            point_images: std::mem::take(&mut selected.images),
            turning: vec![false; self.photos.len()],
            images_on,
            observations: vec![],
            linear: vec![],
            screens: Screens::default(),
            parts: OnceLock::new(),
        };
        let prior = |(index, camera): (usize, &Camera)| {
            camera.covariance.as_ref()?;
            CameraPrior::of(camera, self.first_parameter(&bundle, index)?)
        };
        bundle.camera_priors = self.cameras.iter().enumerate().filter_map(prior).collect();
        bundle.assign_cells();
        bundle.observations = self.active_observations(selected, &bundle)?;
        Ok(bundle)
    }

    /// Returns the mounts with trajectories relative to an origin.
    fn placed_mounts(&self, origin: [f64; 3]) -> Mounts {
        Mounts::new((&self.mounts, self.photos.len()), (&self.trajectories, origin), &self.commons)
    }

    /// Returns the shared parameters, each with the number of dependent active observations and images.
    fn cartesian_commons(
        &self,
        selected: &Selected,
        mounts: &Mounts,
        (images, times): (&[Image], &[f64]),
        middle: [f64; 3],
    ) -> Vec<CartesianCommon> {
        let (origin, vertical) = (self.origin(middle), self.vertical(middle));
        let place = |common| CartesianCommon::new(common, self.space, origin, &vertical);
        let mut placed: Vec<CartesianCommon> = self.commons.iter().map(place).collect();
        let time = |image: usize| times.get(image).copied().unwrap_or(AT_PHOTO);
        let of_image = |(image, own): (usize, &Image)| mounts.commons(own.photo, time(image));
        images.iter().enumerate().flat_map(of_image).for_each(|common| placed[common].uses += 1);
        for Touches { photos, commons, .. } in
            selected.observations.iter().map(|&k| self.observations[k].touches())
        {
            let of_poses = photos.into_iter().flat_map(|photo| mounts.commons(photo, AT_PHOTO));
            let own = commons.into_iter().map(|(common, _)| common);
            own.chain(of_poses).for_each(|common| placed[common].uses += 1);
        }
        placed
    }

    /// Returns the axes of shifts and drifts as rows: X, Y, Z or, in geographic space, east, north and up at the centre of the photos.
    fn vertical(&self, middle: [f64; 3]) -> Matrix3 {
        match self.space {
            ObjectSpace::Rectangular => Matrix3::identity(),
            ObjectSpace::Geographic(_) => local_vertical(middle[0], middle[1]),
        }
    }

    /// Returns true if the network defines its datum.
    #[doc(hidden)]
    pub fn is_placed(&self, selected: &Selected) -> bool {
        self.given_datum(selected, &self.placed_mounts([0.0; 3])).placed
    }

    /// Returns the datum information of the network itself.
    fn given_datum(&self, selected: &Selected, mounts: &Mounts) -> GivenDatum {
        // Angles alone define neither position nor scale.
        let positions = if let PoseNumbers::Angles(_) = self.poses { 3 } else { POSE };
        let own = |photo: &Photo| photo.sd[..positions].iter().any(|sd| sd.is_finite());
        let counts = |index: usize| !mounts.is_carried(index) && own(&self.photos[index]);
        let mut photos = (0..self.photos.len()).filter(|&index| counts(index));
        let fixed = |index: usize| self.photos[index].sd[..positions].iter().all(|&sd| sd == 0.0);
        let (placed, anchor) = match (photos.next(), photos.next()) {
            _ if mounts.trajectories().iter().any(|own| self.is_given(&own.position)) => (true, None),
            _ if selected.points.iter().any(|&point| self.points[point].held() != [false; 3]) => (true, None),
            (None, _) => (false, None),
            (first, None) if first.is_some_and(fixed) => (false, first),
            _ => (true, None),
        };
        GivenDatum { placed, anchor, minimum: None }
    }

    /// Returns true if all coefficients are weighted or fixed.
    fn is_given(&self, coefficients: &[usize]) -> bool {
        coefficients.iter().all(|&common| self.commons[common].sd.iter().all(|sd| sd.is_finite()))
    }

    /// Returns the index of the first parameter of a camera; None without photos.
    fn first_parameter(&self, model: &Bundle, camera: usize) -> Option<usize> {
        Some(match model.blocks.shared.binary_search(&camera) {
            Ok(shared) => model.of_block(model.cameras.len() + shared).start,
            Err(_) => {
                model.of_block(self.photos.iter().position(|photo| photo.camera == camera)?).start + POSE
            }
        })
    }

    /// Returns the active additional observations, last those of single local points in the order of the points.
    fn active_observations(
        &self,
        selected: &Selected,
        model: &Bundle,
    ) -> Result<Vec<AssembledObservation>, NetworkError> {
        let Selected { points, observations, .. } = selected;
        if observations.is_empty() {
            return Ok(vec![]);
        }
        let mut place = vec![0; self.points.len()];
        points.iter().enumerate().for_each(|(own, &point)| place[point] = own);
        let active = |&index: &usize| {
            let observation: &Observation = &self.observations[index];
            let touches = observation.touches();
            let points = touches.points.iter().map(|&point| place[point]).collect();
            let touches = Touches { points, ..touches };
            let blocks = model.blocks_of(&touches);
            let root = match blocks.len() {
                0 => Err(Fault::NothingUnknown),
                _ => observation.root(),
            };
            let kind = observation.kind();
            Ok(AssembledObservation {
                index,
                touches,
                blocks,
                root: root.map_err(|fault| NetworkError::Observation { index, kind, fault })?,
                observation: observation.clone(),
            })
        };
        let active = |place: usize| active(&observations[place]);
        let active = parallel::map_in_place(observations.len(), TOGETHER, &active);
        let mut active = active.into_iter().collect::<Result<Vec<AssembledObservation>, NetworkError>>()?;
        // Observations in the order of the points, which is usual, are not moved.
        if !active.is_sorted_by_key(AssembledObservation::local) {
            active.sort_by_cached_key(AssembledObservation::local);
        }
        Ok(active)
    }
}
