//! The attitude alpha, omega, kappa of a camera under the sky (NOAA TR NOS 55, equation 19).

use super::axes::{Matrix3, Vector3};

/// The matrix from north, east, zenith (left-handed) to x, y and axis of a diapositive; its determinant is -1.
///
/// Alpha turns about east (zenith towards north), omega about the turned north (axis towards east), kappa about the axis; then x is
/// reflected. The axis points to (sin alpha cos omega, sin omega, cos alpha cos omega).
pub fn pointing([alpha, omega, kappa]: [f64; 3]) -> Matrix3 {
    let [(sa, ca), (so, co), (sk, ck)] = [alpha, omega, kappa].map(f64::sin_cos);
    Matrix3::new(
        -ca * ck + sa * so * sk,
        -co * sk,
        sa * ck + ca * so * sk,
        -ca * sk - sa * so * ck,
        co * ck,
        sa * sk - ca * so * ck,
        sa * co,
        so,
        ca * co,
    )
}

/// The matrix and its partials with respect to alpha, omega, kappa.
pub fn pointing_with_partials(angles: [f64; 3]) -> (Matrix3, [Matrix3; 3]) {
    let m = pointing(angles);
    let [(sa, ca), (so, co), (sk, ck)] = angles.map(f64::sin_cos);
    let zero = Vector3::zeros();
    let alpha = Matrix3::from_columns(&[m.column(2).into(), zero, -m.column(0)]);
    let tilted = Vector3::new(-sa * so, co, -ca * so).transpose();
    let omega = Matrix3::from_rows(&[m.row(2) * sk, m.row(2) * -ck, tilted]);
    let kappa = Matrix3::from_rows(&[-m.row(1), m.row(0).into(), zero.transpose()]);
    (m, [alpha, omega, kappa])
}

/// The angles of a matrix (equations 96 to 98): alpha and kappa in [-pi, pi], omega in [-pi/2, pi/2].
///
/// With the axis due east or west only a combination of alpha and kappa is determined; kappa is then zero.
pub fn pointing_angles(m: &Matrix3) -> [f64; 3] {
    let cos_omega = m[(2, 0)].hypot(m[(2, 2)]);
    let omega = m[(2, 1)].atan2(cos_omega);
    if cos_omega < 1e-15 {
        return [m[(0, 2)].atan2(-m[(1, 2)] * omega.signum()), omega, 0.0];
    }
    [m[(2, 0)].atan2(m[(2, 2)]), omega, (-m[(0, 1)]).atan2(m[(1, 1)])]
}
