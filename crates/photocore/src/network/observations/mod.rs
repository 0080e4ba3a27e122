//! Additional observations of a network: lengths, coordinate differences, positions and attitudes of photos.
//!
//! Each type implements [`ObservationModel`], in its own file or with related types, and has a line of `kinds!` below. It writes observed
//! minus computed values and the partials by positions and rotations. [`Rows`] converts these to the parameter columns.

mod adjusted;
mod assembled;
mod model;
mod precision;
mod rows;

use nalgebra::DMatrix;

use self::model::{deviation, in_own_axes, length, nine, own_axes, rotates, rows_of, three};
use self::precision::Root;
use super::commons::{Common, CommonKind};

pub use adjusted::{AdjustedObservation, KindSums};
pub(super) use assembled::{AssembledObservation, LOCAL, Linear, ModelValues};
pub use model::{Named, ObservationModel, Quantity, Touches};
pub(super) use photos::misalignment;
pub use precision::{Fault, Precision};
pub(super) use rows::{CommonSite, PhotoSite, PointSite};
pub use rows::{ObservationInputs, Rows};

macro_rules! kinds {
    ($d:tt $($module:ident { $($name:ident = $said:literal, $precision:ident;)* })*) => {
        $(mod $module;
        pub use $module::{$($name),*};)*

        /// An observation of any type.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Observation {
            $($(#[doc = concat!("See [`", stringify!($name), "`].")] $name($name),)*)*
        }

        $($(impl From<$name> for Observation {
            fn from(observation: $name) -> Self {
                Self::$name(observation)
            }
        })*)*

        /// Names of all types, in the order of the results.
        pub const KINDS: &[&str] = &[$($($said),*),*];

        impl Observation {
            /// Returns the name of the type in reports.
            pub fn kind(&self) -> &'static str {
                match self {
                    $($(Self::$name(_) => $said,)*)*
                }
            }

            /// Returns an observation of the named type (see [`ObservationModel::from_numbers`]); None for an unknown name.
            pub fn from_numbers(kind: &str, of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
                match kind {
                    $($($said => $name::from_numbers(of, values, covariance).map(Self::from),)*)*
                    _ => None,
                }
            }

            /// Returns the precision of the components.
            pub fn precision(&self) -> Precision {
                match self {
                    $($(Self::$name(own) => own.$precision.clone().into(),)*)*
                }
            }

            /// Returns L of the covariance matrix S = L L^T of the components.
            pub(super) fn root(&self) -> Result<DMatrix<f64>, Fault> {
                match self {
                    $($(Self::$name(own) => own.$precision.root(own.rows()),)*)*
                }
            }
        }

        /// Evaluates an expression with the observation as its own type.
        macro_rules! each_observation {
            ($d observation:expr, $d own:ident => $d body:expr) => {
                match $d observation {
                    $($(Observation::$name($d own) => $d body,)*)*
                }
            };
        }
    };
}

// Each type with its name in reports, and its field of a standard deviation or precision.
kinds! { $
    points {
        Control = "control", precision;
        Distance = "distance", sd;
        Difference = "difference", precision;
    }
    equal_height { EqualHeight = "equal height", sd; }
    on_figure {
        OnLevel = "on level", sd;
        OnPlane = "on plane", sd;
        OnPlumbLine = "on plumb line", precision;
        OnLine = "on line", precision;
    }
    photos {
        Range = "range", sd;
        Position = "position", precision;
        Attitude = "attitude", precision;
        Relative = "relative", precision;
    }
    unknowns {
        Base = "base", sd;
        Prior = "prior", precision;
    }
    motion {
        Velocity = "velocity", precision;
        Rate = "rate", precision;
        Smoothness = "smoothness", precision;
    }
    film {
        Fiducial = "fiducial", precision;
        Film = "film", precision;
    }
}

impl Observation {
    /// See [`ObservationModel::touches`].
    pub fn touches(&self) -> Touches {
        each_observation!(self, own => own.touches())
    }

    /// See [`ObservationModel::rows`].
    pub fn rows(&self) -> usize {
        each_observation!(self, own => own.rows())
    }

    fn write(&self, inputs: &ObservationInputs<'_>, rows: &mut Rows<'_>) {
        each_observation!(self, own => own.write(inputs, rows));
    }

    /// See [`ObservationModel::moves`].
    pub(super) fn moves(&self) -> bool {
        each_observation!(self, own => own.moves())
    }

    fn axes(&self, inputs: &ObservationInputs<'_>) -> Option<DMatrix<f64>> {
        each_observation!(self, own => own.axes(inputs))
    }

    /// Returns an error if the observation is invalid or does not fit the points, photos and shared parameters of the network.
    pub(super) fn check(&self, points: usize, photos: usize, commons: &[Common]) -> Result<(), Fault> {
        let touches = self.touches();
        if let Some(&point) = touches.points.iter().find(|&&point| point >= points) {
            return Err(Fault::NoPoint(point));
        }
        if let Some(&photo) = touches.photos.iter().find(|&&photo| photo >= photos) {
            return Err(Fault::NoPhoto(photo));
        }
        for (place, &(common, needed)) in touches.commons.iter().enumerate() {
            let own = commons.get(common).ok_or(Fault::NoCommon(common))?;
            if let Some(needed) = needed.filter(|&needed| needed != own.kind) {
                return Err(Fault::OtherCommon { common, needed });
            }
            // A shared parameter of any type: all its components are observed.
            let (components, given) = (own.sd.len(), each_observation!(self, own => own.components(place)));
            if needed.is_none() && components != given {
                return Err(Fault::Deviations { components, given });
            }
        }
        let twice = |all: &[usize]| (1..all.len()).any(|i| all[..i].contains(&all[i]));
        let named: Vec<usize> = touches.commons.iter().map(|&(common, _)| common).collect();
        if twice(&touches.points) || twice(&touches.photos) || twice(&named) {
            return Err(Fault::Twice);
        }
        each_observation!(self, own => own.check())?;
        match self.rows() {
            0 => Err(Fault::Nothing),
            _ => self.root().map(|_| ()),
        }
    }
}

#[cfg(test)]
mod golden;
#[cfg(test)]
mod tests;
