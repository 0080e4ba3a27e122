//! Photos of a model that are on frames: what their poses are made of, and the cofactors of these.

use nalgebra::Matrix6;

use super::model::Bundle;
use super::mounts::{Mount, Mounted, mounted};
use crate::geometry::Orientation;
use crate::normals::{Cofactors, Layout};

impl Bundle {
    /// How a photo is mounted, if it is.
    #[inline]
    pub(super) fn mount(&self, photo: usize) -> Option<&Mount> {
        self.mounts.get(photo).and_then(Option::as_ref)
    }

    /// The photo whose pose is unknown where that of a photo follows from it: its frame, or itself.
    pub(super) fn carrier(&self, photo: usize) -> usize {
        self.mount(photo).map_or(photo, |mount| mount.frame)
    }

    /// The retained blocks that the pose of a photo is made of: its own, or those of its frame and of its sensor unless that is known.
    pub(super) fn blocks_of_pose(&self, photo: usize) -> impl Iterator<Item = usize> {
        let sensor = self.mount(photo).and_then(|mount| self.common_block[mount.sensor]);
        std::iter::once(self.carrier(photo)).chain(sensor)
    }

    /// The orientation of a photo that is mounted; None of others. `unknowns` are those of all stations.
    pub(super) fn on_frame(&self, photo: usize, unknowns: &[f64]) -> Option<(Orientation, Mounted)> {
        let mount = self.mount(photo)?;
        let pose = &unknowns[self.first[mount.frame]..][..6];
        let frame = self.orientation(mount.frame, &std::array::from_fn(|k| pose[k]));
        let block = self.common_block[mount.sensor];
        let own = block.map_or(&[] as &[f64], |block| &unknowns[self.first[block]..self.first[block + 1]]);
        Some(mounted(self.space, &frame, &self.commons[mount.sensor].at(own), block.is_some()))
    }

    /// The six numbers of a pose, counted from the origin, and what leads to them from its own unknowns; None where angles are singular.
    pub(super) fn reported(&self, orientation: &Orientation) -> ([f64; 6], Option<Matrix6<f64>>) {
        let numbers = orientation.numbers(self.poses, self.space);
        let by_step = Orientation::new(self.poses, self.space, &numbers).unknowns_by_step();
        (numbers, by_step.map(|by_step| by_step * orientation.step_matrix()))
    }

    /// The pairs of retained blocks whose cofactors those of the poses of mounted photos need.
    pub(super) fn pairs(&self) -> Vec<[u32; 2]> {
        let pair = |photo: usize| {
            let mut blocks = self.blocks_of_pose(photo).map(|block| block as u32);
            Some([blocks.next()?, blocks.next()?])
        };
        (0..self.mounts.len()).filter(|&photo| self.mount(photo).is_some()).filter_map(pair).collect()
    }

    /// Cofactors of the six unknowns, as its orientation has them, of a photo that is mounted: J Q J^T.
    pub(super) fn mounted_cofactors(
        &self,
        layout: &Layout,
        photo: usize,
        Mounted { by_frame, by_sensor, .. }: &Mounted,
        all: &Cofactors,
    ) -> Matrix6<f64> {
        let six = |block: usize| {
            let (own, width) = (self.cofactors_of_block(all, block), self.of_block(block).len());
            Matrix6::from_fn(|i, j| own[i * width + j])
        };
        let blocks: Vec<usize> = self.blocks_of_pose(photo).collect();
        let own = by_frame * six(blocks[0]) * by_frame.transpose();
        let &[frame, sensor] = &blocks[..] else { return own };
        let cross = layout.pair([frame as u32, sensor as u32]).map_or_else(
            || Matrix6::repeat(f64::NAN),
            |range| Matrix6::from_fn(|i, j| all.pairs[range.start + 6 * i + j]),
        );
        let mixed = by_frame * cross * by_sensor.transpose();
        own + mixed + mixed.transpose() + by_sensor * six(sensor) * by_sensor.transpose()
    }
}
