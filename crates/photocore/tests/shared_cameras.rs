//! Shared cameras with unknown parameters, compared with a dense adjustment with partials by complex steps.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::ops::{ControlFlow, Range};

use faer::linalg::solvers::{DenseSolveCore, Solve};
use faer::{Mat, Side};
use nalgebra::{DMatrix, DVector};
use num_complex::Complex64 as C;
use photocore::adjustment::{self, CofactorError, Method, Status, Stop};
use photocore::geometry::{self, Bal, ObjectSpace, Perspective, PoseNumbers, RotationSense};
use photocore::network::observations::Distance;
use photocore::network::{
    Camera, Combination, Image, Network, NetworkError, Of, Options, Photo, Point, PosePart, Solution,
};
use photocore::{Context, Stopped, Threads};

use crate::scatter;

const FREE: f64 = f64::INFINITY;
const PHOTOS: usize = 14;
const POINTS: usize = 40;
const IMAGE_SD: f64 = 0.5;
const TIGHT: Method = Method::Damped(Stop::Fraction(1e-9));
/// Two cameras of several photos, one of a single photo, a fixed one, one with only a principal distance, and a backward one.
const CAMERA_OF: [usize; PHOTOS] = [0, 1, 0, 1, 0, 1, 0, 2, 3, 4, 4, 5, 5, 5];

/// c, xp, yp, K1, K2, K3, P1, P2, b1, b2 and the balancing radius.
const BROWN: [f64; 11] = [-1000.0, 3.0, -5.0, -5e-8, 2e-13, 0.0, 1e-6, -2e-6, 3e-4, -2e-4, 300.0];

fn cameras() -> Vec<Camera> {
    let bal = |f, [k1, k2]: [f64; 2]| geometry::Camera::from(Bal { parameters: [f, k1, k2] });
    vec![
        Camera::new(bal(1000.0, [0.05, -0.02]), vec![FREE; 3]),
        // Weighted, free, fixed.
        Camera::new(bal(1100.0, [0.03, 0.01]), vec![0.3, FREE, 0.0]),
        Camera::new(bal(900.0, [-0.04, 0.02]), vec![FREE, 0.004, 0.01]),
        Camera::held(bal(950.0, [0.0, 0.02])),
        Camera::new(Perspective { principal_distance: -1050.0 }.into(), vec![FREE]),
        Camera::new(
            geometry::Camera::named("brown", &BROWN).unwrap(),
            vec![FREE, FREE, 0.5, FREE, FREE, 0.0, FREE, 1e-6, FREE, FREE, 0.0],
        ),
    ]
}

/// Returns the rotated vector by the exponential series of the cross product.
fn turned(w: &[C], v: [C; 3]) -> [C; 3] {
    let cross = |b: [C; 3]| -> [C; 3] {
        std::array::from_fn(|k| w[(k + 1) % 3] * b[(k + 2) % 3] - w[(k + 2) % 3] * b[(k + 1) % 3])
    };
    let (mut sum, mut term) = (v, v);
    for n in 1..60 {
        term = cross(term).map(|value| value / f64::from(n));
        sum = std::array::from_fn(|k| sum[k] + term[k]);
    }
    sum
}

/// Returns a measured position as corrected by the backward camera.
fn corrected(camera: &[C], measured: [f64; 2]) -> [C; 2] {
    let [xp, yp, k1, k2, k3, p1, p2, b1, b2] = std::array::from_fn(|k| camera[1 + k]);
    let (dx, y) = (measured[0] - xp, measured[1] - yp);
    let x = dx * (1.0 + b1) + y * b2;
    let (q, q0) = (x * x + y * y, camera[10] * camera[10]);
    let r = k1 * (q - q0) + k2 * (q * q - q0 * q0) + k3 * (q * q * q - q0 * q0 * q0);
    [
        x + x * r + p1 * (q + 2.0 * x * x) + 2.0 * p2 * x * y,
        y + y * r + p2 * (q + 2.0 * y * y) + 2.0 * p1 * x * y,
    ]
}

/// Returns observed minus computed.
fn misclosure(pose: &[C], camera: &[C], point: &[C], measured: [f64; 2]) -> [C; 2] {
    let (computed, observed) = match camera.len() {
        11 => (image(pose, &camera[..1], point), corrected(camera, measured)),
        _ => (image(pose, camera, point), measured.map(C::from)),
    };
    [0, 1].map(|k| observed[k] - computed[k])
}

/// Returns the position with zero misclosure by fixed-point iteration.
fn exact(pose: &[C], camera: &[C], point: &[C]) -> [f64; 2] {
    let mut measured = [0.0; 2];
    for _ in 0..30 {
        let left = misclosure(pose, camera, point, measured);
        measured = [0, 1].map(|k| measured[k] - left[k].re);
    }
    measured
}

/// Returns the image of a point: f or -c, with or without radial terms.
fn image(pose: &[C], camera: &[C], point: &[C]) -> [C; 2] {
    let r = turned(&pose[..3], [point[0], point[1], point[2]]);
    let p = [0, 1].map(|k| -(r[k] + pose[3 + k]) / (r[2] + pose[5]));
    let square = p[0] * p[0] + p[1] * p[1];
    match camera {
        [c] => p.map(|value| -c * value),
        camera => p.map(|value| camera[0] * (1.0 + camera[1] * square + camera[2] * square * square) * value),
    }
}

fn pose(photo: usize) -> [f64; 6] {
    let around = -2.5 + 5.0 * photo as f64 / PHOTOS as f64;
    let [a, b] = [0, 1].map(|k| 0.2 * scatter(photo + 50 * k));
    [a, -around, b, 0.3 * scatter(photo + 100), 0.3 * scatter(photo + 150), -10.0 + scatter(photo + 200)]
}

fn place(point: usize) -> [f64; 3] {
    std::array::from_fn(|k| 2.0 * scatter(3 * point + k + 400))
}

fn complex(values: &[f64]) -> Vec<C> {
    values.iter().map(|&value| C::new(value, 0.0)).collect()
}

/// Returns photos around a cloud of points with weighted first points, and two observed lengths: their end points are retained.
fn network() -> Network {
    let cameras = cameras();
    let mut images = Vec::new();
    for point in 0..POINTS {
        for photo in (0..PHOTOS).filter(|photo| (photo + point) % 3 > 0) {
            let parameters: Vec<f64> = cameras[CAMERA_OF[photo]].camera.parameters();
            let exact = exact(&complex(&pose(photo)), &complex(&parameters), &complex(&place(point)));
            let n = 2 * images.len();
            let xy = [0, 1].map(|k| exact[k] + IMAGE_SD * scatter(n + k + 7000));
            images.push(Image { photo, point, xy, sd: [IMAGE_SD; 2] });
        }
    }
    let photo = |photo: usize| {
        let pose = std::array::from_fn(|k| pose(photo)[k] + 0.01 * scatter(6 * photo + k + 900));
        Photo { pose, observed: pose, sd: [FREE; 6], camera: CAMERA_OF[photo] }
    };
    let point = |point: usize| {
        let sd = if point < 6 { 0.002 } else { FREE };
        Point { coordinates: place(point).map(|value| value + 0.001 * scatter(point + 1300)), sd: [sd; 3] }
    };
    let length = |points: [usize; 2]| {
        let [p, q] = points.map(place);
        let length = (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt();
        Distance { points, length: length + 0.0005, sd: 0.001, instrument: None }.into()
    };
    Network {
        space: ObjectSpace::Rectangular,
        poses: PoseNumbers::Vectors,
        refraction: None,
        cameras,
        photos: (0..PHOTOS).map(photo).collect(),
        points: (0..POINTS).map(point).collect(),
        images,
        observations: [[20, 21], [4, 30]].map(length).into(),
        commons: vec![],
        mounts: vec![],
        trajectories: vec![],
        image_times: vec![],
        image_corrections: vec![],
    }
}

fn options(method: Method) -> Options {
    let adjustment = adjustment::Options { method, ..adjustment::Options::default() };
    Options { adjustment, ..Options::default() }
}

fn adjust(network: &Network, method: Method) -> Result<Solution, NetworkError> {
    let threads = Threads::new(2).unwrap();
    network.adjustment(&options(method)).run_in(&mut Context::new(&threads))
}

/// The same network with full matrices: poses, parameters of all cameras, points; fixed unknowns have a separate equation.
struct Dense<'a> {
    network: &'a Network,
    first_parameter: Vec<usize>,
    first_point: usize,
    unknowns: usize,
}

impl<'a> Dense<'a> {
    fn new(network: &'a Network) -> Self {
        let mut first_parameter = vec![6 * PHOTOS];
        for camera in &network.cameras {
            first_parameter.push(first_parameter[first_parameter.len() - 1] + camera.sd.len());
        }
        let first_point = first_parameter[network.cameras.len()];
        Self { network, first_parameter, first_point, unknowns: first_point + 3 * POINTS }
    }

    fn camera(&self, camera: usize) -> Range<usize> {
        self.first_parameter[camera]..self.first_parameter[camera + 1]
    }

    fn point(&self, point: usize) -> Range<usize> {
        self.first_point + 3 * point..self.first_point + 3 * point + 3
    }

    /// Returns values and standard deviations of observed or fixed unknowns.
    fn observed(&self) -> (Vec<f64>, Vec<f64>) {
        let Network { photos, cameras, points, .. } = self.network;
        let poses = photos.iter().flat_map(|photo| photo.pose);
        let parameters = cameras.iter().flat_map(|camera| camera.camera.parameters());
        let values = poses.chain(parameters).chain(points.iter().flat_map(|point| point.coordinates));
        let sd =
            vec![FREE; 6 * PHOTOS].into_iter().chain(cameras.iter().flat_map(|camera| camera.sd.clone()));
        (values.collect(), sd.chain(points.iter().flat_map(|point| point.sd)).collect())
    }

    /// Returns observed minus computed and partials, for unit weight: images, lengths, unknowns.
    fn equations(&self, x: &[f64]) -> (Mat<f64>, Mat<f64>) {
        const STEP: f64 = 1e-100;
        let Network { images, photos, .. } = self.network;
        let (observed, sd) = self.observed();
        let mut a = Mat::zeros(2 * images.len() + 2 + self.unknowns, self.unknowns);
        let mut left = Mat::zeros(a.nrows(), 1);
        for (i, each) in images.iter().enumerate() {
            let camera = self.camera(photos[each.photo].camera);
            let pose = 6 * each.photo..6 * each.photo + 6;
            let columns: Vec<usize> =
                pose.clone().chain(camera.clone()).chain(self.point(each.point)).collect();
            for (k, &column) in columns.iter().enumerate() {
                let mut values: Vec<C> = columns.iter().map(|&column| C::new(x[column], 0.0)).collect();
                values[k].im = STEP;
                let (pose, rest) = values.split_at(6);
                let (camera, point) = rest.split_at(camera.len());
                let misclosure = misclosure(pose, camera, point, each.xy);
                for row in 0..2 {
                    // A fixed unknown appears only in its own equation.
                    let partial = if sd[column] == 0.0 { 0.0 } else { -misclosure[row].im / STEP };
                    a[(2 * i + row, column)] = partial / IMAGE_SD;
                    left[(2 * i + row, 0)] = misclosure[row].re / IMAGE_SD;
                }
            }
        }
        for (k, (points, length)) in [[20, 21], [4, 30]].into_iter().zip(lengths(self.network)).enumerate() {
            let row = 2 * images.len() + k;
            let [p, q] = points.map(|point| self.point(point).start);
            let difference = [0, 1, 2].map(|k| x[q + k] - x[p + k]);
            let computed = difference.iter().map(|d| d * d).sum::<f64>().sqrt();
            left[(row, 0)] = (length - computed) / 0.001;
            for k in 0..3 {
                a[(row, q + k)] = difference[k] / computed / 0.001;
                a[(row, p + k)] = -a[(row, q + k)];
            }
        }
        for i in 0..self.unknowns {
            let weight = if sd[i] == 0.0 { 1.0 } else { sd[i].recip() };
            a[(2 * images.len() + 2 + i, i)] = weight;
            left[(2 * images.len() + 2 + i, 0)] = weight * (observed[i] - x[i]);
        }
        (a, left)
    }

    /// Returns the adjusted unknowns and the inverse normal matrix.
    fn adjust(&self) -> (Vec<f64>, Mat<f64>) {
        let (mut x, _) = self.observed();
        for _ in 0..20 {
            let (a, left) = self.equations(&x);
            let normal = a.transpose() * &a;
            let step = normal.llt(Side::Lower).unwrap().solve(a.transpose() * left);
            (0..x.len()).for_each(|i| x[i] += step[(i, 0)]);
        }
        let (a, _) = self.equations(&x);
        let mut inverse = (a.transpose() * &a).llt(Side::Lower).unwrap().inverse();
        // Fixed unknowns have zero cofactors.
        let (_, sd) = self.observed();
        (0..x.len()).filter(|&i| sd[i] == 0.0).for_each(|i| inverse[(i, i)] = 0.0);
        (x, inverse)
    }
}

fn lengths(network: &Network) -> Vec<f64> {
    let length = |observation: &photocore::network::Observation| match observation {
        photocore::network::Observation::Distance(distance) => distance.length,
        other => panic!("{other:?}"),
    };
    network.observations.iter().map(length).collect()
}

fn compare(found: &[f64], cofactors: &[f64], unknowns: &[usize], x: &[f64], q: &Mat<f64>, what: &str) {
    for (i, &u) in unknowns.iter().enumerate() {
        let sd = q[(u, u)].sqrt();
        assert!((found[i] - x[u]).abs() <= 1e-7 * sd, "{what} {i}: {} instead of {}", found[i], x[u]);
        for (j, &v) in unknowns.iter().enumerate() {
            let scale = sd * q[(v, v)].sqrt();
            let (value, expected) = (cofactors[i * unknowns.len() + j], q[(u, v)]);
            assert!((value - expected).abs() <= 1e-8 * scale, "{what} {i} {j}: {value:e} {expected:e}");
        }
    }
}

#[test]
fn shared_cameras_are_those_of_an_adjustment_with_full_matrices() {
    let network = network();
    let (dense, solution) = (Dense::new(&network), adjust(&network, TIGHT).unwrap());
    assert_eq!(solution.adjustment.status, Status::Converged);
    let (x, q) = dense.adjust();
    let (_, sd) = dense.observed();
    let (design, _) = dense.equations(&x);
    for (i, photo) in solution.photos.iter().enumerate() {
        let mut unknowns: Vec<usize> = (6 * i..6 * i + 6).collect();
        let mut values = photo.pose.to_vec();
        if CAMERA_OF[i] == 2 {
            unknowns.extend(dense.camera(2));
            values.extend(&photo.camera);
        }
        compare(&values, photo.cofactors.as_slice(), &unknowns, &x, &q, &format!("photo {i}"));
        assert_eq!(photo.camera, solution.cameras[CAMERA_OF[i]].parameters);
    }
    for (i, camera) in solution.cameras.iter().enumerate() {
        let unknowns: Vec<usize> = dense.camera(i).collect();
        compare(&camera.parameters, camera.cofactors.as_slice(), &unknowns, &x, &q, &format!("camera {i}"));
        for (k, &u) in unknowns.iter().enumerate() {
            let weighted = sd[u] > 0.0 && sd[u] < FREE;
            let expected = if weighted { 1.0 - q[(u, u)] / sd[u].powi(2) } else { 0.0 };
            assert!((camera.redundancy[k] - expected).abs() < 1e-8, "camera {i}, parameter {k}");
            let sum: f64 = (0..design.nrows()).map(|row| design[(row, u)].powi(2)).sum();
            let expected = if sd[u] == 0.0 { 0.0 } else { sum };
            assert!((camera.information[k] - expected).abs() <= 1e-8 * sum, "camera {i}, parameter {k}");
        }
        let of_camera = |image: &&Image| CAMERA_OF[image.photo] == i;
        let photos = CAMERA_OF.iter().filter(|&&camera| camera == i).count();
        let images = network.images.iter().filter(of_camera).count();
        assert_eq!((camera.photos, camera.images), (photos, images));
    }
    for (i, point) in solution.points.iter().enumerate() {
        let point = point.unwrap();
        let unknowns: Vec<usize> = dense.point(i).collect();
        let cofactors = point.cofactors.as_slice();
        compare(&point.coordinates, cofactors, &unknowns, &x, &q, &format!("point {i}"));
    }
    let (a, left) = dense.equations(&x);
    let taken_up = &a * &q;
    for (i, image) in solution.images.iter().enumerate() {
        for row in 0..2 {
            let equation = 2 * i + row;
            let share: f64 = (0..x.len()).map(|k| taken_up[(equation, k)] * a[(equation, k)]).sum();
            let image = image.unwrap();
            assert!((image.redundancy[row] - (1.0 - share)).abs() < 1e-8, "image {i}");
            assert!((image.residual[row] / IMAGE_SD - left[(equation, 0)]).abs() < 1e-6, "image {i}");
        }
    }
    let total: f64 = (0..left.nrows()).map(|i| left[(i, 0)].powi(2)).sum();
    assert!((solution.sums_of_squares.total() - total).abs() < 1e-9 * total);
}

/// Compares the full cofactor matrix and cross-cofactors at the end of the adjustment with dense matrices.
#[test]
fn cofactors_of_anything_with_anything_are_those_of_full_matrices() {
    let network = network();
    let options = options(TIGHT);
    let in_threads = |threads: usize| Threads::new(threads).unwrap();
    let threads = in_threads(2);
    let solution = network.adjustment(&options).run_in(&mut Context::new(&threads)).unwrap();
    let dense = Dense::new(&network);
    let (_, q) = dense.adjust();
    let (_, sd) = dense.observed();
    let photos = (0..PHOTOS).map(Of::Photo);
    let of: Vec<Of> = (0..POINTS).map(Of::Point).rev().chain(photos).chain((0..5).map(Of::Camera)).collect();
    let unknowns = |of: &[Of]| -> Vec<usize> {
        let own = |of: &Of| match *of {
            Of::Photo(photo) | Of::PhotoStep(photo) => 6 * photo..6 * photo + 6,
            Of::Point(point) => dense.point(point),
            Of::Camera(camera) => dense.camera(camera),
            Of::Common(common) => panic!("common unknown {common}"),
        };
        of.iter().flat_map(own).collect()
    };
    let covariances =
        network.covariances(&options, &solution.state, None, &mut Context::new(&threads)).unwrap();
    let all = covariances.cofactors(&of, None, &mut Context::new(&threads)).unwrap();
    let compare = |found: &DMatrix<f64>, rows: &[usize], columns: &[usize]| {
        assert_eq!(found.shape(), (rows.len(), columns.len()));
        for (k, value) in found.iter().enumerate() {
            let (i, j) = (rows[k % rows.len()], columns[k / rows.len()]);
            let expected = if sd[i] == 0.0 || sd[j] == 0.0 { 0.0 } else { q[(i, j)] };
            let scale = (q[(i, i)] * q[(j, j)]).sqrt();
            assert!((value - expected).abs() <= 1e-8 * scale, "{i} {j}: {value:e} {expected:e}");
        }
    };
    compare(&all, &unknowns(&of), &unknowns(&of));
    // Bit-identical results for any number of threads.
    let one = in_threads(1);
    let again = network.covariances(&options, &solution.state, None, &mut Context::new(&one)).unwrap();
    let again = again.cofactors(&of, None, &mut Context::new(&one)).unwrap();
    assert!(all.iter().zip(&again).all(|(a, b)| a.to_bits() == b.to_bits()));
    // Cross-cofactors: one camera and all unknowns, all unknowns and one camera, some points and others.
    for (rows, columns) in [
        (vec![Of::Camera(0)], of.clone()),
        (of.clone(), vec![Of::Camera(1)]),
        (vec![Of::Point(4), Of::Point(30)], vec![Of::Point(30), Of::Photo(7), Of::Point(5)]),
    ] {
        let found = covariances.cofactors(&rows, Some(&columns), &mut Context::new(&threads)).unwrap();
        compare(&found, &unknowns(&rows), &unknowns(&columns));
    }
    // A distance as a function of two points.
    let ends = [Of::Point(3), Of::Point(22)];
    let [p, r] = [3, 22].map(|point| solution.points[point].unwrap().coordinates);
    let length = (0..3).map(|k| (r[k] - p[k]).powi(2)).sum::<f64>().sqrt();
    let direction: Vec<f64> = (0..3).map(|k| (r[k] - p[k]) / length).collect();
    let partials: Vec<f64> = direction.iter().map(|d| -d).chain(direction.iter().copied()).collect();
    let found = covariances.propagate(&partials, &ends, &mut Context::new(&threads)).unwrap();
    let places = unknowns(&ends);
    let pairs = (0..6).flat_map(|i| (0..6).map(move |j| (i, j)));
    let expected: f64 = pairs.map(|(i, j)| partials[i] * q[(places[i], places[j])] * partials[j]).sum();
    assert!((found[0] / expected - 1.0).abs() < 1e-8, "{} {expected}", found[0]);
}

#[test]
fn what_has_no_cofactors_is_refused() {
    let network = network();
    let threads = Threads::new(1).unwrap();
    let options = Options { memory: Some(1 << 30), ..options(TIGHT) };
    let solution = network.adjustment(&options).run_in(&mut Context::new(&threads)).unwrap();
    let covariances =
        network.covariances(&options, &solution.state, None, &mut Context::new(&threads)).unwrap();
    let refused = |of: Of| covariances.cofactors(&[of], None, &mut Context::new(&threads)).unwrap_err();
    assert_eq!(refused(Of::Photo(PHOTOS)), NetworkError::NoPhoto(PHOTOS));
    assert_eq!(refused(Of::Point(POINTS)), NetworkError::NoPoint(POINTS));
    let cameras = network.cameras.len();
    assert_eq!(refused(Of::Camera(cameras)), NetworkError::CameraIndex(cameras));
    let partials =
        covariances.propagate(&[1.0; 4], &[Of::Point(0)], &mut Context::new(&threads)).unwrap_err();
    assert_eq!(partials, NetworkError::Partials { unknowns: 3, numbers: 4 });
    let many = vec![Of::Point(0); 4000];
    let too_many = covariances.cofactors(&many, None, &mut Context::new(&threads)).unwrap_err();
    let NetworkError::Cofactors(CofactorError::Memory { needed, .. }) = too_many else {
        panic!("{too_many:?}");
    };
    assert!(needed > 8 * 12_000 * 12_000);
    let mut stop = |_| ControlFlow::Break(());
    let stopping = &mut Context::with_progress(&threads, &mut stop);
    let stopped = covariances.cofactors(&[Of::Point(0)], None, stopping);
    assert_eq!(stopped.unwrap_err(), NetworkError::Stopped(Stopped::Interrupted));
    let mut other = solution.state;
    other.unknowns.pop();
    let found = network.covariances(&options, &other, None, &mut Context::new(&threads)).err();
    assert_eq!(found, Some(NetworkError::State));
}

/// Without control: the datum fixes photos, and redundancy numbers sum to the degrees of freedom.
#[test]
fn redundancy_numbers_of_a_free_network_add_up() {
    let mut network = network();
    network.points.iter_mut().for_each(|point| point.sd = [FREE; 3]);
    network.observations.clear();
    let solution = adjust(&network, Method::TrustRegion(Stop::Decrease(1e-10))).unwrap();
    assert_eq!(solution.datum.held.len(), 7);
    let parameters = 3 + 2 + 3 + 1 + 9;
    let weighted = 1 + 2 + 2;
    let unknowns = (6 * PHOTOS + parameters + 3 * POINTS - 7) as i64;
    let expected = (2 * network.images.len() + weighted) as i64 - unknowns;
    assert_eq!(solution.degrees_of_freedom, expected);
    let of_images = solution.images.iter().flatten().flat_map(|image| image.redundancy);
    let of_cameras = solution.cameras.iter().flat_map(|camera| camera.redundancy.clone());
    let total: f64 = of_images.chain(of_cameras).sum();
    assert!((total - expected as f64).abs() < 1e-7 * expected as f64, "{total} of {expected}");
}

/// Vertical photos of a plane: a longer principal distance is equivalent to a greater flying height.
#[test]
fn a_camera_that_is_not_determined_is_named_with_its_photos() {
    let camera = Perspective { principal_distance: -1000.0 };
    let places: Vec<[f64; 3]> = (0..9).map(|k| [(k % 3) as f64, (k / 3) as f64, 0.0]).collect();
    let stations = [[-0.5, -1.0], [-1.0, -1.2], [-1.5, -0.8]];
    let mut network = Network {
        poses: PoseNumbers::Vectors,
        cameras: vec![Camera::held(camera.into()), Camera::new(camera.into(), vec![FREE])],
        photos: vec![],
        points: places.iter().map(|&coordinates| Point { coordinates, sd: [0.0; 3] }).collect(),
        images: vec![],
        ..Network::new()
    };
    for (photo, [x, y]) in stations.into_iter().enumerate() {
        let pose = [0.0, 0.0, 0.0, x, y, -10.0];
        network.photos.push(Photo::known(pose, [FREE; 6], 1));
        for (point, place) in places.iter().enumerate() {
            let xy = image(&complex(&pose), &complex(&[-1000.0]), &complex(place)).map(|value| value.re);
            network.images.push(Image { photo, point, xy, sd: [IMAGE_SD; 2] });
        }
    }
    let combination = Combination { photos: vec![0, 1, 2], cameras: vec![1], ..Combination::default() };
    assert_eq!(adjust(&network, TIGHT).unwrap_err(), NetworkError::Undetermined(vec![combination]));
    // A weight is sufficient.
    network.cameras[1].sd = vec![0.1];
    let solution = adjust(&network, TIGHT).unwrap();
    assert!((solution.cameras[1].cofactors[0].sqrt() - 0.1).abs() < 1e-9);
    assert!(solution.cameras[1].redundancy[0].abs() < 1e-8);
}

#[test]
fn constants_of_a_camera_are_never_unknown() {
    for sd in [FREE, 0.1] {
        let mut network = network();
        network.cameras[5].sd[10] = sd;
        let error = NetworkError::CameraConstant { camera: 5, parameter: "r0" };
        assert_eq!(adjust(&network, TIGHT).unwrap_err(), error);
    }
}

/// The same with poses in angles: the members of the combination are reported.
#[test]
fn what_is_not_determined_is_named_by_parameters_and_parts_of_poses() {
    let sense = RotationSense::GroundToPhoto;
    let places: Vec<[f64; 3]> = (0..9).map(|k| [(k % 3) as f64, (k / 3) as f64, 0.0]).collect();
    let lens = geometry::Camera::named("radial", &[1000.0, 0.0, 0.0, 0.0, 0.0]).unwrap();
    let network = |free: &[usize]| {
        let sd = (0..5).map(|k| if free.contains(&k) { FREE } else { 0.0 }).collect();
        let mut network = Network {
            poses: PoseNumbers::Angles(sense),
            cameras: vec![Camera::new(lens.clone(), sd)],
            photos: vec![],
            points: places.iter().map(|&coordinates| Point { coordinates, sd: [0.0; 3] }).collect(),
            images: vec![],
            ..Network::new()
        };
        for (photo, [x, y]) in [[0.5, 1.0], [1.0, 1.2], [1.5, 0.8]].into_iter().enumerate() {
            let pose = [x, y, 10.0, 0.0, 0.0, 0.0];
            network.photos.push(Photo::known(pose, [FREE; 6], 0));
            for (point, place) in places.iter().enumerate() {
                let xy = lens.image(&[place[0] - x, place[1] - y, -10.0].into());
                network.images.push(Image { photo, point, xy, sd: [IMAGE_SD; 2] });
            }
        }
        network
    };
    let combinations = |free: &[usize]| match adjust(&network(free), TIGHT) {
        Err(NetworkError::Undetermined(found)) => found,
        other => panic!("{:?}", other.map(|solution| solution.degrees_of_freedom)),
    };
    let [found] = &combinations(&[0])[..] else { panic!("one combination") };
    assert_eq!((&found.parameters[..], &found.poses[..]), (&[(0, 0)][..], &[PosePart::Along][..]));
    // The principal point and the horizontal positions, x and y.
    let found = combinations(&[1, 2]);
    let parameters: Vec<_> = found.iter().flat_map(|one| one.parameters.clone()).collect();
    assert_eq!(parameters, [(0, 1), (0, 2)]);
    assert!(found.iter().all(|one| one.poses == [PosePart::Across]), "{found:?}");
}

/// Separate weights and a diagonal matrix agree; correlated weights agree with the combination of a free camera and the prior.
#[test]
fn parameters_may_be_observed_with_their_covariance() {
    let deviations = |of: &[f64]| DMatrix::from_diagonal(&DVector::from_column_slice(of).map(|sd| sd * sd));
    let (mut one, mut matrix) = (network(), network());
    for (camera, sd) in [(0, [0.4, 0.003, 0.004]), (2, [0.5, 0.002, 0.006])] {
        (one.cameras[camera].sd, matrix.cameras[camera].sd) = (sd.to_vec(), sd.to_vec());
        matrix.cameras[camera].covariance = Some(deviations(&sd));
    }
    let (one, matrix) = (adjust(&one, TIGHT).unwrap(), adjust(&matrix, TIGHT).unwrap());
    for (own, other) in one.cameras.iter().zip(&matrix.cameras) {
        for (k, sd) in own.cofactors.iter().step_by(own.parameters.len() + 1).map(|q| q.sqrt()).enumerate() {
            assert!((own.parameters[k] - other.parameters[k]).abs() <= 1e-7 * sd);
            assert!((own.redundancy[k] - other.redundancy[k]).abs() < 1e-8);
            assert!((own.information[k] - other.information[k]).abs() <= 1e-8 * own.information[k]);
        }
        let difference = own.cofactors.iter().zip(&other.cofactors).map(|(a, b)| (a - b).abs());
        assert!(
            difference.fold(0.0, f64::max)
                <= 1e-9 * own.cofactors.iter().fold(0.0, |most: f64, q| most.max(q.abs()))
        );
    }
    assert!((one.sums_of_squares.total() / matrix.sums_of_squares.total() - 1.0).abs() < 1e-10);
    assert_eq!(one.degrees_of_freedom, matrix.degrees_of_freedom);

    for camera in [0, 2] {
        let mut free = network();
        free.cameras[camera].sd = vec![FREE; 3];
        let before = adjust(&free, TIGHT).unwrap().cameras[camera].clone();
        let q = before.cofactors.clone();
        // As precise as the observations, with different correlations.
        let sd: Vec<f64> = (0..3).map(|k| q[(k, k)].sqrt()).collect();
        let s = DMatrix::from_fn(3, 3, |i, j| {
            sd[i] * sd[j] * if i == j { 1.0 } else { 0.6 - 0.5 * (i + j) as f64 / 3.0 }
        });
        let found = DVector::from_column_slice(&before.parameters);
        let given = DVector::from_fn(3, |k, _| found[k] + [0.5, -0.4, 0.3][k] * sd[k]);
        let mut weighted = network();
        let lens = weighted.cameras[camera].camera.with_parameters(given.as_slice()).unwrap();
        weighted.cameras[camera] = Camera { covariance: Some(s.clone()), ..Camera::new(lens, sd.clone()) };
        let solution = adjust(&weighted, TIGHT).unwrap();
        let after = &solution.cameras[camera];
        let w = s.clone().try_inverse().unwrap();
        let together = (q.clone().try_inverse().unwrap() + &w).try_inverse().unwrap();
        let expected = &found + &together * &w * (&given - &found);
        for k in 0..3 {
            // The network is slightly nonlinear over such large deviations.
            assert!(
                (after.parameters[k] - expected[k]).abs() < 0.02 * sd[k],
                "{} {}",
                after.parameters[k],
                expected[k]
            );
            let own = 1.0 - (&together * &w)[(k, k)];
            assert!((after.redundancy[k] - own).abs() < 0.03, "{} {own}", after.redundancy[k]);
            for j in 0..3 {
                assert!((after.cofactors[3 * k + j] - together[(k, j)]).abs() < 0.02 * sd[k] * sd[j]);
            }
        }
        let of_images = solution.images.iter().flatten().flat_map(|image| image.redundancy);
        let of_cameras = solution.cameras.iter().flat_map(|camera| camera.redundancy.clone());
        let of_points = solution.points.iter().flatten().flat_map(|point| point.redundancy);
        let of_lengths = solution.observations.iter().flatten().flat_map(|own| own.redundancy.clone());
        let total: f64 = of_images.chain(of_cameras).chain(of_points).chain(of_lengths).sum();
        assert!(
            (total - solution.degrees_of_freedom as f64).abs() < 1e-6,
            "{total} {}",
            solution.degrees_of_freedom
        );
        weighted.cameras[camera].covariance = Some(DMatrix::from_element(3, 3, 1.0));
        assert_eq!(adjust(&weighted, TIGHT).unwrap_err(), NetworkError::CameraCovariance(camera));
    }
}
