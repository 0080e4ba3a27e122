//! Prior information of films, and readings of fiducial marks.

use nalgebra::{DMatrix, Vector3};

use super::{Fault, Named, ObservationInputs, ObservationModel, Precision, Rows, Touches};
use crate::network::commons::CommonKind;
use crate::network::film::{FilmOf, Read};

/// Prior values of some of t1, t2, theta, m, b1, b2 of the film of a photo; m is relative to the roll, if any.
///
/// `m - m_roll` has the partials 1 and -1; all others are parameters themselves.
#[derive(Debug, Clone, PartialEq)]
pub struct Film {
    /// A [`CommonKind::FilmPlacement`].
    pub placement: usize,
    /// A [`CommonKind::FilmSize`].
    pub size: usize,
    /// A [`CommonKind::Roll`].
    pub roll: Option<usize>,
    /// Observed components among the six.
    pub components: Vec<usize>,
    /// Observed values of the components.
    pub observed: Vec<f64>,
    /// Precision of the components.
    pub precision: Precision,
}

/// Index of m among the six.
const MEAN: usize = 3;

impl ObservationModel for Film {
    /// Values: numbers of the components, then their observed values.
    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let &[Some(placement), Some(size), roll] = of.commons else { return None };
        let (components, observed) = values.split_at_checked(covariance.nrows())?;
        Some(Self {
            placement,
            size,
            roll,
            components: components.iter().map(|&own| own as usize).collect(),
            observed: observed.to_vec(),
            precision: Precision::Covariance(covariance),
        })
    }

    fn touches(&self) -> Touches {
        let placement = (self.placement, Some(CommonKind::FilmPlacement));
        let own = Touches { commons: vec![placement], ..Touches::default() };
        own.and(Some(self.size), CommonKind::FilmSize).and(self.roll, CommonKind::Roll)
    }

    fn rows(&self) -> usize {
        self.components.len()
    }

    fn write(&self, inputs: &ObservationInputs<'_>, rows: &mut Rows<'_>) {
        for (row, (&component, observed)) in self.components.iter().zip(&self.observed).enumerate() {
            let (common, axis) = (component / 3, component % 3);
            let along = Vector3::ith(axis, 1.0).transpose();
            let mut computed = inputs.common(common).vector()[axis];
            rows.by_offset(row, common, &along);
            if component == MEAN && self.roll.is_some() {
                computed -= inputs.common(2).vector().x;
                rows.by_offset(row, 2, &-Vector3::x().transpose());
            }
            rows.residual(row, &[observed - computed]);
        }
    }

    fn check(&self) -> Result<(), Fault> {
        let known =
            self.components.iter().all(|&own| own < 6) && self.observed.len() == self.components.len();
        if known && self.observed.iter().all(|own| own.is_finite()) { Ok(()) } else { Err(Fault::NotFinite) }
    }
}

/// Reading of a fiducial mark: its position in the camera, transformed by film and scanner.
#[derive(Debug, Clone, PartialEq)]
pub struct Fiducial {
    /// Mark, a [`CommonKind::Fiducial`].
    pub mark: usize,
    /// Approximate position of the mark, in mm.
    pub near: [f64; 2],
    /// Film of the photo.
    pub film: FilmOf,
    /// Column and row, or x and y.
    pub reading: [f64; 2],
    /// Precision of the reading.
    pub precision: Precision,
}

impl ObservationModel for Fiducial {
    const ROWS: usize = 2;

    /// Indices: mark, then film (see [`crate::network::ImageCorrection`]); values: reading, approximate position, numbers of the film.
    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let commons: Vec<usize> = of.commons.iter().copied().collect::<Option<_>>()?;
        let (&[x, y, near_x, near_y], film) = values.split_first_chunk()?;
        let (&mark, commons) = commons.split_first()?;
        Some(Self {
            mark,
            near: [near_x, near_y],
            film: FilmOf::from_numbers(commons, film)?,
            reading: [x, y],
            precision: Precision::Covariance(covariance),
        })
    }

    fn touches(&self) -> Touches {
        let film = self.film.commons(self.film.cell(self.near));
        let all = film.into_iter().chain([(self.mark, CommonKind::Fiducial)]);
        Touches { commons: all.map(|(own, kind)| (own, Some(kind))).collect(), ..Touches::default() }
    }

    fn write(&self, inputs: &ObservationInputs<'_>, rows: &mut Rows<'_>) {
        let cell = self.film.cell(self.near);
        let commons = self.film.commons(cell);
        let numbered = |own: usize| commons.iter().position(|&(common, _)| common == own);
        let mark = inputs.common(commons.len()).vector();
        let film = self.film.at(&|own| Some(inputs.common(numbered(own)?).vector()));
        let mut read = Read::default();
        film.read([mark.x, mark.y], cell, &mut read);
        let residual = [0, 1].map(|k| self.reading[k] - read.reading.xy[k]);
        rows.residual(0, &residual);
        self.film.partials(&read, |slot, by| rows.by_offset(0, slot, by));
        let by_mark = read.reading.by_q.map(|[x, y]| [x, y, 0.0]);
        rows.by_offset(0, commons.len(), &nalgebra::Matrix2x3::from_row_slice(by_mark.as_flattened()));
    }

    fn check(&self) -> Result<(), Fault> {
        let finite = self.reading.iter().chain(&self.near).all(|value| value.is_finite());
        if finite && self.film.is_sound() { Ok(()) } else { Err(Fault::NotFinite) }
    }
}
