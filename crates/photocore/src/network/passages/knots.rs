//! Lenses whose distortion is a spline, its knots unknown.

use super::{Facts, PassageModel};
use crate::geometry::Camera;
use crate::network::commons::CommonKind;

/// The knots of a camera that has a spline ([`crate::geometry::camera::SplinedStereographic`]), each a common unknown of its own: an image
/// steps with those about it alone.
#[derive(Debug, Clone, PartialEq)]
pub struct Knots {
    /// The camera.
    pub camera: usize,
    /// The knots, row by row.
    pub commons: Vec<usize>,
}

impl Knots {
    /// The name under which [`super::Passage::from_numbers`] knows it.
    pub const NAME: &'static str = "knots";

    /// The knots, and the camera.
    pub(super) fn from_numbers(commons: &[usize], of: &[usize], numbers: &[f64]) -> Option<Self> {
        let (&[camera], []) = (of, numbers) else { return None };
        Some(Self { camera, commons: commons.to_vec() })
    }
}

impl PassageModel for Knots {
    fn unknowns(&self) -> Vec<(usize, CommonKind)> {
        self.commons.iter().map(|&common| (common, CommonKind::Knot)).collect()
    }

    fn is_of(&self, network: &Facts<'_>) -> bool {
        let knots = network.cameras.get(self.camera).and_then(|camera| camera.knots());
        knots.is_some_and(|own| own.len() == self.commons.len())
            && matches!(network.cameras[self.camera], Camera::SplinedStereographic(_))
    }
}
