//! Why a network cannot be adjusted.

use thiserror::Error;

use super::observations::Fault;
use super::surroundings::BlockOf;
use crate::Stopped;
use crate::adjustment::{CofactorError, DatumError, gib};
use crate::normals::LayoutError;

/// Why a network cannot be adjusted, or has no cofactors. Photos, cameras and points are indices into the network.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum NetworkError {
    /// An image names a photo or point that is not there.
    #[error("image {0} names a photo or point that is not there")]
    Index(usize),
    /// A photo names a camera that is not there.
    #[error("photo {0} names a camera that is not there")]
    NoCamera(usize),
    /// There is no photo of this index.
    #[error("there is no photo {0}")]
    NoPhoto(usize),
    /// There is no point of this index.
    #[error("there is no point {0}")]
    NoPoint(usize),
    /// There is no camera of this index.
    #[error("there is no camera {0}")]
    CameraIndex(usize),
    /// There is no common unknown of this index.
    #[error("there is no common unknown {0}")]
    NoCommon(usize),
    /// The point took no part in the adjustment.
    #[error("point {0} was left out of the adjustment")]
    LeftOut(usize),
    /// Partials that are not those of functions of the unknowns.
    #[error("{numbers} partials are not rows of {unknowns}, as many as there are unknowns")]
    Partials {
        /// How many unknowns there are.
        unknowns: usize,
        /// How many partials.
        numbers: usize,
    },
    /// The state is not that of an adjustment of this network.
    #[error("the adjusted state is not of this network")]
    State,
    /// A camera has more or fewer standard deviations than parameters.
    #[error("camera {0} has not as many standard deviations as parameters")]
    CameraDeviations(usize),
    /// A camera has a covariance matrix that is not one of its weighted parameters.
    #[error("camera {0} has a covariance matrix that is not that of its weighted parameters")]
    CameraCovariance(usize),
    /// A common unknown has more or fewer standard deviations than unknowns.
    #[error("common unknown {0} has not as many standard deviations as unknowns")]
    CommonDeviations(usize),
    /// A photo that is mounted twice, on itself, on a photo that is mounted, or names a photo or sensor that is not there.
    #[error(
        "mount {0} names a photo or sensor that is not there, or a photo that is mounted twice or has others mounted on it"
    )]
    Mount(usize),
    /// What images pass names unknowns, points, photos or cameras that are not there, or not such as it may have.
    #[error("passage {0} names unknowns, points, photos or cameras that are not there, or not of its kind")]
    Passage(usize),
    /// A trajectory whose basis is none, or that has not a coefficient of the right type for each function.
    #[error(
        "trajectory {0} has knots that are none, or more or fewer coefficients than functions of its basis"
    )]
    Trajectory(usize),
    /// Some images have a time, and others have none.
    #[error("{0} times are given for another number of images")]
    ImageTimes(usize),
    /// A photo or an image at a time that a trajectory does not reach.
    #[error(
        "photo {photo} is at {time} s of trajectory {trajectory}, which reaches from {first} to {last} s: half a record beyond its table, within its knots"
    )]
    OutsideTrajectory {
        /// The photo.
        photo: usize,
        /// The point of its image; None where it is the photo itself.
        point: Option<usize>,
        /// The trajectory.
        trajectory: usize,
        /// The time of the photo or of one of its images.
        time: f64,
        /// The first time that may be asked for.
        first: f64,
        /// The last.
        last: f64,
    },
    /// A constant of a camera has a standard deviation.
    #[error(
        "{parameter} of camera {camera} is a constant and cannot be free or weighted: its standard deviation is 0"
    )]
    CameraConstant {
        /// The camera.
        camera: usize,
        /// What the constant is called.
        parameter: &'static str,
    },
    /// An observation that contradicts itself or the network.
    #[error("observation {index}, of kind {kind}, {fault}")]
    Observation {
        /// Its index.
        index: usize,
        /// The name of its kind.
        kind: &'static str,
        /// What is wrong with it.
        fault: Fault,
    },
    /// Poses in vectors in a space where they are not defined.
    #[error("poses in vectors need rectangular space and no refraction, and carry no datum")]
    Vectors,
    /// Photos whose attitudes are to carry a datum but do not step by rotations: poses in vectors, fixed angles, full steps.
    #[error(
        "the attitude of photo {0} cannot carry a datum: an angle is fixed, or steps are those of a program of its time"
    )]
    Attitude(usize),
    /// Nothing to adjust.
    #[error("no point is left to adjust: none is on two photos")]
    Empty,
    /// The rays of a point do not say where it is.
    #[error("the rays of point {0} do not intersect, so that it has no initial position")]
    NoIntersection(usize),
    /// Points whose image points do not determine them.
    #[error("{} points are not determined by their image points", .0.len())]
    UndeterminedPoints(Vec<usize>),
    /// Combinations of the unknowns of photos and of cameras that the observations do not determine.
    #[error("{} combinations of the unknowns of photos and cameras are not determined", .0.len())]
    Undetermined(Vec<Combination>),
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
    /// More cofactors than there may be.
    #[error(transparent)]
    Cofactors(CofactorError),
    /// The work was stopped: by whoever watched it, or for want of memory or threads.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// It cannot be taken to a datum.
    #[error(transparent)]
    Datum(#[from] DatumError),
    /// A block of unknowns that other nodes touch is not there, or has no unknowns of its own.
    #[error("{0:?}, named for other nodes, is not there or has no unknowns of its own")]
    NoBlock(BlockOf),
    /// A node of a larger network cannot go on with what it is given.
    #[error("{0}")]
    Node(&'static str),
    /// More than can be numbered.
    #[error(transparent)]
    Layout(#[from] LayoutError),
}

/// Coordinates or angles that double precision rounds by more than their standard deviations, or than image coordinates show.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{} photos and {} points have coordinates or angles too large for double precision", .photos.len(), .points.len())]
pub struct Coarse {
    /// Photos that have them.
    pub photos: Vec<usize>,
    /// Points that have them.
    pub points: Vec<usize>,
}

/// What a combination of unknowns moves.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Combination {
    /// Photos, by their pose or a camera that is theirs alone.
    pub photos: Vec<usize>,
    /// Cameras that several photos share.
    pub cameras: Vec<usize>,
    /// Cameras and their parameters that take a notable part; none where this was not looked into.
    pub parameters: Vec<(usize, usize)>,
    /// Parts of the poses of photos that do.
    pub poses: Vec<PosePart>,
    /// Common unknowns.
    pub commons: Vec<usize>,
}

/// A part of the poses of photos.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum PosePart {
    /// Positions along the directions of view.
    Along,
    /// Positions across these.
    Across,
    /// Turns about axes across the directions of view.
    Tilt,
    /// Turns about the directions of view.
    Swing,
}

impl PosePart {
    pub(super) const ALL: [Self; 4] = [Self::Along, Self::Across, Self::Tilt, Self::Swing];

    /// What it is called.
    pub fn name(self) -> &'static str {
        match self {
            Self::Along => "along",
            Self::Across => "across",
            Self::Tilt => "tilt",
            Self::Swing => "swing",
        }
    }
}
