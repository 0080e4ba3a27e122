//! Cofactors of every unknown and of every adjusted equation, from the selected inverse.

use std::ops::ControlFlow;

use pulp::Arch;
use rayon::ThreadPool;
use rayon::prelude::*;

use super::elimination::{Elimination, Equations, LocalPrior, dot};
use super::floors::skip;
use super::invert::SelectedInverse;
use super::system::{Between, Prior, System};
use super::triangle::for_local_dim;

/// Cofactors: the inverse normal matrix where it is needed. All blocks are square, row by row.
#[derive(Debug, Clone)]
pub struct Cofactors {
    /// Of each local block, one after the other.
    pub local: Vec<f64>,
    /// Of each kept block, one after the other.
    pub kept: Vec<f64>,
    /// Of the border.
    pub border: Vec<f64>,
    /// Of each kept block with the border (its unknowns x those of the border, row by row), one after the other.
    pub kept_border: Vec<f64>,
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
            kept_border: Vec::new(),
            equations: vec![0.0; layout.groups() * rows],
        };
        let (mut local_rest, mut rest) = (&mut result.local[..], &mut result.equations[..]);
        let eliminate = |e: &mut Elimination, prior: LocalPrior<'_>| e.eliminate(layout, prior, 0.0);
        let arch = Arch::new();
        let done = self.for_locals(pool, equations, prior, between, eliminate, |first, batch| {
            let mut work = Vec::with_capacity(batch.len());
            for (i, elimination) in batch.iter().enumerate() {
                let groups = layout.groups_of(first + i);
                let own = (skip(&mut local_rest, l * l), skip(&mut rest, groups.len() * rows));
                work.push((elimination, groups.start, own.0, own.1));
            }
            pool.install(|| {
                work.into_par_iter().with_min_len(32).for_each_init(
                    Others::default,
                    |others, (elimination, first_group, local, equations)| {
                        arch.dispatch(|| {
                            others.gather(self, elimination, inverse);
                            for_local_dim!(l, L => {
                                others.cofactors::<L>(self, elimination, first_group, local, equations);
                            });
                        });
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
            let with_border = (0..layout.kept()).filter_map(|block| inverse.block(block, layout.kept()));
            result.kept_border = with_border.flatten().collect();
        }
        ControlFlow::Continue(result)
    }
}

/// Everything that one local block is tied to: its kept blocks in the order of its slots, then the border.
#[derive(Default)]
struct Others {
    positions: Vec<usize>,
    /// Where each of them starts; one more at the end, the width.
    start: Vec<usize>,
    /// The inverse over them, full square.
    inverse: Vec<f64>,
    /// H = N_ll^-1 N_lo, row by row.
    h: Vec<f64>,
    /// H times the inverse, row by row.
    hq: Vec<f64>,
}

impl Others {
    /// Collects the inverse over everything that a local block is tied to.
    #[inline(always)]
    fn gather(&mut self, system: &System, e: &Elimination, inverse: &SelectedInverse) {
        let border = system.layout.border_dim();
        self.positions.clear();
        self.start.clear();
        let mut width = 0;
        for slot in &e.slots {
            self.positions.push(slot.position);
            self.start.push(width);
            width += slot.dim;
        }
        if border > 0 {
            self.positions.push(system.symbolic.blocks() - 1);
            self.start.push(width);
            width += border;
        }
        self.start.push(width);
        self.inverse.resize(width * width, 0.0);
        inverse.gather(&self.positions, &self.start, &mut self.inverse);
    }

    fn width(&self) -> usize {
        self.start[self.positions.len()]
    }

    /// With H = N_ll^-1 N_lo and Q_oo the inverse over the others o: Q_ll = N_ll^-1 + H Q_oo H^T, Q_lo = -H Q_oo, and
    /// a Q a^T for each equation.
    #[inline(always)]
    fn cofactors<const L: usize>(
        &mut self,
        system: &System,
        e: &Elimination,
        first_group: usize,
        local: &mut [f64],
        equations: &mut [f64],
    ) {
        self.multiply::<L>(system, e);
        let width = self.width();
        let mut own = [[0.0; L]; L];
        for a in 0..L {
            let mut unit = [0.0; L];
            unit[a] = 1.0;
            e.triangle.forward::<L>(&mut unit, 1);
            e.triangle.backward::<L>(&mut unit, 1);
            for b in 0..=a {
                let value = unit[b] + dot(&self.hq[a * width..][..width], &self.h[b * width..][..width]);
                (own[a][b], own[b][a]) = (value, value);
            }
        }
        local.copy_from_slice(own.as_flattened());
        let rows = system.layout.rows();
        let border = width - system.layout.border_dim();
        for (slot, &start) in e.slots.iter().zip(&self.start) {
            for place in &e.groups[slot.first..slot.end] {
                for row in 0..rows {
                    let a = &e.local_rows[place.local + row * L..][..L];
                    let kept = (start, &e.kept_rows[place.kept + row * slot.dim..][..slot.dim]);
                    let common =
                        &e.border_rows[place.border + row * place.border_width..][..place.border_width];
                    let common = (border + place.border_first, common);
                    let mut q = self.product(kept, kept) + self.product(common, common);
                    q += 2.0 * self.product(kept, common);
                    for d in 0..L {
                        let hq = &self.hq[d * width..][..width];
                        let tied = dot(&hq[kept.0..], kept.1) + dot(&hq[common.0..], common.1);
                        q += a[d] * (dot(&own[d], a) - 2.0 * tied);
                    }
                    equations[(place.group - first_group) * rows + row] = q;
                }
            }
        }
    }

    /// Computes H = L^-T V and its product with the inverse.
    #[inline(always)]
    fn multiply<const L: usize>(&mut self, system: &System, e: &Elimination) {
        let (width, border) = (self.width(), system.layout.border_dim());
        self.h.resize(L * width, 0.0);
        for d in 0..L {
            let row = &mut self.h[d * width..][..width];
            for (slot, &start) in e.slots.iter().zip(&self.start) {
                row[start..][..slot.dim]
                    .copy_from_slice(&e.coupling[slot.coupling + d * slot.dim..][..slot.dim]);
            }
            row[width - border..].copy_from_slice(&e.border_coupling[d * border..][..border]);
        }
        e.triangle.backward::<L>(&mut self.h, width);
        self.hq.clear();
        self.hq.resize(L * width, 0.0);
        for d in 0..L {
            let sums = &mut self.hq[d * width..][..width];
            for (value, row) in
                self.h[d * width..][..width].iter().zip(self.inverse.chunks_exact(width.max(1)))
            {
                sums.iter_mut().zip(row).for_each(|(sum, q)| *sum += value * q);
            }
        }
    }

    /// x Q y^T for two vectors that are zero but for the given elements from the given places on.
    #[inline(always)]
    fn product(&self, x: (usize, &[f64]), y: (usize, &[f64])) -> f64 {
        let width = self.width();
        let row = |i: usize| &self.inverse[(x.0 + i) * width + y.0..][..y.1.len()];
        x.1.iter().enumerate().map(|(i, value)| value * dot(row(i), y.1)).sum()
    }
}
