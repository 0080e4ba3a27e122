//! Comparison of values and partials of all types with an independent program, if its files exist.

#![allow(clippy::unwrap_used)]

use nalgebra::DMatrix;
use serde_json::Value;

use super::assembled::ModelValues;
use super::rows::{CommonSite, PhotoSite, PointSite};
use super::{AssembledObservation, Named, Observation};
use crate::geometry::{Camera, Matrix3, ObjectSpace, Orientation, Perspective, Point, Vector3};
use crate::network::commons::{CartesianCommon, Common, CommonKind, CommonState, InBlock};
use crate::network::mounts::tests::mounted;
use crate::network::mounts::{AT_PHOTO, OnFrame, PoseInputs};

#[path = "../../../tests/golden/mod.rs"]
mod data;

use data::{golden, list, rows};

const SPACE: ObjectSpace = ObjectSpace::Rectangular;

fn matrix(value: &Value) -> Matrix3 {
    Matrix3::from_row_slice(&rows(value).concat())
}

fn orientation(block: &Value) -> Orientation {
    let position = list(&block["position"]).try_into().unwrap();
    Orientation::stepping(SPACE, position, &matrix(&block["matrix_photo_to_object"]))
}

fn state(kind: CommonKind, position: [f64; 3], attitude: Matrix3) -> CommonState {
    let sd = vec![1.0; kind.unknowns().len()];
    let common = Common { kind, position, attitude, sd };
    CartesianCommon::new(&common, SPACE, [0.0; 3], &Matrix3::identity()).at(&vec![0.0; common.sd.len()])
}

/// Returns the shared parameter of a block in a case, and the matching columns of its partials with their signs.
fn common(case: &Value, kind: &str, block: &Value) -> (CommonState, Vec<(usize, f64)>) {
    let plain = |kind: CommonKind, position: [f64; 3]| {
        let all = (0..kind.unknowns().len()).map(|k| (k, 1.0)).collect();
        (state(kind, position, Matrix3::identity()), all)
    };
    let value = || list(&block["value"]);
    let three = || value().try_into().unwrap();
    match kind {
        "distance with scale and constant" => plain(CommonKind::Instrument, [value()[0], value()[1], 0.0]),
        "equal height, unknown level" => plain(CommonKind::Level, [0.0, 0.0, value()[0]]),
        "point on plumb line" => plain(CommonKind::PlumbLine, [value()[0], value()[1], 0.0]),
        "point on plane" => {
            // n <- n + T tau: rotations about the second and first axes tilt the normal towards the first and second.
            let normal = Vector3::from_column_slice(&list(&case["normal"]));
            let basis = rows(&case["tangent_basis"]);
            let axis = |k: usize| Vector3::new(basis[0][k], basis[1][k], basis[2][k]);
            let handed = axis(0).cross(&axis(1)).dot(&normal).signum();
            let attitude = Matrix3::from_columns(&[axis(0), handed * axis(1), normal]);
            // The distance is relative to the origin, and so is the given position.
            let plane = state(CommonKind::Plane, [0.0; 3], attitude);
            (plane, vec![(2, 1.0), (1, -handed), (0, 1.0)])
        }
        "gnss" => match block["name"].as_str().unwrap() {
            "lever arm" => plain(CommonKind::LeverArm, three()),
            "shift" => plain(CommonKind::Shift, three()),
            _ => plain(CommonKind::Drift, three()),
        },
        _ => {
            let boresight = state(CommonKind::Boresight, [0.0; 3], matrix(&block["matrix"]));
            (boresight, vec![(0, 1.0), (1, 1.0), (2, 1.0)])
        }
    }
}

/// Returns the name of the type, its numbers, and whether the reference partials refer to the residual.
fn kind(case: &Value, blocks: &[Value]) -> Option<(&'static str, Vec<f64>, bool)> {
    let flat = |name: &str| rows(&case[name]).concat();
    let none = vec![0.0];
    Some(match case["kind"].as_str().unwrap() {
        "distance" | "distance with scale and constant" => ("distance", none, false),
        "coordinate difference" => ("difference", vec![0.0; 3], false),
        "height difference (equal height: observed 0)" => ("equal height", none, false),
        "equal height, unknown level" => ("on level", none, false),
        "point on plane" => ("on plane", vec![list(&blocks[1]["value"])[2]], false),
        "point on plumb line" => ("on plumb line", vec![], false),
        "control" => ("control", vec![0.0; 3], false),
        "gnss" => ("position", [vec![0.0; 6], vec![case["dt"].as_f64().unwrap()]].concat(), false),
        "imu attitude" => ("attitude", [flat("observed"), vec![0.0; 9]].concat(), true),
        "relative pose" => {
            let values = [list(&case["observed_translation"]), flat("observed_rotation")].concat();
            ("relative", values, true)
        }
        _ => return None,
    })
}

fn assert_close(found: f64, expected: f64, scale: f64, what: &str) {
    assert!((found - expected).abs() <= 1e-11 * scale.max(1.0), "{what}: {found} {expected}");
}

/// Compares one case of an additional observation.
fn assert_case(case: &Value) -> bool {
    let blocks = case["blocks"].as_array().unwrap();
    let what = case["kind"].as_str().unwrap();
    let Some((name, values, of_residual)) = kind(case, blocks) else { return false };
    let of_type = |kind: &'static str| blocks.iter().filter(move |block| block["type"] == kind);
    let points: Vec<[f64; 3]> =
        of_type("point").map(|block| list(&block["value"]).try_into().unwrap()).collect();
    let photos: Vec<Orientation> = of_type("pose").map(orientation).collect();
    let others = blocks.iter().filter(|block| block["type"] != "point" && block["type"] != "pose");
    let commons: Vec<(CommonState, Vec<(usize, f64)>)> =
        others.map(|block| common(case, what, block)).collect();
    let components = list(&case["computed"]).len();
    let indices = |count: usize| (0..count).collect::<Vec<usize>>();
    let mut named: Vec<Option<usize>> = indices(commons.len()).into_iter().map(Some).collect();
    if name == "distance" {
        named.resize(1, None);
    }
    let of = Named { points: &indices(points.len()), photos: &indices(photos.len()), commons: &named };
    let covariance = DMatrix::identity(components, components);
    let observation = Observation::from_numbers(name, &of, &values, covariance.clone()).unwrap();
    let touches = observation.touches();
    // Blocks in the order of the case.
    let (mut ours, mut next) = (vec![], [0, 100, 200]);
    for block in blocks {
        let which = ["point", "pose"].iter().position(|kind| block["type"] == *kind).unwrap_or(2);
        ours.push(next[which]);
        next[which] += 1;
    }
    let width = |block: usize| match block / 100 {
        0 => 3,
        1 => 6,
        _ => commons[block - 200].1.len(),
    };
    let active =
        AssembledObservation { index: 0, observation, touches, blocks: ours.clone(), root: covariance };
    let model = ModelValues {
        space: SPACE,
        origin: [0.0; 3],
        point: &|i| PointSite { point: Point::new(SPACE, points[i]), coordinates: points[i], block: i },
        photo: &|i| PhotoSite { orientation: &photos[i], block: 100 + i, made_of: None },
        moving: &|_| None,
        common: &|i| CommonSite { state: &commons[i].0, place: Some(InBlock::whole(200 + i, 0)) },
        width: &width,
    };
    let all: usize = ours.iter().map(|&block| width(block)).sum();
    let (mut constant, mut coefficients) = (vec![0.0; components], vec![0.0; components * all]);
    active.write(&model, &mut constant, &mut coefficients);
    for (row, expected) in list(&case["computed"]).into_iter().enumerate() {
        // Planes have observed distances from the origin; all other observed values are zero.
        let found = if of_residual { constant[row] } else { -constant[row] };
        assert_close(found, expected, expected.abs(), what);
    }
    let mut first = 0;
    for (block, own) in blocks.iter().zip(&ours) {
        let expected = rows(&block["partials"]);
        let same = (0..width(*own)).map(|k| (k, 1.0)).collect();
        let columns = if *own < 200 { &same } else { &commons[own - 200].1 };
        for (k, &(column, sign)) in columns.iter().enumerate() {
            // Partials of residuals have the opposite sign of partials of computed values.
            let sign = if of_residual { -sign } else { sign };
            for (row, expected) in expected.iter().enumerate() {
                let found = sign * coefficients[row * all + first + column];
                let largest = expected.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
                assert_close(found, expected[k], largest, &format!("{what}, {}", block["name"]));
            }
        }
        first += width(*own);
    }
    true
}

/// Compares the image of a rig.
fn assert_rig(case: &Value) {
    let blocks = case["blocks"].as_array().unwrap();
    let frame = orientation(&blocks[0]);
    let in_frame = list(&blocks[1]["position"]).try_into().unwrap();
    let sensor = state(CommonKind::Sensor, in_frame, matrix(&blocks[1]["matrix_photo_to_object"]));
    let mounts = mounted(OnFrame { photo: 1, frame: 0, sensor: 0 }.into(), 2);
    let common = |_| (std::borrow::Cow::Borrowed(&sensor), Some(InBlock::whole(2, 6)));
    let pose_inputs = PoseInputs { space: SPACE, mounts: &mounts, photo: &|_| frame, common: &common };
    let composed = pose_inputs.composed(1, AT_PHOTO).unwrap();
    let (photo, parts) = (composed.orientation, composed.parts());
    let point = Point::new(SPACE, list(&blocks[2]["value"]).try_into().unwrap());
    let camera = Camera::from(Perspective { principal_distance: case["c"].as_f64().unwrap() });
    let u = photo.to_camera_frame(&point);
    let image = camera.image(&u);
    let Camera::Perspective(own) = camera else { return };
    let found = photo.projection(&u, &crate::geometry::CameraModel::linearize(&own, &u), &point);
    let by_photo = nalgebra::Matrix2x6::from_fn(|i, k| found.photo[i][k]);
    let ours: Vec<_> = parts.iter().map(|(_, steps)| by_photo * steps).collect();
    for (row, expected) in list(&case["computed"]).into_iter().enumerate() {
        assert_close(image[row], expected, expected.abs(), "rig");
        for (own, block) in ours.iter().zip(blocks) {
            let expected = &rows(&block["partials"])[row];
            (0..6).for_each(|k| assert_close(own[(row, k)], expected[k], 1e3, "rig"));
        }
        let expected = &rows(&blocks[2]["partials"])[row];
        (0..3).for_each(|k| assert_close(found.point[row][k], expected[k], 10.0, "rig"));
    }
}

#[test]
fn every_kind_has_the_golden_values_and_partials() {
    let Some(file) = golden("ties.json") else { return };
    let cases = file["cases"].as_array().unwrap();
    let terms = cases.iter().filter(|case| assert_case(case)).count();
    cases.iter().filter(|case| case["kind"] == "image, rig").for_each(assert_rig);
    // Forward and backward images of fixed cameras belong to another module.
    assert_eq!((terms, cases.len()), (11, 15));
}
