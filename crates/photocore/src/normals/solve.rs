//! Solution of the reduced normal equations.

use std::ops::ControlFlow;

use rayon::ThreadPool;

use super::elimination::{Elimination, Equations, LocalPrior, dot};
use super::factor::Factor;
use super::system::{Between, Prior, System};
use super::triangle::for_local_dim;

/// A solution of the normal equations.
#[derive(Debug)]
pub struct Solution {
    /// All unknowns, in the order of the layout.
    pub values: Vec<f64>,
    /// |L^-1 n|^2: the decrease of the sum of squares that the solution predicts, the local blocks' part not counted.
    pub decrease: f64,
}

impl System {
    /// Solves the normal equations: the kept blocks and the border from the factor, the local blocks one by one.
    ///
    /// `equations`, `prior` and `damping` must be those of the formation that the factor comes from.
    pub fn solve<E: Equations>(
        &self,
        pool: &ThreadPool,
        factor: &Factor,
        equations: &E,
        prior: &Prior,
        damping: f64,
        between: Between<'_>,
    ) -> ControlFlow<(), Solution> {
        let (reduced, decrease) = factor.solve();
        let (layout, symbolic) = (&self.layout, &*self.symbolic);
        let mut values = vec![0.0; layout.unknowns()];
        for position in 0..symbolic.blocks() {
            let range = symbolic.unknowns_at(layout, position);
            values[range].copy_from_slice(&reduced[symbolic.range(position)]);
        }
        let back_substitute = |e: &mut Elimination, prior: LocalPrior<'_>| {
            for_local_dim!(layout.local_dim(), L => e.solve::<L>(layout, symbolic, prior, damping, &reduced));
        };
        let locals = &mut values[layout.all_locals()];
        self.for_locals(pool, equations, prior, between, back_substitute, |first, batch| {
            let own = locals[first * layout.local_dim()..].chunks_exact_mut(layout.local_dim());
            for (elimination, x) in batch.iter().zip(own) {
                x.copy_from_slice(&elimination.solution[..x.len()]);
            }
        })?;
        ControlFlow::Continue(Solution { values, decrease })
    }
}

impl Factor {
    /// The reduced solution in the order of elimination, and |L^-1 n|^2.
    fn solve(&self) -> (Vec<f64>, f64) {
        let mut x: Vec<f64> = self.right.iter().zip(&self.scale).map(|(b, d)| b * d).collect();
        self.solve_forward(&mut x);
        let decrease = dot(&x, &x);
        self.solve_backward(&mut x);
        x.iter_mut().zip(&self.scale).for_each(|(x, d)| *x *= d);
        (x, decrease)
    }

    /// x := L^-1 x.
    fn solve_forward(&self, x: &mut [f64]) {
        let symbolic = &*self.panels.symbolic;
        for (index, s) in symbolic.supernodes().iter().enumerate() {
            let first = symbolic.first_unknown(index);
            let panel = &self.panels.values[s.panel.clone()];
            for (j, column) in panel.chunks_exact(s.height()).enumerate() {
                x[first + j] /= column[j];
                let value = x[first + j];
                let mut subtract = |target: std::ops::Range<usize>, factors: &[f64]| {
                    x[target].iter_mut().zip(factors).for_each(|(x, factor)| *x -= factor * value);
                };
                subtract(first + j + 1..first + s.width, &column[j + 1..s.width]);
                for (&row, &start) in s.rows.iter().zip(&s.row_offset) {
                    subtract(symbolic.range(row), &column[start..]);
                }
            }
        }
    }

    /// x := L^-T x.
    pub(crate) fn solve_backward(&self, x: &mut [f64]) {
        let symbolic = &*self.panels.symbolic;
        for (index, s) in symbolic.supernodes().iter().enumerate().rev() {
            let first = symbolic.first_unknown(index);
            let panel = &self.panels.values[s.panel.clone()];
            for (j, column) in panel.chunks_exact(s.height()).enumerate().rev() {
                let mut value =
                    x[first + j] - dot(&column[j + 1..s.width], &x[first + j + 1..first + s.width]);
                for (&row, &start) in s.rows.iter().zip(&s.row_offset) {
                    value -= dot(&column[start..start + symbolic.dim(row)], &x[symbolic.range(row)]);
                }
                x[first + j] = value / column[j];
            }
        }
    }
}
