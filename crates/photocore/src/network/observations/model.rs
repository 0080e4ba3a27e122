//! Interface of an observation type.

use nalgebra::{DMatrix, RowVector3, SMatrix, SVector};

use super::precision::Fault;
use super::rows::{ObservationInputs, Rows};
use crate::geometry::{Matrix3, Vector3};
use crate::network::commons::CommonKind;

/// A type of observations of points, photos and shared parameters.
pub trait ObservationModel: Sized {
    /// Number of components, if it is the same for all observations of the type.
    const ROWS: usize = 1;

    /// Returns an observation from indices and numbers; None if their counts are wrong.
    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self>;

    /// Returns points, photos and shared parameters; [`ObservationModel::write`] refers to them by their index in these lists.
    fn touches(&self) -> Touches;

    /// Returns true if the observation depends on the motion of a photo on a trajectory: [`ObservationInputs::moving`].
    fn moves(&self) -> bool {
        false
    }

    /// Returns the number of components.
    fn rows(&self) -> usize {
        Self::ROWS
    }

    /// Returns the number of parameters of a shared parameter of any type, by its index in [`Touches::commons`].
    fn components(&self, _common: usize) -> usize {
        self.rows()
    }

    /// Writes observed minus computed, and the partials of the computed values.
    fn write(&self, inputs: &ObservationInputs<'_>, rows: &mut Rows<'_>);

    /// Returns, as rows, the axes of observed minus computed if it is a displacement of a position; None otherwise. A displacement is
    /// transformed with the network and does not define its datum (see [`crate::adjustment::Evaluated::carried`]).
    fn axes(&self, _sites: &ObservationInputs<'_>) -> Option<DMatrix<f64>> {
        None
    }

    /// Returns an error for invalid values.
    ///
    /// # Errors
    /// The first invalid value.
    fn check(&self) -> Result<(), Fault> {
        Ok(())
    }
}

/// Distinct indices into the network on which an observation depends; shared parameters with their required type, None for any.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Touches {
    /// Points.
    pub points: Vec<usize>,
    /// Photos.
    pub photos: Vec<usize>,
    /// Shared parameters.
    pub commons: Vec<(usize, Option<CommonKind>)>,
}

impl Touches {
    /// Returns a list of points.
    pub fn points(points: &[usize]) -> Self {
        Self { points: points.to_vec(), ..Self::default() }
    }

    /// Returns a list of photos.
    pub fn photos(photos: &[usize]) -> Self {
        Self { photos: photos.to_vec(), ..Self::default() }
    }

    /// Adds a shared parameter, if any.
    #[must_use]
    pub fn and(mut self, common: Option<usize>, kind: CommonKind) -> Self {
        self.commons.extend(common.map(|common| (common, Some(kind))));
        self
    }
}

/// Objects of an observation as indices into the network.
#[derive(Debug, Clone, Copy)]
pub struct Named<'a> {
    /// Points.
    pub points: &'a [usize],
    /// Photos.
    pub photos: &'a [usize],
    /// Shared parameters; None for optional ones.
    pub commons: &'a [Option<usize>],
}

/// A fixed quantity, or the index of a shared parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Quantity<T> {
    /// Value.
    Known(T),
    /// Index.
    Common(usize),
}

impl<T> Quantity<T> {
    /// Returns the shared parameter if it is given, else the fixed value.
    pub fn new(common: Option<usize>, known: T) -> Self {
        common.map_or(Self::Known(known), Self::Common)
    }

    /// Returns the index of a shared parameter.
    pub fn common(&self) -> Option<usize> {
        match self {
            Self::Known(_) => None,
            Self::Common(index) => Some(*index),
        }
    }

    /// Returns the fixed value.
    pub(super) fn known(&self) -> Option<&T> {
        match self {
            Self::Known(value) => Some(value),
            Self::Common(_) => None,
        }
    }

    /// Returns the fixed value, or that of the shared parameter.
    pub(in crate::network) fn value(self, of_common: impl FnOnce(usize) -> T) -> T {
        match self {
            Self::Known(value) => value,
            Self::Common(index) => of_common(index),
        }
    }
}

/// Returns three numbers from an index on; None if there are fewer.
pub(super) fn three(values: &[f64], first: usize) -> Option<[f64; 3]> {
    values.get(first..first + 3)?.try_into().ok()
}

/// Returns a matrix of nine numbers from an index on, row by row.
pub(super) fn nine(values: &[f64], first: usize) -> Option<Matrix3> {
    values.get(first..first + 9).map(Matrix3::from_row_slice)
}

/// Returns the standard deviation of an observation with one component.
pub(super) fn deviation(covariance: &DMatrix<f64>) -> f64 {
    covariance[(0, 0)].sqrt()
}

/// Writes the residual of an observed length of a vector, and its partials by an instrument. Returns the partials by the vector, m e.
pub(super) fn length(
    inputs: &ObservationInputs<'_>,
    rows: &mut Rows<'_>,
    vector: &Vector3,
    (observed, instrument): (f64, Option<usize>),
) -> RowVector3<f64> {
    let length = vector.norm();
    let instrument = instrument.map(|_| inputs.common(0).vector());
    let (scale, constant) = instrument.map_or((1.0, 0.0), |own| (own.x, own.y));
    rows.residual(0, &[observed - scale * length - constant]);
    if instrument.is_some() {
        rows.by_offset(0, 0, &RowVector3::new(length, 1.0, 0.0));
    }
    scale * (vector / length).transpose()
}

/// Writes the `selected` components (rows) of a point in the own axes of a plane or line, minus the estimated offsets.
///
/// own = R^T (P - p_0), with the partials R^T by P, and `[own]x` by a rotation of the axes about themselves.
pub(super) fn in_own_axes<const N: usize>(
    inputs: &ObservationInputs<'_>,
    rows: &mut Rows<'_>,
    selected: &SMatrix<f64, N, 3>,
    observed: &[f64; N],
) {
    let common = inputs.common(0);
    let own = common.own(&inputs.position(0));
    let residual = SVector::from(*observed) - selected * (own - common.offset());
    rows.residual(0, residual.as_slice());
    rows.by_position(0, 0, &(selected * common.attitude().transpose()));
    rows.by_offset(0, 0, &-selected);
    rows.by_turn(0, 0, &(selected * own.cross_matrix()));
}

/// Returns [`ObservationModel::axes`] of a point in some of the own axes of a plane or line.
pub(super) fn own_axes<const N: usize>(
    inputs: &ObservationInputs<'_>,
    selected: &SMatrix<f64, N, 3>,
) -> Option<DMatrix<f64>> {
    rows_of(&(selected * inputs.common(0).attitude().transpose()))
}

/// Returns axes as rows.
pub(super) fn rows_of<const N: usize>(axes: &SMatrix<f64, N, 3>) -> Option<DMatrix<f64>> {
    Some(DMatrix::from_iterator(N, 3, axes.iter().copied()))
}

/// Returns an error unless a matrix is a rotation within 1e-6.
pub(super) fn rotates(matrix: &Matrix3) -> Result<(), Fault> {
    const DIGITS: f64 = 1e-6;
    let difference = (matrix.tr_mul(matrix) - Matrix3::identity()).amax();
    // NaN also fails this test.
    if difference < DIGITS && matrix.determinant() > 0.0 { Ok(()) } else { Err(Fault::Rotation) }
}
