//! Vectors and matrices in cartesian axes, and sequential rotations M = M_kappa M_phi M_omega (GIANT guide, section 5 of its
//! specification).

/// Vector of three cartesian components.
pub type Vector3 = nalgebra::Vector3<f64>;
/// Matrix of 3 x 3 cartesian components.
pub type Matrix3 = nalgebra::Matrix3<f64>;

/// Maximum number of sweeps of an eigenvalue decomposition.
const SWEEPS: usize = 1000;

/// Returns the eigenvalues of a symmetric matrix in descending order and its unit eigenvectors as columns; None if it is not finite.
pub fn principal_axes(matrix: &Matrix3) -> Option<(Vector3, Matrix3)> {
    if !matrix.iter().all(|element| element.is_finite()) {
        return None;
    }
    let eigen = matrix.try_symmetric_eigen(f64::EPSILON, SWEEPS)?;
    let values = eigen.eigenvalues;
    let mut falling = [0, 1, 2];
    falling.sort_by(|&a, &b| values[b].total_cmp(&values[a]));
    let columns = falling.map(|k| eigen.eigenvectors.column(k).into_owned());
    Some((Vector3::from_fn(|k, _| values[falling[k]]), Matrix3::from_columns(&columns)))
}

/// Returns x of A x = b by Cramer's rule. None if the determinant is below `tolerance` times its upper bound, the product of the column
/// norms; the test is independent of the units of the columns.
#[inline]
pub fn solve(matrix: &Matrix3, b: &Vector3, tolerance: f64) -> Option<Vector3> {
    let [p, q, r] = [0, 1, 2].map(|k| Vector3::from(matrix.column(k)));
    let (qr, rp, pq) = (q.cross(&r), r.cross(&p), p.cross(&q));
    let determinant = p.dot(&qr);
    let largest = (p.norm_squared() * q.norm_squared() * r.norm_squared()).sqrt();
    let regular = determinant.abs() > tolerance * largest;
    regular.then(|| Vector3::new(b.dot(&qr), b.dot(&rp), b.dot(&pq)) / determinant)
}

/// Returns v / |v|; None for a zero or infinite vector.
#[inline]
pub fn unit(v: &Vector3) -> Option<Vector3> {
    let length = v.norm();
    (length > 0.0 && length.is_finite()).then(|| v / length)
}

/// Returns the rotation matrix M(omega, phi, kappa), angles in radians.
///
/// ```text
///  ck cp    so sp ck + co sk   -co sp ck + so sk
/// -sk cp   -so sp sk + co ck    co sp sk + so ck
///  sp      -so cp               co cp
/// ```
#[inline]
pub fn rotation(angles: [f64; 3]) -> Matrix3 {
    let [(so, co), (sp, cp), (sk, ck)] = angles.map(f64::sin_cos);
    Matrix3::new(
        ck * cp,
        so * sp * ck + co * sk,
        -co * sp * ck + so * sk,
        -sk * cp,
        -so * sp * sk + co * ck,
        co * sp * sk + so * ck,
        sp,
        -so * cp,
        co * cp,
    )
}

/// Returns the angles omega, phi, kappa of a rotation matrix: omega and kappa in [-pi, pi], phi in [-pi/2, pi/2].
///
/// If phi is +-90 degrees, only omega + kappa (or their difference) is determined; the returned angles still reproduce the matrix.
pub fn rotation_angles(m: &Matrix3) -> [f64; 3] {
    let omega = (-m[(2, 1)]).atan2(m[(2, 2)]);
    let phi = m[(2, 0)].atan2(m[(2, 1)].hypot(m[(2, 2)]));
    // After removal of omega the second column contains sin kappa and cos kappa, for any phi.
    let (so, co) = omega.sin_cos();
    let kappa = (so * m[(0, 2)] + co * m[(0, 1)]).atan2(so * m[(1, 2)] + co * m[(1, 1)]);
    [omega, phi, kappa]
}

/// Shifts angles by full rotations so that they are nearest to known ones (NaN if unknown).
pub fn nearest_turns<const N: usize>(angles: [f64; N], known: [f64; N]) -> [f64; N] {
    const TURN: f64 = std::f64::consts::TAU;
    std::array::from_fn(|k| {
        let turns = ((known[k] - angles[k]) / TURN).round();
        if turns.is_finite() { angles[k] + turns * TURN } else { angles[k] }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn principal_axes_fall() {
        let matrix = Matrix3::new(2.0, -1.0, 0.5, -1.0, 7.0, 0.3, 0.5, 0.3, -4.0);
        let (values, axes) = principal_axes(&matrix).unwrap();
        assert!(values[0] > values[1] && values[1] > values[2]);
        assert!((matrix * axes - axes * Matrix3::from_diagonal(&values)).norm() < 1e-13);
        assert!(principal_axes(&Matrix3::repeat(f64::NAN)).is_none());
    }
}
