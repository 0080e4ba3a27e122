//! Rigs: photos on a frame with others, each in a pose of its own there.

use nalgebra::Matrix6;

use super::commons::CommonState;
use crate::geometry::{ObjectSpace, Orientation, Vector3, local_vertical};

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
