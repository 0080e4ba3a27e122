//! Refraction: partials against complex steps of an independent implementation, rays against Snell's law, values of the GIANT guide and of
//! the standard atmosphere.

#![allow(clippy::unwrap_used)]

use std::f64::consts::PI;

use crate::forward;
use num_complex::Complex64 as C;
use photocore::geometry::atmosphere::Air;
use photocore::geometry::{AirModel, ObjectSpace, Point, Refraction, RotationSense, View, Water, WaterModel};
use proptest::prelude::*;

const WGS84: (f64, f64) = (6_378_137.0, 6_356_752.314_245_179);

/// Independent implementation of refraction for complex arguments: heights in metres, positions in the local frame of the camera.
mod bent {
    use super::{C, forward};

    pub fn air_giant(station: C, point: C) -> C {
        13e-6 * (station - point) / 1e3 * (1.0 - 0.02e-3 * (2.0 * station + point))
    }

    /// Returns pressure and density relative to sea level up to 32 km, by handbook formulas and constants.
    fn standard_air(z: C) -> (C, C) {
        let pressure = if z.re < 11e3 {
            (1.0 - 0.0065 * z / 288.15).powf(5.255_876_113_278_518)
        } else {
            let base = (216.65f64 / 288.15).powf(5.255_876_113_278_518);
            let isothermal = |z: C| base * (-(z - 11e3) * 0.034_163_194_736_310_36 / 216.65).exp();
            if z.re < 20e3 {
                isothermal(z)
            } else {
                isothermal(C::from(20e3))
                    * ((216.65 + 0.001 * (z - 20e3)) / 216.65).powf(-34.163_194_736_310_36)
            }
        };
        let temperature = if z.re < 11e3 {
            288.15 - 0.0065 * z
        } else if z.re < 20e3 {
            C::from(216.65)
        } else {
            216.65 + 0.001 * (z - 20e3)
        };
        (pressure, pressure * 288.15 / temperature)
    }

    /// Returns K_a in Saastamoinen's form.
    pub fn air_standard(station: C, point: C) -> C {
        let (low, high) = (standard_air(point), standard_air(station));
        277e-6 * (288.15 / 0.034_163_194_736_310_36 * (low.0 - high.0) / (station - point) - high.1)
    }

    /// Returns the apparent depth by Fermat's principle. The ray from `height` above the water to `depth` below it, `across` away, crosses
    /// the surface at the minimum of the optical length.
    pub fn apparent_depth(across: C, height: C, depth: C, n: f64) -> C {
        let sine = |a: C, b: C| a / (a * a + b * b).sqrt();
        let slope = |a: C, b: C| b * b / (a * a + b * b).powf(1.5);
        // The optical length is convex; bisection precedes Newton's method, which converges only near the root.
        let (mut low, mut high) = (0.0, across.re);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            let stationary = sine(C::from(middle), height) - n * sine(across - middle, depth);
            if stationary.re > 0.0 { high = middle } else { low = middle }
        }
        let mut place = C::from(0.5 * (low + high));
        for _ in 0..5 {
            let value = sine(place, height) - n * sine(across - place, depth);
            place -= value / (slope(place, height) + n * slope(across - place, depth));
        }
        // The ray in air is extended to the vertical of the point.
        height * (across - place) / place
    }

    /// Returns the depth of a point, smoothed at the surface.
    fn rounded(depth: C, height: C) -> C {
        let shore = 3e-5 * height;
        if depth.re >= shore.re { depth } else { (depth + shore) * (depth + shore) / (4.0 * shore) }
    }

    /// Returns the apparent point in the local frame of the camera.
    pub fn seen(case: &super::Case, position: [C; 3], point: [C; 3]) -> [C; 3] {
        let heights = [position[2], point[2]].map(|height| case.metres * (height + case.datum));
        let k_air = match case.air {
            None => C::ZERO,
            Some(super::AirModel::Giant) => air_giant(heights[0], heights[1]),
            Some(super::AirModel::Standard) => air_standard(heights[0], heights[1]),
        };
        let level = C::from(case.metres * case.level);
        let depth = level - heights[1];
        let mut d = forward::local(case.spheroid, position, point);
        let drop = -d[2];
        let square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        let across = (d[0] * d[0] + d[1] * d[1]).sqrt();
        let mut k_water = C::ZERO;
        let mut raised = point;
        let dry = depth.re <= -3e-5 * (heights[0] - level).re;
        match case.water.filter(|_| !dry) {
            None => (),
            Some(super::WaterModel::Giant) => {
                let (height, across) = (heights[0] - level, case.metres * across);
                let depth = rounded(depth, height);
                let shallow = apparent_depth(across, height, depth, case.index);
                let tangent = across / (height + depth);
                k_water = ((height + depth) / (height + shallow) - 1.0) / (1.0 + tangent * tangent);
            }
            Some(super::WaterModel::Snell) => {
                // Up at the point is the direction of increasing height.
                let camera = forward::local(case.spheroid, point, position);
                let across = case.metres * (camera[0] * camera[0] + camera[1] * camera[1]).sqrt();
                let height = case.metres * camera[2] - depth;
                let depth = rounded(depth, height);
                let shallow = apparent_depth(across, height, depth, case.index);
                raised[2] += (depth - shallow) / case.metres;
            }
        }
        let lift = (k_air + k_water) * square / drop;
        d = forward::local(case.spheroid, position, raised);
        d[2] += lift;
        d
    }
}

/// Photo and a point below it, in rectangular space without `spheroid`. Lengths are in units of `metres`, the third coordinate is relative
/// to `datum`.
#[derive(Debug, Clone)]
struct Case {
    spheroid: Option<(f64, f64)>,
    sense: RotationSense,
    position: [f64; 3],
    attitude: [f64; 3],
    c: f64,
    point: [f64; 3],
    metres: f64,
    datum: f64,
    air: Option<AirModel>,
    water: Option<WaterModel>,
    level: f64,
    index: f64,
}

impl Case {
    fn space(&self) -> ObjectSpace {
        forward::object_space(self.spheroid)
    }

    fn refraction(&self) -> Refraction {
        let water = |model| Water::new(model, self.level, self.index).unwrap();
        Refraction {
            air: self.air,
            water: self.water.map(water),
            metres_per_unit: self.metres,
            datum: self.datum,
        }
    }
}

prop_compose! {
    fn cases()(
        switches in (any::<bool>(), any::<bool>(), any::<bool>(), any::<bool>()),
        models in (0..3u8, 0..3u8),
        unit in prop::array::uniform3(-1.0..1.0f64),
        flying_height in prop_oneof![50.0..3e3f64, 3e3..11e3f64, 11e3..30e3f64],
        depth in -300.0..100.0f64,
        shore in prop_oneof![Just(None), (-0.8..1.2f64).prop_map(Some)],
        attitude in (-0.4..0.4f64, -0.4..0.4f64, -PI..PI),
        tangent in prop::array::uniform2(-0.8..0.8f64),
        level in -30.0..60.0f64,
        index in 1.0..1.5f64,
        datum in -500.0..500.0f64,
    ) -> Case {
        let (geographic, to_ground, positive, feet) = switches;
        let metres = if feet { 0.3048 } else { 1.0 };
        // At smaller distances the rounding of geocentric coordinates (1e-9 m) exceeds the tolerance.
        let flying_height = if geographic { flying_height.max(1000.0) } else { flying_height };
        let spheroid = geographic.then_some((WGS84.0 / metres, WGS84.1 / metres));
        let datum = if geographic { 0.0 } else { datum };
        let scale = if geographic { flying_height / 6.4e6 } else { flying_height / metres };
        let start = if geographic { [PI * unit[0], 1.2 * unit[1]] } else { [1e5 * unit[0], 1e5 * unit[1]] };
        // Half of the points are near the surface, within the smoothed depth.
        let depth = shore.map_or(depth, |part| 3e-5 * flying_height * part);
        let height = |above: f64| (level + above) / metres - datum;
        Case {
            spheroid,
            sense: if to_ground { RotationSense::PhotoToGround } else { RotationSense::GroundToPhoto },
            position: [start[0], start[1], height(flying_height)],
            attitude: attitude.into(),
            c: if positive { -152.74 } else { 152.74 },
            point: [
                start[0] + scale * tangent[0],
                start[1] + scale * tangent[1],
                height((-depth).min(0.5 * flying_height)),
            ],
            metres,
            datum,
            air: [None, Some(AirModel::Giant), Some(AirModel::Standard)][models.0 as usize],
            water: [None, Some(WaterModel::Giant), Some(WaterModel::Snell)][models.1 as usize],
            level: level / metres,
            index,
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3000))]

    #[test]
    fn refracted_partials_agree_with_complex_steps(case in cases()) {
        let (space, refraction) = (case.space(), case.refraction());
        let photo = View::new(space, case.sense, case.position, case.attitude, case.c);
        let point = Point::new(space, case.point);
        let (station, foot) = (refraction.vertical(space, case.position), refraction.vertical(space, case.point));
        let lift = refraction.offset(&photo.orientation, &station, &point, &foot);
        let with_offset = View { orientation: photo.orientation.with_offset(&lift), camera: photo.camera };
        let projection = with_offset.linearize(&point.with_offset(&lift));
        prop_assert_eq!(photo.project(&point.with_offset(&lift)), projection.xy);

        let to_ground = case.sense == RotationSense::PhotoToGround;
        let unknowns = std::array::from_fn(|k| [case.position, case.attitude, case.point][k / 3][k % 3]);
        let project = |[p, q, r, o, f, k, x, y, z]: [C; 9]| {
            forward::image(to_ground, case.c, [o, f, k], bent::seen(&case, [p, q, r], [x, y, z]))
        };
        let expected = project(unknowns.map(C::from));
        for (computed, expected) in projection.xy.iter().zip(expected) {
            // Rounding of 1e-9 m of geocentric coordinates, at the distance of the point.
            let drop = case.metres * (case.position[2] - case.point[2]);
            let tolerance = 1e-10 + 1e-8 * 152.74 / drop * (1.0 + computed.abs() / 152.74).powi(2);
            prop_assert!((computed - expected.re).abs() <= tolerance, "{computed} {expected}");
        }
        let analytic = [0, 1].map(|i| {
            let [x, y, z, omega, phi, kappa] = projection.photo[i];
            [[x, y, z], [omega, phi, kappa], projection.point[i]]
        });
        let radius = case.spheroid.map_or(1.0, |(a, _)| a);
        let worst = forward::disagreement(unknowns, radius, analytic, project);
        prop_assert!(worst <= 1e-10, "{worst:e}");
    }

    #[test]
    fn the_rigorous_ray_obeys_snell(
        height in 0.1..1000.0f64, depth in 0.1..100.0f64, ratio in 0.0..3.0f64, index in 1.0..1.6f64,
    ) {
        let across = ratio * (height + depth);
        let water = Water::new(WaterModel::Snell, 0.0, index).unwrap();
        let lift = lift_of(&Refraction { air: None, water: Some(water), metres_per_unit: 1.0, datum: 0.0 },
            [0.0, 0.0, height], [across, 0.0, -depth]);
        // The line from the camera to the lifted point crosses the surface at the refraction point.
        let surface = across * height / (height + depth - lift[2]);
        let (above, below) = (surface.hypot(height), (across - surface).hypot(depth));
        prop_assert!((surface / above - index * (across - surface) / below).abs() <= 1e-9);
        // Any other crossing point increases the optical length.
        let optical = |x: f64| x.hypot(height) + index * (across - x).hypot(depth);
        for other in [0.99 * surface, 0.9 * surface + 0.1 * across] {
            prop_assert!(optical(other) >= optical(surface) * (1.0 - 1e-15));
        }
        prop_assert!(lift[2] >= 0.0 && lift[2] < depth && lift[0] == 0.0 && lift[1] == 0.0);
    }
}

/// Returns the lift of a point in rectangular space.
fn lift_of(refraction: &Refraction, station: [f64; 3], point: [f64; 3]) -> [f64; 3] {
    let space = ObjectSpace::Rectangular;
    let photo = View::new(space, RotationSense::GroundToPhoto, station, [0.0; 3], -152.74);
    let at = |coordinates| refraction.vertical(space, coordinates);
    refraction.offset(&photo.orientation, &at(station), &Point::new(space, point), &at(point)).vector.into()
}

fn air_only(model: AirModel) -> Refraction {
    Refraction { air: Some(model), water: None, metres_per_unit: 1.0, datum: 0.0 }
}

/// Returns K_a from the lift at nadir, in microradians.
fn microradians(model: AirModel, station: f64, point: f64) -> f64 {
    1e6 * lift_of(&air_only(model), [0.0, 0.0, station], [0.0, 0.0, point])[2] / (station - point)
}

#[test]
fn appendix_f_gives_the_figures_of_the_example() {
    assert!((microradians(AirModel::Giant, 4500.0, 0.0) - 47.97).abs() < 1e-9);
    let refraction = air_only(AirModel::Giant);
    let lift = |across| lift_of(&refraction, [0.0, 0.0, 4500.0], [across, 0.0, 0.0])[2];
    assert!((lift(0.0) - 0.215_865).abs() < 1e-12);
    assert!((lift(4500.0) - 0.431_73).abs() < 1e-12);
}

#[test]
fn the_air_is_that_of_the_standard_atmosphere() {
    // U.S. Standard Atmosphere 1976, Part 4: pressure (mbar) and density (kg/m^3) at geopotential heights (m), five digits.
    for (height, pressure, density) in [
        (0.0, 1013.25, 1.2250),
        (5_000.0, 540.20, 0.736_12),
        (11_000.0, 226.32, 0.363_92),
        (20_000.0, 54.749, 0.088_035),
        (32_000.0, 8.6802, 0.013_225),
        (47_000.0, 1.1091, 0.001_427_5),
        (51_000.0, 0.669_39, 0.000_861_60),
        (71_000.0, 0.039_564, 0.000_064_211),
    ] {
        let air = Air::at(height);
        assert!((1013.25 * air.pressure / pressure - 1.0).abs() < 1e-4, "{height}");
        assert!((1.225 * air.density / density - 1.0).abs() < 1e-4, "{height}");
    }
    assert_eq!(Air::at(84_852.0), Air::NONE);
    assert!(Air::at(84_851.0).pressure < 4e-6);
}

#[test]
fn the_standard_model_is_that_of_saastamoinen() {
    // Manual of Photogrammetry: valid below 11 km; its constants, and therefore its results, have four digits.
    let manual = |station: f64, point: f64| {
        let at = |height: f64, power: f64| (1.0 - 0.02257 * height / 1e3).powf(power);
        2335.0 / (station - point) * 1e3 * (at(point, 5.256) - at(station, 5.256))
            - 277.0 * at(station, 4.256)
    };
    for (station, point) in [(1_000.0, 0.0), (4_500.0, 500.0), (9_000.0, 0.0), (11_000.0, 2_000.0)] {
        let (computed, expected) = (microradians(AirModel::Standard, station, point), manual(station, point));
        assert!((computed - expected).abs() < 0.25, "{station} {point}: {computed} {expected}");
    }
}

#[test]
fn high_above_the_air_only_its_mass_counts() {
    // K (H - h) tends to N0 times the scale height: 277e-6 x 8434.5 m.
    let lift = lift_of(&air_only(AirModel::Standard), [0.0, 0.0, 500e3], [0.0; 3])[2];
    assert!((lift - 277e-6 * 8434.5).abs() < 1e-4, "{lift}");
}

#[test]
fn what_no_model_covers_is_left_alone() {
    for model in [AirModel::Giant, AirModel::Standard] {
        let refraction = air_only(model);
        for height in [99.5, 100.0, 150.0] {
            assert_eq!(lift_of(&refraction, [0.0, 0.0, 100.0], [50.0, 0.0, height]), [0.0; 3]);
        }
    }
    for model in [WaterModel::Giant, WaterModel::Snell] {
        let water = Water::new(model, 10.0, 1.34).unwrap();
        let refraction = Refraction { air: None, water: Some(water), metres_per_unit: 1.0, datum: 0.0 };
        // A point above the water, and a camera below its level.
        assert_eq!(lift_of(&refraction, [0.0, 0.0, 100.0], [50.0, 0.0, 10.003]), [0.0; 3]);
        assert!(lift_of(&refraction, [0.0, 0.0, 100.0], [50.0, 0.0, 10.0])[2] < 2.5e-4);
        assert_eq!(lift_of(&refraction, [0.0, 0.0, 9.0], [50.0, 0.0, 5.0]), [0.0; 3]);
        assert!(lift_of(&refraction, [0.0, 0.0, 100.0], [50.0, 0.0, 5.0])[2] > 1.0);
        assert!(Water::new(model, f64::NAN, 1.34).is_err());
        assert!(Water::new(model, 0.0, 0.99).is_err());
    }
}
