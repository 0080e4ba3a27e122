//! Precision of observations, and errors of invalid observations.

use nalgebra::DMatrix;
use thiserror::Error;

use crate::network::commons::CommonKind;

/// Smallest standard deviation with a finite weight; the largest is its reciprocal.
const SMALLEST: f64 = 1e-100;
/// Tolerance of the symmetry of a covariance matrix, relative to its diagonal.
const SYMMETRIC: f64 = 1e-9;

/// Precision of the components of an observation, in their units.
#[derive(Debug, Clone, PartialEq)]
pub enum Precision {
    /// Standard deviations.
    Deviations(Vec<f64>),
    /// Covariance matrix.
    Covariance(DMatrix<f64>),
}

impl From<f64> for Precision {
    /// Returns the precision of one component with this standard deviation.
    fn from(sd: f64) -> Self {
        Self::Deviations(vec![sd])
    }
}

/// Precision with a root.
pub(super) trait Root {
    /// Returns L of the covariance matrix S = L L^T of `components` components: L^-1 whitens them.
    fn root(&self, components: usize) -> Result<DMatrix<f64>, Fault>;
}

/// Returns true if a standard deviation has a finite weight.
fn deviates(sd: f64) -> bool {
    sd > SMALLEST && sd < SMALLEST.recip()
}

impl Root for f64 {
    fn root(&self, _components: usize) -> Result<DMatrix<f64>, Fault> {
        if deviates(*self) { Ok(DMatrix::repeat(1, 1, *self)) } else { Err(Fault::Deviation) }
    }
}

impl Root for Precision {
    fn root(&self, components: usize) -> Result<DMatrix<f64>, Fault> {
        let given = match self {
            Self::Deviations(sd) => sd.len(),
            Self::Covariance(matrix) if matrix.ncols() == components => matrix.nrows(),
            Self::Covariance(matrix) => matrix.ncols(),
        };
        if given != components {
            return Err(Fault::Deviations { components, given });
        }
        match self {
            Self::Deviations(sd) if sd.iter().all(|&sd| deviates(sd)) => {
                Ok(DMatrix::from_fn(components, components, |i, j| if i == j { sd[i] } else { 0.0 }))
            }
            Self::Deviations(_) => Err(Fault::Deviation),
            Self::Covariance(s) => {
                let scale = |i: usize, j: usize| (s[(i, i)] * s[(j, j)]).sqrt();
                let symmetric = |i: usize, j: usize| (s[(i, j)] - s[(j, i)]).abs() <= SYMMETRIC * scale(i, j);
                let sound = (0..components)
                    .all(|i| deviates(s[(i, i)].sqrt()) && (0..components).all(|j| symmetric(i, j)));
                sound
                    .then(|| s.clone().cholesky())
                    .flatten()
                    .map(|factor| factor.l())
                    .ok_or(Fault::Covariance)
            }
        }
    }
}

/// Error of an invalid observation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum Fault {
    /// Missing point.
    #[error("names point {0}, which is not there")]
    NoPoint(usize),
    /// Missing photo.
    #[error("names photo {0}, which is not there")]
    NoPhoto(usize),
    /// Missing shared parameter.
    #[error("names common unknown {0}, which is not there")]
    NoCommon(usize),
    /// Shared parameter of a wrong type.
    #[error("names common unknown {common}, which is no {}", .needed.name())]
    OtherCommon {
        /// Index of the shared parameter.
        common: usize,
        /// Required type.
        needed: CommonKind,
    },
    /// Photo without a trajectory, and so without a velocity.
    #[error("is of the motion of photo {0}, which is on no trajectory")]
    AtRest(usize),
    /// All quantities of the observation are fixed.
    #[error("is of known quantities alone")]
    NothingUnknown,
    /// Repeated point, photo or shared parameter.
    #[error("names a point, photo or common unknown twice")]
    Twice,
    /// Observation without components.
    #[error("has no component")]
    Nothing,
    /// Wrong number of standard deviations.
    #[error("has {components} components and {given} standard deviations")]
    Deviations {
        /// Number of components.
        components: usize,
        /// Number of standard deviations, or rows of the covariance matrix.
        given: usize,
    },
    /// Standard deviation without a finite weight.
    #[error("has a standard deviation that is not positive and finite")]
    Deviation,
    /// Invalid covariance matrix.
    #[error("has a covariance matrix that is not symmetric and positive definite")]
    Covariance,
    /// Matrix that is not a rotation.
    #[error("has a matrix that is no rotation")]
    Rotation,
    /// Value that is not finite, as given or at the initial values.
    #[error("has a value that is not finite, or cannot be computed from the initial values")]
    NotFinite,
}
