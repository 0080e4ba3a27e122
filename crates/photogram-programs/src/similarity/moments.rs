//! Best similarity for any attitude, from moments of the stations.
//!
//! For a given rotation, scale and translation follow in closed form. The sum of squared misclosures is then a function of the nine
//! elements of A. With the columns a_j of A, and x and X_j relative to their means over the stations with known component j:
//!
//! S(A) = sum_j a_j^T M_j a_j - (sum_j a_j . c_j)^2 / V,   M_j = sum x x^T,  c_j = sum x X_j,  V = sum_j sum X_j^2.
//!
//! For a fixed s: S(A) = sum_j a_j^T M_j a_j - 2 s sum_j a_j . c_j + s^2 V.
//!
//! The minima over all rotations are computed from the moments, without initial values.

use nalgebra::Matrix4;

use super::transform::Similarity;
use super::{SimilarityError, Station};
use photocore::geometry::angle_axis::quaternion_rotation;
use photocore::geometry::rotation::solve;
use photocore::geometry::{Matrix3, Vector3, rotation};

/// Maximum number of steps of one descent, and the rotation step (rad) that ends it.
const STEPS: usize = 100;
const ARRIVED: f64 = 1e-13;
/// Largest difference of the elements of two rotations of the same minimum.
const SAME: f64 = 1e-6;
/// Distance to a known minimum that ends a descent.
const NEAR: f64 = 1e-3;
/// Rounding of S as a fraction of its largest terms.
const ROUNDING: f64 = 1e-14;
/// Maximum number of steps of the eigenvalue iteration.
pub const EIGEN_STEPS: usize = 1000;
/// Spacing of the initial angles of the descents.
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
    held: Option<f64>,
}

impl Moments {
    /// Computes the moments of stations relative to given centres; the scale may be fixed.
    pub fn new(
        stations: &[Station],
        control_centre: Vector3,
        model_centre: Vector3,
        held: Option<f64>,
    ) -> Self {
        let mut moments = Self {
            m: [Matrix3::zeros(); 3],
            c: [Vector3::zeros(); 3],
            v: 0.0,
            model_mean: [Vector3::zeros(); 3],
            control_mean: Vector3::zeros(),
            full: stations.iter().all(|station| station.known() == [true; 3]),
            control_centre,
            model_centre,
            held,
        };
        (0..3).for_each(|j| moments.add_component(stations, j));
        moments
    }

    fn add_component(&mut self, stations: &[Station], j: usize) {
        let with: Vec<(Vector3, f64)> = stations
            .iter()
            .filter(|station| station.known()[j])
            .map(|s| (s.model - self.model_centre, s.control[j] - self.control_centre[j]))
            .collect();
        let count = with.len().max(1) as f64;
        let mean = with.iter().map(|(x, _)| x).sum::<Vector3>() / count;
        let control_mean = with.iter().map(|(_, value)| value).sum::<f64>() / count;
        for (model, control) in &with {
            let x = model - mean;
            let value = control - control_mean;
            self.m[j] += x * x.transpose();
            self.c[j] += x * value;
            self.v += value * value;
        }
        (self.model_mean[j], self.control_mean[j]) = (mean, control_mean);
    }

    /// Returns the best similarities: one by Horn's quaternion for full control, otherwise every minimum found from rotations sixty degrees
    /// apart. Mirror images (scale not positive) are excluded.
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
            let Some(found) = self.descend(&rotation(angles), &minima) else { continue };
            if !minima.iter().any(|other| closer(&other.rotation, &found.rotation, SAME)) {
                minima.push(found);
            }
        }
        Ok(minima)
    }

    /// Returns the minimum reached by a descent from a rotation. None if the model is a mirror image there, or if the descent approaches
    /// one of the `known` minima.
    ///
    /// Gauss-Newton with damping (Levenberg-Marquardt) on three small rotations; the scale is eliminated.
    pub fn descend(&self, from: &Matrix3, known: &[Similarity]) -> Option<Similarity> {
        let mut at = *from;
        let (mut damping, mut value) = (1e-3, self.value(&at));
        let (mut normal, mut gradient) = self.linearize(&at);
        for _ in 0..STEPS {
            let damped = normal + damping * Matrix3::from_diagonal(&normal.diagonal());
            let Some(step) = solve(&damped, &-gradient, 0.0) else { break };
            let next = rotation(step.into()) * at;
            let next_value = self.value(&next);
            if next_value <= value + ROUNDING * self.size() {
                (at, value, damping) = (next, next_value, damping / 10.0);
                if step.iter().all(|angle| angle.abs() < ARRIVED) {
                    break;
                }
                if known.iter().any(|minimum| closer(&minimum.rotation, &at, NEAR)) {
                    return None;
                }
                (normal, gradient) = self.linearize(&at);
            } else {
                damping *= 10.0;
            }
        }
        self.similarity(&at)
    }

    /// Returns normal matrix and gradient of three small rotations about the model axes: dr_j = a_j x x, the partials of the misclosures.
    fn linearize(&self, a: &Matrix3) -> (Matrix3, Vector3) {
        let scale = self.scale(a);
        let (mut normal, mut gradient, mut by_scale) = (Matrix3::zeros(), Vector3::zeros(), Vector3::zeros());
        for (j, column) in a.column_iter().enumerate() {
            let skew = Vector3::from(column).cross_matrix();
            let control = skew * self.c[j];
            normal += skew * self.m[j] * skew.transpose();
            by_scale += control;
            gradient += scale * control - skew * self.m[j] * column;
        }
        if self.held.is_none() {
            normal -= by_scale * by_scale.transpose() / self.v;
        }
        (normal, gradient)
    }

    fn product(&self, a: &Matrix3) -> f64 {
        a.column_iter().zip(&self.c).map(|(column, c)| column.dot(c)).sum()
    }

    fn scale(&self, a: &Matrix3) -> f64 {
        self.held.unwrap_or_else(|| self.product(a) / self.v)
    }

    /// Returns S(A).
    fn value(&self, a: &Matrix3) -> f64 {
        let model: f64 = a.column_iter().zip(&self.m).map(|(column, m)| column.dot(&(m * column))).sum();
        let scale = self.scale(a);
        model - scale * (2.0 * self.product(a) - scale * self.v)
    }

    fn size(&self) -> f64 {
        self.m.iter().map(Matrix3::trace).sum()
    }

    /// Returns the similarity with a given rotation; None if its scale is not positive.
    fn similarity(&self, a: &Matrix3) -> Option<Similarity> {
        let scale = self.scale(a);
        // The mean of each misclosure vanishes: (A^T t)_j = a_j . x - s X_j in the means.
        let turned_shift =
            Vector3::from_fn(|j, _| a.column(j).dot(&self.model_mean[j]) - scale * self.control_mean[j]);
        (scale > 0.0).then(|| Similarity {
            rotation: *a,
            scale,
            shift: a * turned_shift,
            control_centre: self.control_centre,
            model_centre: self.model_centre,
        })
    }

    /// Returns the best rotation for full control: its quaternion is the eigenvector of the largest eigenvalue of a 4 x 4 matrix (B. K. P.
    /// Horn, J. Opt. Soc. Am. A 4, 1987).
    fn horn(&self) -> Result<Matrix3, SimilarityError> {
        let [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = self.c.map(<[f64; 3]>::from);
        #[rustfmt::skip]
        let matrix = Matrix4::new(
            xx + yy + zz, yz - zy, zx - xz, xy - yx,
            yz - zy, xx - yy - zz, xy + yx, zx + xz,
            zx - xz, xy + yx, yy - xx - zz, yz + zy,
            xy - yx, zx + xz, yz + zy, zz - xx - yy,
        );
        let eigen =
            matrix.try_symmetric_eigen(f64::EPSILON, EIGEN_STEPS).ok_or(SimilarityError::NotFinite)?;
        let vector = eigen.eigenvectors.column(eigen.eigenvalues.imax());
        Ok(quaternion_rotation([vector[0], vector[1], vector[2], vector[3]]))
    }
}

fn closer(a: &Matrix3, b: &Matrix3, limit: f64) -> bool {
    (a - b).amax() < limit
}
