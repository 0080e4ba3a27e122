//! The best similarity at any attitude, from moments of the stations.
//!
//! With the rotation given, scale and translation follow in closed form, and the sum of squared misclosures depends on the nine
//! numbers of A alone: with a_j the columns of A, x and X_j counted from their means over the stations where component j is known,
//!
//! S(A) = sum_j a_j^T M_j a_j - (sum_j a_j . c_j)^2 / V,   M_j = sum x x^T,  c_j = sum x X_j,  V = sum_j sum X_j^2.
//!
//! Its minima over all rotations are found without the stations and without initial values.

use faer::{Mat, Side};

use super::transform::Similarity;
use super::{SimilarityError, Station};
use crate::geometry::vector::{apply, cross, difference, dot, product, solve, transposed};
use crate::geometry::{Matrix3, Vector3, rotation};

/// Steps of one descent at the most, and the rotation (rad) below which it has arrived.
const STEPS: usize = 100;
const ARRIVED: f64 = 1e-13;
/// Rotations whose elements differ by less are one minimum.
const SAME: f64 = 1e-6;
/// Values of S are good to this fraction of its largest terms.
const ROUNDING: f64 = 1e-14;
/// Descents start every sixty degrees.
const SIXTH: f64 = std::f64::consts::TAU / 6.0;

/// Moments of the known components.
#[derive(Debug)]
pub struct Moments {
    m: [Matrix3; 3],
    c: [Vector3; 3],
    v: f64,
    model_mean: [Vector3; 3],
    control_mean: Vector3,
    full: bool,
    control_centre: Vector3,
    model_centre: Vector3,
}

impl Moments {
    /// The moments of some stations, counted from given centres.
    pub fn new(stations: &[Station], control_centre: Vector3, model_centre: Vector3) -> Self {
        let mut moments = Self {
            m: [[[0.0; 3]; 3]; 3],
            c: [[0.0; 3]; 3],
            v: 0.0,
            model_mean: [[0.0; 3]; 3],
            control_mean: [0.0; 3],
            full: stations.iter().all(|station| station.known() == [true; 3]),
            control_centre,
            model_centre,
        };
        (0..3).for_each(|j| moments.add_component(stations, j));
        moments
    }

    fn add_component(&mut self, stations: &[Station], j: usize) {
        let with: Vec<(Vector3, f64)> = stations
            .iter()
            .filter(|station| station.known()[j])
            .map(|s| (difference(&s.model, &self.model_centre), s.control[j] - self.control_centre[j]))
            .collect();
        let count = with.len().max(1) as f64;
        let mean: Vector3 = std::array::from_fn(|i| with.iter().map(|(x, _)| x[i]).sum::<f64>() / count);
        let control_mean = with.iter().map(|(_, value)| value).sum::<f64>() / count;
        for (model, control) in &with {
            let x = difference(model, &mean);
            let value = control - control_mean;
            for i in 0..3 {
                (0..3).for_each(|k| self.m[j][i][k] += x[i] * x[k]);
                self.c[j][i] += x[i] * value;
            }
            self.v += value * value;
        }
        (self.model_mean[j], self.control_mean[j]) = (mean, control_mean);
    }

    /// The similarities that fit best: by Horn's quaternion when all control is full, otherwise every minimum found from rotations
    /// sixty degrees apart. Mirror images (scale not positive) are left out.
    ///
    /// # Errors
    /// Moments that are not finite.
    pub fn best(&self) -> Result<Vec<Similarity>, SimilarityError> {
        if self.full {
            return Ok(self.similarity(&self.horn()?).into_iter().collect());
        }
        let mut minima: Vec<Similarity> = Vec::new();
        for index in 0..108 {
            let (omega, phi, kappa) = (index / 18, index / 6 % 3, index % 6);
            let angles = [omega as f64, phi as f64 - 1.0, kappa as f64].map(|sixths| SIXTH * sixths);
            let Some(found) = self.descend(&rotation(angles)) else { continue };
            if !minima.iter().any(|other| same(&other.rotation, &found.rotation)) {
                minima.push(found);
            }
        }
        Ok(minima)
    }

    /// The minimum that a descent from a rotation leads to; None when the model would be a mirror image there.
    ///
    /// Gauss-Newton with damping (Levenberg-Marquardt) on three small rotations; the scale is eliminated.
    pub fn descend(&self, from: &Matrix3) -> Option<Similarity> {
        let mut at = *from;
        let (mut damping, mut value) = (1e-3, self.value(&at));
        let (mut normal, mut gradient) = self.linearize(&at);
        for _ in 0..STEPS {
            let mut damped = normal;
            (0..3).for_each(|i| damped[i][i] += damping * normal[i][i]);
            let Some(step) = solve(&damped, &gradient.map(|g| -g), 0.0) else { break };
            let next = product(&rotation(step), &at);
            let next_value = self.value(&next);
            if next_value <= value + ROUNDING * self.size() {
                (at, value, damping) = (next, next_value, damping / 10.0);
                if step.iter().all(|angle| angle.abs() < ARRIVED) {
                    break;
                }
                (normal, gradient) = self.linearize(&at);
            } else {
                damping *= 10.0;
            }
        }
        self.similarity(&at)
    }

    /// Normal matrix and gradient of three small rotations about the model axes: dr_j = a_j x x, the partials of the misclosures.
    fn linearize(&self, a: &Matrix3) -> (Matrix3, Vector3) {
        let scale = self.scale(a);
        let (mut normal, mut gradient, mut by_scale) = ([[0.0; 3]; 3], [0.0; 3], [0.0; 3]);
        for (j, column) in transposed(a).iter().enumerate() {
            // [a]x M [a]x^T, M being symmetric: first the columns, then the rows.
            let once = transposed(&self.m[j].map(|row| cross(column, &row)));
            let twice = once.map(|row| cross(column, &row));
            let control = cross(column, &self.c[j]);
            let model = cross(column, &apply(&self.m[j], column));
            for i in 0..3 {
                (0..3).for_each(|k| normal[i][k] += twice[i][k]);
                by_scale[i] += control[i];
                gradient[i] += scale * control[i] - model[i];
            }
        }
        for i in 0..3 {
            (0..3).for_each(|k| normal[i][k] -= by_scale[i] * by_scale[k] / self.v);
        }
        (normal, gradient)
    }

    fn scale(&self, a: &Matrix3) -> f64 {
        transposed(a).iter().zip(&self.c).map(|(column, c)| dot(column, c)).sum::<f64>() / self.v
    }

    /// S(A).
    fn value(&self, a: &Matrix3) -> f64 {
        let columns = transposed(a);
        let model: f64 = (0..3).map(|j| dot(&columns[j], &apply(&self.m[j], &columns[j]))).sum();
        model - self.scale(a).powi(2) * self.v
    }

    fn size(&self) -> f64 {
        self.m.iter().map(|m| m[0][0] + m[1][1] + m[2][2]).sum()
    }

    /// The similarity with a given rotation; None when its scale is not positive.
    fn similarity(&self, a: &Matrix3) -> Option<Similarity> {
        let scale = self.scale(a);
        // The mean of each misclosure vanishes: (A^T t)_j = a_j . x - s X_j in the means.
        let columns = transposed(a);
        let turned_shift: Vector3 =
            std::array::from_fn(|j| dot(&columns[j], &self.model_mean[j]) - scale * self.control_mean[j]);
        (scale > 0.0).then(|| Similarity {
            rotation: *a,
            scale,
            shift: apply(a, &turned_shift),
            control_centre: self.control_centre,
            model_centre: self.model_centre,
        })
    }

    /// The rotation that fits full control best: the eigenvector of the largest eigenvalue of a 4 x 4 matrix is its quaternion
    /// (B. K. P. Horn, J. Opt. Soc. Am. A 4, 1987).
    fn horn(&self) -> Result<Matrix3, SimilarityError> {
        let [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = self.c;
        let rows = [
            [xx + yy + zz, yz - zy, zx - xz, xy - yx],
            [yz - zy, xx - yy - zz, xy + yx, zx + xz],
            [zx - xz, xy + yx, yy - xx - zz, yz + zy],
            [xy - yx, zx + xz, yz + zy, zz - xx - yy],
        ];
        let matrix = Mat::from_fn(4, 4, |i, j| rows[i][j]);
        let eigen = matrix.self_adjoint_eigen(Side::Lower).map_err(|_| SimilarityError::NotFinite)?;
        let vector = eigen.U().col(3);
        let [w, x, y, z] = [vector[0], vector[1], vector[2], vector[3]];
        Ok([
            [w * w + x * x - y * y - z * z, 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ])
    }
}

fn same(a: &Matrix3, b: &Matrix3) -> bool {
    a.iter().flatten().zip(b.iter().flatten()).all(|(p, q)| (p - q).abs() < SAME)
}
