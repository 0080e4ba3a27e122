//! Factorization of full reduced normal equations, as in collections with complete overlap, compared with a dense Cholesky factorization of
//! the same size by `faer`.

// Panics are acceptable in a benchmark.
#![allow(clippy::expect_used, missing_docs)]

use std::sync::Arc;
use std::time::{Duration, Instant};

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{cholesky_in_place, cholesky_in_place_scratch};
use faer::{Mat, Par};
use photocore::normals::{Equations, FactorOptions, GroupRows, Layout, Ordering, Prior, System};
use photocore::{Context, Threads};

/// Number of unknowns of a photograph.
const DIM: usize = 9;
/// Number of points, each visible on every photograph: few, so that the formation is fast.
const POINTS: usize = 5;

/// Arbitrary equations.
struct Anything(Prior);

impl Equations for Anything {
    fn write(&self, local: usize, group: usize, rows: &mut GroupRows<'_>) {
        let value = |k: usize| (1.3 * k as f64 + 0.7 * local as f64 + 0.11 * (group % 1009) as f64).sin();
        rows.constant.iter_mut().enumerate().for_each(|(k, v)| *v = value(k));
        rows.local.iter_mut().enumerate().for_each(|(k, v)| *v = value(3 * k + 1));
        rows.retained.iter_mut().enumerate().for_each(|(k, v)| *v = value(7 * k + 2));
    }

    fn prior(&self) -> &Prior {
        &self.0
    }
}

fn system(photos: usize) -> (Arc<System>, Anything) {
    let retained = (0..POINTS * photos).map(|group| (group % photos) as u32).collect();
    let pointers = (0..=POINTS).map(|point| point * photos).collect();
    let layout = Layout::new(2, 3, &vec![DIM; photos], pointers, retained).expect("a layout");
    let unknowns = layout.unknowns();
    (
        System::new(layout, Ordering::Auto).expect("a system"),
        Anything(Prior { weight: vec![100.0; unknowns], right: vec![0.0; unknowns], between: vec![] }),
    )
}

/// Returns the time of the factorization without the formation.
fn factor(threads: &Threads, system: &Arc<System>, equations: &Anything) -> Duration {
    let start = Instant::now();
    let done = system.factor(equations, &FactorOptions::default(), &mut Context::new(threads));
    let elapsed = start.elapsed();
    match done {
        Ok(factor) => elapsed.mul_f64(1.0 - factor.formation_share),
        Err(_) => unreachable!("nothing interrupts"),
    }
}

fn dense(threads: &Threads, mut matrix: Mat<f64>) -> Mat<f64> {
    threads.install(|| {
        let (par, dim) = (Par::rayon(0), matrix.nrows());
        let mut memory = MemBuffer::new(cholesky_in_place_scratch::<f64>(dim, par, Default::default()));
        let stack = MemStack::new(&mut memory);
        let regularization = Default::default();
        cholesky_in_place(matrix.as_mut(), regularization, par, stack, Default::default()).expect("definite");
    });
    matrix
}

fn full(criterion: &mut Criterion) {
    let threads = Threads::new(0).expect("a threads");
    for photos in [160, 500] {
        let dim = DIM * photos;
        let mut group = criterion.benchmark_group(format!("full/{dim}"));
        let (system, equations) = system(photos);
        group.bench_function("factor", |bencher| {
            bencher.iter_custom(|times| (0..times).map(|_| factor(&threads, &system, &equations)).sum());
        });
        let matrix =
            Mat::from_fn(dim, dim, |i, j| if i == j { 10.0 * dim as f64 } else { ((i + j) as f64).sin() });
        group.bench_function("faer", |bencher| {
            bencher.iter_batched(
                || matrix.clone(),
                |matrix| dense(&threads, matrix),
                BatchSize::PerIteration,
            );
        });
        group.finish();
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10);
    targets = full
}
criterion_main!(benches);
