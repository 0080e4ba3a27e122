//! What a kind of observation is.

use nalgebra::{DMatrix, SMatrix, SVector};

use super::fault::Fault;
use super::precision::Precision;
use super::rows::{Rows, Sites};
use crate::geometry::Matrix3;
use crate::network::commons::CommonKind;

/// A kind of observation of points, photos and unknowns that observations have in common.
pub trait ObservationModel: Sized {
    /// The name under which reports know the kind.
    const NAME: &'static str;

    /// From numbers, as callers have them that know a kind by its name; None where there are more or fewer than it has.
    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self>;

    /// What it is of: points, photos and common unknowns are known by their place in these lists to [`ObservationModel::write`].
    fn touches(&self) -> Touches;

    /// Whether it is of how a photo moves, which then is on a trajectory: [`Sites::moving`].
    fn moves(&self) -> bool {
        false
    }

    /// How many components it has.
    fn rows(&self) -> usize;

    /// How many unknowns a common one of any type has, by its place in [`Touches::commons`].
    fn components(&self, _common: usize) -> usize {
        self.rows()
    }

    /// How well these are known.
    fn precision(&self) -> Precision;

    /// Writes observed minus computed, and the partials of the computed values.
    fn write(&self, sites: &Sites<'_>, rows: &mut Rows<'_>);

    /// The axes, as rows, in which observed minus computed is a displacement of a place; None where it is none. A displacement turns and
    /// grows with a network that moves as a whole, and says nothing about that (see [`crate::adjustment::Evaluated::carried`]).
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
pub(super) fn three(values: &[f64], first: usize) -> Option<[f64; 3]> {
    values.get(first..first + 3)?.try_into().ok()
}

/// A matrix of nine numbers, row by row, from a place on.
pub(super) fn nine(values: &[f64], first: usize) -> Option<Matrix3> {
    values.get(first..first + 9).map(Matrix3::from_row_slice)
}

/// The standard deviation of an observation of one component.
pub(super) fn deviation(covariance: &DMatrix<f64>) -> f64 {
    covariance[(0, 0)].sqrt()
}

/// Writes some components of a point in the own axes of a plane or line, less the unknown offsets: `selected` has them as rows.
///
/// own = R^T (P - p_0), with the partials R^T by P, and `[own]x` by a turn of the axes about themselves.
pub(super) fn in_own_axes<const N: usize>(
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
pub(super) fn own_axes<const N: usize>(
    sites: &Sites<'_>,
    selected: &SMatrix<f64, N, 3>,
) -> Option<DMatrix<f64>> {
    rows_of(&(selected * sites.common(0).attitude().transpose()))
}

/// Axes as rows.
pub(super) fn rows_of<const N: usize>(axes: &SMatrix<f64, N, 3>) -> Option<DMatrix<f64>> {
    Some(DMatrix::from_iterator(N, 3, axes.iter().copied()))
}

/// Refuses a matrix that is not a rotation to six digits.
pub(super) fn rotates(matrix: &Matrix3) -> Result<(), Fault> {
    const DIGITS: f64 = 1e-6;
    let difference = (matrix.tr_mul(matrix) - Matrix3::identity()).amax();
    // NaN is no rotation either.
    if difference < DIGITS && matrix.determinant() > 0.0 { Ok(()) } else { Err(Fault::Rotation) }
}
