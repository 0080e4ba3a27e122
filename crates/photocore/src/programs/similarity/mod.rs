//! Absolute orientation: the similarity x = s A X + B between a model and its control (C&GS Technical Bulletin 19, "TB 19").
//!
//! Each station has model coordinates x and any part of its control coordinates X. The observations are the model coordinates,
//! as in the bulletin; control coordinates are unknowns of their own, fixed where they are known exactly, weighted where they have
//! standard deviations, free where they are missing. Eliminating the free ones leaves the misclosures
//! u = s X - A^T (x - B) of the known components: the form that is right for any mix of full, horizontal and height control.
//!
//! ```
//! use photocore::geometry::Vector3;
//! use photocore::programs::similarity::{Options, Station, orient};
//!
//! // A model at 1:2, shifted; the last station has only its elevation.
//! let control = [[0.0, 0.0, 10.0], [800.0, 0.0, 30.0], [800.0, 600.0, 0.0], [f64::NAN, f64::NAN, 50.0]];
//! let model = [[7.0, 0.0, 5.0], [407.0, 0.0, 15.0], [407.0, 300.0, 0.0], [107.0, 200.0, 25.0]];
//! let station = |i: usize| Station {
//!     control: Vector3::from(control[i]),
//!     control_sd: [0.0; 3],
//!     model: Vector3::from(model[i]),
//!     model_sd: [0.01; 3],
//! };
//! let stations: Vec<Station> = (0..4).map(station).collect();
//! let solution = orient(&stations, &Options::default())?;
//! let parameters = solution.similarity.parameters();
//! assert!((parameters.scale - 0.5).abs() < 1e-9);
//! assert!((parameters.translation.x - 7.0).abs() < 1e-6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod crout;
mod determinacy;
mod misclosures;
mod model;
mod moments;
mod published;
mod solution;
mod start;
mod transform;
mod weights;

use std::ops::ControlFlow;

use thiserror::Error;

use crate::adjustment::{self, AdjustError, Event, Problem, Status, Stop};
use crate::geometry::Vector3;
use crate::normals::{Layout, LayoutError, Ordering, System};
use crate::{Stopped, Threads};

pub use crout::gauss_crout;
pub use determinacy::Cause;
use model::{AsControl, CHANGES, SCALE};
pub use published::Trace;
pub use solution::{AdjustedStation, Solution};
use start::Chosen;
pub use start::Started;
pub use transform::{Matrix7, Parameters, Similarity};
use weights::Weighted;

/// A station: a point of the model with some of its control coordinates.
#[derive(Debug, Clone, Copy)]
pub struct Station {
    /// Control coordinates X in ground units; NaN where unknown.
    pub control: Vector3,
    /// Their standard deviations; zero for an exact one, infinite for one that takes no part.
    pub control_sd: [f64; 3],
    /// Model coordinates x in model units.
    pub model: Vector3,
    /// Their standard deviations; zero where those of the control are positive.
    pub model_sd: [f64; 3],
}

impl Station {
    /// Which control coordinates take part.
    pub fn known(&self) -> [bool; 3] {
        std::array::from_fn(|k| self.control[k].is_finite() && self.control_sd[k].is_finite())
    }

    /// Whether both horizontal coordinates take part.
    fn pair(&self) -> bool {
        let [x, y, _] = self.known();
        x && y
    }

    /// Whether the elevation takes part.
    fn elevation(&self) -> bool {
        self.known()[2]
    }
}

/// How the iteration is carried out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Least squares by the engine, until no unknown changes by a fraction of its standard deviation.
    Rigorous,
    /// The cycle of TB 19 with the misclosures of the known components: Gauss-Crout, until all corrections of angles are 1e-5
    /// radian at the most.
    Report,
    /// The cycle of TB 19 with its own equations, missing control coordinates filled in from the last cycle.
    FillIn,
}

/// Where the iteration starts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Start {
    /// The report's values, unless they lead to a worse place than the closed form.
    Auto,
    /// From the first two stations (TB 19, section 3).
    Report,
    /// Horn's quaternion for full control; otherwise the best of the minima over all rotations.
    ClosedForm,
    /// From a former result.
    Given(Parameters),
}

/// How to orient.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// How the iteration is carried out.
    pub method: Method,
    /// Where it starts.
    pub start: Start,
    /// Iterations at the most.
    pub max_iterations: usize,
    /// Fraction of its standard deviation by which no unknown changes any more (rigorous method).
    pub tolerance: f64,
    /// Whether the cycles of the bulletin keep what they computed on their way.
    pub trace: bool,
    /// The scale that is held; six unknowns are left then.
    pub scale: Option<f64>,
}

impl Default for Options {
    /// The rigorous method from the start that suits the control, to a hundred-thousandth of the standard deviations.
    fn default() -> Self {
        Self {
            method: Method::Rigorous,
            start: Start::Auto,
            max_iterations: 50,
            tolerance: 1e-5,
            trace: false,
            scale: None,
        }
    }
}

/// Why there is no orientation. Stations are indices.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SimilarityError {
    /// Fewer known components than the seven parameters need, or too few of a kind.
    #[error(
        "insufficient control: {} known coordinates ({} X, {} Y, {} elevations)",
        known.iter().sum::<usize>(), known[0], known[1], known[2]
    )]
    Insufficient {
        /// How many X, Y and Z are known.
        known: [usize; 3],
    },
    /// The geometry of the control leaves a combination of parameters undetermined.
    #[error("the control does not determine the orientation: {cause}")]
    Undetermined {
        /// Why.
        cause: Cause,
        /// The stations concerned.
        stations: Vec<usize>,
    },
    /// The report's start needs horizontal control at the first two stations, at different places.
    #[error("the first two stations {0}")]
    FirstStations(&'static str),
    /// The scale is not positive: the model is a mirror image of its control.
    #[error("the scale became {0}: not positive")]
    Scale(f64),
    /// The initial values give nothing finite.
    #[error("the initial values give model coordinates that are not finite")]
    NotFinite,
    /// The work was stopped: by whoever watched it, or for want of memory or threads.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// More than can be numbered.
    #[error(transparent)]
    Layout(#[from] LayoutError),
}

/// Finds the seven parameters by least squares, on a thread of its own: control is never much work.
///
/// # Errors
/// Those of [`orient_on`]; a thread that cannot be started.
pub fn orient(stations: &[Station], options: &Options) -> Result<Solution, SimilarityError> {
    orient_on(stations, options, &Threads::new(1)?, &mut adjustment::go_on)
}

/// The same on threads of the caller. `watch` is called on the calling thread; when it breaks, the adjustment stops.
///
/// # Errors
/// Control that does not determine the parameters, a start that cannot be had, a mirror image, an interruption.
pub fn orient_on(
    stations: &[Station],
    options: &Options,
    threads: &Threads,
    watch: &mut dyn FnMut(Event) -> ControlFlow<()>,
) -> Result<Solution, SimilarityError> {
    let held = options.scale.is_some();
    determinacy::check_counts(stations, held)?;
    // The solvers of the library ask how many threads there are: elsewhere that would start those of the whole process.
    let chosen = threads.install(|| {
        let chosen = start::choose(stations, options.start, options.scale)?;
        determinacy::check_geometry(stations, &chosen.similarity, held).map(|()| chosen)
    })?;
    match options.method {
        Method::Rigorous => adjust(stations, options, chosen, None, threads, watch),
        Method::Report | Method::FillIn => {
            let cycles = published::iterate(stations, options, &chosen.similarity)?;
            adjust(stations, options, chosen, Some(cycles), threads, watch)
        }
    }
}

/// The seven parameters by least squares with equal weights, in closed form where all control is full.
///
/// # Errors
/// Control that does not determine the parameters, or a mirror image.
pub fn closed_form(stations: &[Station]) -> Result<Similarity, SimilarityError> {
    determinacy::check_counts(stations, false)?;
    Ok(start::choose(stations, Start::ClosedForm, None)?.similarity)
}

/// Adjusts by the engine; after the cycles of the bulletin only for cofactors and statistics.
fn adjust(
    stations: &[Station],
    options: &Options,
    chosen: Chosen,
    cycles: Option<published::Cycles>,
    threads: &Threads,
    watch: &mut dyn FnMut(Event) -> ControlFlow<()>,
) -> Result<Solution, SimilarityError> {
    let start = cycles.as_ref().map_or(chosen.similarity, |cycles| cycles.similarity);
    if start.scale.is_nan() || start.scale <= 0.0 {
        return Err(SimilarityError::Scale(start.scale));
    }
    let weighted = Weighted::new(stations, &chosen)?;
    let problem = threads.install(|| problem(&weighted.stations, &start, options.scale.is_some()))?;
    let engine = adjustment::Options {
        method: adjustment::Method::Damped(Stop::Fraction(options.tolerance)),
        max_iterations: if cycles.is_some() { 0 } else { options.max_iterations },
        covariance: true,
        loss: None,
        threads: 0,
    };
    let mut adjusted =
        adjustment::adjust(&problem, &engine, threads, watch).map_err(|error| match error {
            AdjustError::Stopped(stopped) => SimilarityError::Stopped(stopped),
            AdjustError::NotFinite => SimilarityError::NotFinite,
            AdjustError::UndeterminedLocals(stations) => {
                SimilarityError::Undetermined { cause: Cause::Singular, stations }
            }
            AdjustError::Undetermined(_) => {
                SimilarityError::Undetermined { cause: Cause::Singular, stations: vec![] }
            }
        })?;
    if let Some(cycles) = &cycles {
        adjusted.status = if cycles.converged { Status::Converged } else { Status::NotConverged };
    }
    let solution = threads
        .install(|| Solution::new(&weighted, &problem, &adjusted, chosen, cycles, options.scale.is_some()))?;
    let scale = solution.similarity.scale;
    if scale.is_nan() || scale <= 0.0 { Err(SimilarityError::Scale(scale)) } else { Ok(solution) }
}

/// The least-squares problem: the control coordinates are local blocks of three, the seven parameters one retained block.
fn problem(
    stations: &[Station],
    start: &Similarity,
    held: bool,
) -> Result<Problem<AsControl>, SimilarityError> {
    let (mut initial, mut prior, mut sd) = (vec![], vec![], vec![]);
    for station in stations {
        let known = station.known();
        let given = start.centred(&station.control);
        let carried = start.centred(&start.control_at(&station.model));
        for k in 0..3 {
            initial.push(if known[k] { given[k] } else { carried[k] });
            prior.push(if known[k] { given[k] } else { 0.0 });
            sd.push(if known[k] { station.control_sd[k] } else { f64::INFINITY });
        }
    }
    let [x, y, z] = start.shift.into();
    let parameters = [0.0, 0.0, 0.0, start.scale, x, y, z];
    initial.extend(parameters);
    prior.extend(parameters);
    sd.extend((0..CHANGES).map(|i| if held && i == SCALE { 0.0 } else { f64::INFINITY }));
    let count = stations.len();
    let layout = Layout::new(3, 3, &[CHANGES], (0..=count).collect(), vec![0; count])?;
    Ok(Problem {
        model: AsControl::new(stations, start),
        system: System::new(layout, Ordering::Input)?,
        observation_sd: stations.iter().flat_map(|station| station.model_sd).collect(),
        initial,
        prior,
        sd,
    })
}
