//! Sequential rotations M = M_kappa M_phi M_omega (GIANT guide, section 5 of its specification).

use super::axes::{Matrix3, Vector3};

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

/// Returns M and its partial derivatives with respect to omega, phi and kappa.
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
