//! Readings of fiducial marks.

use nalgebra::DMatrix;

use super::{Fault, Named, ObservationModel, Precision, Rows, Sites, Touches};
use crate::network::commons::CommonKind;
use crate::network::film::{FilmOf, Read};

/// The reading of a fiducial mark: what the film and the scanner make of its place in the camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Fiducial {
    /// The mark, a [`CommonKind::Fiducial`].
    pub mark: usize,
    /// About where it is, mm.
    pub near: [f64; 2],
    /// The film of the photo.
    pub film: FilmOf,
    /// Column and row, or x and y.
    pub reading: [f64; 2],
    /// Of the same.
    pub precision: Precision,
}

impl ObservationModel for Fiducial {
    const NAME: &'static str = "fiducial";

    /// Of the mark, then of the film (see [`crate::network::Passage`]); the reading, about where the mark is, the numbers of the film.
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

    fn rows(&self) -> usize {
        2
    }

    fn precision(&self) -> Precision {
        self.precision.clone()
    }

    fn write(&self, sites: &Sites<'_>, rows: &mut Rows<'_>) {
        let cell = self.film.cell(self.near);
        let commons = self.film.commons(cell);
        let numbered = |own: usize| commons.iter().position(|&(common, _)| common == own);
        let mark = sites.common(commons.len()).vector();
        let film = self.film.at(&|own| Some(sites.common(numbered(own)?).vector()));
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

#[cfg(test)]
mod tests {
    use super::super::tests::{agrees, of_kind};
    use super::{CommonKind, Fiducial, FilmOf, Precision};
    use crate::geometry::film::Pattern;
    use crate::network::film::Readings;

    #[test]
    fn partials_agree_with_differences() {
        for (pattern, projective) in [(None, true), (Some(Pattern::Quadratic { half: 3.0 }), false)] {
            let film = FilmOf {
                placement: of_kind(CommonKind::FilmPlacement),
                size: of_kind(CommonKind::FilmSize),
                bend: (!projective).then(|| of_kind(CommonKind::FilmBend)),
                projective,
                roll: projective.then(|| of_kind(CommonKind::Roll)),
                scanner: of_kind(CommonKind::Scanner),
                curves: vec![],
                readings: Readings { pitch: 0.5, origin: [3.0, 4.0], down: projective, half_range: [9.0; 2] },
                weights: pattern.map_or(vec![], |_| vec![of_kind(CommonKind::Pattern)]),
                pattern,
                mirrored: projective,
            };
            let (mark, reading) = (of_kind(CommonKind::Fiducial), [3.2, 4.1]);
            let precision = Precision::Deviations(vec![0.1; 2]);
            agrees(&Fiducial { mark, near: [0.4, 0.2], film, reading, precision }.into());
        }
    }
}
