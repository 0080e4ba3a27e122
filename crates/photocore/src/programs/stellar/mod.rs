//! Calibration of a camera by stars (NOAA TR NOS 55): directions of stars, attitudes of the camera and its interior parameters
//! adjusted together.
//!
//! Stars are the local unknowns, two each; attitudes are a retained block each, and the interior parameters and coefficients of refraction
//! one that all images share. A direction of the axis and weights of parameters are ties. A star that is held ties no attitudes to each other: each
//! of its images has a local block of its own.
//!
//! Unit weight is that of the plate coordinates' weights: its mean error has their unit over the root of theirs.
//!
//! A camera of 300 mm whose principal distance and attitude are known to some millimetres and minutes of arc, and nine stars:
//!
//! ```
//! use photocore::adjustment;
//! use photocore::geometry::{Air, Station, sky::REFRACTION};
//! use photocore::programs::stellar::{
//!     Attitude, COMMON, Calibration, Camera, Decentering, Form, Image, Kind, Options, Star, Weights,
//! };
//!
//! let station = Station::new(0.6, 0.0, Air::new(290.0, 750.0));
//! let kind = Kind { lens: None, form: Form::ScaleFirst, decentering: Decentering::Polar, common_scale: true };
//! let (attitude, time) = ([0.2, -0.1, 0.6], 1.0);
//! let mut common = [0.0; COMMON];
//! (common[3], common[4]) = (0.3, 0.3); // principal distances in metres
//! common[COMMON - 4..].copy_from_slice(&REFRACTION);
//! let camera = Camera::new(kind, std::array::from_fn(|k| common[k]));
//!
//! let (mut stars, mut images) = (vec![], vec![]);
//! for star in 0..9 {
//!     // A grid of three by three around the zenith, where the camera sees it.
//!     let standard = [0.1 * (star % 3) as f64, 0.1 * (star / 3) as f64];
//!     let place = station.place(standard, time, &REFRACTION);
//!     stars.push(Star { place, catalogue: place, weight: None, fixed: true });
//!     let seen = station.standard(place, time, &REFRACTION);
//!     let xy = camera.linearize(&Attitude::new(attitude), seen.coordinates).xy;
//!     let weight = [[1.0, 0.0], [0.0, 1.0]];
//!     images.push(Image { star, pointing: 0, xy, weight, sidereal_time: time, shift: [0.0; 2] });
//! }
//! let initial = [attitude[0] + 1e-3, attitude[1] - 1e-3, attitude[2] + 2e-3];
//! let mut fixed = vec![true; 3 + COMMON];
//! fixed[..3].fill(false);
//! fixed[3 + 3] = false; // the principal distance, the same in x and y
//! (common[3], common[4]) = (0.303, 0.303);
//! let calibration = Calibration {
//!     station,
//!     kind,
//!     pointings: vec![initial],
//!     common,
//!     fixed,
//!     weights: Weights { parameters: vec![], values: vec![], root: vec![] },
//!     stars,
//!     images,
//!     axis: None,
//! };
//! let options = Options { adjustment: adjustment::Options::default(), unit: 1e-6, whole: false };
//! let solution = calibration.adjust(&options)?;
//! assert!((solution.parameters[3 + 3] - 0.3).abs() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod camera;
mod cycle;
mod hypotheses;
mod model;
mod published;
mod solution;

use std::ops::ControlFlow;

use thiserror::Error;

use crate::adjustment::{self, AdjustError, Event, Linearized, Phase, Problem};
use crate::geometry::Station;
use crate::normals::{Layout, LayoutError, Ordering, System};
use crate::{Stopped, Threads};

use model::{Partials, StarImages};

pub use camera::{Attitude, Camera, Decentering, Form, INTERIOR, Kind, PlateImage};
pub use hypotheses::{Agreement, Similarity, best_voted, hypotheses};
pub use model::{Rows, Tolerances};
pub use published::{Correction, PublishedRows};
pub use solution::{Observations, ParameterCofactors, Solution, Tested};

/// Number of coefficients of refraction.
pub const TAU: usize = 4;
/// Number of unknowns that all images share.
pub const COMMON: usize = INTERIOR + TAU;

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
    /// Which parameters: attitudes three each, then the common ones.
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
    /// Whether to compute the cofactors of every two parameters, where there are cofactors: so many further right-hand sides.
    pub whole: bool,
}

/// Why a calibration cannot be adjusted.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum StellarError {
    /// An image names a star or an attitude that is not there, or weights a parameter that is not.
    #[error("{0} names a star, an attitude or a parameter that is not there")]
    Index(String),
    /// A lens with more parameters than there is room for.
    #[error("the lens has more than {INTERIOR} parameters")]
    Lens,
    /// A weight matrix that is not positive definite.
    #[error("the weight matrix of {0} is not positive definite")]
    Weight(String),
    /// Stars without images enough.
    #[error("{} stars are not determined by their images", .0.len())]
    UndeterminedStars(Vec<usize>),
    /// Combinations that the stars do not determine: for each the parameters that take part in it.
    #[error("{} combinations of parameters are not determined by the stars", .0.len())]
    Undetermined(Vec<Vec<usize>>),
    /// Stars that the initial values put where they have no image.
    #[error("the initial values put a star below the horizon or behind the camera")]
    NotFinite(Vec<usize>),
    /// The work was stopped: by whoever watched it, or for want of memory or threads.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// More than can be numbered.
    #[error(transparent)]
    Layout(#[from] LayoutError),
}

impl Calibration {
    /// Adjusts by least squares with exact partials, on threads of its own.
    ///
    /// # Errors
    /// Those of [`Calibration::adjust_on`]; threads that cannot be started.
    pub fn adjust(&self, options: &Options) -> Result<Solution, StellarError> {
        self.adjust_on(options, &Threads::new(options.adjustment.threads)?, &mut adjustment::go_on)
    }

    /// The same on threads of the caller.
    ///
    /// `watch` is called on the calling thread; when it breaks, the adjustment stops.
    ///
    /// # Errors
    /// A calibration that contradicts itself or leaves unknowns undetermined; an interruption.
    pub fn adjust_on(
        &self,
        options: &Options,
        threads: &Threads,
        watch: &mut dyn FnMut(Event) -> ControlFlow<()>,
    ) -> Result<Solution, StellarError> {
        let problem = threads.install(|| self.problem(options.unit, Partials::Exact))?;
        let adjusted = adjustment::adjust(&problem, &options.adjustment, threads, watch)
            .map_err(|error| self.named(&problem, error, threads))?;
        let mut whole = None;
        if options.whole && adjusted.cofactors.is_some() {
            let total = problem.layout().locals();
            let mut between = |done| watch(Event::Progress { phase: Phase::Invert, done, total });
            let values = adjusted.unknowns.clone();
            let normal = Linearized::form(&problem, None, values, vec![], threads, &mut between);
            whole = of_parameters(&normal.map_err(|error| self.named(&problem, error, threads))?, &problem);
        }
        Solution::new(self, options, &problem, adjusted, whole)
    }

    /// The parameters that no image, no weight and not the axis touches at the initial values, fixed ones excepted: the centre of a
    /// distortion that is zero.
    ///
    /// # Errors
    /// A calibration that contradicts itself; stars without images at the initial values.
    pub fn without_effect(&self, threads: &Threads) -> Result<Vec<usize>, StellarError> {
        let problem = threads.install(|| self.problem(1.0, Partials::Exact))?;
        let normal = self.formed(&problem, vec![], threads)?;
        Ok(parameters_of(&problem, normal.without_effect(problem.layout())))
    }

    /// The normal equations at the initial values, some unknowns held.
    fn formed(
        &self,
        problem: &Problem<StarImages<'_>>,
        held: Vec<usize>,
        threads: &Threads,
    ) -> Result<Linearized, StellarError> {
        let failed = |error| self.named(problem, error, threads);
        let normal = Linearized::form(problem, None, problem.initial.clone(), held, threads, &mut go_on)
            .map_err(failed)?;
        if normal.sum_of_squares().is_finite() { Ok(normal) } else { Err(failed(AdjustError::NotFinite)) }
    }

    /// Says of which stars and parameters an error of the engine tells.
    fn named(
        &self,
        problem: &Problem<StarImages<'_>>,
        error: AdjustError,
        threads: &Threads,
    ) -> StellarError {
        match error {
            AdjustError::UndeterminedLocals(locals) => {
                let mut stars: Vec<usize> = locals.iter().map(|&local| problem.model.stars[local]).collect();
                stars.dedup();
                StellarError::UndeterminedStars(stars)
            }
            // The initial values are those that leave parameters undetermined.
            AdjustError::Undetermined(_) => {
                let initial = problem.initial.clone();
                let normal = Linearized::form(problem, None, initial, vec![], threads, &mut go_on);
                let found = normal.map_or(vec![], |normal| normal.undetermined_unknowns(problem.layout()));
                let named = found.into_iter().map(|unknowns| parameters_of(problem, unknowns));
                StellarError::Undetermined(named.collect())
            }
            AdjustError::NotFinite => {
                let sight = self.initial();
                let rows: Vec<Rows> =
                    (0..self.images.len()).map(|image| problem.model.image(&sight, image)).collect();
                StellarError::NotFinite(self.unseen(&rows))
            }
            AdjustError::Stopped(stopped) => StellarError::Stopped(stopped),
        }
    }

    /// The stars that have no image in the equations of all images.
    fn unseen(&self, rows: &[Rows]) -> Vec<usize> {
        let images = self.images.iter().zip(rows);
        let lost = images.filter(|(_, rows)| rows.constant.iter().any(|value| !value.is_finite()));
        let mut stars: Vec<usize> = lost.map(|(image, _)| image.star).collect();
        stars.sort_unstable();
        stars.dedup();
        stars
    }

    /// Number of parameters: attitudes and common ones.
    pub fn parameters(&self) -> usize {
        3 * self.pointings.len() + COMMON
    }

    fn check(&self) -> Result<(), StellarError> {
        let counts = (self.stars.len(), self.pointings.len());
        if let Some(i) = self.images.iter().position(|i| i.star >= counts.0 || i.pointing >= counts.1) {
            return Err(StellarError::Index(format!("image {i}")));
        }
        if self.axis.is_some_and(|axis| axis.pointing >= counts.1) {
            return Err(StellarError::Index("the axis".into()));
        }
        if self.kind.lens.is_some_and(|lens| lens.parameter_names().len() > INTERIOR) {
            return Err(StellarError::Lens);
        }
        let Weights { parameters, values, root } = &self.weights;
        let count = parameters.len();
        let known = parameters.iter().all(|&parameter| parameter < self.parameters());
        if !known
            || values.len() != count
            || root.len() != count * count
            || self.fixed.len() != self.parameters()
        {
            return Err(StellarError::Index("a weight".into()));
        }
        Ok(())
    }

    /// The least-squares problem: a local block for each star that is not held, and for each image of one that is; the catalogue
    /// places are weights of decorrelated coordinates of the stars.
    fn problem(&self, unit: f64, partials: Partials) -> Result<Problem<StarImages<'_>>, StellarError> {
        self.check()?;
        let model = StarImages::new(self, partials)?;
        let layout = self.layout(&model)?;
        let parameters = || self.pointings.iter().flatten().chain(&self.common).copied();
        let locals = |place: fn(&Star) -> [f64; 2]| {
            let unknowns = |&star: &usize| model.decorrelated(star, place(&self.stars[star]));
            model.stars.iter().flat_map(unknowns).chain(parameters()).collect::<Vec<f64>>()
        };
        let free = |fixed: bool| if fixed { 0.0 } else { f64::INFINITY };
        let of_star = |&star: &usize| match model.catalogue[star] {
            Some([[first, _], [_, second]]) => [unit / first, unit / second],
            None => [free(self.stars[star].fixed); 2],
        };
        let scale = self.kind.common_scale.then(|| 3 * self.pointings.len() + self.kind.scales()[1]);
        let held = self.fixed.iter().enumerate().map(|(k, &fixed)| free(fixed || Some(k) == scale));
        Ok(Problem {
            observation_sd: vec![unit; layout.equations()],
            sd: model.stars.iter().flat_map(of_star).chain(held).collect(),
            prior: locals(|star| star.catalogue),
            initial: locals(|star| star.place),
            system: System::new(layout, Ordering::Auto)?,
            model,
        })
    }

    fn layout(&self, model: &StarImages<'_>) -> Result<Layout, LayoutError> {
        let retained = model.images.iter().map(|&image| self.images[image].pointing as u32).collect();
        let (count, common) = (model.images.len(), self.pointings.len() as u32);
        let dims: Vec<usize> = self.pointings.iter().map(|_| 3).chain([COMMON]).collect();
        Layout::new(2, 2, &dims, model.start.clone(), retained)?
            .with_shared((0..=count).collect(), vec![common; count])?
            .with_ties(model.ties.iter().map(|(_, tie)| tie.clone()).collect())?
            .with_pairs((0..common).map(|pointing| [pointing, common]).collect())
    }
}

/// Natural logarithm of the determinant of the normal equations reduced to the parameters, and the cofactors of every two parameters;
/// None where some are not determined.
fn of_parameters(normal: &Linearized, problem: &Problem<StarImages<'_>>) -> Option<(f64, Vec<f64>)> {
    normal.log_determinant().map(|log_determinant| (log_determinant, normal.reduced_cofactors(problem)))
}

/// The parameters among unknowns.
fn parameters_of(problem: &Problem<StarImages<'_>>, unknowns: Vec<usize>) -> Vec<usize> {
    let first = problem.layout().all_locals().end;
    unknowns.into_iter().map(|unknown| unknown - first).collect()
}

fn go_on(_: usize) -> ControlFlow<()> {
    ControlFlow::Continue(())
}
