//! Rigs: photos on a frame with others, each in a pose of its own there.

use nalgebra::Matrix6;

use super::commons::{CommonKind, CommonState};
use super::model::Bundle;
use super::{Network, NetworkError};
use crate::geometry::{ObjectSpace, Orientation, Vector3, local_vertical};
use crate::normals::{Cofactors, Layout};

/// That a photo was taken by a sensor on a frame. Its pose follows from those of the frame, which is that of the photo of the first
/// sensor, and of the sensor in it: A = A_f A_s, C = C_f + A_f c_s.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Mount {
    /// The photo. Of its own pose nothing counts but where it is about.
    pub photo: usize,
    /// The photo that stands for the frame; it may have no images.
    pub frame: usize,
    /// The common unknown that is the pose of its sensor in the frame.
    pub sensor: usize,
}

/// What the unknowns of frame and sensor do to a photo that is mounted: steps of its own orientation by them.
#[derive(Debug, Clone)]
pub(super) struct Mounted {
    pub by_frame: Matrix6<f64>,
    pub by_sensor: Matrix6<f64>,
    /// Whether the sensor has a block of unknowns.
    pub sensor_is_unknown: bool,
}

/// A photo that is mounted on a frame with a sensor. Its own six unknowns are its coordinates and a rotation about its axes.
///
/// dC = `dC_f - A_f [c_s]x rho_f + A_f dc`, rho = `A_s^T rho_f + rho_s`.
pub(super) fn mounted(
    space: ObjectSpace,
    frame: &Orientation,
    sensor: &CommonState,
    sensor_is_unknown: bool,
) -> (Orientation, Mounted) {
    let (pose, in_frame) = (frame.pose(), sensor.pose());
    let attitude = pose.attitude * in_frame.attitude;
    let arm = pose.attitude * in_frame.position;
    let coordinates = space.coordinates(pose.position + arm);
    let local = match space {
        ObjectSpace::Rectangular => attitude,
        ObjectSpace::Geographic(_) => local_vertical(coordinates[0], coordinates[1]) * attitude,
    };
    let orientation = Orientation::stepping(space, coordinates, &local);
    let unknowns = orientation.unknowns_by_step().unwrap_or_else(|| Matrix6::repeat(f64::NAN));
    let moves = -pose.attitude * in_frame.position.cross_matrix();
    let mut by_frame = Matrix6::zeros();
    for (k, (shift, rho)) in frame.steps().iter().enumerate() {
        set(&mut by_frame, k, &(shift + moves * rho), &in_frame.attitude.tr_mul(rho));
    }
    let mut by_sensor = Matrix6::zeros();
    for (k, (offset, turn)) in sensor.steps().enumerate() {
        set(&mut by_sensor, k, &(pose.attitude * offset), &turn);
    }
    let [by_frame, by_sensor] = [by_frame, by_sensor].map(|steps| unknowns * steps);
    (orientation, Mounted { by_frame, by_sensor, sensor_is_unknown })
}

fn set(steps: &mut Matrix6<f64>, column: usize, shift: &Vector3, rho: &Vector3) {
    steps.fixed_view_mut::<3, 1>(0, column).copy_from(shift);
    steps.fixed_view_mut::<3, 1>(3, column).copy_from(rho);
}

impl Network {
    /// Refuses mounts that contradict the network or each other.
    pub(super) fn check_mounts(&self) -> Result<(), NetworkError> {
        let mut mounted = vec![false; self.photos.len()];
        let mut carries = mounted.clone();
        for (index, mount) in self.mounts.iter().enumerate() {
            let sensor = self.commons.get(mount.sensor).is_some_and(|own| own.kind == CommonKind::Sensor);
            let there = mount.photo.max(mount.frame) < self.photos.len();
            if !sensor || !there || std::mem::replace(&mut mounted[mount.photo], true) {
                return Err(NetworkError::Mount(index));
            }
            carries[mount.frame] = true;
        }
        let both = self.mounts.iter().position(|mount| carries[mount.photo]);
        both.map_or(Ok(()), |index| Err(NetworkError::Mount(index)))
    }

    /// The mount of each photo; none at all where there are no rigs.
    pub(super) fn mounts_by_photo(&self) -> Vec<Option<Mount>> {
        if self.mounts.is_empty() {
            return vec![];
        }
        let mut all = vec![None; self.photos.len()];
        self.mounts.iter().for_each(|mount| all[mount.photo] = Some(*mount));
        all
    }
}

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

    /// The kept blocks that the pose of a photo is made of: its own, or those of its frame and of its sensor unless that is known.
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

    /// The pairs of kept blocks whose cofactors those of the poses of mounted photos need.
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
