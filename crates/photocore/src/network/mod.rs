//! Networks of photos: poses, cameras, points and images adjusted together.
//!
//! Unknowns are the pose of every photo, the parameters of the cameras unless they are held, and the coordinates of every point,
//! each weighted from free to fixed; observations are image coordinates and, beside them, those of [`observations`]. A block of aerial
//! photographs (GIANT guide, sections 4 to 9) has cameras that are held, and poses in angles; a collection "in the large" (Agarwal,
//! Snavely, Seitz and Szeliski 2010) has a camera of its own for every photo, and poses in vectors; a block that calibrates its camera
//! has one for all. Positions are X, Y, Z or longitude, latitude, height.
//!
//! Two photos over four control points:
//!
//! ```
//! use photocore::geometry::{self, ObjectSpace, Perspective, RotationSense};
//! use photocore::network::{Camera, Image, Network, Options, Photo, Point};
//!
//! let corners = [[0.0, 0.0, 0.0], [900.0, 0.0, 40.0], [0.0, 900.0, 70.0], [900.0, 900.0, 10.0]];
//! let stations = [[200.0, 450.0, 1500.0], [700.0, 450.0, 1500.0]];
//! let mut network = Network::new();
//! network.cameras.push(Camera::held(Perspective { principal_distance: -150.0 }.into()));
//! network.points = corners.map(|coordinates| Point::control(coordinates, [0.02; 3])).to_vec();
//! for (photo, station) in stations.into_iter().enumerate() {
//!     let space = ObjectSpace::Rectangular;
//!     let truth = geometry::View::new(space, RotationSense::GroundToPhoto, station, [0.01, -0.02, 0.1], -150.0);
//!     let image = |(point, corner)| Image {
//!         photo,
//!         point,
//!         xy: truth.project(&geometry::Point::new(space, corner)),
//!         sd: [0.005; 2],
//!     };
//!     network.images.extend(corners.into_iter().enumerate().map(image));
//!     // Poses are known to some metres and degrees.
//!     let [x, y, z] = station;
//!     network.photos.push(Photo::free([x + 5.0, y - 4.0, z + 9.0, 0.0, 0.0, 0.0], 0));
//! }
//! let solution = network.adjust(&Options::default())?;
//! let photo = &solution.photos[1];
//! assert!((photo.pose[0] - 700.0).abs() < 1e-6 && (photo.pose[5] - 0.1).abs() < 1e-9);
//! // Four points seen twice, and their coordinates, less twelve unknowns of the photos and twelve of the points.
//! assert_eq!(solution.degrees_of_freedom, 16 + 12 - 12 - 12);
//! assert!(photo.cofactors[0].sqrt() < 1.0, "standard deviation of the station's X in metres");
//! # Ok::<(), photocore::network::NetworkError>(())
//! ```

mod adjust;
mod adjusted;
mod blocks;
mod bundle;
mod camera_priors;
mod cameras;
mod check;
pub mod commons;
mod composed;
mod covariance;
mod datum;
mod error;
mod evaluated;
pub mod film;
mod group_tests;
mod groups;
pub mod hypotheses;
mod in_block;
mod in_lanes;
mod intersection;
mod layout;
mod median;
mod model;
pub mod mounts;
mod naming;
mod neighbourhood;
mod node;
mod node_chord;
mod node_datum;
pub mod observations;
mod parts;
pub mod passages;
mod passing;
mod precision;
mod predictions;
mod problem;
mod responses;
mod screens;
mod selection;
mod solution;
mod state;
mod station_values;
mod stations;
mod surroundings;
mod suspects;
mod trajectory_motions;
mod trial;
mod visibility;
mod weak_points;
mod weighted_angles;

use nalgebra::DMatrix;

use crate::adjustment;
use crate::geometry::{self, ObjectSpace, POSE, PoseNumbers, Refraction, RotationSense};
use crate::normals::Ordering;

pub use adjust::NetworkAdjustment;
pub use adjusted::{AdjustedPhoto, AdjustedPoint};
pub use cameras::AdjustedCamera;
pub use commons::{AdjustedCommon, Common, CommonKind};
pub use covariance::{Covariances, Of};
pub use error::{Coarse, Combination, NetworkError, PosePart};
pub use group_tests::Tests;
pub use groups::Groups;
pub(crate) use intersection::meet;
pub(crate) use median::median;
pub use mounts::{Mount, Trajectory};
pub use node::{FormedNode, Node, NodePrediction};
pub use node_datum::{AdjustedInParts, UnknownName};
pub use observations::{AdjustedObservation, KindSums, Observation, Precision};
pub use passages::Passage;
pub use predictions::{OnPoint, Prediction};
pub use responses::{Moved, UnknownOf};
pub use selection::{Dropped, Reason};
pub use solution::{
    DatumInForce, Joint, LEAST_REDUNDANCY, Redundancies, Solution, SumsOfSquares, Unseen, Weak,
};
pub use state::{InnerConstraints, NetworkDatum, State};
pub use surroundings::{BlockOf, Surroundings};
pub use suspects::{Subject, Suspects};
pub use trial::{Converged, Out, Outcome, Trial};
pub use weak_points::WeakPoint;

/// A photo as it is known beforehand.
#[derive(Debug, Clone, Copy)]
pub struct Photo {
    /// Initial values of the six unknowns of its pose (see [`PoseNumbers`]); those of fixed ones.
    pub pose: [f64; POSE],
    /// Observed values; those count that are weighted. Angles, and longitudes, may be whole turns apart.
    pub observed: [f64; POSE],
    /// Standard deviations: infinite free, zero fixed.
    pub sd: [f64; POSE],
    /// Index of its camera.
    pub camera: usize,
}

impl Photo {
    /// Of which nothing is known: its pose is where to start from.
    pub fn free(pose: [f64; POSE], camera: usize) -> Self {
        Self::known(pose, [f64::INFINITY; POSE], camera)
    }

    /// Of which the pose was observed, with these standard deviations.
    pub fn known(pose: [f64; POSE], sd: [f64; POSE], camera: usize) -> Self {
        Self { pose, observed: pose, sd, camera }
    }
}

/// A camera as it is known beforehand. Photos may share it: then its unknown parameters are a block of their own; those of a camera of
/// one photo are unknowns of that.
#[derive(Debug, Clone)]
pub struct Camera {
    /// The camera with its initial (and, where weighted, observed) parameters.
    pub camera: geometry::Camera,
    /// Standard deviations of the parameters: infinite free, zero fixed.
    pub sd: Vec<f64>,
    /// Covariance matrix of those that are weighted, in their order; None where these were observed one by one.
    pub covariance: Option<DMatrix<f64>>,
}

impl Camera {
    /// A camera whose parameters are known one by one: standard deviations, infinite free, zero fixed.
    pub fn new(camera: geometry::Camera, sd: Vec<f64>) -> Self {
        Self { camera, sd, covariance: None }
    }

    /// A camera whose parameters are known.
    pub fn held(camera: geometry::Camera) -> Self {
        let count = camera.parameter_names().len();
        Self::new(camera, vec![0.0; count])
    }

    /// Whether its parameters are known.
    pub fn is_held(&self) -> bool {
        self.sd.iter().all(|&sd| sd == 0.0)
    }
}

/// A point as it is known beforehand.
#[derive(Debug, Clone, Copy)]
pub struct Point {
    /// Coordinates in the object space; NaN where unknown.
    pub coordinates: [f64; 3],
    /// Standard deviations: finite for held components (zero fixed), infinite for all others.
    pub sd: [f64; 3],
}

impl Point {
    /// Of which nothing is known.
    pub fn free() -> Self {
        Self { coordinates: [f64::NAN; 3], sd: [f64::INFINITY; 3] }
    }

    /// Of which the coordinates were determined, with these standard deviations.
    pub fn control(coordinates: [f64; 3], sd: [f64; 3]) -> Self {
        Self { coordinates, sd }
    }

    /// Which components are held.
    pub fn held(&self) -> [bool; 3] {
        self.sd.map(f64::is_finite)
    }
}

/// An image point.
#[derive(Debug, Clone, Copy)]
pub struct Image {
    /// Index of its photo.
    pub photo: usize,
    /// Index of its point.
    pub point: usize,
    /// Image coordinates in the unit of the camera.
    pub xy: [f64; 2],
    /// Their standard deviations.
    pub sd: [f64; 2],
}

/// A network of photos.
#[derive(Debug, Clone)]
pub struct Network {
    /// Coordinates of positions and points.
    pub space: ObjectSpace,
    /// What the six unknowns of a pose are.
    pub poses: PoseNumbers,
    /// What bends the rays, applied in every iteration; None for images that are free of it.
    pub refraction: Option<Refraction>,
    /// Its cameras.
    pub cameras: Vec<Camera>,
    /// Its photos.
    pub photos: Vec<Photo>,
    /// Its points.
    pub points: Vec<Point>,
    /// Its image points.
    pub images: Vec<Image>,
    /// What else was observed.
    pub observations: Vec<Observation>,
    /// Unknowns that observations, and photos that are mounted, have in common.
    pub commons: Vec<Common>,
    /// Which photos are on a frame with others, or on a trajectory.
    pub mounts: Vec<Mount>,
    /// The trajectories.
    pub trajectories: Vec<Trajectory>,
    /// Of each image its number on the scale of its photo's time (see [`mounts::OnTrajectory`]); nothing at all where all are zero.
    pub image_times: Vec<f64>,
    /// What images pass beside pose, point and camera.
    pub passages: Vec<Passage>,
}

impl Network {
    /// Without anything yet, in rectangular space, poses in angles of the rotation from ground to photo, images free of refraction.
    pub fn new() -> Self {
        Self::default()
    }
}

impl Default for Network {
    fn default() -> Self {
        Self {
            space: ObjectSpace::Rectangular,
            poses: PoseNumbers::Angles(RotationSense::GroundToPhoto),
            refraction: None,
            cameras: vec![],
            photos: vec![],
            points: vec![],
            images: vec![],
            observations: vec![],
            commons: vec![],
            mounts: vec![],
            trajectories: vec![],
            image_times: vec![],
            passages: vec![],
        }
    }
}

/// What the variance of unit weight is based on (GIANT guide, Appendix E).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum UnitVariance {
    /// The rule of 1987, photos completely free: image coordinates and ground control count, weights of poses and cameras do not,
    /// though what these determine is taken off. Its expectation is above 1 where these are strong.
    Free,
    /// Every weighted quantity counts as the observation that it is: the expectation is 1 whatever the weights are.
    #[default]
    Constrained,
    /// Image coordinates, ground control and what was observed beside these, over the sum of their redundancy numbers: right whatever the
    /// weights of poses and cameras are.
    Redundancy,
    /// Set to one.
    Unity,
}

/// Where points start from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Start {
    /// Where their (straight) rays meet, but for the components that are held.
    #[default]
    Intersected,
    /// Their given coordinates where these are known, otherwise as above.
    Given,
}

/// The photo, and the coordinate of another one, that are to be held where nothing else gives a datum.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Minimum {
    /// The photo whose pose is held.
    pub photo: usize,
    /// Photo and number of its unknown, held for the scale; where there is none, the one in which a photo is farthest from the first.
    pub coordinate: Option<(usize, usize)>,
}

/// What may leave a network for the good of the rest while it is adjusted, see [`Reason`]; each is on unless it is switched off, and then
/// stays and does its harm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Screens {
    /// Points and photos that their images do not determine, where they are few.
    pub not_determined: bool,
    /// Points that rays which part, or are parallel, lead out of the network.
    pub ran_off: bool,
    /// Points that two rays lead to the station of a photo.
    pub ran_into_station: bool,
    /// Points given at the place of a station that sees them.
    pub at_station: bool,
    /// Points held near a station that sees them, where the adjustment goes wrong with them and not without.
    pub near_station: bool,
}

impl Default for Screens {
    /// All.
    fn default() -> Self {
        Self {
            not_determined: true,
            ran_off: true,
            ran_into_station: true,
            at_station: true,
            near_station: true,
        }
    }
}

/// How to adjust a network.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// When to stop, and what to compute.
    pub adjustment: adjustment::Options,
    /// How to order the photos.
    pub ordering: Ordering,
    /// What the variance of unit weight is based on.
    pub unit_variance: UnitVariance,
    /// Where points start from.
    pub start: Start,
    /// Whether photos without images stay as they are; otherwise their unknowns are unknowns, and determined only if they are weighted.
    pub hold_unused: bool,
    /// Bytes that the adjustment may take (see [`crate::normals::System::memory`]); None for any number.
    pub memory: Option<usize>,
    /// Bytes of these that the caller takes besides: an interpreter for what it loads.
    pub reserved: usize,
    /// What to hold where nothing else gives a datum; None for what is best held.
    pub minimum: Option<Minimum>,
    /// What may leave for the good of the rest.
    pub screens: Screens,
}

impl Default for Options {
    /// Strict least squares of constrained photos, points from where their rays meet.
    fn default() -> Self {
        Self {
            adjustment: adjustment::Options::default(),
            ordering: Ordering::Auto,
            unit_variance: UnitVariance::default(),
            start: Start::default(),
            hold_unused: false,
            memory: None,
            reserved: 0,
            minimum: None,
            screens: Screens::default(),
        }
    }
}
