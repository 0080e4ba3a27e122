//! Initial values of photos and points; the documentation is in `_photocore.pyi`.

use numpy::PyArray1;
use photocore::geometry::{Matrix3, Pose, Vector3};
use photogram_programs::first_values::{
    FirstValues, FirstValuesError, Found, Frame, KnownPhoto, KnownPoint, Missing, Sighting, Source,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::{
    Array, Blocks, Indices, InputError, Matrix, blocks, check_lengths, from_rows, indices, matrices, numbers,
    row_major, rows, table,
};
use crate::work::{Workers, supervised};

/// Positions, attitudes, sources and reasons for missing poses of photos; positions of points; rejected observations; contradicted control;
/// the frame; the misfit.
type FoundRow<'py> = (
    Matrix<'py>,
    Blocks<'py>,
    Vec<(&'static str, usize, usize)>,
    Matrix<'py>,
    Bound<'py, PyArray1<bool>>,
    Bound<'py, PyArray1<bool>>,
    Option<usize>,
    Option<f64>,
);

#[pyfunction]
#[pyo3(signature = (
    photo_positions, photo_attitudes, observed_positions, observed_attitudes, point_positions, point_sd, image_photos, image_points,
    directions, direction_sd, *, threads
))]
pub fn find_first_values<'py>(
    py: Python<'py>,
    photo_positions: Array<'py>,
    photo_attitudes: Array<'py>,
    observed_positions: Array<'py>,
    observed_attitudes: Array<'py>,
    point_positions: Array<'py>,
    point_sd: Array<'py>,
    image_photos: Indices<'py>,
    image_points: Indices<'py>,
    directions: Array<'py>,
    direction_sd: Array<'py>,
    threads: usize,
) -> PyResult<FoundRow<'py>> {
    let positions = rows::<3>("photo_positions", &photo_positions)?;
    let attitudes = matrices::<3>("photo_attitudes", &photo_attitudes)?;
    let own_positions = rows::<3>("observed_positions", &observed_positions)?;
    let own_attitudes = matrices::<3>("observed_attitudes", &observed_attitudes)?;
    check_lengths(
        ("photo_positions", positions.len()),
        &[
            ("photo_attitudes", attitudes.len()),
            ("observed_positions", own_positions.len()),
            ("observed_attitudes", own_attitudes.len()),
        ],
    )?;
    let photo = |k: usize| KnownPhoto {
        pose: vector(positions[k])
            .zip(rotation(attitudes[k]))
            .map(|(position, attitude)| Pose { position, attitude }),
        position: vector(own_positions[k]),
        attitude: rotation(own_attitudes[k]),
    };
    let (coordinates, sd) = (rows("point_positions", &point_positions)?, rows("point_sd", &point_sd)?);
    check_lengths(("point_positions", coordinates.len()), &[("point_sd", sd.len())])?;
    let (photos, points) = (indices("image_photos", &image_photos)?, indices("image_points", &image_points)?);
    let seen = rows::<3>("directions", &directions)?;
    let seen_sd = numbers("direction_sd", &direction_sd)?;
    check_lengths(
        ("directions", seen.len()),
        &[("image_photos", photos.len()), ("image_points", points.len()), ("direction_sd", seen_sd.len())],
    )?;
    let sighting =
        |k: usize| Sighting { photo: photos[k], point: points[k], direction: seen[k].into(), sd: seen_sd[k] };
    let given = FirstValues {
        photos: (0..positions.len()).map(photo).collect(),
        points: coordinates
            .into_iter()
            .zip(sd)
            .map(|(coordinates, sd)| KnownPoint { coordinates, sd })
            .collect(),
        sightings: (0..seen.len()).map(sighting).collect(),
    };
    let workers = Workers::of(threads, given.sightings.len());
    match supervised(py, workers, None, |context| given.find(context))? {
        Ok(found) => row(py, found),
        Err(error @ FirstValuesError::Index(_)) => Err(InputError::new_err(error.to_string())),
        Err(error) => Err(PyValueError::new_err(error.to_string())),
    }
}

fn vector(values: [f64; 3]) -> Option<Vector3> {
    values.iter().all(|value| value.is_finite()).then(|| values.into())
}

fn rotation(values: [[f64; 3]; 3]) -> Option<Matrix3> {
    values.as_flattened().iter().all(|value| value.is_finite()).then(|| from_rows(values))
}

fn row(py: Python<'_>, found: Found) -> PyResult<FoundRow<'_>> {
    let (mut positions, mut attitudes, mut sources) = (vec![], vec![], vec![]);
    for pose in found.poses {
        match pose {
            Ok((Pose { position, attitude }, source)) => {
                positions.push(position.into());
                attitudes.push(row_major(&attitude));
                sources.push((name(source), 0, 0));
            }
            Err(missing) => {
                positions.push([f64::NAN; 3]);
                attitudes.push([[f64::NAN; 3]; 3]);
                sources.push(match missing {
                    Missing::Points(known) => ("points", known, 0),
                    Missing::Misfit(known) => ("misfit", known, 0),
                    Missing::Apart { photos, common } => ("apart", common, photos),
                });
            }
        }
    }
    let point = |at: &Option<Vector3>| at.map_or([f64::NAN; 3], Into::into);
    let frame = match found.frame {
        Frame::Known => None,
        Frame::FirstPhoto(photo) => Some(photo),
    };
    Ok((
        table(py, positions)?,
        blocks(py, attitudes)?,
        sources,
        table(py, found.points.iter().map(point).collect())?,
        PyArray1::from_vec(py, found.set_aside),
        PyArray1::from_vec(py, found.contradicted),
        frame,
        found.misfit,
    ))
}

fn name(source: Source) -> &'static str {
    match source {
        Source::Given => "given",
        Source::Resected => "resected",
        Source::Observed => "observed",
        Source::Oriented => "oriented",
    }
}
