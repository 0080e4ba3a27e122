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

use crate::geometry::Vector3;

pub use adjust::{closed_form, orient, orient_on};
pub use error::{Cause, SimilarityError};
pub use published::{Trace, gauss_crout};
pub use solution::{AdjustedStation, Solution};
pub use start::Started;
pub use transform::{Matrix7, Parameters, Similarity};

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
