//! What is wrong with an observation.

use thiserror::Error;

use crate::network::commons::CommonKind;

/// What is wrong with an observation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum Fault {
    /// A point that is not there.
    #[error("names point {0}, which is not there")]
    NoPoint(usize),
    /// A photo that is not there.
    #[error("names photo {0}, which is not there")]
    NoPhoto(usize),
    /// A common unknown that is not there.
    #[error("names common unknown {0}, which is not there")]
    NoCommon(usize),
    /// A common unknown of another type than it needs.
    #[error("names common unknown {common}, which is no {}", .needed.name())]
    OtherCommon {
        /// Its index.
        common: usize,
        /// The type.
        needed: CommonKind,
    },
    /// A photo that is on no trajectory: it has no velocity.
    #[error("is of the motion of photo {0}, which is on no trajectory")]
    AtRest(usize),
    /// Nothing of what it is of is unknown.
    #[error("is of known quantities alone")]
    NothingUnknown,
    /// A point, photo or common unknown with itself.
    #[error("names a point, photo or common unknown twice")]
    Twice,
    /// No component is observed.
    #[error("has no component")]
    Nothing,
    /// More or fewer standard deviations than components.
    #[error("has {components} components and {given} standard deviations")]
    Deviations {
        /// How many components it has.
        components: usize,
        /// Standard deviations, or rows of the covariance matrix.
        given: usize,
    },
    /// A standard deviation that gives no weight.
    #[error("has a standard deviation that is not positive and finite")]
    Deviation,
    /// A matrix that is no covariance matrix.
    #[error("has a covariance matrix that is not symmetric and positive definite")]
    Covariance,
    /// A matrix that is no rotation.
    #[error("has a matrix that is no rotation")]
    Rotation,
    /// A value that is not finite, at the initial values or at all.
    #[error("has a value that is not finite, or cannot be computed from the initial values")]
    NotFinite,
}
