//! The adjusted block as arrays; its documentation is in `_photocore.pyi`.

use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use photocore::adjustment::{Adjustment, Iteration, Observed, Status};
use photocore::programs::Coarse;
use photocore::programs::block::{BlockError as Failure, Solution};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{squares, table};

/// Number, weighted sum of squares, largest change in standard deviations, damping.
pub type IterationRow = (usize, f64, f64, f64);

/// One iteration as Python sees it.
pub fn iteration_row(iteration: &Iteration) -> IterationRow {
    (iteration.number, iteration.sum_of_squares, iteration.largest_change, iteration.damping)
}

/// How an adjustment ended, as Python says it.
pub fn status_name(status: Status) -> &'static str {
    match status {
        Status::Converged => "converged",
        Status::NotConverged => "not converged",
        Status::Diverged => "diverged",
    }
}

/// An adjusted block.
#[pyclass(frozen, module = "photogram._photocore")]
pub struct BlockSolution {
    solution: Solution,
}

impl BlockSolution {
    pub fn new(solution: Solution) -> Self {
        Self { solution }
    }
}

#[pymethods]
impl BlockSolution {
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
    fn photo_corrections<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let iterations = &self.solution.photo_corrections;
        let values = iterations.iter().flatten().flatten().copied().collect();
        PyArray1::from_vec(py, values).reshape([iterations.len(), self.solution.photos.len(), 6])
    }

    #[getter]
    fn photo_positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        table(py, self.solution.photos.iter().map(|photo| photo.position).collect())
    }

    #[getter]
    fn photo_attitudes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        table(py, self.solution.photos.iter().map(|photo| photo.attitude).collect())
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
    fn point_positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let missing = [f64::NAN; 3];
        table(py, self.solution.points.iter().map(|p| p.map_or(missing, |p| p.coordinates)).collect())
    }

    #[getter]
    fn point_last_corrections<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let missing = [f64::NAN; 3];
        table(py, self.solution.points.iter().map(|p| p.map_or(missing, |p| p.last_correction)).collect())
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
    fn images_behind<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        PyArray1::from_vec(py, self.solution.behind.iter().map(|&image| image as i64).collect())
    }

    #[getter]
    fn undetermined(&self) -> Option<FailureRow> {
        self.solution.undetermined.as_ref().map(failure)
    }

    #[getter]
    fn redundancy_excess(&self) -> Option<f64> {
        self.solution.adjustment.redundancy_excess
    }

    #[getter]
    fn weak(&self) -> Vec<(usize, usize)> {
        self.solution.weak.clone()
    }

    #[getter]
    fn dropped(&self) -> Vec<(usize, &'static str)> {
        self.solution.dropped.iter().map(|dropped| (dropped.point, dropped.reason.name())).collect()
    }

    #[getter]
    fn sums_of_squares(&self) -> (f64, f64, f64) {
        let sums = self.solution.sums_of_squares;
        (sums.camera, sums.ground, sums.plates)
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
    fn photo_order<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        let order = &self.solution.adjustment.order;
        // A border of common unknowns is no photo.
        let photos = order.iter().filter(|&&block| block < self.solution.photos.len());
        PyArray1::from_vec(py, photos.map(|&photo| photo as i64).collect())
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

/// Predicted multiply-adds of a factorisation in each ordering that was tried.
pub fn predictions<'py>(py: Python<'py>, adjustment: &Adjustment) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for (ordering, operations) in &adjustment.predictions {
        dict.set_item(ordering.name(), operations)?;
    }
    Ok(dict)
}

/// Predicted multiply-adds of each phase.
pub fn operations<'py>(py: Python<'py>, adjustment: &Adjustment) -> PyResult<Bound<'py, PyDict>> {
    let operations = adjustment.operations;
    let dict = PyDict::new(py);
    dict.set_item("reduction", operations.reduction)?;
    dict.set_item("factor", operations.factor)?;
    dict.set_item("inverse", operations.inverse)?;
    Ok(dict)
}

/// Seconds spent in each phase.
pub fn seconds<'py>(py: Python<'py>, adjustment: &Adjustment) -> PyResult<Bound<'py, PyDict>> {
    let seconds = adjustment.seconds;
    let dict = PyDict::new(py);
    dict.set_item("form", seconds.form)?;
    dict.set_item("factor", seconds.factor)?;
    dict.set_item("solve", seconds.solve)?;
    dict.set_item("invert", seconds.invert)?;
    dict.set_item("cofactors", seconds.cofactors)?;
    Ok(dict)
}

/// Two numbers of every image as an (m, 2) array; NaN for images that were left out.
pub fn image_table<'py>(
    py: Python<'py>,
    images: &[Option<Observed<2>>],
    part: impl Fn(&Observed<2>) -> [f64; 2],
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let missing = [f64::NAN; 2];
    table(py, images.iter().map(|image| image.as_ref().map_or(missing, &part)).collect())
}

/// By how much a loss has changed the weight of every image, (m,); NaN for images that were left out.
pub fn image_weights<'py>(py: Python<'py>, images: &[Option<Observed<2>>]) -> Bound<'py, PyArray1<f64>> {
    let weights = images.iter().map(|image| image.map_or(f64::NAN, |image| image.weight));
    PyArray1::from_vec(py, weights.collect())
}

/// Kind, message, and the photos and points concerned.
pub type FailureRow = (&'static str, String, Vec<Vec<usize>>, Vec<usize>);

/// A failure as Python sees it.
pub fn failure(error: &Failure) -> FailureRow {
    let (kind, photos, points) = match error {
        Failure::NoIntersection(point) => ("no intersection", vec![], vec![*point]),
        Failure::UndeterminedPoints(points) => ("undetermined points", vec![], points.clone()),
        Failure::UndeterminedPhotos(combinations) => ("undetermined photos", combinations.clone(), vec![]),
        Failure::Coarse(Coarse { photos, points }) => ("coarse", vec![photos.clone()], points.clone()),
        Failure::Empty => ("empty", vec![], vec![]),
        Failure::NotFinite => ("not finite", vec![], vec![]),
        Failure::Memory { .. } | Failure::OutOfMemory(_) => ("memory", vec![], vec![]),
        Failure::Index(_) | Failure::Layout(_) | Failure::Interrupted => ("input", vec![], vec![]),
    };
    (kind, error.to_string(), photos, points)
}
