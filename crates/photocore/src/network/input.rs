//! Input of an adjustment: the network with its photos, cameras, points and image observations, the options, the datum, and the state of
//! an earlier adjustment.

use nalgebra::DMatrix;

use super::commons::Common;
use super::image_corrections::ImageCorrection;
use super::mounts::{Mount, Trajectory};
use super::observations::Observation;
use crate::adjustment;
use crate::geometry::{self, ObjectSpace, POSE, PoseNumbers, Refraction};
use crate::normals::Ordering;

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

/// A network of photos. Default: empty, in rectangular space, with poses in angles from ground to photo.
#[derive(Debug, Clone, Default)]
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
    /// Number of each image on the time scale of its photo (see [`super::mounts::OnTrajectory`]); empty if all are zero.
    pub image_times: Vec<f64>,
    /// Corrections of images after the projection.
    pub image_corrections: Vec<ImageCorrection>,
}

impl Network {
    /// Returns an empty network: rectangular space, poses in angles from ground to photo, images free of refraction.
    pub fn new() -> Self {
        Self::default()
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

/// Screens that may exclude points and photos during the adjustment, see [`super::Reason`]. Each is on by default; if it is off, the points
/// and photos remain.
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

/// Options of the adjustment of a network. Default: strict least squares of constrained photos, points from the intersection of their rays.
#[derive(Debug, Clone, Copy, Default)]
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
    /// Whether to store the corrections of the photos in every iteration.
    pub photo_corrections: bool,
}

/// Final state of an adjustment, sufficient to restore it.
#[derive(Debug, Clone)]
pub struct State {
    /// Adjusted parameters, in the order of the adjustment.
    pub unknowns: Vec<f64>,
    /// Indices of the parameters that were fixed as a minimal datum.
    pub held: Vec<usize>,
    /// Points excluded because they ran into a station or their rays do not determine them, ascending.
    pub collapsed: Vec<usize>,
    /// Photos excluded because their images do not determine them, ascending.
    pub undetermined_photos: Vec<usize>,
    /// Elimination order.
    pub ordering: Ordering,
    /// Datum of a later transformation; None for the minimal datum or the datum of the observations.
    pub datum: Option<NetworkDatum>,
    /// Whether minimal control and weights of poses were removed for this datum.
    pub released: bool,
}

/// Datum of coordinates and their cofactors.
#[derive(Debug, Clone)]
pub enum NetworkDatum {
    /// Inner constraints of chosen points and photos in free networks.
    Inner(InnerConstraints),
    /// Cofactors relative to a photo (or its rig frame), as if its adjusted pose were fixed. Values and scale are unchanged, and the
    /// network need not be free.
    RelativeToPhoto(usize),
    /// Cofactors relative to the mean position and orientation of points.
    RelativeToPoints(Vec<usize>),
}

/// Inner constraints: the datum with the least sum of squared distances of chosen points and photos from their given positions (or else
/// their initial positions).
#[derive(Debug, Clone, Default)]
pub struct InnerConstraints {
    /// Indices of points.
    pub points: Vec<usize>,
    /// Indices of photos with constrained positions.
    pub photos: Vec<usize>,
    /// Indices of photos with constrained attitudes: rotations about their own axes, times `radius`.
    pub attitudes: Vec<usize>,
    /// Length that converts rotations to displacements; None for the root mean square distance of all points and photos from their centre.
    pub radius: Option<f64>,
    /// Whether they also define the scale; otherwise the scale remains unchanged.
    pub scale: bool,
}
