//! Solution of three linear equations.

use super::axes::{Matrix3, Vector3};

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
