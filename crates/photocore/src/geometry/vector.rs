//! Products of 3-vectors and 3x3 matrices.

/// Three numbers.
pub type Vector3 = [f64; 3];
/// Three rows of three numbers.
pub type Matrix3 = [[f64; 3]; 3];

/// The identity matrix.
pub const IDENTITY: Matrix3 = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// a . b
#[inline(always)]
pub fn dot(a: &Vector3, b: &Vector3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// |v|^2
#[inline(always)]
pub fn square(v: &Vector3) -> f64 {
    dot(v, v)
}

/// v / |v|; None for a vector without direction.
pub fn unit(v: &Vector3) -> Option<Vector3> {
    let length = square(v).sqrt();
    (length > 0.0 && length.is_finite()).then(|| v.map(|value| value / length))
}

/// a x b
#[inline(always)]
pub fn cross(a: &Vector3, b: &Vector3) -> Vector3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// a - b
#[inline(always)]
pub fn difference(a: &Vector3, b: &Vector3) -> Vector3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// A v
#[inline(always)]
pub fn apply(matrix: &Matrix3, v: &Vector3) -> Vector3 {
    [dot(&matrix[0], v), dot(&matrix[1], v), dot(&matrix[2], v)]
}

/// A^T v, the row v^T A
#[inline(always)]
pub fn apply_transposed(matrix: &Matrix3, v: &Vector3) -> Vector3 {
    std::array::from_fn(|j| matrix[0][j] * v[0] + matrix[1][j] * v[1] + matrix[2][j] * v[2])
}

/// A B
#[inline(always)]
pub fn product(a: &Matrix3, b: &Matrix3) -> Matrix3 {
    std::array::from_fn(|i| apply_transposed(b, &a[i]))
}

/// A^T
#[inline(always)]
pub fn transposed(a: &Matrix3) -> Matrix3 {
    std::array::from_fn(|i| [a[0][i], a[1][i], a[2][i]])
}

/// x of A x = b by Cramer's rule; None when the determinant is below `tolerance` times its largest possible value.
pub fn solve(matrix: &Matrix3, b: &Vector3, tolerance: f64) -> Option<Vector3> {
    let [p, q, r] = transposed(matrix);
    let (qr, rp, pq) = (cross(&q, &r), cross(&r, &p), cross(&p, &q));
    let determinant = dot(&p, &qr);
    let largest = (square(&p) * square(&q) * square(&r)).sqrt();
    let regular = determinant.abs() > tolerance * largest;
    regular.then(|| [&qr, &rp, &pq].map(|minor| dot(b, minor) / determinant))
}
