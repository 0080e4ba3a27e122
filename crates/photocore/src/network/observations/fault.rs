//! Errors of observations.

use thiserror::Error;

use crate::network::commons::CommonKind;

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
