//! What an adjustment has found of points and images, in arrays.

use numpy::{PyArray1, PyArray2, PyArray3};
use photocore::Threads;
use photocore::adjustment::Observed;
use photocore::network::{AdjustedPoint, Solution};
use pyo3::prelude::*;
use rayon::prelude::*;

use crate::arrays::{squares, table};

/// Points and images that a thread takes at least.
const TOGETHER: usize = 4096;

/// A solution whose points and images stand in columns: made on all threads, before Python waits for it.
pub struct Told {
    pub solution: Solution,
    point_positions: Vec<[f64; 3]>,
    point_cofactors: Vec<[[f64; 3]; 3]>,
    point_redundancy: Vec<[f64; 3]>,
    point_last_corrections: Vec<[f64; 3]>,
    point_rays: Vec<i64>,
    point_rays_behind: Vec<i64>,
    residuals: Vec<[f64; 2]>,
    redundancy: Vec<[f64; 2]>,
    standardized: Vec<[f64; 2]>,
    image_weights: Vec<f64>,
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

    /// The solution, and its columns as arrays.
    pub fn tables(self, py: Python<'_>) -> PyResult<(Solution, Tables)> {
        let tables = Tables {
            point_positions: table(py, self.point_positions)?.unbind(),
            point_cofactors: squares(py, self.point_cofactors)?.unbind(),
            point_redundancy: table(py, self.point_redundancy)?.unbind(),
            point_last_corrections: table(py, self.point_last_corrections)?.unbind(),
            point_rays: PyArray1::from_vec(py, self.point_rays).unbind(),
            point_rays_behind: PyArray1::from_vec(py, self.point_rays_behind).unbind(),
            residuals: table(py, self.residuals)?.unbind(),
            redundancy: table(py, self.redundancy)?.unbind(),
            standardized: table(py, self.standardized)?.unbind(),
            image_weights: PyArray1::from_vec(py, self.image_weights).unbind(),
        };
        Ok((self.solution, tables))
    }
}

/// The arrays of points, (n, ...), and images, (m, ...): they are handed out as they are.
pub struct Tables {
    pub point_positions: Py<PyArray2<f64>>,
    pub point_cofactors: Py<PyArray3<f64>>,
    pub point_redundancy: Py<PyArray2<f64>>,
    pub point_last_corrections: Py<PyArray2<f64>>,
    pub point_rays: Py<PyArray1<i64>>,
    pub point_rays_behind: Py<PyArray1<i64>>,
    pub residuals: Py<PyArray2<f64>>,
    pub redundancy: Py<PyArray2<f64>>,
    pub standardized: Py<PyArray2<f64>>,
    pub image_weights: Py<PyArray1<f64>>,
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
