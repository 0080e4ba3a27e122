//! What every kind must hold: steps that agree with differences.

#![allow(clippy::unwrap_used)]

use nalgebra::Vector6;

use super::{Composed, Grounds, Mount, Mounts, When};
use crate::geometry::angle_axis::rotation_angle_axis;
use crate::geometry::{
    Ellipsoid, Matrix3, ObjectSpace, Orientation, PoseNumbers, RotationSense, Vector3, rotation,
};
use crate::network::commons::{Common, PlacedCommon};

/// Asserts that the poses of the first of two photos step as central differences of the fourth order do, in both spaces. All common
/// unknowns are of the type of the mount, and not at their origin.
pub fn agrees(mount: Mount) {
    let geographic = ObjectSpace::Geographic(Ellipsoid::new(300.0, 290.0).unwrap());
    for space in [ObjectSpace::Rectangular, geographic] {
        for when in [When::Time(0.0), When::Time(-1.7), When::Image([0.0; 2]), When::Image([3.0, -20.0])] {
            agrees_at(mount, space, when);
        }
    }
}

fn agrees_at(mount: Mount, space: ObjectSpace, when: When) {
    let (poses, mounts) = (PoseNumbers::Angles(RotationSense::GroundToPhoto), Mounts::new(&[mount], 2));
    let count = 1 + mount.commons(None).into_iter().max().unwrap();
    let width = mount.unknowns().unknowns().len();
    let placed = |k: usize| {
        let turns = mount.unknowns().unknowns().iter().any(|&(_, component, _)| component > 2);
        let attitude = if turns { rotation([0.2, -0.4, 0.9 - k as f64]) } else { Matrix3::identity() };
        let common =
            Common { kind: mount.unknowns(), position: [0.4, 0.2, -0.7], attitude, sd: vec![1.0; width] };
        PlacedCommon::new(&common, space, [0.0; 3], &Matrix3::identity())
    };
    let commons: Vec<PlacedCommon> = (0..count).map(placed).collect();
    let photos = vec![0.31, 0.7, 2.0, 0.4, -0.3, 1.2, 0.3, 0.69, 1.5, 1.1, 0.5, -0.7];
    let small = (0..count * width).map(|k| 0.3 * (1.7 * k as f64).sin());
    let values: Vec<f64> = photos.into_iter().chain(small).collect();
    let first = |block: usize| 6 * block.min(2) + width * block.saturating_sub(2);
    let at = |values: &[f64]| -> Composed {
        let photo =
            |photo: usize| Orientation::new(poses, space, &std::array::from_fn(|k| values[6 * photo + k]));
        let common = |common: usize| {
            let block = 2 + common;
            (commons[common].at(&values[first(block)..][..width]), Some(block))
        };
        Grounds { space, mounts: &mounts, photo: &photo, common: &common }.composed(0, when).unwrap()
    };
    let Composed { orientation, parts } = at(&values);
    let (pose, unknowns) = (orientation.pose(), orientation.unknowns_by_step().unwrap());
    for (block, steps) in &parts {
        for (k, step) in steps.column_iter().enumerate() {
            let unknown = first(*block) + k;
            let apart = |times: f64| {
                let mut moved = values.clone();
                moved[unknown] += 1e-3 * times;
                let moved = *at(&moved).orientation.pose();
                let shift = moved.position - pose.position;
                let rho: Vector3 = rotation_angle_axis(&pose.attitude.tr_mul(&moved.attitude));
                Vector6::new(shift.x, shift.y, shift.z, rho.x, rho.y, rho.z)
            };
            let difference = 8.0 * (apart(1.0) - apart(-1.0)) - (apart(2.0) - apart(-2.0));
            let expected = unknowns * difference / 12e-3;
            let error = (step - expected).amax() / expected.amax().max(1.0);
            assert!(error < 1e-9, "{space:?}, {when:?}, block {block}, unknown {k}: {error:e}");
        }
    }
    let columns: usize = parts.iter().map(|(_, steps)| steps.ncols()).sum();
    assert_eq!(columns, 6 + mount.commons(Some(when)).len() * width, "all that it is made of");
}
