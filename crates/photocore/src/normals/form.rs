//! Formation of the normal equations with the local blocks reduced out on the way.

use std::ops::ControlFlow;
use std::sync::Arc;

use pulp::Arch;
use rayon::ThreadPool;
use rayon::prelude::*;

use super::elimination::{Elimination, Equations, LocalPrior, Slot};
use super::floors::skip;
use super::panels::Panels;
use super::system::{Between, Prior, System};

/// The reduced normal equations.
#[derive(Debug)]
pub struct Normals {
    pub(crate) panels: Panels,
    pub(crate) right: Vec<f64>,
    pub(crate) diagonal: Vec<f64>,
    /// Sum of squares of the right-hand sides of all equations (priors not counted).
    pub sum_of_squares: f64,
    /// Sum of |v|^2 = |L^-1 n|^2 over the local blocks: their part of the decrease that a full step predicts.
    pub local_decrease: f64,
    /// Local blocks that their equations do not determine.
    pub deficient_locals: Vec<usize>,
}

impl System {
    /// Forms the reduced normal equations. The result has the same bits for any number of threads: every value is
    /// summed by one thread, in the order of the local blocks.
    pub fn form<E: Equations>(
        &self,
        pool: &ThreadPool,
        equations: &E,
        prior: &Prior,
        damping: f64,
        between: Between<'_>,
    ) -> ControlFlow<(), Normals> {
        let symbolic = &self.symbolic;
        let mut normals = Normals {
            panels: Panels::zeros(Arc::clone(symbolic)),
            right: vec![0.0; symbolic.unknowns()],
            diagonal: vec![0.0; symbolic.unknowns()],
            sum_of_squares: 0.0,
            local_decrease: 0.0,
            deficient_locals: Vec::new(),
        };
        let eliminate =
            |e: &mut Elimination, prior: LocalPrior<'_>| e.eliminate(&self.layout, prior, damping);
        let formed = self.for_locals(pool, equations, prior, between, eliminate, |first, batch| {
            for (i, elimination) in batch.iter().enumerate() {
                normals.sum_of_squares += elimination.sum_of_squares;
                normals.local_decrease += elimination.reduced.iter().map(|v| v * v).sum::<f64>();
                if elimination.deficient {
                    normals.deficient_locals.push(first + i);
                }
            }
            self.accumulate(pool, batch, &mut normals);
        });
        match formed {
            ControlFlow::Break(()) => ControlFlow::Break(()),
            ControlFlow::Continue(()) => {
                self.add_prior(&mut normals, prior, damping);
                ControlFlow::Continue(normals)
            }
        }
    }

    /// Adds a batch to the normal equations. Each supernode belongs to one task, which walks the whole batch in order.
    fn accumulate(&self, pool: &ThreadPool, batch: &[Elimination], normals: &mut Normals) {
        let tasks = pool.current_num_threads();
        let mut owned: Vec<Vec<Option<Columns<'_>>>> = (0..tasks).map(|_| Vec::new()).collect();
        let mut panels = &mut normals.panels.values[..];
        let mut right = &mut normals.right[..];
        let mut diagonal = &mut normals.diagonal[..];
        for (index, supernode) in self.symbolic.supernodes().iter().enumerate() {
            let columns = Columns {
                panel: skip(&mut panels, supernode.panel.len()),
                right: skip(&mut right, supernode.width),
                diagonal: skip(&mut diagonal, supernode.width),
            };
            let mut columns = Some(columns);
            for (task, list) in owned.iter_mut().enumerate() {
                list.push(if index % tasks == task { columns.take() } else { None });
            }
        }
        let arch = Arch::new();
        let accumulate = |columns: &mut Vec<Option<Columns<'_>>>| {
            arch.dispatch(|| {
                for elimination in batch {
                    self.add_elimination(elimination, columns);
                }
            });
        };
        if tasks == 1 {
            owned.iter_mut().for_each(accumulate);
        } else {
            pool.install(|| owned.par_iter_mut().for_each(accumulate));
        }
    }

    /// Adds what one eliminated local block leaves to the columns that a task owns.
    #[inline(always)]
    fn add_elimination(&self, e: &Elimination, columns: &mut [Option<Columns<'_>>]) {
        let symbolic = &*self.symbolic;
        let l = self.layout.local_dim();
        for (index, slot) in e.slots.iter().enumerate() {
            let supernode = symbolic.supernode_of(slot.position);
            let Some(target) = &mut columns[supernode] else { continue };
            let height = symbolic.supernodes()[supernode].height();
            let first = symbolic.range(slot.position).start - symbolic.first_unknown(supernode);
            let v = &e.coupling[slot.coupling..][..l * slot.dim];
            target.add_own_block(e, slot, self.layout.rows(), height, first);
            subtract(&mut target.panel[first * height + first..], height, v, slot.dim, v, slot.dim, l);
            for column in 0..slot.dim {
                for d in 0..l {
                    target.right[first + column] -= v[d * slot.dim + column] * e.reduced[d];
                }
            }
            for other in &e.slots[index + 1..] {
                // Every pair that shares a local block is in the pattern.
                let Some(row) = symbolic.panel_row(supernode, other.position) else { continue };
                let w = &e.coupling[other.coupling..][..l * other.dim];
                subtract(&mut target.panel[first * height + row..], height, w, other.dim, v, slot.dim, l);
            }
            let border = self.layout.border_dim();
            if border > 0 {
                let row = height - border;
                let block = &mut target.panel[first * height + row..];
                for place in e.groups[slot.first..slot.end].iter().filter(|place| place.border_width > 0) {
                    let common = &e.border_rows[place.border..][..self.layout.rows() * place.border_width];
                    let kept = &e.kept_rows[place.kept..][..self.layout.rows() * slot.dim];
                    add(&mut block[place.border_first..], height, common, place.border_width, kept, slot.dim);
                }
                subtract(block, height, &e.border_coupling, border, v, slot.dim, l);
            }
        }
        if self.layout.border_dim() > 0 {
            let supernode = symbolic.supernode_count() - 1;
            if let Some(target) = &mut columns[supernode] {
                target.add_border(e, self.layout.rows(), self.layout.border_dim(), l);
            }
        }
    }

    /// Adds the priors and the damping of the kept blocks and the border.
    fn add_prior(&self, normals: &mut Normals, prior: &Prior, damping: f64) {
        let symbolic = &*self.symbolic;
        for position in 0..symbolic.blocks() {
            let unknowns = symbolic.unknowns_at(&self.layout, position);
            let supernode = symbolic.supernode_of(position);
            let s = &symbolic.supernodes()[supernode];
            for (unknown, i) in unknowns.zip(symbolic.range(position)) {
                normals.diagonal[i] += prior.weight[unknown];
                normals.right[i] += prior.right[unknown];
                let column = i - symbolic.first_unknown(supernode);
                normals.panels.values[s.panel.start + column * (s.height() + 1)] +=
                    prior.weight[unknown] + damping * normals.diagonal[i];
                normals.diagonal[i] *= 1.0 + damping;
            }
        }
    }
}

/// The columns of one supernode: its panel, its part of the right-hand side and of the diagonal before reduction.
struct Columns<'a> {
    panel: &'a mut [f64],
    right: &'a mut [f64],
    diagonal: &'a mut [f64],
}

impl Columns<'_> {
    /// Adds A^T A and A^T l of the groups of a slot, A being the coefficients of its kept block.
    #[inline(always)]
    fn add_own_block(&mut self, e: &Elimination, slot: &Slot, rows: usize, height: usize, first: usize) {
        for place in &e.groups[slot.first..slot.end] {
            let kept = &e.kept_rows[place.kept..][..rows * slot.dim];
            add(&mut self.panel[first * height + first..], height, kept, slot.dim, kept, slot.dim);
            for (row, constant) in kept.chunks_exact(slot.dim).zip(&e.constants[place.constant..]) {
                for (column, value) in row.iter().enumerate() {
                    self.right[first + column] += value * constant;
                    self.diagonal[first + column] += value * value;
                }
            }
        }
    }

    /// Adds the part of a local block to the border's own block.
    fn add_border(&mut self, e: &Elimination, rows: usize, border: usize, l: usize) {
        for place in e.groups.iter().filter(|place| place.border_width > 0) {
            let (first, width) = (place.border_first, place.border_width);
            let common = &e.border_rows[place.border..][..rows * width];
            add(&mut self.panel[first * border + first..], border, common, width, common, width);
            for (row, constant) in common.chunks_exact(width).zip(&e.constants[place.constant..]) {
                for (column, value) in row.iter().enumerate() {
                    self.right[first + column] += value * constant;
                    self.diagonal[first + column] += value * value;
                }
            }
        }
        subtract(self.panel, border, &e.border_coupling, border, &e.border_coupling, border, l);
        for d in 0..l {
            for (right, value) in self.right.iter_mut().zip(&e.border_coupling[d * border..][..border]) {
                *right -= value * e.reduced[d];
            }
        }
    }
}

/// target[i, j] += sum over rows of a[row][i] b[row][j]; the target is column by column with the given stride.
#[inline(always)]
fn add(target: &mut [f64], stride: usize, a: &[f64], na: usize, b: &[f64], nb: usize) {
    match (na, nb) {
        (6, 6) => add_sized(target, stride, a, 6, b, 6),
        _ => add_sized(target, stride, a, na, b, nb),
    }
}

#[inline(always)]
fn add_sized(target: &mut [f64], stride: usize, a: &[f64], na: usize, b: &[f64], nb: usize) {
    for (row_a, row_b) in a.chunks_exact(na).zip(b.chunks_exact(nb)) {
        for (j, value) in row_b.iter().enumerate() {
            for (sum, x) in target[j * stride..][..na].iter_mut().zip(row_a) {
                *sum += x * value;
            }
        }
    }
}

/// target[i, j] -= sum over d of a[d][i] b[d][j]: the 108 multiply-adds of each pair of photographs that share a point.
#[inline(always)]
fn subtract(target: &mut [f64], stride: usize, a: &[f64], na: usize, b: &[f64], nb: usize, depth: usize) {
    // The common sizes are compiled for themselves: constant bounds let the compiler unroll and vectorise.
    match (depth, na, nb) {
        (3, 6, 6) => subtract_sized(target, stride, a, 6, b, 6, 3),
        _ => subtract_sized(target, stride, a, na, b, nb, depth),
    }
}

#[inline(always)]
fn subtract_sized(
    target: &mut [f64],
    stride: usize,
    a: &[f64],
    na: usize,
    b: &[f64],
    nb: usize,
    depth: usize,
) {
    let (a, b) = (&a[..depth * na], &b[..depth * nb]);
    for j in 0..nb {
        let column = &mut target[j * stride..][..na];
        for d in 0..depth {
            let value = b[d * nb + j];
            for i in 0..na {
                column[i] -= a[d * na + i] * value;
            }
        }
    }
}
