//! What an adjustment of a network has found, as arrays.

use std::sync::Arc;

use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use photocore::network::{AdjustedCamera, AdjustedPhoto, Reason, Solution};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::state::{BlockState, Kept, kept};
use super::tables::{Tables, Told};
use super::{FailureRow, failure};
use crate::arrays::table;
use crate::commons::{AdjustedRow as UnknownRow, adjusted_row as unknown_row};
use crate::observations::{AdjustedRow, adjusted_row};
use crate::solution::{IterationRow, iteration_row, operations, predictions, seconds, status_name};

/// Adds the classes to the extension module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<BlockState>()?;
    module.add_class::<BlockSolution>()?;
    module.add_class::<CollectionSolution>()
}

/// Cofactors of so many unknowns of each photo, (n, N, N); those of held ones are zero.
fn photo_cofactors<'py>(
    py: Python<'py>,
    photos: &[AdjustedPhoto],
    unknowns: usize,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let mut all = vec![0.0; photos.len() * unknowns * unknowns];
    for (photo, matrix) in photos.iter().zip(all.chunks_exact_mut(unknowns * unknowns)) {
        let own = photo.redundancy.len();
        // A block has the unknowns of cameras apart.
        let shown = own.min(unknowns);
        for (row, values) in photo.cofactors.as_slice().chunks_exact(own).take(shown).enumerate() {
            matrix[row * unknowns..][..shown].copy_from_slice(&values[..shown]);
        }
        if photo.cofactors[0].is_nan() {
            matrix.fill(f64::NAN);
        }
    }
    PyArray1::from_vec(py, all).reshape([photos.len(), unknowns, unknowns])
}

/// Redundancy numbers of so many unknowns of each photo, (n, N); those of held ones are zero.
fn photo_redundancy<'py>(
    py: Python<'py>,
    photos: &[AdjustedPhoto],
    unknowns: usize,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let mut all = vec![0.0; photos.len() * unknowns];
    for (photo, row) in photos.iter().zip(all.chunks_exact_mut(unknowns)) {
        let shown = photo.redundancy.len().min(unknowns);
        row[..shown].copy_from_slice(&photo.redundancy[..shown]);
        if photo.redundancy[0].is_nan() {
            row.fill(f64::NAN);
        }
    }
    PyArray1::from_vec(py, all).reshape([photos.len(), unknowns])
}

/// The points that were left out for a reason.
fn left_out(solution: &Solution, reason: Reason) -> Vec<usize> {
    let own = solution.dropped.iter().filter(|dropped| dropped.reason == reason);
    own.map(|dropped| dropped.point).collect()
}

/// Parameters, cofactors row by row, redundancy numbers, diagonal of the normal equations, photos and images of an adjusted camera.
type CameraRow = (Vec<f64>, Vec<f64>, Vec<f64>, Vec<f64>, usize, usize);

fn camera_row(camera: &AdjustedCamera) -> CameraRow {
    let AdjustedCamera { parameters, cofactors, redundancy, information, photos, images } = camera.clone();
    (parameters, cofactors.data.into(), redundancy, information, photos, images)
}

/// A class of adjusted networks: what all have, and what the class has besides.
macro_rules! solution_class {
    ($(#[$doc:meta])* $class:ident, $what:literal, { $($own:tt)* }) => {
        $(#[$doc])*
        #[pyclass(frozen, module = "photogram._photocore")]
        pub struct $class {
            pub solution: Solution,
            /// Of a photo: its pose, and its camera where that may be unknown.
            unknowns: usize,
            kept: Kept,
            tables: Tables,
        }

        impl $class {
            /// Of so many unknowns of a photo.
            pub fn new(py: Python<'_>, told: Told, unknowns: usize) -> PyResult<Self> {
                let (mut solution, tables) = told.tables(py)?;
                let kept = kept(&mut solution);
                Ok(Self { solution, unknowns, kept, tables })
            }
        }

        #[pymethods]
        impl $class {
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
            fn photo_cofactors<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
                photo_cofactors(py, &self.solution.photos, self.unknowns)
            }

            #[getter]
            fn photo_redundancy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
                photo_redundancy(py, &self.solution.photos, self.unknowns)
            }

            #[getter]
            fn point_positions(&self, py: Python<'_>) -> Py<PyArray2<f64>> {
                self.tables.point_positions.clone_ref(py)
            }

            #[getter]
            fn point_cofactors(&self, py: Python<'_>) -> Py<PyArray3<f64>> {
                self.tables.point_cofactors.clone_ref(py)
            }

            #[getter]
            fn point_redundancy(&self, py: Python<'_>) -> Py<PyArray2<f64>> {
                self.tables.point_redundancy.clone_ref(py)
            }

            #[getter]
            fn point_rays(&self, py: Python<'_>) -> Py<PyArray1<i64>> {
                self.tables.point_rays.clone_ref(py)
            }

            #[getter]
            fn residuals(&self, py: Python<'_>) -> Py<PyArray2<f64>> {
                self.tables.residuals.clone_ref(py)
            }

            #[getter]
            fn redundancy(&self, py: Python<'_>) -> Py<PyArray2<f64>> {
                self.tables.redundancy.clone_ref(py)
            }

            #[getter]
            fn standardized(&self, py: Python<'_>) -> Py<PyArray2<f64>> {
                self.tables.standardized.clone_ref(py)
            }

            #[getter]
            fn image_weights(&self, py: Python<'_>) -> Py<PyArray1<f64>> {
                self.tables.image_weights.clone_ref(py)
            }

            #[getter]
            fn redundancy_excess(&self) -> Option<f64> {
                self.solution.adjustment.redundancy_excess
            }

            #[getter]
            fn undetermined(&self) -> Option<FailureRow> {
                self.solution.undetermined.as_ref().map(|error| failure(error, $what))
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
                self.solution.adjustment.effort.ordering.name()
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
                self.solution.adjustment.effort.formations
            }

            #[getter]
            fn seconds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
                seconds(py, &self.solution.adjustment)
            }

            #[getter]
            fn state(&self) -> BlockState {
                let Solution { state, joint, .. } = &self.solution;
                BlockState { state: state.clone(), kept: Arc::clone(&self.kept), joint: joint.clone() }
            }

            #[getter]
            fn datum(&self) -> Vec<(usize, usize)> {
                self.solution.datum.held.clone()
            }

            #[getter]
            fn weak(&self) -> Vec<(usize, usize)> {
                self.solution.weak.photos.clone()
            }

            #[getter]
            fn weak_points(&self) -> Vec<(usize, f64, f64)> {
                self.solution.weak.points.iter().map(|weak| (weak.point, weak.ratio, weak.distance)).collect()
            }

            $($own)*
        }
    };
}

solution_class! {
    /// An adjusted block.
    BlockSolution, "block", {
        #[getter]
        fn relative_error(&self) -> f64 {
            self.solution.datum.relative_error
        }

        #[getter]
        fn minimal_control(&self) -> bool {
            self.solution.datum.minimal_control
        }

        #[getter]
        fn photo_corrections<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
            let (iterations, photos) = (&self.solution.photo_corrections, &self.solution.photos);
            let mut values = Vec::with_capacity(6 * iterations.len() * photos.len());
            for corrections in iterations {
                let mut rest = corrections.as_slice();
                for photo in photos {
                    let (own, others) = rest.split_at(photo.redundancy.len());
                    values.extend_from_slice(&own[..6]);
                    rest = others;
                }
            }
            PyArray1::from_vec(py, values).reshape([iterations.len(), photos.len(), 6])
        }

        #[getter]
        fn photo_positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
            let position = |photo: &AdjustedPhoto| std::array::from_fn::<_, 3, _>(|k| photo.pose[k]);
            table(py, self.solution.photos.iter().map(position).collect())
        }

        #[getter]
        fn photo_attitudes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
            let attitude = |photo: &AdjustedPhoto| std::array::from_fn::<_, 3, _>(|k| photo.pose[3 + k]);
            table(py, self.solution.photos.iter().map(attitude).collect())
        }

        #[getter]
        fn point_last_corrections(&self, py: Python<'_>) -> Py<PyArray2<f64>> {
            self.tables.point_last_corrections.clone_ref(py)
        }

        #[getter]
        fn images_behind<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
            PyArray1::from_vec(py, self.solution.unseen.behind.iter().map(|&image| image as i64).collect())
        }

        #[getter]
        fn images_folded<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
            PyArray1::from_vec(py, self.solution.unseen.folded.iter().map(|&image| image as i64).collect())
        }

        #[getter]
        fn loose_photos(&self) -> Vec<usize> {
            self.solution.state.loose.clone()
        }

        #[getter]
        fn weak_unknowns(&self) -> Vec<(usize, usize)> {
            self.solution.weak.commons.clone()
        }

        #[getter]
        fn adjusted_unknowns(&self) -> Vec<UnknownRow> {
            self.solution.commons.iter().map(unknown_row).collect()
        }

        #[getter]
        fn weak_cameras(&self) -> Vec<(usize, usize)> {
            self.solution.weak.cameras.clone()
        }

        #[getter]
        fn cameras(&self) -> Vec<CameraRow> {
            self.solution.cameras.iter().map(camera_row).collect()
        }

        #[getter]
        fn dropped(&self) -> Vec<(usize, &'static str)> {
            self.solution.dropped.iter().map(|dropped| (dropped.point, dropped.reason.name())).collect()
        }

        #[getter]
        fn sums_of_squares(&self) -> (f64, f64, f64, f64) {
            let sums = self.solution.sums_of_squares;
            (sums.camera, sums.ground, sums.plates, sums.observations)
        }

        #[getter]
        fn redundancies(&self) -> Option<(f64, f64, f64, f64)> {
            self.solution.redundancies.map(|own| (own.camera, own.ground, own.plates, own.observations))
        }

        #[getter]
        fn adjusted_observations(&self) -> Vec<Option<AdjustedRow>> {
            self.solution.observations.iter().map(|own| own.as_ref().map(adjusted_row)).collect()
        }

        #[getter]
        fn photo_order<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
            let order = &self.solution.adjustment.effort.order;
            // A camera, a point that stays or a mount is no photo.
            let photos = order.iter().filter(|&&block| block < self.solution.photos.len());
            PyArray1::from_vec(py, photos.map(|&photo| photo as i64).collect())
        }
    }
}

solution_class! {
    /// An adjusted collection.
    CollectionSolution, "collection", {
        #[getter]
        fn photo_parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
            let parameters = |photo: &AdjustedPhoto| [&photo.pose, photo.camera.as_slice()].concat();
            let all = self.solution.photos.iter().flat_map(parameters).collect();
            PyArray1::from_vec(py, all).reshape([self.solution.photos.len(), self.unknowns])
        }

        #[getter]
        fn photo_images<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
            PyArray1::from_vec(py, self.solution.photos.iter().map(|photo| photo.images as i64).collect())
        }

        #[getter]
        fn point_rays_behind(&self, py: Python<'_>) -> Py<PyArray1<i64>> {
            self.tables.point_rays_behind.clone_ref(py)
        }

        #[getter]
        fn collapsed(&self) -> Vec<usize> {
            [Reason::RanIntoStation, Reason::AtStation].map(|why| left_out(&self.solution, why)).concat()
        }

        #[getter]
        fn beside_stations(&self) -> Vec<usize> {
            left_out(&self.solution, Reason::NearStation)
        }

        #[getter]
        fn not_determined(&self) -> Vec<usize> {
            [Reason::NotDetermined, Reason::RanOff].map(|why| left_out(&self.solution, why)).concat()
        }

        #[getter]
        fn sum_of_squares(&self) -> f64 {
            self.solution.sums_of_squares.total()
        }
    }
}
