//! Rotations as one vector: its direction is the axis, its length the angle in radians.

use super::vector::{Matrix3, Vector3, square};

/// Square of the angle below which the closed form of (a - sin a) / a^3 loses digits, and its series does not.
const SMALL: f64 = 0.1;

/// sin a / a, (1 - cos a) / a^2 and (a - sin a) / a^3.
fn ratios(square: f64) -> (f64, f64, f64) {
    let angle = square.sqrt();
    let half = if angle > 0.0 { (0.5 * angle).sin() / (0.5 * angle) } else { 1.0 };
    let (sine, versine) = (if angle > 0.0 { angle.sin() / angle } else { 1.0 }, 0.5 * half * half);
    let rest = if square > SMALL {
        (1.0 - sine) / square
    } else {
        let term = |rest: f64, n: f64| 1.0 - square * rest / ((n + 1.0) * (n + 2.0));
        [11.0, 9.0, 7.0, 5.0, 3.0].into_iter().fold(1.0, term) / 6.0
    };
    (sine, versine, rest)
}

/// a I + b [w]x + c w w^T
fn combined(w: Vector3, a: f64, b: f64, c: f64) -> Matrix3 {
    let [x, y, z] = w;
    let skew = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]];
    std::array::from_fn(|i| {
        std::array::from_fn(|j| f64::from(u8::from(i == j)) * a + b * skew[i][j] + c * w[i] * w[j])
    })
}

/// The rotation by an angle-axis vector (Rodrigues).
pub fn angle_axis_rotation(w: Vector3) -> Matrix3 {
    let (sine, versine, _) = ratios(square(&w));
    combined(w, 1.0 - versine * square(&w), sine, versine)
}

/// The rotation R and its left Jacobian J: a small change dw turns further by J dw, d(R v) = (J dw) x R v.
///
/// J is singular at full turns.
pub fn angle_axis_with_jacobian(w: Vector3) -> (Matrix3, Matrix3) {
    let (sine, versine, rest) = ratios(square(&w));
    let rotation = combined(w, 1.0 - versine * square(&w), sine, versine);
    (rotation, combined(w, sine, versine, rest))
}
