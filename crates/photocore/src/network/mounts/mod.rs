//! What the pose of an image is made of where it is not the six unknowns of its photo: photos on a frame, photos that move.
//!
//! Each kind is a file with a type that implements [`MountModel`], and a line of `kinds!` below. A pose is handed on from mount to mount
//! with the list of the blocks that it is made of, and how it steps with the unknowns of each.

use std::ops::Deref;

use nalgebra::Matrix6;

use super::commons::{CommonKind, CommonState};
use crate::geometry::{ObjectSpace, Orientation, Pose, Steps, steps};

/// What a pose is asked for. A photo itself is at the time zero.
#[derive(Debug, Clone, Copy)]
pub enum When {
    /// An image, at its place in the photo.
    Image([f64; 2]),
    /// A time, counted from that of the photo.
    Time(f64),
}

/// The photos themselves.
pub(super) const AT_PHOTO: When = When::Time(0.0);

/// How the pose of a photo, or of its images, follows from another pose and from common unknowns.
pub trait MountModel {
    /// The photo.
    fn photo(&self) -> usize;

    /// The photo whose pose it begins with instead of its own, whose six unknowns then count for nothing.
    fn frame(&self) -> Option<usize> {
        None
    }

    /// The type of the common unknowns.
    fn unknowns(&self) -> CommonKind;

    /// Those that a pose is made of; None for those of all poses.
    fn commons(&self, when: Option<When>) -> Vec<usize>;

    /// Whether images of one photo have poses of their own.
    fn is_timed(&self) -> bool;

    /// Leads from the pose that it begins with to the one that is asked for.
    fn compose(&self, when: When, grounds: &Grounds<'_>, pose: &mut Chain);
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
    rolling::Rolling;
}

/// The mounts of a network by their photos, in their order; none at all where there are none.
#[derive(Debug, Default)]
pub(super) struct Mounts(Vec<Vec<Mount>>);

impl Mounts {
    /// Those of a network of so many photos.
    pub fn new(mounts: &[Mount], photos: usize) -> Self {
        if mounts.is_empty() {
            return Self::default();
        }
        let mut all = vec![vec![]; photos];
        mounts.iter().for_each(|mount| all[mount.photo()].push(*mount));
        Self(all)
    }

    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Those of a photo.
    #[inline]
    pub fn of(&self, photo: usize) -> &[Mount] {
        self.0.get(photo).map_or(&[], Vec::as_slice)
    }

    /// All of them.
    pub fn all(&self) -> impl Iterator<Item = &Mount> {
        self.0.iter().flatten()
    }

    /// The photo whose six unknowns the pose of a photo begins with: its frame, or itself.
    pub fn carrier(&self, photo: usize) -> usize {
        self.of(photo).first().and_then(|mount| mount.frame()).unwrap_or(photo)
    }

    /// The common unknowns that a pose is made of, each once; None for all of a photo.
    #[inline]
    pub fn commons(&self, photo: usize, when: Option<When>) -> Vec<usize> {
        // It is asked of every image.
        if self.is_empty() { vec![] } else { self.commons_of_mounts(photo, when) }
    }

    fn commons_of_mounts(&self, photo: usize, when: Option<When>) -> Vec<usize> {
        let carrier = self.carrier(photo);
        let mut all = if carrier == photo { vec![] } else { self.commons_of_mounts(carrier, when) };
        for common in self.of(photo).iter().flat_map(|mount| mount.commons(when)) {
            if !all.contains(&common) {
                all.push(common);
            }
        }
        all
    }

    /// Whether images of a photo have poses of their own.
    pub fn are_timed(&self, photo: usize) -> bool {
        [photo, self.carrier(photo)].iter().any(|&photo| self.of(photo).iter().any(|mount| mount.is_timed()))
    }
}

/// A pose on the way from mount to mount.
#[derive(Debug)]
pub struct Chain {
    pose: Pose,
    /// The retained blocks that it is made of, and how it steps with the first unknowns of each.
    steps: Vec<(usize, Steps)>,
}

impl Chain {
    /// Goes on to a pose that is given in the axes of this one, and there steps so with unknowns of a block.
    pub fn lead_to(&mut self, inner: &Pose, own: Option<(usize, Steps)>) {
        self.steps.iter_mut().for_each(|(_, steps)| *steps = self.pose.carried(inner, steps));
        if let Some((block, steps)) = own {
            self.add(block, self.pose.carrying(&steps));
        }
        self.pose = self.pose.of_inner(inner);
    }

    fn add(&mut self, block: usize, steps: Steps) {
        match self.steps.iter_mut().find(|own| own.0 == block) {
            Some((_, all)) => *all += steps,
            None => self.steps.push((block, steps)),
        }
    }
}

/// A pose that is made of the unknowns of several blocks.
#[derive(Debug, Clone)]
pub(super) struct Composed {
    /// With six unknowns of its own: its coordinates and a rotation about its axes.
    pub orientation: Orientation,
    /// The retained blocks, and how these six step with the first unknowns of each: that of the carrier, then those of common unknowns.
    pub parts: Vec<(usize, Steps)>,
}

/// What poses are composed of, at given values of the unknowns.
pub struct Grounds<'a> {
    pub(super) space: ObjectSpace,
    pub(super) mounts: &'a Mounts,
    /// Photos as their own six unknowns have them.
    pub(super) photo: &'a dyn Fn(usize) -> Orientation,
    /// Common unknowns, and the block of each unless it is known.
    pub(super) common: &'a dyn Fn(usize) -> (CommonState, Option<usize>),
}

impl Grounds<'_> {
    /// A common unknown, and its block unless it is known.
    pub fn common(&self, common: usize) -> (CommonState, Option<usize>) {
        (self.common)(common)
    }

    /// A pose of a photo; None where nothing but its six unknowns counts.
    pub(super) fn composed(&self, photo: usize, when: When) -> Option<Composed> {
        if self.mounts.of(photo).is_empty() {
            return None;
        }
        let Chain { pose, steps } = self.chain(photo, when);
        let orientation = Orientation::of_pose(self.space, &pose);
        let unknowns = orientation.unknowns_by_step().unwrap_or_else(|| Matrix6::repeat(f64::NAN));
        let parts = steps.into_iter().map(|(block, steps)| (block, unknowns * steps)).collect();
        Some(Composed { orientation, parts })
    }

    fn chain(&self, photo: usize, when: When) -> Chain {
        let carrier = self.mounts.carrier(photo);
        let mut chain = if carrier == photo {
            let own = (self.photo)(photo);
            Chain { pose: *own.pose(), steps: vec![(photo, steps(own.steps()))] }
        } else {
            self.chain(carrier, when)
        };
        self.mounts.of(photo).iter().for_each(|mount| mount.compose(when, self, &mut chain));
        chain
    }
}

#[cfg(test)]
mod tests;
