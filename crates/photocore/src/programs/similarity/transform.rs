//! The similarity x = s A X + B of a model and its control, its inverse, and the partials of both.

use crate::geometry::vector::{apply, apply_transposed, cross, difference, transposed};
use crate::geometry::{Matrix3, Vector3, rotation_angles};

/// The seven parameters of x = s A X + B.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameters {
    /// Rotation matrix A = K Phi Omega (TB 19, equation 2.3).
    pub rotation: Matrix3,
    /// s, model units per ground unit.
    pub scale: f64,
    /// B in model units.
    pub translation: Vector3,
}

/// A similarity counted from a centre in each system, so that large coordinates cost no digits:
/// x - c_x = s A (X - c_X) + t.
///
/// Its partials and cofactors are those of seven *tangent parameters*: three small rotations r about the model axes,
/// `A <- (I - [r]x) A`, then s, then t. They are regular at every attitude; omega and kappa are not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Similarity {
    /// Rotation matrix A.
    pub rotation: Matrix3,
    /// s, model units per ground unit.
    pub scale: f64,
    /// t in model units.
    pub shift: Vector3,
    /// c_X in ground units.
    pub control_centre: Vector3,
    /// c_x in model units.
    pub model_centre: Vector3,
}

/// Covariances and partials of seven parameters in the order of their unknowns.
pub type Matrix7 = [[f64; 7]; 7];

impl Similarity {
    /// Counts given parameters from given centres.
    pub fn from_parameters(parameters: &Parameters, control_centre: Vector3, model_centre: Vector3) -> Self {
        let Parameters { rotation, scale, translation } = *parameters;
        let moved = apply(&rotation, &control_centre);
        let shift = std::array::from_fn(|i| translation[i] + scale * moved[i] - model_centre[i]);
        Self { rotation, scale, shift, control_centre, model_centre }
    }

    /// The parameters of x = s A X + B: B = t + c_x - s A c_X.
    pub fn parameters(&self) -> Parameters {
        let moved = apply(&self.rotation, &self.control_centre);
        let translation =
            std::array::from_fn(|i| self.shift[i] + self.model_centre[i] - self.scale * moved[i]);
        Parameters { rotation: self.rotation, scale: self.scale, translation }
    }

    /// Omega, phi, kappa in radians.
    pub fn angles(&self) -> Vector3 {
        rotation_angles(&self.rotation)
    }

    /// x - c_x - t, in model units: what the rotation and the scale alone carry into control.
    pub(super) fn reduced(&self, model: &Vector3) -> Vector3 {
        difference(&difference(model, &self.model_centre), &self.shift)
    }

    /// X - c_X.
    pub(super) fn centred(&self, control: &Vector3) -> Vector3 {
        difference(control, &self.control_centre)
    }

    /// X of a model point (TB 19, equation 2.2).
    pub fn control_at(&self, model: &Vector3) -> Vector3 {
        let turned = apply_transposed(&self.rotation, &self.reduced(model));
        std::array::from_fn(|j| self.control_centre[j] + turned[j] / self.scale)
    }

    /// u = s X - A^T (x - B): what is missing between a control point and its model point, in control axes and model units.
    /// NaN where X is.
    pub(super) fn misclosure(&self, control: &Vector3, model: &Vector3) -> Vector3 {
        let turned = apply_transposed(&self.rotation, &self.reduced(model));
        let centred = self.centred(control);
        std::array::from_fn(|j| self.scale * centred[j] - turned[j])
    }

    /// Partials of the misclosures with respect to the tangent parameters . The column of the
    /// scale is NaN where X is.
    pub(super) fn misclosure_partials(&self, control: &Vector3, model: &Vector3) -> [[f64; 7]; 3] {
        let reduced = self.reduced(model);
        let centred = self.centred(control);
        let columns = transposed(&self.rotation);
        std::array::from_fn(|j| {
            let [p, q, r] = cross(&columns[j], &reduced);
            let [a, b, c] = columns[j];
            [p, q, r, centred[j], a, b, c]
        })
    }

    /// X of a model point and its partials with respect to the tangent parameters.
    fn control_with_partials_at(&self, model: &Vector3) -> (Vector3, [[f64; 7]; 3]) {
        let control = self.control_at(model);
        // u = 0 holds at X; dX = -du / s.
        let partials = self.misclosure_partials(&control, model).map(|row| row.map(|p| -p / self.scale));
        (control, partials)
    }

    /// X of a model point and its covariance from those of the tangent parameters and the standard deviations of the point itself:
    /// J Q J^T + A^T Q_x A / s^2.
    pub fn transform(&self, model: &Vector3, model_sd: &Vector3, covariance: &Matrix7) -> (Vector3, Matrix3) {
        let (control, partials) = self.control_with_partials_at(model);
        let mut result = propagate(&partials, covariance);
        for i in 0..3 {
            for j in 0..3 {
                let own: f64 =
                    (0..3).map(|k| self.rotation[k][i] * model_sd[k].powi(2) * self.rotation[k][j]).sum();
                result[i][j] += own / (self.scale * self.scale);
            }
        }
        (control, result)
    }

    /// Partials of omega, phi, kappa, s, b1, b2, b3 with respect to the tangent parameters; those of omega and kappa grow without
    /// bound where phi comes near 90 degrees, where the two turn about one axis.
    pub fn parameter_partials(&self) -> Matrix7 {
        let mut partials = identity();
        let rates = inverse_rates(self.angles());
        let moved = apply(&self.rotation, &self.control_centre);
        for i in 0..3 {
            partials[i][..3].copy_from_slice(&rates[i]);
            // dB = dt + s r x (A c_X) - A c_X ds
            partials[4 + i][3] = -moved[i];
        }
        let [p, q, r] = moved.map(|value| self.scale * value);
        let lever = [[0.0, r, -q], [-r, 0.0, p], [q, -p, 0.0]];
        (0..3).for_each(|i| partials[4 + i][..3].copy_from_slice(&lever[i]));
        partials
    }
}

/// J Q J^T.
pub(super) fn propagate<const N: usize, const M: usize>(
    partials: &[[f64; M]; N],
    cofactors: &[[f64; M]; M],
) -> [[f64; N]; N] {
    let product: [[f64; M]; N] = std::array::from_fn(|i| {
        std::array::from_fn(|k| (0..M).map(|l| partials[i][l] * cofactors[l][k]).sum())
    });
    let mut result = [[0.0; N]; N];
    for i in 0..N {
        for j in 0..=i {
            let value: f64 = (0..M).map(|k| product[i][k] * partials[j][k]).sum();
            (result[i][j], result[j][i]) = (value, value);
        }
    }
    result
}

fn identity() -> Matrix7 {
    std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))))
}

/// Partials of omega, phi, kappa with respect to three small rotations r: the inverse of r = (K Phi e1) domega + (K e2) dphi
/// + e3 dkappa.
fn inverse_rates([_, phi, kappa]: Vector3) -> Matrix3 {
    let ((sp, cp), (sk, ck)) = (phi.sin_cos(), kappa.sin_cos());
    [[ck / cp, -sk / cp, 0.0], [sk, ck, 0.0], [-ck * sp / cp, sk * sp / cp, 1.0]]
}
