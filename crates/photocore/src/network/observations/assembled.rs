//! Active observation: a whitened term.

use nalgebra::{DMatrix, DVector};
use smallvec::SmallVec;

use super::rows::{CommonSite, PhotoSite, PointSite};
use super::{Observation, ObservationInputs, Rows, Touches};
use crate::geometry::{ObjectSpace, Vector3};
use crate::network::mounts::PhotoMotion;
use crate::normals::GroupRows;

/// An observation of points, photos and shared parameters of a model.
#[derive(Debug)]
pub struct AssembledObservation {
    pub index: usize,
    pub observation: Observation,
    /// Objects of the observation, with points as numbered in the model.
    pub touches: Touches,
    /// Their distinct retained blocks.
    pub blocks: Vec<usize>,
    /// L of the covariance matrix S = L L^T.
    pub root: DMatrix<f64>,
}

/// Whitened linear equations of a point: observed minus computed at some coordinates, and partials row by row.
#[derive(Debug)]
pub struct Linear {
    pub point: usize,
    pub at: [f64; 3],
    pub constant: SmallVec<[f64; 3]>,
    pub coefficients: SmallVec<[f64; 9]>,
}

impl Linear {
    /// Writes the equations at other coordinates of the points.
    pub fn write(&self, coordinates: &[[f64; 3]], rows: &mut GroupRows<'_>) {
        let moved: [f64; 3] = std::array::from_fn(|k| coordinates[self.point][k] - self.at[k]);
        rows.local.copy_from_slice(&self.coefficients);
        let partials = self.coefficients.as_chunks::<3>().0;
        for ((to, constant), row) in rows.constant.iter_mut().zip(&self.constant).zip(partials) {
            *to = constant - (row[0] * moved[0] + row[1] * moved[1] + row[2] * moved[2]);
        }
    }
}

/// A model at given parameter values.
pub struct ModelValues<'a> {
    pub space: ObjectSpace,
    pub origin: [f64; 3],
    pub point: &'a dyn Fn(usize) -> PointSite,
    pub photo: &'a dyn Fn(usize) -> PhotoSite<'a>,
    pub common: &'a dyn Fn(usize) -> CommonSite<'a>,
    /// Motion of a photo; None without a trajectory.
    pub moving: &'a dyn Fn(usize) -> Option<PhotoMotion>,
    /// Number of parameters of each block.
    pub width: &'a dyn Fn(usize) -> usize,
}

/// Block of a local point in [`AssembledObservation::blocks`].
pub const LOCAL: usize = usize::MAX;

impl AssembledObservation {
    /// Returns the local point of an observation of this point alone.
    pub fn local(&self) -> Option<usize> {
        self.touches.points.first().copied().filter(|_| self.blocks == [LOCAL])
    }

    /// Writes L^-1 (observed - computed) and L^-1 times the partials, in columns block by block.
    pub fn write(&self, model: &ModelValues<'_>, constant: &mut [f64], coefficients: &mut [f64]) {
        let inputs = self.inputs(model);
        let mut width = 0;
        let column = |&block: &usize| {
            let first = width;
            width += (model.width)(block);
            (block, first)
        };
        let columns: Vec<(usize, usize)> = self.blocks.iter().map(column).collect();
        coefficients.fill(0.0);
        let mut rows =
            Rows { inputs: &inputs, columns: &columns, width, constant: &mut *constant, coefficients };
        self.observation.write(&inputs, &mut rows);
        self.whiten(constant, 1);
        self.whiten(coefficients, width);
    }

    /// Returns L^-1 E m(E^T r), row by row, for the effects m of transformations on a displacement. r is observed minus computed in the
    /// axes E. None if it is not a displacement.
    pub fn carried<const N: usize>(
        &self,
        model: &ModelValues<'_>,
        motions: impl Fn(&Vector3) -> [Vector3; N],
    ) -> Option<Vec<[f64; N]>> {
        let axes = self.observation.axes(&self.inputs(model))?;
        let rows = self.root.nrows();
        let width: usize = self.blocks.iter().map(|&block| (model.width)(block)).sum();
        let mut constant = vec![0.0; rows];
        self.write(model, &mut constant, &mut vec![0.0; rows * width]);
        let missed = axes.tr_mul(&(&self.root * DVector::from_vec(constant)));
        let moved = motions(&Vector3::new(missed[0], missed[1], missed[2]));
        let mut found: Vec<[f64; N]> =
            axes.row_iter().map(|axis| moved.map(|moved| axis.transpose().dot(&moved))).collect();
        self.whiten(found.as_flattened_mut(), N);
        Some(found)
    }

    fn inputs<'a>(&self, model: &ModelValues<'a>) -> ObservationInputs<'a> {
        ObservationInputs {
            space: model.space,
            origin: model.origin,
            points: self.touches.points.iter().map(|&point| (model.point)(point)).collect(),
            photos: self.touches.photos.iter().map(|&photo| (model.photo)(photo)).collect(),
            moving: if self.observation.moves() {
                self.touches.photos.iter().map(|&photo| (model.moving)(photo)).collect()
            } else {
                vec![]
            },
            commons: self.touches.commons.iter().map(|&(common, _)| (model.common)(common)).collect(),
        }
    }

    /// Multiplies a matrix of `width` columns by L^-1: forward substitution, row by row.
    pub(super) fn whiten(&self, matrix: &mut [f64], width: usize) {
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
