//! An observation that takes part in an adjustment: a tie of unit weight.

use nalgebra::DMatrix;

use super::{Observation, Rows, Sites};
use crate::geometry::{ObjectSpace, Orientation, Point};

/// An observation of points and photos of a model.
#[derive(Debug)]
pub struct TiedObservation {
    /// Its index in the network.
    pub index: usize,
    pub observation: Observation,
    /// Its points, as the model numbers them, and photos.
    pub points: Vec<usize>,
    pub photos: Vec<usize>,
    /// L of its covariance matrix S = L L^T.
    pub root: DMatrix<f64>,
}

/// Points and photos of a model at given values of the unknowns.
pub struct TiedModel<'a> {
    pub space: ObjectSpace,
    pub origin: [f64; 3],
    /// Position and coordinates of a point.
    pub point: &'a dyn Fn(usize) -> (Point, [f64; 3]),
    /// The photos, and how many unknowns each has.
    pub photo: &'a dyn Fn(usize) -> (&'a Orientation, usize),
}

impl TiedObservation {
    /// Writes L^-1 (observed - computed) and L^-1 times the partials: columns of three for each point, then those of each photo.
    pub fn write(&self, model: &TiedModel<'_>, constant: &mut [f64], coefficients: &mut [f64]) {
        let photos: Vec<(&Orientation, usize)> = self.photos.iter().map(|&i| (model.photo)(i)).collect();
        let sites = Sites {
            space: model.space,
            origin: model.origin,
            points: self.points.iter().map(|&point| (model.point)(point)).collect(),
            photos: photos.iter().map(|&(photo, _)| photo).collect(),
        };
        let mut width = 0;
        let mut columns = Vec::new();
        for unknowns in self.points.iter().map(|_| 3).chain(photos.iter().map(|&(_, unknowns)| unknowns)) {
            columns.push(width);
            width += unknowns;
        }
        coefficients.fill(0.0);
        let mut rows = Rows { sites: &sites, columns, width, constant: &mut *constant, coefficients };
        self.observation.write(&sites, &mut rows);
        self.whiten(constant, 1);
        self.whiten(coefficients, width);
    }

    /// Multiplies a matrix of so many columns by L^-1: forward substitution, row by row.
    fn whiten(&self, matrix: &mut [f64], width: usize) {
        for i in 0..self.root.nrows() {
            let (before, row) = matrix.split_at_mut(i * width);
            let row = &mut row[..width];
            for (k, earlier) in before.chunks_exact(width).enumerate() {
                row.iter_mut().zip(earlier).for_each(|(value, by)| *value -= self.root[(i, k)] * by);
            }
            row.iter_mut().for_each(|value| *value /= self.root[(i, i)]);
        }
    }
}
