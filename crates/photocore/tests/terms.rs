//! Networks with constraints: a free trilateration in the plane, in any datum, against dense algebra.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use faer::{Mat, Side};
use photocore::adjustment::{
    Datum, DatumError, Evaluated, Leverages, Linearized, Loss, Method, Model, Motions, Options, Problem,
    Published, Status, Stop, adjust,
};
use photocore::normals::{GroupRows, Layout, Ordering, System, Term};
use photocore::{Context, Threads};

use crate::scatter;

/// Points in the plane; distances between retained and local points are observations, distances between retained points are constraints.
struct Trilateration {
    layout: Layout,
    lengths: Vec<f64>,
    held: Vec<usize>,
}

impl Trilateration {
    /// Returns observed minus computed, and the partials with respect to the first point; the second has opposite signs. NaN for NaN.
    fn distance(&self, values: &[f64], observation: usize, from: usize, to: usize) -> (f64, [f64; 2]) {
        let difference = [values[from] - values[to], values[from + 1] - values[to + 1]];
        let length = difference[0].hypot(difference[1]);
        let left = self.lengths[observation] - length;
        (left, difference.map(|value| if left.is_nan() { left } else { value / length }))
    }
}

struct At<'a> {
    net: &'a Trilateration,
    values: Vec<f64>,
}

impl Evaluated for At<'_> {
    fn observe(&self, local: usize, group: usize, rows: &mut GroupRows<'_>) {
        let (net, layout) = (self.net, &self.net.layout);
        let (point, station) =
            (layout.local_range(local).start, layout.retained_range(layout.retained_of(group)).start);
        let (left, partials) = net.distance(&self.values, group, point, station);
        rows.constant[0] = left;
        rows.local.copy_from_slice(&partials);
        rows.retained.copy_from_slice(&partials.map(|value| -value));
    }

    fn observe_term(&self, term: usize, rows: &mut GroupRows<'_>) {
        let (net, layout) = (self.net, &self.net.layout);
        let retained = &layout.terms()[term].retained;
        let [from, to] = [0, 1].map(|end| layout.retained_range(retained[end] as usize).start);
        let (left, partials) = net.distance(&self.values, layout.groups() + term, from, to);
        rows.constant[0] = left;
        rows.shared[..2].copy_from_slice(&partials);
        rows.shared[2..].copy_from_slice(&partials.map(|value| -value));
    }
}

impl Model for Trilateration {
    fn at<'a>(&'a self, unknowns: &[f64]) -> Box<dyn Evaluated + 'a> {
        Box::new(At { net: self, values: unknowns.to_vec() })
    }

    fn motions(&self, unknowns: &[f64]) -> Option<Motions> {
        let preferred = self.held.iter().copied().chain(0..unknowns.len()).collect();
        Some(Motions { vectors: null_vectors(unknowns), preferred })
    }

    fn move_along(&self, unknowns: &mut [f64], amounts: &[f64]) {
        let (sin, cos) = amounts[2].sin_cos();
        for point in unknowns.chunks_exact_mut(2) {
            let [x, y] = [point[0], point[1]];
            (point[0], point[1]) = (cos * x - sin * y + amounts[0], sin * x + cos * y + amounts[1]);
        }
    }
}

const SD: f64 = 0.01;

/// Returns a grid of 4 x 3 retained points and 8 local ones, each local one observed from four retained points.
fn network(held: Vec<usize>) -> Problem<Trilateration> {
    let retained: Vec<[f64; 2]> = (0..12).map(|k| [100.0 * (k % 4) as f64, 120.0 * (k / 4) as f64]).collect();
    let local: Vec<[f64; 2]> =
        (0..8).map(|k| [40.0 + 33.0 * k as f64, 60.0 + 70.0 * scatter(k).abs()]).collect();
    let (mut ptr, mut seen) = (vec![0], Vec::new());
    for k in 0..8 {
        seen.extend([k, k + 1, k + 3, k + 4].map(|station| station as u32 % 12));
        ptr.push(seen.len());
    }
    let pairs: Vec<[u32; 2]> =
        (0..12).flat_map(|k| [[k, (k + 1) % 12], [k, (k + 4) % 12], [(k + 5) % 12, k]]).collect();
    let terms = pairs.iter().map(|pair| Term { rows: 1, local: None, retained: pair.to_vec() }).collect();
    let layout = Layout::new(1, 2, &[2; 12], ptr.clone(), seen.clone()).unwrap().with_terms(terms).unwrap();
    let truth: Vec<f64> = local.iter().chain(&retained).flatten().copied().collect();
    let distance = |a: usize, b: usize| (truth[a] - truth[b]).hypot(truth[a + 1] - truth[b + 1]);
    let of_groups = (0..seen.len()).map(|g| distance(g / 4 * 2, 16 + 2 * seen[g] as usize));
    let of_terms = pairs.iter().map(|pair| distance(16 + 2 * pair[0] as usize, 16 + 2 * pair[1] as usize));
    let lengths: Vec<f64> =
        of_groups.chain(of_terms).enumerate().map(|(i, length)| length + SD * scatter(100 + i)).collect();
    let initial: Vec<f64> = truth.iter().enumerate().map(|(i, x)| x + 0.5 * scatter(500 + i)).collect();
    let unknowns = layout.unknowns();
    Problem {
        observation_sd: vec![SD; lengths.len()],
        model: Trilateration { layout: layout.clone(), lengths, held },
        system: System::new(layout, Ordering::Auto).unwrap(),
        prior: initial.clone(),
        initial,
        sd: vec![f64::INFINITY; unknowns],
    }
}

fn threads() -> Threads {
    Threads::new(2).unwrap()
}

fn options() -> Options {
    Options { method: Method::TrustRegion(Stop::Decrease(1e-14)), ..Options::default() }
}

/// Returns the design matrix divided by the standard deviations, at the given values.
fn design(problem: &Problem<Trilateration>, values: &[f64]) -> Mat<f64> {
    let layout = problem.layout();
    let mut a = Mat::zeros(layout.equations(), layout.unknowns());
    let ends = (0..layout.groups())
        .map(|g| [layout.local_range(g / 4).start, layout.retained_range(layout.retained_of(g)).start]);
    let tied = layout
        .terms()
        .iter()
        .map(|term| [0, 1].map(|end| layout.retained_range(term.retained[end] as usize).start));
    for (row, [from, to]) in ends.chain(tied).enumerate() {
        let (_, partials) = problem.model.distance(values, row, from, to);
        for k in 0..2 {
            a[(row, from + k)] = partials[k] / SD;
            a[(row, to + k)] = -partials[k] / SD;
        }
    }
    a
}

/// Returns the null vectors: shifts along both axes, and a rotation about the origin.
fn null_vectors(values: &[f64]) -> Vec<Vec<f64>> {
    let of = |each: &dyn Fn(f64, f64) -> [f64; 2]| {
        values.chunks_exact(2).flat_map(|point| each(point[0], point[1])).collect::<Vec<f64>>()
    };
    vec![of(&|_, _| [1.0, 0.0]), of(&|_, _| [0.0, 1.0]), of(&|x, y| [-y, x])]
}

/// Returns the pseudo-inverse of the normal matrix: the inverse without the null space.
fn pseudo_inverse(a: &Mat<f64>) -> Mat<f64> {
    let eigen = (a.transpose() * a).self_adjoint_eigen(Side::Lower).unwrap();
    let (values, vectors) = (eigen.S(), eigen.U());
    let largest = values[values.dim() - 1];
    let scaled = Mat::from_fn(vectors.nrows(), vectors.ncols(), |i, k| {
        if values[k] > 1e-10 * largest { vectors[(i, k)] / values[k] } else { 0.0 }
    });
    scaled * vectors.transpose()
}

fn kept_block(problem: &Problem<Trilateration>, cofactors: &[f64], retained: usize, q: &Mat<f64>) -> f64 {
    let range = problem.layout().retained_range(retained);
    let scale = q[(range.start, range.start)].max(q[(range.start + 1, range.start + 1)]);
    (0..4)
        .map(|k| (cofactors[4 * retained + k] - q[(range.start + k / 2, range.start + k % 2)]).abs() / scale)
        .fold(0.0, f64::max)
}

#[test]
fn inner_constraints_over_everything_are_the_pseudo_inverse() {
    // One point and the direction to another are fixed.
    let problem = network(vec![16, 17, 19]);
    let threads = threads();
    let mut found = adjust(&problem, &options(), &mut Context::new(&threads)).unwrap();
    assert_eq!(found.status, Status::Converged);
    let (redundancy, formed) = (found.redundancy.take().unwrap(), found.effort.formations);
    let all = (0..problem.layout().unknowns()).map(|unknown| (unknown, 1.0)).collect();
    let datum = Datum { carriers: all, left: vec![], relative: false };
    found.take_to(&problem, &options(), &datum, &problem.initial, &mut Context::new(&threads)).unwrap();
    assert_eq!(found.effort.formations, formed + 1);
    let (free, cofactors) = (&found, found.cofactors.as_ref().unwrap());
    let a = design(&problem, &free.unknowns);
    let q = pseudo_inverse(&a);
    for retained in 0..12 {
        assert!(kept_block(&problem, &cofactors.retained, retained, &q) < 1e-9);
    }
    for local in 0..8 {
        for k in 0..4 {
            let (i, j) = (2 * local + k / 2, 2 * local + k % 2);
            let scale = (q[(i, i)] * q[(j, j)]).sqrt();
            assert!((cofactors.local[4 * local + k] - q[(i, j)]).abs() < 1e-9 * scale);
        }
    }
    // The carriers have minimal displacements: these have a zero component along the null vectors.
    for vector in null_vectors(&free.unknowns) {
        let along: f64 =
            vector.iter().zip(&free.unknowns).zip(&problem.initial).map(|((g, x), x0)| g * (x - x0)).sum();
        let length = vector.iter().map(|g| g * g).sum::<f64>().sqrt();
        assert!((along / length).abs() < 1e-9);
    }
    // Distances are independent of the datum.
    for (row, r) in redundancy.iter().enumerate() {
        let share: f64 = (0..a.ncols())
            .flat_map(|i| (0..a.ncols()).map(move |j| (i, j)))
            .map(|(i, j)| a[(row, i)] * q[(i, j)] * a[(row, j)])
            .sum();
        assert!((1.0 - share - r).abs() < 1e-9);
    }
    for (r, there) in redundancy.iter().zip(found.redundancy.as_ref().unwrap()) {
        assert!((r - there).abs() < 1e-9);
    }
    let sum: f64 = redundancy.iter().sum();
    assert!((sum - found.counts.degrees_of_freedom() as f64).abs() < 1e-8);
    assert!(found.redundancy_excess.unwrap().abs() < 1e-8);

    // Without cofactors only the unknowns are transformed, without a factorization.
    let bare = Options { covariance: false, ..options() };
    let mut moved = adjust(&problem, &bare, &mut Context::new(&threads)).unwrap();
    let formations = moved.effort.formations;
    moved.take_to(&problem, &bare, &datum, &problem.initial, &mut Context::new(&threads)).unwrap();
    assert!(moved.cofactors.is_none() && moved.redundancy.is_none());
    assert_eq!(moved.effort.formations, formations);
    let difference = moved.unknowns.iter().zip(&free.unknowns).map(|(x, other)| (x - other).abs());
    assert!(difference.fold(0.0, f64::max) < 1e-9);
}

#[test]
fn a_datum_does_not_depend_on_where_the_network_comes_from() {
    let threads = threads();
    let in_datum_of = |held: Vec<usize>| {
        let problem = network(held);
        let mut found = adjust(&problem, &options(), &mut Context::new(&threads)).unwrap();
        // Datum of three retained points.
        let datum = Datum {
            carriers: (20..26).map(|unknown| (unknown, 1.0)).collect(),
            left: vec![],
            relative: false,
        };
        found.take_to(&problem, &options(), &datum, &problem.initial, &mut Context::new(&threads)).unwrap();
        found.cofactors.unwrap()
    };
    let one = in_datum_of(vec![16, 17, 19]);
    let other = in_datum_of(vec![38, 39, 30]);
    for (a, b) in one.retained.iter().zip(&other.retained) {
        assert!((a - b).abs() < 1e-7 * SD * SD, "{a} {b}");
    }
    assert_eq!(one.equations.len(), 32 + 36);
}

#[test]
fn too_few_carriers_are_refused() {
    let problem = network(vec![16, 17, 19]);
    let threads = threads();
    let mut found = adjust(&problem, &options(), &mut Context::new(&threads)).unwrap();
    // One point defines shifts, but not a rotation about itself; one coordinate of four points does not define the shift along the other.
    for carriers in [vec![16, 17], vec![16, 18, 20, 22]] {
        let carriers = carriers.into_iter().map(|unknown| (unknown, 1.0)).collect();
        let datum = Datum { carriers, left: vec![], relative: false };
        let refused =
            found.take_to(&problem, &options(), &datum, &problem.initial, &mut Context::new(&threads));
        assert_eq!(refused.unwrap_err(), DatumError::NotCarried);
    }
}

#[test]
fn what_is_open_is_found_by_trying_and_held() {
    let threads = threads();
    let adjusted = |change: &dyn Fn(&mut Problem<Trilateration>), method: Method| {
        let mut problem = network(vec![16, 17, 19]);
        change(&mut problem);
        (adjust(&problem, &Options { method, ..options() }, &mut Context::new(&threads)).unwrap(), problem)
    };
    for method in [
        Method::default(),
        Method::TrustRegion(Stop::Decrease(1e-14)),
        Method::Full(Published::Percent(1e-6)),
    ] {
        let (free, _) = adjusted(&|_| {}, method);
        assert_eq!((free.status, &free.datum[..]), (Status::Converged, &[16, 17, 19][..]), "{method:?}");
        let redundancy: f64 = free.redundancy.iter().flatten().sum();
        assert!((redundancy - free.counts.degrees_of_freedom() as f64).abs() < 1e-8);
        assert_eq!(free.counts.degrees_of_freedom(), 32 + 36 - 40 + 3);
        // A fixed point leaves the rotation; a point observed in x leaves the shift along y and the rotation.
        let (turning, _) = adjusted(&|problem| problem.sd[24..26].fill(0.0), method);
        assert_eq!(turning.datum, [16]);
        let (undetermined_photos, _) = adjusted(&|problem| problem.sd[24] = 0.5, method);
        assert_eq!(undetermined_photos.datum, [16, 17]);
        // Two points define the datum.
        let (mut placed, problem) = adjusted(&|problem| problem.sd[24..28].fill(0.5), method);
        assert!(placed.datum.is_empty());
        let datum = Datum {
            carriers: (0..40).map(|unknown| (unknown, 1.0)).collect(),
            left: vec![],
            relative: false,
        };
        let refused =
            placed.take_to(&problem, &options(), &datum, &problem.initial, &mut Context::new(&threads));
        assert_eq!(refused.unwrap_err(), DatumError::NotFree);
    }
}

#[test]
fn a_loss_takes_the_weight_of_a_wrong_term() {
    let mut problem = network(vec![16, 17, 19]);
    let wrong = problem.layout().groups() + 5;
    problem.model.lengths[wrong] += 3.0;
    let robust = Options { loss: Some(Loss::Huber(1.5)), covariance: false, ..options() };
    let found = adjust(&problem, &robust, &mut Context::new(&threads())).unwrap();
    let weights = found.weights.unwrap();
    assert_eq!(weights.len(), 32 + 36);
    let least = (0..weights.len()).min_by(|&a, &b| weights[a].total_cmp(&weights[b])).unwrap();
    assert_eq!(least, wrong);
    assert!(weights[wrong] < 0.1);
}

#[test]
fn excluded_observations_may_not_be_finite() {
    let threads = threads();
    let adjusted = |length: f64, method: Method, loss: Option<Loss>| {
        let mut problem = network(vec![16, 17, 19]);
        for excluded in [5, problem.layout().groups() + 7] {
            problem.observation_sd[excluded] = f64::INFINITY;
            problem.model.lengths[excluded] = length;
        }
        let found =
            adjust(&problem, &Options { method, loss, ..options() }, &mut Context::new(&threads)).unwrap();
        let (values, held) = (found.unknowns.clone(), found.datum.clone());
        let leverages = Leverages::at(&problem, values, held, &mut Context::new(&threads)).unwrap();
        let of_point = leverages
            .of_locals(&problem, (&problem.observation_sd, None), &[1], (|_| vec![], None), &threads)
            .unwrap();
        (found, leverages.sum_of_squares(&problem), of_point[0].equations.clone())
    };
    for (method, loss) in [
        (Method::default(), None),
        (Method::default(), Some(Loss::Huber(1.5))),
        (Method::TrustRegion(Stop::Decrease(1e-14)), None),
        (Method::TrustRegion(Stop::Decrease(1e-14)), Some(Loss::Cauchy(1.5))),
        (Method::Full(Published::Percent(1e-6)), None),
    ] {
        let (expected, squares, equations) = adjusted(90.0, method, loss);
        let (found, found_squares, found_equations) = adjusted(f64::NAN, method, loss);
        assert_eq!((found.status, &found.unknowns), (Status::Converged, &expected.unknowns), "{method:?}");
        assert_eq!(
            found.iterations.last().unwrap().sum_of_squares,
            expected.iterations.last().unwrap().sum_of_squares
        );
        assert_eq!((found.datum, found.weights), (expected.datum, expected.weights));
        assert_eq!(found.redundancy, expected.redundancy);
        assert_eq!(found.cofactors.unwrap().retained, expected.cofactors.unwrap().retained);
        assert_eq!((found_squares, found_equations), (squares, equations));
        assert!(found.residuals[5].is_nan());
    }
}

#[test]
fn equations_of_terms_have_the_cofactors_of_solutions() {
    let (problem, threads) = (network(vec![]), threads());
    let adjusted = adjust(&problem, &Options::default(), &mut Context::new(&threads)).unwrap();
    let (values, held) = (adjusted.unknowns, adjusted.datum);
    let leverages =
        Leverages::at(&problem, values.clone(), held.clone(), &mut Context::new(&threads)).unwrap();
    let linearized = Linearized::form(&problem, None, values, held, &mut Context::new(&threads)).unwrap();
    let layout = problem.layout();
    let terms: Vec<usize> = (0..layout.terms().len()).collect();
    for rows in leverages.rows_of_terms(&problem, &problem.observation_sd, &terms, &threads) {
        let dense = |row: &Vec<(usize, f64)>| {
            let mut dense = vec![0.0; layout.unknowns()];
            row.iter().for_each(|&(unknown, value)| dense[unknown] = value);
            dense
        };
        let rights: Vec<f64> = rows.iter().flat_map(dense).collect();
        let solved = linearized.solve_for(&problem, &rights, &mut Context::new(&threads)).unwrap();
        let found = leverages.of_rows(layout, &rows).unwrap();
        for (k, value) in found.equations.iter().enumerate() {
            let column = &solved[k % rows.len() * layout.unknowns()..][..layout.unknowns()];
            let expected: f64 = rows[k / rows.len()].iter().map(|&(unknown, a)| a * column[unknown]).sum();
            assert!((value - expected).abs() < 1e-9, "{k}: {value} {expected}");
        }
        let widths: usize = found.blocks.iter().map(|(_, along)| along.len() / rows.len()).sum();
        assert_eq!(widths, rows[0].len());
    }
}

#[test]
fn observations_of_one_point_take_up_together_what_further_right_hand_sides_say() {
    let (problem, threads) = (network(vec![]), threads());
    let adjusted = adjust(&problem, &Options::default(), &mut Context::new(&threads)).unwrap();
    let (values, held) = (adjusted.unknowns.clone(), adjusted.datum.clone());
    let leverages =
        Leverages::at(&problem, values.clone(), held.clone(), &mut Context::new(&threads)).unwrap();
    let local = 3;
    let layout = problem.layout();
    // The rows of the point, over all unknowns, for unit weight; fixed unknowns have zero columns.
    let row = |group: usize| {
        let mut row = vec![0.0; layout.unknowns()];
        let (point, station) = (layout.local_range(local), layout.retained_range(layout.retained_of(group)));
        let (_, partials) = problem.model.distance(&adjusted.unknowns, group, point.start, station.start);
        for k in 0..2 {
            row[point.start + k] = partials[k] / SD;
            row[station.start + k] = -partials[k] / SD;
        }
        adjusted.datum.iter().for_each(|&held| row[held] = 0.0);
        row
    };
    let rows: Vec<Vec<f64>> = layout.groups_of(local).map(row).collect();
    let linearized = Linearized::form(&problem, None, values, held, &mut Context::new(&threads)).unwrap();
    let solved = linearized.solve_for(&problem, &rows.concat(), &mut Context::new(&threads)).unwrap();
    let sd = &problem.observation_sd;
    let found = leverages.of_locals(&problem, (sd, None), &[local, 0], (|_| vec![], None), &threads).unwrap();
    let blocks: Vec<Vec<f64>> = found.into_iter().map(|own| own.equations).collect();
    assert_eq!(blocks.len(), 2);
    for (k, value) in blocks[0].iter().enumerate() {
        let column = &solved[k % 4 * layout.unknowns()..][..layout.unknowns()];
        let expected: f64 = rows[k / 4].iter().zip(column).map(|(a, q)| a * q).sum();
        assert!((value - expected).abs() < 1e-9, "{k}: {value} {expected}");
    }
    let redundancy = adjusted.redundancy.unwrap();
    for (k, group) in layout.groups_of(local).enumerate() {
        // The adjustment computed its own before the last step, which is 1e-5 of the standard deviations.
        assert!((1.0 - blocks[0][5 * k] - redundancy[group]).abs() < 1e-6);
    }
}
