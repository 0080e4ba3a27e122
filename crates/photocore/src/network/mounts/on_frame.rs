//! Rigs: several photos with individual poses on a common frame.

use super::{MountModel, Mounts, PartialPose, PoseInputs};
use crate::network::commons::CommonKind;

/// Mount of a photo that was taken by a sensor on a frame. Its pose is composed from the frame (the photo of the first sensor) and the
/// sensor: A = A_f A_s, C = C_f + A_f c_s.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OnFrame {
    /// Photo. Its own pose is only an approximate position.
    pub photo: usize,
    /// Photo that represents the frame, with or without images. It is the photo itself if its frame is on a trajectory.
    pub frame: usize,
    /// Shared parameter with the pose of the sensor in the frame.
    pub sensor: usize,
}

impl MountModel for OnFrame {
    fn photo(&self) -> usize {
        self.photo
    }

    fn frame(&self) -> Option<usize> {
        Some(self.frame)
    }

    fn unknowns(&self) -> Vec<(usize, CommonKind)> {
        vec![(self.sensor, CommonKind::Sensor)]
    }

    fn commons(&self, _: f64, known: &Mounts) -> Vec<usize> {
        self.always(known)
    }

    fn always(&self, _: &Mounts) -> Vec<usize> {
        vec![self.sensor]
    }

    fn is_timed(&self) -> bool {
        false
    }

    fn compose(&self, _: f64, pose_inputs: &PoseInputs<'_>, pose: &mut PartialPose) {
        let (sensor, block) = pose_inputs.common(self.sensor);
        let own = block.filter(|_| pose.steps()).map(|block| (block, sensor.steps()));
        pose.lead_to(&sensor.pose(), own);
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::agrees;
    use super::{CommonKind, OnFrame};

    #[test]
    fn steps_agree_with_differences() {
        agrees(OnFrame { photo: 0, frame: 1, sensor: 1 }.into(), &[CommonKind::Sensor; 2], &[]);
    }
}
