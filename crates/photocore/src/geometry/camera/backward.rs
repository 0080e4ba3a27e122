//! Backward cameras: measured positions are corrected and compared with the central perspective.

use super::inverse::{Matrix2, RadialLimit, inverted, times};
use super::model::{CameraModel, Image, LensDirection, Unit};
use super::perspective::Perspective;
use crate::geometry::Vector3;

/// Corrected position and its partials; the first index is x or y.
#[derive(Debug, Clone, Copy)]
pub struct Corrected<P> {
    /// g, the corrected position.
    pub xy: [f64; 2],
    /// With respect to the measured position.
    pub by_measured: Matrix2,
    /// With respect to the parameters of the camera; zero for c.
    pub by_parameters: [P; 2],
}

/// A camera with c, its first parameter, and corrections g that are functions of the measured position:
///
/// ```text
/// residual = g(measured) - c (u1, u2) / u3
/// ```
///
/// Every such type is a [`CameraModel`]. Its image of u is the measured position whose correction g equals c (u1, u2) / u3.
pub trait BackwardModel: Copy {
    /// See [`CameraModel::Parameters`].
    type Parameters: Copy + AsRef<[f64]> + AsMut<[f64]> + for<'a> TryFrom<&'a [f64]>;

    /// See [`CameraModel::NAME`].
    const NAME: &'static str;
    /// See [`CameraModel::PARAMETERS`].
    const PARAMETERS: &'static [(&'static str, Unit)];
    /// See [`CameraModel::CONSTANTS`].
    const CONSTANTS: usize;
    /// See [`CameraModel::FORMULA`].
    const FORMULA: &'static str;
    /// See [`CameraModel::IN_LANES`].
    const IN_LANES: bool = false;

    /// See [`CameraModel::with_parameters`].
    fn with_parameters(parameters: Self::Parameters) -> Self;

    /// See [`CameraModel::parameters`].
    fn parameters(&self) -> Self::Parameters;

    /// Returns c, negative for the positive plane.
    fn principal_distance(&self) -> f64;

    /// Returns g with its partials.
    fn correct(&self, measured: [f64; 2]) -> Corrected<Self::Parameters>;

    /// Returns the measured position with the given corrected position (inverse of g).
    fn measured(&self, corrected: [f64; 2]) -> Option<[f64; 2]>;

    /// See [`CameraModel::radius`]; a function of the measured position.
    fn radius(&self, _measured: [f64; 2]) -> f64 {
        0.0
    }

    /// See [`CameraModel::radial_limit`].
    fn radial_limit(&self) -> Option<RadialLimit> {
        None
    }

    /// Returns the central perspective with the same principal distance.
    fn perspective(&self) -> Perspective {
        Perspective { principal_distance: self.principal_distance() }
    }

    /// Returns g - c u/u3, the partials of c u/u3 - g, and the partials of g with respect to the measured position.
    #[inline(always)]
    fn compared(&self, u: &Vector3, measured: [f64; 2]) -> ([f64; 2], Image<Self::Parameters>, Matrix2) {
        let Corrected { xy, by_measured, by_parameters } = self.correct(measured);
        let Image { xy: ideal, by_u, by_parameters: by_distance } = self.perspective().linearize(u);
        let mut own = by_parameters;
        for row in 0..2 {
            own[row].as_mut().iter_mut().for_each(|partial| *partial = -*partial);
            own[row].as_mut()[0] = by_distance[row][0];
        }
        let residual = [xy[0] - ideal[0], xy[1] - ideal[1]];
        (residual, Image { xy: ideal, by_u, by_parameters: own }, by_measured)
    }
}

impl<T: BackwardModel> CameraModel for T {
    type Parameters = <T as BackwardModel>::Parameters;

    const NAME: &'static str = <T as BackwardModel>::NAME;
    const PARAMETERS: &'static [(&'static str, Unit)] = <T as BackwardModel>::PARAMETERS;
    const CONSTANTS: usize = <T as BackwardModel>::CONSTANTS;
    const FORMULA: &'static str = <T as BackwardModel>::FORMULA;
    const LENS: LensDirection = LensDirection::Backward;
    const IN_LANES: bool = <T as BackwardModel>::IN_LANES;

    fn with_parameters(parameters: <T as BackwardModel>::Parameters) -> Self {
        BackwardModel::with_parameters(parameters)
    }

    fn parameters(&self) -> <T as BackwardModel>::Parameters {
        BackwardModel::parameters(self)
    }

    fn scale(&self) -> f64 {
        self.principal_distance().abs()
    }

    fn image(&self, u: &Vector3) -> [f64; 2] {
        self.measured(self.perspective().image(u)).unwrap_or([f64::NAN; 2])
    }

    /// The derivatives of the inverse follow from c u/u3 - g = 0.
    fn linearize(&self, u: &Vector3) -> Image<Self::Parameters> {
        let xy = self.image(u);
        let (_, Image { by_u: [x, y], by_parameters, .. }, by_measured) = self.compared(u, xy);
        let back = inverted(by_measured);
        let mut own = by_parameters;
        for k in 0..Self::PARAMETERS.len() {
            let [by_x, by_y] = times(&back, by_parameters.map(|row| row.as_ref()[k]));
            own[0].as_mut()[k] = by_x;
            own[1].as_mut()[k] = by_y;
        }
        Image { xy, by_u: back.map(|row| x * row[0] + y * row[1]), by_parameters: own }
    }

    #[inline(always)]
    fn compare(&self, u: &Vector3, measured: [f64; 2]) -> ([f64; 2], Image<Self::Parameters>) {
        let (residual, image, _) = self.compared(u, measured);
        (residual, image)
    }

    /// None if the correction is not one-to-one at the position.
    fn direction(&self, xy: [f64; 2]) -> Option<Vector3> {
        let Corrected { xy, by_measured: [[a, b], [c, d]], .. } = self.correct(xy);
        let positive = a > 0.0 && a * d - 0.25 * (b + c) * (b + c) > 0.0;
        if positive { self.perspective().direction(xy) } else { None }
    }

    fn radius(&self, _: &Vector3, measured: [f64; 2]) -> f64 {
        BackwardModel::radius(self, measured)
    }

    fn correction(&self, measured: [f64; 2]) -> Option<[f64; 2]> {
        Some(self.correct(measured).xy)
    }

    fn radial_limit(&self) -> Option<RadialLimit> {
        BackwardModel::radial_limit(self)
    }
}
