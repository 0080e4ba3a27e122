//! Features through points: derivatives, known results, invariance, dispersion, errors.

use photocore::geometry::{Matrix3, Vector3, angle_axis_rotation};
use photocore::nalgebra::{DMatrix, DVector};
use photogram_programs::features::{FeatureError, Form, Measured, distance, measure};

const FORMS: [Form; 5] = [Form::Line, Form::Plane, Form::Circle, Form::Sphere, Form::Cylinder];

/// Reproducible generator of numbers between -1 and 1.
struct Numbers(u64);

impl Numbers {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// Returns a normally distributed number as the sum of twelve.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| 0.5 * self.uniform()).sum()
    }

    fn vector(&mut self) -> Vector3 {
        Vector3::from_fn(|_, _| self.uniform())
    }
}

/// Returns points near a feature of diameter 2.4, in its frame.
fn points(form: Form, count: usize, spread: f64, numbers: &mut Numbers) -> Vec<Vector3> {
    let turn = std::f64::consts::TAU / count as f64;
    (0..count)
        .map(|k| {
            let (sin, cos) = (turn * k as f64 * 0.8).sin_cos();
            let along = 1.5 * numbers.uniform();
            let on = match form {
                Form::Line => Vector3::new(0.0, 0.0, along),
                Form::Plane => Vector3::new(along, 1.5 * numbers.uniform(), 0.0),
                Form::Circle => Vector3::new(1.2 * cos, 1.2 * sin, 0.0),
                Form::Sphere => numbers.vector().normalize() * 1.2,
                Form::Cylinder => Vector3::new(1.2 * cos, 1.2 * sin, along),
            };
            on + spread * numbers.vector()
        })
        .collect()
}

fn placed(points: &[Vector3], turn: &Matrix3, shift: Vector3, scale: f64) -> Vec<Vector3> {
    points.iter().map(|p| scale * (turn * p) + shift).collect()
}

fn some_turn() -> Matrix3 {
    angle_axis_rotation(&Vector3::new(0.4, -0.7, 0.3))
}

/// Returns a full covariance matrix of `count` points.
fn covariance(count: usize, sd: f64, numbers: &mut Numbers) -> DMatrix<f64> {
    let root = DMatrix::from_fn(3 * count, 3 * count, |_, _| numbers.uniform());
    let square = &root * root.transpose() / count as f64 + DMatrix::identity(3 * count, 3 * count);
    square * sd * sd
}

fn values(found: &Measured) -> DVector<f64> {
    DVector::from_iterator(found.quantities.len(), found.quantities.iter().map(|each| each.value))
}

fn all_deviations(found: &Measured) -> Vec<[f64; 2]> {
    found.deviations.iter().map(|each| [each.value, each.axial]).collect()
}

/// The partials of the values with respect to the points agree with differences, even for form deviations of a tenth.
#[test]
fn covariances_follow_the_points() {
    for form in FORMS {
        let mut numbers = Numbers(7);
        let points =
            placed(&points(form, 9, 0.1, &mut numbers), &some_turn(), Vector3::new(5., -3., 9.), 1.0);
        let given = covariance(9, 1e-3, &mut numbers);
        let found = measure(form, &points, &given).unwrap();
        let step = 1e-5;
        let moved = |k: usize, by: f64| {
            let mut points = points.clone();
            points[k / 3][k % 3] += by;
            measure(form, &points, &given).unwrap()
        };
        let (mut partials, mut of_points) =
            (DMatrix::zeros(found.quantities.len(), 27), DMatrix::zeros(18, 27));
        for k in 0..27 {
            let (after, before) = (moved(k, step), moved(k, -step));
            partials.set_column(k, &((values(&after) - values(&before)) / (2.0 * step)));
            let pairs = all_deviations(&after).into_iter().zip(all_deviations(&before)).enumerate();
            for (row, (a, b)) in pairs {
                (0..2).for_each(|j| of_points[(2 * row + j, k)] = (a[j] - b[j]) / (2.0 * step));
            }
        }
        let expected = &partials * &given * partials.transpose();
        let scale = expected.diagonal().map(f64::sqrt);
        for (i, j) in (0..expected.nrows()).flat_map(|i| (0..expected.nrows()).map(move |j| (i, j))) {
            let difference = (found.covariance[(i, j)] - expected[(i, j)]) / (scale[i] * scale[j]);
            assert!(difference.abs() < 1e-7, "{form:?} {i} {j}: {difference}");
        }
        let spread = &of_points * &given * of_points.transpose();
        for (row, each) in found.deviations.iter().enumerate() {
            let expected = [2 * row, 2 * row + 1].map(|k| spread[(k, k)].sqrt());
            assert!((each.sd / expected[0] - 1.0).abs() < 1e-6, "{form:?} {row}");
            assert!((each.axial_sd - expected[1]).abs() < 1e-6 * expected[0], "{form:?} {row}");
        }
    }
}

/// Points on a feature determine it to all digits, at any position.
#[test]
fn exact_features_are_found() {
    let mut numbers = Numbers(3);
    for (scale, shift) in
        [(1.0, Vector3::zeros()), (1e-3, Vector3::new(4e3, -2e3, 1e2)), (5e4, Vector3::zeros())]
    {
        for form in FORMS {
            let turn = angle_axis_rotation(&(3.0 * numbers.vector()));
            let points = placed(&points(form, 12, 0.0, &mut numbers), &turn, shift, scale);
            let found = measure(form, &points, &(DMatrix::identity(36, 36) * 1e-12 * scale * scale)).unwrap();
            let rounding = 1e-12 * shift.norm() + 1e-11 * scale;
            if let Some(diameter) = found.of("diameter") {
                assert!((diameter.value - 2.4 * scale).abs() < rounding, "{form:?} {}", diameter.value);
            }
            assert!(found.deviations.iter().all(|each| each.value.abs() < rounding), "{form:?}");
            let names = found.quantities.iter().filter(|each| !each.is_length);
            let axis = Vector3::from_iterator(names.map(|each| each.value).chain([0.0; 3]));
            if form != Form::Sphere {
                let angle = axis.cross(&turn.column(2)).norm();
                assert!(angle < 4.0 * rounding / scale, "{form:?}: {angle}");
            }
        }
    }
}

/// Values are invariant or equivariant under rotation, shift, change of unit and change of order.
#[test]
fn values_go_with_the_points() {
    for form in FORMS {
        let mut numbers = Numbers(11);
        let first = points(form, 10, 0.05, &mut numbers);
        let given = DMatrix::identity(30, 30) * 1e-6;
        let found = measure(form, &first, &given).unwrap();
        let mut reversed = first.clone();
        reversed.reverse();
        let there = placed(&first, &some_turn(), Vector3::new(1e3, 2e3, -50.0), 1e3);
        let others = [(reversed, 1.0, 1e-11), (there, 1e3, 1e-9)];
        for (points, scale, rounding) in others {
            let other = measure(form, &points, &(&given * scale * scale)).unwrap();
            for name in ["diameter", "straightness", "flatness", "roundness", "sphericity", "cylindricity"] {
                let (Some(a), Some(b)) = (found.of(name), other.of(name)) else { continue };
                assert!((a.value - b.value / scale).abs() < rounding, "{form:?} {name}");
                assert!((a.sd / (b.sd / scale) - 1.0).abs() < 1e-6, "{form:?} {name}");
            }
            let [a, b] = [&found, &other].map(|each| each.test.unwrap());
            assert!((a.statistic / b.statistic - 1.0).abs() < 1e-6 && a.freedom == b.freedom, "{form:?}");
        }
    }
}

/// Standard deviations agree with repeated measurements, and the form test is chi-square distributed.
#[test]
fn draws_spread_as_predicted() {
    let draws = 1000;
    for form in FORMS {
        let mut numbers = Numbers(5);
        // Form deviations are large compared with the errors, so that the extreme points are the same in every draw.
        let shaped = points(form, 9, 0.05, &mut numbers);
        let perfect = points(form, 9, 0.0, &mut numbers);
        let given = covariance(9, 2e-4, &mut numbers);
        let root = given.clone().cholesky().unwrap().l();
        let predicted = measure(form, &shaped, &given).unwrap();
        let (mut squares, mut statistic) = (DVector::zeros(predicted.quantities.len()), 0.0);
        for _ in 0..draws {
            let errors = &root * DVector::from_fn(27, |_, _| numbers.normal());
            let with = |points: &[Vector3]| -> Vec<Vector3> {
                points.iter().enumerate().map(|(k, p)| p + errors.fixed_rows::<3>(3 * k)).collect()
            };
            let found = measure(form, &with(&shaped), &given).unwrap();
            squares += (values(&found) - values(&predicted)).map(|each| each * each);
            statistic += measure(form, &with(&perfect), &given).unwrap().test.unwrap().statistic;
        }
        for (each, square) in predicted.quantities.iter().zip(squares.iter()) {
            let ratio = (square / f64::from(draws)).sqrt() / each.sd;
            // Four standard deviations of a standard deviation.
            assert!(
                (ratio - 1.0).abs() < 4.0 / f64::from(2 * draws).sqrt(),
                "{form:?} {}: {ratio}",
                each.name
            );
        }
        let freedom = predicted.test.unwrap().freedom as f64;
        let mean = statistic / f64::from(draws);
        assert!((mean - freedom).abs() < 4.0 * (2.0 * freedom / f64::from(draws)).sqrt(), "{form:?}: {mean}");
    }
}

/// The test equals the weighted fit with a generalised inverse of the covariance C_d of the deviations.
#[test]
fn a_free_datum_leaves_the_test_as_it_is() {
    let mut numbers = Numbers(21);
    let points = points(Form::Plane, 8, 1e-3, &mut numbers);
    let given = DMatrix::identity(24, 24) * 1e-6;
    // Covariances in the datum of these points, without shifts and rotations.
    let mut motions = DMatrix::zeros(24, 6);
    for (k, p) in points.iter().enumerate() {
        motions.fixed_view_mut::<3, 3>(3 * k, 0).copy_from(&Matrix3::identity());
        motions.fixed_view_mut::<3, 3>(3 * k, 3).copy_from(&p.cross_matrix());
    }
    let inverse = (motions.transpose() * &motions).try_inverse().unwrap();
    let out = DMatrix::identity(24, 24) - &motions * inverse * motions.transpose();
    let inner = &out * &given * out.transpose();
    let [a, b] = [&given, &inner].map(|each| measure(Form::Plane, &points, each).unwrap().test.unwrap());
    assert!((a.statistic / b.statistic - 1.0).abs() < 1e-9, "{} {}", a.statistic, b.statistic);
}

#[test]
fn distances_have_the_covariance_of_both_ends() {
    let ends = [Vector3::new(1.0, 2.0, 2.0), Vector3::zeros()];
    let mut given = DMatrix::identity(6, 6) * 1e-6;
    assert!((distance(&ends, &given).unwrap().quantities[0].sd - 2f64.sqrt() * 1e-3).abs() < 1e-15);
    // Common errors do not change the distance.
    given.fixed_view_mut::<3, 3>(0, 3).copy_from(&(Matrix3::identity() * 1e-6));
    given.fixed_view_mut::<3, 3>(3, 0).copy_from(&(Matrix3::identity() * 1e-6));
    let found = distance(&ends, &given).unwrap();
    assert!((found.quantities[0].value - 3.0).abs() < 1e-15 && found.quantities[0].sd < 1e-12);
    assert_eq!(distance(&[ends[0]; 2], &given), Err(FeatureError::Coincident));
}

#[test]
fn what_points_leave_open_is_refused() {
    let good = |points: &[Vector3]| DMatrix::identity(3 * points.len(), 3 * points.len()) * 1e-12;
    let line: Vec<Vector3> = (0..8).map(|k| Vector3::new(f64::from(k), 2.0 * f64::from(k), 1.0)).collect();
    let ring: Vec<Vector3> =
        (0..8).map(|k| Vector3::new((0.7 * f64::from(k)).cos(), (0.7 * f64::from(k)).sin(), 3.0)).collect();
    let corners: Vec<Vector3> =
        (0..8).map(|k| Vector3::from_fn(|axis, _| f64::from(k >> axis & 1))).collect();
    let refused = |form: Form, points: &[Vector3]| measure(form, points, &good(points)).unwrap_err();
    for form in FORMS {
        let few = &ring[..form.needed() - 1];
        assert_eq!(refused(form, few), FeatureError::TooFew { form, given: few.len() });
        assert_eq!(refused(form, &[ring[0]; 7]), FeatureError::Undetermined(form));
        let mut wild = ring.clone();
        wild[1].x = f64::NAN;
        assert_eq!(refused(form, &wild), FeatureError::NotFinite);
        assert_eq!(
            measure(form, &ring, &DMatrix::identity(8, 8)),
            Err(FeatureError::Shape { points: 8, rows: 8, columns: 8 })
        );
    }
    for form in [Form::Plane, Form::Circle, Form::Sphere, Form::Cylinder] {
        assert_eq!(refused(form, &line), FeatureError::Undetermined(form), "{form:?}");
    }
    for form in [Form::Sphere, Form::Cylinder] {
        assert_eq!(refused(form, &ring), FeatureError::Undetermined(form), "{form:?}");
    }
    assert_eq!(refused(Form::Cylinder, &corners), FeatureError::Ambiguous(Form::Cylinder));
    // Nearly collinear points with errors as large as their deviation do not determine a plane.
    let hair: Vec<Vector3> =
        line.iter().enumerate().map(|(k, p)| p + Vector3::new(0.0, 0.0, 1e-3 * (k * k) as f64)).collect();
    let found = measure(Form::Plane, &hair, &(DMatrix::identity(24, 24) * 1e-4));
    assert!(matches!(found, Err(FeatureError::Loose { form: Form::Plane, .. })), "{found:?}");
}
