//! What the pose of an image is made of where it is not the six unknowns of its photo: photos on a frame, images on a trajectory.
//!
//! Each kind is a file with a type that implements [`MountModel`], and a line of `kinds!` below. A pose is handed on from mount to mount
//! with the list of the blocks that it is made of, and how it steps with the unknowns of each.

mod chain;

use std::borrow::Cow;
use std::ops::Deref;

use nalgebra::{Matrix3xX, Matrix6};

use super::commons::{Common, CommonKind, CommonState};
use super::in_block::InBlock;
use crate::geometry::{self, ObjectSpace, Orientation, POSE, Vector3};

pub use chain::Chain;
pub(super) use chain::Composed;

/// The photos themselves: the time of their images counts from theirs (see [`OnTrajectory`]).
pub(super) const AT_PHOTO: f64 = 0.0;

/// A trajectory of a network: a pose as a function of time, and the common unknowns that are its coefficients.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    /// Table and bases. Rectangular coordinates as those of photos and points; geocentric ones where the space is geographic.
    pub course: geometry::trajectory::Trajectory,
    /// Common unknowns: those of positions, one for each function of the basis.
    pub position: Vec<usize>,
    /// The same of rotations.
    pub rotation: Vec<usize>,
}

impl Trajectory {
    /// The common unknowns that are its coefficients, positions first.
    pub fn coefficients(&self) -> impl Iterator<Item = usize> + Clone {
        self.position.iter().chain(&self.rotation).copied()
    }

    /// The common unknowns that are the coefficients of functions that are never zero.
    pub fn everywhere(&self) -> impl Iterator<Item = usize> {
        let own = [(&self.course.position, &self.position), (&self.course.rotation, &self.rotation)];
        own.into_iter().filter(|(basis, _)| !basis.is_local()).flat_map(|(_, all)| all.iter().copied())
    }
}

/// How the pose of a photo, or of its images, follows from another pose and from common unknowns.
pub trait MountModel {
    /// The photo.
    fn photo(&self) -> usize;

    /// The photo whose pose it begins with instead of its own, whose six unknowns then count for nothing.
    fn frame(&self) -> Option<usize> {
        None
    }

    /// The trajectory that it is on.
    fn trajectory(&self) -> Option<usize> {
        None
    }

    /// That, and the time there of an image with a number, common unknowns as they are given.
    fn flight(&self, _at: f64, _known: &Mounts) -> Option<(usize, f64)> {
        None
    }

    /// The common unknowns that it is given, with their types.
    fn unknowns(&self) -> Vec<(usize, CommonKind)>;

    /// The common unknowns that a pose at a time is made of, in the order of [`MountModel::compose`].
    fn commons(&self, at: f64, known: &Mounts) -> Vec<usize>;

    /// Those that poses at all times are made of.
    fn always(&self, known: &Mounts) -> Vec<usize>;

    /// Whether the pose that it begins with, and the six unknowns of that, count for nothing.
    fn replaces(&self) -> bool {
        false
    }

    /// Where it replaces: the common unknowns that every pose is made of, and that stand in one block.
    fn everywhere<'a>(&self, _known: &'a Mounts) -> Box<dyn Iterator<Item = usize> + 'a> {
        Box::new(std::iter::empty())
    }

    /// Whether images of one photo have poses of their own.
    fn is_timed(&self) -> bool;

    /// How the pose that is asked for moves; None where it does not.
    fn moving(&self, _at: f64, _grounds: &Grounds<'_>) -> Option<Moving> {
        None
    }

    /// Leads from the pose that it begins with to the one that is asked for.
    fn compose(&self, at: f64, grounds: &Grounds<'_>, pose: &mut Chain);
}

macro_rules! kinds {
    ($($module:ident::$name:ident;)*) => {
        $(mod $module;
        pub use $module::$name;)*

        /// A mount of any kind.
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

/// The mounts of a network by their photos, in their order; none at all where there are none.
#[derive(Debug, Default)]
pub struct Mounts {
    by_photo: Vec<Vec<Mount>>,
    /// The trajectories that they name, their coordinates counted from the origin.
    trajectories: Vec<Trajectory>,
    /// Of the common unknowns, what is given as the first component, and whether that is known.
    given: Vec<(f64, bool)>,
}

impl Mounts {
    /// Those of so many photos, with trajectories whose coordinates are to be counted from an origin, and the common unknowns.
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

    /// A trajectory.
    pub fn trajectory(&self, trajectory: usize) -> &Trajectory {
        &self.trajectories[trajectory]
    }

    /// The first component of a common unknown as it is given, and whether it is known.
    pub fn given(&self, common: usize) -> (f64, bool) {
        self.given[common]
    }

    /// Those of a photo.
    #[inline]
    pub(super) fn of(&self, photo: usize) -> &[Mount] {
        self.by_photo.get(photo).map_or(&[], Vec::as_slice)
    }

    /// All of them.
    pub(super) fn all(&self) -> impl Iterator<Item = &Mount> {
        self.by_photo.iter().flatten()
    }

    /// The photo whose six unknowns the pose of a photo begins with: its frame, or itself.
    pub(super) fn carrier(&self, photo: usize) -> usize {
        self.of(photo).first().and_then(|mount| mount.frame()).unwrap_or(photo)
    }

    /// Whether the six unknowns of a photo count for nothing: others do, or coefficients.
    pub(super) fn is_carried(&self, photo: usize) -> bool {
        self.carrier(photo) != photo || self.is_replaced(photo)
    }

    fn is_replaced(&self, photo: usize) -> bool {
        self.of(photo).iter().any(|mount| mount.replaces())
    }

    /// The main block of a pose, given those of common unknowns: that of its carrier, also where the six of that count for nothing and no
    /// common unknown stands for them.
    pub(super) fn main_block(&self, photo: usize, block: &dyn Fn(usize) -> Option<InBlock>) -> usize {
        let carrier = self.carrier(photo);
        let replacing = self.of(carrier).iter().find(|mount| mount.replaces());
        let own = replacing.and_then(|mount| mount.everywhere(self).find_map(block));
        own.map_or(carrier, |own| own.block)
    }

    /// All trajectories.
    pub(super) fn trajectories(&self) -> &[Trajectory] {
        &self.trajectories
    }

    /// The trajectory that a photo is on.
    pub(super) fn trajectory_of(&self, photo: usize) -> Option<usize> {
        [photo, self.carrier(photo)]
            .iter()
            .find_map(|&photo| self.of(photo).iter().find_map(|own| own.trajectory()))
    }

    /// That, and the time there of an image of the photo with a number, common unknowns as they are given.
    pub(super) fn flight(&self, photo: usize, at: f64) -> Option<(usize, f64)> {
        self.of(self.carrier(photo)).first().and_then(|mount| mount.flight(at, self))
    }

    /// The common unknowns that all poses of a photo are made of.
    pub(super) fn always(&self, photo: usize) -> impl Iterator<Item = usize> {
        let carrier = Some(self.carrier(photo)).filter(|&carrier| carrier != photo);
        let photos = carrier.into_iter().chain([photo]);
        photos.flat_map(|photo| self.of(photo)).flat_map(|mount| mount.always(self))
    }

    /// The coefficients of functions that are zero at most times, each with the place of its trajectory in the middle of the others.
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

    /// The common unknowns that a pose is made of, each once.
    #[inline]
    pub(super) fn commons(&self, photo: usize, at: f64) -> Vec<usize> {
        // It is asked of every image.
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

    /// Whether images of a photo have poses of their own.
    pub(super) fn are_timed(&self, photo: usize) -> bool {
        [photo, self.carrier(photo)].iter().any(|&photo| self.of(photo).iter().any(|mount| mount.is_timed()))
    }
}

/// How a photo on a trajectory moves, in the axes of the object space and about its own.
#[derive(Debug, Clone)]
pub struct Moving {
    /// C', in a second.
    pub velocity: Vector3,
    /// w, in radians in a second.
    pub rate: Vector3,
    /// The partials of C' by unknowns of retained blocks.
    pub velocity_by: Vec<(InBlock, Matrix3xX<f64>)>,
    /// The same of w.
    pub rate_by: Vec<(InBlock, Matrix3xX<f64>)>,
}

/// What poses are composed of, at given values of the unknowns.
pub struct Grounds<'a> {
    pub(super) space: ObjectSpace,
    pub(super) mounts: &'a Mounts,
    /// Photos as their own six unknowns have them.
    pub(super) photo: &'a dyn Fn(usize) -> Orientation,
    /// Common unknowns, and where each is unless it is known.
    pub(super) common: &'a dyn Fn(usize) -> (Cow<'a, CommonState>, Option<InBlock>),
}

impl Grounds<'_> {
    /// The trajectories, and what is given.
    pub fn known(&self) -> &Mounts {
        self.mounts
    }

    /// A common unknown, and where it is unless it is known.
    pub fn common(&self, common: usize) -> (Cow<'_, CommonState>, Option<InBlock>) {
        (self.common)(common)
    }

    /// A pose of a photo; None where nothing but its six unknowns counts.
    pub(super) fn composed(&self, photo: usize, at: f64) -> Option<Composed> {
        let mut own = Composed::new(true);
        self.compose(photo, at, &mut own).then_some(own)
    }

    /// The same put in the place of another; false where nothing but its six unknowns counts.
    pub(super) fn compose(&self, photo: usize, at: f64, own: &mut Composed) -> bool {
        if self.mounts.of(photo).is_empty() {
            return false;
        }
        let Composed { orientation, chain, .. } = own;
        self.lead(photo, at, chain);
        *orientation = Orientation::of_pose(self.space, chain.pose());
        if chain.steps() {
            // In rectangular space its unknowns step as the pose does.
            if orientation.stepping_pose().is_none() {
                chain.lead_by(&orientation.unknowns_by_step().unwrap_or_else(|| Matrix6::repeat(f64::NAN)));
            }
            own.number(self.mounts.main_block(photo, &|common| (self.common)(common).1));
        }
        true
    }

    /// How a photo moves; None where it is on no trajectory, or on a frame that is.
    pub(super) fn moving(&self, photo: usize, at: f64) -> Option<Moving> {
        match self.mounts.of(photo) {
            [mount] => mount.moving(at, self),
            _ => None,
        }
    }

    /// Leads from mount to mount to a pose.
    fn lead(&self, photo: usize, at: f64, chain: &mut Chain) {
        let carrier = self.mounts.carrier(photo);
        if carrier != photo {
            self.lead(carrier, at, chain);
        } else if !self.mounts.is_replaced(photo) {
            let own = (self.photo)(photo);
            chain.stand(*own.pose());
            if chain.steps() {
                chain.add([(InBlock::whole(photo, POSE), 1.0)].into_iter(), own.steps());
            }
        }
        self.mounts.of(photo).iter().for_each(|mount| mount.compose(at, self, chain));
    }
}

#[cfg(test)]
pub(super) mod tests;
