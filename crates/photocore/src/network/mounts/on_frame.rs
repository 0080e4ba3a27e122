//! Rigs: photos on a frame with others, each in a pose of its own there.

use super::{Chain, Grounds, MountModel, Mounts};
use crate::network::commons::CommonKind;

/// That a photo was taken by a sensor on a frame. Its pose follows from those of the frame, which is that of the photo of the first
/// sensor, and of the sensor in it: A = A_f A_s, C = C_f + A_f c_s.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OnFrame {
    /// The photo. Of its own pose nothing counts but where it is about.
    pub photo: usize,
    /// The photo that stands for the frame; it may have no images. The photo itself where its frame is on a trajectory.
    pub frame: usize,
    /// The common unknown that is the pose of its sensor in the frame.
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

    fn compose(&self, _: f64, grounds: &Grounds<'_>, pose: &mut Chain) {
        let (sensor, block) = grounds.common(self.sensor);
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
