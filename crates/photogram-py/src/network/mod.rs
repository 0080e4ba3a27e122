//! Networks of photos: blocks and collections; the documentation is in `_photocore.pyi`.

pub mod block;
pub mod block_network;
pub mod collection;
pub mod covariances;
pub mod first_values;
pub mod node;
pub mod snooping;
pub mod solution;
pub mod state;
pub mod suspects;
mod tables;
pub mod trial;

use photocore::Stopped;
use photocore::network::{Coarse, Combination, Image, NetworkError as Failure, Point, PosePart};
use pyo3::create_exception;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;

use crate::arrays::{Array, Indices, check_lengths, indices_in_place, rows_in_place};

create_exception!(
    _photocore,
    BlockError,
    PyException,
    "The block cannot be adjusted: (kind, message, combinations, points, seconds)."
);
create_exception!(
    _photocore,
    CollectionError,
    PyException,
    "The collection cannot be adjusted: (kind, message, combinations, points, seconds)."
);

/// Returns points with their standard deviations.
fn points(positions: &Array<'_>, sd: &Array<'_>) -> PyResult<Vec<Point>> {
    let coordinates = rows_in_place("point_positions", positions)?;
    let sd = rows_in_place("point_sd", sd)?;
    check_lengths(("point_positions", coordinates.len()), &[("point_sd", sd.len())])?;
    Ok(coordinates.iter().zip(&*sd).map(|(&coordinates, &sd)| Point { coordinates, sd }).collect())
}

/// Returns image observations: indices of their photos and points, coordinates and standard deviations.
fn images(
    photos: &Indices<'_>,
    points: &Indices<'_>,
    xy: &Array<'_>,
    sd: &Array<'_>,
) -> PyResult<Vec<Image>> {
    let photos = indices_in_place("image_photos", photos)?;
    let points = indices_in_place("image_points", points)?;
    let xy = rows_in_place("image_xy", xy)?;
    let sd = rows_in_place("image_sd", sd)?;
    check_lengths(
        ("image_xy", xy.len()),
        &[("image_photos", photos.len()), ("image_points", points.len()), ("image_sd", sd.len())],
    )?;
    let image =
        |i: usize| Image { photo: photos[i] as usize, point: points[i] as usize, xy: xy[i], sd: sd[i] };
    Ok((0..xy.len()).map(image).collect())
}

/// Members of an undetermined combination: photos, cameras, shared parameters, camera parameters, pose components.
type CombinationRow = (Vec<usize>, Vec<usize>, Vec<usize>, Vec<(usize, usize)>, Vec<&'static str>);

/// Code, message, and objects concerned: combinations, or photos in one combination; points; trajectory times in seconds (time, first and
/// last valid time).
type FailureRow = (&'static str, String, Vec<CombinationRow>, Vec<usize>, Vec<f64>);

/// Converts an error to a row for Python.
fn failure(error: &Failure, what: &str) -> FailureRow {
    let photos_alone = |photos: &[usize]| {
        vec![combination_row(&Combination { photos: photos.to_vec(), ..Combination::default() })]
    };
    let mut seconds = vec![];
    let (kind, combinations, points) = match error {
        Failure::NoIntersection(point) => ("no intersection", vec![], vec![*point]),
        Failure::UndeterminedPoints(points) => ("undetermined points", vec![], points.clone()),
        Failure::Undetermined(combinations) => {
            ("undetermined photos", combinations.iter().map(combination_row).collect(), vec![])
        }
        Failure::Coarse(Coarse { photos, points }) => ("coarse", photos_alone(photos), points.clone()),
        Failure::OutsideTrajectory { photo, point, time, first, last, .. } => {
            seconds = vec![*time, *first, *last];
            ("outside", photos_alone(&[*photo]), point.iter().copied().collect())
        }
        Failure::Empty => ("empty", vec![], vec![]),
        error if block_network::has_datum(error) => ("not free", vec![], vec![]),
        Failure::Datum(_) => ("datum", vec![], vec![]),
        Failure::LeftOut(point) => ("left out", vec![], vec![*point]),
        Failure::NotFinite => ("not finite", vec![], vec![]),
        Failure::Memory { .. } | Failure::Stopped(Stopped::OutOfMemory(_)) | Failure::Cofactors(_) => {
            ("memory", vec![], vec![])
        }
        Failure::Index(_)
        | Failure::NoCamera(_)
        | Failure::CameraDeviations(_)
        | Failure::CameraCovariance(_)
        | Failure::NoPhoto(_)
        | Failure::NoPoint(_)
        | Failure::CameraIndex(_)
        | Failure::NoCommon(_)
        | Failure::Partials { .. }
        | Failure::State
        | Failure::CommonDeviations(_)
        | Failure::Mount(_)
        | Failure::Trajectory(_)
        | Failure::ImageCorrection(_)
        | Failure::ImageTimes(_)
        | Failure::CameraConstant { .. }
        | Failure::Observation { .. }
        | Failure::Vectors
        | Failure::Attitude(_)
        | Failure::NoBlock(_)
        | Failure::Node(_)
        | Failure::Layout(_)
        | Failure::Stopped(_) => ("input", vec![], vec![]),
    };
    (kind, said(error, what), combinations, points, seconds)
}

fn combination_row(combination: &Combination) -> CombinationRow {
    let Combination { photos, cameras, commons, parameters, poses } = combination.clone();
    (photos, cameras, commons, parameters, poses.into_iter().map(PosePart::name).collect())
}

/// Returns the message of an error for a block or a collection.
fn said(error: &Failure, what: &str) -> String {
    match error {
        Failure::Index(image) => format!("image {image} names a photo or point that is not in the {what}"),
        error => error.to_string(),
    }
}
