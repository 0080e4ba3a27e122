//! What each camera is and says.

use std::sync::Arc;

use super::inverse::RadialLimit;
use super::knots::Patch;
use crate::geometry::axes::Vector3;

/// How a camera maps u, a point in the photo's axes (it looks along -z), to image coordinates.
///
/// Only the direction of u counts: (dx/du) u = 0.
///
/// A **forward** camera has a lens whose terms are functions of ideal coordinates: it maps u to what is measured. That of a **backward**
/// one has terms that are functions of measured coordinates: it corrects what is measured, and compares that with the central perspective
/// of u ([`super::backward::BackwardModel`]).
pub trait CameraModel: Clone {
    /// Its interior parameters, an array of numbers.
    type Parameters: Copy + AsRef<[f64]> + AsMut<[f64]> + for<'a> TryFrom<&'a [f64]>;

    /// What the model is called.
    const NAME: &'static str;
    /// What its parameters are called and measured in, in their order.
    const PARAMETERS: &'static [(&'static str, Unit)];
    /// How many of the parameters, the last ones, are constants: never unknowns.
    const CONSTANTS: usize = 0;
    /// The image of P, a point in the photo's axes, as documents say it.
    const FORMULA: &'static str;
    /// What the terms of its lens are functions of.
    const LENS: LensDirection = LensDirection::Forward;
    /// Whether the second image coordinate counts downwards, as rows of pixels do.
    const DOWN: bool = false;
    /// Whether the adjustment computes several images side by side: for cameras without branches.
    const IN_LANES: bool = false;

    /// The camera with the given parameters.
    fn with_parameters(parameters: Self::Parameters) -> Self;

    /// Its parameters.
    fn parameters(&self) -> Self::Parameters;

    /// The same camera with other parameters: what it has beside them stays.
    #[inline]
    fn with_others(&self, parameters: Self::Parameters) -> Self {
        Self::with_parameters(parameters)
    }

    /// Its displacements at the knots of a spline, row by row; None of cameras without one.
    fn knots(&self) -> Option<&[[f64; 2]]> {
        None
    }

    /// The same camera with other displacements there; None unless it has as many.
    fn with_knots(&self, _knots: Arc<[[f64; 2]]>) -> Option<Self> {
        None
    }

    /// The knots that the image of u depends on; None of cameras without them.
    #[inline]
    fn patch(&self, _u: &Vector3) -> Option<Patch> {
        None
    }

    /// What a small angle near the axis is multiplied by, without sign: the principal distance in the unit of the image.
    fn scale(&self) -> f64;

    /// The image of u; not finite in the plane of the projection centre. What lies behind has the image that the formula gives.
    fn image(&self, u: &Vector3) -> [f64; 2];

    /// The image with its partials.
    fn linearize(&self, u: &Vector3) -> Image<Self::Parameters>;

    /// Observed minus computed of a measured position, and what is computed with its partials: the image, or what a backward camera
    /// compares with the corrected position.
    #[inline(always)]
    fn compare(&self, u: &Vector3, measured: [f64; 2]) -> ([f64; 2], Image<Self::Parameters>) {
        let image = self.linearize(u);
        ([measured[0] - image.xy[0], measured[1] - image.xy[1]], image)
    }

    /// The unit direction in the photo's axes, in front of the camera, of an image position; None where no direction has it.
    fn direction(&self, xy: [f64; 2]) -> Option<Vector3>;

    /// Whether a camera looks to where u is: in front of it, but for those that see more than half of the sphere.
    #[inline]
    fn faces(&self, u: &Vector3) -> bool {
        u.z <= 0.0
    }

    /// Whether u, or what was measured of it, lies beyond where the radial part of the lens is one-to-one: its image is that of another
    /// direction, too.
    fn folds(&self, u: &Vector3, measured: [f64; 2]) -> bool {
        self.radius(u, measured) > self.fold()
    }

    /// The radius that the radial part of the lens is a function of.
    fn radius(&self, _u: &Vector3, _measured: [f64; 2]) -> f64 {
        0.0
    }

    /// The radius from which on it folds back: infinite where it is one-to-one everywhere. It is the same for all images.
    fn fold(&self) -> f64 {
        f64::INFINITY
    }

    /// What a measured position is corrected to; None of a forward camera.
    fn correction(&self, _measured: [f64; 2]) -> Option<[f64; 2]> {
        None
    }

    /// Up to where the radial part of the lens is one-to-one; None where it is so everywhere.
    fn radial_limit(&self) -> Option<RadialLimit> {
        None
    }
}

/// What the terms of a lens are functions of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LensDirection {
    /// Of ideal coordinates.
    Forward,
    /// Of measured coordinates.
    Backward,
}

/// A model of cameras.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ModelFacts {
    /// [`CameraModel::FORMULA`].
    pub formula: &'static str,
    /// [`CameraModel::PARAMETERS`].
    pub parameters: &'static [(&'static str, Unit)],
    /// [`CameraModel::CONSTANTS`].
    pub constants: usize,
    /// [`CameraModel::LENS`].
    pub lens: LensDirection,
    /// [`CameraModel::DOWN`].
    pub down: bool,
}

/// What parameters are called and measured in: names by their unit, in their order.
macro_rules! parameters {
    ($($unit:expr => $($name:literal)+;)+) => {
        &[$($(($name, $unit),)+)+]
    };
}
pub(super) use parameters;

/// What a parameter of a camera is measured in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// The unit of image coordinates.
    Image,
    /// The reciprocal of this power of it.
    PerImage(u8),
    /// None: a number.
    One,
}

/// An image position and its partials; the first index is x or y.
#[derive(Debug, Clone, Copy)]
pub struct Image<P> {
    /// x, y in the unit of the camera.
    pub xy: [f64; 2],
    /// With respect to u.
    pub by_u: [Vector3; 2],
    /// With respect to the parameters of the camera.
    pub by_parameters: [P; 2],
}

impl<P: AsRef<[f64]>> Image<P> {
    /// The same with the partials in a list.
    pub(crate) fn listed(self) -> Image<Vec<f64>> {
        let by_parameters = self.by_parameters.map(|row| row.as_ref().to_vec());
        Image { xy: self.xy, by_u: self.by_u, by_parameters }
    }
}
