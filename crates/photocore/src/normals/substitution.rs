//! Forward and back substitution with the factor L of the reduced normal equations.

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::{Accum, MatMut, MatRef, Par};
use pulp::Simd;

use super::factor::Factor;
use super::layout::Layout;
use super::panels::Panels;
use super::vectorised::{Kernel, dot_in_lanes, run_unsized};

impl Factor {
    /// The corrections of the unknowns that are not local, in the order of the layout; of a whole system.
    pub fn reduced_corrections(&self, layout: &Layout) -> Vec<f64> {
        let (first, mut x) = (layout.all_locals().end, self.right.clone());
        self.solve_backward(&mut x);
        let mut corrections = vec![0.0; x.len()];
        self.unknowns(layout).zip(&x).for_each(|(unknown, &x)| corrections[unknown - first] = x);
        corrections
    }

    /// Solves the reduced normal equations for right-hand sides over the unknowns that are not local, in the order of the layout, one
    /// after the other; so are the solutions. No equation is formed again.
    pub fn solve_reduced(&self, layout: &Layout, rights: &[f64]) -> Vec<f64> {
        let (first, order) = (layout.all_locals().end, self.unknowns(layout).collect::<Vec<usize>>());
        let columns = rights.chunks_exact(order.len().max(1));
        let mut sorted: Vec<f64> =
            columns.flat_map(|right| order.iter().map(|&unknown| right[unknown - first])).collect();
        self.solve_columns(&mut sorted);
        let mut solutions = vec![0.0; sorted.len()];
        let pairs =
            solutions.chunks_exact_mut(order.len().max(1)).zip(sorted.chunks_exact(order.len().max(1)));
        for (solution, sorted) in pairs {
            order.iter().zip(sorted).for_each(|(&unknown, &x)| solution[unknown - first] = x);
        }
        solutions
    }

    /// Replaces columns, in the order of elimination, by (L L^T)^-1 times them. Outer unknowns must be zero: they stay so only where the
    /// others leave nothing for them, so that this is for whole systems.
    pub(super) fn solve_columns(&self, columns: &mut [f64]) {
        self.forward_columns(columns);
        self.backward_columns(columns);
    }

    /// Replaces columns by L^-1 times them, and what they have of outer unknowns by what is left of it.
    pub(super) fn forward_columns(&self, columns: &mut [f64]) {
        let symbolic = &*self.panels.symbolic;
        let count = columns.len() / symbolic.unknowns().max(1);
        let mut x = MatMut::from_column_major_slice_mut(columns, symbolic.unknowns(), count);
        let mut below = Vec::new();
        for index in 0..symbolic.closed().len() {
            let (s, first) = (&symbolic.supernodes()[index], symbolic.first_unknown(index));
            let (top, rest) = self.panel(index);
            let mut own = x.as_mut().subrows_mut(first, s.width);
            solve_lower_triangular_in_place(top, own.as_mut(), Par::Seq);
            below.resize(s.below() * count, 0.0);
            let mut product = MatMut::from_column_major_slice_mut(&mut below, s.below(), count);
            matmul(product.as_mut(), Accum::Replace, rest, own.as_ref(), 1.0, Par::Seq);
            for (&row, &offset) in s.rows.iter().zip(&s.row_offset) {
                let range = symbolic.range(row);
                let mut target = x.as_mut().subrows_mut(range.start, range.len());
                target -= product.as_ref().subrows(offset - s.width, range.len());
            }
        }
    }

    /// Replaces columns by L^-T times them; outer unknowns stay as they are.
    pub(super) fn backward_columns(&self, columns: &mut [f64]) {
        let symbolic = &*self.panels.symbolic;
        let count = columns.len() / symbolic.unknowns().max(1);
        let mut x = MatMut::from_column_major_slice_mut(columns, symbolic.unknowns(), count);
        let mut below = Vec::new();
        for index in (0..symbolic.closed().len()).rev() {
            let (s, first) = (&symbolic.supernodes()[index], symbolic.first_unknown(index));
            let (top, rest) = self.panel(index);
            below.resize(s.below() * count, 0.0);
            let mut known = MatMut::from_column_major_slice_mut(&mut below, s.below(), count);
            for (&row, &offset) in s.rows.iter().zip(&s.row_offset) {
                let range = symbolic.range(row);
                let mut target = known.as_mut().subrows_mut(offset - s.width, range.len());
                target.copy_from(x.as_ref().subrows(range.start, range.len()));
            }
            let mut own = x.as_mut().subrows_mut(first, s.width);
            matmul(own.as_mut(), Accum::Add, rest.transpose(), known.as_ref(), -1.0, Par::Seq);
            solve_upper_triangular_in_place(top.transpose(), own.as_mut(), Par::Seq);
        }
    }

    /// The own and the coupled rows of the panel of a supernode.
    pub(super) fn panel(&self, index: usize) -> (MatRef<'_, f64>, MatRef<'_, f64>) {
        let s = &self.panels.symbolic.supernodes()[index];
        MatRef::from_column_major_slice(self.panels.panel(index), s.height(), s.width).split_at_row(s.width)
    }

    /// x := L^-T x; outer unknowns stay as they are.
    pub(super) fn solve_backward(&self, x: &mut [f64]) {
        run_unsized(Backward { panels: &self.panels, x });
    }
}

struct Backward<'a> {
    panels: &'a Panels,
    x: &'a mut [f64],
}

impl Kernel for Backward<'_> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const L: usize, const D: usize>(self, _: S) {
        let Self { panels, x } = self;
        let (symbolic, mut own) = (&*panels.symbolic, Vec::new());
        for (index, s) in symbolic.closed().iter().enumerate().rev() {
            let first = symbolic.first_unknown(index);
            own.clear();
            own.extend_from_slice(&x[first..first + s.width]);
            s.rows.iter().for_each(|&row| own.extend_from_slice(&x[symbolic.range(row)]));
            if own.iter().all(|&value| value == 0.0) {
                continue;
            }
            for (j, column) in panels.panel(index).chunks_exact(s.height()).enumerate().rev() {
                own[j] = (own[j] - dot_in_lanes(&column[j + 1..], &own[j + 1..])) / column[j];
            }
            x[first..first + s.width].copy_from_slice(&own[..s.width]);
        }
    }
}
