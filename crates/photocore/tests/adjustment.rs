//! Adjustment of a small problem without photographs.
//!
//! Points of a plane (local blocks of two) are measured in frames (retained blocks: shift and rotation) with a common scale and a common
//! radial distortion (a shared block).

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::collections::HashSet;
use std::ops::ControlFlow;
use std::sync::Mutex;
use std::thread::{self, ThreadId};

use photocore::adjustment::{
    AdjustError, Adjustment, Evaluated, Linearized, Method, Model, Options, Problem, Published, Requests,
    Status, Stop, adjust, adjust_with,
};
use photocore::normals::{GroupRows, Layout, LayoutError, Ordering, System};
use photocore::{Context, Event, Phase, Stopped, Threads};

const FRAMES: usize = 4;
const POINTS: usize = 9;
const SCALE: usize = 2 * POINTS + 3 * FRAMES;
const UNKNOWNS: usize = SCALE + 2;

#[derive(Debug)]
struct Frames {
    measured: Vec<[f64; 2]>,
    frame_of: Vec<usize>,
}

/// Returns coordinates in a frame, each with partials: point (2), frame (3), scale and distortion (2).
fn measure(point: &[f64], frame: &[f64], common: &[f64]) -> ([f64; 2], [[f64; 7]; 2]) {
    let (sin, cos) = frame[2].sin_cos();
    let (dx, dy) = (point[0] - frame[0], point[1] - frame[1]);
    let (p, q) = (cos * dx + sin * dy, -sin * dx + cos * dy);
    let (scale, distortion) = (common[0], common[1]);
    let radial = 1.0 + distortion * (p * p + q * q);
    // Partials with respect to p and q, which rotate with the frame.
    let by_p = [scale * (radial + 2.0 * distortion * p * p), scale * 2.0 * distortion * p * q];
    let by_q = [scale * 2.0 * distortion * p * q, scale * (radial + 2.0 * distortion * q * q)];
    let values = [scale * p * radial, scale * q * radial];
    let partials = std::array::from_fn(|row| {
        let by_x = by_p[row] * cos - by_q[row] * sin;
        let by_y = by_p[row] * sin + by_q[row] * cos;
        let turn = by_p[row] * q - by_q[row] * p;
        let along = if row == 0 { p } else { q };
        [by_x, by_y, -by_x, -by_y, turn, along * radial, scale * along * (p * p + q * q)]
    });
    (values, partials)
}

struct At<'a> {
    frames: &'a Frames,
    values: Vec<f64>,
}

impl Model for Frames {
    fn at<'a>(&'a self, unknowns: &[f64]) -> Box<dyn Evaluated + 'a> {
        Box::new(At { frames: self, values: unknowns.to_vec() })
    }
}

impl Evaluated for At<'_> {
    fn observe(&self, local: usize, group: usize, rows: &mut GroupRows<'_>) {
        let Self { frames, values } = self;
        let frame = &values[2 * POINTS + 3 * frames.frame_of[group]..][..3];
        let (computed, partials) = measure(&values[2 * local..][..2], frame, &values[SCALE..]);
        for row in 0..2 {
            rows.constant[row] = frames.measured[group][row] - computed[row];
            rows.local[2 * row..][..2].copy_from_slice(&partials[row][..2]);
            rows.retained[3 * row..][..3].copy_from_slice(&partials[row][2..5]);
            rows.shared[2 * row..][..2].copy_from_slice(&partials[row][5..]);
        }
    }
}

/// Returns deterministic noise from incommensurable angles.
fn noise(index: usize) -> f64 {
    (1.7 * index as f64 + 0.3).sin()
}

fn truth() -> Vec<f64> {
    let points = (0..POINTS).flat_map(|i| [(i % 3) as f64 - 1.0, (i / 3) as f64 - 1.0]);
    let frames = (0..FRAMES).flat_map(|i| [0.2 * noise(i), 0.2 * noise(i + 10), 0.5 * i as f64 - 0.7]);
    points.chain(frames).chain([2.0, 0.05]).collect()
}

/// Returns the problem with every point in every frame; all unknowns are free, the standard deviation is 0.001.
fn problem() -> Problem<Frames> {
    let truth = truth();
    let (mut measured, mut frame_of) = (Vec::new(), Vec::new());
    for point in 0..POINTS {
        for frame in 0..FRAMES {
            let place = &truth[2 * POINTS + 3 * frame..][..3];
            let (exact, _) = measure(&truth[2 * point..][..2], place, &truth[SCALE..]);
            let group = measured.len();
            measured.push([exact[0] + 1e-3 * noise(group), exact[1] + 1e-3 * noise(group + 500)]);
            frame_of.push(frame);
        }
    }
    let pointers = (0..=POINTS).map(|point| point * FRAMES).collect();
    let retained = frame_of.iter().map(|&frame| frame as u32).collect();
    let layout = Layout::new(2, 2, &[[3; FRAMES].as_slice(), &[2]].concat(), pointers, retained).unwrap();
    let shared = vec![FRAMES as u32; measured.len()];
    let layout = layout.with_shared((0..=measured.len()).collect(), shared).unwrap();
    let initial: Vec<f64> = truth.iter().enumerate().map(|(i, value)| value + 0.02 * noise(i + 70)).collect();
    Problem {
        observation_sd: vec![1e-3; 2 * measured.len()],
        model: Frames { measured, frame_of },
        system: System::new(layout, Ordering::Auto).unwrap(),
        prior: initial.clone(),
        initial,
        sd: vec![f64::INFINITY; UNKNOWNS],
    }
}

/// Adds the true values of unknowns as observations.
fn hold(problem: &mut Problem<Frames>, unknowns: &[usize], sd: f64) {
    for &unknown in unknowns {
        problem.prior[unknown] = truth()[unknown];
        problem.initial[unknown] = truth()[unknown];
        problem.sd[unknown] = sd;
    }
}

const STRICT: Options = Options {
    method: Method::Damped(Stop::Fraction(1e-8)),
    max_iterations: 50,
    covariance: true,
    loss: None,
    threads: 0,
};

fn run(problem: &Problem<Frames>, options: &Options) -> Result<Adjustment, AdjustError> {
    let threads = Threads::new(1).unwrap();
    let requests = Requests { history: usize::MAX, ..Requests::default() };
    adjust_with(problem, options, requests, &mut Context::new(&threads))
}

/// Two points with both coordinates: the datum of the plane, and its scale.
const DATUM: [usize; 4] = [0, 1, 16, 17];

#[test]
fn redundancy_numbers_sum_to_the_degrees_of_freedom_from_free_to_fixed() {
    for sd in [0.0, 1e-4, 1e-2, 0.1] {
        let mut problem = problem();
        hold(&mut problem, &DATUM, sd);
        hold(&mut problem, &[2 * POINTS + 3], 0.1);
        hold(&mut problem, &[SCALE + 1], 0.01);
        let adjusted = run(&problem, &STRICT).unwrap();
        assert_eq!(adjusted.status, Status::Converged);
        let counts = adjusted.counts;
        let fixed = if sd == 0.0 { DATUM.len() } else { 0 };
        assert!(adjusted.redundancy_excess.unwrap().abs() < 1e-9);
        assert_eq!(counts.observations, 2 * POINTS * FRAMES);
        assert_eq!((counts.weighted, counts.unknowns), (6 - fixed, UNKNOWNS - fixed));
        let redundancy = adjusted.redundancy.unwrap().iter().sum::<f64>()
            + adjusted.prior_redundancy.unwrap().iter().sum::<f64>();
        let expected = (counts.observations + counts.weighted - counts.unknowns) as f64;
        assert!((redundancy - expected).abs() < 1e-9 * expected, "sd {sd}: {redundancy} of {expected}");
    }
}

#[test]
fn weights_lead_from_fixed_to_free() {
    let distortion_with = |sd: f64| {
        let mut problem = problem();
        hold(&mut problem, &DATUM, 0.0);
        hold(&mut problem, &[SCALE + 1], sd);
        let adjusted = run(&problem, &STRICT).unwrap();
        (adjusted.unknowns[SCALE + 1], adjusted.cofactors.unwrap().retained.last().unwrap().sqrt())
    };
    let ((fixed, fixed_sd), (free, free_sd)) = (distortion_with(0.0), distortion_with(f64::INFINITY));
    assert_eq!((fixed, fixed_sd), (truth()[SCALE + 1], 0.0));
    assert!((free - truth()[SCALE + 1]).abs() < 4.0 * free_sd);
    let (value, sd) = distortion_with(1e-9);
    assert!((value - fixed).abs() < 1e-8 && (sd - 1e-9).abs() < 1e-12);
    let (value, sd) = distortion_with(1e3);
    assert!((value - free).abs() < 1e-6 * free_sd && (sd - free_sd).abs() < 1e-6 * free_sd);
    // Two independent determinations add their weights.
    let (_, sd) = distortion_with(free_sd);
    assert!((sd - free_sd / 2.0_f64.sqrt()).abs() < 1e-3 * free_sd);
}

#[test]
fn a_bad_start_is_damped_and_a_good_one_is_not() {
    let mut problem = problem();
    hold(&mut problem, &DATUM, 0.0);
    let near = run(&problem, &STRICT).unwrap();
    assert!(near.iterations.iter().all(|iteration| iteration.damping == 0.0));
    assert_eq!(near.effort.formations, near.iterations.len());
    for frame in 0..FRAMES {
        problem.initial[2 * POINTS + 3 * frame + 2] += 1.2 * noise(3 * frame + 1);
    }
    problem.initial[SCALE] = 0.4;
    let published = Options { method: Method::Full(Published::Percent(5.0)), ..STRICT };
    assert_eq!(run(&problem, &published).unwrap().status, Status::Diverged);
    let far = run(&problem, &STRICT).unwrap();
    assert_eq!(far.status, Status::Converged);
    assert!(far.iterations.iter().any(|iteration| iteration.damping > 0.0));
    let sums: Vec<f64> = far.iterations.iter().map(|iteration| iteration.sum_of_squares).collect();
    assert!(sums.windows(2).all(|pair| pair[1] <= pair[0] * (1.0 + 1e-9)));
    for (a, b) in far.unknowns.iter().zip(&near.unknowns) {
        assert!((a - b).abs() < 1e-9);
    }
}

#[test]
fn corrections_lead_from_the_initial_to_the_adjusted_values() {
    let mut problem = problem();
    hold(&mut problem, &DATUM, 0.0);
    for frame in 0..FRAMES {
        problem.initial[2 * POINTS + 3 * frame + 2] += 1.2 * noise(3 * frame + 1);
    }
    for method in [STRICT.method, Method::Full(Published::Percent(5.0))] {
        let adjusted = run(&problem, &Options { method, ..STRICT }).unwrap();
        assert_eq!(adjusted.corrections().count(), adjusted.iterations.len());
        assert!(adjusted.iterations.len() > 1);
        for (i, (initial, last)) in
            problem.initial.iter().zip(&adjusted.unknowns).enumerate().skip(2 * POINTS)
        {
            let sum: f64 = adjusted.corrections().map(|all| all[i - 2 * POINTS]).sum();
            assert!((initial + sum - last).abs() < 1e-13);
        }
        // One iteration fewer ends at the start of the last iteration.
        let max_iterations = adjusted.iterations.len() - 1;
        let before = run(&problem, &Options { method, max_iterations, ..STRICT }).unwrap();
        for (i, correction) in adjusted.last_corrections.iter().enumerate() {
            assert!((before.unknowns[i] + correction - adjusted.unknowns[i]).abs() < 1e-13);
        }
    }
}

#[test]
fn undetermined_unknowns_are_named() {
    // Without a datum the plane is shifted, rotated and scaled with all frames and the scale.
    let Err(AdjustError::Undetermined(combinations)) = run(&problem(), &STRICT) else { panic!("determined") };
    // Scaling about the centre of a frame does not change this frame.
    let all: Vec<usize> = (0..FRAMES).collect();
    assert_eq!(combinations.iter().filter(|&blocks| *blocks == all).count(), 3);
    assert_eq!(combinations.iter().filter(|blocks| blocks.contains(&FRAMES)).count(), 1);
    // A fixed scale leaves the shift and the rotation undetermined.
    let mut problem = problem();
    hold(&mut problem, &[SCALE], 0.0);
    let Err(AdjustError::Undetermined(combinations)) = run(&problem, &STRICT) else { panic!("determined") };
    assert_eq!(combinations, vec![all; 3]);
}

#[test]
fn what_cannot_be_computed_is_refused() {
    let mut problem = problem();
    hold(&mut problem, &DATUM, 0.0);
    problem.initial[SCALE] = f64::NAN;
    assert_eq!(run(&problem, &STRICT).unwrap_err(), AdjustError::NotFinite);
}

#[test]
fn slices_of_other_lengths_are_refused() {
    let observations = 2 * POINTS * FRAMES;
    type Field = fn(&mut Problem<Frames>) -> &mut Vec<f64>;
    let fields: [(&str, Field, usize); 4] = [
        ("Problem::observation_sd", |problem| &mut problem.observation_sd, observations),
        ("Problem::initial", |problem| &mut problem.initial, UNKNOWNS),
        ("Problem::prior", |problem| &mut problem.prior, UNKNOWNS),
        ("Problem::sd", |problem| &mut problem.sd, UNKNOWNS),
    ];
    let threads = Threads::new(1).unwrap();
    for (field, slice, required) in fields {
        for length in [0, required - 1, required + 1] {
            let mut problem = problem();
            hold(&mut problem, &DATUM, 0.0);
            slice(&mut problem).resize(length, 1.0);
            let expected = AdjustError::Layout(LayoutError::Length { field, length, required });
            assert_eq!(run(&problem, &STRICT).unwrap_err(), expected);
            let formed = Linearized::form(&problem, None, truth(), vec![], &mut Context::new(&threads));
            assert_eq!(formed.unwrap_err(), expected);
        }
    }
}

#[test]
fn progress_reports_every_phase_and_stops_any() {
    let mut problem = problem();
    hold(&mut problem, &DATUM, 0.0);
    let threads = Threads::new(1).unwrap();
    let (mut events, mut phases, mut iterations) = (0, Vec::new(), 0);
    let mut progress = |event| {
        events += 1;
        match event {
            Event::Progress { phase, done, total } => {
                assert!(done <= total && total == POINTS);
                phases.push(phase);
            }
            Event::Iteration(iteration) => {
                iterations += 1;
                assert_eq!(iteration.number, iterations);
            }
        }
        ControlFlow::Continue(())
    };
    let whole = adjust(&problem, &STRICT, &mut Context::with_progress(&threads, &mut progress));
    assert_eq!(whole.unwrap().iterations.len(), iterations);
    for phase in [Phase::Form, Phase::Solve, Phase::Invert] {
        assert!(phases.contains(&phase), "{phase:?}");
    }
    for last in 0..events {
        let mut count = 0;
        let mut progress = |_| {
            count += 1;
            if count > last { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let stopped = adjust(&problem, &STRICT, &mut Context::with_progress(&threads, &mut progress));
        assert_eq!(stopped.unwrap_err(), AdjustError::Stopped(Stopped::Interrupted));
        assert_eq!(count, last + 1);
    }
}

#[test]
fn without_covariance_there_is_none() {
    let mut problem = problem();
    hold(&mut problem, &DATUM, 0.0);
    let adjusted = run(&problem, &Options { covariance: false, ..STRICT }).unwrap();
    assert_eq!(adjusted.status, Status::Converged);
    assert!(adjusted.cofactors.is_none() && adjusted.redundancy.is_none());
    assert!(adjusted.prior_redundancy.is_none());
}

/// Model that records the thread of its observations.
#[derive(Debug)]
struct Witness {
    frames: Frames,
    seen: Mutex<HashSet<ThreadId>>,
}

struct Witnessed<'a> {
    frames: Box<dyn Evaluated + 'a>,
    seen: &'a Mutex<HashSet<ThreadId>>,
}

impl Model for Witness {
    fn at<'a>(&'a self, unknowns: &[f64]) -> Box<dyn Evaluated + 'a> {
        Box::new(Witnessed { frames: self.frames.at(unknowns), seen: &self.seen })
    }
}

impl Evaluated for Witnessed<'_> {
    fn observe(&self, local: usize, group: usize, rows: &mut GroupRows<'_>) {
        self.seen.lock().unwrap().insert(thread::current().id());
        self.frames.observe(local, group, rows);
    }
}

#[test]
fn a_thread_of_another_pool_watches_and_leaves_the_work_to_the_pool_that_it_is_given() {
    let of_pools = thread::spawn(|| {
        let own = Threads::from(
            rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build().unwrap(),
        );
        let other = Threads::new(1).unwrap();
        [&own, &other].map(|threads| {
            let mut held = problem();
            hold(&mut held, &DATUM, 0.0);
            let Problem { model, system, observation_sd, initial, prior, sd } = held;
            let model = Witness { frames: model, seen: Mutex::default() };
            let problem = Problem { model, system, observation_sd, initial, prior, sd };
            adjust(&problem, &STRICT, &mut Context::new(threads)).unwrap();
            problem.model.seen.into_inner().unwrap().contains(&thread::current().id())
        })
    });
    assert_eq!(of_pools.join().unwrap(), [true, false]);
}
