//! Adjustment of a block of parallel strips, in total and per phase, compared with a dense matrix product.
//!
//! Environment variables define the size: `STRIPS=50 PHOTOS=100 cargo bench --package photocore --bench block`. Criterion's elements are
//! multiply-adds if counted, so that the rates of the phases compare with `dense/product`. The elements of `linearize` are image
//! observations, the elements of `adjust` are photographs.

// Panics are acceptable in a benchmark.
#![allow(clippy::expect_used, missing_docs)]

use std::fmt::Debug;
use std::hint::black_box;
use std::sync::Arc;

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par};
use photocore::geometry::{self, Bal, ObjectSpace, Orientation, Perspective, PoseNumbers, RotationSense};
use photocore::network::{Camera, Image, Network, Options, Photo, Point, Screens, Start, UnitVariance};
use photocore::normals::{
    Equations, Factor, FactorOptions, GroupRows, InvertOptions, Layout, Ordering, Prior, SolveOptions, System,
};
use photocore::{Context, Threads, adjustment};

/// Number of rows and columns of the dense product.
const DENSE: usize = 1024;

/// Wide-angle photographs from 4,500 m, 60 % forward and 30 % side overlap, a hundred points per photograph.
const PRINCIPAL_DISTANCE: f64 = -152.74;
const FLYING_HEIGHT: f64 = 4500.0;
const HALF_FRAME: f64 = 115.0;
const BASE: f64 = 2710.0;
const SEPARATION: f64 = 4743.0;
/// Distance between ground points in metres: four columns per base, seven rows per strip separation.
const SPACING: f64 = 677.5;
/// Visibility limit of a photograph along or across the strip, in metres.
const REACH: f64 = 1.2 * FLYING_HEIGHT * HALF_FRAME / -PRINCIPAL_DISTANCE;
const IMAGE_SD: f64 = 0.01;
/// Number of points per control point.
const CONTROL: usize = 50;
const CONTROL_SD: f64 = 0.05;

/// Returns the block of the size given by the environment, and its name.
fn block() -> (Network, String) {
    let number = |name: &str, default: usize| {
        std::env::var(name).map_or(default, |text| text.parse().expect("a number of strips or photographs"))
    };
    let (count, photos) = (number("STRIPS", 20), number("PHOTOS", 50));
    (strips(count, photos), format!("{count}x{photos}"))
}

/// Returns an error-free block with initial stations wrong by about ten metres and some milliradians.
fn strips(strips: usize, photos_per_strip: usize) -> Network {
    let (space, sense) = (ObjectSpace::Rectangular, RotationSense::GroundToPhoto);
    let true_photos: Vec<([f64; 3], [f64; 3])> = (0..strips * photos_per_strip)
        .map(|photo| {
            let (strip, number) = (photo / photos_per_strip, photo % photos_per_strip);
            let wave = |k: usize| (photo as f64 * (0.7 + 0.1 * k as f64)).sin();
            let position = [number as f64 * BASE, strip as f64 * SEPARATION, FLYING_HEIGHT + 20.0 * wave(0)];
            (position, [0.01 * wave(1), 0.01 * wave(2), 0.03 * wave(3)])
        })
        .collect();
    let mut block = Network {
        space,
        poses: PoseNumbers::Angles(sense),
        cameras: vec![Camera::held(Perspective { principal_distance: PRINCIPAL_DISTANCE }.into())],
        photos: vec![],
        points: vec![],
        images: vec![],
        ..Network::new()
    };
    for (photo, (position, attitude)) in true_photos.iter().enumerate() {
        let off = |k: usize| (photo as f64 * (1.3 + 0.2 * k as f64)).cos();
        let pose = std::array::from_fn(|k| match k {
            0..3 => position[k] + 15.0 * off(k),
            _ => attitude[k - 3] + 0.005 * off(k),
        });
        block.photos.push(Photo::free(pose, 0));
    }
    let cameras: Vec<geometry::View> = true_photos
        .iter()
        .map(|&(position, attitude)| {
            geometry::View::new(space, sense, position, attitude, PRINCIPAL_DISTANCE)
        })
        .collect();
    let columns = (photos_per_strip as f64 * BASE / SPACING) as usize;
    let rows = (strips as f64 * SEPARATION / SPACING) as usize;
    for (column, row) in (0..columns).flat_map(|column| (0..rows).map(move |row| (column, row))) {
        let height = 100.0 * (column as f64 * 0.3).sin() * (row as f64 * 0.2).cos();
        let coordinates = [column as f64 * SPACING, row as f64 * SPACING, height];
        let point = block.points.len();
        let at = geometry::Point::new(space, coordinates);
        let images: Vec<Image> = cameras
            .iter()
            .enumerate()
            .filter(|&(photo, _)| {
                let position = true_photos[photo].0;
                (0..2).all(|k| (position[k] - coordinates[k]).abs() < REACH)
            })
            .map(|(photo, camera)| Image { photo, point, xy: camera.project(&at), sd: [IMAGE_SD; 2] })
            .filter(|image| image.xy.iter().all(|value| value.abs() < HALF_FRAME))
            .collect();
        if images.len() >= 2 {
            let sd = if point.is_multiple_of(CONTROL) { CONTROL_SD } else { f64::INFINITY };
            block.points.push(Point { coordinates, sd: [sd; 3] });
            block.images.extend(images);
        }
    }
    block
}

/// Returns the block with one camera for all photographs, with free focal length and two free radial terms.
fn with_shared_camera(block: &Network) -> Network {
    let camera = Bal { parameters: [-PRINCIPAL_DISTANCE, 0.0, 0.0] };
    Network { cameras: vec![Camera::new(camera.into(), vec![f64::INFINITY; 3])], ..block.clone() }
}

/// Precomputed observation equations of a block, so that the phases of the normal equations are timed without the model.
struct Linear {
    projections: Vec<geometry::Projection>,
    prior: Prior,
}

impl Linear {
    /// Linearizes at the initial positions and attitudes of the block and the true positions of its points.
    fn new(block: &Network, prior: Prior) -> Self {
        let photos: Vec<geometry::View> = block
            .photos
            .iter()
            .map(|photo| geometry::View {
                orientation: Orientation::new(block.poses, block.space, &photo.pose),
                camera: Perspective { principal_distance: PRINCIPAL_DISTANCE },
            })
            .collect();
        let linearize = |image: &Image| {
            let point = geometry::Point::new(block.space, block.points[image.point].coordinates);
            photos[image.photo].linearize(&point)
        };
        Self { projections: block.images.iter().map(linearize).collect(), prior }
    }
}

impl Equations for Linear {
    fn write(&self, _: usize, group: usize, rows: &mut GroupRows<'_>) {
        let projection = &self.projections[group];
        for row in 0..2 {
            rows.constant[row] = projection.xy[row] / IMAGE_SD;
            for k in 0..3 {
                rows.local[3 * row + k] = projection.point[row][k] / IMAGE_SD;
            }
            for k in 0..6 {
                rows.retained[6 * row + k] = projection.photo[row][k] / IMAGE_SD;
            }
        }
    }

    fn prior(&self) -> &Prior {
        &self.prior
    }
}

/// Normal equations of a block.
struct Phases {
    threads: Threads,
    system: Arc<System>,
    equations: Linear,
}

impl Phases {
    fn new(block: &Network) -> Self {
        let mut start = vec![0];
        for (group, image) in block.images.iter().enumerate() {
            // The observations are sorted by point.
            start.resize(image.point + 1, group);
        }
        start.push(block.images.len());
        let photos = block.images.iter().map(|image| image.photo as u32).collect();
        let layout = Layout::new(2, 3, &vec![6; block.photos.len()], start, photos).expect("a layout");
        let mut weight = vec![0.0; layout.unknowns()];
        for (point, weight) in block.points.iter().zip(weight.as_chunks_mut::<3>().0) {
            *weight = point.sd.map(|sd| (sd * sd).recip());
        }
        let prior = Prior { right: vec![0.0; weight.len()], weight, between: vec![] };
        let equations = Linear::new(block, prior);
        Self { threads: threads(), system: System::new(layout, Ordering::Auto).expect("a system"), equations }
    }

    fn factor(&self) -> Factor {
        done(self.system.factor(&self.equations, &FactorOptions::default(), &mut Context::new(&self.threads)))
    }

    /// Returns the multiply-adds of the formation with its reduction, and of the cofactors, from the numbers of rays of the points. In
    /// addition to the reduction an observation needs 146. These are 20 for the normal matrix and right-hand side of the point, 72 for the
    /// coupling and triangular solution, 54 for block and right-hand side of the photograph. H Q_oo needs 3 (6 k)^2 for k photographs, the
    /// redundancy numbers of an observation about 100.
    fn operations(&self) -> (f64, f64) {
        let layout = self.system.layout();
        let reduction = self.system.symbolic().operations(layout).reduction;
        let rays = (0..layout.locals()).map(|local| layout.groups_of(local).len() as f64);
        let cofactors = rays.map(|k| 108.0 * k * k + 100.0 * k).sum();
        (reduction + 146.0 * layout.groups() as f64, cofactors)
    }
}

fn threads() -> Threads {
    Threads::new(0).expect("threads")
}

fn done<T, E: Debug>(result: Result<T, E>) -> T {
    result.expect("a result")
}

/// Converts multiply-adds to criterion's elements.
fn elements(operations: f64) -> Throughput {
    Throughput::Elements(operations as u64)
}

/// Measures the reference rate: a dense matrix product on all processors.
fn product(criterion: &mut Criterion) {
    let matrix =
        |shift: usize| Mat::from_fn(DENSE, DENSE, |i, j| ((7 * i + 3 * j + shift) % 11) as f64 - 5.0);
    let (a, b, mut c) = (matrix(0), matrix(1), Mat::<f64>::zeros(DENSE, DENSE));
    let mut group = criterion.benchmark_group("dense");
    group.throughput(elements((DENSE as f64).powi(3)));
    group.bench_function("product", |bencher| {
        bencher.iter(|| matmul(c.as_mut(), Accum::Replace, a.as_ref(), b.as_ref(), 1.0, Par::rayon(0)));
    });
    group.finish();
}

/// Measures the complete adjustment with all cofactors and redundancy numbers, for a fixed and for a shared free camera. Also measures the
/// linearization of the collinearity equations on one thread.
fn adjust(criterion: &mut Criterion) {
    let (block, size) = block();
    let threads = threads();
    let options = Options {
        adjustment: adjustment::Options {
            method: adjustment::Method::Damped(adjustment::Stop::Fraction(1e-5)),
            max_iterations: 50,
            covariance: true,
            loss: None,
            threads: 0,
        },
        ordering: Ordering::Auto,
        unit_variance: UnitVariance::Constrained,
        start: Start::Intersected,
        hold_unused: false,
        memory: None,
        reserved: 0,
        minimum: None,
        screens: Screens::default(),
        photo_corrections: false,
    };
    let adjust = |block: &Network| {
        block.adjustment(&options).run_in(&mut Context::new(&threads)).expect("a determined block")
    };
    let shared = with_shared_camera(&block);
    let mut group = criterion.benchmark_group(format!("block/{size}"));
    group.throughput(Throughput::Elements(block.photos.len() as u64));
    group.bench_function("adjust", |bencher| bencher.iter(|| black_box(adjust(&block))));
    group.bench_function("adjust with a shared camera", |bencher| {
        bencher.iter(|| black_box(adjust(&shared)));
    });
    group.throughput(Throughput::Elements(block.images.len() as u64));
    group.bench_function("linearize", |bencher| {
        bencher.iter(|| black_box(Linear::new(&block, Prior::default())))
    });
    group.finish();
}

/// Measures each phase of the normal equations once.
fn phases(criterion: &mut Criterion) {
    let (block, size) = block();
    let phases = Phases::new(&block);
    let Phases { threads, system, equations } = &phases;
    let predicted = system.symbolic().operations(system.layout());
    let (formation, cofactors) = phases.operations();
    let mut group = criterion.benchmark_group(format!("normals/{size}"));
    group.bench_function("order", |bencher| {
        let layout = || system.layout().clone();
        bencher.iter_batched(
            layout,
            |layout| System::new(layout, Ordering::Auto).expect("a system"),
            BatchSize::PerIteration,
        );
    });
    let factor = phases.factor();
    group.bench_function("solve", |bencher| {
        bencher.iter(|| done(factor.solve(equations, &SolveOptions::default(), &mut Context::new(threads))));
    });
    // Formation, reduction and factorization are interleaved, front by front, as are selected inverse and cofactors.
    group.throughput(elements(formation + predicted.factor));
    group.bench_function("factor", |bencher| bencher.iter(|| phases.factor()));
    group.throughput(elements(predicted.inverse + cofactors));
    group.bench_function("invert", |bencher| {
        let invert = |factor: Factor| {
            done(factor.invert(equations, &InvertOptions::default(), &mut Context::new(threads)))
        };
        bencher.iter_batched(|| phases.factor(), invert, BatchSize::PerIteration);
    });
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10);
    targets = product, adjust, phases
}
criterion_main!(benches);
