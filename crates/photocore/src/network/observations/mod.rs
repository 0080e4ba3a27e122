//! Additional observations of a network: lengths, coordinate differences, positions and attitudes of photos.
//!
//! Each type implements [`ObservationModel`], in its own file or with related types, and has a line of `kinds!` below. It writes observed
//! minus computed values and the partials by positions and rotations. [`Rows`] converts these to the parameter columns.

mod adjusted;
mod model;
mod precision;
mod rows;
mod tied;

use nalgebra::DMatrix;

use self::model::{deviation, in_own_axes, nine, own_axes, rotates, rows_of, three};
use super::commons::{Common, CommonKind};

pub use adjusted::{AdjustedObservation, KindSums};
pub use model::{Named, ObservationModel, Quantity, Touches};
pub(super) use photos::misalignment;
pub use precision::{Fault, Precision};
pub(super) use rows::{CommonSite, PhotoSite, PointSite};
pub use rows::{Rows, Sites};
pub(super) use tied::{LOCAL, Linear, TiedModel, TiedObservation};

macro_rules! kinds {
    ($($module:ident::$($name:ident)? $({$($member:ident),*})?;)*) => {
        $(mod $module;
        $(pub use $module::$name;)?
        $(pub use $module::{$($member),*};)?)*
        kinds! { @kinds $($($name)? $($($member)*)?)* }
    };
    (@kinds $($name:ident)*) => {
        /// An observation of any type.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Observation {
            $(#[doc = concat!("See [`", stringify!($name), "`].")] $name($name),)*
        }

        $(impl From<$name> for Observation {
            fn from(observation: $name) -> Self {
                Self::$name(observation)
            }
        })*

        /// Names of all types, in the order of the results.
        pub const KINDS: &[&str] = &[$($name::NAME),*];

        impl Observation {
            /// See [`ObservationModel::NAME`].
            pub fn kind(&self) -> &'static str {
                match self {
                    $(Self::$name(_) => $name::NAME,)*
                }
            }

            /// Returns an observation of the named type (see [`ObservationModel::from_numbers`]); None for an unknown name.
            pub fn from_numbers(
                kind: &str,
                of: &Named<'_>,
                values: &[f64],
                covariance: DMatrix<f64>,
            ) -> Option<Self> {
                match kind {
                    $($name::NAME => $name::from_numbers(of, values, covariance).map(Self::from),)*
                    _ => None,
                }
            }

            /// See [`ObservationModel::touches`].
            pub fn touches(&self) -> Touches {
                match self {
                    $(Self::$name(own) => own.touches(),)*
                }
            }

            /// See [`ObservationModel::rows`].
            pub fn rows(&self) -> usize {
                match self {
                    $(Self::$name(own) => own.rows(),)*
                }
            }

            /// See [`ObservationModel::precision`].
            pub fn precision(&self) -> Precision {
                match self {
                    $(Self::$name(own) => own.precision(),)*
                }
            }

            fn write(&self, sites: &Sites<'_>, rows: &mut Rows<'_>) {
                match self {
                    $(Self::$name(own) => own.write(sites, rows),)*
                }
            }

            /// See [`ObservationModel::moves`].
            pub(super) fn moves(&self) -> bool {
                match self {
                    $(Self::$name(own) => own.moves(),)*
                }
            }

            fn axes(&self, sites: &Sites<'_>) -> Option<DMatrix<f64>> {
                match self {
                    $(Self::$name(own) => own.axes(sites),)*
                }
            }

            fn components(&self, common: usize) -> usize {
                match self {
                    $(Self::$name(own) => own.components(common),)*
                }
            }

            fn own_check(&self) -> Result<(), Fault> {
                match self {
                    $(Self::$name(own) => own.check(),)*
                }
            }
        }
    };
}

kinds! {
    points::{Control, Distance, Difference};
    equal_height::EqualHeight;
    on_figure::{OnLevel, OnPlane, OnPlumbLine, OnLine};
    photos::{Range, Position, Attitude, Relative};
    unknowns::{Base, Prior};
    motion::{Velocity, Rate, Smoothness};
    film::{Fiducial, Film};
}

impl Observation {
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
            let (components, given) = (own.sd.len(), self.components(place));
            if needed.is_none() && components != given {
                return Err(Fault::Deviations { components, given });
            }
        }
        let twice = |all: &[usize]| (1..all.len()).any(|i| all[..i].contains(&all[i]));
        let named: Vec<usize> = touches.commons.iter().map(|&(common, _)| common).collect();
        if twice(&touches.points) || twice(&touches.photos) || twice(&named) {
            return Err(Fault::Twice);
        }
        self.own_check()?;
        match self.rows() {
            0 => Err(Fault::Nothing),
            rows => self.precision().root(rows).map(|_| ()),
        }
    }
}

#[cfg(test)]
mod golden;
#[cfg(test)]
mod tests;
