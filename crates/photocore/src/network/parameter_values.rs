//! Parameters of photos, shared cameras and shared parameters before the adjustment: values, observed values, standard deviations.

use super::input::{Camera, Network, Photo};
use super::interface::{BlockId, Interface};
use super::model::Bundle;
use crate::adjustment::median;
use crate::geometry::{ObjectSpace, Orientation, POSE, PoseNumbers, Vector3, nearest_turns};

impl Network {
    /// Returns the projection centre for six pose parameters.
    pub(super) fn centre(&self, pose: &[f64; POSE]) -> Vector3 {
        match self.poses {
            PoseNumbers::Angles(_) => self.space.cartesian([pose[0], pose[1], pose[2]]),
            PoseNumbers::Vectors => Orientation::new(self.poses, self.space, pose).centre(),
        }
    }

    /// Returns the origin of coordinates in the adjustment: a point near the photos, which avoids rounding errors of large coordinates.
    /// Medians are robust against single wrong positions. The origin is zero for geographic space, because differences are geocentric. It
    /// is zero for poses in vectors, whose translations rotate, and for rotating bodies with inertial tables.
    pub(super) fn origin(&self, middle: [f64; 3]) -> [f64; 3] {
        let turns = self.trajectories.iter().any(|own| own.course.body.is_some());
        match (self.space, self.poses) {
            (ObjectSpace::Rectangular, PoseNumbers::Angles(_)) if !turns => middle.map(f64::round),
            _ => [0.0; 3],
        }
    }

    /// Returns the medians of the coordinates of the photos.
    pub(super) fn middle(&self) -> [f64; 3] {
        let middle = |k: usize| median(self.photos.iter().map(|photo| photo.pose[k]).collect());
        std::array::from_fn(|k| middle(k).unwrap_or_default())
    }

    pub(super) fn camera(&self, photo: &Photo) -> &Camera {
        &self.cameras[photo.camera]
    }

    /// Returns the standard deviations of photos, shared cameras and shared parameters; zero for `unused` and carried photos, for cameras
    /// of such photos only, and for shared parameters without active observations.
    pub(super) fn parameter_sd(
        &self,
        model: &Bundle,
        interface: &Interface,
        unused: impl Fn(usize) -> bool,
    ) -> Vec<f64> {
        let mut all = Vec::new();
        let mut used = vec![false; self.cameras.len()];
        interface.indices(BlockId::Camera).into_iter().for_each(|camera| used[camera] = true);
        let (commons, photos) = (interface.indices(BlockId::Common), interface.indices(BlockId::Photo));
        let of_commons = |own: &[usize], elsewhere: bool| {
            let of_common = |&common: &usize| {
                let is_used = elsewhere || model.commons[common].uses > 0 || commons.contains(&common);
                self.commons[common].sd.iter().map(move |&sd| if is_used { sd } else { 0.0 })
            };
            own.iter().flat_map(of_common).collect::<Vec<f64>>()
        };
        for (index, photo) in self.photos.iter().enumerate() {
            let own = if model.has_own_camera(index) { &self.camera(photo).sd[..] } else { &[] };
            used[photo.camera] |= !unused(index);
            let held = unused(index) || model.is_carried(index);
            all.extend(photo.sd.iter().chain(own).map(|&sd| if held { 0.0 } else { sd }));
            all.extend(of_commons(model.blocks.commons_of(index), photos.contains(&index)));
        }
        for &camera in &model.blocks.shared {
            all.extend(self.cameras[camera].sd.iter().map(|&sd| if used[camera] { sd } else { 0.0 }));
        }
        model.blocks.commons.iter().for_each(|own| all.extend(of_commons(own, false)));
        all
    }

    /// Returns the values of photos at given poses, shared cameras and shared parameters.
    pub(super) fn parameter_values(&self, model: &Bundle, pose: impl Fn(&Photo) -> [f64; POSE]) -> Vec<f64> {
        let mut all = Vec::new();
        for (index, photo) in self.photos.iter().enumerate() {
            all.extend(pose(photo));
            if model.has_own_camera(index) {
                all.extend(self.camera(photo).camera.parameters());
            }
            // Shared parameters are relative to their given values.
            all.resize(all.len() + model.of_block(index).len() - model.of_photo(index).len(), 0.0);
        }
        all.extend(model.blocks.shared.iter().flat_map(|&camera| self.cameras[camera].camera.parameters()));
        all.resize(model.parameter_unknowns().len(), 0.0);
        all
    }

    /// Returns the observed pose of a photo, with angles shifted by full circles to the initial ones.
    pub(super) fn observed_pose(&self, photo: &Photo) -> [f64; POSE] {
        let near = nearest_turns(photo.observed, photo.pose);
        let turning = |k: usize| match self.poses {
            PoseNumbers::Angles(_) => k >= 3 || k == 0 && self.space != ObjectSpace::Rectangular,
            PoseNumbers::Vectors => false,
        };
        std::array::from_fn(|k| if turning(k) { near[k] } else { photo.observed[k] })
    }

    /// Returns true if the attitude of a photo steps by a rotation vector: a fixed angle must remain exact.
    pub(super) fn turns(&self, photo: usize) -> bool {
        let fixed = self.photos[photo].sd[3..].contains(&0.0);
        !fixed && matches!(self.poses, PoseNumbers::Angles(_))
    }
}
