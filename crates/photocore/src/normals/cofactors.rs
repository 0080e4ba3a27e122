//! Cofactors of every unknown and of every adjusted equation, from the selected inverse.

use std::ops::{ControlFlow, Range};

use rayon::ThreadPool;
use rayon::prelude::*;

use super::elimination::{Elimination, Equations, dot};
use super::floors::skip;
use super::form::{Between, Prior, System};
use super::invert::SelectedInverse;

/// Cofactors: the inverse normal matrix where it is needed. All blocks are square, row by row.
#[derive(Debug, Clone)]
pub struct Cofactors {
    /// Of each local block, one after the other.
    pub local: Vec<f64>,
    /// Of each kept block, one after the other.
    pub kept: Vec<f64>,
    /// Of the border.
    pub border: Vec<f64>,
    /// a Q a^T of each equation a x = l, in the order of groups and rows: the share of the equation that its own
    /// unknowns take up. One minus it is the redundancy number of an observation.
    pub equations: Vec<f64>,
}

impl System {
    /// Computes all cofactors.
    ///
    /// `equations`, `prior` must be those of the formation that the selected inverse comes from, without damping.
    pub fn cofactors<E: Equations>(
        &self,
        pool: &ThreadPool,
        inverse: &SelectedInverse,
        equations: &E,
        prior: &Prior,
        between: Between<'_>,
    ) -> ControlFlow<(), Cofactors> {
        let layout = &self.layout;
        let (rows, l) = (layout.rows(), layout.local_dim());
        let mut result = Cofactors {
            local: vec![0.0; layout.locals() * l * l],
            kept: Vec::new(),
            border: Vec::new(),
            equations: vec![0.0; layout.groups() * rows],
        };
        let (mut local_rest, mut rest) = (&mut result.local[..], &mut result.equations[..]);
        let done = self.eliminate_all(pool, equations, prior, 0.0, between, |first, batch| {
            let mut work = Vec::with_capacity(batch.len());
            for (i, elimination) in batch.iter().enumerate() {
                let groups = layout.groups_of(first + i);
                let own = (skip(&mut local_rest, l * l), skip(&mut rest, groups.len() * rows));
                work.push((elimination, groups, own));
            }
            pool.install(|| {
                work.into_par_iter().with_min_len(32).for_each(
                    |(elimination, groups, (local, equations))| {
                        self.cofactors_of_local(elimination, inverse, groups, local, equations);
                    },
                );
            });
        });
        if done.is_break() {
            return ControlFlow::Break(());
        }
        for block in 0..layout.kept() {
            result.kept.extend(inverse.block(block, block).unwrap_or_default());
        }
        if layout.border_dim() > 0 {
            result.border = inverse.block(layout.kept(), layout.kept()).unwrap_or_default();
        }
        ControlFlow::Continue(result)
    }

    /// With H = N_ll^-1 N_lo (o: the kept blocks and the border that the local block is tied to) and Q_oo from the inverse:
    /// Q_ll = N_ll^-1 + H Q_oo H^T, Q_lo = -H Q_oo, and a Q a^T for each equation.
    fn cofactors_of_local(
        &self,
        e: &Elimination,
        inverse: &SelectedInverse,
        groups: Range<usize>,
        local: &mut [f64],
        equations: &mut [f64],
    ) {
        let (rows, l) = (self.layout.rows(), self.layout.local_dim());
        let others = Others::new(self, e, inverse);
        let h = others.coupling(self, e);
        let hq: Vec<f64> =
            (0..l).flat_map(|a| others.times(&h[a * others.width..][..others.width])).collect();
        for a in 0..l {
            let mut unit = [0.0; 3];
            unit[a] = 1.0;
            e.solve_normal(&mut unit, l);
            for b in 0..=a {
                let row = &h[b * others.width..][..others.width];
                local[a * l + b] = unit[b] + dot(&hq[a * others.width..][..others.width], row);
                local[b * l + a] = local[a * l + b];
            }
        }
        let mut wide = vec![0.0; others.width];
        for (index, slot) in e.slots.iter().enumerate() {
            for place in &e.groups[slot.first..slot.end] {
                for row in 0..rows {
                    let own = &e.local_rows[place.local + row * l..][..l];
                    let kept = &e.kept_rows[place.kept + row * slot.dim..][..slot.dim];
                    let common =
                        &e.border_rows[place.border + row * place.border_width..][..place.border_width];
                    wide.fill(0.0);
                    wide[others.start[index]..][..slot.dim].copy_from_slice(kept);
                    wide[others.border_start() + place.border_first..][..place.border_width]
                        .copy_from_slice(common);
                    let mut q = others.quadratic(&wide, others.start[index]..others.start[index] + slot.dim);
                    for a in 0..l {
                        q -= 2.0 * own[a] * dot(&hq[a * others.width..][..others.width], &wide);
                        q += own[a] * dot(&local[a * l..][..l], own);
                    }
                    equations[(place.group - groups.start) * rows + row] = q;
                }
            }
        }
    }
}

/// The inverse over everything that one local block is tied to: its kept blocks in the order of its slots, then the border.
struct Others {
    start: Vec<usize>,
    width: usize,
    border: usize,
    inverse: Vec<f64>,
}

impl Others {
    fn new(system: &System, e: &Elimination, inverse: &SelectedInverse) -> Self {
        let border = system.layout.border_dim();
        let mut start = Vec::with_capacity(e.slots.len() + 1);
        let mut blocks = Vec::with_capacity(e.slots.len() + 1);
        let mut width = 0;
        for slot in &e.slots {
            start.push(width);
            blocks.push(system.symbolic.block(slot.position));
            width += slot.dim;
        }
        if border > 0 {
            start.push(width);
            blocks.push(system.layout.kept());
        }
        width += border;
        let mut values = vec![0.0; width * width];
        for (&row_start, &row) in start.iter().zip(&blocks) {
            for (&column_start, &column) in start.iter().zip(&blocks) {
                inverse.write_block(row, column, &mut values[row_start * width + column_start..], width);
            }
        }
        Self { start, width, border, inverse: values }
    }

    fn border_start(&self) -> usize {
        self.width - self.border
    }

    /// H = L^-T V, row by row.
    fn coupling(&self, system: &System, e: &Elimination) -> Vec<f64> {
        let l = system.layout.local_dim();
        let mut h = vec![0.0; l * self.width];
        for d in 0..l {
            for (slot, &start) in e.slots.iter().zip(&self.start) {
                let values = &e.coupling[slot.coupling + d * slot.dim..][..slot.dim];
                h[d * self.width + start..][..slot.dim].copy_from_slice(values);
            }
            let values = &e.border_coupling[d * self.border..][..self.border];
            h[d * self.width + self.border_start()..][..self.border].copy_from_slice(values);
        }
        for column in 0..self.width {
            let mut values = [0.0; 3];
            (0..l).for_each(|d| values[d] = h[d * self.width + column]);
            e.solve_transposed(&mut values, l);
            (0..l).for_each(|d| h[d * self.width + column] = values[d]);
        }
        h
    }

    /// The row vector x Q.
    fn times(&self, x: &[f64]) -> Vec<f64> {
        let mut product = vec![0.0; self.width];
        for (value, row) in x.iter().zip(self.inverse.chunks_exact(self.width.max(1))) {
            product.iter_mut().zip(row).for_each(|(sum, q)| *sum += value * q);
        }
        product
    }

    /// x Q x^T for a vector that is zero outside `kept` and the border.
    fn quadratic(&self, x: &[f64], kept: Range<usize>) -> f64 {
        let border = self.border_start()..self.width;
        let part = |i: usize| {
            let row = &self.inverse[i * self.width..][..self.width];
            x[i] * (dot(&row[kept.clone()], &x[kept.clone()]) + dot(&row[border.clone()], &x[border.clone()]))
        };
        kept.clone().map(part).sum::<f64>() + border.clone().map(part).sum::<f64>()
    }
}
