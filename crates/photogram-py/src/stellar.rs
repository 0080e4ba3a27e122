//! Stellar camera calibration; the documentation is in `_photocore.pyi`.

use nalgebra::Complex;
use numpy::{PyArray1, PyArrayMethods};
use photocore::Context;
use photocore::adjustment::{Method, Options as AdjustmentOptions, Stop};
use photocore::geometry::Camera as Lens;
use photogram_programs::sky::{Air, Station, pointing, pointing_angles};
use photogram_programs::stellar::{
    Agreement, Attitude, Axis, COMMON, Calibration, Camera, Decentering, Form, INTERIOR, Image, Kind,
    Observations, Options, Rows, Similarity, Star, StellarError as Failure, Tested, Tolerances, Weights,
    best_voted, hypotheses,
};
use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::adjustment::{iteration_row, status_name, unknown};
use crate::arrays::{
    Array, Indices, Matrix, Vector, blocks, check_lengths, from_rows, group_rows, indices, matrices, numbers,
    row_major, rows, table,
};
use crate::work::{Workers, supervised};

create_exception!(
    _photocore,
    StellarError,
    PyException,
    "The camera cannot be calibrated: (kind, message, indices of stars or parameters)."
);

/// Latitude (rad), constant of diurnal aberration (rad), temperature (K), pressure (mm of mercury).
type PlaceRow = (f64, f64, f64, f64);
/// Camera model without its values.
#[derive(FromPyObject)]
pub enum CameraKind {
    /// Plate camera: reference principal distance (None: scale first), Brown's decentering, common scale.
    #[pyo3(transparent)]
    Plate((Option<f64>, bool, bool)),
    /// Another model: name, common scale.
    #[pyo3(transparent)]
    Lens((String, bool)),
}

/// Attitude, standard coordinates, plate coordinates and weight of the axis.
type AxisRow = (usize, [f64; 2], [f64; 2], [[f64; 2]; 2]);

fn station((latitude, aberration, temperature, pressure): PlaceRow) -> Station {
    Station::new(latitude, aberration, Air::new(temperature, pressure))
}

fn kind(camera: CameraKind) -> PyResult<Kind> {
    let plate = |reference: Option<f64>, cartesian, common_scale| Kind {
        lens: None,
        form: reference.map_or(Form::ScaleFirst, Form::DistortionFirst),
        decentering: if cartesian { Decentering::Cartesian } else { Decentering::Polar },
        common_scale,
    };
    match camera {
        CameraKind::Plate((reference, cartesian, common_scale)) => {
            Ok(plate(reference, cartesian, common_scale))
        }
        CameraKind::Lens((model, common_scale)) => {
            let facts = Lens::model(&model).ok_or_else(|| unknown("camera", &model))?;
            let lens = crate::camera::named(&model, &vec![0.0; facts.parameters.len()])?;
            Ok(Kind { lens: Some(lens), ..plate(None, false, common_scale) })
        }
    }
}

/// Returns a plate camera or another model; the model must not have more parameters than fit.
fn camera_of(camera: CameraKind, interior: &Array<'_>) -> PyResult<Camera> {
    let kind = kind(camera)?;
    if kind.lens.as_ref().is_some_and(|lens| lens.parameter_names().len() > INTERIOR) {
        return Err(failure(&Failure::Lens));
    }
    Ok(Camera::new(&kind, fixed_size("interior", interior)?))
}

fn fixed_size<const N: usize>(name: &str, array: &Array<'_>) -> PyResult<[f64; N]> {
    let values = numbers(name, array)?;
    let count = values.len();
    values.try_into().map_err(|_| PyValueError::new_err(format!("{name} has {count} numbers, not {N}")))
}

#[pyfunction]
pub fn refraction<'py>(
    py: Python<'py>,
    zenith_distances: Array<'py>,
    temperature: f64,
    pressure: f64,
    tau: Array<'py>,
    observed: bool,
) -> PyResult<Vector<'py>> {
    let (air, tau) = (Air::new(temperature, pressure), fixed_size("tau", &tau)?);
    let angle = |&z: &f64| if observed { air.refraction(z, &tau).angle } else { z - air.observed(z, &tau) };
    let values = numbers("zenith_distances", &zenith_distances)?;
    Ok(PyArray1::from_vec(py, values.iter().map(angle).collect()))
}

#[pyfunction]
pub fn standard_coordinates<'py>(
    py: Python<'py>,
    places: Array<'py>,
    sidereal_times: Array<'py>,
    place: PlaceRow,
    tau: Array<'py>,
) -> PyResult<Matrix<'py>> {
    let (station, tau) = (station(place), fixed_size("tau", &tau)?);
    let (places, times) = (rows("places", &places)?, numbers("sidereal_times", &sidereal_times)?);
    check_lengths(("places", places.len()), &[("sidereal_times", times.len())])?;
    let all = places.iter().zip(&times);
    table(py, all.map(|(&place, &time)| station.standard(place, time, &tau).coordinates).collect())
}

#[pyfunction]
pub fn star_places<'py>(
    py: Python<'py>,
    standard: Array<'py>,
    sidereal_times: Array<'py>,
    place: PlaceRow,
    tau: Array<'py>,
) -> PyResult<Matrix<'py>> {
    let (station, tau) = (station(place), fixed_size("tau", &tau)?);
    let (standard, times) = (rows("standard", &standard)?, numbers("sidereal_times", &sidereal_times)?);
    check_lengths(("standard", standard.len()), &[("sidereal_times", times.len())])?;
    let all = standard.iter().zip(&times);
    table(py, all.map(|(&standard, &time)| station.place(standard, time, &tau)).collect())
}

#[pyfunction]
pub fn pointing_matrix<'py>(py: Python<'py>, angles: Array<'py>) -> PyResult<Matrix<'py>> {
    table(py, row_major(&pointing(fixed_size("angles", &angles)?)).to_vec())
}

#[pyfunction]
pub fn pointing_of_matrix<'py>(py: Python<'py>, matrix: Array<'py>) -> PyResult<Vector<'py>> {
    let matrix: Vec<[f64; 3]> = rows("matrix", &matrix)?;
    let matrix = matrix.try_into().map_err(|_| PyValueError::new_err("matrix does not have 3 rows"))?;
    Ok(PyArray1::from_vec(py, pointing_angles(&from_rows(matrix)).to_vec()))
}

#[pyfunction]
pub fn plate_images<'py>(
    py: Python<'py>,
    standard: Array<'py>,
    angles: Array<'py>,
    interior: Array<'py>,
    camera: CameraKind,
) -> PyResult<Matrix<'py>> {
    let camera = camera_of(camera, &interior)?;
    let attitude = Attitude::new(fixed_size("angles", &angles)?);
    let standard: Vec<[f64; 2]> = rows("standard", &standard)?;
    table(py, standard.iter().map(|&standard| camera.linearize(&attitude, standard).xy).collect())
}

#[pyfunction]
#[pyo3(signature = (xy, angles, interior, camera, *, tolerance, passes))]
pub fn plate_directions<'py>(
    py: Python<'py>,
    xy: Array<'py>,
    angles: Array<'py>,
    interior: Array<'py>,
    camera: CameraKind,
    tolerance: f64,
    passes: usize,
) -> PyResult<Matrix<'py>> {
    let camera = camera_of(camera, &interior)?;
    let attitude = Attitude::new(fixed_size("angles", &angles)?);
    let xy: Vec<[f64; 2]> = rows("xy", &xy)?;
    let direction = |&xy: &[f64; 2]| {
        let ([x, y], _, converged) = camera.undistorted(xy, tolerance, passes);
        let [xi, eta] = camera.standard(&attitude.matrix, [x, y]);
        [xi, eta, x, y, f64::from(u8::from(converged))]
    };
    table(py, xy.iter().map(direction).collect())
}

/// Input of a stellar calibration.
#[pyclass(frozen, module = "photogram._photocore")]
pub struct StellarProblem {
    calibration: Calibration,
}

#[pymethods]
impl StellarProblem {
    #[new]
    #[pyo3(signature = (
        *, station, camera, pointings, common, fixed, weighted, weighted_values, weight_root, star_places, star_catalogue,
        star_weights, star_fixed, image_stars, image_pointings, image_xy, image_weights, image_times, image_shifts, axis
    ))]
    fn new(
        station: PlaceRow,
        camera: CameraKind,
        pointings: Array<'_>,
        common: Array<'_>,
        fixed: Vec<bool>,
        weighted: Indices<'_>,
        weighted_values: Array<'_>,
        weight_root: Array<'_>,
        star_places: Array<'_>,
        star_catalogue: Array<'_>,
        star_weights: Array<'_>,
        star_fixed: Vec<bool>,
        image_stars: Indices<'_>,
        image_pointings: Indices<'_>,
        image_xy: Array<'_>,
        image_weights: Array<'_>,
        image_times: Array<'_>,
        image_shifts: Array<'_>,
        axis: Option<AxisRow>,
    ) -> PyResult<Self> {
        let places = rows("star_places", &star_places)?;
        let catalogue = rows("star_catalogue", &star_catalogue)?;
        let weights: Vec<[[f64; 2]; 2]> = matrices("star_weights", &star_weights)?;
        check_lengths(
            ("star_places", places.len()),
            &[
                ("star_catalogue", catalogue.len()),
                ("star_weights", weights.len()),
                ("star_fixed", star_fixed.len()),
            ],
        )?;
        let star = |i: usize| Star {
            place: places[i],
            catalogue: catalogue[i],
            weight: (weights[i][0][0] > 0.0).then_some(weights[i]),
            fixed: star_fixed[i],
        };
        let (stars_of, pointings_of) =
            (indices("image_stars", &image_stars)?, indices("image_pointings", &image_pointings)?);
        let (xy, plate) = (rows("image_xy", &image_xy)?, matrices("image_weights", &image_weights)?);
        let (times, shifts) = (numbers("image_times", &image_times)?, rows("image_shifts", &image_shifts)?);
        check_lengths(
            ("image_xy", xy.len()),
            &[
                ("image_stars", stars_of.len()),
                ("image_pointings", pointings_of.len()),
                ("image_weights", plate.len()),
                ("image_times", times.len()),
                ("image_shifts", shifts.len()),
            ],
        )?;
        let image = |i: usize| Image {
            star: stars_of[i],
            pointing: pointings_of[i],
            xy: xy[i],
            weight: plate[i],
            sidereal_time: times[i],
            shift: shifts[i],
        };
        let root = weight_root.as_array().iter().copied().collect();
        Ok(Self {
            calibration: Calibration {
                station: self::station(station),
                kind: kind(camera)?,
                pointings: rows("pointings", &pointings)?,
                common: fixed_size("common", &common)?,
                fixed,
                weights: Weights {
                    parameters: indices("weighted", &weighted)?,
                    values: numbers("weighted_values", &weighted_values)?,
                    root,
                },
                stars: (0..places.len()).map(star).collect(),
                images: (0..xy.len()).map(image).collect(),
                axis: axis.map(|(pointing, standard, xy, weight)| Axis { pointing, standard, xy, weight }),
            },
        })
    }

    #[pyo3(signature = (*, unit, fraction, max_iterations, covariance, threads, progress, whole=false))]
    fn adjust<'py>(
        &self,
        py: Python<'py>,
        unit: f64,
        fraction: f64,
        max_iterations: usize,
        covariance: bool,
        threads: usize,
        progress: Option<Py<PyAny>>,
        whole: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let method = Method::Damped(Stop::Fraction(fraction));
        let options = Options {
            adjustment: AdjustmentOptions { method, max_iterations, covariance, loss: None, threads: 0 },
            unit,
            whole,
        };
        let work = |context: &mut Context<'_>| self.calibration.adjust_on(&options, context);
        let solution = supervised(py, Workers::of(threads, self.calibration.images.len()), progress, work)?
            .map_err(|error| failure(&error))?;
        let found = observations(py, solution.observations)?;
        found.set_item("status", status_name(solution.adjustment.status))?;
        let iterations: Vec<_> = solution.adjustment.iterations.iter().map(iteration_row).collect();
        found.set_item("iterations", iterations)?;
        found.set_item("initial_sum_of_squares", solution.adjustment.initial_sum_of_squares)?;
        found.set_item("parameters", PyArray1::from_vec(py, solution.parameters))?;
        tests(&found, "axis", &[solution.axis_test])?;
        if let Some(cofactors) = solution.cofactors {
            let pointings = self.calibration.pointings.len();
            let own = PyArray1::from_vec(py, cofactors.own).reshape([pointings, 3, 3])?;
            let cross = PyArray1::from_vec(py, cofactors.cross).reshape([pointings, 3, COMMON])?;
            let common = PyArray1::from_vec(py, cofactors.common).reshape([COMMON, COMMON])?;
            found.set_item("pointing_cofactors", own)?;
            found.set_item("cross_cofactors", cross)?;
            found.set_item("common_cofactors", common)?;
        }
        if let Some((log_determinant, cofactors)) = solution.whole {
            self.set_whole(&found, log_determinant, cofactors)?;
        }
        Ok(found)
    }

    fn without_effect(&self, py: Python<'_>) -> PyResult<Vec<usize>> {
        let found = supervised(py, Workers::of(0, 0), None, |context| {
            self.calibration.without_effect(context.threads)
        })?;
        found.map_err(|error| failure(&error))
    }

    #[pyo3(signature = (*, refraction, distortion, passes))]
    fn correction<'py>(
        &self,
        py: Python<'py>,
        refraction: f64,
        distortion: f64,
        passes: usize,
    ) -> PyResult<Bound<'py, PyDict>> {
        let tolerances = Tolerances { refraction, distortion, passes };
        let correction = supervised(py, Workers::of(0, 0), None, |context| {
            self.calibration.correction(&tolerances, context.threads)
        })?;
        let correction = correction.map_err(|error| failure(&error))?;
        let found = PyDict::new(py);
        found.set_item("parameters", PyArray1::from_vec(py, correction.parameters))?;
        found.set_item("without_effect", correction.without_effect)?;
        self.set_whole(&found, correction.log_determinant, correction.cofactors)?;
        Ok(found)
    }

    #[pyo3(signature = (cofactors, *, refraction, distortion, passes))]
    fn residual_cycle<'py>(
        &self,
        py: Python<'py>,
        cofactors: Array<'py>,
        refraction: f64,
        distortion: f64,
        passes: usize,
    ) -> PyResult<Bound<'py, PyDict>> {
        let tolerances = Tolerances { refraction, distortion, passes };
        let cofactors: Vec<f64> = cofactors.as_array().iter().copied().collect();
        let found = self.calibration.residual_cycle(&tolerances, &cofactors);
        observations(py, found.map_err(|error| failure(&error))?)
    }

    fn equations<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        equations(py, &self.calibration.equations().map_err(|error| failure(&error))?)
    }

    fn axis_equations<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let rows = self.calibration.axis_equations().map_err(|error| failure(&error))?;
        equations(py, &rows.into_iter().collect::<Vec<_>>())
    }

    #[pyo3(signature = (*, refraction, distortion, passes))]
    fn published<'py>(
        &self,
        py: Python<'py>,
        refraction: f64,
        distortion: f64,
        passes: usize,
    ) -> PyResult<Bound<'py, PyDict>> {
        let tolerances = Tolerances { refraction, distortion, passes };
        let found = self.calibration.published(&tolerances).map_err(|error| failure(&error))?;
        let dict = equations(py, &found.iter().map(|image| image.rows).collect::<Vec<_>>())?;
        dict.set_item("standard", table(py, found.iter().map(|image| image.standard).collect())?)?;
        dict.set_item("undistorted", table(py, found.iter().map(|image| image.undistorted).collect())?)?;
        let unsettled = found.iter().enumerate().filter_map(|(i, image)| Some((i, image.unsettled?)));
        dict.set_item("unsettled", unsettled.collect::<Vec<_>>())?;
        Ok(dict)
    }

    fn directions<'py>(&self, py: Python<'py>) -> PyResult<Matrix<'py>> {
        table(py, self.calibration.directions().map_err(|error| failure(&error))?)
    }
}

impl StellarProblem {
    fn set_whole(&self, dict: &Bound<'_, PyDict>, log_determinant: f64, cofactors: Vec<f64>) -> PyResult<()> {
        let count = self.calibration.parameters();
        dict.set_item("log_determinant", log_determinant)?;
        dict.set_item("cofactors", PyArray1::from_vec(dict.py(), cofactors).reshape([count, count])?)
    }
}

/// Converts adjusted stars, images and axis to a dictionary.
fn observations<'py>(py: Python<'py>, found: Observations) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("places", table(py, found.places)?)?;
    dict.set_item("place_cofactors", blocks(py, found.place_cofactors)?)?;
    dict.set_item("place_inverses", blocks(py, found.place_inverses)?)?;
    dict.set_item("residuals", table(py, found.residuals)?)?;
    dict.set_item("axis_residual", found.axis_residual)?;
    dict.set_item("sums_of_squares", found.sums_of_squares)?;
    tests(&dict, "image", &found.image_tests)?;
    tests(&dict, "place", &found.place_tests)?;
    Ok(dict)
}

/// Converts discrepancies and partials to arrays; the second index is x or y.
fn equations<'py>(py: Python<'py>, all: &[Rows]) -> PyResult<Bound<'py, PyDict>> {
    let count = all.len();
    let dict = PyDict::new(py);
    dict.set_item("constant", table(py, all.iter().map(|rows| rows.constant).collect())?)?;
    dict.set_item("star", blocks(py, all.iter().map(|rows| rows.star).collect())?)?;
    let pointing = all.iter().flat_map(|rows| rows.pointing).collect::<Vec<_>>().into_flattened();
    dict.set_item("pointing", PyArray1::from_vec(py, pointing).reshape([count, 2, 3])?)?;
    let common = all.iter().flat_map(|rows| rows.common).collect::<Vec<_>>().into_flattened();
    dict.set_item("common", PyArray1::from_vec(py, common).reshape([count, 2, COMMON])?)?;
    Ok(dict)
}

fn tests(dict: &Bound<'_, PyDict>, name: &str, all: &[Tested]) -> PyResult<()> {
    let py = dict.py();
    dict.set_item(format!("{name}_redundancy"), table(py, all.iter().map(|t| t.redundancy).collect())?)?;
    dict.set_item(format!("{name}_standardized"), table(py, all.iter().map(|t| t.standardized).collect())?)
}

fn failure(error: &Failure) -> PyErr {
    let (kind, indices) = match error {
        Failure::UndeterminedStars(stars) => ("undetermined stars", stars.clone()),
        Failure::NotFinite(stars) => ("not finite", stars.clone()),
        Failure::Undetermined(combinations) => {
            let mut parameters = combinations.concat();
            parameters.sort_unstable();
            parameters.dedup();
            ("undetermined", parameters)
        }
        Failure::Weight(_) => ("weight", vec![]),
        Failure::Index(_) | Failure::Lens | Failure::Layout(_) | Failure::Stopped(_) => ("input", vec![]),
    };
    StellarError::new_err((kind, error.to_string(), indices))
}

#[pyfunction]
#[pyo3(signature = (images, stars, candidates, *, makers, tolerance, stretch, least, axis, limit, wanted))]
pub fn star_similarities<'py>(
    py: Python<'py>,
    images: Array<'py>,
    stars: Array<'py>,
    candidates: Indices<'py>,
    makers: usize,
    tolerance: f64,
    stretch: f64,
    least: f64,
    axis: Option<([f64; 2], f64)>,
    limit: f64,
    wanted: usize,
) -> PyResult<(usize, Matrix<'py>)> {
    let plane = |rows: Vec<[f64; 2]>| rows.into_iter().map(|[x, y]| Complex::new(x, y)).collect::<Vec<_>>();
    let (images, stars) = (plane(rows("images", &images)?), plane(rows("stars", &stars)?));
    let pairs: Vec<(usize, usize)> =
        group_rows("candidates", &candidates)?.into_iter().map(|[image, star]| (image, star)).collect();
    if pairs.iter().any(|&(image, star)| image >= makers.min(images.len()) || star >= stars.len()) {
        return Err(PyValueError::new_err("a candidate is no image and star"));
    }
    let axis = axis.map(|([x, y], radius)| (Complex::new(x, y), radius));
    let rule = Agreement { tolerance, stretch, least, axis };
    let (count, best) = py.detach(|| {
        let all = hypotheses(&images[..makers.min(images.len())], &stars, &pairs, &rule);
        (all.len(), best_voted(&all, &images, &stars, makers, limit, wanted))
    });
    let row = |each: &Similarity| [each.factor.re, each.factor.im, each.shift.re, each.shift.im];
    Ok((count, table(py, best.iter().map(row).collect())?))
}
