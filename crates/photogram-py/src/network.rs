//! Networks of photos: blocks and collections; their documentation is in `_photocore.pyi`.

use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArrayDyn};
use photocore::adjustment::{Criterion, Options as AdjustmentOptions};
use photocore::geometry::{Bal, BundlerPhoto, ObjectSpace, Perspective, Point as GroundPoint, PoseNumbers};
use photocore::network::{
    AdjustedPhoto, Camera, Coarse, Image, Network, NetworkError as Failure, Options, Photo, Point, Solution,
    Start, UnitVariance,
};
use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{check_lengths, indices, numbers, rows, squares, table};
use crate::geometry::{RefractionRow, object_space, refraction as refraction_of, rotation_sense};
use crate::observations::{AdjustedRow, Group, adjusted_row, observations};
use crate::options::{named_loss, named_ordering, unknown};
use crate::solution::{
    IterationRow, image_table, image_weights, iteration_row, operations, predictions, seconds, status_name,
};
use crate::work::{Workers, watched};

create_exception!(
    _photocore,
    BlockError,
    PyException,
    "The block cannot be adjusted: (kind, message, photos, points)."
);
create_exception!(
    _photocore,
    CollectionError,
    PyException,
    "The collection cannot be adjusted: (kind, message, photos, points)."
);

/// Adds the functions and classes to the extension module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("BlockError", module.py().get_type::<BlockError>())?;
    module.add("CollectionError", module.py().get_type::<CollectionError>())?;
    module.add_class::<BlockSolution>()?;
    module.add_class::<CollectionSolution>()?;
    module.add_function(wrap_pyfunction!(read_numbers, module)?)?;
    module.add_function(wrap_pyfunction!(bundler_images, module)?)?;
    module.add_function(wrap_pyfunction!(adjust_block, module)?)?;
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

/// Points with their standard deviations.
fn points(positions: &PyReadonlyArrayDyn<'_, f64>, sd: &PyReadonlyArrayDyn<'_, f64>) -> PyResult<Vec<Point>> {
    let coordinates = rows("point_positions", positions)?;
    let sd = rows("point_sd", sd)?;
    check_lengths(("point_positions", coordinates.len()), &[("point_sd", sd.len())])?;
    Ok(coordinates.into_iter().zip(sd).map(|(coordinates, sd)| Point { coordinates, sd }).collect())
}

/// Image points: indices of their photos and points, coordinates and standard deviations.
fn images(
    photos: &PyReadonlyArrayDyn<'_, i64>,
    points: &PyReadonlyArrayDyn<'_, i64>,
    xy: &PyReadonlyArrayDyn<'_, f64>,
    sd: &PyReadonlyArrayDyn<'_, f64>,
) -> PyResult<Vec<Image>> {
    let photos = indices("image_photos", photos)?;
    let points = indices("image_points", points)?;
    let xy = rows("image_xy", xy)?;
    let sd = rows("image_sd", sd)?;
    check_lengths(
        ("image_xy", xy.len()),
        &[("image_photos", photos.len()), ("image_points", points.len()), ("image_sd", sd.len())],
    )?;
    let image = |i: usize| Image { photo: photos[i], point: points[i], xy: xy[i], sd: sd[i] };
    Ok((0..xy.len()).map(image).collect())
}

#[pyfunction]
#[pyo3(signature = (
    photo_positions, photo_attitudes, photo_positions_observed, photo_attitudes_observed, photo_position_sd, photo_attitude_sd,
    principal_distances, point_positions, point_sd, image_photos, image_points, image_xy, image_sd, *, observation_groups, spheroid, photo_to_ground, refraction, criterion, limit, max_iterations,
    covariance, loss, ordering, unit_variance, threads, memory, progress
))]
fn adjust_block(
    py: Python<'_>,
    photo_positions: PyReadonlyArrayDyn<'_, f64>,
    photo_attitudes: PyReadonlyArrayDyn<'_, f64>,
    photo_positions_observed: PyReadonlyArrayDyn<'_, f64>,
    photo_attitudes_observed: PyReadonlyArrayDyn<'_, f64>,
    photo_position_sd: PyReadonlyArrayDyn<'_, f64>,
    photo_attitude_sd: PyReadonlyArrayDyn<'_, f64>,
    principal_distances: PyReadonlyArrayDyn<'_, f64>,
    point_positions: PyReadonlyArrayDyn<'_, f64>,
    point_sd: PyReadonlyArrayDyn<'_, f64>,
    image_photos: PyReadonlyArrayDyn<'_, i64>,
    image_points: PyReadonlyArrayDyn<'_, i64>,
    image_xy: PyReadonlyArrayDyn<'_, f64>,
    image_sd: PyReadonlyArrayDyn<'_, f64>,
    observation_groups: Vec<Group<'_>>,
    spheroid: Option<(f64, f64)>,
    photo_to_ground: bool,
    refraction: Option<RefractionRow>,
    criterion: &str,
    limit: f64,
    max_iterations: usize,
    covariance: bool,
    loss: Option<(&str, f64)>,
    ordering: &str,
    unit_variance: &str,
    threads: usize,
    memory: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<BlockSolution> {
    let positions = rows("photo_positions", &photo_positions)?;
    let attitudes = rows("photo_attitudes", &photo_attitudes)?;
    let positions_observed = rows("photo_positions_observed", &photo_positions_observed)?;
    let attitudes_observed = rows("photo_attitudes_observed", &photo_attitudes_observed)?;
    let position_sd = rows("photo_position_sd", &photo_position_sd)?;
    let attitude_sd = rows("photo_attitude_sd", &photo_attitude_sd)?;
    let distances = numbers("principal_distances", &principal_distances)?;
    check_lengths(
        ("photo_positions", positions.len()),
        &[
            ("photo_attitudes", attitudes.len()),
            ("photo_positions_observed", positions_observed.len()),
            ("photo_attitudes_observed", attitudes_observed.len()),
            ("photo_position_sd", position_sd.len()),
            ("photo_attitude_sd", attitude_sd.len()),
            ("principal_distances", distances.len()),
        ],
    )?;
    let mut cameras: Vec<f64> = Vec::new();
    let photo = |i: usize| {
        if cameras.last() != Some(&distances[i]) {
            cameras.push(distances[i]);
        }
        Photo {
            pose: six(positions[i], attitudes[i]),
            observed: six(positions_observed[i], attitudes_observed[i]),
            sd: six(position_sd[i], attitude_sd[i]),
            camera: cameras.len() - 1,
        }
    };
    let photos = (0..positions.len()).map(photo).collect();
    let camera = |principal_distance| Camera::held(Perspective { principal_distance }.into());
    let network = Network {
        space: object_space(spheroid)?,
        poses: PoseNumbers::Angles(rotation_sense(photo_to_ground)),
        refraction: refraction.map(refraction_of).transpose()?,
        cameras: cameras.into_iter().map(camera).collect(),
        photos,
        points: points(&point_positions, &point_sd)?,
        images: images(&image_photos, &image_points, &image_xy, &image_sd)?,
        observations: observations(&observation_groups)?,
    };
    let criterion = match criterion {
        "fraction" => Criterion::Fraction(limit),
        "percent" => Criterion::Percent(limit),
        other => return Err(unknown("criterion", other)),
    };
    let options = Options {
        adjustment: AdjustmentOptions { criterion, max_iterations, covariance, loss: named_loss(loss)? },
        ordering: named_ordering(ordering)?,
        unit_variance: match unit_variance {
            "free" => UnitVariance::Free,
            "constrained" => UnitVariance::Constrained,
            "unity" => UnitVariance::Unity,
            other => return Err(unknown("unit_variance", other)),
        },
        start: Start::Intersected,
        hold_unused: false,
        memory,
    };
    let solution = adjusted(py, &network, &options, threads, progress)?;
    solution
        .map(|solution| BlockSolution { solution })
        .map_err(|error| BlockError::new_err(failure(&error, "block")))
}

fn six([a, b, c]: [f64; 3], [d, e, f]: [f64; 3]) -> [f64; 6] {
    [a, b, c, d, e, f]
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
    let photo =
        |(camera, ([a, b, c, d, e, f, ..], [p, q, r, s, t, u, ..])): (usize, (&[f64; 9], &[f64; 9]))| {
            let pose = [*a, *b, *c, *d, *e, *f];
            Photo { pose, observed: pose, sd: [*p, *q, *r, *s, *t, *u], camera }
        };
    let photos = parameters.iter().zip(&sd).enumerate().map(photo).collect();
    let camera = |([.., f, k1, k2], [.., a, b, c]): (&[f64; 9], &[f64; 9])| Camera {
        camera: Bal { focal_length: *f, radial: [*k1, *k2] }.into(),
        sd: vec![*a, *b, *c],
    };
    let network = Network {
        space: ObjectSpace::Rectangular,
        poses: PoseNumbers::Vectors,
        refraction: None,
        cameras: parameters.iter().zip(&sd).map(camera).collect(),
        photos,
        points: points(&point_positions, &point_sd)?,
        images: images(&image_photos, &image_points, &image_xy, &image_sd)?,
        observations: vec![],
    };
    let options = Options {
        adjustment: AdjustmentOptions {
            criterion: Criterion::Decrease(decrease),
            max_iterations,
            covariance,
            loss: named_loss(loss)?,
        },
        ordering: named_ordering(ordering)?,
        unit_variance: UnitVariance::Constrained,
        start: Start::Given,
        hold_unused: true,
        memory,
    };
    let solution = adjusted(py, &network, &options, threads, progress)?;
    solution.map(|solution| CollectionSolution { solution }).map_err(|error| match error {
        Failure::Index(_) => PyValueError::new_err(said(&error, "collection")),
        error => CollectionError::new_err(failure(&error, "collection")),
    })
}

fn adjusted(
    py: Python<'_>,
    network: &Network,
    options: &Options,
    threads: usize,
    progress: Option<Py<PyAny>>,
) -> PyResult<Result<Solution, Failure>> {
    let workers = Workers::of(threads, network.images.len());
    watched(py, workers, progress, |pool, watch| network.adjust(options, pool, watch))
}

/// Kind, message, and the photos and points concerned.
type FailureRow = (&'static str, String, Vec<Vec<usize>>, Vec<usize>);

/// A failure as Python sees it.
fn failure(error: &Failure, what: &str) -> FailureRow {
    let (kind, photos, points) = match error {
        Failure::NoIntersection(point) => ("no intersection", vec![], vec![*point]),
        Failure::UndeterminedPoints(points) => ("undetermined points", vec![], points.clone()),
        Failure::UndeterminedPhotos(combinations) => ("undetermined photos", combinations.clone(), vec![]),
        Failure::Coarse(Coarse { photos, points }) => ("coarse", vec![photos.clone()], points.clone()),
        Failure::Empty => ("empty", vec![], vec![]),
        Failure::NotFinite => ("not finite", vec![], vec![]),
        Failure::Memory { .. } | Failure::OutOfMemory(_) => ("memory", vec![], vec![]),
        Failure::Index(_)
        | Failure::NoCamera(_)
        | Failure::CameraDeviations(_)
        | Failure::SharedCamera(_)
        | Failure::Observation { .. }
        | Failure::Vectors
        | Failure::Layout(_)
        | Failure::Interrupted => ("input", vec![], vec![]),
    };
    (kind, said(error, what), photos, points)
}

/// What went wrong, in terms of what was given: a block or a collection.
fn said(error: &Failure, what: &str) -> String {
    match error {
        Failure::Index(image) => format!("image {image} names a photo or point that is not in the {what}"),
        error => error.to_string(),
    }
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
        for (row, values) in photo.cofactors.chunks_exact(own).enumerate() {
            matrix[row * unknowns..][..own].copy_from_slice(values);
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
        row[..photo.redundancy.len()].copy_from_slice(&photo.redundancy);
        if photo.redundancy[0].is_nan() {
            row.fill(f64::NAN);
        }
    }
    PyArray1::from_vec(py, all).reshape([photos.len(), unknowns])
}

/// A class of adjusted networks, `unknowns` to a photo: what all have, and what the class has besides.
macro_rules! solution_class {
    ($(#[$doc:meta])* $class:ident, $unknowns:literal, $what:literal, { $($own:tt)* }) => {
        $(#[$doc])*
        #[pyclass(frozen, module = "photogram._photocore")]
        pub struct $class {
            solution: Solution,
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
                photo_cofactors(py, &self.solution.photos, $unknowns)
            }

            #[getter]
            fn photo_redundancy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
                photo_redundancy(py, &self.solution.photos, $unknowns)
            }

            #[getter]
            fn point_positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
                let missing = [f64::NAN; 3];
                table(py, self.solution.points.iter().map(|p| p.map_or(missing, |p| p.coordinates)).collect())
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
                let rays = self.solution.points.iter().map(|p| p.map_or(0, |p| p.rays as i64));
                PyArray1::from_vec(py, rays.collect())
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

            $($own)*
        }
    };
}

solution_class! {
    /// An adjusted block.
    BlockSolution, 6, "block", {
        #[getter]
        fn photo_corrections<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
            let iterations = &self.solution.photo_corrections;
            let values = iterations.iter().flatten().copied().collect();
            PyArray1::from_vec(py, values).reshape([iterations.len(), self.solution.photos.len(), 6])
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
        fn point_last_corrections<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
            let missing = [f64::NAN; 3];
            table(py, self.solution.points.iter().map(|p| p.map_or(missing, |p| p.last_correction)).collect())
        }

        #[getter]
        fn images_behind<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
            PyArray1::from_vec(py, self.solution.behind.iter().map(|&image| image as i64).collect())
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
        fn sums_of_squares(&self) -> (f64, f64, f64, f64) {
            let sums = self.solution.sums_of_squares;
            (sums.camera, sums.ground, sums.plates, sums.observations)
        }

        #[getter]
        fn adjusted_observations(&self) -> Vec<Option<AdjustedRow>> {
            self.solution.observations.iter().map(|own| own.as_ref().map(adjusted_row)).collect()
        }

        #[getter]
        fn photo_order<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
            let order = &self.solution.adjustment.order;
            // A border of common unknowns is no photo.
            let photos = order.iter().filter(|&&block| block < self.solution.photos.len());
            PyArray1::from_vec(py, photos.map(|&photo| photo as i64).collect())
        }
    }
}

solution_class! {
    /// An adjusted collection.
    CollectionSolution, 9, "collection", {
        #[getter]
        fn photo_parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
            let parameters = |photo: &AdjustedPhoto| -> [f64; 9] {
                std::array::from_fn(|k| if k < 6 { photo.pose[k] } else { photo.camera[k - 6] })
            };
            table(py, self.solution.photos.iter().map(parameters).collect())
        }

        #[getter]
        fn photo_images<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
            PyArray1::from_vec(py, self.solution.photos.iter().map(|photo| photo.images as i64).collect())
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
        fn sum_of_squares(&self) -> f64 {
            self.solution.sums_of_squares.total()
        }

        #[getter]
        fn datum(&self) -> Vec<(usize, usize)> {
            self.solution.datum.clone()
        }
    }
}
