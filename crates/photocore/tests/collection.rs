//! Collections of photos: partials against complex steps, coarse initial values, datum and redundancy.

#![allow(clippy::unwrap_used, clippy::panic)]

use num_complex::Complex64 as C;
use photocore::adjustment::{self, Loss, Method, Status, Stop};
use photocore::geometry::{
    self, Bal, ObjectSpace, Orientation, Perspective, Point as GroundPoint, PoseNumbers, angle_axis_rotation,
    angle_axis_with_jacobian,
};
use photocore::network::{
    AdjustedPhoto, Camera, Coarse, Image, Network, NetworkError, Options, Photo, Point, Solution, Start,
};
use photocore::{Context, Threads};
use proptest::prelude::*;

use crate::noise;

/// Returns the rotated vector by the exponential series of the cross product, independent of closed forms.
fn turned(w: [C; 3], v: [C; 3]) -> [C; 3] {
    let cross = |a: [C; 3], b: [C; 3]| -> [C; 3] {
        std::array::from_fn(|k| a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3])
    };
    let (mut sum, mut term) = (v, v);
    for n in 1..60 {
        term = cross(w, term).map(|value| value / f64::from(n));
        sum = std::array::from_fn(|k| sum[k] + term[k]);
    }
    sum
}

fn image(unknowns: [C; 12]) -> [C; 2] {
    let [w1, w2, w3, t1, t2, t3, f, k1, k2, x, y, z] = unknowns;
    let r = turned([w1, w2, w3], [x, y, z]);
    let p = [-(r[0] + t1) / (r[2] + t3), -(r[1] + t2) / (r[2] + t3)];
    let square = p[0] * p[0] + p[1] * p[1];
    p.map(|value| f * (1.0 + k1 * square + k2 * square * square) * value)
}

/// Returns a photo with nine parameters: rotation vector, translation, f, k1, k2.
fn bal_photo([a, b, c, x, y, z, f, k1, k2]: [f64; 9]) -> geometry::View<Bal> {
    let orientation = Orientation::from_vectors([a, b, c].into(), [x, y, z].into());
    geometry::View { orientation, camera: Bal { parameters: [f, k1, k2] } }
}

fn ground(position: [f64; 3]) -> GroundPoint {
    GroundPoint::new(ObjectSpace::Rectangular, position)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    #[test]
    fn partials_are_those_of_complex_steps(
        axis in prop::array::uniform3(-1.0..1.0f64),
        angle in prop_oneof![Just(0.0), 1e-9..1e-3f64, 1e-3..0.4f64, 0.3..6.0f64],
        shift in prop::array::uniform2(-1.0..1.0f64),
        f in 300.0..3000.0f64,
        k in prop::array::uniform2(-0.3..0.3f64),
        point in prop::array::uniform3(-2.0..2.0f64),
    ) {
        let norm = axis.iter().map(|value| value * value).sum::<f64>().sqrt().max(1e-3);
        let w = axis.map(|value| angle * value / norm);
        let unknowns = [
            w[0], w[1], w[2], shift[0], shift[1], -10.0, f, k[0], k[1], point[0], point[1], point[2],
        ];
        let photo: [f64; 9] = std::array::from_fn(|i| unknowns[i]);
        let computed = bal_photo(photo).linearize(&ground(point));
        const STEP: f64 = 1e-100;
        for i in 0..12 {
            let mut stepped = unknowns.map(|value| C::new(value, 0.0));
            stepped[i].im = STEP;
            let expected = image(stepped);
            for row in 0..2 {
                let partial = match i {
                    0..6 => computed.photo[row][i],
                    6..9 => computed.camera[row][i - 6],
                    _ => computed.point[row][i - 9],
                };
                let scale = if i < 3 { f } else { f / 10.0 }.max(1.0);
                prop_assert!((partial - expected[row].im / STEP).abs() < 1e-10 * scale, "partial {i} of {row}");
                prop_assert!((computed.xy[row] - expected[row].re).abs() < 1e-10 * f);
            }
        }
        prop_assert!(computed.xy.iter().all(|value| value.is_finite()));
    }
}

#[test]
fn the_rotation_is_orthogonal_and_turns_by_the_angle() {
    for angle in [0.0, 1e-12, 1e-4, 0.3, 0.32, 2.0, 3.1, 6.2] {
        let w = [0.6 * angle, 0.0, -0.8 * angle].into();
        let (r, jacobian) = angle_axis_with_jacobian(&w);
        assert_eq!(r, angle_axis_rotation(&w));
        for i in 0..3 {
            for j in 0..3 {
                let product: f64 = (0..3).map(|k| r[(i, k)] * r[(j, k)]).sum();
                assert!((product - f64::from(u8::from(i == j))).abs() < 1e-14);
                // (R - I) w = 0 and J w = w.
                assert!((r[(i, j)] * w[j]).is_finite() && jacobian[(i, j)].is_finite());
            }
            let along: f64 = (0..3).map(|j| jacobian[(i, j)] * w[j]).sum();
            assert!((along - w[i]).abs() < 1e-14 * (1.0 + angle));
        }
        let trace = r.trace();
        assert!((trace - (1.0 + 2.0 * f64::cos(angle))).abs() < 1e-14);
    }
}

/// Returns photos around a cloud of points; initial values are wrong by `coarseness`.
fn collection(photos: usize, points: usize, coarseness: f64) -> Network {
    let parameters = |i: usize| -> [f64; 9] {
        let around = -3.0 + 6.0 * i as f64 / photos as f64;
        let w = [0.05 * noise(i), -around, 0.05 * noise(i + 50)];
        [w[0], w[1], w[2], 0.3 * noise(i + 100), 0.3 * noise(i + 150), -10.0, 1000.0, 0.05, -0.02]
    };
    let position = |i: usize| -> [f64; 3] { std::array::from_fn(|k| 2.0 * noise(3 * i + k + 400)) };
    let mut images = Vec::new();
    for point in 0..points {
        for photo in (0..photos).filter(|photo| (photo + point) % 3 > 0) {
            let exact = bal_photo(parameters(photo)).project(&ground(position(point)));
            let n = images.len();
            let xy = [exact[0] + 0.5 * noise(2 * n + 7), exact[1] + 0.5 * noise(2 * n + 8)];
            images.push(Image { photo, point, xy, sd: [0.5; 2] });
        }
    }
    let coarse = |i: usize, k: usize| {
        let by = [0.05, 0.05, 0.05, 0.5, 0.5, 0.5, 100.0, 0.0, 0.0];
        parameters(i)[k] + coarseness * by[k] * noise(9 * i + k + 900)
    };
    let coarse_photo = |i: usize| {
        let pose = std::array::from_fn(|k| coarse(i, k));
        Photo::free(pose, i)
    };
    let coarse_camera = |i: usize| {
        let [focal_length, k1, k2] = [6, 7, 8].map(|k| coarse(i, k));
        Camera::new(Bal { parameters: [focal_length, k1, k2] }.into(), vec![f64::INFINITY; 3])
    };
    let coarse_point = |i: usize| {
        let exact = position(i);
        let coordinates = std::array::from_fn(|k| exact[k] + 0.5 * coarseness * noise(3 * i + k + 2000));
        Point { coordinates, sd: [f64::INFINITY; 3] }
    };
    Network {
        space: ObjectSpace::Rectangular,
        poses: PoseNumbers::Vectors,
        refraction: None,
        cameras: (0..photos).map(coarse_camera).collect(),
        photos: (0..photos).map(coarse_photo).collect(),
        points: (0..points).map(coarse_point).collect(),
        images,
        observations: vec![],
        commons: vec![],
        mounts: vec![],
        trajectories: vec![],
        image_times: vec![],
        image_corrections: vec![],
    }
}

fn adjusted(collection: &Network, loss: Option<Loss>, threads: usize) -> Solution {
    adjusted_from(collection, loss, threads, Start::Given).unwrap()
}

fn adjusted_from(
    collection: &Network,
    loss: Option<Loss>,
    threads: usize,
    start: Start,
) -> Result<Solution, NetworkError> {
    let threads = Threads::new(threads).unwrap();
    let adjustment = adjustment::Options {
        method: Method::TrustRegion(Stop::Decrease(1e-10)),
        max_iterations: 200,
        loss,
        ..Default::default()
    };
    let options = Options { adjustment, start, hold_unused: true, ..Options::default() };
    collection.adjustment(&options).run_in(&mut Context::new(&threads))
}

fn sum(solution: &Solution) -> f64 {
    solution.sums_of_squares.total()
}

fn redundancy(solution: &Solution) -> Vec<f64> {
    solution.images.iter().flatten().flat_map(|image| image.redundancy).collect()
}

#[test]
fn far_starts_lead_to_the_solution_of_near_ones() {
    let near = adjusted(&collection(9, 80, 0.0), None, 1);
    let far = adjusted(&collection(9, 80, 3.0), None, 1);
    assert_eq!((near.adjustment.status, far.adjustment.status), (Status::Converged, Status::Converged));
    assert!(far.adjustment.initial_sum_of_squares > 1e4 * near.adjustment.initial_sum_of_squares);
    assert!((sum(&near) - sum(&far)).abs() < 1e-8 * sum(&near));
}

#[test]
fn redundancy_numbers_sum_to_the_degrees_of_freedom_of_a_network_without_datum() {
    let collection = collection(9, 80, 0.3);
    let solution = adjusted(&collection, None, 2);
    assert_eq!(solution.datum.held.len(), 7);
    let expected = 2 * collection.images.len() as i64 - (9 * 9 + 3 * 80 - 7);
    assert_eq!(solution.degrees_of_freedom, expected);
    let sum: f64 = redundancy(&solution).iter().sum();
    assert!((sum - expected as f64).abs() < 1e-7 * expected as f64, "{sum} of {expected}");
}

#[test]
fn redundancy_numbers_do_not_depend_on_the_datum() {
    let free = adjusted(&collection(9, 80, 0.3), None, 1);
    // Another datum: two points and a coordinate fixed at their values in the free network.
    let mut held = collection(9, 80, 0.3);
    for ((photo, camera), adjusted) in held.photos.iter_mut().zip(&mut held.cameras).zip(&free.photos) {
        photo.pose = adjusted.pose;
        camera.camera = camera.camera.with_parameters(&adjusted.camera).unwrap();
    }
    for (point, adjusted) in held.points.iter_mut().zip(&free.points) {
        point.coordinates = adjusted.unwrap().coordinates;
    }
    held.points[0].sd = [0.0; 3];
    held.points[1].sd = [0.0; 3];
    held.points[2].sd[0] = 0.0;
    let held = adjusted(&held, None, 1);
    assert!(held.datum.held.is_empty());
    assert_eq!(held.degrees_of_freedom, free.degrees_of_freedom);
    for (a, b) in redundancy(&free).into_iter().zip(redundancy(&held)) {
        assert!((a - b).abs() < 1e-7, "{a} {b}");
    }
}

#[test]
fn the_bits_do_not_depend_on_the_number_of_threads() {
    let collection = collection(9, 200, 1.0);
    for loss in [None, Some(Loss::Huber(1.0))] {
        let (one, three) = (adjusted(&collection, loss, 1), adjusted(&collection, loss, 3));
        let values = |solution: &Solution| -> Vec<f64> {
            let photos =
                solution.photos.iter().flat_map(|photo| photo.pose.into_iter().chain(photo.camera.clone()));
            let cofactors = solution
                .points
                .iter()
                .flatten()
                .flat_map(|point| point.cofactors.data.0.into_iter().flatten());
            photos.chain(cofactors).chain(redundancy(solution)).collect()
        };
        assert_eq!(values(&one), values(&three));
    }
}

#[test]
fn losses_join_their_slopes() {
    for loss in [Loss::Huber(1.5), Loss::Cauchy(2.5)] {
        assert_eq!((loss.value(0.0), loss.weight(0.0)), (0.0, 1.0));
        for s in [1e-3, 1.0, 2.2, 2.3, 10.0, 1e4] {
            let slope = (loss.value(s * (1.0 + 1e-6)) - loss.value(s * (1.0 - 1e-6))) / (2e-6 * s);
            assert!((slope - loss.weight(s)).abs() < 1e-7, "{loss:?} at {s}");
            assert!(loss.value(s) <= s);
        }
    }
}

#[test]
fn points_without_initial_values_start_where_their_rays_meet() {
    let mut rays_only = collection(9, 80, 0.0);
    rays_only.points.iter_mut().skip(3).for_each(|point| point.coordinates = [f64::NAN; 3]);
    let (given, met) = (collection(9, 80, 0.0), adjusted(&rays_only, None, 1));
    assert!((sum(&met) - sum(&adjusted(&given, None, 1))).abs() < 1e-8 * sum(&met));
    let intersected = adjusted_from(&given, None, 1, Start::Intersected).unwrap();
    assert!((sum(&met) - sum(&intersected)).abs() < 1e-8 * sum(&met));
}

#[test]
fn cameras_of_both_kinds_and_held_ones_stand_in_one_network() {
    // Exact photos with fixed cameras, the first a perspective of the same focal length without distortion.
    let mut network = collection(9, 80, 0.0);
    network.cameras.iter_mut().skip(1).for_each(|camera| *camera = Camera::held(camera.camera.clone()));
    network.cameras[0] = Camera::new(Perspective { principal_distance: -1000.0 }.into(), vec![f64::INFINITY]);
    for image in network.images.iter_mut().filter(|image| image.photo == 0) {
        let ideal = network.cameras[1].camera.direction(image.xy).unwrap();
        image.xy = [-1000.0 * ideal.x / ideal.z, -1000.0 * ideal.y / ideal.z];
    }
    let solution = adjusted(&network, None, 2);
    assert_eq!(solution.adjustment.status, Status::Converged);
    let expected = 2 * network.images.len() as i64 - (9 * 6 + 1 + 3 * 80 - 7);
    assert_eq!(solution.degrees_of_freedom, expected);
    assert_eq!(solution.photos[0].cofactors.len(), 49);
    assert_eq!(solution.photos[1].cofactors.len(), 36);
    assert!((solution.photos[0].camera[0] + 1000.0).abs() < 10.0);
    assert_eq!(solution.photos[1].camera, network.cameras[1].camera.parameters());
    let total: f64 = redundancy(&solution).iter().sum();
    assert!((total - expected as f64).abs() < 1e-7 * expected as f64, "{total} of {expected}");
}

#[test]
fn networks_that_contradict_themselves_are_refused() {
    let refused = |change: &dyn Fn(&mut Network)| {
        let mut network = collection(4, 10, 0.0);
        change(&mut network);
        adjusted_from(&network, None, 1, Start::Given).unwrap_err()
    };
    assert_eq!(refused(&|network| network.images[3].point = 10), NetworkError::Index(3));
    assert_eq!(refused(&|network| network.photos[2].camera = 4), NetworkError::NoCamera(2));
    assert_eq!(refused(&|network| network.cameras[1].sd = vec![0.0]), NetworkError::CameraDeviations(1));
    assert_eq!(refused(&|network| network.images.clear()), NetworkError::Empty);
    let ellipsoid = photocore::geometry::Ellipsoid::CLARKE_1866;
    assert_eq!(refused(&|network| network.space = ObjectSpace::Geographic(ellipsoid)), NetworkError::Vectors);
}

#[test]
fn a_point_that_runs_into_a_station_is_left_out_soon() {
    let sound = collection(9, 80, 0.3);
    let expected = adjusted(&sound, None, 1);
    // One photo sees the point at a finite position, another at the station of the first: the point converges to this station.
    let [first, second] = [0, 3].map(|photo| adjusted_photo(&expected, photo));
    let station = first.centre();
    let mut with_point = sound.clone();
    let point = sound.points.len();
    let coordinates = [station[0], station[1] + 0.5, station[2]];
    with_point.points.push(Point { coordinates, sd: [f64::INFINITY; 3] });
    for (photo, xy) in [(0, [40.0, 30.0]), (3, second.project(&ground(station.into())))] {
        with_point.images.push(Image { photo, point, xy, sd: [0.5; 2] });
    }
    let found = adjusted(&with_point, None, 1);
    assert_eq!((found.adjustment.status, &found.state.collapsed[..]), (Status::Converged, &[point][..]));
    assert!(found.points[point].is_none());
    // Convergence as soon as the stations are stable for the observations, instead of after dozens of small steps.
    let steps = [&found, &expected].map(|solution| solution.adjustment.iterations.len());
    assert!(steps[0] <= steps[1] + 8, "{steps:?}");
    assert!((sum(&found) - sum(&expected)).abs() < 1e-8 * sum(&expected));
    assert_eq!(found.degrees_of_freedom, expected.degrees_of_freedom);
}

fn adjusted_photo(solution: &Solution, photo: usize) -> geometry::View<Bal> {
    let AdjustedPhoto { pose, camera, .. } = &solution.photos[photo];
    bal_photo(std::array::from_fn(|k| if k < 6 { pose[k] } else { camera[k - 6] }))
}

#[test]
fn points_behind_a_camera_are_counted() {
    let sound = collection(9, 80, 0.0);
    assert!(adjusted(&sound, None, 1).points.iter().flatten().all(|point| point.behind == 0));
    // All unknowns fixed, one photo rotated by 180 degrees about its station: its points are behind it.
    let mut turned = sound.clone();
    turned.points.iter_mut().for_each(|point| point.sd = [0.0; 3]);
    turned.photos.iter_mut().for_each(|photo| photo.sd = [0.0; 6]);
    turned.cameras.iter_mut().for_each(|camera| camera.sd = vec![0.0; 3]);
    let pose = &mut turned.photos[4].pose;
    let centre = Orientation::new(PoseNumbers::Vectors, ObjectSpace::Rectangular, pose).centre();
    pose[1] += std::f64::consts::PI;
    let translation = -(angle_axis_rotation(&[pose[0], pose[1], pose[2]].into()) * centre);
    (0..3).for_each(|k| pose[3 + k] = translation[k]);
    // At least one unknown must be free.
    turned.cameras[0].sd[0] = f64::INFINITY;
    let found = adjusted(&turned, None, 1);
    let seen = sound.images.iter().filter(|image| image.photo == 4).count();
    assert_eq!(found.points.iter().flatten().map(|point| point.behind).sum::<usize>(), seen);
    assert_eq!(found.unseen.behind.len(), seen);
}

#[test]
fn values_too_large_for_double_precision_are_named() {
    let sound = collection(9, 80, 0.3);
    let refused = |network: &Network| adjusted_from(network, None, 1, Start::Given).err();
    for value in [1e308, -1e101, 1e16] {
        for parameter in [1, 5] {
            let mut wrong = sound.clone();
            wrong.photos[6].pose[parameter] = value;
            let expected = Coarse { photos: vec![6], points: vec![] };
            assert_eq!(refused(&wrong), Some(NetworkError::Coarse(expected)));
        }
        let mut wrong = sound.clone();
        wrong.points[17].coordinates[2] = value;
        let expected = Coarse { photos: vec![], points: vec![17] };
        assert_eq!(refused(&wrong), Some(NetworkError::Coarse(expected)));
    }
}
