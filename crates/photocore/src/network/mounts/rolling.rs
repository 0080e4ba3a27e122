//! Photos whose rows are read one after the other while they move.

use super::{Chain, Grounds, MountModel, When};
use crate::geometry::angle_axis::{right_jacobian_inverse, rotation_angle_axis};
use crate::geometry::{Pose, angle_axis_rotation, angle_axis_with_jacobian, steps};
use crate::network::commons::CommonKind;

/// That a photo moves uniformly while it is read: an image has the pose of its time, C + A t v and A Exp(t w).
///
/// v and w, in the axes of the photo, are a common unknown: of one photo, or of all of a strip. An image at (x, y) has the time
/// t = `start` + `by_xy` . (x, y). The six unknowns of the photo are its pose at the time zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rolling {
    /// The photo.
    pub photo: usize,
    /// The common unknown that is its velocity.
    pub velocity: usize,
    /// The time of an image at (0, 0), in seconds from that of the photo.
    pub start: f64,
    /// Seconds per unit of x and of y: where rows are read from above and y points up, the second is negative and the first zero.
    pub by_xy: [f64; 2],
}

impl MountModel for Rolling {
    fn photo(&self) -> usize {
        self.photo
    }

    fn unknowns(&self) -> CommonKind {
        CommonKind::Velocity
    }

    fn commons(&self, _: Option<When>) -> Vec<usize> {
        vec![self.velocity]
    }

    fn is_timed(&self) -> bool {
        true
    }

    /// A turn of w by Jr^-1(w) e brings about one of t w by t Jr(t w) Jr^-1(w) e, e being the turn in a second.
    fn compose(&self, when: When, grounds: &Grounds<'_>, pose: &mut Chain) {
        let t = match when {
            When::Image([x, y]) => self.start + self.by_xy[0] * x + self.by_xy[1] * y,
            When::Time(time) => time,
        };
        let (velocity, block) = grounds.common(self.velocity);
        let Pose { position, attitude } = velocity.pose();
        let w = rotation_angle_axis(&attitude);
        let at = Pose { position: t * position, attitude: angle_axis_rotation(&(t * w)) };
        let by_turn = t * angle_axis_with_jacobian(&(t * w)).1.transpose() * right_jacobian_inverse(&w);
        let own = steps(velocity.steps().map(|(shift, turn)| (t * shift, by_turn * turn)));
        pose.lead_to(&at, block.map(|block| (block, own)));
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::agrees;
    use super::Rolling;

    #[test]
    fn steps_agree_with_differences() {
        agrees(Rolling { photo: 0, velocity: 0, start: 0.1, by_xy: [0.02, -0.03] }.into());
    }
}
