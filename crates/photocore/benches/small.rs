//! Hand-written small algebra, retained because it is faster or clearer, compared with `nalgebra`. The cases are three linear equations
//! (per intersected point) and the rotation of three angles (per photo).

#![allow(missing_docs)]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::Rotation3;
use photocore::geometry::{Matrix3, Vector3, rotation};

/// Relative size of a determinant that counts as zero.
const TOLERANCE: f64 = 1e-8;

fn equations(criterion: &mut Criterion) {
    let matrix = Matrix3::new(4.0, -1.0, 0.3, -1.0, 3.0, 0.2, 0.3, 0.2, 2.0);
    let right = Vector3::new(1.0, -2.0, 0.5);
    let mut group = criterion.benchmark_group("three equations");
    group.bench_function("cramer", |bencher| {
        bencher.iter(|| rotation::solve(black_box(&matrix), black_box(&right), TOLERANCE));
    });
    group.bench_function("nalgebra, LU", |bencher| {
        bencher.iter(|| black_box(matrix).lu().solve(black_box(&right)));
    });
    group.bench_function("nalgebra, Cholesky", |bencher| {
        bencher.iter(|| black_box(matrix).cholesky().map(|factor| factor.solve(black_box(&right))));
    });
    group.finish();
}

fn angles(criterion: &mut Criterion) {
    let angles = [0.3, -0.7, 2.1];
    let mut group = criterion.benchmark_group("rotation of three angles");
    group.bench_function("written out", |bencher| bencher.iter(|| rotation(black_box(angles))));
    group.bench_function("nalgebra, product", |bencher| {
        bencher.iter(|| {
            // M rotates the axes, nalgebra's rotations rotate vectors.
            let [omega, phi, kappa] = black_box(angles).map(|angle| -angle);
            let turns = [Vector3::z_axis(), Vector3::y_axis(), Vector3::x_axis()];
            let [mz, my, mx] = [(kappa, 0), (phi, 1), (omega, 2)]
                .map(|(angle, k)| Rotation3::from_axis_angle(&turns[k], angle));
            mz * my * mx
        });
    });
    group.finish();
}

criterion_group!(benches, equations, angles);
criterion_main!(benches);
