//! Backward cameras with residuals in the measured image, so that weights refer to measured coordinates.

use super::backward::BackwardModel;
use super::brown::{Brown, BrownAffinityAfter};
use super::inverse::RadialLimit;
use super::model::{CameraModel, Image, LensDirection, Unit};
use super::on_comparator::OnComparator;
use super::orthogonal::{Ebner, Gruen};
use crate::geometry::Vector3;

/// Backward camera with the residual in measured coordinates: measured position - modelled image of u.
///
/// To first order the residual is D^-1 (g(measured) - c (u1, u2) / u3) with D = dg/d(measured). It corresponds to a residual in the
/// corrected image with the covariance D S D^T. The image follows from Newton's method. The estimates are unbiased, unlike with weights D S
/// D^T that vary with the parameters.
///
/// [`Camera`](super::Camera) lists the parameters in their order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured<C>(pub C);

/// Model with a name for its measured form.
trait NamedCamera: BackwardModel {
    const MEASURED: &'static str;
}

macro_rules! measured {
    ($($(#[$doc:meta])* $name:ident = $camera:ident, $said:literal;)*) => {$(
        $(#[$doc])*
        pub type $name = Measured<$camera>;

        impl NamedCamera for $camera {
            const MEASURED: &'static str = $said;
        }
    )*};
}

measured! {
    /// [`Brown`] with residuals in measured coordinates.
    BrownMeasured = Brown, "brown_measured";
    /// [`BrownAffinityAfter`] with residuals in measured coordinates.
    BrownAffinityAfterMeasured = BrownAffinityAfter, "brown_affinity_after_measured";
    /// [`Ebner`] with residuals in measured coordinates.
    EbnerMeasured = Ebner, "ebner_measured";
    /// [`Gruen`] with residuals in measured coordinates.
    GruenMeasured = Gruen, "gruen_measured";
    /// [`OnComparator`] with residuals in measured coordinates.
    OnComparatorMeasured = OnComparator, "on_comparator_measured";
}

impl<C: NamedCamera> CameraModel for Measured<C> {
    type Parameters = <C as BackwardModel>::Parameters;

    const NAME: &'static str = C::MEASURED;
    const PARAMETERS: &'static [(&'static str, Unit)] = <C as CameraModel>::PARAMETERS;
    const CONSTANTS: usize = <C as CameraModel>::CONSTANTS;
    const FORMULA: &'static str = <C as CameraModel>::FORMULA;
    const LENS: LensDirection = LensDirection::Backward;

    fn with_parameters(parameters: Self::Parameters) -> Self {
        Self(BackwardModel::with_parameters(parameters))
    }

    fn parameters(&self) -> Self::Parameters {
        BackwardModel::parameters(&self.0)
    }

    fn scale(&self) -> f64 {
        self.0.scale()
    }

    fn image(&self, u: &Vector3) -> [f64; 2] {
        self.0.image(u)
    }

    fn linearize(&self, u: &Vector3) -> Image<Self::Parameters> {
        self.0.linearize(u)
    }

    fn direction(&self, xy: [f64; 2]) -> Option<Vector3> {
        self.0.direction(xy)
    }

    fn radius(&self, u: &Vector3, measured: [f64; 2]) -> f64 {
        CameraModel::radius(&self.0, u, measured)
    }

    fn correction(&self, measured: [f64; 2]) -> Option<[f64; 2]> {
        self.0.correction(measured)
    }

    fn radial_limit(&self) -> Option<RadialLimit> {
        CameraModel::radial_limit(&self.0)
    }
}
