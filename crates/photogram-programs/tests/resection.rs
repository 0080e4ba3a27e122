//! Resection of one photo: three points without initial values, partials of program W5344, degenerate configurations.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use photocore::adjustment::{Method, Options, Published, Status, Stop};
use photocore::geometry::{ObjectSpace, Point, RotationSense, Vector3, View, rotation};
use photocore::{Context, Threads};
use photogram_programs::resection::{
    ControlPoint, Degeneracy, Known, Partials, Pose, Resection, ResectionError, Solution,
    linearize_at_measured, three_points,
};

const C: f64 = -150.0;
const STRICT: Options = Options {
    method: Method::Damped(Stop::Fraction(1e-8)),
    max_iterations: 50,
    covariance: true,
    loss: None,
    threads: 0,
};

/// Returns deterministic numbers in [-1, 1).
fn noise(index: usize) -> f64 {
    let mut state = (index as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    for shift in [30, 27, 31] {
        state = (state ^ (state >> shift)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    }
    (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

fn noises<const N: usize>(index: usize) -> [f64; N] {
    std::array::from_fn(|k| noise(100 * index + k))
}

fn photo(pose: &Pose) -> View {
    View::new(ObjectSpace::Rectangular, RotationSense::GroundToPhoto, pose.position, pose.attitude, C)
}

/// Returns points observed from a pose, with errors of the image coordinates of the given size.
fn resection(pose: &Pose, points: &[[f64; 3]], error: f64) -> Resection {
    let photo = photo(pose);
    let control = |(index, &coordinates): (usize, &[f64; 3])| {
        let [x, y] = photo.project(&Point::new(ObjectSpace::Rectangular, coordinates));
        let [ex, ey] = noises(index + 7);
        let xy = [x + error * ex, y + error * ey];
        ControlPoint { coordinates, sd: [0.0; 3], xy, xy_sd: [0.005; 2] }
    };
    let unknown = Known { value: [f64::NAN; 3], sd: [f64::INFINITY; 3] };
    Resection {
        space: ObjectSpace::Rectangular,
        sense: RotationSense::GroundToPhoto,
        principal_distance: C,
        points: points.iter().enumerate().map(control).collect(),
        position: unknown,
        attitude: unknown,
        start: None,
        partials: Partials::AtComputed,
    }
}

fn apart(a: &Pose, b: &Pose) -> f64 {
    (Vector3::from(a.position) - Vector3::from(b.position)).norm()
}

fn adjust(resection: &Resection, options: &Options) -> Result<Solution, ResectionError> {
    let threads = Threads::new(1).unwrap();
    resection.adjust_on(options, &mut Context::new(&threads))
}

const POSE: Pose = Pose { position: [420.0, 310.0, 900.0], attitude: [0.05, -0.08, 2.1] };
const POINTS: [[f64; 3]; 6] = [
    [10.0, 20.0, 5.0],
    [820.0, 40.0, 60.0],
    [790.0, 640.0, 12.0],
    [30.0, 600.0, 90.0],
    [400.0, 330.0, 0.0],
    [120.0, 300.0, 40.0],
];

#[test]
fn three_points_give_every_place_they_are_seen_from() {
    for case in 0..2000 {
        let attitude = noises::<3>(case).map(|value| 3.0 * value);
        let centre: Vector3 = noises::<3>(case + 5000).map(|value| 50.0 * value).into();
        let m = rotation(attitude);
        // Points along three directions in front of the camera, at one to three units.
        let rays: [Vector3; 3] = std::array::from_fn(|i| {
            let [x, y, _] = noises::<3>(9000 + 3 * case + i);
            let length = (x * x + y * y + 1.0).sqrt();
            Vector3::new(x, y, -1.0) / length
        });
        let points: [Vector3; 3] = std::array::from_fn(|i| {
            let distance = 2.0 + noise(31 * case + i);
            centre + distance * m.tr_mul(&rays[i])
        });
        let found = three_points(&rays, &points);
        assert!((1..=4).contains(&found.len()), "case {case}: {} places", found.len());
        for (order, place) in found.iter().enumerate() {
            // The first solution is exact; near the danger cylinder others may be approximate.
            let least = if order == 0 { 1.0 - 1e-9 } else { 0.95 };
            for (ray, point) in rays.iter().zip(&points) {
                let u = place.to_photo * (point - place.centre);
                let cosine = u.dot(ray) / u.norm();
                assert!(cosine > least, "case {case}, place {order}: cosine {cosine}");
            }
        }
        let distance = |place: &photogram_programs::resection::Placement| (place.centre - centre).norm();
        let nearest = found.iter().map(distance).fold(f64::INFINITY, f64::min);
        assert!(nearest < 1e-4, "case {case}: the true place is missed by {nearest}");
    }
}

#[test]
fn symmetric_triangles_are_no_exception() {
    // Isosceles and equilateral triangles seen from the axis: determinants of the cones vanish.
    let root = 3f64.sqrt() / 2.0;
    let points = [[1.0, 0.0, 0.0], [-0.5, root, 0.0], [-0.5, -root, 0.0]].map(Vector3::from);
    for height in [0.5_f64, 1.0, 3.0] {
        let rays = points.map(|at| (at - height * Vector3::z()).normalize());
        let found = three_points(&rays, &points);
        let apart = |c: &Vector3| (c - height * Vector3::z()).norm();
        assert!(found.iter().any(|place| apart(&place.centre) < 1e-7), "height {height}: {found:?}");
    }
}

/// Returns the coefficients of the report's listing (specification, section 3), which has the angles first.
fn published(pose: &Pose, point: &[f64; 3], [px, py]: [f64; 2]) -> [[f64; 6]; 2] {
    let [(so, co), (sp, cp), (sk, ck)] = pose.attitude.map(f64::sin_cos);
    let m = rotation(pose.attitude);
    let d = Vector3::from(*point) - Vector3::from(pose.position);
    let (n32, n33) = (so * sp, -co * sp);
    let phi = [
        Vector3::new(-sp * ck, -ck * m[(2, 1)], -ck * m[(2, 2)]),
        Vector3::new(sp * sk, sk * m[(2, 1)], sk * m[(2, 2)]),
    ];
    let u = m * d;
    let r = 1.0 / u.z;
    let s = m[(2, 1)] * d[2] - m[(2, 2)] * d[1];
    let t = cp * d[0] + n32 * d[1] + n33 * d[2];
    let computed = [C * r * u.x, C * r * u.y];
    let kappa = [computed[1], -computed[0]];
    let row = |k: usize, plate: f64| {
        let omega = -r * (s * plate - C * (m[(k, 1)] * d[2] - m[(k, 2)] * d[1]));
        let by_phi = -r * (t * plate - C * phi[k].dot(&d));
        let position = |j: usize| r * (m[(2, j)] * plate - m[(k, j)] * C);
        [position(0), position(1), position(2), omega, by_phi, kappa[k]]
    };
    [row(0, px), row(1, py)]
}

#[test]
fn partials_at_the_measured_image_are_those_of_the_report() {
    for (point, measured) in POINTS.iter().zip([[60.0, -20.0], [-75.0, 3.0], [10.0, 88.0]]) {
        let at = Point::new(ObjectSpace::Rectangular, *point);
        let found = linearize_at_measured(&photo(&POSE), &at, measured);
        let expected = published(&POSE, point, measured);
        for (row, other) in found.photo.iter().zip(expected) {
            for (a, b) in row.iter().zip(other) {
                assert!((a - b).abs() < 1e-11 * (1.0 + b.abs()), "{found:?} {expected:?}");
            }
        }
        let same = linearize_at_measured(&photo(&POSE), &at, photo(&POSE).project(&at));
        assert_eq!(same.photo, photo(&POSE).linearize(&at).photo);
    }
}

#[test]
fn a_pose_is_found_without_initial_values() {
    let solution = adjust(&resection(&POSE, &POINTS, 0.0), &STRICT).unwrap();
    assert_eq!(solution.adjustment.status, Status::Converged);
    for k in 0..3 {
        assert!((solution.pose.position[k] - POSE.position[k]).abs() < 1e-8);
        assert!((solution.pose.attitude[k] - POSE.attitude[k]).abs() < 1e-11);
    }
    assert_eq!((solution.degrees_of_freedom, solution.alternatives.len()), (6, 0));
}

#[test]
fn the_rule_of_the_report_takes_full_steps_until_the_position_moves_little() {
    let mut published = resection(&POSE, &POINTS, 0.02);
    published.partials = Partials::AtMeasured;
    published.start = Some(Pose { position: [400.0, 300.0, 880.0], attitude: [0.0, 0.0, 2.0] });
    let method = Method::Full(Published::Length { first: 3 * POINTS.len(), count: 3, limit: 1e-3 });
    let solution = adjust(&published, &Options { method, ..STRICT }).unwrap();
    assert_eq!(solution.adjustment.status, Status::Converged);
    let steps: Vec<f64> = solution.history.windows(2).map(|pair| apart(&pair[1], &pair[0])).collect();
    let (last, before) = steps.split_last().unwrap();
    assert!(*last < 1e-3 && before.iter().all(|step| *step >= 1e-3), "{steps:?}");
    // The fixed point is the report's, A^T L = 0 with its own A: close to least squares, but different.
    let strict = adjust(&resection(&POSE, &POINTS, 0.02), &STRICT).unwrap();
    let size = apart(&solution.pose, &strict.pose);
    assert!(size > 1e-5 && size < 0.05, "{size}");
    let short = adjust(&published, &Options { method, max_iterations: 2, ..STRICT }).unwrap();
    assert_eq!((short.adjustment.status, short.history.len()), (Status::NotConverged, 2));
}

#[test]
fn degenerate_configurations_are_named() {
    let two = adjust(&resection(&POSE, &POINTS[..2], 0.0), &STRICT);
    assert_eq!(two.unwrap_err(), ResectionError::TooFewPoints(2));
    let line: Vec<[f64; 3]> = (0..5).map(|i| [100.0 * f64::from(i), 50.0 * f64::from(i), 10.0]).collect();
    assert_eq!(adjust(&resection(&POSE, &line, 0.0), &STRICT).unwrap_err(), ResectionError::Collinear);

    let started = |points: &[[f64; 3]], pose: &Pose| {
        let mut given = resection(pose, points, 0.0);
        given.start = Some(*pose);
        adjust(&given, &STRICT).unwrap_err()
    };
    let cylinder =
        Pose { position: [100.0 * 0.7f64.cos(), 100.0 * 0.7f64.sin(), 300.0], attitude: [0.02, 0.1, 0.3] };
    let circle = [0.0f64, 1.8, 3.9].map(|t| [100.0 * t.cos(), 100.0 * t.sin(), 0.0]);
    let undetermined = ResectionError::Undetermined;
    assert_eq!(started(&circle, &cylinder), undetermined(Degeneracy::DangerCylinder));
    assert_eq!(started(&line, &POSE), ResectionError::Collinear);
    assert_eq!(started(&POINTS[..2], &POSE), ResectionError::TooFewPoints(2));
}

#[test]
fn poses_that_fit_as_well_are_told() {
    // Above the centre of a triangle three points have four solutions.
    let circle = [0.0f64, 1.8, 3.9].map(|t| [100.0 * t.cos(), 100.0 * t.sin(), 0.0]);
    let pose = Pose { position: [0.0, 0.0, 300.0], attitude: [0.02, 0.03, 0.2] };
    let solution = adjust(&resection(&pose, &circle, 0.0), &STRICT).unwrap();
    let all = solution.alternatives.iter().map(|other| other.pose).chain([solution.pose]);
    assert_eq!(all.clone().count(), 4);
    let from = |other: Pose| apart(&other, &pose);
    assert!(all.map(from).fold(f64::INFINITY, f64::min) < 1e-6);
    assert!((solution.outside_danger_cylinder.unwrap()).abs() > 1.0);
}

#[test]
fn points_behind_the_camera_are_told_and_no_start_of_our_own_ends_there() {
    // Below the points and looking up, with images from above: the equations are satisfied.
    let mut start = POSE;
    start.position[2] = -900.0;
    let given = Resection { start: Some(start), ..resection(&POSE, &POINTS, 0.0) };
    let below = adjust(&given, &STRICT).unwrap();
    assert_eq!(below.adjustment.status, Status::Converged);
    assert_eq!(below.behind, (0..POINTS.len()).collect::<Vec<_>>());
    let above = adjust(&resection(&POSE, &POINTS, 0.0), &STRICT).unwrap();
    assert!(above.behind.is_empty());
}
