//! Poses that depend on several blocks: the blocks, the poses and their cofactors.

use std::borrow::Cow;

use nalgebra::{DMatrix, Matrix6, Matrix6xX};
use smallvec::{SmallVec, smallvec};

use super::commons::{CommonState, InBlock};
use super::linearization_point::{LinearizationPoint, Mounted, PhotoState};
use super::model::Bundle;
use super::mounts::{AT_PHOTO, Composed, PhotoMotion, PoseInputs};
use crate::geometry::{Orientation, POSE, Vector3};
use crate::normals::{Cofactors, Layout};

impl Bundle {
    /// Returns the photo whose six parameters are the start of the pose of a photo: its frame, or itself.
    pub(super) fn carrier(&self, photo: usize) -> usize {
        self.mounts.carrier(photo)
    }

    pub(super) fn is_carried(&self, photo: usize) -> bool {
        self.mounts.is_carried(photo)
    }

    /// Returns the retained blocks of a pose: the main one, then blocks of free shared parameters.
    pub(super) fn blocks_of_pose(&self, photo: usize, at: f64) -> impl Iterator<Item = usize> {
        let main = self.main_block_of_pose(photo);
        let commons = self.mounts.commons(photo, at).into_iter();
        let others = commons.filter_map(|common| Some(self.blocks.of_common[common]?.block));
        let mut seen: SmallVec<[usize; 16]> = smallvec![main];
        let once = move |&own: &usize| {
            let new = !seen.contains(&own);
            if new {
                seen.push(own);
            }
            new
        };
        std::iter::once(main).chain(others.filter(once))
    }

    /// Returns the first of them, which all poses of a photo share.
    pub(super) fn main_block_of_pose(&self, photo: usize) -> usize {
        self.mounts.main_block(photo, &|common| self.blocks.of_common[common])
    }

    fn pose_inputs<'a>(
        &'a self,
        photo: &'a dyn Fn(usize) -> Orientation,
        common: &'a dyn Fn(usize) -> (Cow<'a, CommonState>, Option<InBlock>),
    ) -> PoseInputs<'a> {
        PoseInputs { space: self.space, mounts: &self.mounts, photo, common }
    }

    /// Returns the pose of a mounted photo; None for others. `unknowns` contains the parameters of [`Bundle::parameter_unknowns`].
    pub(super) fn composed(&self, photo: usize, unknowns: &[f64]) -> Option<Composed> {
        let own = |photo: usize| {
            let pose = &unknowns[self.blocks.first[photo]..][..POSE];
            self.orientation(photo, &std::array::from_fn(|k| pose[k]))
        };
        let common =
            |common: usize| (Cow::Owned(self.common_state(common, unknowns)), self.blocks.of_common[common]);
        self.pose_inputs(&own, &common).composed(photo, AT_PHOTO)
    }

    /// Composes the poses of all mounted photos and stores them in replaced photos; None without mounts.
    pub(super) fn mount_all(&self, photos: &mut [PhotoState], commons: &[CommonState]) -> Option<Mounted> {
        if self.mounts.is_empty() {
            return None;
        }
        let own: Vec<Orientation> = photos.iter().map(|photo| photo.orientation).collect();
        let composed = {
            let photo = |photo: usize| own[photo];
            let common = |common: usize| (Cow::Borrowed(&commons[common]), self.blocks.of_common[common]);
            let pose_inputs = self.pose_inputs(&photo, &common);
            (0..own.len()).map(|photo| pose_inputs.composed(photo, AT_PHOTO)).collect::<Vec<_>>()
        };
        for (photo, composed) in composed.iter().enumerate().filter(|&(photo, _)| self.is_carried(photo)) {
            composed.iter().for_each(|composed| photos[photo].orientation = composed.orientation);
        }
        Some(Mounted { own, composed })
    }

    /// Returns the point of an image with corrections, in the axes of its photo.
    #[inline(never)]
    pub(super) fn corrected_sight(
        &self,
        linearization: &LinearizationPoint,
        group: usize,
        local: usize,
    ) -> Vector3 {
        let mut own = Composed::new(false);
        let timed = self.compose_timed(linearization, group, &mut own);
        let (timed, photo) = (timed.then_some(&own.orientation), self.images[group].photo);
        linearization
            .seen(self.space, timed, photo, local, |orientation, point| orientation.to_camera_frame(point))
    }

    pub(super) fn compose_timed(
        &self,
        linearization: &LinearizationPoint,
        image: usize,
        own: &mut Composed,
    ) -> bool {
        linearization
            .mounted
            .as_ref()
            .is_some_and(|mounted| self.compose(mounted, &linearization.commons, image, own))
    }

    /// Composes the individual pose of an image into existing storage; returns false if it shares the pose of its photo.
    pub(super) fn compose(
        &self,
        mounted: &Mounted,
        commons: &[CommonState],
        image: usize,
        own: &mut Composed,
    ) -> bool {
        let of = self.images[image].photo;
        let photo = |photo: usize| mounted.own[photo];
        let common = |common: usize| (Cow::Borrowed(&commons[common]), self.blocks.of_common[common]);
        self.mounts.are_timed(of) && self.pose_inputs(&photo, &common).compose(of, self.time_of(image), own)
    }

    pub(super) fn moving(
        &self,
        mounted: &Mounted,
        commons: &[CommonState],
        photo: usize,
    ) -> Option<PhotoMotion> {
        let own = |photo: usize| mounted.own[photo];
        let common = |common: usize| (Cow::Borrowed(&commons[common]), self.blocks.of_common[common]);
        self.pose_inputs(&own, &common).moving(photo, AT_PHOTO)
    }

    /// Returns the six reported pose parameters, relative to the origin, and their partials by its own parameters; None at singular angles.
    pub(super) fn reported(&self, orientation: &Orientation) -> ([f64; POSE], Option<Matrix6<f64>>) {
        let numbers = orientation.numbers(self.poses, self.space);
        let by_step = Orientation::new(self.poses, self.space, &numbers).unknowns_by_step();
        (numbers, by_step.map(|by_step| by_step * orientation.step_matrix()))
    }

    /// Returns the pairs of retained blocks whose cofactors are required for poses of mounted photos.
    pub(super) fn pairs(&self) -> Vec<[u32; 2]> {
        let of_photo = |photo: usize| {
            let mut blocks: Vec<u32> =
                self.blocks_of_pose(photo, AT_PHOTO).map(|block| block as u32).collect();
            blocks.sort_unstable();
            let before = |j: usize| blocks[..j].iter().map(|&i| [i, blocks[j]]).collect::<Vec<_>>();
            (1..blocks.len()).flat_map(before).collect::<Vec<_>>()
        };
        (0..self.cameras.len())
            .filter(|&photo| !self.mounts.of(photo).is_empty())
            .flat_map(of_photo)
            .collect()
    }

    /// Returns the cofactors of the six parameters of a mounted photo: J Q J^T over all pairs of its blocks.
    pub(super) fn mounted_cofactors(
        &self,
        layout: &Layout,
        composed: &Composed,
        all: &Cofactors,
    ) -> Matrix6<f64> {
        type Part = (usize, Matrix6xX<f64>);
        let term = |(i, by_i): &Part, (j, by_j): &Part| -> Matrix6<f64> {
            let (rows, columns) = (by_i.ncols(), by_j.ncols());
            let (width, numbers) = if i == j {
                (self.of_block(*i).len(), Some(self.cofactors_of_block(all, *i)))
            } else {
                let range = layout.pair([*i as u32, *j as u32]);
                (self.of_block(*j).len(), range.map(|range| &all.pairs[range]))
            };
            let of = |r: usize, c: usize| numbers.map_or(f64::NAN, |numbers| numbers[width * r + c]);
            by_i * DMatrix::from_fn(rows, columns, of) * by_j.transpose()
        };
        let mut parts = composed.parts();
        // Blocks with zero partials contribute nothing, even if their cofactors are undefined.
        parts.retain(|(_, by)| by.iter().any(|&partial| partial != 0.0));
        parts.sort_by_key(|own| own.0);
        let mut sum = Matrix6::zeros();
        for (j, part) in parts.iter().enumerate() {
            for before in &parts[..j] {
                let mixed = term(before, part);
                sum += mixed;
                sum += mixed.transpose();
            }
            sum += term(part, part);
        }
        sum
    }
}
