//! Networks without control, compared with dense algebra.

#![allow(clippy::unwrap_used)]

use std::f64::consts::TAU;

use faer::{Mat, Side};
use photocore::adjustment::{self, DatumError, Method, Published, Status, Stop};
use photocore::geometry::{
    AttitudeNumbers, CameraModel, Ellipsoid, Matrix3, ObjectSpace, Orientation, Perspective, Point as At,
    PoseNumbers, RotationSense, Vector3, angle_axis_rotation,
};
use photocore::network::{
    Camera, Image, InnerConstraints, Network, NetworkDatum, NetworkError, Of, Options, Photo, Point,
    Solution, Start,
};
use photocore::{Context, Threads};

use crate::{noise, noises};

const CAMERA: Perspective = Perspective { principal_distance: -28.0 };
const SD: f64 = 0.002;
const FREE: f64 = f64::INFINITY;
const NUMBERS: AttitudeNumbers = AttitudeNumbers::OmegaPhiKappa(RotationSense::GroundToPhoto);
const PHOTOS: usize = 6;
const POINTS: usize = 12;

/// Returns photos on a circle about free points; the third sees one point fewer than the others, the second all.
fn around() -> Network {
    let space = ObjectSpace::Rectangular;
    let places: Vec<Vector3> = (0..POINTS).map(noises).collect();
    let (mut photos, mut images) = (vec![], vec![]);
    for index in 0..PHOTOS {
        let (sin, cos) = (TAU * index as f64 / PHOTOS as f64).sin_cos();
        let station = Vector3::new(6.0 * cos, 5.0 * sin, 0.5 * noise(index));
        let back = station.normalize();
        let right = Vector3::z().cross(&back).normalize();
        let attitude = Matrix3::from_columns(&[right, back.cross(&right), back]);
        let orientation = Orientation::stepping(space, station.into(), &attitude);
        let view = photocore::geometry::View { orientation, camera: CAMERA };
        for (point, place) in places.iter().enumerate().filter(|(point, _)| index == 1 || *point != index) {
            let [x, y] = view.project(&At::new(space, (*place).into()));
            let n = 2 * images.len();
            let xy = [x + SD * noise(n), y + SD * noise(n + 1)];
            images.push(Image { photo: index, point, xy, sd: [SD; 2] });
        }
        let start = station + 0.05 * noises(40 + index);
        let [omega, phi, kappa] =
            NUMBERS.numbers(&(attitude * angle_axis_rotation(&(0.02 * noises(80 + index)))));
        let pose = [start.x, start.y, start.z, omega, phi, kappa];
        photos.push(Photo::known(pose, [FREE; 6], 0));
    }
    let point = |place: &Vector3| Point { coordinates: (*place).into(), sd: [FREE; 3] };
    let poses = PoseNumbers::Angles(RotationSense::GroundToPhoto);
    let points = places.iter().map(point).collect();
    Network {
        space,
        poses,
        cameras: vec![Camera::held(CAMERA.into())],
        photos,
        points,
        images,
        ..Network::new()
    }
}

fn threads() -> Threads {
    Threads::new(2).unwrap()
}

fn options(method: Method) -> Options {
    let adjustment = adjustment::Options { method, max_iterations: 200, ..Default::default() };
    Options { adjustment, ..Options::default() }
}

const FINE: Method = Method::Damped(Stop::Fraction(1e-9));

fn adjust(network: &Network, method: Method) -> Result<Solution, NetworkError> {
    network.adjustment(&options(method)).run_in(&mut Context::new(&threads()))
}

fn in_datum(network: &Network, inner: &InnerConstraints) -> Result<Solution, NetworkError> {
    network.adjustment(&options(FINE)).in_datum(inner).run_in(&mut Context::new(&threads()))
}

/// Returns the design matrix at the adjusted values, for unit weight: points, then positions and rotation steps of the photos.
fn design(network: &Network, solution: &Solution) -> Mat<f64> {
    let mut a = Mat::zeros(2 * network.images.len(), 3 * POINTS + 6 * PHOTOS);
    for (index, image) in network.images.iter().enumerate() {
        let [x, y, z, omega, phi, kappa] = solution.photos[image.photo].pose;
        let attitude = NUMBERS.attitude([omega, phi, kappa]);
        let orientation = Orientation::stepping(network.space, [x, y, z], &attitude);
        let point = At::new(network.space, solution.points[image.point].unwrap().coordinates);
        let u = orientation.to_camera_frame(&point);
        let gradients = CAMERA.linearize(&u).by_u;
        for (row, gradient) in gradients.iter().enumerate() {
            let (by_photo, by_point) = orientation.chain(&u, gradient, &point);
            (0..3).for_each(|k| a[(2 * index + row, 3 * image.point + k)] = by_point[k] / SD);
            (0..6).for_each(|k| a[(2 * index + row, 3 * POINTS + 6 * image.photo + k)] = by_photo[k] / SD);
        }
    }
    a
}

/// Returns S Q S^T with S = I - G (B^T G)^-1 B^T. Q is the pseudo-inverse of A^T A, G its null space, `carriers` the rows of B.
fn dense(a: &Mat<f64>, carriers: &[usize]) -> Mat<f64> {
    let eigen = (a.transpose() * a).self_adjoint_eigen(Side::Lower).unwrap();
    let (values, vectors) = (eigen.S(), eigen.U());
    let count = vectors.nrows();
    assert!(values[6] < 1e-9 * values[count - 1] && values[7] > 1e-9 * values[count - 1], "seven are open");
    let part = |i: usize, k: usize| if k < 7 { 0.0 } else { vectors[(i, k)] / values[k] };
    let q = Mat::from_fn(count, count, part) * vectors.transpose();
    let g = Mat::from_fn(count, 7, |i, k| vectors[(i, k)]);
    let b = Mat::from_fn(count, 7, |i, k| if carriers.contains(&i) { g[(i, k)] } else { 0.0 });
    let product = b.transpose() * &g;
    let inverse = faer::linalg::solvers::DenseSolveCore::inverse(&product.partial_piv_lu());
    let s = Mat::<f64>::identity(count, count) - &g * inverse * b.transpose();
    &s * q * s.transpose()
}

/// Returns the largest difference of the cofactors of points and positions from dense ones, relative to the largest of the block.
fn difference(solution: &Solution, q: &Mat<f64>) -> f64 {
    let block = |first: usize, found: &dyn Fn(usize, usize) -> f64| {
        let largest = (0..3).map(|k| q[(first + k, first + k)]).fold(0.0, f64::max);
        let each = (0..9).map(|at| (found(at / 3, at % 3) - q[(first + at / 3, first + at % 3)]).abs());
        each.fold(0.0, f64::max) / largest
    };
    let points = (0..POINTS).map(|i| block(3 * i, &|k, m| solution.points[i].unwrap().cofactors[(k, m)]));
    let photos =
        (0..PHOTOS).map(|i| block(3 * POINTS + 6 * i, &|k, m| solution.photos[i].cofactors[6 * k + m]));
    points.chain(photos).fold(0.0, f64::max)
}

fn redundancies(solution: &Solution) -> Vec<f64> {
    solution.images.iter().flat_map(|image| image.unwrap().redundancy).collect()
}

#[test]
fn a_network_without_control_is_adjusted_by_any_method() {
    let network = around();
    let expected = adjust(&network, FINE).unwrap();
    for method in [
        Method::default(),
        Method::TrustRegion(Stop::Decrease(1e-13)),
        Method::Full(Published::Percent(1e-8)),
    ] {
        let found = adjust(&network, method).unwrap();
        assert_eq!(found.adjustment.status, Status::Converged, "{method:?}");
        // The second photo has most observations; the fourth photo's X has the largest difference among the other coordinates.
        assert_eq!(found.datum.held[..6], [0, 1, 2, 3, 4, 5].map(|unknown| (1, unknown)));
        assert_eq!(found.datum.held[6..], [(3, 0)]);
        let freedom = 2 * network.images.len() as i64 - (3 * POINTS + 6 * PHOTOS) as i64 + 7;
        assert_eq!(found.degrees_of_freedom, freedom);
        let redundancy: f64 = redundancies(&found).iter().sum();
        assert!((redundancy - freedom as f64).abs() < 1e-6, "{method:?} {redundancy}");
        let ratio = found.sums_of_squares.total() / expected.sums_of_squares.total();
        assert!((ratio - 1.0).abs() < 1e-8, "{method:?} {ratio}");
    }
    let held = &expected.photos[1];
    assert_eq!(held.pose[..3], network.photos[1].pose[..3], "held where it started");
    assert!(held.cofactors.iter().all(|&q| q == 0.0));
}

#[test]
fn inner_constraints_are_those_of_the_pseudo_inverse() {
    let network = around();
    let minimal = adjust(&network, FINE).unwrap();
    let points: Vec<usize> = (0..POINTS).collect();
    let photos: Vec<usize> = (0..PHOTOS).collect();
    for (points, photos) in [
        (points.clone(), vec![]),
        (vec![], photos.clone()),
        (points[2..6].to_vec(), vec![0, 3]),
        (points, photos),
    ] {
        let inner = InnerConstraints {
            points: points.clone(),
            photos: photos.clone(),
            scale: true,
            ..Default::default()
        };
        let found = in_datum(&network, &inner).unwrap();
        let carriers: Vec<usize> = points
            .iter()
            .map(|point| 3 * point)
            .chain(photos.iter().map(|photo| 3 * POINTS + 6 * photo))
            .flat_map(|first| first..first + 3)
            .collect();
        let a = design(&network, &found);
        let difference = difference(&found, &dense(&a, &carriers));
        assert!(difference < 1e-9, "{difference:e}");

        // The differences of the carriers from their initial positions have a zero component along every datum motion.
        let places =
            points.iter().map(|&i| (found.points[i].unwrap().coordinates, network.points[i].coordinates));
        let stations = photos.iter().map(|&i| {
            [found.photos[i].pose, network.photos[i].pose].map(|pose| [pose[0], pose[1], pose[2]]).into()
        });
        let moved: Vec<(Vector3, Vector3)> = places
            .chain(stations)
            .map(|(at, was): ([f64; 3], [f64; 3])| (at.into(), Vector3::from(at) - Vector3::from(was)))
            .collect();
        let shift: Vector3 = moved.iter().map(|(_, by)| by).sum();
        let turn: Vector3 = moved.iter().map(|(at, by)| at.cross(by)).sum();
        let scale: f64 = moved.iter().map(|(at, by)| at.dot(by)).sum();
        assert!(shift.amax() < 1e-11 && turn.amax() < 1e-10 && scale.abs() < 1e-10, "{shift} {turn} {scale}");

        // Quantities that are invariant under a change of the datum.
        for (r, expected) in redundancies(&found).iter().zip(redundancies(&minimal)) {
            assert!((r - expected).abs() < 1e-9);
        }
        let distance = |solution: &Solution| {
            let [a, b, c] = [0, 5, 9].map(|i| Vector3::from(solution.points[i].unwrap().coordinates));
            (a - b).norm() / (a - c).norm()
        };
        assert!((distance(&found) - distance(&minimal)).abs() < 1e-10);
    }
}

/// Returns the full cofactor matrix of photos (position and rotation step) and points, in the order of [`design`].
fn whole(network: &Network, solution: &Solution, datum: Option<&NetworkDatum>) -> Mat<f64> {
    let (options, threads) = (options(FINE), threads());
    let covariances =
        network.covariances(&options, &solution.state, datum, &mut Context::new(&threads)).unwrap();
    let of: Vec<Of> = (0..POINTS).map(Of::Point).chain((0..PHOTOS).map(Of::PhotoStep)).collect();
    let found = covariances.cofactors(&of, None, &mut Context::new(&threads)).unwrap();
    let count = 3 * POINTS + 6 * PHOTOS;
    Mat::from_fn(count, count, |i, j| found[i * count + j])
}

/// Returns the largest difference of two matrices, relative to their diagonals.
fn greatest(found: &Mat<f64>, expected: &Mat<f64>) -> f64 {
    let count = expected.nrows();
    // Fixed unknowns have zero cofactors.
    let largest = (0..count).map(|i| expected[(i, i)]).fold(0.0, f64::max);
    let sd = |i: usize| expected[(i, i)].max(1e-9 * largest).sqrt();
    let pairs = (0..count).flat_map(|i| (0..count).map(move |j| (i, j)));
    pairs.map(|(i, j)| (found[(i, j)] - expected[(i, j)]).abs() / sd(i) / sd(j)).fold(0.0, f64::max)
}

#[test]
fn cofactors_of_everything_go_over_to_any_datum() {
    let network = around();
    let minimal = adjust(&network, FINE).unwrap();
    let (points, photos): (Vec<usize>, Vec<usize>) = ((0..POINTS).collect(), (0..PHOTOS).collect());
    let step = |photo: &usize| 3 * POINTS + 6 * photo;
    // Fixed: the second photo, and X of the fourth.
    let held: Vec<usize> = (step(&1)..step(&1) + 6).chain([step(&3)]).collect();
    let a = design(&network, &minimal);
    assert!(greatest(&whole(&network, &minimal, None), &dense(&a, &held)) < 1e-8);

    let inner = InnerConstraints {
        points: points.clone(),
        photos: photos.clone(),
        scale: true,
        ..Default::default()
    };
    let found = in_datum(&network, &inner).unwrap();
    let carriers: Vec<usize> =
        (0..3 * POINTS).chain(photos.iter().map(step).flat_map(|first| first..first + 3)).collect();
    let expected = dense(&design(&network, &found), &carriers);
    let difference = greatest(&whole(&network, &found, None), &expected);
    assert!(difference < 1e-8, "{difference:e}");

    // Without another adjustment, from the minimal datum and from a third one.
    let (options, threads) = (options(FINE), threads());
    let datum = NetworkDatum::Inner(inner);
    let two =
        NetworkDatum::Inner(InnerConstraints { points: vec![3, 7, 9], scale: true, ..Default::default() });
    let by_two = network.in_datum(&options, &minimal.state, &two, &mut Context::new(&threads)).unwrap();
    for from in [&minimal, &by_two] {
        let there = network.in_datum(&options, &from.state, &datum, &mut Context::new(&threads)).unwrap();
        for (photo, expected) in there.photos.iter().zip(&found.photos) {
            let position = Vector3::from_column_slice(&photo.pose[..3]);
            assert!((position - Vector3::from_column_slice(&expected.pose[..3])).amax() < 1e-9);
            // The same attitude has other angles if it has passed phi of 90 degrees.
            let [one, other] = [photo, expected]
                .map(|photo| NUMBERS.attitude([photo.pose[3], photo.pose[4], photo.pose[5]]));
            assert!((one - other).amax() < 1e-9);
        }
        assert!(greatest(&whole(&network, &there, None), &expected) < 1e-7);
        for (r, expected) in redundancies(&there).iter().zip(redundancies(&minimal)) {
            assert!((r - expected).abs() < 1e-9);
        }
        assert!(
            there.variance_of_unit_weight.unwrap() / minimal.variance_of_unit_weight.unwrap() - 1.0 < 1e-9
        );
        assert!(
            there.datum.relative_error > 0.0 && there.datum.relative_error < 1e-9,
            "{:e}",
            there.datum.relative_error
        );
    }
}

/// Cofactors relative to a photo equal the result of a fixed photo, and J Q J^T for networks that are not free.
#[test]
fn cofactors_relative_to_a_photo_are_those_of_holding_it() {
    let network = around();
    let found = adjust(&network, FINE).unwrap();
    let step = |photo: usize| 3 * POINTS + 6 * photo;
    let relative = whole(&network, &found, Some(&NetworkDatum::RelativeToPhoto(4)));
    assert!((0..6).all(|k| relative[(step(4) + k, step(4) + k)] == 0.0));
    // The datum fixes the X distance from the fixed to another photo and so the scale; the relative cofactors do not fix it.
    let a = design(&network, &found);
    let (count, g) = (3 * POINTS + 6 * PHOTOS, rigid(&found));
    let b = Mat::from_fn(6, count, |i, j| if j == step(4) + i { 1.0 } else { 0.0 });
    let inverse = faer::linalg::solvers::DenseSolveCore::inverse(&(&b * &g).partial_piv_lu());
    let s = Mat::<f64>::identity(count, count) - &g * inverse * &b;
    let held: Vec<usize> = (step(1)..step(1) + 6).chain([step(3)]).collect();
    let expected = &s * dense(&a, &held) * s.transpose();
    assert!(greatest(&relative, &expected) < 1e-8, "{:e}", greatest(&relative, &expected));

    let mut controlled = network;
    controlled.points[..4].iter_mut().for_each(|point| point.sd = [0.01; 3]);
    let found = adjust(&controlled, FINE).unwrap();
    let (q, g) = (whole(&controlled, &found, None), rigid(&found));
    let inverse = faer::linalg::solvers::DenseSolveCore::inverse(&(&b * &g).partial_piv_lu());
    let s = Mat::<f64>::identity(count, count) - &g * inverse * &b;
    let relative = whole(&controlled, &found, Some(&NetworkDatum::RelativeToPhoto(4)));
    assert!(greatest(&relative, &(&s * &q * s.transpose())) < 1e-8);
    let to_points = whole(&controlled, &found, Some(&NetworkDatum::RelativeToPoints(vec![6, 7, 8, 9])));
    let of_points = |q: &Mat<f64>| (18..30).map(|i| q[(i, i)]).sum::<f64>();
    assert!(of_points(&to_points) < of_points(&q));
}

/// Returns the displacements of points, photos and their axes by shifts and rotations.
fn rigid(solution: &Solution) -> Mat<f64> {
    let mut g = Mat::zeros(3 * POINTS + 6 * PHOTOS, 6);
    let mut put = |first: usize, at: [f64; 3]| {
        for k in 0..3 {
            let turned = Vector3::ith(k, 1.0).cross(&Vector3::from(at));
            (0..3).for_each(|m| {
                (g[(first + m, k)], g[(first + m, 3 + k)]) = (f64::from(u8::from(m == k)), turned[m])
            });
        }
    };
    solution.points.iter().enumerate().for_each(|(i, point)| put(3 * i, point.unwrap().coordinates));
    for (i, photo) in solution.photos.iter().enumerate() {
        let [x, y, z, ..] = photo.pose;
        put(3 * POINTS + 6 * i, [x, y, z]);
    }
    for (i, photo) in solution.photos.iter().enumerate() {
        let [.., omega, phi, kappa] = photo.pose;
        let attitude = NUMBERS.attitude([omega, phi, kappa]);
        for k in 0..3 {
            (0..3).for_each(|m| g[(3 * POINTS + 6 * i + 3 + m, 3 + k)] = attitude[(k, m)]);
        }
    }
    g
}

#[test]
fn scale_stays_where_it_is_held_unless_it_is_asked_for() {
    let network = around();
    let minimal = adjust(&network, FINE).unwrap();
    let inner = InnerConstraints { points: (0..POINTS).collect(), ..Default::default() };
    let found = in_datum(&network, &inner).unwrap();
    for (a, b) in [(0, 1), (3, 11), (7, 2)] {
        let distance = |solution: &Solution| {
            let [a, b] = [a, b].map(|i| Vector3::from(solution.points[i].unwrap().coordinates));
            (a - b).norm()
        };
        assert!((distance(&found) - distance(&minimal)).abs() < 1e-10);
    }
}

#[test]
fn what_is_not_free_or_not_carried_is_refused() {
    let network = around();
    let inner = |points: Vec<usize>| InnerConstraints { points, scale: true, ..Default::default() };
    let not_carried = Some(NetworkError::Datum(DatumError::NotCarried));
    assert_eq!(in_datum(&network, &inner(vec![])).err(), not_carried);
    assert_eq!(
        in_datum(&network, &inner(vec![0, 1])).err(),
        not_carried,
        "a line carries no turn about itself"
    );
    let mut controlled = network;
    controlled.points[..4].iter_mut().for_each(|point| point.sd = [0.01; 3]);
    assert_eq!(
        in_datum(&controlled, &inner((0..9).collect())).err(),
        Some(NetworkError::Datum(DatumError::NotFree))
    );
}

#[test]
fn known_attitudes_leave_place_and_scale_open() {
    let mut network = around();
    network.photos.iter_mut().for_each(|photo| photo.sd[3..].fill(0.01));
    let found = adjust(&network, FINE).unwrap();
    assert_eq!(found.datum.held, [(1, 0), (1, 1), (1, 2), (3, 0)]);
    let redundancy: f64 = redundancies(&found).iter().sum();
    let of_angles: f64 = found.photos.iter().flat_map(|photo| &photo.redundancy).sum();
    assert!((redundancy + of_angles - found.degrees_of_freedom as f64).abs() < 1e-6);
}

#[test]
fn geographic_networks_are_free_to_move_too() {
    let ellipsoid = Ellipsoid::new(6_378_137.0, 6_356_752.314_2).unwrap();
    let space = ObjectSpace::Geographic(ellipsoid);
    let flat = around();
    // Scaled from metres to kilometres, on the ground at 9 degrees east, 48 north.
    let place =
        |at: [f64; 3]| [0.157 + at[0] * 1e3 / 4.27e6, 0.838 + at[1] * 1e3 / 6.37e6, 500.0 + 100.0 * at[2]];
    let mut network = Network { space, images: vec![], ..flat.clone() };
    for (point, of) in network.points.iter_mut().zip(&flat.points) {
        point.coordinates = place(of.coordinates);
    }
    for (index, photo) in network.photos.iter_mut().enumerate() {
        let [longitude, latitude, height] = place([noise(index), noise(index + 20), 40.0]);
        let angles = [0.05 * noise(index + 50), 0.05 * noise(index + 60), noise(index + 70)];
        let attitude = NUMBERS.attitude(angles);
        let orientation = Orientation::stepping(space, [longitude, latitude, height], &attitude);
        let view = photocore::geometry::View { orientation, camera: CAMERA };
        for (point, at) in network.points.iter().enumerate() {
            let [x, y] = view.project(&At::new(space, at.coordinates));
            let n = 2 * network.images.len();
            let xy = [x + SD * noise(n), y + SD * noise(n + 1)];
            network.images.push(Image { photo: index, point, xy, sd: [SD; 2] });
        }
        photo.pose = [longitude, latitude, height, angles[0], angles[1], angles[2]];
    }
    // Geocentric coordinates are accurate to a nanometre.
    let minimal = adjust(&network, Method::default()).unwrap();
    assert_eq!((minimal.adjustment.status, minimal.datum.held.len()), (Status::Converged, 7));
    let inner = InnerConstraints {
        points: (0..POINTS).collect(),
        photos: (0..PHOTOS).collect(),
        scale: true,
        ..Default::default()
    };
    let mut given = options(Method::default());
    given.start = Start::Given;
    let found = network.adjustment(&given).in_datum(&inner).run_in(&mut Context::new(&threads())).unwrap();
    for (r, expected) in redundancies(&found).iter().zip(redundancies(&minimal)) {
        assert!((r - expected).abs() < 1e-6);
    }
    // Its points are more precise than with one fixed photo.
    let height = |solution: &Solution| {
        solution.points.iter().map(|point| point.unwrap().cofactors[(2, 2)]).sum::<f64>()
    };
    assert!(height(&found) < height(&minimal));
}
