//! Lens models with a distortion spline of free knots.

use super::{Facts, PassageModel};
use crate::geometry::Camera;
use crate::network::commons::CommonKind;

/// Knots of a camera with a spline ([`crate::geometry::camera::SplinedStereographic`]), each a shared parameter: an image depends only on
/// neighbouring knots.
#[derive(Debug, Clone, PartialEq)]
pub struct Knots {
    /// Camera.
    pub camera: usize,
    /// Knots, row by row.
    pub commons: Vec<usize>,
}

impl Knots {
    /// Name in [`super::Passage::from_numbers`].
    pub const NAME: &'static str = "knots";

    /// Indices: knots, camera.
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
