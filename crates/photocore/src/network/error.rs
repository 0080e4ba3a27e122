//! Why a network cannot be adjusted.

use thiserror::Error;

use super::precision::Coarse;
use crate::adjustment::{AdjustError, DatumError, gib};
use crate::normals::LayoutError;

/// Why a network cannot be adjusted, or has no cofactors. Photos, cameras and points are indices into the network.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum NetworkError {
    /// An image names a photo or point that is not there.
    #[error("image {0} names a photo or point that is not there")]
    Index(usize),
    /// A photo names a camera that is not there.
    #[error("photo {0} names a camera that is not there")]
    NoCamera(usize),
    /// A camera has more or fewer standard deviations than parameters.
    #[error("camera {0} has not as many standard deviations as parameters")]
    CameraDeviations(usize),
    /// Several photos share a camera that is not held.
    #[error("camera {0} has unknown parameters and belongs to several photos")]
    SharedCamera(usize),
    /// Poses in vectors in a space where they are not defined.
    #[error("poses in vectors need rectangular space and no refraction, and carry no datum")]
    Vectors,
    /// Nothing to adjust.
    #[error("no point is left to adjust: none is on two photos")]
    Empty,
    /// The rays of a point do not say where it is.
    #[error("the rays of point {0} do not intersect, so that it has no initial position")]
    NoIntersection(usize),
    /// Points whose image points do not determine them.
    #[error("{} points are not determined by their image points", .0.len())]
    UndeterminedPoints(Vec<usize>),
    /// Photos whose unknowns the observations do not determine; one list for each undetermined combination.
    #[error("{} combinations of the photos' unknowns are not determined", .0.len())]
    UndeterminedPhotos(Vec<Vec<usize>>),
    /// The initial values put a point into the plane of a projection centre, so that its image is not finite.
    #[error("the initial values give image coordinates that are not finite")]
    NotFinite,
    /// Values too large for double precision.
    #[error(transparent)]
    Coarse(#[from] Coarse),
    /// The adjustment would take more memory than it may.
    #[error("the adjustment takes {} of memory, and {} are free", gib(*.needed), gib(*.available))]
    Memory {
        /// Bytes that it would take.
        needed: usize,
        /// Bytes that it may take.
        available: usize,
    },
    /// The caller asked to stop.
    #[error("interrupted")]
    Interrupted,
    /// An allocation of so many bytes failed.
    #[error("there is no memory for an array of {0} bytes")]
    OutOfMemory(usize),
    /// It cannot be taken to a datum.
    #[error(transparent)]
    Datum(#[from] DatumError),
    /// More than can be numbered.
    #[error(transparent)]
    Layout(#[from] LayoutError),
}

impl NetworkError {
    /// What stopped the adjustment, in terms of the network; `points` are those that took part.
    pub(super) fn new(error: AdjustError, points: &[usize]) -> Self {
        match error {
            AdjustError::UndeterminedLocals(locals) => {
                let mut points: Vec<usize> = locals.into_iter().map(|local| points[local]).collect();
                points.sort_unstable();
                Self::UndeterminedPoints(points)
            }
            AdjustError::Undetermined(combinations) => Self::UndeterminedPhotos(combinations),
            AdjustError::NotFinite => Self::NotFinite,
            AdjustError::Interrupted => Self::Interrupted,
            AdjustError::OutOfMemory(bytes) => Self::OutOfMemory(bytes),
        }
    }
}
