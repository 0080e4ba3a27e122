//! Errors of the absolute orientation.

use std::fmt;

use thiserror::Error;

use photocore::Stopped;
use photocore::normals::LayoutError;

/// Reason why control does not determine the orientation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// The horizontal stations coincide in plan.
    Coincident,
    /// The stations with elevations are in a straight line in plan.
    ElevationsInLine,
    /// All stations are in a straight line in space.
    StationsInLine,
    /// Another deficiency of the geometry.
    Singular,
}

impl Cause {
    /// Returns the name of the cause.
    pub fn name(self) -> &'static str {
        match self {
            Self::Coincident => "coincident",
            Self::ElevationsInLine => "elevations in line",
            Self::StationsInLine => "stations in line",
            Self::Singular => "singular",
        }
    }
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Coincident => {
                "the stations with horizontal coordinates coincide in plan, so that kappa and the scale are open"
            }
            Self::ElevationsInLine => {
                "the stations with elevations are in a straight line in plan, so that the tilt about it is open"
            }
            Self::StationsInLine => {
                "the stations are in a straight line, so that the rotation about it is open"
            }
            Self::Singular => "the normal equations are singular",
        })
    }
}

/// Reason for a failed orientation. Stations are indices.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SimilarityError {
    /// Fewer known components than the seven parameters need, or too few of one kind.
    #[error(
        "insufficient control: {} known coordinates ({} X, {} Y, {} elevations)",
        known.iter().sum::<usize>(), known[0], known[1], known[2]
    )]
    Insufficient {
        /// Numbers of known X, Y and Z.
        known: [usize; 3],
    },
    /// The geometry of the control does not determine a combination of parameters.
    #[error("the control does not determine the orientation: {cause}")]
    Undetermined {
        /// Cause of the deficiency.
        cause: Cause,
        /// Stations concerned.
        stations: Vec<usize>,
    },
    /// The report's initial values need horizontal control at the first two stations, at different positions.
    #[error("the first two stations {0}")]
    FirstStations(&'static str),
    /// The scale is not positive: the model is a mirror image of its control.
    #[error("the scale became {0}: not positive")]
    Scale(f64),
    /// The initial values give values that are not finite.
    #[error("the initial values give model coordinates that are not finite")]
    NotFinite,
    /// The computation was stopped by the caller, or lacks memory or threads.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// The number of unknowns exceeds the index range.
    #[error(transparent)]
    Layout(#[from] LayoutError),
}
