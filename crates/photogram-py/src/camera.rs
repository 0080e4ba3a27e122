//! Cameras by the names of their models; their documentation is in `_photocore.pyi`.

use numpy::{PyArray2, PyReadonlyArrayDyn};
use photocore::geometry::camera::{LensDirection, ModelFacts};
use photocore::geometry::{Camera, Unit};
use pyo3::prelude::*;

use crate::arrays::{InputError, numbers, rows, table};
use crate::options::unknown;

/// Adds the functions to the extension module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(camera_models, module)?)?;
    module.add_function(wrap_pyfunction!(camera_images, module)?)?;
    module.add_function(wrap_pyfunction!(camera_rays, module)?)?;
    module.add_function(wrap_pyfunction!(camera_correct, module)?)
}

/// Formula, parameters with the power of the unit of the image that they are measured in, how many of them, the last ones, are
/// constants, and the direction of the lens.
type Facts = (&'static str, Vec<(&'static str, i32)>, usize, &'static str);

#[pyfunction]
fn camera_models() -> Vec<(&'static str, Facts)> {
    let power = |unit: Unit| match unit {
        Unit::Image => 1,
        Unit::PerImage(power) => -i32::from(power),
        Unit::One => 0,
    };
    let facts = |&name: &&'static str| {
        let ModelFacts { formula, parameters, constants, lens } = Camera::model(name)?;
        let direction = match lens {
            LensDirection::Forward => "forward",
            LensDirection::Backward => "backward",
        };
        let parameters = parameters.iter().map(|&(name, unit)| (name, power(unit))).collect();
        Some((name, (formula, parameters, constants, direction)))
    };
    Camera::NAMES.iter().filter_map(facts).collect()
}

/// The camera of a model.
pub fn named(model: &str, parameters: &[f64]) -> PyResult<Camera> {
    let facts = Camera::model(model).ok_or_else(|| unknown("camera", model))?;
    Camera::named(model, parameters).ok_or_else(|| {
        let (given, needed) = (parameters.len(), facts.parameters.len());
        InputError::new_err(format!("the camera {model} has {needed} parameters, not {given}"))
    })
}

#[pyfunction]
fn camera_images<'py>(
    py: Python<'py>,
    model: &str,
    parameters: PyReadonlyArrayDyn<'py, f64>,
    u: PyReadonlyArrayDyn<'py, f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let camera = named(model, &numbers("parameters", &parameters)?)?;
    let images = rows("u", &u)?.into_iter().map(|u: [f64; 3]| camera.image(&u.into()));
    table(py, images.collect())
}

#[pyfunction]
fn camera_rays<'py>(
    py: Python<'py>,
    model: &str,
    parameters: PyReadonlyArrayDyn<'py, f64>,
    xy: PyReadonlyArrayDyn<'py, f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let camera = named(model, &numbers("parameters", &parameters)?)?;
    let ray = |xy: [f64; 2]| camera.direction(xy).map_or([f64::NAN; 3], Into::into);
    table(py, rows("xy", &xy)?.into_iter().map(ray).collect())
}

#[pyfunction]
fn camera_correct<'py>(
    py: Python<'py>,
    model: &str,
    parameters: PyReadonlyArrayDyn<'py, f64>,
    xy: PyReadonlyArrayDyn<'py, f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let camera = named(model, &numbers("parameters", &parameters)?)?;
    let corrected = |xy: [f64; 2]| {
        let refused =
            || InputError::new_err(format!("the camera {model} does not correct measured coordinates"));
        camera.correction(xy).ok_or_else(refused)
    };
    table(py, rows("xy", &xy)?.into_iter().map(corrected).collect::<PyResult<_>>()?)
}
