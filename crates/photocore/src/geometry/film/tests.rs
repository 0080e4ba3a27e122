//! Tests of the film model: partials against differences, and the inverse.

#![allow(clippy::unwrap_used)]

use super::{Bend, Deformation, Film, Grid, Pattern, Reading, Scanned, Scanner};
use crate::geometry::correction::Correction;

/// Parameters of the complete chain: q, film, bend, weights of the pattern, parameters of the scanner.
#[derive(Clone)]
struct Scene {
    pattern: Pattern,
    projective: bool,
    correction: Correction,
    down: bool,
    mirrored: bool,
    q: [f64; 2],
    film: [f64; 6],
    bend: [f64; 2],
    weights: Vec<f64>,
}

impl Scene {
    fn reading(&self) -> Reading {
        self.photo().read(self.q, &self.deformation(self.q), &self.scanner()).unwrap()
    }

    fn scanner(&self) -> Scanner {
        Scanner::new((self.correction, true), 0.02, [6000.0, 5900.0], self.down)
    }

    fn deformation(&self, q: [f64; 2]) -> Deformation {
        let cell = self.pattern.cell(self.q);
        let pairs = self.pattern.pairs(cell);
        Deformation::new(&self.pattern.at(cell, q), |k| self.weights[2 * pairs[k / 2] + k % 2])
    }

    fn photo(&self) -> Film {
        let [t1, t2, theta, m, b1, b2] = self.film;
        let bend = if self.projective { Bend::Projective } else { Bend::Bilinear };
        Film::new(self.mirrored, [t1, t2, theta], [m, b1, b2], bend(self.bend))
    }

    /// Returns all parameters with their steps in units of mm, and their partials.
    fn partials(&self) -> Vec<(usize, f64, [f64; 2])> {
        let found = self.reading();
        let column = |rows: [&[f64]; 2], k: usize| [rows[0][k], rows[1][k]];
        let mut all = vec![];
        let mut add = |step: f64, by: [f64; 2]| all.push((all.len(), step, by));
        let rows = |by: &[[f64; 2]; 2], k: usize| column([&by[0], &by[1]], k);
        (0..2).for_each(|k| add(0.5, rows(&found.by_q, k)));
        (0..6).for_each(|k| {
            add([0.5, 0.5, 2e-3, 1e-3, 1e-3, 1e-3][k], column([&found.by_film[0], &found.by_film[1]], k));
        });
        (0..2).for_each(|k| add(2e-6, rows(&found.by_bend, k)));
        let cell = self.pattern.cell(self.q);
        let (functions, pairs) = (self.pattern.at(cell, self.q), self.pattern.pairs(cell));
        for weight in 0..self.pattern.count() {
            let mut by = [0.0; 2];
            for own in functions.iter().filter(|own| 2 * pairs[own.weight / 2] + own.weight % 2 == weight) {
                (0..2).for_each(|row| by[row] += found.by_shift[row][own.axis] * own.value);
            }
            add(0.5, by);
        }
        (0..21).for_each(|k| {
            add(if k < 3 { 2e-3 } else { 0.2 }, column([&found.by_scanner[0], &found.by_scanner[1]], k));
        });
        all
    }

    fn moved(&self, number: usize, by: f64) -> Self {
        let mut own = self.clone();
        let weights = 10 + own.weights.len();
        match number {
            0..2 => own.q[number] += by,
            2..8 => own.film[number - 2] += by,
            8..10 => own.bend[number - 8] += by,
            number if number < weights => own.weights[number - 10] += by,
            number => {
                let mut parameters = own.correction.parameters();
                parameters[number - weights] += by;
                own.correction = own.correction.with_parameters(&parameters);
            }
        }
        own
    }
}

fn scenes() -> Vec<Scene> {
    let polynomials =
        [0, 1].map(|axis| std::array::from_fn(|k| 0.004 * (1.3 * (k + 9 * axis) as f64 + 0.4).sin()));
    let correction = Correction { scales: [1.0003, 0.9996], lean: 4e-4, polynomials, half_range: [120.0; 2] };
    let patterns = [
        Pattern::Quadratic { half: 113.0 },
        Pattern::Ebner { half: 113.0 },
        Pattern::Grid(Grid { first: [-100.0, -90.0], spacing: [100.0, 60.0], nodes: [3, 4] }),
    ];
    let scene = |(k, pattern): (usize, Pattern)| {
        let weights = (0..pattern.count()).map(|k| 0.02 * (1.7 * k as f64).cos()).collect();
        let down = k != 1;
        let film = [-0.7, 0.4, [0.01, 1.57, -3.0][k], -3e-4, 2e-4, -1e-4];
        let (mirrored, projective) = (k == 2, k > 0);
        let (q, bend) = ([83.0, -47.0], [3e-6, -2e-6]);
        Scene { pattern, projective, correction, down, mirrored, q, film, bend, weights }
    };
    patterns.into_iter().enumerate().map(scene).collect()
}

#[test]
fn partials_agree_with_differences() {
    for scene in scenes() {
        for (number, step, by) in scene.partials() {
            let at = |times: f64| scene.moved(number, times * step).reading().xy;
            let [near, back, far, far_back] = [1.0, -1.0, 2.0, -2.0].map(at);
            let [further, further_back] = [3.0, -3.0].map(at);
            for row in 0..2 {
                // Sixth-order central differences.
                let change = 45.0 * (near[row] - back[row]) - 9.0 * (far[row] - far_back[row])
                    + (further[row] - further_back[row]);
                let error = (change / (60.0 * step) - by[row]).abs();
                // The steps change readings by about ten pixels.
                assert!(error * step < 1e-9, "{number} {row}: {error:e} of {}", by[row]);
            }
        }
    }
}

#[test]
fn a_place_comes_back_from_its_reading() {
    for scene in scenes() {
        let back =
            scene.photo().place(scene.reading().xy, |q| scene.deformation(q), &scene.scanner()).unwrap();
        (0..2).for_each(|k| assert!((back[k] - scene.q[k]).abs() < 1e-11));
    }
}

#[test]
fn a_scanner_without_polynomials_reads_as_one_whose_polynomials_are_nothing() {
    let correction = Correction { scales: [1.0003, 0.9996], lean: 4e-4, ..Correction::NONE };
    let read = |curved| Scanner::new((correction, curved), 0.02, [6000.0, 5900.0], true).read([81.0, -43.0]);
    let (plain, curved) = (read(false).unwrap(), read(true).unwrap());
    let all = |own: &Scanned| {
        let by_linear = own.by_parameters.map(|row| [row[0], row[1], row[2]]);
        [&own.xy[..], own.by_place.as_flattened(), by_linear.as_flattened()].concat()
    };
    for (one, other) in all(&plain).into_iter().zip(all(&curved)) {
        assert!((one - other).abs() <= 1e-13 * other.abs(), "{one} {other}");
    }
}

#[test]
fn rows_count_down_and_mirrored_films_are_seen_from_the_other_side() {
    let scanner = Scanner::new((Correction::NONE, false), 0.02, [6000.0; 2], true);
    let film = |mirrored| Film::new(mirrored, [0.0; 3], [0.0; 3], Bend::Flat);
    let read = |mirrored| film(mirrored).read([10.0, 20.0], &Deformation::default(), &scanner).unwrap().xy;
    assert_eq!(read(false), [6500.0, 5000.0]);
    assert_eq!(read(true), [5500.0, 5000.0]);
}
