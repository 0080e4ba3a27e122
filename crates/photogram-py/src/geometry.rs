//! Geometry functions over the rows of arrays, features and nearest points; the documentation is in `_photocore.pyi`.

use crate::arrays::{
    Array, Blocks, InputError, Matrix, Vector, blocks, check_lengths, from_rows, matrices, numbers,
    row_major, rows, table,
};
use nalgebra::DMatrix;
use numpy::{PyArray1, PyArrayMethods, PyUntypedArrayMethods};
use photocore::geometry::angle_axis::rotation_angle_axis;
use photocore::geometry::{
    self, AirModel, Ellipsoid, GeometryError, ObjectSpace, Point, Refraction, RefractionOffset,
    RotationSense, Vector3, View, Water, WaterModel,
};
use photogram_programs::features::{Form, Measured, distance, measure};
use photogram_programs::nearest::nearest;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

#[pyfunction]
pub fn rotation_matrix<'py>(py: Python<'py>, angles: Array<'py>) -> PyResult<Blocks<'py>> {
    let angles = rows("angles", &angles)?;
    blocks(
        py,
        py.detach(|| angles.into_iter().map(|angles| row_major(&geometry::rotation(angles))).collect()),
    )
}

#[pyfunction]
pub fn rotation_angles<'py>(py: Python<'py>, matrices: Array<'py>) -> PyResult<Matrix<'py>> {
    let matrices = self::matrices("matrices", &matrices)?;
    let angles = |matrix| geometry::rotation_angles(&from_rows(matrix));
    table(py, py.detach(|| matrices.into_iter().map(angles).collect()))
}

#[pyfunction]
pub fn vector_rotations<'py>(py: Python<'py>, vectors: Array<'py>) -> PyResult<Blocks<'py>> {
    let vectors = rows("vectors", &vectors)?;
    let matrix = |vector: [f64; 3]| row_major(&geometry::angle_axis_rotation(&vector.into()));
    blocks(py, py.detach(|| vectors.into_iter().map(matrix).collect()))
}

#[pyfunction]
pub fn rotation_vectors<'py>(py: Python<'py>, matrices: Array<'py>) -> PyResult<Matrix<'py>> {
    let matrices = self::matrices("matrices", &matrices)?;
    let vector = |matrix| rotation_angle_axis(&from_rows(matrix)).into();
    table(py, py.detach(|| matrices.into_iter().map(vector).collect()))
}

#[pyfunction]
pub fn geographic_to_geocentric<'py>(
    py: Python<'py>,
    positions: Array<'py>,
    a: f64,
    b: f64,
) -> PyResult<Matrix<'py>> {
    let (positions, ellipsoid) = (rows("positions", &positions)?, ellipsoid((a, b))?);
    table(
        py,
        py.detach(|| positions.into_iter().map(|position| ellipsoid.geocentric(position).into()).collect()),
    )
}

#[pyfunction]
pub fn geocentric_to_geographic<'py>(
    py: Python<'py>,
    xyz: Array<'py>,
    a: f64,
    b: f64,
) -> PyResult<Matrix<'py>> {
    let (xyz, ellipsoid) = (rows("xyz", &xyz)?, ellipsoid((a, b))?);
    let geographic = |xyz: [f64; 3]| ellipsoid.geographic(xyz.into());
    table(py, py.detach(|| xyz.into_iter().map(geographic).collect()))
}

#[pyfunction]
#[pyo3(signature = (
    points, positions, attitudes, principal_distances, *, spheroid, photo_to_ground, refraction
))]
pub fn project<'py>(
    py: Python<'py>,
    points: Array<'py>,
    positions: Array<'py>,
    attitudes: Array<'py>,
    principal_distances: Array<'py>,
    spheroid: Option<(f64, f64)>,
    photo_to_ground: bool,
    refraction: Option<RefractionRow>,
) -> PyResult<Matrix<'py>> {
    let points: Vec<[f64; 3]> = rows("points", &points)?;
    let positions: Vec<[f64; 3]> = rows("positions", &positions)?;
    let attitudes: Vec<[f64; 3]> = rows("attitudes", &attitudes)?;
    let principal_distances = numbers("principal_distances", &principal_distances)?;
    check_lengths(
        ("points", points.len()),
        &[
            ("positions", positions.len()),
            ("attitudes", attitudes.len()),
            ("principal_distances", principal_distances.len()),
        ],
    )?;
    let space = object_space(spheroid)?;
    let sense = rotation_sense(photo_to_ground);
    let refraction = refraction.map(self::refraction).transpose()?;
    let image = |i: usize| {
        let photo = View::new(space, sense, positions[i], attitudes[i], principal_distances[i]);
        let point = Point::new(space, points[i]);
        match &refraction {
            None => photo.project(&point),
            Some(refraction) => {
                let offset = offset(refraction, space, (&photo, positions[i]), (&point, points[i]));
                photo.project(&point.with_offset(&offset))
            }
        }
    };
    table(py, py.detach(|| (0..points.len()).map(image).collect()))
}

#[pyfunction]
#[pyo3(signature = (points, positions, *, spheroid, refraction))]
pub fn refraction_shift<'py>(
    py: Python<'py>,
    points: Array<'py>,
    positions: Array<'py>,
    spheroid: Option<(f64, f64)>,
    refraction: RefractionRow,
) -> PyResult<Matrix<'py>> {
    let points: Vec<[f64; 3]> = rows("points", &points)?;
    let positions: Vec<[f64; 3]> = rows("positions", &positions)?;
    check_lengths(("points", points.len()), &[("positions", positions.len())])?;
    let space = object_space(spheroid)?;
    let refraction = self::refraction(refraction)?;
    let shift = |i: usize| {
        // The result is independent of the attitude.
        let photo = View::new(space, RotationSense::GroundToPhoto, positions[i], [0.0; 3], -1.0);
        let point = Point::new(space, points[i]);
        offset(&refraction, space, (&photo, positions[i]), (&point, points[i])).vector.into()
    };
    table(py, py.detach(|| (0..points.len()).map(shift).collect()))
}

/// Returns the lift of one point for one photo, each with its coordinates.
fn offset(
    refraction: &Refraction,
    space: ObjectSpace,
    (photo, position): (&View, [f64; 3]),
    (point, coordinates): (&Point, [f64; 3]),
) -> RefractionOffset {
    let at = |coordinates| refraction.vertical(space, coordinates);
    refraction.offset(&photo.orientation, &at(position), point, &at(coordinates))
}

/// Model of the air, model of the water, its level (linear unit), its refractive index, metres per linear unit.
pub type RefractionRow = (Option<String>, Option<String>, f64, f64, f64);

/// Converts a row to a refraction model.
pub fn refraction((air, water, level, index, metres_per_unit): RefractionRow) -> PyResult<Refraction> {
    let refused = |medium: &str, model: &str| {
        Err(PyValueError::new_err(format!("the refraction in {medium} cannot be {model:?}")))
    };
    let air = match air.as_deref() {
        None => None,
        Some("giant") => Some(AirModel::Giant),
        Some("standard") => Some(AirModel::Standard),
        Some(other) => return refused("air", other),
    };
    let water = match water.as_deref() {
        None => None,
        Some("giant") => Some(WaterModel::Giant),
        Some("snell") => Some(WaterModel::Snell),
        Some(other) => return refused("water", other),
    };
    let water = water.map(|model| Water::new(model, level, index).map_err(geometry_error)).transpose()?;
    Ok(Refraction { air, water, metres_per_unit, datum: 0.0 })
}

fn geometry_error(error: GeometryError) -> PyErr {
    PyValueError::new_err(error.to_string())
}

fn ellipsoid((a, b): (f64, f64)) -> PyResult<Ellipsoid> {
    Ellipsoid::new(a, b).map_err(geometry_error)
}

/// Returns the object space: geographic if a spheroid is given by its semi-axes.
pub fn object_space(spheroid: Option<(f64, f64)>) -> PyResult<ObjectSpace> {
    spheroid.map_or(Ok(ObjectSpace::Rectangular), |axes| ellipsoid(axes).map(ObjectSpace::Geographic))
}

/// Returns the direction of the rotation matrix.
pub fn rotation_sense(photo_to_ground: bool) -> RotationSense {
    if photo_to_ground { RotationSense::PhotoToGround } else { RotationSense::GroundToPhoto }
}

#[pyfunction]
#[pyo3(signature = (points, others, limit, but = None))]
pub fn nearest_points<'py>(
    py: Python<'py>,
    points: Array<'py>,
    others: Array<'py>,
    limit: f64,
    but: Option<Vec<i64>>,
) -> PyResult<Bound<'py, PyArray1<i64>>> {
    let (points, others) = (rows("points", &points)?, rows("others", &others)?);
    if let Some(but) = &but {
        check_lengths(("points", points.len()), &[("but", but.len())])?;
    }
    let but: Option<Vec<_>> = but.map(|but| but.into_iter().map(|k| usize::try_from(k).ok()).collect());
    let found = py.detach(|| nearest(&points, &others, limit, but.as_deref()));
    Ok(PyArray1::from_vec(py, found.into_iter().map(|k| k.map_or(-1, |k| k as i64)).collect()))
}

/// Names and whether they are lengths, values, covariance, deviations, test.
type FeatureRow<'py> =
    (Vec<(&'static str, bool)>, Vector<'py>, Matrix<'py>, Matrix<'py>, Option<(f64, usize)>);

#[pyfunction]
pub fn measured_feature<'py>(
    py: Python<'py>,
    kind: &str,
    points: Array<'py>,
    covariance: Array<'py>,
) -> PyResult<FeatureRow<'py>> {
    let points: Vec<Vector3> = rows("points", &points)?.into_iter().map(<Vector3>::from).collect();
    let covariance = match covariance.shape() {
        // The matrix is symmetric, so that row and column order are equivalent.
        &[n, m] => DMatrix::from_iterator(n, m, covariance.as_array().iter().copied()),
        _ => return Err(PyValueError::new_err("the covariance is no matrix")),
    };
    let found = py.detach(|| match (kind, points.as_slice()) {
        ("distance", &[from, to]) => Some(distance(&[from, to], &covariance)),
        _ => Form::named(kind).map(|form| measure(form, &points, &covariance)),
    });
    match found {
        None => Err(PyValueError::new_err(format!("there is no {kind} of {} points", points.len()))),
        Some(found) => row(py, found.map_err(|error| InputError::new_err(error.to_string()))?),
    }
}

fn row(py: Python<'_>, found: Measured) -> PyResult<FeatureRow<'_>> {
    let Measured { quantities, covariance, deviations, test } = found;
    let names = quantities.iter().map(|each| (each.name, each.is_length)).collect();
    let values = PyArray1::from_vec(py, quantities.iter().map(|each| each.value).collect());
    let (n, m) = covariance.shape();
    let covariance = PyArray1::from_slice(py, covariance.as_slice()).reshape([n, m])?;
    let deviations = deviations.iter().map(|each| [each.value, each.sd, each.axial, each.axial_sd]).collect();
    Ok((names, values, covariance, table(py, deviations)?, test.map(|test| (test.statistic, test.freedom))))
}
