//! Input of a block adjustment: photos with their cameras, poses in angles.

use nalgebra::DMatrix;
use photocore::adjustment::{Method, Options as AdjustmentOptions, Published, Stop};
use photocore::geometry::PoseNumbers;
use photocore::network::{
    Camera, ImageCorrection, Minimum, Network, Options, Photo, Screens, Start, UnitVariance,
};
use pyo3::prelude::*;

use super::block_network::BlockNetwork;
use super::{images, points};
use crate::adjustment::{named_loss, named_ordering, unknown};
use crate::arrays::{Array, Indices, check_lengths, indices, numbers, rows};
use crate::camera::knotted;
use crate::commons::{CommonRow, MountRow, common, mount};
use crate::geometry::{RefractionRow, object_space, refraction as refraction_of, rotation_sense};
use crate::memory::LOADED;
use crate::observations::{Group, observations};
use crate::trajectories::{TimedRow, TrajectoryRow, on_trajectory, trajectory};

/// Model, parameters and standard deviations of a camera, covariance matrix of the weighted ones row by row, knots.
type CameraRow = (String, Vec<f64>, Vec<f64>, Option<Vec<f64>>, Option<Vec<f64>>);

fn camera((model, parameters, sd, covariance, knots): CameraRow) -> PyResult<Camera> {
    let square = |values: Vec<f64>| {
        let count = values.len().isqrt();
        DMatrix::from_row_iterator(count, count, values.into_iter().take(count * count))
    };
    Ok(Camera { covariance: covariance.map(square), ..Camera::new(knotted(&model, &parameters, knots)?, sd) })
}

/// Type; indices of shared parameters; indices of points, photos or cameras; numbers.
type PassageRow<'py> = (String, Vec<usize>, Vec<usize>, Array<'py>);

fn passage((kind, commons, of, values): PassageRow<'_>) -> PyResult<ImageCorrection> {
    let values = numbers("numbers of a passage", &values)?;
    ImageCorrection::from_numbers(&kind, &commons, &of, &values).ok_or_else(|| unknown("passage", &kind))
}

#[pyfunction]
#[pyo3(signature = (
    photo_positions, photo_attitudes, photo_positions_observed, photo_attitudes_observed, photo_position_sd, photo_attitude_sd,
    photo_cameras, cameras, point_positions, point_sd, image_photos, image_points, image_xy, image_sd, *, observation_groups, unknowns, mounts, trajectories, timed, image_times, passages, records, spheroid, photo_to_ground, refraction, criterion, limit, max_iterations,
    covariance, loss, ordering, unit_variance, minimum, memory, points_given
))]
pub fn block_network(
    photo_positions: Array<'_>,
    photo_attitudes: Array<'_>,
    photo_positions_observed: Array<'_>,
    photo_attitudes_observed: Array<'_>,
    photo_position_sd: Array<'_>,
    photo_attitude_sd: Array<'_>,
    photo_cameras: Indices<'_>,
    cameras: Vec<CameraRow>,
    point_positions: Array<'_>,
    point_sd: Array<'_>,
    image_photos: Indices<'_>,
    image_points: Indices<'_>,
    image_xy: Array<'_>,
    image_sd: Array<'_>,
    observation_groups: Vec<Group<'_>>,
    unknowns: Vec<CommonRow>,
    mounts: Vec<MountRow>,
    trajectories: Vec<TrajectoryRow<'_>>,
    timed: Vec<TimedRow>,
    image_times: Array<'_>,
    passages: Vec<PassageRow<'_>>,
    records: usize,
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
    minimum: Option<(usize, Option<(usize, usize)>)>,
    memory: Option<usize>,
    points_given: bool,
) -> PyResult<BlockNetwork> {
    let positions = rows("photo_positions", &photo_positions)?;
    let attitudes = rows("photo_attitudes", &photo_attitudes)?;
    let positions_observed = rows("photo_positions_observed", &photo_positions_observed)?;
    let attitudes_observed = rows("photo_attitudes_observed", &photo_attitudes_observed)?;
    let position_sd = rows("photo_position_sd", &photo_position_sd)?;
    let attitude_sd = rows("photo_attitude_sd", &photo_attitude_sd)?;
    let camera_of = indices("photo_cameras", &photo_cameras)?;
    check_lengths(
        ("photo_positions", positions.len()),
        &[
            ("photo_attitudes", attitudes.len()),
            ("photo_positions_observed", positions_observed.len()),
            ("photo_attitudes_observed", attitudes_observed.len()),
            ("photo_position_sd", position_sd.len()),
            ("photo_attitude_sd", attitude_sd.len()),
            ("photo_cameras", camera_of.len()),
        ],
    )?;
    let photo = |i: usize| Photo {
        pose: six(positions[i], attitudes[i]),
        observed: six(positions_observed[i], attitudes_observed[i]),
        sd: six(position_sd[i], attitude_sd[i]),
        camera: camera_of[i],
    };
    let photos = (0..positions.len()).map(photo).collect();
    let network = Network {
        space: object_space(spheroid)?,
        poses: PoseNumbers::Angles(rotation_sense(photo_to_ground)),
        refraction: refraction.map(refraction_of).transpose()?,
        cameras: cameras.into_iter().map(camera).collect::<PyResult<_>>()?,
        photos,
        points: points(&point_positions, &point_sd)?,
        images: images(&image_photos, &image_points, &image_xy, &image_sd)?,
        observations: observations(&observation_groups)?,
        commons: unknowns.into_iter().map(common).collect::<PyResult<_>>()?,
        // A trajectory precedes the sensors on it.
        mounts: timed
            .into_iter()
            .map(|own| on_trajectory(own).into())
            .chain(mounts.into_iter().map(mount))
            .collect(),
        trajectories: trajectories.into_iter().map(trajectory).collect::<PyResult<_>>()?,
        image_times: numbers("image_times", &image_times)?,
        image_corrections: passages.into_iter().map(passage).collect::<PyResult<_>>()?,
    };
    let method = match criterion {
        "fraction" => Method::Damped(Stop::Fraction(limit)),
        "percent" => Method::Full(Published::Percent(limit)),
        other => return Err(unknown("criterion", other)),
    };
    let options = Options {
        adjustment: AdjustmentOptions {
            method,
            max_iterations,
            covariance,
            loss: named_loss(loss)?,
            threads: 0,
        },
        ordering: named_ordering(ordering)?,
        unit_variance: match unit_variance {
            "free" => UnitVariance::Free,
            "constrained" => UnitVariance::Constrained,
            "unity" => UnitVariance::Unity,
            "redundancy" => UnitVariance::Redundancy,
            other => return Err(unknown("unit_variance", other)),
        },
        start: if points_given { Start::Given } else { Start::Intersected },
        hold_unused: false,
        memory,
        reserved: LOADED,
        minimum: minimum.map(|(photo, coordinate)| Minimum { photo, coordinate }),
        screens: Screens::default(),
        photo_corrections: true,
    };
    Ok(BlockNetwork { network, options, records })
}

fn six([a, b, c]: [f64; 3], [d, e, f]: [f64; 3]) -> [f64; 6] {
    [a, b, c, d, e, f]
}
