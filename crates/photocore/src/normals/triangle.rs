//! The Cholesky factor of a local block.

use std::cmp::Ordering::Greater;

use pulp::Simd;

use super::vectorised::LANES;

/// A pivot smaller than this fraction of its diagonal element before elimination is rounding error: the unknown is not determined.
/// What rounding leaves of a zero pivot is some tens of units in the last place; weights that alone make a datum (GIANT's default
/// of 60000 m for a station) leave ten times this and more.
pub(crate) const PIVOT_TOLERANCE: f64 = 512.0 * f64::EPSILON;

/// The Cholesky factor L of a small matrix, with the reciprocals of its diagonal.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Triangle {
    values: [[f64; 3]; 3],
}

impl Triangle {
    /// Numbers in the lower triangle of so many rows.
    pub const fn numbers(rows: usize) -> usize {
        rows * (rows + 1) / 2
    }

    /// Appends them, row by row.
    pub fn append_to(&self, rows: usize, numbers: &mut Vec<f64>) {
        self.values
            .iter()
            .take(rows)
            .enumerate()
            .for_each(|(row, own)| numbers.extend_from_slice(&own[..=row]));
    }

    /// The triangle of such numbers.
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

    /// Factors the lower triangle of a matrix; false when a pivot is lost in rounding (one then stands in its place).
    #[inline(always)]
    pub fn factor<const N: usize>(&mut self, matrix: &[[f64; N]; N]) -> bool {
        let mut regular = true;
        let l = &mut self.values;
        for j in 0..N {
            let mut pivot = matrix[j][j];
            for k in 0..j {
                pivot -= l[j][k] * l[j][k];
            }
            if !matches!(pivot.partial_cmp(&(PIVOT_TOLERANCE * matrix[j][j])), Some(Greater)) {
                regular = false;
                pivot = 1.0;
            }
            l[j][j] = pivot.sqrt().recip();
            for i in j + 1..N {
                let mut value = matrix[i][j];
                for k in 0..j {
                    value -= l[i][k] * l[j][k];
                }
                l[i][j] = value * l[j][j];
            }
        }
        regular
    }

    /// Replaces a matrix of N rows of the given width by L^-1 times it.
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

    /// The same of N rows in vectors.
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

    /// Replaces a matrix of N rows of the given width by L^-T times it.
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
