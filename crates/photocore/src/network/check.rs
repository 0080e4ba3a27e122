//! Networks that contradict themselves are refused.

use std::mem::discriminant;

use super::surroundings::{BlockOf, Surroundings};
use super::{Image, Mount, Network, NetworkError};
use crate::geometry::{ObjectSpace, PoseNumbers};

impl Network {
    /// Refuses a network that contradicts itself.
    pub(super) fn check(&self) -> Result<(), NetworkError> {
        let counts = (self.photos.len(), self.points.len());
        let outside = |image: &Image| image.photo >= counts.0 || image.point >= counts.1;
        if let Some(bad) = self.images.iter().position(outside) {
            return Err(NetworkError::Index(bad));
        }
        for (index, photo) in self.photos.iter().enumerate() {
            if photo.camera >= self.cameras.len() {
                return Err(NetworkError::NoCamera(index));
            }
        }
        for (index, camera) in self.cameras.iter().enumerate() {
            if camera.sd.len() != camera.camera.parameter_names().len() {
                return Err(NetworkError::CameraDeviations(index));
            }
            if !camera.has_sound_covariance() {
                return Err(NetworkError::CameraCovariance(index));
            }
            let known = camera.camera.parameter_names();
            let unknowns = known.len() - camera.camera.constants();
            if let Some(free) = (unknowns..known.len()).find(|&k| camera.sd[k] != 0.0) {
                return Err(NetworkError::CameraConstant { camera: index, parameter: known[free].0 });
            }
        }
        for (index, common) in self.commons.iter().enumerate() {
            if common.sd.len() != common.kind.unknowns().len() {
                return Err(NetworkError::CommonDeviations(index));
            }
        }
        self.check_mounts()?;
        for (index, observation) in self.observations.iter().enumerate() {
            let checked = observation.check(self.points.len(), self.photos.len(), &self.commons);
            checked.map_err(|fault| NetworkError::Observation { index, kind: observation.kind(), fault })?;
        }
        let cartesian = self.space == ObjectSpace::Rectangular && self.refraction.is_none();
        if self.poses == PoseNumbers::Vectors && !cartesian { Err(NetworkError::Vectors) } else { Ok(()) }
    }

    /// Refuses mounts that contradict the network or each other.
    fn check_mounts(&self) -> Result<(), NetworkError> {
        let mut mounted = vec![vec![]; self.photos.len()];
        let mut carries = vec![false; self.photos.len()];
        for (index, mount) in self.mounts.iter().enumerate() {
            let (photo, frame) = (mount.photo(), mount.frame());
            let of_type =
                |&common: &usize| self.commons.get(common).map(|own| own.kind) == Some(mount.unknowns());
            let there = photo.max(frame.unwrap_or(photo)) < self.photos.len();
            if !there || !mount.commons(None).iter().all(of_type) {
                return Err(NetworkError::Mount(index));
            }
            // On a frame first, then what moves it, once each.
            let before: &mut Vec<&Mount> = &mut mounted[photo];
            if before.iter().any(|own| frame.is_some() || discriminant(*own) == discriminant(mount)) {
                return Err(NetworkError::Mount(index));
            }
            before.push(mount);
            frame.into_iter().for_each(|frame| carries[frame] = true);
        }
        let both = self.mounts.iter().position(|mount| mount.frame().is_some() && carries[mount.photo()]);
        both.map_or(Ok(()), |index| Err(NetworkError::Mount(index)))
    }

    /// Refuses names of blocks that are not there.
    pub(super) fn check_blocks(&self, surroundings: &Surroundings) -> Result<(), NetworkError> {
        let there = |block: BlockOf| match block {
            BlockOf::Photo(photo) => photo < self.photos.len(),
            BlockOf::Camera(camera) => camera < self.cameras.len(),
            BlockOf::Common(common) => common < self.commons.len(),
            BlockOf::Point(point) => point < self.points.len(),
        };
        let held = surroundings.held.iter();
        if held.clone().any(|&(_, number)| number >= 6) {
            return Err(NetworkError::Node("a photo has six unknowns that may be held"));
        }
        let mut all = surroundings.all().chain(held.map(|&(photo, _)| BlockOf::Photo(photo)));
        let missing = all.find(|&block| !there(block));
        missing.map_or(Ok(()), |block| Err(NetworkError::NoBlock(block)))
    }
}
