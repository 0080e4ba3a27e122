//! Cholesky factor of a local block.

use pulp::Simd;

use super::vectorised::LANES;

/// Minimum ratio of a pivot to its initial diagonal element; the unknown is undetermined below it. The rounding error of a zero pivot is
/// some tens of units in the last digit. Priors that only define the datum (GIANT's default of 60000 m for a station) give ten times this
/// or more.
pub(crate) const PIVOT_TOLERANCE: f64 = 512.0 * f64::EPSILON;

/// Cholesky factor L of a small matrix, with reciprocal diagonal elements.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Triangle {
    values: [[f64; 3]; 3],
}

impl Triangle {
    /// Number of elements in a lower triangle.
    pub const fn numbers(rows: usize) -> usize {
        rows * (rows + 1) / 2
    }

    /// Writes the elements, row by row.
    pub fn write_to(&self, rows: usize, numbers: &mut [f64]) {
        let mut at = 0;
        for (row, own) in self.values[..rows].iter().enumerate() {
            numbers[at..=at + row].copy_from_slice(&own[..=row]);
            at += row + 1;
        }
    }

    /// Creates the triangle from its elements.
    #[inline(always)]
    pub fn of(rows: usize, numbers: &[f64]) -> Self {
        let mut found = Self::default();
        let mut at = 0;
        for row in 0..rows {
            found.values[row][..=row].copy_from_slice(&numbers[at..=at + row]);
            at += row + 1;
        }
        found
    }

    /// Factors the lower triangles of one matrix per lane. Returns the triangles, and for each lane one, or zero if a pivot is lost in
    /// rounding errors (it is replaced by one).
    #[inline(always)]
    pub fn factor_lanes<S: Simd, const N: usize>(
        simd: S,
        matrices: &[[[f64; LANES]; N]; N],
    ) -> ([[[f64; LANES]; N]; N], [f64; LANES]) {
        let (mut found, mut regular) = ([[[0.0; LANES]; N]; N], [1.0; LANES]);
        let (zero, one) = (simd.splat_f64s(0.0), simd.splat_f64s(1.0));
        for v in 0..LANES / S::F64_LANES {
            let mut l = [[zero; N]; N];
            let mut sound = one;
            for j in 0..N {
                let diagonal = S::as_simd_f64s(&matrices[j][j]).0[v];
                let mut pivot = diagonal;
                for k in 0..j {
                    pivot = simd.sub_f64s(pivot, simd.mul_f64s(l[j][k], l[j][k]));
                }
                let least = simd.mul_f64s(simd.splat_f64s(PIVOT_TOLERANCE), diagonal);
                let retained = simd.greater_than_f64s(pivot, least);
                sound = simd.select_f64s(retained, sound, zero);
                l[j][j] = simd.div_f64s(one, simd.sqrt_f64s(simd.select_f64s(retained, pivot, one)));
                for i in j + 1..N {
                    let mut value = S::as_simd_f64s(&matrices[i][j]).0[v];
                    for k in 0..j {
                        value = simd.sub_f64s(value, simd.mul_f64s(l[i][k], l[j][k]));
                    }
                    l[i][j] = simd.mul_f64s(value, l[j][j]);
                }
            }
            for a in 0..N {
                for b in 0..a + 1 {
                    S::as_mut_simd_f64s(&mut found[a][b]).0[v] = l[a][b];
                }
            }
            S::as_mut_simd_f64s(&mut regular).0[v] = sound;
        }
        (found, regular)
    }

    /// Returns the triangle in one lane.
    #[inline(always)]
    pub fn in_lane<const N: usize>(lanes: &[[[f64; LANES]; N]; N], t: usize) -> Self {
        let mut found = Self::default();
        for a in 0..N {
            for b in 0..a + 1 {
                found.values[a][b] = lanes[a][b][t];
            }
        }
        found
    }

    /// Multiplies a matrix of N rows and the given width by L^-1.
    #[inline(always)]
    pub fn forward<const N: usize>(&self, matrix: &mut [f64], width: usize) {
        for a in 0..N {
            let (above, row) = matrix[..(a + 1) * width].split_at_mut(a * width);
            for b in 0..a {
                subtract_row(row, self.values[a][b], &above[b * width..][..width]);
            }
            row.iter_mut().for_each(|value| *value *= self.values[a][a]);
        }
    }

    /// Multiplies N rows in vectors by L^-1.
    #[inline(always)]
    pub fn forward_vectors<S: Simd, const N: usize>(&self, simd: S, rows: &mut [[S::f64s; LANES]; N]) {
        for k in 0..LANES / S::F64_LANES {
            for a in 0..N {
                let mut value = rows[a][k];
                for b in 0..a {
                    let factor = simd.splat_f64s(-self.values[a][b]);
                    value = simd.mul_add_f64s(rows[b][k], factor, value);
                }
                rows[a][k] = simd.mul_f64s(value, simd.splat_f64s(self.values[a][a]));
            }
        }
    }

    /// Multiplies a matrix of N rows and the given width by L^-T.
    #[inline(always)]
    pub fn backward<const N: usize>(&self, matrix: &mut [f64], width: usize) {
        for a in (0..N).rev() {
            let (row, below) = matrix[a * width..].split_at_mut(width);
            for b in a + 1..N {
                subtract_row(row, self.values[b][a], &below[(b - a - 1) * width..][..width]);
            }
            row.iter_mut().for_each(|value| *value *= self.values[a][a]);
        }
    }
}

/// row -= factor * other.
#[inline(always)]
fn subtract_row(row: &mut [f64], factor: f64, other: &[f64]) {
    for (value, other) in row.iter_mut().zip(other) {
        *value -= factor * other;
    }
}

#[cfg(test)]
mod tests {
    use pulp::{Arch, WithSimd};

    use super::*;

    type Matrices = [[[f64; LANES]; 3]; 3];

    struct Factor<'a>(&'a Matrices);

    impl WithSimd for Factor<'_> {
        type Output = (Matrices, [f64; LANES]);

        fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
            Triangle::factor_lanes(simd, self.0)
        }
    }

    /// Matrix of lane t: the last lane is singular, the others are positive definite.
    fn matrix(t: usize) -> [[f64; 3]; 3] {
        let x = t as f64;
        let weight = if t + 1 < LANES { 2.0 + x } else { 0.0 };
        [[4.0 + x, 0.0, 0.0], [1.0 - x, 5.0 + x * x, 0.0], [0.0, 0.0, weight]]
    }

    #[test]
    fn every_lane_is_factored() {
        let mut lanes = Matrices::default();
        for (t, a, b) in (0..LANES).flat_map(|t| (0..9).map(move |k| (t, k / 3, k % 3))) {
            lanes[a][b][t] = matrix(t)[a][b];
        }
        let (triangles, regular) = Arch::new().dispatch(Factor(&lanes));
        for t in 0..LANES {
            assert_eq!(regular[t] == 1.0, t + 1 < LANES);
            let l = Triangle::in_lane(&triangles, t);
            // L^-1 N L^-T is the identity; N is symmetric, with the upper triangle equal to the lower one.
            let mut product = [0.0; 9];
            (0..9).for_each(|k| product[k] = matrix(t)[(k / 3).max(k % 3)][(k / 3).min(k % 3)]);
            for _ in 0..2 {
                l.forward::<3>(&mut product, 3);
                product = std::array::from_fn(|k| product[k % 3 * 3 + k / 3]);
            }
            for (k, value) in product.iter().enumerate() {
                let expected = if k % 4 == 0 && (k < 8 || t + 1 < LANES) { 1.0 } else { 0.0 };
                assert!((value - expected).abs() < 1e-15, "{t}: {product:?}");
            }
        }
    }
}
