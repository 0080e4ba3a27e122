//! Cofactors of every unknown and of every adjusted equation, from the selected inverse.

use std::time::Instant;

use pulp::Simd;
use rayon::prelude::*;
use smallvec::{SmallVec, smallvec};

use super::equations::{Equations, Prior};
use super::further::Known;
use super::incidence::Stacks;
use super::layout::Layout;
use super::selected::SelectedInverse;
use super::stack::{Part, Slot, Stack};
use super::system::System;
use super::tie_equations::TieEquations;
use super::vectorised::{Kernel, LANES, Rows, Side, copy_vectors, dot, dot_in_lanes, run, size};
use super::watch::Control;
use super::workspace::zeros;

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
    /// a Q a^T of each equation a x = l, in the order of groups and rows, then of ties and rows: the share of the equation that its own
    /// unknowns take up. One minus it is the redundancy number of an observation.
    pub equations: Vec<f64>,
    /// a Q a^T of the equations a of each tie, a square block row by row, one after the other.
    pub ties: Vec<f64>,
    /// Of the pairs of kept blocks that were asked for, one after the other; NaN where no equations touch both.
    pub pairs: Vec<f64>,
    /// What the equations of each group have to do with each other, where that was asked for.
    pub groups: Option<GroupCofactors>,
    /// Diagonal of the normal equations of the unknowns of all kept blocks before any elimination, priors counted: the reciprocal cofactor
    /// that each would have if all other unknowns were known.
    pub information: Vec<f64>,
}

/// What the equations a of each group have to do with each other. All blocks are square, row by row, one after the other.
#[derive(Debug, Clone)]
pub struct GroupCofactors {
    /// a Q a^T of every two equations of a group. The identity minus it is the cofactor matrix of residuals of unit weight.
    pub shares: Vec<f64>,
    /// The same with all unknowns known but those of the local block.
    pub by_local: Vec<f64>,
    /// Of each local block, all others being known.
    pub alone: Vec<f64>,
}

impl Cofactors {
    /// Puts together what was found at each supernode, and last for the local blocks without equations, with the information; None
    /// without memory.
    pub(super) fn collect(
        system: &System,
        control: &Control,
        inverse: &SelectedInverse,
        found: &[AtHome],
        information: Vec<f64>,
    ) -> Option<Self> {
        let layout = &system.layout;
        let (rows, l) = (layout.rows(), layout.local_dim());
        let mut local = control.allocated(zeros(layout.locals() * l * l))?;
        let mut equations = control.allocated(zeros(layout.equations()))?;
        let (of_groups, of_ties) = equations.split_at_mut(layout.groups() * rows);
        let mut ties = control.allocated(zeros(layout.tie_blocks().end))?;
        for (index, at_home) in found.iter().enumerate() {
            let mut values = at_home.equations.chunks_exact(rows.max(1));
            let blocks = at_home.local.chunks_exact(l * l);
            for (&block, cofactors) in system.incidence.locals_at(index).iter().zip(blocks) {
                local[block as usize * l * l..][..l * l].copy_from_slice(cofactors);
                for (&group, values) in
                    system.incidence.groups_of(layout, block as usize).iter().zip(&mut values)
                {
                    of_groups[group as usize * rows..][..rows].copy_from_slice(values);
                }
            }
            let mut values = &at_home.ties[..];
            for &tie in system.ties.at(index) {
                let (tie, rows) = (tie as usize, layout.ties()[tie as usize].rows);
                let (own, rest) = values.split_at(rows * rows);
                ties[layout.tie_block(tie)].copy_from_slice(own);
                let diagonal = own.iter().step_by(rows + 1);
                of_ties[layout.tie_rows(tie)].iter_mut().zip(diagonal).for_each(|(to, &share)| *to = share);
                values = rest;
            }
        }
        let blocks = 0..layout.kept();
        let kept = blocks.clone().filter_map(|block| inverse.block(block, block)).flatten().collect();
        let pair = |pair: &[u32; 2]| {
            let [row, column] = pair.map(|block| block as usize);
            let size = layout.kept_dim(row) * layout.kept_dim(column);
            inverse.block(row, column).unwrap_or_else(|| vec![f64::NAN; size])
        };
        let pairs = layout.pairs().iter().flat_map(pair).collect();
        let (mut border, mut kept_border) = (Vec::new(), Vec::new());
        if layout.border_dim() > 0 {
            border = inverse.block(layout.kept(), layout.kept()).unwrap_or_default();
            kept_border = blocks.filter_map(|block| inverse.block(block, layout.kept())).flatten().collect();
        }
        Some(Self { local, kept, border, kept_border, equations, ties, pairs, groups: None, information })
    }
}

impl GroupCofactors {
    /// Puts together what was found at each supernode, and last for the local blocks without equations; None without memory.
    pub(super) fn collect(system: &System, control: &Control, found: &[AtHome]) -> Option<Self> {
        let layout = &system.layout;
        let (size, l) = (layout.rows() * layout.rows(), layout.local_dim());
        let mut shares = control.allocated(zeros(layout.groups() * size))?;
        let mut by_local = control.allocated(zeros(layout.groups() * size))?;
        let mut alone = control.allocated(zeros(layout.locals() * l * l))?;
        for (index, at_home) in found.iter().enumerate() {
            let blocks = at_home.alone.chunks_exact(l * l);
            let mut pairs = at_home.shares.chunks_exact(size).zip(at_home.by_local.chunks_exact(size));
            for (&block, own) in system.incidence.locals_at(index).iter().zip(blocks) {
                alone[block as usize * l * l..][..l * l].copy_from_slice(own);
                for (&group, (together, own)) in
                    system.incidence.groups_of(layout, block as usize).iter().zip(&mut pairs)
                {
                    shares[group as usize * size..][..size].copy_from_slice(together);
                    by_local[group as usize * size..][..size].copy_from_slice(own);
                }
            }
        }
        Some(Self { shares, by_local, alone })
    }
}

/// The cofactors of the local blocks at home in one supernode, and of their equations, in the order of the incidence.
#[derive(Default)]
pub(super) struct AtHome {
    local: Vec<f64>,
    equations: Vec<f64>,
    /// Of the equations of the ties at home there, in their order: a square block for each.
    ties: Vec<f64>,
    /// See [`GroupCofactors`]; in the order of the incidence too, empty where they are not asked for.
    shares: Vec<f64>,
    by_local: Vec<f64>,
    alone: Vec<f64>,
    /// Solutions for further right-hand sides, stack by stack.
    pub further: Vec<Side>,
    /// Time that it took.
    pub seconds: f64,
}

/// Local blocks at one supernode from which on several threads work at them.
const MANY: usize = 256;

impl AtHome {
    /// `front` is the inverse over the rows of the front of the supernode, full square, of the order `height`.
    pub fn new<E: Equations>(
        system: &System,
        index: usize,
        equations: &E,
        prior: &Prior,
        known: &Known<'_>,
        control: &Control,
        front: &[f64],
        height: usize,
        by_group: bool,
    ) -> Self {
        let start = Instant::now();
        let layout = &system.layout;
        let stacks = system.incidence.stacks_at(index);
        let room = || (Stack::default(), Others { by_group, ..Others::default() });
        let part = |(stack, others): &mut (Stack, Others), stacks: Stacks<'_>| {
            let mut part = Self::default();
            for run in stacks.iter().take_while(|_| !control.stopped()) {
                stack.gather(system, equations, run);
                stack.eliminate(layout, prior, 0.0);
                others.gather(stack, front, height);
                others.cofactors(stack, layout, &mut part);
                known.solve(system, stack, &mut part.further);
                control.count(run.len());
            }
            part
        };
        let mut found = if stacks.locals() < MANY {
            part(&mut room(), stacks)
        } else {
            let parts: Vec<Self> = stacks.parts(MANY / 16).into_par_iter().map_init(room, part).collect();
            parts.into_iter().fold(Self::default(), |mut all, part| {
                all.local.extend(part.local);
                all.equations.extend(part.equations);
                all.shares.extend(part.shares);
                all.by_local.extend(part.by_local);
                all.alone.extend(part.alone);
                all.further.extend(part.further);
                all
            })
        };
        found.ties = ties_at_home(system, index, equations, front, height);
        found.seconds = start.elapsed().as_secs_f64();
        found
    }
}

/// a Q a^T of the equations of the ties at home in a supernode, a square block for each.
fn ties_at_home<E: Equations>(
    system: &System,
    index: usize,
    equations: &E,
    front: &[f64],
    height: usize,
) -> Vec<f64> {
    let (mut tie, mut found) = (TieEquations::default(), Vec::new());
    for &each in system.ties.at(index) {
        tie.gather(system, equations, index, each as usize);
        let columns = tie.columns();
        for (own, _) in tie.rows() {
            // a Q, the columns of the tie.
            let by_column = |&column: &usize| {
                columns.iter().zip(own).map(|(&row, value)| front[column * height + row] * value).sum::<f64>()
            };
            let product: Vec<f64> = columns.iter().map(by_column).collect();
            found.extend(tie.rows().map(|(other, _)| dot(&product, other)));
        }
    }
    found
}

/// Everything that the local blocks of a stack are tied to: main blocks in the order of the slots, then segments.
#[derive(Default)]
struct Others {
    /// The first row in the front, the first row here and the width of each.
    strips: Vec<(usize, usize, usize)>,
    width: usize,
    /// Q, the inverse over them, full square.
    inverse: Vec<f64>,
    /// H = N_ll^-1 N_lo, row by row.
    h: Vec<f64>,
    /// H Q, row by row.
    hq: Vec<f64>,
    /// Whether to find [`GroupCofactors`] besides.
    by_group: bool,
}

impl Others {
    /// Collects the inverse over everything that a stack is tied to; it stays as it is where the last stack was tied to the same.
    fn gather(&mut self, stack: &Stack, front: &[f64], height: usize) {
        let slots = stack.slots.iter().map(|slot| (slot.row, slot.dim));
        let segments = stack.segments.iter().map(|segment| (segment.row, segment.unknowns.len()));
        let all = slots.chain(segments);
        if self.strips.iter().map(|&(row, _, width)| (row, width)).eq(all.clone()) {
            return;
        }
        self.strips.clear();
        self.width = 0;
        for (row, width) in all {
            self.strips.push((row, self.width, width));
            self.width += width;
        }
        // Products read beyond the end.
        self.inverse.resize(self.width * self.width + LANES, 0.0);
        for &(from_column, to_column, columns) in &self.strips {
            for k in 0..columns {
                let source = &front[(from_column + k) * height..][..height];
                let target = &mut self.inverse[(to_column + k) * self.width..][..self.width];
                for &(from_row, to_row, rows) in &self.strips {
                    target[to_row..to_row + rows].copy_from_slice(&source[from_row..from_row + rows]);
                }
            }
        }
    }

    /// With H = N_ll^-1 N_lo and Q_oo the inverse over the others o: Q_ll = N_ll^-1 + H Q_oo H^T, Q_lo = -H Q_oo, and
    /// a Q a^T for each equation.
    fn cofactors(&mut self, stack: &Stack, layout: &Layout, found: &mut AtHome) {
        run(layout, stack.kept_dim(), Find { others: self, stack, rows: layout.rows(), found });
    }

    #[inline(always)]
    fn cofactors_of<S: Simd, const R: usize, const L: usize, const D: usize>(
        &mut self,
        simd: S,
        stack: &Stack,
        t: usize,
        rows: usize,
        found: &mut AtHome,
    ) {
        self.multiply::<S, L, D>(simd, stack, t);
        let width = self.width;
        let mut own = [[0.0; L]; L];
        for a in 0..L {
            let mut unit = [0.0; L];
            unit[a] = 1.0;
            stack.triangles[t].forward::<L>(&mut unit, 1);
            stack.triangles[t].backward::<L>(&mut unit, 1);
            if self.by_group {
                found.alone.extend_from_slice(&unit);
            }
            for b in 0..=a {
                let value =
                    unit[b] + dot_in_lanes(&self.hq[a * width..][..width], &self.h[b * width..][..width]);
                (own[a][b], own[b][a]) = (value, value);
            }
        }
        found.local.extend_from_slice(own.as_flattened());
        for (slot, &(_, start, _)) in stack.slots.iter().zip(&self.strips) {
            for (k, p) in slot.groups.clone().enumerate() {
                for row in 0..size::<R>(rows) {
                    found.equations.push(self.equation::<S, R, L, D>(
                        simd,
                        stack,
                        slot,
                        start,
                        (t, k, p, row),
                        rows,
                        &own,
                    ));
                }
                if self.by_group {
                    self.group::<S, R, L, D>(simd, stack, slot, start, (t, k, p), rows, &own, found);
                }
            }
        }
    }

    /// The blocks of [`GroupCofactors`] of group `k` of a slot, `p` of the pattern, for local block `t` of the stack, whose own equations
    /// were the last that were found.
    #[inline(always)]
    fn group<S: Simd, const R: usize, const L: usize, const D: usize>(
        &self,
        simd: S,
        stack: &Stack,
        slot: &Slot,
        start: usize,
        (t, k, p): (usize, usize, usize),
        rows: usize,
        own: &[[f64; L]; L],
        found: &mut AtHome,
    ) {
        let rows = size::<R>(rows);
        let local = stack.local_rows::<L>(t, p, rows);
        let (diagonal, first) = (found.equations.len() - rows, found.shares.len());
        let along: SmallVec<[[f64; L]; 4]> = local[..rows]
            .iter()
            .map(|&(mut row)| {
                stack.triangles[t].forward::<L>(&mut row, 1);
                row
            })
            .collect();
        found.by_local.resize(first + rows * rows, 0.0);
        found.shares.resize(first + rows * rows, 0.0);
        for i in 0..rows {
            for j in 0..=i {
                let share = match i == j {
                    true => found.equations[diagonal + i],
                    false => {
                        self.between::<S, R, L, D>(simd, stack, slot, start, (t, k, p), (i, j), rows, own)
                    }
                };
                for at in [first + i * rows + j, first + j * rows + i] {
                    found.by_local[at] = dot(&along[i], &along[j]);
                    found.shares[at] = share;
                }
            }
        }
    }

    /// a Q b^T of two rows of a group.
    #[inline(always)]
    fn between<S: Simd, const R: usize, const L: usize, const D: usize>(
        &self,
        simd: S,
        stack: &Stack,
        slot: &Slot,
        start: usize,
        (t, k, p): (usize, usize, usize),
        pair: (usize, usize),
        rows: usize,
        own: &[[f64; L]; L],
    ) -> f64 {
        let (rows, dim) = (size::<R>(rows), size::<D>(slot.dim));
        let coefficients = &stack.slot_rows::<D>(slot, rows).rows.values;
        let kept = |row: usize| {
            let at = (t * slot.groups.len() + k) * rows + row;
            (start, &coefficients[at * dim..][..dim])
        };
        let common =
            |row: usize| stack.parts(p).iter().map(move |part| self.common(stack, (t, p, row), rows, part));
        let of = |row: usize| std::iter::once(kept(row)).chain(common(row));
        let (a, b) = (&stack.local_rows::<L>(t, p, rows)[pair.0], &stack.local_rows::<L>(t, p, rows)[pair.1]);
        let mut q = (0..L).map(|d| a[d] * dot(&own[d], b)).sum::<f64>();
        if stack.parts(p).is_empty() {
            return q + self.tied_pair::<S, L>(simd, (a, kept(pair.0).1), (b, kept(pair.1).1), start);
        }
        for (from, to, local) in [(pair.0, None, b), (pair.1, Some(pair.0), a)] {
            for (first, values) in of(from) {
                for d in 0..L {
                    q -= local[d] * dot(&self.hq[d * self.width + first..][..values.len()], values);
                }
                if let Some(to) = to {
                    q += of(to).map(|other| self.product((first, values), other)).sum::<f64>();
                }
            }
        }
        q
    }

    /// a Q a^T of one row of group `k` of a slot, `p` of the pattern, for local block `t` of the stack.
    #[inline(always)]
    fn equation<S: Simd, const R: usize, const L: usize, const D: usize>(
        &self,
        simd: S,
        stack: &Stack,
        slot: &Slot,
        start: usize,
        (t, k, p, row): (usize, usize, usize, usize),
        rows: usize,
        own: &[[f64; L]; L],
    ) -> f64 {
        let (rows, dim) = (size::<R>(rows), size::<D>(slot.dim));
        let a = &stack.local_rows::<L>(t, p, rows)[row];
        let at = (t * slot.groups.len() + k) * rows + row;
        let kept = (start, &stack.slot_rows::<D>(slot, rows).rows.values[at * dim..][..dim]);
        let mut q: f64 = (0..L).map(|d| a[d] * dot(&own[d], a)).sum();
        q += self.tied::<S, L>(simd, a, &[], kept);
        if !stack.parts(p).is_empty() {
            let mut strips: SmallVec<[_; 4]> = smallvec![kept];
            for part in stack.parts(p) {
                let common = self.common(stack, (t, p, row), rows, part);
                q += self.tied::<S, L>(simd, a, &strips, common);
                strips.push(common);
            }
        }
        q
    }

    /// What coefficients x of other unknowns, from a place on, add to a Q a^T: (x Q + 2 y Q - 2 a_l H Q) x^T, y those that were added
    /// before.
    #[inline(always)]
    fn tied<S: Simd, const L: usize>(
        &self,
        simd: S,
        a: &[f64; L],
        before: &[(usize, &[f64])],
        (start, x): (usize, &[f64]),
    ) -> f64 {
        let mut q = 0.0;
        for first in (0..x.len()).step_by(LANES) {
            let column = start + first;
            let mut sums = [simd.splat_f64s(0.0); LANES];
            let mut add = |from: &[f64], factor: f64| {
                let vectors = S::as_simd_f64s(&from[..LANES]).0;
                let factor = simd.splat_f64s(factor);
                for k in 0..LANES / S::F64_LANES {
                    sums[k] = simd.mul_add_f64s(vectors[k], factor, sums[k]);
                }
            };
            for d in 0..L {
                add(&self.hq[d * self.width + column..], -2.0 * a[d]);
            }
            for &(other, y) in before {
                for (i, value) in y.iter().enumerate() {
                    add(&self.inverse[(other + i) * self.width + column..], 2.0 * value);
                }
            }
            for (i, value) in x.iter().enumerate() {
                add(&self.inverse[(start + i) * self.width + column..], *value);
            }
            let mut values = [0.0; LANES];
            copy_vectors::<S>(simd, &sums, &mut values);
            q += dot(&values, &x[first..]);
        }
        q
    }

    /// What coefficients x and y of the same other unknowns, from a place on, add to a Q b^T of two equations, a and b those of the local
    /// block: (x Q - a H Q) y^T - b H Q x^T.
    #[inline(always)]
    fn tied_pair<S: Simd, const L: usize>(
        &self,
        simd: S,
        (a, x): (&[f64; L], &[f64]),
        (b, y): (&[f64; L], &[f64]),
        start: usize,
    ) -> f64 {
        let mut q = 0.0;
        for first in (0..x.len()).step_by(LANES) {
            let column = start + first;
            let mut along = [[simd.splat_f64s(0.0); LANES]; 2];
            let mut add = |to: usize, from: &[f64], factor: f64| {
                let vectors = S::as_simd_f64s(&from[..LANES]).0;
                let factor = simd.splat_f64s(factor);
                for k in 0..LANES / S::F64_LANES {
                    along[to][k] = simd.mul_add_f64s(vectors[k], factor, along[to][k]);
                }
            };
            for d in 0..L {
                let hq = &self.hq[d * self.width + column..];
                add(0, hq, -a[d]);
                add(1, hq, -b[d]);
            }
            for (i, value) in x.iter().enumerate() {
                add(0, &self.inverse[(start + i) * self.width + column..], *value);
            }
            for (sums, other) in along.iter().zip([y, x]) {
                let mut values = [0.0; LANES];
                copy_vectors::<S>(simd, sums, &mut values);
                q += dot(&values, &other[first..]);
            }
        }
        q
    }

    /// Where a part of what group `p` of the pattern has in common with others stands here, and its coefficients in one row, for local
    /// block `t` of the stack.
    #[inline(always)]
    fn common<'s>(
        &self,
        stack: &'s Stack,
        (t, p, row): (usize, usize, usize),
        rows: usize,
        part: &Part,
    ) -> (usize, &'s [f64]) {
        let equation = t * rows + row;
        let Rows { values, width, .. } = stack.part_rows(p, part, equation..equation + 1).rows;
        let start = self.strips[stack.slots.len() + part.segment].1 + part.shift;
        (start, &values[..width])
    }

    /// Computes H = L^-T V and its product with the inverse, for local block `t` of the stack.
    #[inline(always)]
    fn multiply<S: Simd, const L: usize, const D: usize>(&mut self, simd: S, stack: &Stack, t: usize) {
        let width = self.width;
        self.h.resize(L * width, 0.0);
        let slots = stack.slots.iter().map(|slot| stack.slot_coupling::<L, D>(slot));
        let segments = stack.segments.iter().map(|segment| stack.segment_coupling::<L>(segment));
        for (v, &(_, start, _)) in slots.chain(segments).zip(&self.strips) {
            for d in 0..L {
                let row = &v.rows.values[(t * L + d) * v.rows.width..][..v.rows.width];
                self.h[d * width + start..][..row.len()].copy_from_slice(row);
            }
        }
        stack.triangles[t].backward::<L>(&mut self.h, width);
        self.hq.resize(L * width + LANES, 0.0);
        for first in (0..width).step_by(LANES) {
            let mut sums = [[simd.splat_f64s(0.0); LANES]; L];
            for i in 0..width {
                let vectors = S::as_simd_f64s(&self.inverse[i * width + first..][..LANES]).0;
                for d in 0..L {
                    let factor = simd.splat_f64s(self.h[d * width + i]);
                    for k in 0..LANES / S::F64_LANES {
                        sums[d][k] = simd.mul_add_f64s(vectors[k], factor, sums[d][k]);
                    }
                }
            }
            let count = LANES.min(width - first);
            for d in 0..L {
                copy_vectors::<S>(simd, &sums[d], &mut self.hq[d * width + first..][..count]);
            }
        }
    }

    /// x Q y^T for two vectors that are zero but for the given elements from the given places on.
    #[inline(always)]
    fn product(&self, x: (usize, &[f64]), y: (usize, &[f64])) -> f64 {
        let row = |i: usize| &self.inverse[(x.0 + i) * self.width + y.0..][..y.1.len()];
        x.1.iter().enumerate().map(|(i, value)| value * dot(row(i), y.1)).sum()
    }
}

struct Find<'a> {
    others: &'a mut Others,
    stack: &'a Stack,
    rows: usize,
    found: &'a mut AtHome,
}

impl Kernel for Find<'_> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const L: usize, const D: usize>(self, simd: S) {
        for t in 0..self.stack.locals.len() {
            self.others.cofactors_of::<S, R, L, D>(simd, self.stack, t, self.rows, self.found);
        }
    }
}
