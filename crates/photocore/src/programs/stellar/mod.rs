//! Calibration of a camera by stars (NOAA TR NOS 55): directions of stars, attitudes of the camera and its interior parameters
//! adjusted together.
//!
//! Stars are the local unknowns, two each. A few attitudes on one plate and the interior parameters form one kept block, so that
//! their whole covariance comes out; many attitudes are a kept block each, and the interior parameters the border.
//!
//! Unit weight is that of the plate coordinates' weights: its mean error has their unit over the root of theirs.

mod camera;
mod model;
mod published;
mod solution;

use std::ops::ControlFlow;

use rayon::ThreadPool;
use thiserror::Error;

use crate::adjustment::{self, AdjustError, Event, Problem};
use crate::geometry::Station;
use crate::normals::{Layout, LayoutError, Ordering, System};

use model::{Group, StarImages};

pub use camera::{Attitude, Camera, Decentering, Form, INTERIOR, Kind, PlateImage};
pub use model::Rows;
pub use published::{PublishedRows, Tolerances};
pub use solution::{Solution, Tested};

/// Number of coefficients of refraction.
pub const TAU: usize = 4;
/// Number of unknowns that all images share.
pub const COMMON: usize = INTERIOR + TAU;
/// Attitudes at the most that form one block with the interior parameters.
const JOINT: usize = 3;

/// A star as it is known beforehand.
#[derive(Debug, Clone, Copy)]
pub struct Star {
    /// Initial right ascension and declination in radians.
    pub place: [f64; 2],
    /// Those of the catalogue.
    pub catalogue: [f64; 2],
    /// Weights of right ascension and declination; None for a direction that is not known.
    pub weight: Option<[[f64; 2]; 2]>,
    /// Whether the initial place is held as it is.
    pub fixed: bool,
}

/// An image of a star.
#[derive(Debug, Clone, Copy)]
pub struct Image {
    /// Index of its star.
    pub star: usize,
    /// Index of its attitude.
    pub pointing: usize,
    /// Measured plate coordinates.
    pub xy: [f64; 2],
    /// Their weights.
    pub weight: [[f64; 2]; 2],
    /// Local apparent sidereal time in radians.
    pub sidereal_time: f64,
    /// The star's apparent place at the time of this image minus the place adjusted, in radians.
    pub shift: [f64; 2],
}

/// A direction of the camera's axis that is known from outside (equation 72).
#[derive(Debug, Clone, Copy)]
pub struct Axis {
    /// Index of the attitude.
    pub pointing: usize,
    /// Standard coordinates of the direction.
    pub standard: [f64; 2],
    /// Undistorted plate coordinates of its image.
    pub xy: [f64; 2],
    /// Their weights.
    pub weight: [[f64; 2]; 2],
}

/// Weighted parameters: given values and their weight matrix.
#[derive(Debug, Clone)]
pub struct Weights {
    /// Which parameters: attitudes three each, then the common ones. Only common ones where the attitudes are many.
    pub parameters: Vec<usize>,
    /// Their given values.
    pub values: Vec<f64>,
    /// Upper triangular root R of their weight matrix P = R^T R, row by row.
    pub root: Vec<f64>,
}

/// A calibration as it is known beforehand.
#[derive(Debug, Clone)]
pub struct Calibration {
    /// Where it is done.
    pub station: Station,
    /// What is estimated of the camera.
    pub kind: Kind,
    /// Initial alpha, omega, kappa of every attitude in radians.
    pub pointings: Vec<[f64; 3]>,
    /// Initial interior parameters, then coefficients of refraction in seconds of arc.
    pub common: [f64; COMMON],
    /// Which parameters are held: attitudes three each, then the common ones.
    pub fixed: Vec<bool>,
    /// Weights of parameters.
    pub weights: Weights,
    /// The stars.
    pub stars: Vec<Star>,
    /// Their images.
    pub images: Vec<Image>,
    /// The axis.
    pub axis: Option<Axis>,
}

/// How to adjust.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// When to stop, and what to compute.
    pub adjustment: adjustment::Options,
    /// Mean error of unit weight that is expected.
    pub unit: f64,
}

/// Why a calibration cannot be adjusted.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum StellarError {
    /// An image names a star or an attitude that is not there, or weights a parameter that is not.
    #[error("{0} names a star, an attitude or a parameter that is not there")]
    Index(String),
    /// A weight matrix that is not positive definite.
    #[error("the weight matrix of {0} is not positive definite")]
    Weight(String),
    /// Stars without images enough.
    #[error("{} stars are not determined by their images", .0.len())]
    UndeterminedStars(Vec<usize>),
    /// Parameters that the stars do not determine.
    #[error("{0} combinations of parameters are not determined by the stars")]
    Undetermined(usize),
    /// The initial values give images that are not finite.
    #[error("the initial values put a star below the horizon or behind the camera")]
    NotFinite,
    /// The caller asked to stop.
    #[error("interrupted")]
    Interrupted,
    /// An allocation of so many bytes failed.
    #[error("there is no memory for an array of {0} bytes")]
    OutOfMemory(usize),
    /// More than can be numbered.
    #[error(transparent)]
    Layout(#[from] LayoutError),
}

impl Calibration {
    /// Adjusts by least squares with exact partials.
    ///
    /// `watch` is called on the calling thread; when it breaks, the adjustment stops.
    ///
    /// # Errors
    /// A calibration that contradicts itself or leaves unknowns undetermined; an interruption.
    pub fn adjust(
        &self,
        options: &Options,
        pool: &ThreadPool,
        watch: &mut dyn FnMut(Event) -> ControlFlow<()>,
    ) -> Result<Solution, StellarError> {
        self.check()?;
        let problem = self.problem(options)?;
        let adjusted =
            adjustment::adjust(&problem, &options.adjustment, pool, watch).map_err(|error| match error {
                AdjustError::UndeterminedLocals(stars) => StellarError::UndeterminedStars(stars),
                AdjustError::Undetermined(combinations) => StellarError::Undetermined(combinations.len()),
                AdjustError::NotFinite => StellarError::NotFinite,
                AdjustError::Interrupted => StellarError::Interrupted,
                AdjustError::OutOfMemory(bytes) => StellarError::OutOfMemory(bytes),
            })?;
        Ok(Solution::new(self, options, &problem, adjusted))
    }

    /// Number of parameters: attitudes and common ones.
    pub fn parameters(&self) -> usize {
        3 * self.pointings.len() + COMMON
    }

    /// Whether attitudes and common parameters form one block.
    fn joint(&self) -> bool {
        self.pointings.len() <= JOINT
    }

    fn check(&self) -> Result<(), StellarError> {
        let counts = (self.stars.len(), self.pointings.len());
        if let Some(i) = self.images.iter().position(|i| i.star >= counts.0 || i.pointing >= counts.1) {
            return Err(StellarError::Index(format!("image {i}")));
        }
        if self.axis.is_some_and(|axis| axis.pointing >= counts.1) {
            return Err(StellarError::Index("the axis".into()));
        }
        let first = if self.joint() { 0 } else { 3 * counts.1 };
        let Weights { parameters, values, root } = &self.weights;
        let count = parameters.len();
        let known = parameters.iter().all(|&parameter| (first..self.parameters()).contains(&parameter));
        if !known
            || values.len() != count
            || root.len() != count * count
            || self.fixed.len() != self.parameters()
        {
            return Err(StellarError::Index("a weight".into()));
        }
        Ok(())
    }

    /// The least-squares problem: the stars, and a fixed local block for what concerns no star.
    fn problem(&self, options: &Options) -> Result<Problem<StarImages<'_>>, StellarError> {
        let model = StarImages::new(self)?;
        let layout = self.layout(&model.groups, &model.start)?;
        let places = self.stars.iter().flat_map(|star| star.place).chain([0.0; 2]);
        let parameters = self.pointings.iter().flatten().chain(&self.common).copied();
        let initial: Vec<f64> = places.chain(parameters).collect();
        let free = |fixed: bool| if fixed { 0.0 } else { f64::INFINITY };
        let stars = self.stars.iter().flat_map(|star| [free(star.fixed); 2]).chain([0.0; 2]);
        let scale = if self.kind.common_scale { Some(3 * self.pointings.len() + 4) } else { None };
        let held = self.fixed.iter().enumerate().map(|(k, &fixed)| free(fixed || Some(k) == scale));
        Ok(Problem {
            observation_sd: vec![options.unit; 2 * model.groups.len()],
            sd: stars.chain(held).collect(),
            prior: initial.clone(),
            initial,
            system: System::new(layout, Ordering::Auto),
            model,
        })
    }

    fn layout(&self, groups: &[Group], start: &[usize]) -> Result<Layout, LayoutError> {
        if self.joint() {
            return Layout::new(2, 2, &[self.parameters()], start.to_vec(), vec![0; groups.len()]);
        }
        let pointing_of = |group: &Group| match *group {
            Group::Image(image) => self.images[image].pointing as u32,
            Group::Axis => self.axis.map_or(0, |axis| axis.pointing as u32),
            Group::Star(_) | Group::Parameters(_) => 0,
        };
        let kept = groups.iter().map(pointing_of).collect();
        let layout = Layout::new(2, 2, &vec![3; self.pointings.len()], start.to_vec(), kept)?;
        layout.with_border(COMMON, vec![0..COMMON as u32; groups.len()])
    }
}
