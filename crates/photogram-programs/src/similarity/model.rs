//! Observation equations: model coordinates of stations with unknown control coordinates.

use super::Station;
use super::transform::Similarity;
use photocore::adjustment::{Evaluated, Model};
use photocore::geometry::{Matrix3, Vector3, rotation};
use photocore::normals::GroupRows;

/// Number of unknowns of the retained block: three changes of the rotation (omega, phi, kappa applied after the initial rotation), s, t.
pub const CHANGES: usize = 7;
/// Index of s.
pub const SCALE: usize = 3;

/// Model coordinates as functions of control coordinates and the seven parameters (TB 19, equation 2.1).
#[derive(Debug)]
pub struct AsControl {
    start: Similarity,
    /// Model coordinates relative to their centre.
    observed: Vec<Vector3>,
    /// Whether each control component is free.
    free: Vec<[bool; 3]>,
}

/// Unknowns, and the rotation with its partials.
struct StationsAt<'a> {
    model: &'a AsControl,
    control: Vec<Vector3>,
    similarity: Similarity,
    /// Partials of A with respect to the three changes.
    partials: [Matrix3; 3],
}

impl AsControl {
    /// Creates the model of stations; changes of the rotation are relative to an initial similarity.
    pub fn new(stations: &[Station], start: &Similarity) -> Self {
        let centre = start.model_centre;
        let centred = |station: &Station| station.model - centre;
        Self {
            start: *start,
            observed: stations.iter().map(centred).collect(),
            free: stations.iter().map(|station| station.known().map(|known| !known)).collect(),
        }
    }

    /// Returns the similarity at given values of the seven unknowns.
    pub fn similarity(&self, changes: &[f64]) -> Similarity {
        let change = rotation([changes[0], changes[1], changes[2]]);
        Similarity {
            rotation: change * self.start.rotation,
            scale: changes[3],
            shift: Vector3::new(changes[4], changes[5], changes[6]),
            ..self.start
        }
    }
}

impl Model for AsControl {
    fn at<'a>(&'a self, unknowns: &[f64]) -> Box<dyn Evaluated + 'a> {
        let (control, changes) = unknowns.split_at(3 * self.observed.len());
        let (_, by_change) = rotation_with_partials([changes[0], changes[1], changes[2]]);
        Box::new(StationsAt {
            model: self,
            control: control.as_chunks().0.iter().map(|&x: &[f64; 3]| x.into()).collect(),
            similarity: self.similarity(changes),
            partials: by_change.map(|partial| partial * self.start.rotation),
        })
    }

    /// Recomputes free control coordinates from the model.
    fn relocate(&self, unknowns: &mut [f64]) -> bool {
        let (control, changes) = unknowns.split_at_mut(3 * self.observed.len());
        let Similarity { rotation, scale, shift, .. } = self.similarity(changes);
        for ((control, observed), free) in
            control.as_chunks_mut::<3>().0.iter_mut().zip(&self.observed).zip(&self.free)
        {
            let carried = rotation.tr_mul(&(observed - shift));
            (0..3).filter(|&k| free[k]).for_each(|k| control[k] = carried[k] / scale);
        }
        true
    }
}

impl Evaluated for StationsAt<'_> {
    fn observe(&self, local: usize, _group: usize, rows: &mut GroupRows<'_>) {
        let Similarity { rotation, scale, shift, .. } = self.similarity;
        let control = &self.control[local];
        let turned = rotation * control;
        let by_change = self.partials.map(|partial| partial * control);
        for row in 0..3 {
            rows.constant[row] = self.model.observed[local][row] - scale * turned[row] - shift[row];
            (0..3).for_each(|k| rows.local[3 * row + k] = scale * rotation[(row, k)]);
            let retained = &mut rows.retained[CHANGES * row..][..CHANGES];
            retained.fill(0.0);
            (0..3).for_each(|k| retained[k] = scale * by_change[k][row]);
            retained[3] = turned[row];
            retained[4 + row] = 1.0;
        }
    }
}

/// Returns the rotation matrix and its partial derivatives with respect to omega, phi and kappa.
#[inline]
pub fn rotation_with_partials(angles: [f64; 3]) -> (Matrix3, [Matrix3; 3]) {
    let m = rotation(angles);
    let [(so, co), (sp, cp), (sk, ck)] = angles.map(f64::sin_cos);
    let columns = |k: usize| Vector3::from(m.column(k));
    let omega = Matrix3::from_columns(&[Vector3::zeros(), -columns(2), columns(1)]);
    let phi = Matrix3::new(
        -ck * sp,
        so * cp * ck,
        -co * cp * ck,
        sk * sp,
        -so * cp * sk,
        co * cp * sk,
        cp,
        so * sp,
        -co * sp,
    );
    let kappa = Matrix3::from_rows(&[m.row(1).into(), -m.row(0), Vector3::zeros().transpose()]);
    (m, [omega, phi, kappa])
}
