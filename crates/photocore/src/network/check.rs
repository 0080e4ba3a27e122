//! Consistency checks of networks.

use std::mem::discriminant;

use super::commons::CommonKind;
use super::error::NetworkError;
use super::image_corrections::{ImageCorrection, Requirements};
use super::input::{Image, Network};
use super::mounts::{AT_PHOTO, Mount, Mounts, Trajectory};
use super::observations::{Fault, Observation};
use crate::geometry::{ObjectSpace, PoseNumbers};

impl Network {
    #[doc(hidden)]
    pub fn check(&self) -> Result<(), NetworkError> {
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
        self.check_trajectories()?;
        self.check_mounts()?;
        let flies = self.flies();
        for (index, observation) in self.observations.iter().enumerate() {
            let checked = observation
                .check(self.points.len(), self.photos.len(), &self.commons)
                .and_then(|()| check_motion(observation, &flies));
            checked.map_err(|fault| NetworkError::Observation { index, kind: observation.kind(), fault })?;
        }
        self.check_image_corrections()?;
        let cartesian = self.space == ObjectSpace::Rectangular && self.refraction.is_none();
        if self.poses == PoseNumbers::Vectors && !cartesian { Err(NetworkError::Vectors) } else { Ok(()) }
    }

    /// Returns which photos are mounted on a trajectory only.
    fn flies(&self) -> Vec<bool> {
        let mut mounts = vec![(0, false); self.photos.len()];
        for mount in &self.mounts {
            let (count, flies) = &mut mounts[mount.photo()];
            *count += 1;
            *flies = mount.trajectory().is_some();
        }
        mounts.into_iter().map(|(count, flies)| flies && count == 1).collect()
    }

    /// Returns an error for invalid trajectories or coefficients, or if the number of image times is wrong.
    fn check_trajectories(&self) -> Result<(), NetworkError> {
        let of_kind = |all: &[usize], kind: CommonKind| {
            all.iter().all(|&common| self.commons.get(common).is_some_and(|own| own.kind == kind))
        };
        for (index, Trajectory { course, position, rotation }) in self.trajectories.iter().enumerate() {
            let sound = course.position.is_sound() && course.rotation.is_sound();
            if !sound
                || (position.len(), rotation.len()) != (course.position.count(), course.rotation.count())
                || !of_kind(position, CommonKind::PositionCoefficient)
                || !of_kind(rotation, CommonKind::RotationCoefficient)
            {
                return Err(NetworkError::Trajectory(index));
            }
        }
        let times = self.image_times.len();
        if times == 0 || times == self.images.len() { Ok(()) } else { Err(NetworkError::ImageTimes(times)) }
    }

    /// Returns an error for mounts that contradict the network or each other.
    fn check_mounts(&self) -> Result<(), NetworkError> {
        let mut mounted = vec![vec![]; self.photos.len()];
        let mut carries = vec![false; self.photos.len()];
        for (index, mount) in self.mounts.iter().enumerate() {
            let (photo, frame) = (mount.photo(), mount.frame());
            let of_type = |(common, kind): (usize, CommonKind)| {
                self.commons.get(common).is_some_and(|own| own.kind == kind)
            };
            let there = photo.max(frame.unwrap_or(photo)) < self.photos.len();
            let flies = mount.trajectory().is_none_or(|own| own < self.trajectories.len());
            if !there || !flies || !mount.unknowns().into_iter().all(of_type) {
                return Err(NetworkError::Mount(index));
            }
            // A mount on another frame is the only one; a trajectory precedes its sensor; types are distinct.
            let before: &mut Vec<&Mount> = &mut mounted[photo];
            let carried = frame.is_some_and(|frame| frame != photo);
            let again = |own: &&Mount| discriminant(*own) == discriminant(mount);
            if before.iter().any(|own| carried || mount.replaces() || again(own)) {
                return Err(NetworkError::Mount(index));
            }
            before.push(mount);
            frame.filter(|_| carried).into_iter().for_each(|frame| carries[frame] = true);
        }
        let on_another = |mount: &Mount| mount.frame().is_some_and(|frame| frame != mount.photo());
        let both = self.mounts.iter().position(|mount| on_another(mount) && carries[mount.photo()]);
        both.map_or(Ok(()), |index| Err(NetworkError::Mount(index)))?;
        self.check_flights()
    }

    /// Returns an error for image corrections that do not fit the network.
    fn check_image_corrections(&self) -> Result<(), NetworkError> {
        let of_type = |(common, kind): (usize, CommonKind)| {
            self.commons.get(common).is_some_and(|own| own.kind == kind)
        };
        if self.image_corrections.is_empty() {
            return Ok(());
        }
        let mut given: Vec<bool> = self.points.iter().map(|point| point.sd == [0.0; 3]).collect();
        let touched = self.observations.iter().flat_map(|own| own.touches().points);
        touched.for_each(|point| given[point] = false);
        let cameras = self.cameras.iter().map(|own| &own.camera).collect();
        let photos = self.photos.iter().map(|own| own.camera).collect();
        let required = Requirements { space: self.space, given, cameras, photos };
        let bad = |own: &ImageCorrection| !own.unknowns().into_iter().all(of_type) || !own.is_of(&required);
        self.image_corrections
            .iter()
            .position(bad)
            .map_or(Ok(()), |index| Err(NetworkError::ImageCorrection(index)))
    }

    /// Returns an error for times of photos and images outside their trajectory.
    fn check_flights(&self) -> Result<(), NetworkError> {
        if self.trajectories.is_empty() {
            return Ok(());
        }
        let known =
            Mounts::new((&self.mounts, self.photos.len()), (&self.trajectories, [0.0; 3]), &self.commons);
        let spans: Vec<(f64, f64)> = self.trajectories.iter().map(|own| own.course.span()).collect();
        let reach = |photo: usize, point: Option<usize>, at: f64| {
            let Some((trajectory, time)) = known.flight(photo, at) else { return Ok(()) };
            let (first, last) = spans[trajectory];
            if first <= time && time <= last {
                return Ok(());
            }
            Err(NetworkError::OutsideTrajectory { photo, point, trajectory, time, first, last })
        };
        let mut images = self.images.iter().zip(&self.image_times);
        images.try_for_each(|(image, &at)| reach(image.photo, Some(image.point), at))?;
        (0..self.photos.len()).try_for_each(|photo| reach(photo, None, AT_PHOTO))
    }
}

/// Returns an error for motion observations of photos that are not on a trajectory.
fn check_motion(observation: &Observation, flies: &[bool]) -> Result<(), Fault> {
    let at_rest = |&photo: &usize| observation.moves() && !flies[photo];
    let photo = observation.touches().photos.into_iter().find(at_rest);
    photo.map_or(Ok(()), |photo| Err(Fault::AtRest(photo)))
}
