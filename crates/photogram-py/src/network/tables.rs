//! Columns of adjusted points and image observations.

use photocore::Threads;
use photocore::adjustment::Observed;
use photocore::network::{AdjustedPoint, Solution};
use rayon::Scope;

/// Solution with points and image observations in columns, built in parallel without the GIL.
pub struct SolutionColumns {
    pub solution: Solution,
    pub point_positions: Vec<[f64; 3]>,
    pub point_cofactors: Vec<[[f64; 3]; 3]>,
    pub point_redundancy: Vec<[f64; 3]>,
    pub point_last_corrections: Vec<[f64; 3]>,
    pub point_rays: Vec<i64>,
    pub point_rays_behind: Vec<i64>,
    pub residuals: Vec<[f64; 2]>,
    pub redundancy: Vec<[f64; 2]>,
    pub standardized: Vec<[f64; 2]>,
    pub image_weights: Vec<f64>,
}

impl SolutionColumns {
    /// Moves points and image observations of a solution into columns. Excluded ones are NaN.
    pub fn new(solution: Solution, pool: &Threads) -> Self {
        pool.install(|| Self::on_pool(solution))
    }

    /// Creates the columns without trajectory records: the last `records` photos, with the last camera.
    pub fn without_records(mut solution: Solution, records: usize, pool: &Threads) -> Self {
        solution.photos.truncate(solution.photos.len() - records);
        if records > 0 {
            solution.cameras.pop();
        }
        Self::new(solution, pool)
    }

    fn on_pool(mut solution: Solution) -> Self {
        let points: Vec<Option<AdjustedPoint>> = std::mem::take(&mut solution.points);
        let images: Vec<Option<Observed<2>>> = std::mem::take(&mut solution.images);
        let (three, two) = ([f64::NAN; 3], [f64::NAN; 2]);
        let mut columns = Self {
            solution,
            point_positions: vec![],
            point_cofactors: vec![],
            point_redundancy: vec![],
            point_last_corrections: vec![],
            point_rays: vec![],
            point_rays_behind: vec![],
            residuals: vec![],
            redundancy: vec![],
            standardized: vec![],
            image_weights: vec![],
        };
        // The results of images are released before the columns of points are allocated.
        rayon::scope(|scope| {
            fill(scope, &mut columns.residuals, &images, two, |image| image.residual);
            fill(scope, &mut columns.redundancy, &images, two, |image| image.redundancy);
            fill(scope, &mut columns.standardized, &images, two, |image| image.standardized);
            fill(scope, &mut columns.image_weights, &images, f64::NAN, |image| image.weight);
        });
        drop(images);
        rayon::scope(|scope| {
            fill(scope, &mut columns.point_cofactors, &points, [three; 3], |point| point.cofactors.data.0);
            fill(scope, &mut columns.point_positions, &points, three, |point| point.coordinates);
            fill(scope, &mut columns.point_redundancy, &points, three, |point| point.redundancy);
            fill(scope, &mut columns.point_last_corrections, &points, three, |point| point.last_correction);
            fill(scope, &mut columns.point_rays, &points, 0, |point| point.rays as i64);
            fill(scope, &mut columns.point_rays_behind, &points, 0, |point| point.behind as i64);
        });
        columns
    }
}

/// Fills a column with one part of all used items, and with `missing` for the others, as a parallel task.
fn fill<'s, T: Sync, P: Copy + Send + 's>(
    scope: &Scope<'s>,
    column: &'s mut Vec<P>,
    all: &'s [Option<T>],
    missing: P,
    part: impl Fn(&T) -> P + Send + 's,
) {
    scope.spawn(move |_| *column = all.iter().map(|own| own.as_ref().map_or(missing, &part)).collect());
}
