//! Rotation vectors: the direction is the axis, the length is the angle in radians.

use super::rotation::{Matrix3, Vector3};

/// Square of the angle below which series replace closed forms. (a - sin a) / a^3 and 1/a^2 - cot(a/2) / (2a) lose digits there; for sin a
/// / a and (1 - cos a) / a^2 the series are faster than a sine.
const SMALL: f64 = 0.1;

/// Returns the coefficients 1/n!, -1/(n+2)!, 1/(n+4)! ..., sufficient below [`SMALL`].
const fn inverse_factorials(n: u32) -> [f64; 8] {
    let (mut all, mut term, mut m) = ([0.0; 8], 1.0, 1);
    while m <= n {
        term /= m as f64;
        m += 1;
    }
    let mut k = 0;
    while k < all.len() {
        all[k] = term;
        term /= -((m * (m + 1)) as f64);
        m += 2;
        k += 1;
    }
    all
}

/// Evaluates a power series in the square of an angle.
#[inline(always)]
fn series(coefficients: &[f64; 8], square: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, term| sum * square + term)
}

/// Returns sin a / a, (1 - cos a) / a^2 and (a - sin a) / a^3.
#[inline]
fn ratios(square: f64) -> (f64, f64, f64) {
    const SINE: [f64; 8] = inverse_factorials(1);
    const VERSINE: [f64; 8] = inverse_factorials(2);
    const REST: [f64; 8] = inverse_factorials(3);
    if square < SMALL {
        return (series(&SINE, square), series(&VERSINE, square), series(&REST, square));
    }
    let angle = square.sqrt();
    let half = (0.5 * angle).sin() / (0.5 * angle);
    let sine = angle.sin() / angle;
    (sine, 0.5 * half * half, (1.0 - sine) / square)
}

/// a I + b `[w]x` + c w w^T
fn combined(w: &Vector3, a: f64, b: f64, c: f64) -> Matrix3 {
    Matrix3::from_diagonal_element(a) + b * w.cross_matrix() + c * w * w.transpose()
}

/// Returns the rotation matrix of a rotation vector (Rodrigues): Exp.
#[inline]
pub fn angle_axis_rotation(w: &Vector3) -> Matrix3 {
    let (sine, versine, _) = ratios(w.norm_squared());
    combined(w, 1.0 - versine * w.norm_squared(), sine, versine)
}

/// Returns the rotation R and its left Jacobian J. A small change dw rotates further by J dw: d(R v) = (J dw) x R v.
///
/// J is singular at full rotations (multiples of 2 pi).
pub fn angle_axis_with_jacobian(w: &Vector3) -> (Matrix3, Matrix3) {
    let (sine, versine, rest) = ratios(w.norm_squared());
    let rotation = combined(w, 1.0 - versine * w.norm_squared(), sine, versine);
    (rotation, combined(w, sine, versine, rest))
}

/// Returns the rotation vector of a rotation matrix, at most pi long: Log.
///
/// The quaternion is an intermediate result, largest component first, which preserves all digits near 180 degrees.
pub fn rotation_angle_axis(r: &Matrix3) -> Vector3 {
    let [w, x, y, z] = quaternion(r);
    let axis = Vector3::new(x, y, z);
    let sine = axis.norm();
    // sin(a/2) / a tends to 1/2.
    if sine > 0.0 { axis * (2.0 * sine.atan2(w) / sine) } else { 2.0 * axis }
}

/// Returns the unit quaternion w, x, y, z of a rotation matrix, w >= 0 (Shepperd 1978).
pub fn quaternion(r: &Matrix3) -> [f64; 4] {
    let trace = r.trace();
    let squares = [trace, 2.0 * r[(0, 0)] - trace, 2.0 * r[(1, 1)] - trace, 2.0 * r[(2, 2)] - trace];
    let largest = (0..4).fold(0, |best, k| if squares[k] > squares[best] { k } else { best });
    let double = (1.0 + squares[largest]).sqrt();
    let (sum, difference) =
        (|i: usize, j: usize| r[(i, j)] + r[(j, i)], |i: usize, j: usize| r[(i, j)] - r[(j, i)]);
    let four = match largest {
        0 => [double * double, difference(2, 1), difference(0, 2), difference(1, 0)],
        1 => [difference(2, 1), double * double, sum(0, 1), sum(0, 2)],
        2 => [difference(0, 2), sum(0, 1), double * double, sum(1, 2)],
        _ => [difference(1, 0), sum(0, 2), sum(1, 2), double * double],
    };
    let scale = if four[0] < 0.0 { -0.5 / double } else { 0.5 / double };
    four.map(|value| scale * value)
}

/// Returns the rotation matrix of a unit quaternion w, x, y, z.
#[inline]
pub fn quaternion_rotation([w, x, y, z]: [f64; 4]) -> Matrix3 {
    Matrix3::new(
        w * w + x * x - y * y - z * z,
        2.0 * (x * y - w * z),
        2.0 * (x * z + w * y),
        2.0 * (x * y + w * z),
        w * w - x * x + y * y - z * z,
        2.0 * (y * z - w * x),
        2.0 * (x * z - w * y),
        2.0 * (y * z + w * x),
        w * w - x * x - y * y + z * z,
    )
}

/// Returns Jr^-1, the inverse right Jacobian: Log(Exp(r) Exp(rho)) = r + Jr^-1(r) rho to first order. Singular at a full rotation.
pub fn right_jacobian_inverse(r: &Vector3) -> Matrix3 {
    let square = r.norm_squared();
    let second = if square > SMALL {
        let half = 0.5 * square.sqrt();
        (1.0 - half / half.tan()) / square
    } else {
        // Sum of |B_2k| a^(2k-2) / (2k)! with the Bernoulli numbers B.
        let terms = [1.0 / 12.0, 1.0 / 720.0, 1.0 / 30_240.0, 1.0 / 1_209_600.0, 1.0 / 47_900_160.0];
        let last = 691.0 / 1_307_674_368_000.0;
        terms.iter().rev().fold(last, |sum, term| term + square * sum)
    };
    let skew = r.cross_matrix();
    Matrix3::identity() + 0.5 * skew + second * skew * skew
}

/// Returns dJr/dt for dr/dt = `rate`. Jr is the right Jacobian: Exp(r + dr) = Exp(r) Exp(Jr dr) to first order.
pub fn right_jacobian_rate(r: &Vector3, rate: &Vector3) -> Matrix3 {
    let square = r.norm_squared();
    let (_, versine, rest) = ratios(square);
    // Derivatives of (1 - cos a) / a^2 and of (a - sin a) / a^3, divided by a.
    let (by_versine, by_rest) = if square > SMALL {
        let angle = square.sqrt();
        let (sine, chord) = (angle.sin(), 1.0 - angle.cos());
        let fourth = square * square;
        ((angle * sine - 2.0 * chord) / fourth, (angle * chord - 3.0 * (angle - sine)) / (fourth * angle))
    } else {
        // Sum of (-1)^k 2k a^(2k-2) / (2k + n)!.
        let series = |n: usize| {
            let factorial = |m: usize| (1..=m).map(|i| i as f64).product::<f64>();
            (1..8).rev().fold(0.0, |sum, k| {
                let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
                sum * square + sign * (2 * k) as f64 / factorial(2 * k + n)
            })
        };
        (series(2), series(3))
    };
    let (along, skew, turning) = (r.dot(rate), r.cross_matrix(), rate.cross_matrix());
    -versine * turning - by_versine * along * skew
        + rest * (skew * turning + turning * skew)
        + by_rest * along * skew * skew
}
