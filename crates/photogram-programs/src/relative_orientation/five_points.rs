//! Relative orientation from five points: the essential matrix (Nister 2004) by the action matrix of its cubic equations (Stewenius,
//! Engels and Nister, ISPRS Journal 60, 2006).
//!
//! Five equations u1^T E u2 = 0 leave E = x E1 + y E2 + z E3 + E4. x, y, z satisfy ten cubic equations: det E = 0 and E E^T E - 1/2 tr(E
//! E^T) E = 0. Elimination of the ten monomials of degree three expresses x times the ten lower monomials by the lower ones: an action
//! matrix with the eigenvalues x.
//!
//! Relative orientation over a plane: the homography of four points, and its poses.
//!
//! With a plane n . P = d in the axes of the first photo, u2 ~ H u1, H = R + t n^T / d, R = A^T and t = -A^T b. The two poses follow from
//! the singular values of H (Ma, Soatto, Kosecka and Sastry, An Invitation to 3-D Vision, 2004, section 5.3).

use nalgebra::{SMatrix, SVector, Schur};

use super::Oriented;
use photocore::geometry::{Matrix3, Vector3};
use photocore::internal::principal_axes;

/// Maximum number of steps of the decompositions.
const STEPS: usize = 1000;

/// Exponents of the monomials in x, y, z: ten of degree three, then ten lower ones. The first six are x times the first six lower ones.
const EXPONENTS: [[usize; 3]; 20] = [
    [3, 0, 0],
    [2, 1, 0],
    [2, 0, 1],
    [1, 2, 0],
    [1, 1, 1],
    [1, 0, 2],
    [0, 3, 0],
    [0, 2, 1],
    [0, 1, 2],
    [0, 0, 3],
    [2, 0, 0],
    [1, 1, 0],
    [1, 0, 1],
    [0, 2, 0],
    [0, 1, 1],
    [0, 0, 2],
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
    [0, 0, 0],
];

/// Maximum relative imaginary part of a real eigenvalue: rounding makes a double eigenvalue a complex pair.
const NOT_REAL: f64 = 1e-3;

/// Coefficients of a polynomial of degree three or less.
type CubicPolynomial = [f64; 20];

/// Index of the product of two monomials, by its exponents.
const PLACE: [[[usize; 4]; 4]; 4] = places();

const fn places() -> [[[usize; 4]; 4]; 4] {
    let mut places = [[[0; 4]; 4]; 4];
    let mut index = 0;
    while index < 20 {
        let [i, j, k] = EXPONENTS[index];
        places[i][j][k] = index;
        index += 1;
    }
    places
}

/// Returns the product of two polynomials; the sum of their degrees is at most three.
fn product(a: &CubicPolynomial, b: &CubicPolynomial) -> CubicPolynomial {
    let mut sum = [0.0; 20];
    for (p, left) in EXPONENTS.iter().zip(a).filter(|(_, value)| **value != 0.0) {
        for (q, right) in EXPONENTS.iter().zip(b).filter(|(_, value)| **value != 0.0) {
            sum[PLACE[p[0] + q[0]][p[1] + q[1]][p[2] + q[2]]] += left * right;
        }
    }
    sum
}

/// Returns a + f b.
fn plus(a: &CubicPolynomial, f: f64, b: &CubicPolynomial) -> CubicPolynomial {
    std::array::from_fn(|k| a[k] + f * b[k])
}

/// Returns up to ten E with u1^T E u2 = 0 for five pairs of rays, in the axes of the first and of the second photo.
pub fn five_points(pairs: &[[Vector3; 2]; 5]) -> Vec<Matrix3> {
    let Some(basis) = null_space(pairs) else { return vec![] };
    let entry = |i: usize, j: usize| -> CubicPolynomial {
        let mut linear = [0.0; 20];
        (0..4).for_each(|k| linear[16 + k] = basis[k][(i, j)]);
        linear
    };
    let e: [[CubicPolynomial; 3]; 3] = std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)));
    let equations = constraints(&e);
    let (left, right) = (equations.fixed_columns::<10>(0), equations.fixed_columns::<10>(10));
    let Some(reduced) = left.into_owned().lu().solve(&right.into_owned()) else { return vec![] };
    let action = action_matrix(&reduced);
    roots(&action)
        .into_iter()
        .filter_map(|root| {
            let v = eigenvector(&action, root)?;
            let found = (v[6] * basis[0] + v[7] * basis[1] + v[8] * basis[2]) / v[9] + basis[3];
            let size = found.norm();
            (size.is_finite() && size > 0.0).then(|| found / size)
        })
        .collect()
}

/// Up to twelve equations in the nine elements of a matrix; unused rows are zero.
type EpipolarEquations = SMatrix<f64, 12, 9>;

/// Returns the right singular vectors, row by row, largest singular value first.
fn right_vectors(equations: EpipolarEquations) -> Option<SMatrix<f64, 9, 9>> {
    equations.try_svd(false, true, f64::EPSILON, STEPS)?.v_t
}

/// Returns four matrices that span the null space of the five equations.
fn null_space(pairs: &[[Vector3; 2]; 5]) -> Option<[Matrix3; 4]> {
    let mut equations = EpipolarEquations::zeros();
    for (row, [first, second]) in pairs.iter().enumerate() {
        (0..9).for_each(|k| equations[(row, k)] = first[k / 3] * second[k % 3]);
    }
    let rows = right_vectors(equations)?;
    Some(std::array::from_fn(|k| Matrix3::from_fn(|i, j| rows[(5 + k, 3 * i + j)])))
}

/// Returns the coefficients of det E = 0 and E E^T E - 1/2 tr(E E^T) E = 0.
fn constraints(e: &[[CubicPolynomial; 3]; 3]) -> SMatrix<f64, 10, 20> {
    let sum = |terms: [CubicPolynomial; 3]| plus(&plus(&terms[0], 1.0, &terms[1]), 1.0, &terms[2]);
    let square = |i: usize, j: usize| sum(std::array::from_fn(|k| product(&e[i][k], &e[j][k])));
    let mut squares: [[CubicPolynomial; 3]; 3] =
        std::array::from_fn(|i| std::array::from_fn(|j| square(i, j)));
    let trace = sum([squares[0][0], squares[1][1], squares[2][2]]);
    (0..3).for_each(|i| squares[i][i] = plus(&squares[i][i], -0.5, &trace));
    let cubic = |i: usize, j: usize| sum(std::array::from_fn(|k| product(&squares[i][k], &e[k][j])));
    let minor = |a: usize, b: usize| plus(&product(&e[1][a], &e[2][b]), -1.0, &product(&e[1][b], &e[2][a]));
    let determinant = sum([
        product(&e[0][0], &minor(1, 2)),
        product(&e[0][1], &minor(2, 0)),
        product(&e[0][2], &minor(0, 1)),
    ]);
    let rows: Vec<CubicPolynomial> =
        (0..9).map(|k| cubic(k / 3, k % 3)).chain(std::iter::once(determinant)).collect();
    SMatrix::from_fn(|row, column| rows[row][column])
}

/// Returns the matrix of the multiplication by x of the ten lower monomials, modulo the equations.
fn action_matrix(reduced: &SMatrix<f64, 10, 10>) -> SMatrix<f64, 10, 10> {
    let mut action = SMatrix::<f64, 10, 10>::zeros();
    for row in 0..6 {
        action.set_row(row, &-reduced.row(row));
    }
    // x x, x y, x z, x 1
    for (row, column) in [(6, 0), (7, 1), (8, 2), (9, 6)] {
        action[(row, column)] = 1.0;
    }
    action
}

fn roots(action: &SMatrix<f64, 10, 10>) -> Vec<f64> {
    if !action.iter().all(|value| value.is_finite()) {
        return vec![];
    }
    let Some(schur) = Schur::try_new(*action, f64::EPSILON, STEPS) else { return vec![] };
    let values = schur.complex_eigenvalues();
    values.iter().filter(|value| value.im.abs() <= NOT_REAL * (1.0 + value.re.abs())).map(|v| v.re).collect()
}

/// Returns the monomials of a root by inverse iteration.
fn eigenvector(action: &SMatrix<f64, 10, 10>, root: f64) -> Option<SVector<f64, 10>> {
    let near = root + 1e-10 * (1.0 + root.abs());
    let factors = (action - SMatrix::<f64, 10, 10>::identity() * near).lu();
    let mut vector = SVector::<f64, 10>::repeat(1.0);
    for _ in 0..3 {
        vector = factors.solve(&vector)?;
        let size = vector.norm();
        if !size.is_finite() || size == 0.0 {
            return None;
        }
        vector /= size;
    }
    Some(vector)
}

/// Minimum relative difference of the singular values for a determined base.
const NO_BASE: f64 = 1e-9;

/// Returns the poses of the second photo, in the axes of the first, that agree with four pairs of rays to points of a plane.
pub fn over_plane(pairs: &[[Vector3; 2]; 4]) -> Vec<Oriented> {
    homography(pairs).map_or(vec![], |h| poses(&h, pairs))
}

/// Returns H with u2 x (H u1) = 0, unscaled.
fn homography(pairs: &[[Vector3; 2]; 4]) -> Option<Matrix3> {
    let mut equations = EpipolarEquations::zeros();
    for (pair, [first, second]) in pairs.iter().enumerate() {
        let across = second.cross_matrix();
        for row in 0..3 {
            (0..9).for_each(|k| equations[(3 * pair + row, k)] = across[(row, k / 3)] * first[k % 3]);
        }
    }
    let rows = right_vectors(equations)?;
    let h = Matrix3::from_fn(|i, j| rows[(8, 3 * i + j)]);
    let forward: f64 = pairs.iter().map(|[first, second]| second.dot(&(h * first))).sum();
    Some(h * forward.signum())
}

fn poses(h: &Matrix3, pairs: &[[Vector3; 2]; 4]) -> Vec<Oriented> {
    let Some((squares, axes)) = principal_axes(&h.tr_mul(h)) else { return vec![] };
    let [v1, v2, v3] = [0, 1, 2].map(|k| Vector3::from(axes.column(k)));
    // The middle singular value is scaled to one.
    let h = h / squares[1].sqrt();
    let (large, small) = (squares[0] / squares[1], squares[2] / squares[1]);
    let has_base = squares[1] > 0.0 && large - small >= NO_BASE;
    if !has_base {
        return vec![];
    }
    let (p, q) = ((1.0 - small).max(0.0).sqrt(), (large - 1.0).max(0.0).sqrt());
    let root = (large - small).sqrt();
    let of_sign = |sign: f64| -> Option<Oriented> {
        // H preserves lengths in the plane of v2 and u.
        let u = (v1 * p + v3 * (sign * q)) / root;
        let (own, turned) = (frame(&v2, &u), frame(&(h * v2), &(h * u)));
        let to_second = turned * own.transpose();
        let mut normal = v2.cross(&u);
        if pairs.iter().map(|[first, _]| normal.dot(first)).sum::<f64>() < 0.0 {
            normal = -normal;
        }
        let shift = (h - to_second) * normal;
        let attitude = to_second.transpose();
        let base = (-(attitude * shift)).try_normalize(NO_BASE)?;
        Some(Oriented { base, attitude })
    };
    [1.0, -1.0].into_iter().filter_map(of_sign).collect()
}

fn frame(a: &Vector3, b: &Vector3) -> Matrix3 {
    Matrix3::from_columns(&[*a, *b, a.cross(b)])
}
