//! Interface of all camera models.

use std::sync::Arc;

use super::inverse::RadialLimit;
use crate::geometry::rotation::Vector3;

/// Mapping of u, a point in the photo's axes (the camera looks along -z), to image coordinates.
///
/// The image depends only on the direction of u: (dx/du) u = 0.
///
/// The lens of a **forward** camera is a function of ideal coordinates: it maps u to the measured position. The lens of a **backward**
/// camera is a function of measured coordinates: the corrected position is compared with the central perspective of u
/// ([`super::backward::BackwardModel`]).
pub trait CameraModel: Clone {
    /// Array of the interior parameters.
    type Parameters: Copy + AsRef<[f64]> + AsMut<[f64]> + for<'a> TryFrom<&'a [f64]>;

    /// Name of the model.
    const NAME: &'static str;
    /// Names and units of the parameters, in order.
    const PARAMETERS: &'static [(&'static str, Unit)];
    /// Number of constants: the last parameters, which are always fixed.
    const CONSTANTS: usize = 0;
    /// Formula of the image of P, a point in the photo's axes, for documents.
    const FORMULA: &'static str;
    /// Coordinates on which the lens terms depend.
    const LENS: LensDirection = LensDirection::Forward;
    /// Whether the second image coordinate increases downwards, as pixel rows do.
    const DOWN: bool = false;
    /// Whether the adjustment evaluates several images in SIMD lanes: for cameras without branches.
    const IN_LANES: bool = false;

    /// Returns the camera with the given parameters.
    fn with_parameters(parameters: Self::Parameters) -> Self;

    /// Returns the parameters.
    fn parameters(&self) -> Self::Parameters;

    /// Returns the camera with other parameters and the same knots.
    #[inline]
    fn with_others(&self, parameters: Self::Parameters) -> Self {
        Self::with_parameters(parameters)
    }

    /// Returns the displacements at the knots of a spline, row by row; None for cameras without a spline.
    fn knots(&self) -> Option<&[[f64; 2]]> {
        None
    }

    /// Returns the camera with other displacements at the knots; None if their number differs.
    fn with_knots(&self, _knots: Arc<[[f64; 2]]>) -> Option<Self> {
        None
    }

    /// Returns the knots that affect the image of u; None for cameras without knots.
    #[inline]
    fn patch(&self, _u: &Vector3) -> Option<Patch> {
        None
    }

    /// Returns the absolute image scale near the axis (image length per radian): the principal distance in the unit of the image.
    fn scale(&self) -> f64;

    /// Returns the image of u; not finite in the plane of the projection centre. Points behind the camera are not rejected.
    fn image(&self, u: &Vector3) -> [f64; 2];

    /// Returns the image with its partials.
    fn linearize(&self, u: &Vector3) -> Image<Self::Parameters>;

    /// Returns the residual of a measured position and the linearized computed value: the image or, for a backward camera, the central
    /// perspective that is compared with the corrected position.
    #[inline(always)]
    fn compare(&self, u: &Vector3, measured: [f64; 2]) -> ([f64; 2], Image<Self::Parameters>) {
        let image = self.linearize(u);
        ([measured[0] - image.xy[0], measured[1] - image.xy[1]], image)
    }

    /// Returns the unit direction, in the photo's axes and in front of the camera, of an image position; None outside of the model's range.
    fn direction(&self, xy: [f64; 2]) -> Option<Vector3>;

    /// Returns whether u is in the field of view: in front of the camera, unless the model covers more than a hemisphere.
    #[inline]
    fn faces(&self, u: &Vector3) -> bool {
        u.z <= 0.0
    }

    /// Returns whether u, or its measured position, is beyond the one-to-one range of the radial part of the lens. Another direction then
    /// has the same image.
    fn folds(&self, u: &Vector3, measured: [f64; 2]) -> bool {
        self.radius(u, measured) > self.fold()
    }

    /// Returns the radius on which the radial part of the lens depends.
    fn radius(&self, _u: &Vector3, _measured: [f64; 2]) -> f64 {
        0.0
    }

    /// Returns the radius at which the radial part folds back; infinite if it is one-to-one. It is the same for all images.
    fn fold(&self) -> f64 {
        self.radial_limit().map_or(f64::INFINITY, |limit| limit.radius)
    }

    /// Returns the corrected position of a measured one; None for a forward camera.
    fn correction(&self, _measured: [f64; 2]) -> Option<[f64; 2]> {
        None
    }

    /// Returns the limit of the one-to-one range of the radial part of the lens; None if it is unlimited.
    fn radial_limit(&self) -> Option<RadialLimit> {
        None
    }
}

/// Coordinates on which the terms of a lens depend.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LensDirection {
    /// Ideal coordinates.
    Forward,
    /// Measured coordinates.
    Backward,
}

/// Description of a camera model.
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

/// Lists parameters by unit: names and units, in order.
macro_rules! parameters {
    ($($unit:expr => $($name:literal)+;)+) => {
        &[$($(($name, $unit),)+)+]
    };
}
pub(super) use parameters;

/// Unit of a camera parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// Unit of image coordinates.
    Image,
    /// Reciprocal of this power of the image unit.
    PerImage(u8),
    /// Dimensionless.
    One,
}

/// Image position and its partials; the first index is x or y.
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
    /// Converts the partials to vectors of variable length.
    pub(crate) fn listed(self) -> Image<Vec<f64>> {
        let by_parameters = self.by_parameters.map(|row| row.as_ref().to_vec());
        Image { xy: self.xy, by_u: self.by_u, by_parameters }
    }
}

/// Maximum number of nodes per axis that affect a position.
pub(super) const NODES: usize = 4;

/// Knots that affect an image position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Patch {
    /// Column and row of the first knot.
    pub first: [usize; 2],
    /// Number of knots along each of columns and rows.
    pub nodes: usize,
    /// Weight of each knot, row by row: d image / d knot = diag(fx, fy) times the weight. Zero beyond nodes^2.
    pub weights: [f64; NODES * NODES],
}

impl Patch {
    /// Returns the knot indices (row by row, `columns` per row) with their weights.
    pub fn knots(&self, columns: usize) -> impl Iterator<Item = (usize, f64)> + use<'_> {
        let ([first, row], nodes) = (self.first, self.nodes);
        let number = move |k: usize| (row + k / nodes) * columns + first + k % nodes;
        self.weights[..nodes * nodes].iter().enumerate().map(move |(k, &weight)| (number(k), weight))
    }
}

/// Rectangular block of knots.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    /// Column and row of the first knot.
    pub first: [usize; 2],
    /// Column and row after the last knot.
    pub end: [usize; 2],
}

impl Window {
    /// Returns whether the window contains all knots of a patch.
    pub fn has(&self, patch: &Patch) -> bool {
        (0..2).all(|k| self.first[k] <= patch.first[k] && patch.first[k] + patch.nodes <= self.end[k])
    }

    /// Returns the knot indices, row by row with `columns` per row.
    pub fn knots(&self, columns: usize) -> impl Iterator<Item = usize> + use<> {
        let Self { first, end } = *self;
        (first[1]..end[1]).flat_map(move |row| (first[0]..end[0]).map(move |column| row * columns + column))
    }
}
