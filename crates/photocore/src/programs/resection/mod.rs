//! Resection: position and attitude of one photo from control points, with or without initial values.
//!
//! Unknowns are the position and attitude of the photo and the coordinates of the control points, each weighted from free
//! (the photo) to fixed; observations are image coordinates. Positions are X, Y, Z or longitude, latitude, height. Without
//! initial values the adjustment starts from poses that three points give directly ([`three_points`]).
//!
//! ```
//! use photocore::adjustment::Options;
//! use photocore::geometry::{ObjectSpace, View, Point, RotationSense};
//! use photocore::programs::resection::{ControlPoint, Known, Partials, Resection};
//!
//! let (space, sense) = (ObjectSpace::Rectangular, RotationSense::GroundToPhoto);
//! let truth = View::new(space, sense, [520.0, 480.0, 1600.0], [0.05, -0.03, 2.0], -150.0);
//! let control = [[0.0, 0.0, 20.0], [1000.0, 0.0, 90.0], [1000.0, 1000.0, 0.0], [0.0, 1000.0, 60.0], [500.0, 300.0, 140.0]];
//! let point = |coordinates| {
//!     let xy = truth.project(&Point::new(space, coordinates));
//!     ControlPoint { coordinates, sd: [0.0; 3], xy, xy_sd: [0.01; 2] }
//! };
//! let unknown = Known { value: [f64::NAN; 3], sd: [f64::INFINITY; 3] };
//! let resection = Resection {
//!     space,
//!     sense,
//!     principal_distance: -150.0,
//!     points: control.map(point).to_vec(),
//!     position: unknown,
//!     attitude: unknown,
//!     start: None,
//!     partials: Partials::AtComputed,
//! };
//! let solution = resection.adjust(&Options::default())?;
//! assert!((solution.pose.position[2] - 1600.0).abs() < 1e-6);
//! assert_eq!(solution.degrees_of_freedom, 4);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod degenerate;
mod model;
mod solution;
mod start;
mod three_points;

use std::ops::ControlFlow;

use thiserror::Error;

use crate::adjustment::{self, AdjustError, Adjustment, Event, Options, Problem, Status};
use crate::geometry::{ObjectSpace, RotationSense, rotation, rotation_angles};
use crate::normals::{Layout, LayoutError, Ordering, System};
use crate::{Stopped, Threads};

pub use degenerate::Degeneracy;
use model::SinglePhoto;
use solution::absolute;
pub use solution::{AdjustedControl, AdjustedImage, Alternative, Solution};
pub use three_points::{Placement, three_points};

/// Three values as they are known beforehand.
#[derive(Debug, Clone, Copy)]
pub struct Known {
    /// Observed values; NaN where nothing is known.
    pub value: [f64; 3],
    /// Standard deviations: infinite free, zero fixed.
    pub sd: [f64; 3],
}

/// A control point and its image.
#[derive(Debug, Clone, Copy)]
pub struct ControlPoint {
    /// Coordinates in the object space.
    pub coordinates: [f64; 3],
    /// Their standard deviations, finite: zero fixed.
    pub sd: [f64; 3],
    /// Image coordinates in millimetres.
    pub xy: [f64; 2],
    /// Their standard deviations in millimetres.
    pub xy_sd: [f64; 2],
}

/// Position and attitude of a photo.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Coordinates in the object space.
    pub position: [f64; 3],
    /// Omega, phi, kappa in radians.
    pub attitude: [f64; 3],
}

impl Pose {
    /// The six unknowns of a photo as a pose.
    fn from_unknowns(values: &[f64]) -> Self {
        Self {
            position: std::array::from_fn(|k| values[k]),
            attitude: std::array::from_fn(|k| values[3 + k]),
        }
    }

    fn unknowns(&self) -> [f64; 6] {
        let ([x, y, z], [omega, phi, kappa]) = (self.position, self.attitude);
        [x, y, z, omega, phi, kappa]
    }

    /// The same pose, its position counted from an origin.
    fn counted_from(&self, origin: [f64; 3]) -> Self {
        let position = std::array::from_fn(|k| self.position[k] - origin[k]);
        Self { position, attitude: self.attitude }
    }
}

/// Where the partials of the image coordinates are formed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Partials {
    /// At the computed image positions: least squares.
    #[default]
    AtComputed,
    /// At the measured image positions, as program W5344 does (USGS Computer Contribution 2, 1969, equations 4 and 5). Its
    /// solution differs from least squares by residuals relative to the size of the image, in standard deviations.
    AtMeasured,
}

/// One photo and its control.
#[derive(Debug, Clone)]
pub struct Resection {
    /// Coordinates of positions and points.
    pub space: ObjectSpace,
    /// Sense of the attitude angles.
    pub sense: RotationSense,
    /// Signed principal distance in millimetres: negative for the positive plane.
    pub principal_distance: f64,
    /// The points.
    pub points: Vec<ControlPoint>,
    /// What is known of the position.
    pub position: Known,
    /// What is known of the attitude, omega, phi, kappa in radians.
    pub attitude: Known,
    /// Initial values; without them a direct method finds some.
    pub start: Option<Pose>,
    /// Where the partials are formed.
    pub partials: Partials,
}

/// Why there is no resection.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum ResectionError {
    /// Fewer than three points.
    #[error("{0} points do not determine a pose; it takes three")]
    TooFewPoints(usize),
    /// All points on one line.
    #[error("the points are on one line, about which the photo can turn")]
    Collinear,
    /// No position in front of which the points lie as they are seen.
    #[error("no position sees the points in front of the camera as the image shows them")]
    NoPlacement,
    /// The observations leave unknowns undetermined.
    #[error("the observations do not determine the pose")]
    Undetermined(Degeneracy),
    /// The initial values put a point into the plane of the projection centre.
    #[error("the initial values give image coordinates that are not finite")]
    NotFinite,
    /// The work was stopped: by whoever watched it, or for want of memory or threads.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// More than can be numbered.
    #[error("too many points")]
    TooManyPoints,
}

impl From<LayoutError> for ResectionError {
    fn from(_: LayoutError) -> Self {
        ResectionError::TooManyPoints
    }
}

/// An adjustment, and the problem it solved.
struct Solved {
    problem: Problem<SinglePhoto>,
    adjustment: Adjustment,
    start: Pose,
    origin: [f64; 3],
}

impl Solved {
    fn pose(&self) -> Pose {
        absolute(&self.adjustment.unknowns[self.problem.layout().all_retained()], self.origin)
    }

    /// Weighted sum of squares at the end.
    fn sum_of_squares(&self) -> f64 {
        let last = self.adjustment.iterations.last();
        last.map_or(self.adjustment.initial_sum_of_squares, |iteration| iteration.sum_of_squares)
    }

    fn behind(&self) -> Vec<usize> {
        self.problem.model.behind(&self.adjustment.unknowns)
    }

    fn converged(&self) -> bool {
        self.adjustment.status == Status::Converged
    }
}

impl Resection {
    /// Adjusts the photo by least squares, on threads of its own.
    ///
    /// # Errors
    /// Those of [`Resection::adjust_on`]; threads that cannot be started.
    pub fn adjust(&self, options: &Options) -> Result<Solution, ResectionError> {
        self.adjust_on(options, &Threads::new(options.threads)?, &mut adjustment::go_on)
    }

    /// The same on threads of the caller.
    ///
    /// Without initial values, every distinct pose that a direct method finds is adjusted. The one with the least sum of squares
    /// is the solution; the others that fit about as well are told too (see [`Alternative`]).
    ///
    /// # Errors
    /// A configuration that determines no pose, or an interruption by `watch`.
    pub fn adjust_on(
        &self,
        options: &Options,
        threads: &Threads,
        watch: &mut dyn FnMut(Event) -> ControlFlow<()>,
    ) -> Result<Solution, ResectionError> {
        let starts = match self.start {
            Some(start) => {
                // Rounding may hide from the adjustment that the points determine nothing.
                if self.position.sd.iter().chain(&self.attitude.sd).all(|sd| sd.is_infinite()) {
                    self.enough_points()?;
                }
                vec![start]
            }
            None => self.starts()?,
        };
        let mut solved: Vec<Solved> = Vec::new();
        let mut failure = ResectionError::NoPlacement;
        let mut undetermined = None;
        for start in starts {
            let mut adjusted = self.adjust_from(start, options, threads, watch);
            if let (None, Some(turned)) = (self.start, adjusted.as_ref().ok().and_then(|a| self.upright(a))) {
                adjusted = self.adjust_from(turned, options, threads, watch);
            }
            match adjusted {
                Ok(adjusted) if self.start.is_none() && !adjusted.behind().is_empty() => {}
                Ok(adjusted) => solved.push(adjusted),
                Err(stop @ ResectionError::Stopped(_)) => return Err(stop),
                Err(other) => {
                    if let ResectionError::Undetermined(why) = other {
                        undetermined = Some(why);
                    }
                    failure = other;
                }
            }
        }
        solved.sort_by(|a, b| {
            b.converged().cmp(&a.converged()).then(a.sum_of_squares().total_cmp(&b.sum_of_squares()))
        });
        Solution::new(self, solved, undetermined).ok_or(failure)
    }

    fn adjust_from(
        &self,
        start: Pose,
        options: &Options,
        threads: &Threads,
        watch: &mut dyn FnMut(Event) -> ControlFlow<()>,
    ) -> Result<Solved, ResectionError> {
        let origin = self.origin(&start);
        let problem = threads.install(|| self.problem(&start, origin))?;
        let adjusted = adjustment::adjust(&problem, options, threads, watch);
        let adjustment = adjusted.map_err(|error| match error {
            AdjustError::Stopped(stopped) => ResectionError::Stopped(stopped),
            AdjustError::NotFinite => ResectionError::NotFinite,
            AdjustError::Undetermined(_) | AdjustError::UndeterminedLocals(_) => {
                ResectionError::Undetermined(self.degeneracy(&start))
            }
        })?;
        Ok(Solved { problem, adjustment, start, origin })
    }

    /// The same pose with |phi| <= 90 degrees, where the iteration has led beyond and nothing is known of the angles.
    fn upright(&self, solved: &Solved) -> Option<Pose> {
        let Pose { position, attitude } = solved.pose();
        let beyond = attitude[1].abs() > std::f64::consts::FRAC_PI_2;
        let free = self.attitude.sd.iter().all(|sd| sd.is_infinite());
        (beyond && free).then(|| Pose { position, attitude: rotation_angles(&rotation(attitude)) })
    }

    /// What is degenerate about the points seen from a pose.
    fn degeneracy(&self, pose: &Pose) -> Degeneracy {
        Degeneracy::of(&self.sight().points, &self.space.cartesian(pose.position))
    }

    /// Coordinates are counted from here while the photo is adjusted, so that no digits are lost in large ones.
    fn origin(&self, start: &Pose) -> [f64; 3] {
        match self.space {
            ObjectSpace::Rectangular => start.position.map(f64::round),
            ObjectSpace::Geographic(_) => [0.0; 3],
        }
    }

    /// The least-squares problem: points are local blocks of three, the photo is the retained block of six.
    fn problem(&self, start: &Pose, origin: [f64; 3]) -> Result<Problem<SinglePhoto>, LayoutError> {
        let count = self.points.len();
        let shifted = |point: &ControlPoint| ControlPoint {
            coordinates: std::array::from_fn(|k| point.coordinates[k] - origin[k]),
            ..*point
        };
        let points: Vec<ControlPoint> = self.points.iter().map(shifted).collect();
        let layout = Layout::new(2, 3, &[6], (0..=count).collect(), vec![0; count])?;
        let known = Pose { position: self.position.value, attitude: self.attitude.value };
        let own: Vec<f64> = points.iter().flat_map(|point| point.coordinates).collect();
        let with_photo = |pose: &Pose| [&own[..], &pose.counted_from(origin).unknowns()].concat();
        let photo_sd = [self.position.sd, self.attitude.sd].concat();
        Ok(Problem {
            system: System::new(layout, Ordering::Input)?,
            observation_sd: points.iter().flat_map(|point| point.xy_sd).collect(),
            initial: with_photo(start),
            prior: with_photo(&known),
            sd: points.iter().flat_map(|point| point.sd).chain(photo_sd).collect(),
            model: SinglePhoto {
                space: self.space,
                sense: self.sense,
                principal_distance: self.principal_distance,
                partials: self.partials,
                points,
            },
        })
    }
}
