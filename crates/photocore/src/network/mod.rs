//! Networks of photos: poses, cameras, points and images adjusted together.
//!
//! Parameters are the pose of every photo, the coordinates of every point and the parameters of the cameras that are not fixed. Each is
//! fixed, weighted or free. Observations are image coordinates and the additional [`observations`]. Aerial blocks (GIANT guide, sections 4
//! to 9) have fixed cameras and poses in angles. Collections "in the large" (Agarwal, Snavely, Seitz and Szeliski 2010) have one camera per
//! photo and poses in vectors; self-calibrating blocks share one camera. Positions are X, Y, Z or longitude, latitude, height.
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
pub mod snooping;
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
#[doc(hidden)]
pub use intersection::meet;
#[doc(hidden)]
pub use median::median;
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

/// Initial values and prior information of a photo.
#[derive(Debug, Clone, Copy)]
pub struct Photo {
    /// Initial values of the six parameters of its pose (see [`PoseNumbers`]), and the values of fixed ones.
    pub pose: [f64; POSE],
    /// Observed values; only weighted components count. Angles and longitudes may differ by full circles.
    pub observed: [f64; POSE],
    /// Standard deviations: infinite free, zero fixed.
    pub sd: [f64; POSE],
    /// Index of its camera.
    pub camera: usize,
}

impl Photo {
    /// Returns a photo without prior information; `pose` contains the initial values.
    pub fn free(pose: [f64; POSE], camera: usize) -> Self {
        Self::known(pose, [f64::INFINITY; POSE], camera)
    }

    /// Returns a photo with an observed pose and its standard deviations.
    pub fn known(pose: [f64; POSE], sd: [f64; POSE], camera: usize) -> Self {
        Self { pose, observed: pose, sd, camera }
    }
}

/// Initial values and prior information of a camera. The free parameters of a camera that several photos share form their own parameter
/// block; otherwise they belong to the block of its photo.
#[derive(Debug, Clone)]
pub struct Camera {
    /// Camera with initial values (and, if weighted, observed values) of its parameters.
    pub camera: geometry::Camera,
    /// Standard deviations of the parameters: infinite free, zero fixed.
    pub sd: Vec<f64>,
    /// Covariance matrix of the weighted parameters in their order; None if they were observed independently.
    pub covariance: Option<DMatrix<f64>>,
}

impl Camera {
    /// Returns a camera with independent parameters: standard deviations, infinite free, zero fixed.
    pub fn new(camera: geometry::Camera, sd: Vec<f64>) -> Self {
        Self { camera, sd, covariance: None }
    }

    /// Returns a camera with fixed parameters.
    pub fn held(camera: geometry::Camera) -> Self {
        let count = camera.parameter_names().len();
        Self::new(camera, vec![0.0; count])
    }

    /// Returns true if all parameters are fixed.
    pub fn is_held(&self) -> bool {
        self.sd.iter().all(|&sd| sd == 0.0)
    }
}

/// Initial values and prior information of an object point.
#[derive(Debug, Clone, Copy)]
pub struct Point {
    /// Coordinates in the object space; NaN if unknown.
    pub coordinates: [f64; 3],
    /// Standard deviations: infinite free, zero fixed, otherwise weighted.
    pub sd: [f64; 3],
}

impl Point {
    /// Returns a point without prior information.
    pub fn free() -> Self {
        Self { coordinates: [f64::NAN; 3], sd: [f64::INFINITY; 3] }
    }

    /// Returns a control point with coordinates and standard deviations.
    pub fn control(coordinates: [f64; 3], sd: [f64; 3]) -> Self {
        Self { coordinates, sd }
    }

    /// Returns which components are fixed or weighted.
    pub fn held(&self) -> [bool; 3] {
        self.sd.map(f64::is_finite)
    }
}

/// An image observation of a point.
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
    /// Parametrization of a pose.
    pub poses: PoseNumbers,
    /// Atmospheric refraction, applied in every iteration; None for images that are free of it.
    pub refraction: Option<Refraction>,
    /// Cameras.
    pub cameras: Vec<Camera>,
    /// Photos.
    pub photos: Vec<Photo>,
    /// Object points.
    pub points: Vec<Point>,
    /// Image observations.
    pub images: Vec<Image>,
    /// Additional observations.
    pub observations: Vec<Observation>,
    /// Shared parameters of observations and mounted photos.
    pub commons: Vec<Common>,
    /// Relations of photos to a rig frame or a trajectory.
    pub mounts: Vec<Mount>,
    /// Trajectories.
    pub trajectories: Vec<Trajectory>,
    /// Number of each image on the time scale of its photo (see [`mounts::OnTrajectory`]); empty if all are zero.
    pub image_times: Vec<f64>,
    /// Corrections of images after the projection.
    pub passages: Vec<Passage>,
}

impl Network {
    /// Returns an empty network: rectangular space, poses in angles from ground to photo, images free of refraction.
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

/// Definition of the variance of unit weight (GIANT guide, Appendix E).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum UnitVariance {
    /// The rule of 1987 for free photos: image coordinates and ground control count, weights of poses and cameras do not. The parameters
    /// are subtracted in full. The expectation exceeds 1 if these weights are strong.
    Free,
    /// Every weighted quantity counts as an observation: the expectation is 1 for any weights.
    #[default]
    Constrained,
    /// Sum of squares of image coordinates, ground control and additional observations, divided by their redundancy. It is valid for any
    /// weights of poses and cameras.
    Redundancy,
    /// Set to one.
    Unity,
}

/// Source of the initial coordinates of points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Start {
    /// Intersection of the (straight) rays.
    #[default]
    Intersected,
    /// The given coordinates if they are known, otherwise the intersection.
    Given,
}

/// Minimal datum to fix if no other information defines one: a photo, and a coordinate of another photo.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Minimum {
    /// Photo whose pose is fixed.
    pub photo: usize,
    /// Photo and number of its parameter, fixed for the scale; with None, the coordinate with the longest distance from `photo`.
    pub coordinate: Option<(usize, usize)>,
}

/// Screens that may exclude points and photos during the adjustment, see [`Reason`]. Each is on by default; if it is off, the points and
/// photos remain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Screens {
    /// Points and photos that their images do not determine, if these are few.
    pub not_determined: bool,
    /// Points that diverging or parallel rays move out of the network.
    pub ran_off: bool,
    /// Points that two rays move to the station of a photo.
    pub ran_into_station: bool,
    /// Points with given coordinates at the position of a station that observes them.
    pub at_station: bool,
    /// Fixed or weighted points near a station that observes them, if the adjustment fails with them only.
    pub near_station: bool,
}

impl Default for Screens {
    /// All screens are on.
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

/// Options of the adjustment of a network.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// Convergence criteria, method and results to compute.
    pub adjustment: adjustment::Options,
    /// Elimination order of the photos.
    pub ordering: Ordering,
    /// Definition of the variance of unit weight.
    pub unit_variance: UnitVariance,
    /// Source of the initial coordinates of points.
    pub start: Start,
    /// Whether photos without images are fixed; otherwise they have parameters, which only weights can determine.
    pub hold_unused: bool,
    /// Bytes available to the adjustment (see [`crate::normals::System::memory`]); None for no limit.
    pub memory: Option<usize>,
    /// Bytes of `memory` that the caller needs for itself.
    pub reserved: usize,
    /// Datum to fix if no other information defines one; None to select the best one.
    pub minimum: Option<Minimum>,
    /// Screens that may exclude points and photos.
    pub screens: Screens,
}

impl Default for Options {
    /// Strict least squares of constrained photos, points from the intersection of their rays.
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
