//! S-transformation of cofactors, Q_S = S Q S^T with S = I - G (B^T G)^-1 B^T (see [`super::datum`]).

use std::ops::Range;

use faer::Mat;
use smallvec::{SmallVec, smallvec};

use crate::normals::{Cofactors, Function, Layout};
use crate::parallel;

/// Number of unknowns per task.
const AT_ONCE: usize = 256;

/// Values of one unknown or function for the conditions of a datum: seven, except for unconnected networks.
type Along = SmallVec<[f64; 8]>;

/// T = G (B^T G)^-1, W = Q B and B^T W, which transform any block of Q to the other datum: Q_ij - T_i W_j^T - W_i T_j^T + T_i (B^T W)
/// T_j^T.
#[derive(Debug, Clone)]
#[doc(hidden)]
pub struct Transformation {
    /// T and W: one row per unknown, one after the other.
    pub t: Vec<f64>,
    pub w: Vec<f64>,
    pub common: Mat<f64>,
    /// Condition of B^T G with scaled columns.
    pub condition: f64,
    /// Carriers, ascending, if their number equals the number of conditions: they are fixed by the new datum.
    pub staying: Vec<usize>,
}

/// Cofactors of one block, with its unknowns.
struct Block<'a> {
    rows: Range<usize>,
    columns: Range<usize>,
    values: &'a mut [f64],
}

impl Transformation {
    /// Whether an unknown is fixed by the new datum.
    pub fn stays(&self, unknown: usize) -> bool {
        self.staying.binary_search(&unknown).is_ok()
    }

    /// Transforms cofactors. Returns the approximate relative rounding error of the variances: large numbers cancel if the old datum is
    /// distant from the new one, or weak.
    pub fn apply(&self, layout: &Layout, cofactors: &mut Cofactors) -> f64 {
        let l = layout.local_dim();
        let of_locals = |(chunk, values): (usize, &mut [f64])| {
            let blocks = values.chunks_exact_mut(l * l).enumerate().map(|(k, values)| {
                let range = layout.local_range(chunk * AT_ONCE + k);
                Block { rows: range.clone(), columns: range, values }
            });
            self.blocks(blocks)
        };
        let chunks = cofactors.local.chunks_mut((AT_ONCE * l * l).max(1)).enumerate().collect();
        let largest = |found: Vec<f64>| found.into_iter().fold(1.0, f64::max);
        let mut cancelled = largest(parallel::map_each(chunks, &of_locals));
        let mut others = Vec::new();
        for &pair in layout.pairs() {
            let [rows, columns] = pair.map(|block| layout.retained_range(block as usize));
            if let Some(range) = layout.pair(pair) {
                let values = &mut cofactors.pairs[range];
                cancelled = cancelled.max(self.blocks(std::iter::once(Block { rows, columns, values })));
            }
        }
        let mut own = &mut cofactors.retained[..];
        for retained in 0..layout.retained() {
            let rows = layout.retained_range(retained);
            let (values, rest) = std::mem::take(&mut own).split_at_mut(rows.len().pow(2));
            own = rest;
            others.push(Block { rows: rows.clone(), columns: rows, values });
        }
        let of_others =
            parallel::map_each(others.chunks_mut(AT_ONCE).collect(), &|blocks: &mut [Block<'_>]| {
                self.blocks(blocks.iter_mut().map(|Block { rows, columns, values }| Block {
                    rows: rows.clone(),
                    columns: columns.clone(),
                    values,
                }))
            });
        f64::EPSILON * self.condition * cancelled.max(largest(of_others))
    }

    /// Transforms blocks of Q, row by row. Returns the maximum ratio of cancelled terms to the resulting variance.
    fn blocks<'a>(&self, blocks: impl Iterator<Item = Block<'a>>) -> f64 {
        let mut cancelled = 1.0;
        for Block { rows, columns, values } in blocks {
            let width = columns.len();
            for (i, row) in rows.enumerate() {
                let left = self.left(self.row(&self.t, row).into(), self.row(&self.w, row));
                for (j, column) in columns.clone().enumerate() {
                    let value = &mut values[i * width + j];
                    let change = left.times(self.row(&self.t, column), self.row(&self.w, column));
                    let before = *value;
                    *value += change;
                    if self.stays(row) || self.stays(column) {
                        *value = 0.0;
                    } else if row == column && *value > 0.0 {
                        cancelled = f64::max(cancelled, before.max(change.abs()) / *value);
                    }
                }
            }
        }
        cancelled
    }

    /// Transforms cofactors of functions: of all pairs in `rows`, or of `rows` with `columns`.
    pub fn apply_to_functions(&self, rows: &[Function], columns: Option<&[Function]>, matrix: &mut [f64]) {
        let along = |functions: &[Function]| -> Vec<[Along; 2]> {
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

    /// Returns the row of an unknown in a matrix over all unknowns.
    fn row<'a>(&self, matrix: &'a [f64], unknown: usize) -> &'a [f64] {
        let d = self.common.nrows();
        &matrix[unknown * d..][..d]
    }

    /// Returns the products of a function with the columns of such a matrix.
    fn of(&self, matrix: &[f64], function: &[(usize, f64)]) -> Along {
        let mut along: Along = smallvec![0.0; self.common.nrows()];
        for &(unknown, value) in function {
            along.iter_mut().zip(self.row(matrix, unknown)).for_each(|(sum, of)| *sum += value * of);
        }
        along
    }

    fn left(&self, t: Along, w: &[f64]) -> Left {
        let by_t = w
            .iter()
            .enumerate()
            .map(|(k, w)| t.iter().enumerate().map(|(m, t)| t * self.common[(m, k)]).sum::<f64>() - w);
        Left { by_t: by_t.collect(), t }
    }
}

/// Factors of the change of Q_ij that depend on i.
struct Left {
    by_t: Along,
    t: Along,
}

impl Left {
    fn times(&self, t: &[f64], w: &[f64]) -> f64 {
        let products = self.by_t.iter().zip(t).zip(self.t.iter().zip(w));
        products.map(|((by_t, t), (own, w))| by_t * t - own * w).sum()
    }
}
