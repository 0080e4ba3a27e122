//! Cameras by model name, and readings of scanned films; the documentation is in `_photocore.pyi`.

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use photocore::geometry::camera::{LensDirection, ModelFacts, Patch, RadialLimit};
use photocore::geometry::{Camera, Unit, Vector3};
use photocore::network::film::{FilmAt, FilmOf, Read};
use pyo3::prelude::*;

use crate::adjustment::unknown;
use crate::arrays::{Array, Blocks, InputError, Matrix, blocks, numbers, rows, table, values};

/// Formula, parameters with the power of the image unit, number of constants (the last parameters), direction of the lens, and direction of
/// the second image coordinate.
type CameraFacts = (&'static str, Vec<(&'static str, i32)>, usize, &'static str, &'static str);

#[pyfunction]
pub fn camera_models() -> Vec<(&'static str, CameraFacts)> {
    let power = |unit: Unit| match unit {
        Unit::Image => 1,
        Unit::PerImage(power) => -i32::from(power),
        Unit::One => 0,
    };
    let facts = |&name: &&'static str| {
        let ModelFacts { formula, parameters, constants, lens, down } = Camera::model(name)?;
        let direction = match lens {
            LensDirection::Forward => "forward",
            LensDirection::Backward => "backward",
        };
        let parameters = parameters.iter().map(|&(name, unit)| (name, power(unit))).collect();
        Some((name, (formula, parameters, constants, direction, if down { "down" } else { "up" })))
    };
    Camera::NAMES.iter().filter_map(facts).collect()
}

/// Returns the camera of a model.
pub fn named(model: &str, parameters: &[f64]) -> PyResult<Camera> {
    let facts = Camera::model(model).ok_or_else(|| unknown("camera", model))?;
    Camera::named(model, parameters).ok_or_else(|| {
        let (given, needed) = (parameters.len(), facts.parameters.len());
        InputError::new_err(format!("the camera {model} has {needed} parameters, not {given}"))
    })
}

/// Returns the camera of a model with its knots, if any: dx, dy of each, row by row.
pub fn knotted(model: &str, parameters: &[f64], knots: Option<Vec<f64>>) -> PyResult<Camera> {
    let camera = named(model, parameters)?;
    let Some(knots) = knots else { return Ok(camera) };
    camera.with_knots(knots.as_chunks().0.into()).ok_or_else(|| {
        let needed = camera.knots().map_or(0, |own| 2 * own.len());
        InputError::new_err(format!("the camera {model} has {needed} values of knots, not {}", knots.len()))
    })
}

/// Returns the camera of Python arguments.
fn given(model: &str, parameters: &Array<'_>, knots: Option<&Array<'_>>) -> PyResult<Camera> {
    knotted(model, &numbers("parameters", parameters)?, knots.map(values))
}

#[pyfunction]
#[pyo3(signature = (model, parameters, u, knots=None))]
pub fn camera_images<'py>(
    py: Python<'py>,
    model: &str,
    parameters: Array<'py>,
    u: Array<'py>,
    knots: Option<Array<'py>>,
) -> PyResult<Matrix<'py>> {
    let camera = given(model, &parameters, knots.as_ref())?;
    let images = rows("u", &u)?.into_iter().map(|u: [f64; 3]| camera.image(&u.into()));
    table(py, images.collect())
}

#[pyfunction]
#[pyo3(signature = (model, parameters, xy, knots=None))]
pub fn camera_rays<'py>(
    py: Python<'py>,
    model: &str,
    parameters: Array<'py>,
    xy: Array<'py>,
    knots: Option<Array<'py>>,
) -> PyResult<Matrix<'py>> {
    let camera = given(model, &parameters, knots.as_ref())?;
    let ray = |xy: [f64; 2]| camera.direction(xy).map_or([f64::NAN; 3], Into::into);
    table(py, rows("xy", &xy)?.into_iter().map(ray).collect())
}

#[pyfunction]
pub fn camera_correct<'py>(
    py: Python<'py>,
    model: &str,
    parameters: Array<'py>,
    xy: Array<'py>,
) -> PyResult<Matrix<'py>> {
    let camera = named(model, &numbers("parameters", &parameters)?)?;
    let corrected = |xy: [f64; 2]| {
        let refused =
            || InputError::new_err(format!("the camera {model} does not correct measured coordinates"));
        camera.correction(xy).ok_or_else(refused)
    };
    table(py, rows("xy", &xy)?.into_iter().map(corrected).collect::<PyResult<_>>()?)
}

/// Images, and their partials with respect to u and to the parameters.
type PartialsRow<'py> = (Matrix<'py>, Blocks<'py>, Blocks<'py>);

#[pyfunction]
#[pyo3(signature = (model, parameters, u, knots=None))]
pub fn camera_partials<'py>(
    py: Python<'py>,
    model: &str,
    parameters: Array<'py>,
    u: Array<'py>,
    knots: Option<Array<'py>>,
) -> PyResult<PartialsRow<'py>> {
    let camera = given(model, &parameters, knots.as_ref())?;
    let images: Vec<_> = rows("u", &u)?.into_iter().map(|u: [f64; 3]| camera.linearize(&u.into())).collect();
    let by_u = images.iter().flat_map(|image| image.by_u).flat_map(<[f64; 3]>::from).collect();
    let by_parameters = images.iter().flat_map(|image| image.by_parameters.concat()).collect();
    let count = images.len();
    Ok((
        table(py, images.iter().map(|image| image.xy).collect())?,
        PyArray1::from_vec(py, by_u).reshape([count, 2, 3])?,
        PyArray1::from_vec(py, by_parameters).reshape([count, 2, camera.parameter_names().len()])?,
    ))
}

/// Knot indices and their weights per direction.
type Patches<'py> = (Bound<'py, PyArray2<i64>>, Matrix<'py>);

#[pyfunction]
pub fn camera_patches<'py>(
    py: Python<'py>,
    model: &str,
    parameters: Array<'py>,
    u: Array<'py>,
) -> PyResult<Patches<'py>> {
    let camera = given(model, &parameters, None)?;
    let patch = |u: [f64; 3]| {
        let refused = || InputError::new_err(format!("the camera {model} has no knots"));
        camera.patch(&u.into()).ok_or_else(refused)
    };
    let patches: Vec<Patch> = rows("u", &u)?.into_iter().map(patch).collect::<PyResult<_>>()?;
    let each = patches.first().map_or(0, |patch| patch.nodes * patch.nodes);
    // The sixth parameter is the number of columns.
    let columns = camera.parameters().get(5).map_or(0, |&columns| columns as usize);
    let (numbers, weights) = patches
        .iter()
        .flat_map(|patch| patch.knots(columns))
        .map(|(knot, weight)| (knot as i64, weight))
        .unzip();
    let shape = [patches.len(), each];
    Ok((PyArray1::from_vec(py, numbers).reshape(shape)?, PyArray1::from_vec(py, weights).reshape(shape)?))
}

#[pyfunction]
pub fn radial_domain(model: &str, parameters: Array<'_>) -> PyResult<Option<(f64, f64)>> {
    let camera = named(model, &numbers("parameters", &parameters)?)?;
    Ok(camera.radial_limit().map(|RadialLimit { radius, distorted }| (radius, distorted)))
}

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
