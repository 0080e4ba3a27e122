//! Similarity x = s A X + B of a model and its control, its inverse, and the partials of both.

use photocore::geometry::{Matrix3, Vector3, rotation_angles};

/// Seven parameters of x = s A X + B.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameters {
    /// Rotation matrix A = K Phi Omega (TB 19, equation 2.3).
    pub rotation: Matrix3,
    /// s, model units per ground unit.
    pub scale: f64,
    /// B in model units.
    pub translation: Vector3,
}

/// Similarity relative to a centre in each system, which preserves the digits of large coordinates: x - c_x = s A (X - c_X) + t.
///
/// Partials and cofactors refer to seven *tangent parameters*: three small rotations r about the model axes, `A <- (I - [r]x) A`, then s,
/// then t. They are regular at every attitude; omega and kappa are not.
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

/// Matrix of the seven parameters in the order of their unknowns, for covariances and partials.
pub type Matrix7 = [[f64; 7]; 7];

impl Similarity {
    /// Converts parameters to a similarity relative to given centres.
    pub fn from_parameters(parameters: &Parameters, control_centre: Vector3, model_centre: Vector3) -> Self {
        let Parameters { rotation, scale, translation } = *parameters;
        let shift = translation + scale * (rotation * control_centre) - model_centre;
        Self { rotation, scale, shift, control_centre, model_centre }
    }

    /// Returns the parameters of x = s A X + B: B = t + c_x - s A c_X.
    pub fn parameters(&self) -> Parameters {
        let moved = self.rotation * self.control_centre;
        let translation = self.shift + self.model_centre - self.scale * moved;
        Parameters { rotation: self.rotation, scale: self.scale, translation }
    }

    /// Returns omega, phi, kappa in radians.
    pub fn angles(&self) -> [f64; 3] {
        rotation_angles(&self.rotation)
    }

    /// Returns x - c_x - t in model units, the argument of the inverse rotation and scale.
    pub(super) fn reduced(&self, model: &Vector3) -> Vector3 {
        model - self.model_centre - self.shift
    }

    /// Returns X - c_X.
    pub(super) fn centred(&self, control: &Vector3) -> Vector3 {
        control - self.control_centre
    }

    /// Returns X of a model point (TB 19, equation 2.2).
    pub fn control_at(&self, model: &Vector3) -> Vector3 {
        self.control_centre + self.rotation.tr_mul(&self.reduced(model)) / self.scale
    }

    /// Returns the misclosure u = s X - A^T (x - B) of a control point and its model point, in control axes and model units. NaN if X is
    /// NaN.
    pub(super) fn misclosure(&self, control: &Vector3, model: &Vector3) -> Vector3 {
        self.scale * self.centred(control) - self.rotation.tr_mul(&self.reduced(model))
    }

    /// Returns the partials of the misclosures with respect to the tangent parameters. The column of the scale is NaN if X is NaN.
    pub(super) fn misclosure_partials(&self, control: &Vector3, model: &Vector3) -> [[f64; 7]; 3] {
        let reduced = self.reduced(model);
        let centred = self.centred(control);
        std::array::from_fn(|j| {
            let column = Vector3::from(self.rotation.column(j));
            let ([p, q, r], [a, b, c]): ([f64; 3], [f64; 3]) = (column.cross(&reduced).into(), column.into());
            [p, q, r, centred[j], a, b, c]
        })
    }

    /// Returns X of a model point and its partials with respect to the tangent parameters.
    fn control_with_partials_at(&self, model: &Vector3) -> (Vector3, [[f64; 7]; 3]) {
        let control = self.control_at(model);
        // u = 0 at X; dX = -du / s.
        let partials = self.misclosure_partials(&control, model).map(|row| row.map(|p| -p / self.scale));
        (control, partials)
    }

    /// Returns X of a model point and its covariance J Q J^T + A^T Q_x A / s^2. Q are the cofactors of the tangent parameters, Q_x the
    /// variances of the point.
    pub fn transform(
        &self,
        model: &Vector3,
        model_sd: &[f64; 3],
        covariance: &Matrix7,
    ) -> (Vector3, Matrix3) {
        let (control, partials) = self.control_with_partials_at(model);
        let result = propagate(&partials, covariance);
        let own = self.rotated_variances(model_sd) / (self.scale * self.scale);
        (control, Matrix3::from_fn(|i, j| result[i][j]) + own)
    }

    /// Returns A^T Q_x A of independent model coordinates.
    pub(super) fn rotated_variances(&self, model_sd: &[f64; 3]) -> Matrix3 {
        let variances = Matrix3::from_diagonal(&model_sd.map(|sd| sd * sd).into());
        self.rotation.tr_mul(&(variances * self.rotation))
    }

    /// Returns the partials of omega, phi, kappa, s, b1, b2, b3 with respect to the tangent parameters. The partials of omega and kappa
    /// diverge as phi approaches 90 degrees: both rotations then have the same axis.
    pub fn parameter_partials(&self) -> Matrix7 {
        let mut partials = identity();
        let rates = inverse_rates(self.angles());
        let moved = self.rotation * self.control_centre;
        let lever = -(self.scale * moved).cross_matrix();
        for i in 0..3 {
            (0..3).for_each(|k| partials[i][k] = rates[(i, k)]);
            // dB = dt + s r x (A c_X) - A c_X ds.
            partials[4 + i][3] = -moved[i];
            (0..3).for_each(|k| partials[4 + i][k] = lever[(i, k)]);
        }
        partials
    }
}

/// Returns J Q J^T.
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

/// Returns the partials of omega, phi, kappa with respect to three small rotations r: the inverse of r = (K Phi e1) domega + (K e2) dphi +
/// e3 dkappa.
fn inverse_rates([_, phi, kappa]: [f64; 3]) -> Matrix3 {
    let ((sp, cp), (sk, ck)) = (phi.sin_cos(), kappa.sin_cos());
    Matrix3::new(ck / cp, -sk / cp, 0.0, sk, ck, 0.0, -ck * sp / cp, sk * sp / cp, 1.0)
}
