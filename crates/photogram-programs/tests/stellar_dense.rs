//! Night of several attitudes with correlated catalogue places, weights of parameters and an axis, against dense algebra.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use faer::linalg::solvers::DenseSolveCore;
use faer::{Mat, Side};
use photocore::adjustment::{Method, Options as AdjustmentOptions, Status, Stop};
use photocore::{Context, Threads};
use photogram_programs::sky::{ARCSEC, Air, REFRACTION, Station};
use photogram_programs::stellar::{
    Axis, COMMON, Calibration, Decentering, Form, Image, Kind, Options, Rows, Solution, Star, StellarError,
    Weights,
};

const ATTITUDES: usize = 5;
const STARS: usize = 14;
const PLATE_SD: f64 = 3e-6;
const LATITUDE: f64 = 0.6;

/// Returns a reproducible number between -1 and 1 for each index.
fn noise(index: usize) -> f64 {
    ((index as f64 * 12.9898).sin() * 43758.5453).fract()
}

fn common() -> [f64; COMMON] {
    let mut common = [0.0; COMMON];
    common[3..5].fill(0.3);
    common[7] = 0.02;
    common[13..].copy_from_slice(&REFRACTION);
    common
}

/// Returns every star on every attitude; the plate coordinates have errors.
fn night(held: bool) -> Calibration {
    let place = |k: usize| [1.0 + 0.25 * noise(k), LATITUDE + 0.2 * noise(50 + k)];
    let plate = 1.0 / (PLATE_SD * PLATE_SD);
    let catalogue = 1.0 / (0.5 * ARCSEC).powi(2);
    let image = |index: usize| Image {
        star: index % STARS,
        pointing: index / STARS,
        xy: [0.0; 2],
        weight: [[plate, 0.2 * plate], [0.2 * plate, 0.7 * plate]],
        sidereal_time: 1.0 + 0.01 * (index / STARS) as f64,
        shift: [0.0; 2],
    };
    let star = |k: usize| Star {
        place: place(k),
        catalogue: place(k),
        weight: (!held && k > 0)
            .then_some([[catalogue, -0.4 * catalogue], [-0.4 * catalogue, 0.8 * catalogue]]),
        fixed: held,
    };
    let free = [1, 2, 3, 4, 7].map(|k| 3 * ATTITUDES + k);
    let mut calibration = Calibration {
        station: Station::new(LATITUDE, 0.32 * ARCSEC, Air::new(285.0, 755.0)),
        kind: Kind {
            lens: None,
            form: Form::ScaleFirst,
            decentering: Decentering::Polar,
            common_scale: false,
        },
        pointings: (0..ATTITUDES).map(|k| [0.05 * noise(200 + k), 0.04 * noise(300 + k), k as f64]).collect(),
        common: common(),
        fixed: (0..3 * ATTITUDES + COMMON).map(|k| k >= 3 * ATTITUDES && !free.contains(&k)).collect(),
        weights: Weights { parameters: vec![], values: vec![], root: vec![] },
        stars: (0..STARS).map(star).collect(),
        images: (0..STARS * ATTITUDES).map(image).collect(),
        axis: None,
    };
    let seen = calibration.equations().unwrap();
    for (index, (image, rows)) in calibration.images.iter_mut().zip(seen).enumerate() {
        image.xy = [0, 1].map(|i| -rows.constant[i] + PLATE_SD * noise(1000 + 2 * index + i));
    }
    calibration
}

/// Returns a night with a direction of the axis, and a weight matrix of two attitudes and a principal distance.
fn weighted_night() -> Calibration {
    let mut calibration = night(false);
    let parameters = vec![1, 3 * 3 + 2, 3 * ATTITUDES + 3];
    let given = [calibration.pointings[0][1] + 2e-5, 3.0 - 1e-5, 0.3 + 2e-6];
    let root = [2e5, 1e5, -3e5, 0.0, 3e5, 1e5, 0.0, 0.0, 4e5];
    calibration.weights = Weights { parameters, values: given.to_vec(), root: root.to_vec() };
    let weight = [[4e10, 1e10], [1e10, 5e10]];
    calibration.axis = Some(Axis { pointing: 2, standard: [0.01, -0.02], xy: [0.0; 2], weight });
    let off = calibration.axis_equations().unwrap().unwrap().constant;
    calibration.axis = calibration.axis.map(|axis| Axis { xy: [3e-6 - off[0], -2e-6 - off[1]], ..axis });
    calibration
}

fn adjusted(calibration: &Calibration) -> Result<Solution, StellarError> {
    let method = Method::Damped(Stop::Fraction(1e-9));
    let adjustment =
        AdjustmentOptions { method, max_iterations: 50, covariance: true, loss: None, threads: 0 };
    let threads = Threads::new(2).unwrap();
    calibration.adjust_on(&Options { adjustment, unit: 1.0, whole: true }, &mut Context::new(&threads))
}

/// Rows of R A and R l, with R from the left Cholesky factor of the weights.
struct Dense {
    rows: Vec<Vec<f64>>,
    right: Vec<f64>,
}

impl Dense {
    fn add(&mut self, weight: [[f64; 2]; 2], rows: [Vec<f64>; 2], constant: [f64; 2]) {
        let (a, b) = (weight[0][0].sqrt(), weight[0][1] / weight[0][0].sqrt());
        let c = (weight[1][1] - b * b).sqrt();
        for [p, q] in [[a, b], [0.0, c]] {
            self.rows.push(rows[0].iter().zip(&rows[1]).map(|(x, y)| p * x + q * y).collect());
            self.right.push(p * constant[0] + q * constant[1]);
        }
    }
}

fn spread(rows: &Rows, pointing: usize, star: Option<usize>) -> [Vec<f64>; 2] {
    [0, 1].map(|i| {
        let mut row = vec![0.0; 2 * STARS + 3 * ATTITUDES + COMMON];
        if let Some(star) = star {
            row[2 * star..][..2].copy_from_slice(&rows.star[i]);
        }
        row[2 * STARS + 3 * pointing..][..3].copy_from_slice(&rows.pointing[i]);
        row[2 * STARS + 3 * ATTITUDES..].copy_from_slice(&rows.common[i]);
        row
    })
}

/// Returns all equations at the adjusted values.
fn dense(calibration: &Calibration, solution: &Solution) -> Dense {
    let mut at = calibration.clone();
    let (pointings, common) = solution.parameters.split_at(3 * ATTITUDES);
    at.pointings = pointings.as_chunks().0.to_vec();
    at.common = common.try_into().unwrap();
    at.stars.iter_mut().zip(&solution.observations.places).for_each(|(star, &place)| star.place = place);
    let mut found = Dense { rows: vec![], right: vec![] };
    for (image, rows) in at.images.iter().zip(at.equations().unwrap()) {
        found.add(image.weight, spread(&rows, image.pointing, Some(image.star)), rows.constant);
    }
    for (k, star) in at.stars.iter().enumerate() {
        let unit = |i: usize| {
            let mut row = vec![0.0; 2 * STARS + 3 * ATTITUDES + COMMON];
            row[2 * k + i] = 1.0;
            row
        };
        let off = [0, 1].map(|i| star.catalogue[i] - star.place[i]);
        if let Some(weight) = star.weight {
            found.add(weight, [unit(0), unit(1)], off);
        }
    }
    if let (Some(axis), Some(rows)) = (at.axis, at.axis_equations().unwrap()) {
        found.add(axis.weight, spread(&rows, axis.pointing, None), rows.constant);
    }
    let Weights { parameters, values, root } = &at.weights;
    for root in root.chunks_exact(parameters.len().max(1)) {
        let mut row = vec![0.0; 2 * STARS + 3 * ATTITUDES + COMMON];
        let mut right = 0.0;
        for ((&parameter, value), factor) in parameters.iter().zip(values).zip(root) {
            row[2 * STARS + parameter] = *factor;
            right += factor * (value - solution.parameters[parameter]);
        }
        found.rows.push(row);
        found.right.push(right);
    }
    found
}

#[test]
fn weights_of_stars_and_parameters_and_the_axis_are_those_of_a_dense_adjustment() {
    let calibration = weighted_night();
    let solution = adjusted(&calibration).unwrap();
    assert_eq!(solution.adjustment.status, Status::Converged);
    let Dense { rows, right } = dense(&calibration, &solution);
    let fixed = |j: usize| j >= 2 * STARS && calibration.fixed[j - 2 * STARS];
    let own: Vec<usize> = (0..rows[0].len()).filter(|&j| !fixed(j)).collect();
    let a = Mat::from_fn(rows.len(), own.len(), |i, j| rows[i][own[j]]);
    let scale: Vec<f64> = (0..own.len()).map(|j| a.col(j).norm_l2().recip()).collect();
    let scaled = Mat::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)] * scale[j]);
    let inverse = (scaled.transpose() * &scaled).llt(Side::Lower).unwrap().inverse();
    let q = |i: usize, j: usize| inverse[(i, j)] * scale[i] * scale[j];
    // The equations are solved: every unknown is within a millionth of its standard deviation.
    let l = Mat::from_fn(right.len(), 1, |i, _| right[i]);
    let step = &inverse * (scaled.transpose() * &l);
    for j in 0..own.len() {
        assert!(step[(j, 0)].abs() < 1e-6 * inverse[(j, j)].sqrt(), "{j}: {}", step[(j, 0)]);
    }
    let count = calibration.parameters();
    let (log_determinant, whole) = solution.whole.as_ref().unwrap();
    for (i, &row) in own.iter().enumerate().filter(|&(_, &row)| row >= 2 * STARS) {
        for (j, &column) in own.iter().enumerate().filter(|&(_, &column)| column >= 2 * STARS) {
            let found = whole[(row - 2 * STARS) * count + column - 2 * STARS];
            assert!((found - q(i, j)).abs() < 1e-7 * (q(i, i) * q(j, j)).sqrt(), "{row} {column}");
        }
    }
    // The determinant of the reduced normal equations is the inverse of the determinant of the parameters' cofactors.
    let first = 2 * STARS;
    let part = Mat::from_fn(own.len() - first, own.len() - first, |i, j| inverse[(first + i, first + j)]);
    let factor = part.llt(Side::Lower).unwrap();
    let sum = |value: f64, i: usize| value + 2.0 * (factor.L()[(i, i)] * scale[first + i]).ln();
    assert!((log_determinant + (0..part.nrows()).fold(0.0, sum)).abs() < 1e-6);
    for (star, found) in solution.observations.place_cofactors.iter().enumerate() {
        for k in 0..4 {
            let (i, j) = (2 * star + k / 2, 2 * star + k % 2);
            assert!((found[k / 2][k % 2] - q(i, j)).abs() < 1e-7 * (q(i, i) * q(j, j)).sqrt());
        }
    }
    // Redundancy numbers: 1 - a Q a^T of every row.
    let share = |row: usize| {
        let a: Vec<f64> = own.iter().map(|&column| rows[row][column]).collect();
        (0..own.len())
            .flat_map(|i| (0..own.len()).map(move |j| (i, j)))
            .map(|(i, j)| a[i] * q(i, j) * a[j])
            .sum()
    };
    let observed = &solution.observations;
    let numbers: Vec<f64> = (observed.image_tests.iter().chain(&observed.place_tests[1..]))
        .chain([&solution.axis_test])
        .flat_map(|test| test.redundancy)
        .collect();
    for (row, r) in numbers.iter().enumerate() {
        let share: f64 = share(row);
        assert!((1.0 - share - r).abs() < 1e-7, "{row}: {r} {share}");
    }
    let squares: f64 = right.iter().map(|v| v * v).sum();
    assert!((observed.sums_of_squares.iter().sum::<f64>() / squares - 1.0).abs() < 1e-12);
}

#[test]
fn blocks_of_the_cofactors_are_those_of_the_whole() {
    let solution = adjusted(&weighted_night()).unwrap();
    let (cofactors, (_, whole)) = (solution.cofactors.unwrap(), solution.whole.unwrap());
    let (first, count) = (3 * ATTITUDES, 3 * ATTITUDES + COMMON);
    let sd = |k: usize| whole[k * (count + 1)].sqrt();
    let same = |found: f64, i: usize, j: usize| {
        assert!((found - whole[i * count + j]).abs() <= 1e-8 * sd(i) * sd(j), "{i} {j}");
    };
    for e in 0..ATTITUDES {
        (0..9).for_each(|k| same(cofactors.own[9 * e + k], 3 * e + k / 3, 3 * e + k % 3));
        let width = 3 * COMMON;
        (0..width).for_each(|k| same(cofactors.cross[width * e + k], 3 * e + k / COMMON, first + k % COMMON));
    }
    (0..COMMON * COMMON).for_each(|k| same(cofactors.common[k], first + k / COMMON, first + k % COMMON));
}

/// Fixed stars shared by all attitudes cost as much as separate stars per attitude.
#[test]
fn a_star_that_is_held_ties_no_attitudes() {
    let shared = night(true);
    let mut apart = shared.clone();
    for (index, image) in apart.images.iter_mut().enumerate() {
        apart.stars.push(apart.stars[image.star]);
        image.star = STARS + index;
    }
    let [shared, apart] = [shared, apart].map(|calibration| adjusted(&calibration).unwrap());
    let work = |solution: &Solution| solution.adjustment.effort.operations.factor;
    assert_eq!(work(&shared), work(&apart));
    let tied = adjusted(&night(false)).unwrap();
    assert!(work(&tied) > 1.5 * work(&shared), "{} {}", work(&tied), work(&shared));
    assert_eq!(shared.observations.place_cofactors[0], [[0.0; 2]; 2]);
}

#[test]
fn parameters_without_effect_and_without_determination_are_named() {
    let mut calibration = night(false);
    let place = |k: usize| 3 * ATTITUDES + k;
    calibration.common[7] = 0.0;
    calibration.fixed[place(5)] = false;
    calibration.fixed[place(6)] = false;
    calibration.fixed[place(7)] = true;
    let threads = Threads::new(1).unwrap();
    assert_eq!(calibration.without_effect(&threads).unwrap(), [place(5), place(6)]);
    match adjusted(&calibration) {
        Err(StellarError::Undetermined(found)) => assert_eq!(found, [[place(5)], [place(6)]]),
        other => panic!("{other:?}"),
    }
    calibration.stars[3].place[0] += std::f64::consts::PI;
    assert_eq!(calibration.without_effect(&threads), Err(StellarError::NotFinite(vec![3])));
    assert!(matches!(adjusted(&calibration), Err(StellarError::NotFinite(stars)) if stars == [3]));
}
