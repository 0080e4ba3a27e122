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
//! use std::ops::ControlFlow;
//!
//! use photocore::geometry::{self, ObjectSpace, Perspective, PoseNumbers, RotationSense};
//! use photocore::network::{Camera, Image, Network, Options, Photo, Point};
//!
//! let (space, sense) = (ObjectSpace::Rectangular, RotationSense::GroundToPhoto);
//! let camera = Perspective { principal_distance: -150.0 };
//! let corners = [[0.0, 0.0, 0.0], [900.0, 0.0, 40.0], [0.0, 900.0, 70.0], [900.0, 900.0, 10.0]];
//! let stations = [[200.0, 450.0, 1500.0], [700.0, 450.0, 1500.0]];
//! let mut images = vec![];
//! for (point, corner) in corners.into_iter().enumerate() {
//!     for (photo, station) in stations.into_iter().enumerate() {
//!         let seen = geometry::Photo::new(space, sense, station, [0.01, -0.02, 0.1], -150.0);
//!         let xy = seen.project(&geometry::Point::new(space, corner));
//!         images.push(Image { photo, point, xy, sd: [0.005; 2] });
//!     }
//! }
//! // Poses are known to some metres and degrees.
//! let photo = |[x, y, z]: [f64; 3]| {
//!     let pose = [x + 5.0, y - 4.0, z + 9.0, 0.0, 0.0, 0.0];
//!     Photo { pose, observed: pose, sd: [f64::INFINITY; 6], camera: 0 }
//! };
//! let network = Network {
//!     space,
//!     poses: PoseNumbers::Angles(sense),
//!     refraction: None,
//!     cameras: vec![Camera::held(camera.into())],
//!     photos: stations.map(photo).to_vec(),
//!     points: corners.map(|coordinates| Point { coordinates, sd: [0.02; 3] }).to_vec(),
//!     images,
//!     observations: vec![],
//!     commons: vec![],
//!     mounts: vec![],
//! };
//! let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
//! let solution = network.adjust(&Options::default(), &pool, &mut |_| ControlFlow::Continue(()))?;
//! let photo = &solution.photos[1];
//! assert!((photo.pose[0] - 700.0).abs() < 1e-6 && (photo.pose[5] - 0.1).abs() < 1e-9);
//! // Four points seen twice, and their coordinates, less twelve unknowns of the photos and twelve of the points.
//! assert_eq!(solution.degrees_of_freedom, 16 + 12 - 12 - 12);
//! assert!(photo.cofactors[0].sqrt() < 1.0, "standard deviation of the station's X in metres");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod approaches;
mod beside;
mod camera_priors;
mod cameras;
pub mod commons;
mod covariance;
mod datum;
mod departures;
mod effects;
mod error;
mod group_tests;
mod groups;
mod hidden;
mod in_lanes;
mod model;
mod mounts;
mod naming;
mod neighbourhood;
mod node;
pub mod observations;
mod on_frames;
mod parts;
mod precision;
mod predictions;
mod problem;
mod responses;
mod screening;
mod settled;
mod solution;
mod start;
mod stations;
mod surroundings;
mod suspects;
mod trial;
mod weak_points;
mod weighted_angles;

use std::ops::ControlFlow;

use nalgebra::DMatrix;
use rayon::ThreadPool;

use self::beside::{Beside, Leaving};
use crate::adjustment::{self, AdjustError, Adjustment, Event, Method};
use crate::geometry::{self, ObjectSpace, PoseNumbers, Refraction};
use crate::normals::Ordering;

pub use cameras::AdjustedCamera;
pub use commons::{AdjustedCommon, Common, CommonKind};
pub use covariance::{Covariances, NetworkDatum, Of, State};
pub use datum::InnerConstraints;
pub use error::{Combination, NetworkError, PosePart};
pub use group_tests::Tests;
pub use groups::Groups;
pub use mounts::Mount;
pub use node::{FormedNode, Node, NodePrediction};
pub use observations::{AdjustedObservation, KindSums, Observation, Precision};
pub use precision::Coarse;
pub(crate) use precision::median;
pub use predictions::{OnPoint, Prediction};
pub use responses::{Moved, UnknownOf};
pub use screening::{Dropped, Reason};
pub use settled::Settled;
pub use solution::{AdjustedPhoto, AdjustedPoint, Redundancies, Solution, SumsOfSquares};
pub(crate) use start::meet;
pub use surroundings::{BlockOf, Surroundings};
pub use suspects::Subject;
pub use trial::{Out, Standing, Trial};
pub use weak_points::WeakPoint;

/// A photo as it is known beforehand.
#[derive(Debug, Clone, Copy)]
pub struct Photo {
    /// Initial values of the six unknowns of its pose (see [`PoseNumbers`]); those of fixed ones.
    pub pose: [f64; 6],
    /// Observed values; those count that are weighted. Angles, and longitudes, may be whole turns apart.
    pub observed: [f64; 6],
    /// Standard deviations: infinite free, zero fixed.
    pub sd: [f64; 6],
    /// Index of its camera.
    pub camera: usize,
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
        Self::new(camera, vec![0.0; camera.parameter_names().len()])
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
    /// Unknowns that observations, and the photos of rigs, have in common.
    pub commons: Vec<Common>,
    /// Which photos are on a frame with others.
    pub mounts: Vec<Mount>,
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
    /// What to hold where nothing else gives a datum; None for what is best held.
    pub minimum: Option<Minimum>,
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
            minimum: None,
        }
    }
}

impl Network {
    /// Adjusts the network by least squares.
    ///
    /// Points that their image points cannot determine are left out first (see [`Dropped`]). So are points that run into the station
    /// of a photo: the adjustment goes on without them from where it was. `watch` is called on the calling thread; when it breaks, the
    /// adjustment stops. Observations of points that are left out do not take part.
    ///
    /// # Errors
    /// A network that contradicts itself, has nothing to adjust, or leaves unknowns undetermined; an interruption.
    pub fn adjust(
        &self,
        options: &Options,
        pool: &ThreadPool,
        watch: &mut dyn FnMut(Event) -> ControlFlow<()>,
    ) -> Result<Solution, NetworkError> {
        self.adjusted(options, (None, false), None, pool, watch)
    }

    /// The same, and keeps what tests of it need ([`Solution::settled`]) where it converges by least squares and there is memory: it
    /// takes about a twentieth longer.
    ///
    /// # Errors
    /// Those of [`Network::adjust`].
    pub fn adjust_and_keep(
        &self,
        options: &Options,
        pool: &ThreadPool,
        watch: &mut dyn FnMut(Event) -> ControlFlow<()>,
    ) -> Result<Solution, NetworkError> {
        self.adjusted(options, (None, true), None, pool, watch)
    }

    /// Adjusts the network from where an adjustment of it has ended, perhaps with other weights: in the order that was in force, and
    /// without the points that had run into a station.
    ///
    /// # Errors
    /// Those of [`Network::adjust`]; a state that is not of this network.
    pub fn adjust_again(
        &self,
        options: &Options,
        state: &State,
        pool: &ThreadPool,
        watch: &mut dyn FnMut(Event) -> ControlFlow<()>,
    ) -> Result<Solution, NetworkError> {
        let options = Options { ordering: state.ordering, ..*options };
        self.adjusted(&options, (None, false), Some(state), pool, watch)
    }

    /// Adjusts a network that is free, and takes it to the datum of inner constraints.
    ///
    /// # Errors
    /// Those of [`Network::adjust`]; a network that is not free, or points and photos that do not carry its datum.
    pub fn adjust_in_datum(
        &self,
        options: &Options,
        datum: &InnerConstraints,
        pool: &ThreadPool,
        watch: &mut dyn FnMut(Event) -> ControlFlow<()>,
    ) -> Result<Solution, NetworkError> {
        self.adjusted(options, (Some(datum), false), None, pool, watch)
    }

    fn adjusted(
        &self,
        options: &Options,
        (datum, keep): (Option<&InnerConstraints>, bool),
        start: Option<&State>,
        pool: &ThreadPool,
        watch: &mut dyn FnMut(Event) -> ControlFlow<()>,
    ) -> Result<Solution, NetworkError> {
        self.check()?;
        let (points, photos) = (vec![false; self.points.len()], self.untouched_photos());
        let mut leaving = Leaving { points, photos, harmful: vec![] };
        for &point in start.iter().flat_map(|state| &state.collapsed) {
            *leaving.points.get_mut(point).ok_or(NetworkError::State)? = true;
        }
        for &photo in start.iter().flat_map(|state| &state.loose) {
            *leaving.photos.get_mut(photo).ok_or(NetworkError::State)? = true;
        }
        let mut start = start;
        let mut before: Option<(Adjustment, problem::Reached)> = None;
        let mut beside = Beside::Untried(leaving.clone());
        loop {
            let screened = pool.install(|| self.screen(&leaving.points, &leaving.photos));
            if screened.points.is_empty() {
                return Err(NetworkError::Empty);
            }
            let reached = before.as_ref().map(|(_, reached)| reached);
            let mut assembled = pool.install(|| self.assemble(options, screened, reached))?;
            if let Some(state) = start.filter(|_| before.is_none()) {
                assembled.go_on_from(state)?;
            }
            let problem = &assembled.problem;
            assembled.check_memory(options)?;
            let done = before.as_ref().map_or(0, |(before, _)| before.iterations.len());
            let mut own = options.adjustment;
            own.max_iterations = own.max_iterations.saturating_sub(done);
            let adjusted = match datum {
                // Cofactors are those of the datum that is asked for; weights that a loss leaves are known at the end only.
                Some(inner)
                    if own.covariance && own.loss.is_none() && matches!(own.method, Method::Damped(_)) =>
                {
                    self.check_carriers(inner, &assembled)?;
                    let (datum, reference) = assembled.datum(inner);
                    adjustment::adjust_in_datum(problem, &own, &datum, &reference, pool, watch)
                }
                _ => {
                    own.covariance &= datum.is_none();
                    let plain =
                        own.covariance && own.loss.is_none() && !matches!(own.method, Method::Full(_));
                    if keep && plain && assembled.may_keep(options) {
                        adjustment::adjust_by_groups(problem, &own, pool, watch)
                    } else {
                        adjustment::adjust(problem, &own, pool, watch)
                    }
                }
            };
            let may_try = own.loss.is_none() && !matches!(own.method, Method::Full(_));
            if may_try && beside.is_untried() && beside.tries(&adjusted, &assembled, &mut leaving) {
                (start, before) = (None, None);
                continue;
            }
            if let Ok(Adjustment { undetermined: Some(error), .. }) | Err(error) = &adjusted {
                let (points, photos) = (assembled.few_points(error), assembled.few_photos(error));
                if !(points.is_empty() && photos.is_empty()) {
                    // They have led the others astray: these begin again.
                    points.iter().for_each(|&point| leaving.points[point] = true);
                    photos.iter().for_each(|&photo| leaving.photos[photo] = true);
                    let reason = Reason::NotDetermined;
                    leaving.harmful.extend(points.into_iter().map(|point| Dropped { point, reason }));
                    start = None;
                    continue;
                }
            }
            let astray = match &adjusted {
                Ok(adjusted) => assembled.run_off(adjusted, &options.adjustment),
                Err(AdjustError::NotFinite) => assembled.at_stations(),
                Err(_) => vec![],
            };
            if !astray.is_empty() {
                astray.iter().for_each(|dropped| leaving.points[dropped.point] = true);
                leaving.harmful.extend(astray);
                (start, before) = (None, None);
                continue;
            }
            if may_try && !beside.is_untried() && beside.tries(&adjusted, &assembled, &mut leaving) {
                (start, before) = (None, None);
                continue;
            }
            let named = |error, values: &[f64]| self.name(error, &assembled, values, pool);
            let mut adjusted = adjusted
                .map_err(|error| named(NetworkError::new(error, &assembled), &assembled.problem.initial))?;
            let earlier = before.take();
            adjusted.go_on_from(earlier.map(|(adjustment, _)| adjustment));
            if adjusted.collapsed.is_empty() {
                let mut lost = adjusted.lost.unwrap_or(0.0);
                if let Some(inner) = datum.filter(|_| adjusted.lost.is_none()) {
                    lost =
                        self.take_to(inner, &options.adjustment, &assembled, &mut adjusted, pool, watch)?;
                }
                let collapsed = (0..leaving.points.len()).filter(|&point| leaving.points[point]).collect();
                let minimal = datum.is_none() && assembled.is_minimal(&adjusted.unknowns, pool);
                let (mut solution, found) =
                    pool.install(|| Solution::with_tried(self, options, &assembled, adjusted, collapsed));
                let undetermined = solution.undetermined.take();
                solution.undetermined = undetermined.map(|error| named(error, &solution.state.unknowns));
                solution.minimal_control = minimal;
                solution.state.datum = datum.cloned().map(NetworkDatum::Inner);
                solution.lost_digits = lost;
                solution.dropped.extend(leaving.harmful);
                solution.dropped.sort_unstable_by_key(|dropped| dropped.point);
                solution.settled =
                    found.map(|found| Box::new(Settled::new(assembled, options.adjustment, found)));
                return Ok(solution);
            }
            for dropped in assembled.collapsed(&adjusted) {
                leaving.points[dropped.point] = true;
                leaving.harmful.push(dropped);
            }
            let reached = assembled.reached(&adjusted.unknowns, self.points.len());
            before = Some((adjusted, reached));
        }
    }

    /// The problem of the network as it is given.
    fn assembled_first(
        &self,
        options: &Options,
        pool: &ThreadPool,
    ) -> Result<problem::Assembled, NetworkError> {
        self.check()?;
        let untouched = self.untouched_photos();
        let screened = pool.install(|| self.screen(&vec![false; self.points.len()], &untouched));
        if screened.points.is_empty() {
            return Err(NetworkError::Empty);
        }
        let assembled = pool.install(|| self.assemble(options, screened, None))?;
        assembled.check_memory(options)?;
        Ok(assembled)
    }

    /// Refuses photos that cannot carry a datum.
    fn check_carriers(
        &self,
        inner: &InnerConstraints,
        assembled: &problem::Assembled,
    ) -> Result<(), NetworkError> {
        if self.poses == PoseNumbers::Vectors && !(inner.photos.is_empty() && inner.attitudes.is_empty()) {
            return Err(NetworkError::Vectors);
        }
        let bad = inner.attitudes.iter().find(|&&photo| !assembled.turns(photo));
        bad.map_or(Ok(()), |&photo| Err(NetworkError::Attitude(photo)))
    }

    /// Takes an adjusted network to the datum of inner constraints; returns how large a part of its variances may be rounding.
    fn take_to(
        &self,
        inner: &InnerConstraints,
        options: &adjustment::Options,
        assembled: &problem::Assembled,
        adjusted: &mut Adjustment,
        pool: &ThreadPool,
        watch: &mut dyn FnMut(Event) -> ControlFlow<()>,
    ) -> Result<f64, NetworkError> {
        self.check_carriers(inner, assembled)?;
        let (datum, reference) = assembled.datum(inner);
        let total = assembled.points.len();
        let mut between = |done| watch(Event::Progress { phase: adjustment::Phase::Invert, done, total });
        let problem = &assembled.problem;
        Ok(adjusted.take_to(problem, options, &datum, &reference, pool, &mut between)?)
    }

    /// Refuses a network that contradicts itself.
    fn check(&self) -> Result<(), NetworkError> {
        let counts = (self.photos.len(), self.points.len());
        let outside = |image: &Image| image.photo >= counts.0 || image.point >= counts.1;
        if let Some(bad) = self.images.iter().position(outside) {
            return Err(NetworkError::Index(bad));
        }
        for (index, photo) in self.photos.iter().enumerate() {
            if photo.camera >= self.cameras.len() {
                return Err(NetworkError::NoCamera(index));
            }
        }
        for (index, camera) in self.cameras.iter().enumerate() {
            if camera.sd.len() != camera.camera.parameter_names().len() {
                return Err(NetworkError::CameraDeviations(index));
            }
            if !camera.has_sound_covariance() {
                return Err(NetworkError::CameraCovariance(index));
            }
            let known = camera.camera.parameter_names();
            let unknowns = known.len() - camera.camera.constants();
            if let Some(free) = (unknowns..known.len()).find(|&k| camera.sd[k] != 0.0) {
                return Err(NetworkError::CameraConstant { camera: index, parameter: known[free].0 });
            }
        }
        for (index, common) in self.commons.iter().enumerate() {
            if common.sd.len() != common.kind.unknowns().len() {
                return Err(NetworkError::CommonDeviations(index));
            }
        }
        self.check_mounts()?;
        for (index, observation) in self.observations.iter().enumerate() {
            let checked = observation.check(self.points.len(), self.photos.len(), &self.commons);
            checked.map_err(|fault| NetworkError::Observation { index, kind: observation.kind(), fault })?;
        }
        let cartesian = self.space == ObjectSpace::Rectangular && self.refraction.is_none();
        if self.poses == PoseNumbers::Vectors && !cartesian { Err(NetworkError::Vectors) } else { Ok(()) }
    }
}
