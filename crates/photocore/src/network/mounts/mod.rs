//! Poses of images that differ from the six parameters of their photo: photos on a frame, images on a trajectory.
//!
//! Each type is a file with an implementation of [`MountModel`], and a line of `kinds!` below. A pose is composed mount by mount, with the
//! list of its blocks and its partials by the parameters of each.

mod chain;

use std::borrow::Cow;
use std::ops::Deref;

use nalgebra::{Matrix3xX, Matrix6};

use super::commons::{Common, CommonKind, CommonState, InBlock};
use crate::geometry::{self, ObjectSpace, Orientation, POSE, Vector3};

pub(super) use chain::Composed;
pub use chain::PartialPose;

/// Image number of the photo itself: times of images are relative to it (see [`OnTrajectory`]).
pub(super) const AT_PHOTO: f64 = 0.0;

/// Trajectory of a network: a pose as a function of time, and the shared parameters that are its coefficients.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    /// Table and bases, in the coordinates of photos and points; geocentric if the space is geographic.
    pub course: geometry::trajectory::Trajectory,
    /// Shared parameters of positions, one for each function of the basis.
    pub position: Vec<usize>,
    /// Shared parameters of rotations, one for each function of the basis.
    pub rotation: Vec<usize>,
}

impl Trajectory {
    /// Returns the shared parameters that are its coefficients, positions first.
    pub fn coefficients(&self) -> impl Iterator<Item = usize> + Clone {
        self.position.iter().chain(&self.rotation).copied()
    }

    /// Returns the coefficients of functions with global support.
    pub fn everywhere(&self) -> impl Iterator<Item = usize> {
        let own = [(&self.course.position, &self.position), (&self.course.rotation, &self.rotation)];
        own.into_iter().filter(|(basis, _)| !basis.is_local()).flat_map(|(_, all)| all.iter().copied())
    }
}

/// Dependence of the pose of a photo, or of its images, on another pose and on shared parameters.
pub trait MountModel {
    /// Returns the photo.
    fn photo(&self) -> usize;

    /// Returns the photo whose pose replaces the own six parameters as the start of the composition.
    fn frame(&self) -> Option<usize> {
        None
    }

    /// Returns the trajectory of the mount.
    fn trajectory(&self) -> Option<usize> {
        None
    }

    /// Returns the trajectory and the time of an image there, at the given values of shared parameters.
    fn flight(&self, _at: f64, _known: &Mounts) -> Option<(usize, f64)> {
        None
    }

    /// Returns the shared parameters of the mount, with their types.
    fn unknowns(&self) -> Vec<(usize, CommonKind)>;

    /// Returns the shared parameters of a pose at a time, in the order of [`MountModel::compose`].
    fn commons(&self, at: f64, known: &Mounts) -> Vec<usize>;

    /// Returns the shared parameters of the poses at all times.
    fn always(&self, known: &Mounts) -> Vec<usize>;

    /// Returns true if the mount replaces the preceding pose and its six parameters.
    fn replaces(&self) -> bool {
        false
    }

    /// For a replacing mount, returns the shared parameters of every pose, which are in one block.
    fn everywhere<'a>(&self, _known: &'a Mounts) -> Box<dyn Iterator<Item = usize> + 'a> {
        Box::new(std::iter::empty())
    }

    /// Returns true if images of one photo have individual poses.
    fn is_timed(&self) -> bool;

    /// Returns velocity and rotation rate of the composed pose; None for a static one.
    fn moving(&self, _at: f64, _grounds: &PoseInputs<'_>) -> Option<PhotoMotion> {
        None
    }

    /// Composes the preceding pose with the mount.
    fn compose(&self, at: f64, pose_inputs: &PoseInputs<'_>, pose: &mut PartialPose);
}

macro_rules! kinds {
    ($($module:ident::$name:ident;)*) => {
        $(mod $module;
        pub use $module::$name;)*

        /// A mount of any type.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub enum Mount {
            $(#[doc = concat!("See [`", stringify!($name), "`].")] $name($name),)*
        }

        $(impl From<$name> for Mount {
            fn from(mount: $name) -> Self {
                Self::$name(mount)
            }
        })*

        impl Deref for Mount {
            type Target = dyn MountModel;

            fn deref(&self) -> &Self::Target {
                match self {
                    $(Self::$name(own) => own,)*
                }
            }
        }
    };
}

kinds! {
    on_frame::OnFrame;
    on_trajectory::OnTrajectory;
}

/// Mounts of a network by photo, in their order; empty for a network without mounts.
#[derive(Debug, Default)]
pub struct Mounts {
    by_photo: Vec<Vec<Mount>>,
    /// Trajectories of the mounts, with coordinates relative to the origin.
    trajectories: Vec<Trajectory>,
    /// First given component of each shared parameter, and whether it is fixed.
    given: Vec<(f64, bool)>,
}

impl Mounts {
    /// Returns the mounts of `photos` photos, with trajectories relative to an origin, and the shared parameters.
    pub(super) fn new(
        (mounts, photos): (&[Mount], usize),
        (trajectories, origin): (&[Trajectory], [f64; 3]),
        commons: &[Common],
    ) -> Self {
        if mounts.is_empty() {
            return Self::default();
        }
        let mut by_photo = vec![vec![]; photos];
        mounts.iter().for_each(|mount| by_photo[mount.photo()].push(*mount));
        let counted =
            |own: &Trajectory| Trajectory { course: own.course.counted_from(origin), ..own.clone() };
        Self {
            by_photo,
            trajectories: trajectories.iter().map(counted).collect(),
            given: commons.iter().map(|own| (own.position[0], own.sd[0] == 0.0)).collect(),
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.by_photo.is_empty()
    }

    /// Returns a trajectory.
    pub fn trajectory(&self, trajectory: usize) -> &Trajectory {
        &self.trajectories[trajectory]
    }

    /// Returns the first given component of a shared parameter, and whether it is fixed.
    pub fn given(&self, common: usize) -> (f64, bool) {
        self.given[common]
    }

    #[inline]
    pub(super) fn of(&self, photo: usize) -> &[Mount] {
        self.by_photo.get(photo).map_or(&[], Vec::as_slice)
    }

    pub(super) fn all(&self) -> impl Iterator<Item = &Mount> {
        self.by_photo.iter().flatten()
    }

    /// Returns the photo whose pose is the start of the composition: the frame of a photo, or itself.
    pub(super) fn carrier(&self, photo: usize) -> usize {
        self.of(photo).first().and_then(|mount| mount.frame()).unwrap_or(photo)
    }

    /// Returns true if the six parameters of a photo are replaced by another photo or by coefficients.
    pub(super) fn is_carried(&self, photo: usize) -> bool {
        self.carrier(photo) != photo || self.is_replaced(photo)
    }

    fn is_replaced(&self, photo: usize) -> bool {
        self.of(photo).iter().any(|mount| mount.replaces())
    }

    /// Returns the main block of a pose, given the blocks of shared parameters. It is the block of its carrier, even if the carrier has no
    /// free parameters, unless coefficients replace it.
    pub(super) fn main_block(&self, photo: usize, block: &dyn Fn(usize) -> Option<InBlock>) -> usize {
        let carrier = self.carrier(photo);
        let replacing = self.of(carrier).iter().find(|mount| mount.replaces());
        let own = replacing.and_then(|mount| mount.everywhere(self).find_map(block));
        own.map_or(carrier, |own| own.block)
    }

    pub(super) fn trajectories(&self) -> &[Trajectory] {
        &self.trajectories
    }

    pub(super) fn trajectory_of(&self, photo: usize) -> Option<usize> {
        [photo, self.carrier(photo)]
            .iter()
            .find_map(|&photo| self.of(photo).iter().find_map(|own| own.trajectory()))
    }

    /// Returns the trajectory and the time of an image of a photo there, at the given values of shared parameters.
    pub(super) fn flight(&self, photo: usize, at: f64) -> Option<(usize, f64)> {
        self.of(self.carrier(photo)).first().and_then(|mount| mount.flight(at, self))
    }

    /// Returns the shared parameters of all poses of a photo.
    pub(super) fn always(&self, photo: usize) -> impl Iterator<Item = usize> {
        let carrier = Some(self.carrier(photo)).filter(|&carrier| carrier != photo);
        let photos = carrier.into_iter().chain([photo]);
        photos.flat_map(|photo| self.of(photo)).flat_map(|mount| mount.always(self))
    }

    /// Returns the coefficients of functions with local support, each with the position of its trajectory at the centre of the support.
    pub(super) fn places_of_coefficients(&self) -> impl Iterator<Item = (usize, [f64; 3])> {
        self.trajectories.iter().flat_map(|Trajectory { course, position, rotation }| {
            [(&course.position, position), (&course.rotation, rotation)].into_iter().flat_map(
                move |(basis, all)| {
                    let placed = move |(k, &common): (usize, &usize)| {
                        Some((common, course.place(basis.middle(k)?).into()))
                    };
                    all.iter().enumerate().filter_map(placed)
                },
            )
        })
    }

    /// Returns the distinct shared parameters of a pose.
    #[inline]
    pub(super) fn commons(&self, photo: usize, at: f64) -> Vec<usize> {
        // Called for every image.
        if self.is_empty() { vec![] } else { self.commons_of_mounts(photo, at) }
    }

    fn commons_of_mounts(&self, photo: usize, at: f64) -> Vec<usize> {
        let carrier = self.carrier(photo);
        let mut all = if carrier == photo { vec![] } else { self.commons_of_mounts(carrier, at) };
        for common in self.of(photo).iter().flat_map(|mount| mount.commons(at, self)) {
            if !all.contains(&common) {
                all.push(common);
            }
        }
        all
    }

    /// Returns true if images of a photo have individual poses.
    pub(super) fn are_timed(&self, photo: usize) -> bool {
        [photo, self.carrier(photo)].iter().any(|&photo| self.of(photo).iter().any(|mount| mount.is_timed()))
    }
}

/// Velocity and rotation rate of a photo on a trajectory, in the axes of the object space and of the photo.
#[derive(Debug, Clone)]
pub struct PhotoMotion {
    /// Velocity C' per second.
    pub velocity: Vector3,
    /// Rotation rate w in radians per second.
    pub rate: Vector3,
    /// Partials of C' by parameters of retained blocks.
    pub velocity_by: Vec<(InBlock, Matrix3xX<f64>)>,
    /// Partials of w by parameters of retained blocks.
    pub rate_by: Vec<(InBlock, Matrix3xX<f64>)>,
}

/// Input of the composition of poses, at given parameter values.
pub struct PoseInputs<'a> {
    pub(super) space: ObjectSpace,
    pub(super) mounts: &'a Mounts,
    /// Orientations of photos from their own six parameters.
    pub(super) photo: &'a dyn Fn(usize) -> Orientation,
    /// Shared parameters, each with its position in the blocks; None if it is fixed.
    pub(super) common: &'a dyn Fn(usize) -> (Cow<'a, CommonState>, Option<InBlock>),
}

impl PoseInputs<'_> {
    /// Returns the trajectories and the given values.
    pub fn known(&self) -> &Mounts {
        self.mounts
    }

    /// Returns a shared parameter, and its position in the blocks; None if it is fixed.
    pub fn common(&self, common: usize) -> (Cow<'_, CommonState>, Option<InBlock>) {
        (self.common)(common)
    }

    /// Returns the composed pose of a photo; None for a photo without mounts.
    pub(super) fn composed(&self, photo: usize, at: f64) -> Option<Composed> {
        let mut own = Composed::new(true);
        self.compose(photo, at, &mut own).then_some(own)
    }

    /// Composes the pose into existing storage; returns false for a photo without mounts.
    pub(super) fn compose(&self, photo: usize, at: f64, own: &mut Composed) -> bool {
        if self.mounts.of(photo).is_empty() {
            return false;
        }
        let Composed { orientation, chain, .. } = own;
        self.lead(photo, at, chain);
        *orientation = Orientation::of_pose(self.space, chain.pose());
        if chain.steps() {
            // In rectangular space, its parameters step like the pose.
            if orientation.stepping_pose().is_none() {
                chain.lead_by(&orientation.unknowns_by_step().unwrap_or_else(|| Matrix6::repeat(f64::NAN)));
            }
            own.number(self.mounts.main_block(photo, &|common| (self.common)(common).1));
        }
        true
    }

    /// Returns the motion of a photo; None unless its only mount is a trajectory.
    pub(super) fn moving(&self, photo: usize, at: f64) -> Option<PhotoMotion> {
        match self.mounts.of(photo) {
            [mount] => mount.moving(at, self),
            _ => None,
        }
    }

    /// Composes a pose mount by mount.
    fn lead(&self, photo: usize, at: f64, chain: &mut PartialPose) {
        let carrier = self.mounts.carrier(photo);
        if carrier != photo {
            self.lead(carrier, at, chain);
        } else if !self.mounts.is_replaced(photo) {
            let own = (self.photo)(photo);
            chain.set_pose(*own.pose());
            if chain.steps() {
                chain.add([(InBlock::whole(photo, POSE), 1.0)].into_iter(), own.steps());
            }
        }
        self.mounts.of(photo).iter().for_each(|mount| mount.compose(at, self, chain));
    }
}

#[cfg(test)]
pub(super) mod tests;
