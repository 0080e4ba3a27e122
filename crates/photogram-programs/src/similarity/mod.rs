//! Absolute orientation: the similarity x = s A X + B between a model and its control (C&GS Technical Bulletin 19, "TB 19").
//!
//! Each station has model coordinates x and any subset of its control coordinates X. The observations are the model coordinates, as in the
//! bulletin. Control coordinates are unknowns: fixed if exact, weighted if they have standard deviations, free if missing. Elimination of
//! the free ones leaves the misclosures u = s X - A^T (x - B) of the known components. They are valid for any mix of full, horizontal and
//! height control.
//!
//! ```
//! use photocore::geometry::Vector3;
//! use photogram_programs::similarity::{Options, Station, orient};
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

mod adjust;
mod determinacy;
mod error;
mod misclosures;
mod model;
mod moments;
mod published;
mod solution;
mod start;
mod transform;

use photocore::geometry::Vector3;

pub use adjust::{closed_form, orient, orient_on};
pub use error::{Cause, SimilarityError};
pub use published::{Trace, gauss_crout};
pub use solution::{AdjustedStation, Solution};
pub use start::Started;
pub use transform::{Matrix7, Parameters, Similarity};

/// Station: a point of the model with some of its control coordinates.
#[derive(Debug, Clone, Copy)]
pub struct Station {
    /// Control coordinates X in ground units; NaN if unknown.
    pub control: Vector3,
    /// Standard deviations of the control coordinates; zero for an exact one, infinite for an unused one.
    pub control_sd: [f64; 3],
    /// Model coordinates x in model units.
    pub model: Vector3,
    /// Standard deviations of the model coordinates; zero if the control has positive ones.
    pub model_sd: [f64; 3],
}

impl Station {
    /// Returns which control coordinates are used.
    pub fn known(&self) -> [bool; 3] {
        std::array::from_fn(|k| self.control[k].is_finite() && self.control_sd[k].is_finite())
    }

    /// Returns whether both horizontal coordinates are used.
    fn pair(&self) -> bool {
        let [x, y, _] = self.known();
        x && y
    }

    /// Returns whether the elevation is used.
    fn elevation(&self) -> bool {
        self.known()[2]
    }
}

/// Method of the iteration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Least squares by the engine, until every change is below a fraction of its standard deviation.
    Rigorous,
    /// Cycle of TB 19 with the misclosures of the known components: Gauss-Crout, until all corrections of angles are at most 1e-5 radian.
    Report,
    /// Cycle of TB 19 with its own equations; missing control coordinates are replaced by results of the last cycle.
    FillIn,
}

/// Initial values of the iteration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Start {
    /// Report's values, unless they lead to a worse minimum than the closed form.
    Auto,
    /// Values from the first two stations (TB 19, section 3).
    Report,
    /// Horn's quaternion for full control; otherwise the best of the minima over all rotations.
    ClosedForm,
    /// Values of a former result.
    Given(Parameters),
}

/// Options of an orientation.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// Method of the iteration.
    pub method: Method,
    /// Initial values.
    pub start: Start,
    /// Maximum number of iterations.
    pub max_iterations: usize,
    /// Convergence limit: change of an unknown as a fraction of its standard deviation (rigorous method).
    pub tolerance: f64,
    /// Whether the cycles of the bulletin record intermediate results.
    pub trace: bool,
    /// Fixed scale; six unknowns remain.
    pub scale: Option<f64>,
}

impl Default for Options {
    /// Returns the rigorous method with automatic initial values, converged to 1e-5 standard deviations.
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
