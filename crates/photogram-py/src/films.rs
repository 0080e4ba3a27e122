//! Readings of scanned films; the documentation is in `_photocore.pyi`.

use photocore::geometry::Vector3;
use photocore::network::film::{FilmAt, FilmOf, Read};
use pyo3::prelude::*;

use crate::arrays::{Array, Blocks, InputError, Matrix, blocks, numbers, rows, table};

/// Creates the film of given numbers; the vectors are its shared parameters in order.
fn film(film: &Array<'_>, vectors: &Array<'_>) -> PyResult<(FilmOf, FilmAt)> {
    let vectors = rows::<3>("vectors", vectors)?;
    let all: Vec<usize> = (0..vectors.len()).collect();
    let found = FilmOf::from_numbers(&all, &numbers("film", film)?).filter(FilmOf::is_sound);
    let found = found.ok_or_else(|| InputError::new_err("numbers and vectors are not those of a film"))?;
    let at = found.at(&|own| vectors.get(own).map(|&own| Vector3::from(own)));
    Ok((found, at))
}

/// Readings, and their partials with respect to position, t1 .. b2 and h or g, (n, 2, 10).
type ReadingsRow<'py> = (Matrix<'py>, Blocks<'py>);

#[pyfunction]
pub fn film_readings<'py>(
    py: Python<'py>,
    numbers: Array<'py>,
    vectors: Array<'py>,
    places: Array<'py>,
) -> PyResult<ReadingsRow<'py>> {
    let (own, at) = film(&numbers, &vectors)?;
    let places = rows::<2>("places", &places)?;
    let mut read = Read::default();
    let reading = |&place: &[f64; 2]| {
        at.read(place, own.cell(place), &mut read);
        read.reading
    };
    let found: Vec<_> = places.iter().map(reading).collect();
    let partials = found.iter().map(|own| {
        [0, 1].map(|row| {
            let parts = [&own.by_q[row][..], &own.by_film[row], &own.by_bend[row]];
            let mut all = parts.into_iter().flatten().copied();
            std::array::from_fn::<f64, 10, _>(|_| all.next().unwrap_or(f64::NAN))
        })
    });
    let partials = partials.collect();
    Ok((table(py, found.iter().map(|own| own.xy).collect())?, blocks(py, partials)?))
}

#[pyfunction]
pub fn film_places<'py>(
    py: Python<'py>,
    numbers: Array<'py>,
    vectors: Array<'py>,
    readings: Array<'py>,
) -> PyResult<Matrix<'py>> {
    let (_, at) = film(&numbers, &vectors)?;
    let place = |&xy: &[f64; 2]| at.place(xy, at.cell_of_reading(xy)).unwrap_or([f64::NAN; 2]);
    table(py, rows::<2>("readings", &readings)?.iter().map(place).collect())
}
