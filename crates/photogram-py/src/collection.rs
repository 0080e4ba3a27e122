//! Collections of photos; its documentation is in `_photocore.pyi`.

use numpy::{PyArray1, PyArray2, PyArray3, PyReadonlyArrayDyn};
use photocore::adjustment::{Criterion, Options as AdjustmentOptions};
use photocore::geometry::{BundlerPhoto, ObjectSpace, Point as GroundPoint};
use photocore::programs::collection::{Collection, CollectionError as Failure};
use photocore::programs::collection::{Image, Options, Photo, Point, Solution};
use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{check_lengths, indices, rows, squares, table};
use crate::block::watched;
use crate::options::{named_loss, named_ordering};
use crate::solution::{
    IterationRow, image_table, image_weights, iteration_row, operations, predictions, seconds, status_name,
};

create_exception!(
    _photocore,
    CollectionError,
    PyException,
    "The collection cannot be adjusted: (kind, message, photos, points)."
);

/// Adds the functions and classes to the extension module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("CollectionError", module.py().get_type::<CollectionError>())?;
    module.add_class::<CollectionSolution>()?;
    module.add_function(wrap_pyfunction!(read_numbers, module)?)?;
    module.add_function(wrap_pyfunction!(bundler_images, module)?)?;
    module.add_function(wrap_pyfunction!(adjust_collection, module)?)
}

#[pyfunction]
fn read_numbers<'py>(py: Python<'py>, text: &[u8]) -> (Bound<'py, PyArray1<f64>>, bool) {
    let number =
        |word: &[u8]| str::from_utf8(word).ok()?.parse().ok().filter(|value: &f64| value.is_finite());
    let (numbers, whole): (Vec<f64>, bool) = py.detach(|| {
        let mut words = text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        let mut numbers = Vec::new();
        let bad = words.find(|word| number(word).map(|value| numbers.push(value)).is_none());
        (numbers, bad.is_none())
    });
    (PyArray1::from_vec(py, numbers), whole)
}

#[pyfunction]
fn bundler_images<'py>(
    py: Python<'py>,
    photo_parameters: PyReadonlyArrayDyn<'py, f64>,
    points: PyReadonlyArrayDyn<'py, f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let parameters = rows("photo_parameters", &photo_parameters)?;
    let points = rows("points", &points)?;
    check_lengths(("points", points.len()), &[("photo_parameters", parameters.len())])?;
    let image = |(photo, point)| {
        BundlerPhoto::from_parameters(photo).project(&GroundPoint::new(ObjectSpace::Rectangular, point))
    };
    let images = py.detach(|| parameters.into_iter().zip(points).map(image).collect());
    table(py, images)
}

#[pyfunction]
#[pyo3(signature = (
    photo_parameters, photo_sd, point_positions, point_sd, image_photos, image_points, image_xy, image_sd, *, decrease,
    max_iterations, covariance, loss, ordering, threads, memory, progress
))]
fn adjust_collection(
    py: Python<'_>,
    photo_parameters: PyReadonlyArrayDyn<'_, f64>,
    photo_sd: PyReadonlyArrayDyn<'_, f64>,
    point_positions: PyReadonlyArrayDyn<'_, f64>,
    point_sd: PyReadonlyArrayDyn<'_, f64>,
    image_photos: PyReadonlyArrayDyn<'_, i64>,
    image_points: PyReadonlyArrayDyn<'_, i64>,
    image_xy: PyReadonlyArrayDyn<'_, f64>,
    image_sd: PyReadonlyArrayDyn<'_, f64>,
    decrease: f64,
    max_iterations: usize,
    covariance: bool,
    loss: Option<(&str, f64)>,
    ordering: &str,
    threads: usize,
    memory: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<CollectionSolution> {
    let parameters = rows("photo_parameters", &photo_parameters)?;
    let sd = rows("photo_sd", &photo_sd)?;
    check_lengths(("photo_parameters", parameters.len()), &[("photo_sd", sd.len())])?;
    let photos = parameters.into_iter().zip(sd).map(|(parameters, sd)| Photo { parameters, sd }).collect();
    let positions = rows("point_positions", &point_positions)?;
    let sd = rows("point_sd", &point_sd)?;
    check_lengths(("point_positions", positions.len()), &[("point_sd", sd.len())])?;
    let points = positions.into_iter().zip(sd).map(|(position, sd)| Point { position, sd }).collect();
    let photos_of = indices("image_photos", &image_photos)?;
    let points_of = indices("image_points", &image_points)?;
    let xy = rows("image_xy", &image_xy)?;
    let sd = rows("image_sd", &image_sd)?;
    check_lengths(
        ("image_xy", xy.len()),
        &[("image_photos", photos_of.len()), ("image_points", points_of.len()), ("image_sd", sd.len())],
    )?;
    let image = |i: usize| Image { photo: photos_of[i], point: points_of[i], xy: xy[i], sd: sd[i] };
    let collection = Collection { photos, points, images: (0..xy.len()).map(image).collect() };
    let options = Options {
        adjustment: AdjustmentOptions {
            criterion: Criterion::Decrease(decrease),
            max_iterations,
            covariance,
            loss: named_loss(loss)?,
        },
        ordering: named_ordering(ordering)?,
        memory,
    };
    let solution = watched(py, threads, progress, |pool, watch| collection.adjust(&options, pool, watch))?;
    solution.map(|solution| CollectionSolution { solution }).map_err(|error| match error {
        Failure::Index(_) => PyValueError::new_err(error.to_string()),
        error => CollectionError::new_err(failure(&error)),
    })
}

/// Kind, message, and the photos and points concerned.
type FailureRow = (&'static str, String, Vec<Vec<usize>>, Vec<usize>);

fn failure(error: &Failure) -> FailureRow {
    let (kind, photos, points) = match error {
        Failure::UndeterminedPoints(points) => ("undetermined points", vec![], points.clone()),
        Failure::UndeterminedPhotos(combinations) => ("undetermined photos", combinations.clone(), vec![]),
        Failure::Empty => ("empty", vec![], vec![]),
        Failure::NotFinite => ("not finite", vec![], vec![]),
        Failure::Memory { .. } | Failure::OutOfMemory(_) => ("memory", vec![], vec![]),
        Failure::Index(_) | Failure::Layout(_) | Failure::Interrupted => ("input", vec![], vec![]),
    };
    (kind, error.to_string(), photos, points)
}

/// An adjusted collection.
#[pyclass(frozen, module = "photogram._photocore")]
pub struct CollectionSolution {
    solution: Solution,
}

#[pymethods]
impl CollectionSolution {
    #[getter]
    fn status(&self) -> &'static str {
        status_name(self.solution.adjustment.status)
    }

    #[getter]
    fn initial_sum_of_squares(&self) -> f64 {
        self.solution.adjustment.initial_sum_of_squares
    }

    #[getter]
    fn iterations(&self) -> Vec<IterationRow> {
        self.solution.adjustment.iterations.iter().map(iteration_row).collect()
    }

    #[getter]
    fn photo_parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        table(py, self.solution.photos.iter().map(|photo| photo.parameters).collect())
    }

    #[getter]
    fn photo_cofactors<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        squares(py, self.solution.photos.iter().map(|photo| photo.cofactors).collect())
    }

    #[getter]
    fn photo_redundancy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        table(py, self.solution.photos.iter().map(|photo| photo.redundancy).collect())
    }

    #[getter]
    fn photo_images<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        PyArray1::from_vec(py, self.solution.photos.iter().map(|photo| photo.images as i64).collect())
    }

    #[getter]
    fn point_positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let missing = [f64::NAN; 3];
        table(py, self.solution.points.iter().map(|p| p.map_or(missing, |p| p.position)).collect())
    }

    #[getter]
    fn point_cofactors<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let missing = [[f64::NAN; 3]; 3];
        squares(py, self.solution.points.iter().map(|p| p.map_or(missing, |p| p.cofactors)).collect())
    }

    #[getter]
    fn point_redundancy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let missing = [f64::NAN; 3];
        table(py, self.solution.points.iter().map(|p| p.map_or(missing, |p| p.redundancy)).collect())
    }

    #[getter]
    fn point_rays<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        PyArray1::from_vec(py, self.solution.points.iter().map(|p| p.map_or(0, |p| p.rays as i64)).collect())
    }

    #[getter]
    fn point_rays_behind<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        let behind = self.solution.points.iter().map(|p| p.map_or(0, |p| p.behind as i64));
        PyArray1::from_vec(py, behind.collect())
    }

    #[getter]
    fn collapsed(&self) -> Vec<usize> {
        self.solution.collapsed.clone()
    }

    #[getter]
    fn residuals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        image_table(py, &self.solution.images, |image| image.residual)
    }

    #[getter]
    fn redundancy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        image_table(py, &self.solution.images, |image| image.redundancy)
    }

    #[getter]
    fn standardized<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        image_table(py, &self.solution.images, |image| image.standardized)
    }

    #[getter]
    fn image_weights<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        image_weights(py, &self.solution.images)
    }

    #[getter]
    fn sum_of_squares(&self) -> f64 {
        self.solution.sum_of_squares
    }

    #[getter]
    fn degrees_of_freedom(&self) -> i64 {
        self.solution.degrees_of_freedom
    }

    #[getter]
    fn variance_of_unit_weight(&self) -> Option<f64> {
        self.solution.variance_of_unit_weight
    }

    #[getter]
    fn datum(&self) -> Vec<(usize, usize)> {
        self.solution.datum.clone()
    }

    #[getter]
    fn undetermined(&self) -> Option<FailureRow> {
        self.solution.undetermined.as_ref().map(failure)
    }

    #[getter]
    fn counts(&self) -> (usize, usize, usize) {
        let counts = self.solution.adjustment.counts;
        (counts.observations, counts.weighted, counts.unknowns)
    }

    #[getter]
    fn ordering(&self) -> &'static str {
        self.solution.adjustment.ordering.name()
    }

    #[getter]
    fn predictions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        predictions(py, &self.solution.adjustment)
    }

    #[getter]
    fn operations<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        operations(py, &self.solution.adjustment)
    }

    #[getter]
    fn formations(&self) -> usize {
        self.solution.adjustment.formations
    }

    #[getter]
    fn seconds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        seconds(py, &self.solution.adjustment)
    }
}
