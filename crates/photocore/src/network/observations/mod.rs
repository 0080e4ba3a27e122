//! Observations of a network beside its images (lengths, differences of coordinates, positions and attitudes of photos ...).
//!
//! Each kind is a file with a type that implements [`ObservationModel`], and a line of `kinds!` below. It writes observed minus
//! computed, and the partials of the computed values by positions and rotations; [`Rows`] turns these into the columns of the unknowns.

mod adjusted;
mod precision;
mod rows;
mod tied;

use nalgebra::{DMatrix, SMatrix, SVector};
use thiserror::Error;

use super::commons::{Common, CommonKind};
use crate::geometry::Matrix3;

pub use adjusted::{AdjustedObservation, KindSums};
pub(super) use attitude::misalignment;
pub use precision::Precision;
pub(super) use rows::{CommonSite, PhotoSite, PointSite};
pub use rows::{Rows, Sites};
pub(super) use tied::{TiedModel, TiedObservation};

/// A kind of observation of points, photos and unknowns that observations have in common.
pub trait ObservationModel: Sized {
    /// The name under which reports know the kind.
    const NAME: &'static str;

    /// From numbers, as callers have them that know a kind by its name; None where there are more or fewer than it has.
    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self>;

    /// What it is of: points, photos and common unknowns are known by their place in these lists to [`ObservationModel::write`].
    fn touches(&self) -> Touches;

    /// How many components it has.
    fn rows(&self) -> usize;

    /// How well these are known.
    fn precision(&self) -> Precision;

    /// Writes observed minus computed, and the partials of the computed values.
    fn write(&self, sites: &Sites<'_>, rows: &mut Rows<'_>);

    /// The axes, as rows, in which observed minus computed is a displacement of a place; None where it is none. A displacement turns and
    /// grows with a network that moves as a whole, and says nothing about that (see [`crate::adjustment::Model::carried`]).
    fn axes(&self, _sites: &Sites<'_>) -> Option<DMatrix<f64>> {
        None
    }

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

            /// An observation of the kind of that name (see [`ObservationModel::from_numbers`]); None where there is no such kind.
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

            fn axes(&self, sites: &Sites<'_>) -> Option<DMatrix<f64>> {
                match self {
                    $(Self::$name(own) => own.axes(sites),)*
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
    on_level::OnLevel;
    on_plane::OnPlane;
    on_plumb_line::OnPlumbLine;
    on_line::OnLine;
    position::Position;
    attitude::Attitude;
    relative::Relative;
    base::Base;
    prior::Prior;
}

/// What an observation is of: indices into the network, each once; of a common unknown with the type that it must have, None for any.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Touches {
    /// Its points.
    pub points: Vec<usize>,
    /// Its photos.
    pub photos: Vec<usize>,
    /// Its common unknowns.
    pub commons: Vec<(usize, Option<CommonKind>)>,
}

impl Touches {
    /// Points alone.
    pub fn points(points: &[usize]) -> Self {
        Self { points: points.to_vec(), ..Self::default() }
    }

    /// Photos alone.
    pub fn photos(photos: &[usize]) -> Self {
        Self { photos: photos.to_vec(), ..Self::default() }
    }

    /// Besides a common unknown, where there is one.
    #[must_use]
    pub fn and(mut self, common: Option<usize>, kind: CommonKind) -> Self {
        self.commons.extend(common.map(|common| (common, Some(kind))));
        self
    }
}

/// What an observation is of, as it is given in numbers: indices into the network.
#[derive(Debug, Clone, Copy)]
pub struct Named<'a> {
    /// Points.
    pub points: &'a [usize],
    /// Photos.
    pub photos: &'a [usize],
    /// Common unknowns; None where the kind can do without.
    pub commons: &'a [Option<usize>],
}

/// A quantity that is known, or a common unknown, by its index.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Quantity<T> {
    /// Its value.
    Known(T),
    /// Its index.
    Common(usize),
}

impl<T> Quantity<T> {
    /// The common unknown, where there is one; else what is known.
    pub fn new(common: Option<usize>, known: T) -> Self {
        common.map_or(Self::Known(known), Self::Common)
    }

    /// The index of a common unknown.
    pub fn common(&self) -> Option<usize> {
        match self {
            Self::Known(_) => None,
            Self::Common(index) => Some(*index),
        }
    }
}

/// Three numbers from a place on; None where there are not so many.
fn three(values: &[f64], first: usize) -> Option<[f64; 3]> {
    values.get(first..first + 3)?.try_into().ok()
}

/// A matrix of nine numbers, row by row, from a place on.
fn nine(values: &[f64], first: usize) -> Option<Matrix3> {
    values.get(first..first + 9).map(Matrix3::from_row_slice)
}

/// The standard deviation of an observation of one component.
fn deviation(covariance: &DMatrix<f64>) -> f64 {
    covariance[(0, 0)].sqrt()
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
    /// A common unknown that is not there.
    #[error("names common unknown {0}, which is not there")]
    NoCommon(usize),
    /// A common unknown of another type than it needs.
    #[error("names common unknown {common}, which is no {}", .needed.name())]
    OtherCommon {
        /// Its index.
        common: usize,
        /// The type.
        needed: CommonKind,
    },
    /// Nothing of what it is of is unknown.
    #[error("is of known quantities alone")]
    NothingUnknown,
    /// A point, photo or common unknown with itself.
    #[error("names a point, photo or common unknown twice")]
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
    /// Refuses an observation that contradicts itself or a network of so many points and photos, and these common unknowns.
    pub(super) fn check(&self, points: usize, photos: usize, commons: &[Common]) -> Result<(), Fault> {
        let touches = self.touches();
        if let Some(&point) = touches.points.iter().find(|&&point| point >= points) {
            return Err(Fault::NoPoint(point));
        }
        if let Some(&photo) = touches.photos.iter().find(|&&photo| photo >= photos) {
            return Err(Fault::NoPhoto(photo));
        }
        for &(common, needed) in &touches.commons {
            let own = commons.get(common).ok_or(Fault::NoCommon(common))?;
            if let Some(needed) = needed.filter(|&needed| needed != own.kind) {
                return Err(Fault::OtherCommon { common, needed });
            }
            // Of any type: all its unknowns are observed.
            let (components, given) = (own.sd.len(), self.rows());
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

/// Writes some components of a point in the own axes of a plane or line, less the unknown offsets: `selected` has them as rows.
///
/// own = R^T (P - p_0), with the partials R^T by P, and `[own]x` by a turn of the axes about themselves.
fn in_own_axes<const N: usize>(
    sites: &Sites<'_>,
    rows: &mut Rows<'_>,
    selected: &SMatrix<f64, N, 3>,
    observed: &[f64; N],
) {
    let common = sites.common(0);
    let own = common.own(&sites.position(0));
    let residual = SVector::from(*observed) - selected * (own - common.offset());
    rows.residual(0, residual.as_slice());
    rows.by_position(0, 0, &(selected * common.attitude().transpose()));
    rows.by_offset(0, 0, &-selected);
    rows.by_turn(0, 0, &(selected * own.cross_matrix()));
}

/// What [`ObservationModel::axes`] are of a point in some of the own axes of a plane or line.
fn own_axes<const N: usize>(sites: &Sites<'_>, selected: &SMatrix<f64, N, 3>) -> Option<DMatrix<f64>> {
    rows_of(&(selected * sites.common(0).attitude().transpose()))
}

/// Axes as rows.
fn rows_of<const N: usize>(axes: &SMatrix<f64, N, 3>) -> Option<DMatrix<f64>> {
    Some(DMatrix::from_iterator(N, 3, axes.iter().copied()))
}

/// Refuses a matrix that is not a rotation to six digits.
fn rotates(matrix: &Matrix3) -> Result<(), Fault> {
    const DIGITS: f64 = 1e-6;
    let difference = (matrix.tr_mul(matrix) - Matrix3::identity()).amax();
    // NaN is no rotation either.
    if difference < DIGITS && matrix.determinant() > 0.0 { Ok(()) } else { Err(Fault::Rotation) }
}

#[cfg(test)]
mod golden;
#[cfg(test)]
mod tests;
