//! Poses and attitudes in every representation: round trips, and golden data if available.

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stderr)]

use std::f64::consts::{FRAC_PI_2, PI};

use photocore::geometry::angle_axis::{
    angle_axis_rotation, quaternion, quaternion_rotation, right_jacobian_inverse, rotation_angle_axis,
};
use photocore::geometry::attitude::{quaternion_by_step, vision_axes};
use photocore::geometry::{
    AttitudeNumbers, Ellipsoid, Matrix3, ObjectSpace, Orientation, Point, Pose, PoseNumbers, RotationSense,
    Vector3,
};
use proptest::prelude::*;
use serde_json::Value;

use crate::golden::{golden, list, rows};

const ALL: [fn() -> AttitudeNumbers; 9] = [
    || AttitudeNumbers::OmegaPhiKappa(RotationSense::GroundToPhoto),
    || AttitudeNumbers::OmegaPhiKappa(RotationSense::PhotoToGround),
    || AttitudeNumbers::PhiOmegaKappa,
    || AttitudeNumbers::AzimuthTiltSwing,
    || AttitudeNumbers::YawPitchRoll(AttitudeNumbers::nadir_boresight(0)),
    || AttitudeNumbers::YawPitchRoll(AttitudeNumbers::nadir_boresight(3)),
    || AttitudeNumbers::RotationVector,
    || AttitudeNumbers::RotationVectorToPhoto,
    || AttitudeNumbers::RotationVectorToVision,
];

fn any_attitude() -> impl Strategy<Value = Matrix3> {
    (prop::array::uniform3(-1.0..1.0f64), prop_oneof![0.0..PI, Just(0.0), (PI - 1e-6)..PI]).prop_map(
        |(axis, angle)| {
            angle_axis_rotation(&(Vector3::from(axis).try_normalize(1e-3).unwrap_or(Vector3::x()) * angle))
        },
    )
}

/// Returns the numerical derivatives of the numbers with respect to rho, by central differences: rho = K d(numbers).
fn numeric_step(numbers: AttitudeNumbers, attitude: &Matrix3) -> Matrix3 {
    const STEP: f64 = 1e-5;
    Matrix3::from_columns(&[0, 1, 2].map(|k| {
        let ends = [STEP, -STEP].map(|step| {
            let rho = Vector3::ith(k, step);
            let found = numbers.numbers(&(attitude * angle_axis_rotation(&rho)));
            Vector3::from(found)
        });
        (ends[0] - ends[1]).map(|change| change - 2.0 * PI * (change / (2.0 * PI)).round()) / (2.0 * STEP)
    }))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn every_representation_gives_its_matrix_back(attitude in any_attitude()) {
        for numbers in ALL.map(|make| make()) {
            let found = numbers.numbers(&attitude);
            let back = numbers.attitude(found);
            prop_assert!((back - attitude).amax() < 2e-8, "{numbers:?} {found:?}");
            if !numbers.is_singular(found) {
                prop_assert!((back - attitude).amax() < 1e-13, "{numbers:?} {found:?}: {:e}", (back - attitude).amax());
            }
        }
        let q = quaternion(&attitude);
        prop_assert!((quaternion_rotation(q) - attitude).amax() < 1e-13 && q[0] >= 0.0);
    }

    #[test]
    fn rates_are_those_of_small_steps(attitude in any_attitude()) {
        for numbers in ALL.map(|make| make()) {
            let found = numbers.numbers(&attitude);
            let Some(inverse) = numbers.rates(found).try_inverse() else { continue };
            // Differences are invalid near a singular attitude, and at the jump of a rotation vector at 180 degrees.
            let vector = Vector3::from(found).norm();
            let jumps = format!("{numbers:?}").starts_with("RotationVector") && vector > PI - 1e-3;
            if inverse.amax() < 30.0 && !jumps {
                let expected = numeric_step(numbers, &attitude);
                prop_assert!((inverse - expected).amax() < 1e-5 * inverse.amax().powi(3).max(1.0), "{numbers:?} {found:?}\n{inverse} {expected}");
            }
        }
    }

    #[test]
    fn a_pose_steps_about_its_own_axes(
        attitude in any_attitude(),
        rho in prop::array::uniform3(-1e-7..1e-7f64),
        shift in prop::array::uniform3(-1e-7..1e-7f64),
        point in prop::array::uniform3(-1.0..1.0f64),
    ) {
        let (rho, shift, point) = (Vector3::from(rho), Vector3::from(shift), Vector3::from(point));
        let pose = Pose { position: Vector3::new(0.3, -0.2, 5.0), attitude };
        let stepped = pose.step(&shift, &rho);
        let u = pose.to_camera_frame(&point);
        let expected = u.cross(&rho) - attitude.tr_mul(&shift);
        prop_assert!((stepped.to_camera_frame(&point) - u - expected).amax() < 1e-12);
        prop_assert!((stepped.attitude.tr_mul(&stepped.attitude) - Matrix3::identity()).amax() < 1e-15);
        prop_assert!((stepped.depth(&point) + stepped.to_camera_frame(&point).z).abs() < 1e-15);
    }

    #[test]
    fn both_sets_of_pose_numbers_move_what_is_seen_as_differences_do(
        attitude in prop::array::uniform3(-1.3..1.3f64),
        position in prop::array::uniform3(-3.0..3.0f64),
        point in prop::array::uniform3(-1.0..1.0f64),
        g in prop::array::uniform3(-1.0..1.0f64),
    ) {
        let point = Point::new(ObjectSpace::Rectangular, point);
        let g = Vector3::from(g);
        let [a, b, c] = attitude;
        let [x, y, z] = position;
        let values = [x, y, z, a, b, c];
        for numbers in [
            PoseNumbers::Angles(RotationSense::GroundToPhoto), PoseNumbers::Angles(RotationSense::PhotoToGround), PoseNumbers::Vectors,
        ] {
            let place = |values: &[f64; 6]| Orientation::new(numbers, ObjectSpace::Rectangular, values);
            let placed = place(&values);
            let (partials, _) = placed.chain(&placed.to_camera_frame(&point), &g, &point);
            for k in 0..6 {
                let ends = [1e-5, -1e-5].map(|step| {
                    let mut moved = values;
                    moved[k] += step;
                    place(&moved).to_camera_frame(&point).dot(&g)
                });
                let expected = (ends[0] - ends[1]) / 2e-5;
                prop_assert!((partials[k] - expected).abs() < 1e-8, "{numbers:?} {k}: {} {expected}", partials[k]);
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    #[test]
    fn attitudes_step_by_rotation_vectors_whatever_phi_is(
        omega in -PI..PI,
        phi in prop_oneof![-1.3..1.3f64, Just(FRAC_PI_2), Just(-FRAC_PI_2), (FRAC_PI_2 - 1e-7)..(FRAC_PI_2 + 1e-7), 1.6..3.0f64],
        kappa in -PI..PI,
        rho in prop::array::uniform3(-0.3..0.3f64),
        position in prop_oneof![
            (Just(ObjectSpace::Rectangular), [-3.0..3.0f64, -3.0..3.0, -3.0..3.0]),
            (Just(ObjectSpace::Geographic(Ellipsoid::new(6_378_137.0, 6_356_752.3).unwrap())), [-3.0..3.0f64, -1.2..1.2, 0.0..3000.0]),
        ],
        g in prop::array::uniform3(-1.0..1.0f64),
    ) {
        let ((space, position), g) = (position, Vector3::from(g));
        let angles = [omega, phi, kappa];
        for sense in [RotationSense::GroundToPhoto, RotationSense::PhotoToGround] {
            let numbers = AttitudeNumbers::OmegaPhiKappa(sense);
            let local = numbers.attitude(angles);
            let stepped = sense.stepped(angles, &Vector3::from(rho));
            let expected = local * angle_axis_rotation(&Vector3::from(rho));
            prop_assert!((numbers.attitude(stepped) - expected).amax() < 1e-14, "{stepped:?}");
            // Outside of the gimbal lock the angles change as little as the attitude does.
            if phi.cos().abs() > 0.5 {
                let small = sense.stepped(angles, &(1e-3 * Vector3::from(rho)));
                prop_assert!((0..3).all(|k| (small[k] - angles[k]).abs() < 2e-3), "{angles:?} {small:?}");
            }

            // Partials at a point some metres away, by differences.
            let photo = Orientation::stepping(space, position, &local);
            let at = photo.centre() + Vector3::new(3.0, -5.0, 4.0);
            let point = Point::new(ObjectSpace::Rectangular, at.into());
            let (partials, _) = photo.chain(&photo.to_camera_frame(&point), &g, &point);
            for k in 0..3 {
                let ends = [1e-5, -1e-5].map(|step| {
                    let turned = local * angle_axis_rotation(&Vector3::ith(k, step));
                    Orientation::stepping(space, position, &turned).to_camera_frame(&point).dot(&g)
                });
                let expected = (ends[0] - ends[1]) / 2e-5;
                // Geocentric coordinates are accurate to a nanometre.
                prop_assert!((partials[3 + k] - expected).abs() < 5e-4, "{k}: {} {expected}", partials[3 + k]);
                prop_assert!(space != ObjectSpace::Rectangular || (partials[3 + k] - expected).abs() < 1e-8);
            }
            // In angles K relates the two.
            let rates = numbers.rates(angles);
            let (by_angles, _) = Orientation::from_angles(space, sense, position, angles).chain(&photo.to_camera_frame(&point), &g, &point);
            let expected = rates.tr_mul(&Vector3::new(partials[3], partials[4], partials[5]));
            prop_assert!((0..3).all(|k| by_angles[k] == partials[k] && (by_angles[3 + k] - expected[k]).abs() < 1e-13));
        }
    }
}

#[test]
fn at_phi_of_ninety_degrees_only_the_report_in_angles_notices() {
    for sense in [RotationSense::GroundToPhoto, RotationSense::PhotoToGround] {
        let numbers = AttitudeNumbers::OmegaPhiKappa(sense);
        let attitude = numbers.attitude([0.4, FRAC_PI_2, 0.3]);
        let found = numbers.numbers(&attitude);
        assert!(numbers.is_singular(found) && found[2] == 0.0);
        assert!((found[0] - 0.7).abs() < 1e-14 && (found[1] - FRAC_PI_2).abs() < 1e-14);
        assert!((numbers.attitude(found) - attitude).amax() < 1e-15);
        assert!(numbers.cofactors(found, &Matrix3::identity()).is_none());
        assert!(!numbers.is_singular([0.0, PI, 0.0]));
    }
}

fn matrix(value: &Value) -> Matrix3 {
    Matrix3::from_row_iterator(rows(value).into_iter().flatten())
}

#[test]
fn attitudes_agree_with_the_golden_data() {
    let Some(data) = golden("attitudes.json") else { return };
    let names = [
        ("omega_phi_kappa", ALL[0]),
        ("omega_phi_kappa_photo_to_ground", ALL[1]),
        ("phi_omega_kappa", ALL[2]),
        ("azimuth_tilt_swing", ALL[3]),
        ("yaw_pitch_roll_ned_nadir", ALL[4]),
        ("rotation_vector_photo_to_object", ALL[6]),
        ("rotation_vector_object_to_photo_bal", ALL[7]),
        ("rotation_vector_vision_from_object", ALL[8]),
    ];
    for (case, entry) in data["cases"].as_array().unwrap().iter().enumerate() {
        let attitude = matrix(&entry["matrix_photo_to_object"]);
        let of_step = matrix(&entry["cofactors_rotation_step"]);
        for (name, make) in names {
            let (numbers, golden) = (make(), &entry["representations"][name]);
            let values: [f64; 3] = list(&golden["values"]).try_into().unwrap();
            let singular = golden["singular"].as_bool().unwrap();
            let near = if singular { 1e-8 } else { 1e-14 };
            let difference = (numbers.attitude(values) - attitude).amax();
            assert!(difference < near, "{case} {name}: matrix {difference:e}");
            let found = numbers.numbers(&attitude);
            assert_eq!(numbers.is_singular(found), singular, "{case} {name}");
            let near = if [11, 19].contains(&case) { 1e-8 } else { 1e-13 };
            let vector = name.starts_with("rotation_vector");
            // Near 180 degrees either sign of a rotation vector is valid.
            let flipped = vector
                && Vector3::from(values).norm() > PI - 1e-6
                && Vector3::from(found).dot(&Vector3::from(values)) < 0.0;
            for k in 0..3 {
                let difference = found[k] - values[k];
                let difference = if vector { difference.abs() } else { (0.5 * difference).sin().abs() };
                assert!(flipped || difference < near, "{case} {name} {k}: {found:?} {values:?}");
            }
            match numbers.cofactors(values, &of_step) {
                None => assert!(singular, "{case} {name}"),
                Some(cofactors) => {
                    let expected = matrix(&golden["cofactors"]);
                    let rates = numbers.rates(values);
                    let condition = rates.norm() * rates.try_inverse().unwrap().norm();
                    let near = if condition < 1e4 { 1e-9 } else { 1e-5 };
                    assert!((cofactors - expected).amax() < near * expected.amax(), "{case} {name}");
                }
            }
        }
        quaternions_agree(&attitude, &of_step, &entry["representations"]["quaternion_photo_to_object_wxyz"]);
        let seen = vision_axes() * attitude.transpose();
        let golden = list(&entry["representations"]["quaternion_vision_from_object_wxyz"]["values"]);
        let sign: f64 = quaternion(&seen).iter().zip(&golden).map(|(a, b)| a * b).sum();
        assert!((sign.abs() - 1.0).abs() < 1e-13, "{case}");
    }
}

fn quaternions_agree(attitude: &Matrix3, of_step: &Matrix3, golden: &Value) {
    let values = list(&golden["values"]);
    let found = quaternion(attitude);
    let sign = found.iter().zip(&values).map(|(a, b)| a * b).sum::<f64>().signum();
    let expected = rows(&golden["cofactors"]);
    let largest = expected.iter().flatten().fold(0.0f64, |most, value| most.max(value.abs()));
    let by_step = quaternion_by_step(found);
    for i in 0..4 {
        assert!((found[i] - sign * values[i]).abs() < 1e-13, "{found:?} {values:?}");
        for j in 0..4 {
            let cofactor = by_step[i].dot(&(of_step * by_step[j]));
            assert!((cofactor - expected[i][j]).abs() < 1e-9 * largest);
        }
    }
}

#[test]
fn the_logarithm_undoes_the_exponential_to_first_order() {
    for r in [Vector3::new(0.3, -0.2, 0.9), Vector3::new(1e-5, 0.0, 2e-6), Vector3::new(-1.2, 2.0, 0.4)] {
        let jacobian = right_jacobian_inverse(&r);
        for k in 0..3 {
            let ends = [1e-6, -1e-6].map(|step| {
                rotation_angle_axis(&(angle_axis_rotation(&r) * angle_axis_rotation(&Vector3::ith(k, step))))
            });
            assert!(((ends[0] - ends[1]) / 2e-6 - jacobian.column(k)).amax() < 1e-8, "{r:?}");
        }
    }
}
