//! Test of the partials of all mounts against differences.

#![allow(clippy::unwrap_used)]

use std::borrow::Cow;

use nalgebra::Vector6;

use super::{Composed, Mount, Mounts, PoseInputs, Trajectory};
use crate::geometry::angle_axis::rotation_angle_axis;
use crate::geometry::{
    Ellipsoid, Matrix3, ObjectSpace, Orientation, PoseNumbers, RotationSense, Vector3, rotation,
};
use crate::network::commons::{CartesianCommon, Common, CommonKind, InBlock};

/// Returns the mounts of one mounted photo among `photos`.
pub fn mounted(mount: Mount, photos: usize) -> Mounts {
    Mounts::new((&[mount], photos), (&[], [0.0; 3]), &[])
}

/// Asserts that the partials of the pose of photo 0 agree with central differences of fourth order, in both spaces. Shared parameters have
/// the required types and nonzero values.
pub fn agrees(mount: Mount, commons: &[CommonKind], trajectories: &[Trajectory]) {
    let geographic = ObjectSpace::Geographic(Ellipsoid::new(300.0, 290.0).unwrap());
    for space in [ObjectSpace::Rectangular, geographic] {
        for at in [0.0, -1.7, 0.3] {
            agrees_at(mount, (commons, trajectories), space, at);
        }
    }
}

fn agrees_at(
    mount: Mount,
    (kinds, trajectories): (&[CommonKind], &[Trajectory]),
    space: ObjectSpace,
    at: f64,
) {
    let poses = PoseNumbers::Angles(RotationSense::GroundToPhoto);
    let common = |(k, &kind): (usize, &CommonKind)| {
        let turns = kind.unknowns().iter().any(|&(_, component, _)| component > 2);
        let attitude = if turns { rotation([0.2, -0.4, 0.9 - k as f64]) } else { Matrix3::identity() };
        Common { kind, position: [0.4, 0.2, -0.7], attitude, sd: vec![1.0; kind.unknowns().len()] }
    };
    let given: Vec<Common> = kinds.iter().enumerate().map(common).collect();
    let mounts = Mounts::new((&[mount], 2), (trajectories, [0.0; 3]), &given);
    let placed = |common| CartesianCommon::new(common, space, [0.0; 3], &Matrix3::identity());
    let commons: Vec<CartesianCommon> = given.iter().map(placed).collect();
    let widths: Vec<usize> = [6, 6].into_iter().chain(given.iter().map(|own| own.sd.len())).collect();
    let first = |block: usize| widths[..block].iter().sum::<usize>();
    let photos = vec![0.31, 0.7, 2.0, 0.4, -0.3, 1.2, 0.3, 0.69, 1.5, 1.1, 0.5, -0.7];
    let small = (0..first(widths.len()) - 12).map(|k| 0.3 * (1.7 * k as f64).sin());
    let values: Vec<f64> = photos.into_iter().chain(small).collect();
    let composed = |values: &[f64]| -> Composed {
        let photo =
            |photo: usize| Orientation::new(poses, space, &std::array::from_fn(|k| values[6 * photo + k]));
        let common = |common: usize| {
            let block = 2 + common;
            (
                Cow::Owned(commons[common].at(&values[first(block)..][..widths[block]])),
                Some(InBlock::whole(block, widths[block])),
            )
        };
        PoseInputs { space, mounts: &mounts, photo: &photo, common: &common }.composed(0, at).unwrap()
    };
    let found = composed(&values);
    let (orientation, parts) = (found.orientation, found.parts());
    let (pose, unknowns) = (orientation.pose(), orientation.unknowns_by_step().unwrap());
    for (block, steps) in &parts {
        for (k, step) in steps.column_iter().enumerate() {
            let unknown = first(*block) + k;
            let difference = |times: f64| {
                let mut moved = values.clone();
                moved[unknown] += 1e-3 * times;
                let moved = *composed(&moved).orientation.pose();
                let shift = moved.position - pose.position;
                let rho: Vector3 = rotation_angle_axis(&pose.attitude.tr_mul(&moved.attitude));
                Vector6::new(shift.x, shift.y, shift.z, rho.x, rho.y, rho.z)
            };
            let difference =
                8.0 * (difference(1.0) - difference(-1.0)) - (difference(2.0) - difference(-2.0));
            let expected = unknowns * difference / 12e-3;
            let error = (step - expected).amax() / expected.amax().max(1.0);
            assert!(error < 1e-9, "{space:?}, {at}, block {block}, unknown {k}: {error:e}");
        }
    }
    let columns: usize = parts.iter().map(|(_, steps)| steps.ncols()).sum();
    let main = mounts.main_block(0, &|common| Some(InBlock::whole(2 + common, widths[2 + common])));
    let own = if main < 2 { 6 } else { 0 };
    let of_commons = mounts.commons(0, at).into_iter().map(|common| widths[2 + common]);
    assert_eq!(columns, own + of_commons.sum::<usize>(), "all that it is made of");
}
