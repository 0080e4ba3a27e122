//! What an adjustment has found of points and images, in columns.

use photocore::Threads;
use photocore::adjustment::Observed;
use photocore::network::{AdjustedPoint, Solution};
use rayon::prelude::*;

/// Points and images that a thread takes at least.
const TOGETHER: usize = 4096;

/// A solution whose points and images stand in columns: made on all threads, before Python waits for it.
pub struct Told {
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

impl Told {
    /// Takes the columns out of a solution, which has no points and images any more. What was left out is NaN.
    pub fn new(solution: Solution, pool: &Threads) -> Self {
        pool.install(|| Self::on_pool(solution))
    }

    /// The same without what stands for so many records on trajectories: the last photos, which have the last camera.
    pub fn without_records(mut solution: Solution, records: usize, pool: &Threads) -> Self {
        solution.photos.truncate(solution.photos.len() - records);
        if records > 0 {
            solution.cameras.pop();
        }
        Self::new(solution, pool)
    }

    fn on_pool(mut solution: Solution) -> Self {
        let (points, images) = (std::mem::take(&mut solution.points), std::mem::take(&mut solution.images));
        let (three, two) = ([f64::NAN; 3], [f64::NAN; 2]);
        Self {
            solution,
            point_positions: column(&points, three, |point| point.coordinates),
            point_cofactors: column(&points, [three; 3], |point: &AdjustedPoint| point.cofactors.data.0),
            point_redundancy: column(&points, three, |point| point.redundancy),
            point_last_corrections: column(&points, three, |point| point.last_correction),
            point_rays: column(&points, 0, |point: &AdjustedPoint| point.rays as i64),
            point_rays_behind: column(&points, 0, |point| point.behind as i64),
            residuals: column(&images, two, |image: &Observed<2>| image.residual),
            redundancy: column(&images, two, |image| image.redundancy),
            standardized: column(&images, two, |image| image.standardized),
            image_weights: column(&images, f64::NAN, |image| image.weight),
        }
    }
}

/// One part of everything that takes part; `missing` of all else.
fn column<T: Sync, P: Copy + Send + Sync>(
    all: &[Option<T>],
    missing: P,
    part: impl Fn(&T) -> P + Sync,
) -> Vec<P> {
    let each = |own: &Option<T>| own.as_ref().map_or(missing, &part);
    all.par_iter().with_min_len(TOGETHER).map(each).collect()
}
