//! The S-transformation of cofactors, Q_S = S Q S^T with S = I - G (B^T G)^-1 B^T (see [`super::datum`]).

use std::ops::Range;

use faer::Mat;

use crate::normals::{Cofactors, Function, Layout};

/// T = G (B^T G)^-1, W = Q B and B^T W: with them any block of Q goes over to the other datum,
/// Q_ij - T_i W_j^T - W_i T_j^T + T_i (B^T W) T_j^T.
#[derive(Debug, Clone)]
pub(super) struct Transformation {
    pub t: Mat<f64>,
    pub w: Mat<f64>,
    pub common: Mat<f64>,
    /// Of B^T G, scaled.
    pub condition: f64,
    /// The carriers, ascending, where there are no more than conditions: they do not move in the new datum.
    pub staying: Vec<usize>,
}

impl Transformation {
    /// Whether an unknown does not move in the new datum.
    pub fn stays(&self, unknown: usize) -> bool {
        self.staying.binary_search(&unknown).is_ok()
    }

    /// Takes cofactors over. Returns an estimate of the relative error that rounding leaves in the variances: where the old datum is far
    /// from the new one, or short, large numbers cancel.
    pub fn apply(&self, layout: &Layout, cofactors: &mut Cofactors) -> f64 {
        let (l, mut cancelled) = (layout.local_dim(), 1.0);
        for (local, block) in cofactors.local.chunks_exact_mut(l * l).enumerate() {
            self.block(layout.local_range(local), layout.local_range(local), block, &mut cancelled);
        }
        for &pair in layout.pairs() {
            let [rows, columns] = pair.map(|block| layout.kept_range(block as usize));
            if let Some(range) = layout.pair(pair) {
                self.block(rows, columns, &mut cofactors.pairs[range], &mut cancelled);
            }
        }
        let border = layout.border_range();
        let (mut own, mut tied) = (&mut cofactors.kept[..], &mut cofactors.kept_border[..]);
        for kept in 0..layout.kept() {
            let range = layout.kept_range(kept);
            let (block, rest) = std::mem::take(&mut own).split_at_mut(range.len().pow(2));
            self.block(range.clone(), range.clone(), block, &mut cancelled);
            own = rest;
            if !border.is_empty() {
                let (block, rest) = std::mem::take(&mut tied).split_at_mut(range.len() * border.len());
                self.block(range, border.clone(), block, &mut cancelled);
                tied = rest;
            }
        }
        if !border.is_empty() {
            self.block(border.clone(), border, &mut cofactors.border, &mut cancelled);
        }
        f64::EPSILON * self.condition * cancelled
    }

    /// Transforms one block of Q, row by row; notes how many times larger than a variance what has made it is.
    fn block(&self, rows: Range<usize>, columns: Range<usize>, block: &mut [f64], cancelled: &mut f64) {
        let (width, d) = (columns.len(), self.common.nrows());
        for (i, row) in rows.enumerate() {
            let left = self.left(self.of(&self.t, &[(row, 1.0)]), &self.of(&self.w, &[(row, 1.0)]));
            for (j, column) in columns.clone().enumerate() {
                let value = &mut block[i * width + j];
                let product = |k: usize| left.by_t[k] * self.t[(column, k)] - left.t[k] * self.w[(column, k)];
                let (before, change) = (*value, (0..d).map(product).sum::<f64>());
                *value += change;
                if self.stays(row) || self.stays(column) {
                    *value = 0.0;
                } else if row == column && *value > 0.0 {
                    *cancelled = cancelled.max(before.max(change.abs()) / *value);
                }
            }
        }
    }

    /// Takes over cofactors of functions, those of every two of `rows` or of `rows` with `columns`.
    pub fn apply_to_functions(&self, rows: &[Function], columns: Option<&[Function]>, matrix: &mut [f64]) {
        let along = |functions: &[Function]| -> Vec<[Vec<f64>; 2]> {
            let of = |function: &Function| {
                let moving: Function =
                    function.iter().filter(|&&(unknown, _)| !self.stays(unknown)).copied().collect();
                [self.of(&self.t, &moving), self.of(&self.w, &moving)]
            };
            functions.iter().map(of).collect()
        };
        let of_rows = along(rows);
        let of_columns = columns.map(along);
        let of_columns = of_columns.as_ref().unwrap_or(&of_rows);
        for (row, [t, w]) in matrix.chunks_exact_mut(of_columns.len().max(1)).zip(&of_rows) {
            let left = self.left(t.clone(), w);
            row.iter_mut().zip(of_columns).for_each(|(value, [t, w])| *value += left.times(t, w));
        }
    }

    /// The products of a function with the columns of a matrix over all unknowns.
    fn of(&self, matrix: &Mat<f64>, function: &[(usize, f64)]) -> Vec<f64> {
        let along = |k: usize| function.iter().map(|&(unknown, value)| value * matrix[(unknown, k)]).sum();
        (0..matrix.ncols()).map(along).collect()
    }

    fn left(&self, t: Vec<f64>, w: &[f64]) -> Left {
        let d = t.len();
        let by_t = |k: usize| (0..d).map(|m| t[m] * self.common[(m, k)]).sum::<f64>() - w[k];
        Left { by_t: (0..d).map(by_t).collect(), t }
    }
}

/// What is added to Q_ij, of i.
struct Left {
    by_t: Vec<f64>,
    t: Vec<f64>,
}

impl Left {
    fn times(&self, t: &[f64], w: &[f64]) -> f64 {
        let products = self.by_t.iter().zip(t).zip(self.t.iter().zip(w));
        products.map(|((by_t, t), (own, w))| by_t * t - own * w).sum()
    }
}
