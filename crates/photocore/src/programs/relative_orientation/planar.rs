//! Relative orientation over a plane: the homography of four points, and the poses that it stands for.
//!
//! With a plane n . P = d in the axes of the first photo, u2 ~ H u1, H = R + t n^T / d, R = A^T and t = -A^T b. The two poses come from
//! the singular values of H (Ma, Soatto, Kosecka and Sastry, An Invitation to 3-D Vision, 2004, section 5.3).

use nalgebra::SMatrix;

use super::oriented::Oriented;
use crate::geometry::{Matrix3, Vector3};

/// Steps of the decompositions at the most.
const STEPS: usize = 1000;
/// Singular values that differ by less leave no base.
const NO_BASE: f64 = 1e-9;

/// The poses of the second photo in the axes of the first that show four points of a plane as the pairs of rays have them.
pub fn over_plane(pairs: &[[Vector3; 2]; 4]) -> Vec<Oriented> {
    homography(pairs).map_or(vec![], |h| poses(&h, pairs))
}

/// H with u2 x (H u1) = 0 and unit middle singular value.
fn homography(pairs: &[[Vector3; 2]; 4]) -> Option<Matrix3> {
    let mut equations = SMatrix::<f64, 12, 9>::zeros();
    for (pair, [first, second]) in pairs.iter().enumerate() {
        let across = second.cross_matrix();
        for row in 0..3 {
            (0..9).for_each(|k| equations[(3 * pair + row, k)] = across[(row, k / 3)] * first[k % 3]);
        }
    }
    let rows = equations.try_svd(false, true, f64::EPSILON, STEPS)?.v_t?;
    let h = Matrix3::from_fn(|i, j| rows[(8, 3 * i + j)]);
    let mut sizes = h.singular_values();
    sizes.as_mut_slice().sort_by(f64::total_cmp);
    let forward: f64 = pairs.iter().map(|[first, second]| second.dot(&(h * first))).sum();
    (sizes[1] > 0.0).then(|| h * forward.signum() / sizes[1])
}

fn poses(h: &Matrix3, pairs: &[[Vector3; 2]; 4]) -> Vec<Oriented> {
    let Some(eigen) = h.tr_mul(h).try_symmetric_eigen(f64::EPSILON, STEPS) else { return vec![] };
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let [v1, v2, v3] = order.map(|k| Vector3::from(eigen.eigenvectors.column(k)));
    let (large, small) = (eigen.eigenvalues[order[0]], eigen.eigenvalues[order[2]]);
    if large - small < NO_BASE {
        return vec![];
    }
    let (p, q) = ((1.0 - small).max(0.0).sqrt(), (large - 1.0).max(0.0).sqrt());
    let root = (large - small).sqrt();
    let of_sign = |sign: f64| -> Option<Oriented> {
        // In the plane of v2 and u, H keeps lengths.
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
