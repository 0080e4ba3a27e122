//! Errors of networks.

use thiserror::Error;

use super::interface::BlockId;
use super::observations::Fault;
use crate::Stopped;
use crate::adjustment::{CofactorError, DatumError, format_bytes};
use crate::normals::LayoutError;

/// Error of a network that cannot be adjusted or has undefined cofactors. Photos, cameras and points are indices into the network.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum NetworkError {
    /// An image refers to a missing photo or point.
    #[error("image {0} names a photo or point that is not there")]
    Index(usize),
    /// A photo refers to a missing camera.
    #[error("photo {0} names a camera that is not there")]
    NoCamera(usize),
    /// Index of a missing photo.
    #[error("there is no photo {0}")]
    NoPhoto(usize),
    /// Index of a missing point.
    #[error("there is no point {0}")]
    NoPoint(usize),
    /// Index of a missing camera.
    #[error("there is no camera {0}")]
    CameraIndex(usize),
    /// Index of a missing shared parameter.
    #[error("there is no common unknown {0}")]
    NoCommon(usize),
    /// The point was excluded from the adjustment.
    #[error("point {0} was left out of the adjustment")]
    LeftOut(usize),
    /// The length of partials is not a multiple of the number of parameters.
    #[error("{numbers} partials are not rows of {unknowns}, as many as there are unknowns")]
    Partials {
        /// Number of parameters.
        unknowns: usize,
        /// Number of partials.
        numbers: usize,
    },
    /// The state belongs to another network or adjustment.
    #[error("the adjusted state is not of this network")]
    State,
    /// The number of standard deviations of a camera differs from the number of its parameters.
    #[error("camera {0} has not as many standard deviations as parameters")]
    CameraDeviations(usize),
    /// The covariance matrix of a camera does not fit its weighted parameters.
    #[error("camera {0} has a covariance matrix that is not that of its weighted parameters")]
    CameraCovariance(usize),
    /// The number of standard deviations of a shared parameter differs from the number of its components.
    #[error("common unknown {0} has not as many standard deviations as unknowns")]
    CommonDeviations(usize),
    /// A mount refers to a missing photo or sensor, or its photo is mounted twice or carries other photos.
    #[error(
        "mount {0} names a photo or sensor that is not there, or a photo that is mounted twice or has others mounted on it"
    )]
    Mount(usize),
    /// A correction refers to missing parameters, points, photos or cameras, or to ones of a wrong type.
    #[error("passage {0} names unknowns, points, photos or cameras that are not there, or not of its kind")]
    ImageCorrection(usize),
    /// A trajectory has invalid knots, or coefficients that do not match its basis.
    #[error(
        "trajectory {0} has knots that are none, or more or fewer coefficients than functions of its basis"
    )]
    Trajectory(usize),
    /// The number of image times differs from the number of images.
    #[error("{0} times are given for another number of images")]
    ImageTimes(usize),
    /// The time of a photo or image is outside its trajectory.
    #[error(
        "photo {photo} is at {time} s of trajectory {trajectory}, which reaches from {first} to {last} s: half a record beyond its table, within its knots"
    )]
    OutsideTrajectory {
        /// Photo.
        photo: usize,
        /// Point of the image; None for the photo itself.
        point: Option<usize>,
        /// Trajectory.
        trajectory: usize,
        /// Time of the photo or image.
        time: f64,
        /// First valid time.
        first: f64,
        /// Last valid time.
        last: f64,
    },
    /// A constant of a camera has a nonzero standard deviation.
    #[error(
        "{parameter} of camera {camera} is a constant and cannot be free or weighted: its standard deviation is 0"
    )]
    CameraConstant {
        /// Camera.
        camera: usize,
        /// Name of the constant.
        parameter: &'static str,
    },
    /// An observation is invalid or contradicts the network.
    #[error("observation {index}, of kind {kind}, {fault}")]
    Observation {
        /// Index of the observation.
        index: usize,
        /// Name of its type.
        kind: &'static str,
        /// Reason.
        fault: Fault,
    },
    /// Poses in vectors in a space in which they are undefined.
    #[error("poses in vectors need rectangular space and no refraction, and carry no datum")]
    Vectors,
    /// The attitude of a photo cannot take part in a datum: poses in vectors, fixed angles or full steps.
    #[error(
        "the attitude of photo {0} cannot carry a datum: an angle is fixed, or steps are those of a program of its time"
    )]
    Attitude(usize),
    /// No point can be adjusted.
    #[error("no point is left to adjust: none is on two photos")]
    Empty,
    /// The rays of a point do not intersect.
    #[error("the rays of point {0} do not intersect, so that it has no initial position")]
    NoIntersection(usize),
    /// Image observations do not determine these points.
    #[error("{} points are not determined by their image points", .0.len())]
    UndeterminedPoints(Vec<usize>),
    /// Observations do not determine these combinations of parameters of photos and cameras.
    #[error("{} combinations of the unknowns of photos and cameras are not determined", .0.len())]
    Undetermined(Vec<Combination>),
    /// At the initial values, a point is in the plane of a projection centre: its image is not finite.
    #[error("the initial values give image coordinates that are not finite")]
    NotFinite,
    /// Values too large for double precision.
    #[error(transparent)]
    Coarse(#[from] Coarse),
    /// The adjustment needs more memory than is available.
    #[error("the adjustment takes {} of memory, and {} are free", format_bytes(*.needed), format_bytes(*.available))]
    Memory {
        /// Required bytes.
        needed: usize,
        /// Available bytes.
        available: usize,
    },
    /// Too many cofactors.
    #[error(transparent)]
    Cofactors(CofactorError),
    /// The computation was interrupted, or memory or threads were insufficient.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// The datum transformation is impossible.
    #[error(transparent)]
    Datum(#[from] DatumError),
    /// An interface block of other nodes is missing or without free parameters.
    #[error("{0:?}, named for other nodes, is not there or has no unknowns of its own")]
    NoBlock(BlockId),
    /// Invalid input of a node of a larger network.
    #[error("{0}")]
    Node(&'static str),
    /// Too many parameters or observations.
    #[error(transparent)]
    Layout(#[from] LayoutError),
}

/// Coordinates or angles with rounding errors above their standard deviations, or visible in image coordinates.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{} photos and {} points have coordinates or angles too large for double precision", .photos.len(), .points.len())]
pub struct Coarse {
    /// Photos with such values.
    pub photos: Vec<usize>,
    /// Points with such values.
    pub points: Vec<usize>,
}

/// Parameters of an undetermined combination.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Combination {
    /// Photos, by their pose or own camera.
    pub photos: Vec<usize>,
    /// Shared cameras.
    pub cameras: Vec<usize>,
    /// Cameras and parameters with a notable share; empty if not computed.
    pub parameters: Vec<(usize, usize)>,
    /// Parts of poses with a notable share.
    pub poses: Vec<PosePart>,
    /// Shared parameters.
    pub commons: Vec<usize>,
}

/// Part of the poses of photos.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum PosePart {
    /// Positions along the viewing directions.
    Along,
    /// Positions across the viewing directions.
    Across,
    /// Rotations about axes across the viewing directions.
    Tilt,
    /// Rotations about the viewing directions.
    Swing,
}

impl PosePart {
    pub(super) const ALL: [Self; 4] = [Self::Along, Self::Across, Self::Tilt, Self::Swing];

    /// Returns the name of the part.
    pub fn name(self) -> &'static str {
        match self {
            Self::Along => "along",
            Self::Across => "across",
            Self::Tilt => "tilt",
            Self::Swing => "swing",
        }
    }
}
