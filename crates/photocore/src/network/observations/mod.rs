//! Observations of a network beside its images (lengths, differences of coordinates, positions and attitudes of photos ...).
//!
//! Each kind is a file with a type that implements [`ObservationModel`], and a line of `kinds!` below. It writes observed minus
//! computed, and the partials of the computed values by positions and rotations; [`Rows`] turns these into the columns of the unknowns.

mod adjusted;
mod precision;
mod rows;
mod tied;

use thiserror::Error;

use crate::geometry::Matrix3;

pub use adjusted::{AdjustedObservation, KindSums};
pub(super) use attitude::misalignment;
pub use precision::Precision;
pub use rows::{Rows, Sites};
pub(super) use tied::{TiedModel, TiedObservation};

/// A kind of observation of points and photos.
pub trait ObservationModel {
    /// The name under which reports know the kind.
    const NAME: &'static str;

    /// The points and photos that it is of: they are known by their place in this list to [`ObservationModel::write`].
    fn touches(&self) -> Touches;

    /// How many components it has.
    fn rows(&self) -> usize;

    /// How well these are known.
    fn precision(&self) -> Precision;

    /// Writes observed minus computed, and the partials of the computed values.
    fn write(&self, sites: &Sites<'_>, rows: &mut Rows<'_>);

    /// Refuses what cannot be observed.
    ///
    /// # Errors
    /// What is wrong with it.
    fn check(&self) -> Result<(), Fault> {
        Ok(())
    }
}

macro_rules! kinds {
    ($($module:ident::$name:ident;)*) => {
        $(mod $module;
        pub use $module::$name;)*

        /// An observation of any kind.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Observation {
            $(#[doc = concat!("See [`", stringify!($name), "`].")] $name($name),)*
        }

        $(impl From<$name> for Observation {
            fn from(observation: $name) -> Self {
                Self::$name(observation)
            }
        })*

        /// The names of all kinds, in the order in which results list them.
        pub const KINDS: &[&str] = &[$($name::NAME),*];

        impl Observation {
            /// See [`ObservationModel::NAME`].
            pub fn kind(&self) -> &'static str {
                match self {
                    $(Self::$name(_) => $name::NAME,)*
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

            fn own_check(&self) -> Result<(), Fault> {
                match self {
                    $(Self::$name(own) => own.check(),)*
                }
            }
        }
    };
}

kinds! {
    control::Control;
    distance::Distance;
    difference::Difference;
    equal_height::EqualHeight;
    position::Position;
    attitude::Attitude;
    relative::Relative;
}

/// What an observation is of: indices into the network, each once.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Touches {
    /// Its points.
    pub points: Vec<usize>,
    /// Its photos.
    pub photos: Vec<usize>,
}

impl Touches {
    /// Points alone.
    pub fn points(points: &[usize]) -> Self {
        Self { points: points.to_vec(), photos: vec![] }
    }

    /// Photos alone.
    pub fn photos(photos: &[usize]) -> Self {
        Self { points: vec![], photos: photos.to_vec() }
    }
}

/// What is wrong with an observation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum Fault {
    /// A point that is not there.
    #[error("names point {0}, which is not there")]
    NoPoint(usize),
    /// A photo that is not there.
    #[error("names photo {0}, which is not there")]
    NoPhoto(usize),
    /// A point or photo with itself.
    #[error("names a point or photo twice")]
    Twice,
    /// No component is observed.
    #[error("has no component")]
    Nothing,
    /// More or fewer standard deviations than components.
    #[error("has {components} components and {given} standard deviations")]
    Deviations {
        /// How many components it has.
        components: usize,
        /// Standard deviations, or rows of the covariance matrix.
        given: usize,
    },
    /// A standard deviation that gives no weight.
    #[error("has a standard deviation that is not positive and finite")]
    Deviation,
    /// A matrix that is no covariance matrix.
    #[error("has a covariance matrix that is not symmetric and positive definite")]
    Covariance,
    /// A matrix that is no rotation.
    #[error("has a matrix that is no rotation")]
    Rotation,
    /// A value that is not finite, at the initial values or at all.
    #[error("has a value that is not finite, or cannot be computed from the initial values")]
    NotFinite,
}

impl Observation {
    /// Refuses an observation that contradicts itself or a network of so many points and photos.
    pub(super) fn check(&self, points: usize, photos: usize) -> Result<(), Fault> {
        let touches = self.touches();
        if let Some(&point) = touches.points.iter().find(|&&point| point >= points) {
            return Err(Fault::NoPoint(point));
        }
        if let Some(&photo) = touches.photos.iter().find(|&&photo| photo >= photos) {
            return Err(Fault::NoPhoto(photo));
        }
        let twice = |all: &[usize]| (1..all.len()).any(|i| all[..i].contains(&all[i]));
        if twice(&touches.points) || twice(&touches.photos) {
            return Err(Fault::Twice);
        }
        self.own_check()?;
        match self.rows() {
            0 => Err(Fault::Nothing),
            rows => self.precision().root(rows).map(|_| ()),
        }
    }
}

/// Refuses a matrix that is not a rotation to six digits.
fn rotates(matrix: &Matrix3) -> Result<(), Fault> {
    const DIGITS: f64 = 1e-6;
    let difference = (matrix.tr_mul(matrix) - Matrix3::identity()).amax();
    // NaN is no rotation either.
    if difference < DIGITS && matrix.determinant() > 0.0 { Ok(()) } else { Err(Fault::Rotation) }
}

#[cfg(test)]
mod tests;
