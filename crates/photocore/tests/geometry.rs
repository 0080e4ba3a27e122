//! Geometry against complex-step derivatives, inverses, and values of the GIANT sample listing.

#![allow(clippy::panic, clippy::unwrap_used)]

use crate::forward;
use photocore::geometry::{
    Ellipsoid, GeometryError, Matrix3, ObjectSpace, Point, RotationSense, Vector3, View, rotation,
    rotation_angles,
};
use proptest::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI};

const WGS84: (f64, f64) = (6_378_137.0, 6_356_752.314_245_179);

fn wgs84() -> Ellipsoid {
    Ellipsoid::new(WGS84.0, WGS84.1).unwrap()
}

/// Photo and image point with its distance to the object, in rectangular space without `spheroid`.
#[derive(Debug, Clone)]
struct Case {
    spheroid: Option<(f64, f64)>,
    sense: RotationSense,
    position: [f64; 3],
    attitude: [f64; 3],
    c: f64,
    xy: [f64; 2],
    distance: f64,
}

impl Case {
    fn space(&self) -> ObjectSpace {
        forward::object_space(self.spheroid)
    }

    fn photo(&self) -> View {
        View::new(self.space(), self.sense, self.position, self.attitude, self.c)
    }

    /// Returns the coordinates of the point observed at `xy`.
    fn coordinates(&self) -> [f64; 3] {
        let ray = self.photo().ray(self.xy).unwrap();
        self.space().coordinates(ray.origin + self.distance * ray.direction)
    }
}

prop_compose! {
    fn cases()(
        geographic in any::<bool>(),
        to_ground in any::<bool>(),
        positive in any::<bool>(),
        unit in prop::array::uniform3(-1.0..1.0f64),
        height in 100.0..12_000.0f64,
        attitude in (-1.2..1.2f64, -1.2..1.2f64, -PI..PI),
        xy in prop::array::uniform2(-115.0..115.0f64),
        distance in 100.0..12_000.0f64,
    ) -> Case {
        let position = if geographic {
            [PI * unit[0], 0.99 * FRAC_PI_2 * unit[1], height]
        } else {
            unit.map(|value| 1e5 * value)
        };
        Case {
            spheroid: geographic.then_some(WGS84),
            sense: if to_ground { RotationSense::PhotoToGround } else { RotationSense::GroundToPhoto },
            position,
            attitude: attitude.into(),
            c: if positive { -152.74 } else { 152.74 },
            xy,
            distance,
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn partials_agree_with_complex_steps(case in cases()) {
        let coordinates = case.coordinates();
        let projection = case.photo().linearize(&Point::new(case.space(), coordinates));
        let to_ground = case.sense == RotationSense::PhotoToGround;
        let analytic = [0, 1].map(|i| {
            let [x, y, z, omega, phi, kappa] = projection.photo[i];
            [[x, y, z], [omega, phi, kappa], projection.point[i]]
        });
        let [position, attitude] = [case.position, case.attitude];
        let unknowns = std::array::from_fn(|k| [position, attitude, coordinates][k / 3][k % 3]);
        let radius = case.spheroid.map_or(1.0, |(a, _)| a);
        let worst = forward::disagreement(unknowns, radius, analytic, |[p, q, r, o, f, k, x, y, z]| {
            let d = forward::local(case.spheroid, [p, q, r], [x, y, z]);
            forward::image(to_ground, case.c, [o, f, k], d)
        });
        prop_assert!(worst <= 1e-10, "{worst:e}");
    }

    #[test]
    fn a_ray_leads_back_to_its_image(case in cases()) {
        let point = Point::new(case.space(), case.coordinates());
        let projection = case.photo().linearize(&point);
        let (projected, direction) = (case.photo().project(&point), case.photo().ray(case.xy).unwrap().direction);
        prop_assert!((direction.iter().map(|v| v * v).sum::<f64>() - 1.0).abs() < 1e-14);
        for i in 0..2 {
            // Rounding of 1e-9 m of the geocentric coordinates, at the distance of the point.
            let tolerance = 1e-10 + 4.0 * 152.74 * 5e-9 / case.distance;
            prop_assert!((projected[i] - case.xy[i]).abs() < tolerance);
            prop_assert_eq!(projected[i].to_bits(), projection.xy[i].to_bits());
        }
    }

    #[test]
    fn angles_come_back_from_the_matrix(
        omega in -PI..PI, phi in -FRAC_PI_2..FRAC_PI_2, kappa in -PI..PI, close in 0.0..1.0f64,
    ) {
        let angles = [omega, phi * (1.0 - close.powi(8)), kappa];
        let m = rotation(angles);
        let back = rotation_angles(&m);
        // omega and kappa lose digits as phi approaches 90 degrees, the matrix does not.
        let loss = 1e-14 / angles[1].cos();
        for k in 0..3 {
            prop_assert!((angles[k] - back[k]).sin().abs() < loss);
        }
        prop_assert!(largest_difference(&m, &rotation(back)) < 4e-15);
    }

    #[test]
    fn geographic_positions_come_back(
        longitude in -PI..PI,
        latitude in -FRAC_PI_2..FRAC_PI_2,
        near in 0.0..1.0f64,
        height in -1e5..5e7f64,
        low in any::<bool>(),
    ) {
        // Half of the cases are close to a pole.
        let pole = FRAC_PI_2.copysign(latitude);
        let latitude = if near < 0.5 { pole * (1.0 - near.powi(20)) } else { latitude };
        let height = if low { height / 5e4 } else { height };
        let ellipsoid = wgs84();
        let xyz = ellipsoid.geocentric([longitude, latitude, height]);
        let back = ellipsoid.geographic(xyz);
        // The tolerance is four roundings of a geocentric coordinate: 4e-9 m near the ground.
        let tolerance = 1e-9f64.max(4.0 * f64::EPSILON * (WGS84.0 + height));
        let again = ellipsoid.geocentric(back);
        for k in 0..3 {
            prop_assert!((xyz[k] - again[k]).abs() <= tolerance, "{xyz:?} {again:?}");
        }
        prop_assert!((back[2] - height).abs() <= tolerance, "{height} {}", back[2]);
        prop_assert!((back[1] - latitude).abs() * (WGS84.0 + height) <= tolerance, "{latitude} {}", back[1]);
    }
}

fn largest_difference(a: &Matrix3, b: &Matrix3) -> f64 {
    (a - b).amax()
}

#[test]
fn rotations_with_a_right_angled_phi_still_give_the_matrix() {
    for phi in [FRAC_PI_2, -FRAC_PI_2] {
        for (omega, kappa) in [(0.3, 1.0), (-2.0, 0.5), (3.0, -3.0)] {
            let m = rotation([omega, phi, kappa]);
            let back = rotation_angles(&m);
            assert!((back[1] - phi).abs() < 1e-7);
            assert!(largest_difference(&m, &rotation(back)) < 1e-15);
        }
    }
}

#[test]
fn positive_omega_lifts_the_left_wing() {
    // Image axis y rotates towards z: the object vector +z appears on +y.
    let m = rotation([0.1, 0.0, 0.0]);
    assert!(m[(1, 2)] > 0.0 && m.row(0) == Vector3::x().transpose());
    assert!(rotation([0.0, 0.1, 0.0])[(2, 0)] > 0.0);
    assert!(rotation([0.0, 0.0, 0.1])[(0, 1)] > 0.0);
}

#[test]
fn poles_axis_and_centre_are_finite() {
    let ellipsoid = wgs84();
    let (a, b) = WGS84;
    assert_eq!(ellipsoid.geographic([a + 10.0, 0.0, 0.0].into()), [0.0, 0.0, 10.0]);
    for sign in [1.0, -1.0] {
        let [_, latitude, height] = ellipsoid.geographic([0.0, 0.0, sign * (b + 100.0)].into());
        assert!((latitude - sign * FRAC_PI_2).abs() < 1e-15 && (height - 100.0).abs() < 2e-9);
    }
    for xyz in [[0.0; 3], [1e-3, 0.0, 0.0], [0.0, 1.0, 1e-9], [1e4, 1e4, -1e4], [1e-300, 0.0, 1.0]] {
        assert!(ellipsoid.geographic(xyz.into()).iter().all(|value| value.is_finite()), "{xyz:?}");
    }
}

#[test]
fn spheroids_are_checked() {
    for (a, b) in
        [(1.0, 2.0), (1.0, 0.0), (1.0, -1.0), (f64::INFINITY, 1.0), (f64::NAN, 1.0), (1.0, f64::NAN)]
    {
        assert!(matches!(Ellipsoid::new(a, b), Err(GeometryError::Semiaxes { .. })), "{a} {b}");
    }
    assert!(Ellipsoid::new(1.0, 1.0).is_ok());
}

fn dms(degrees: f64, minutes: f64, seconds: f64) -> f64 {
    (degrees.abs() + minutes / 60.0 + seconds / 3600.0).copysign(degrees).to_radians()
}

/// Returns adjusted stations of the GIANT sample (pages 30 and 41): longitude, latitude, height, omega, phi, kappa photo-to-ground.
fn sample_photo(frame: &str) -> View {
    let (position, attitude) = match frame {
        "SH9960" => (
            [dms(-94.0, 59.0, 4.7584), dms(29.0, 39.0, 17.7712), 4556.0633],
            [dms(-0.0, 41.0, 24.3710), dms(-0.0, 10.0, 17.9138), dms(236.0, 45.0, 7.6484)],
        ),
        "SH9961" => (
            [dms(-95.0, 0.0, 5.2715), dms(29.0, 40.0, 34.3562), 4555.3282],
            [dms(0.0, 28.0, 23.6767), dms(-0.0, 19.0, 39.0393), dms(238.0, 42.0, 43.8987)],
        ),
        "SH9962" => (
            [dms(-95.0, 0.0, 59.4571), dms(29.0, 41.0, 40.8605), 4553.1973],
            [dms(0.0, 15.0, 18.4795), dms(0.0, 9.0, 20.8849), dms(236.0, 41.0, 42.8541)],
        ),
        other => panic!("{other} is not in the sample"),
    };
    let space = ObjectSpace::Geographic(Ellipsoid::CLARKE_1866);
    View::new(space, RotationSense::PhotoToGround, position, attitude, -152.740)
}

/// Returns adjusted points of the GIANT sample (page 34).
fn sample_point(name: &str) -> Point {
    let coordinates = match name {
        "126!" => [dms(-94.0, 59.0, 38.7142), dms(29.0, 39.0, 54.7204), 3.374],
        "SH960801" => [dms(-95.0, 0.0, 21.0798), dms(29.0, 39.0, 29.2370), 1.8029],
        "SH960202" => [dms(-94.0, 58.0, 34.9651), dms(29.0, 41.0, 15.9415), 0.0005],
        other => panic!("{other} is not in the sample"),
    };
    Point::new(ObjectSpace::Geographic(Ellipsoid::CLARKE_1866), coordinates)
}

#[test]
fn the_giant_sample_projects_as_computed() {
    for (frame, point, x, y) in [
        ("SH9960", "126!", 49.2050, 2.8573),
        ("SH9961", "126!", -46.4852, 2.0476),
        ("SH9960", "SH960801", 47.9577, 49.0819),
        ("SH9961", "SH960801", -49.2251, 48.4082),
        ("SH9960", "SH960202", 88.5056, -91.9543),
        ("SH9962", "SH960202", -93.3361, -93.9861),
    ] {
        let [px, py] = sample_photo(frame).project(&sample_point(point));
        assert!((px - x).abs() < 1e-3 && (py - y).abs() < 1e-3, "{frame} {point}: {px} {py}");
    }
}

#[test]
fn both_senses_of_the_angles_are_transposes() {
    let to_ground = [-0.690103056f64, -0.171642722, 236.752124556].map(f64::to_radians);
    let to_photo = [-0.521909344f64, 0.483031176, 123.249041752];
    let m = rotation(to_ground);
    for (angle, expected) in rotation_angles(&m.transpose()).into_iter().zip(to_photo) {
        assert!((angle.to_degrees() - expected).abs() < 1e-8);
    }
}
