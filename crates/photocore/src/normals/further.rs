//! Further right-hand sides on their way through the local blocks, beside those that the equations have.

use std::ops::Range;

use pulp::Simd;

use super::incidence::Stacks;
use super::layout::Layout;
use super::stack::Stack;
use super::system::System;
use super::vectorised::{Kernel, LANES, run};
use super::workspace::reserved;

/// One row of so many right-hand sides: they go through the local blocks side by side.
pub(super) type Side = [f64; LANES];

/// Right-hand sides over all unknowns as blocks of [`LANES`].
pub(super) fn blocks_of(layout: &Layout, rights: &[f64]) -> usize {
    rights.len().div_ceil((LANES * layout.unknowns()).max(1))
}

/// Takes some sides, block by block for each unknown from `first` on, off right-hand sides of so many unknowns, one after the other.
pub(super) fn subtract_sides(rights: &mut [f64], first: usize, count: usize, sides: &[Side]) {
    let columns = rights.len() / count.max(1);
    let blocks = columns.div_ceil(LANES);
    for (column, right) in rights.chunks_exact_mut(count.max(1)).enumerate() {
        let own = sides.iter().skip(column / LANES).step_by(blocks);
        let rows = right[first..].iter_mut().zip(own);
        rows.for_each(|(value, side)| *value -= side[column % LANES]);
    }
}

/// What a stack takes off the right-hand sides of the others.
pub(super) struct Reduced {
    /// The first right-hand side.
    column: usize,
    /// The first of the coupled unknowns in the order of elimination.
    first: usize,
    values: Vec<Side>,
}

impl Reduced {
    /// Takes it off right-hand sides of so many unknowns, one after the other.
    pub fn subtract_from(&self, others: &mut [f64], count: usize) {
        for (k, others) in others.chunks_exact_mut(count.max(1)).skip(self.column).take(LANES).enumerate() {
            let target = &mut others[self.first..][..self.values.len()];
            target.iter_mut().zip(&self.values).for_each(|(right, value)| *right -= value[k]);
        }
    }
}

/// The parts of right-hand sides that belong to unknowns that are not local, in the order of elimination; the bytes that there are not.
pub(super) fn of_others(system: &System, rights: &[f64]) -> Result<Vec<f64>, usize> {
    let (layout, symbolic) = (&system.layout, &*system.symbolic);
    let unknowns = layout.unknowns().max(1);
    let mut others = reserved(symbolic.unknowns() * (rights.len() / unknowns))?;
    for right in rights.chunks_exact(unknowns) {
        for position in 0..symbolic.blocks() {
            others.extend_from_slice(&right[symbolic.unknowns_at(layout, position)]);
        }
    }
    Ok(others)
}

/// Computes what a stack that is eliminated takes off the right-hand sides of the others: N_ol N_ll^-1 r_l, with N_ll = L L^T and
/// V = L^-1 N_lo that is V^T L^-1 r_l.
pub(super) fn reduce(system: &System, stack: &Stack, rights: &[f64], found: &mut Vec<Reduced>) {
    if !rights.is_empty() {
        run(&system.layout, stack.kept_dim(), Reduce { system, stack, rights, found });
    }
}

/// Right-hand sides for whose other unknowns the equations are solved.
pub(super) struct Known<'a> {
    rights: &'a [f64],
    count: usize,
    /// The other unknowns in the order of elimination, [`LANES`] right-hand sides at a time.
    others: Vec<Vec<Side>>,
}

impl<'a> Known<'a> {
    /// `others` are solutions in the order of elimination, one after the other.
    pub fn new(system: &System, rights: &'a [f64], others: &[f64]) -> Self {
        let count = system.symbolic.unknowns();
        let sides = |columns: &[f64]| {
            let mut found = vec![[0.0; LANES]; count];
            for (k, column) in columns.chunks_exact(count.max(1)).enumerate() {
                found.iter_mut().zip(column).for_each(|(side, value)| side[k] = *value);
            }
            found
        };
        let columns = rights.len() / system.layout.unknowns().max(1);
        Self { rights, count: columns, others: others.chunks((LANES * count).max(1)).map(sides).collect() }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Solves the local blocks of a stack that is eliminated, x_l = L^-T (L^-1 r_l - V x_o): their rows, [`LANES`] right-hand sides at
    /// a time.
    pub fn solve(&self, system: &System, stack: &Stack, found: &mut Vec<Side>) {
        if !self.rights.is_empty() {
            let Self { rights, others, .. } = self;
            run(&system.layout, stack.kept_dim(), Solve { system, stack, rights, others, found });
        }
    }

    /// Hands out what was found of some stacks: the local block, the first right-hand side, the rows.
    pub fn hand_out<'f>(
        &self,
        layout: &Layout,
        stacks: Stacks<'_>,
        found: impl Iterator<Item = &'f Side>,
        mut each: impl FnMut(Range<usize>, usize, &[Side]),
    ) {
        let (mut found, mut rows) = (found, Vec::with_capacity(layout.local_dim()));
        for locals in stacks.iter() {
            for block in 0..self.others.len() {
                for &local in locals {
                    rows.clear();
                    rows.extend(found.by_ref().take(layout.local_dim()));
                    each(layout.local_range(local as usize), block * LANES, &rows);
                }
            }
        }
    }

    /// The other unknowns of a right-hand side in the order of elimination.
    pub fn others(&self, column: usize) -> impl Iterator<Item = f64> + '_ {
        self.others[column / LANES].iter().map(move |side| side[column % LANES])
    }
}

impl Stack {
    /// Computes L^-1 r of right-hand sides over all unknowns, [`LANES`] of them at a time.
    pub fn reduce(&mut self, layout: &Layout, rights: &[f64]) {
        self.sides.clear();
        if !rights.is_empty() {
            run(layout, self.kept_dim(), Sides { stack: self, layout, rights });
        }
    }

    /// L^-1 r of some right-hand sides over all unknowns, local block by local block.
    #[inline(always)]
    fn reduced<const L: usize>(&self, layout: &Layout, rights: &[f64], found: &mut Vec<Side>) {
        found.clear();
        for (t, &local) in self.locals.iter().enumerate() {
            let (mut own, start) = ([[0.0; LANES]; L], layout.local_range(local as usize).start);
            for (k, right) in rights.chunks_exact(layout.unknowns()).enumerate() {
                for d in 0..L {
                    own[d][k] = right[start + d];
                }
            }
            self.triangles[t].forward::<L>(own.as_flattened_mut(), LANES);
            found.extend_from_slice(&own);
        }
    }
}

struct Sides<'a> {
    stack: &'a mut Stack,
    layout: &'a Layout,
    rights: &'a [f64],
}

impl Kernel for Sides<'_> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const L: usize, const D: usize>(self, _: S) {
        let mut reduced = Vec::new();
        for rights in self.rights.chunks(LANES * self.layout.unknowns()) {
            self.stack.reduced::<L>(self.layout, rights, &mut reduced);
            self.stack.sides.extend_from_slice(&reduced);
        }
    }
}

struct Reduce<'a> {
    system: &'a System,
    stack: &'a Stack,
    rights: &'a [f64],
    found: &'a mut Vec<Reduced>,
}

impl Kernel for Reduce<'_> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const L: usize, const D: usize>(self, _: S) {
        let layout = &self.system.layout;
        let mut reduced = Vec::new();
        for (block, rights) in self.rights.chunks(LANES * layout.unknowns()).enumerate() {
            self.stack.reduced::<L>(layout, rights, &mut reduced);
            if reduced.as_flattened().iter().all(|&value| value == 0.0) {
                continue;
            }
            for (range, v) in self.stack.couplings::<L, D>(&self.system.symbolic) {
                let mut values = vec![[0.0; LANES]; range.len()];
                for (row, side) in v.values.chunks_exact(range.len().max(1)).zip(&reduced) {
                    for (sum, value) in values.iter_mut().zip(row) {
                        (0..LANES).for_each(|k| sum[k] += side[k] * value);
                    }
                }
                self.found.push(Reduced { column: block * LANES, first: range.start, values });
            }
        }
    }
}

struct Solve<'a> {
    system: &'a System,
    stack: &'a Stack,
    rights: &'a [f64],
    others: &'a [Vec<Side>],
    found: &'a mut Vec<Side>,
}

impl Kernel for Solve<'_> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const L: usize, const D: usize>(self, _: S) {
        let layout = &self.system.layout;
        let mut reduced = Vec::new();
        for (others, rights) in self.others.iter().zip(self.rights.chunks(LANES * layout.unknowns())) {
            self.stack.reduced::<L>(layout, rights, &mut reduced);
            for (coupled, v) in self.stack.couplings::<L, D>(&self.system.symbolic) {
                let x = &others[coupled];
                for (own, row) in reduced.iter_mut().zip(v.values.chunks_exact(x.len().max(1))) {
                    for (side, value) in x.iter().zip(row) {
                        (0..LANES).for_each(|k| own[k] -= value * side[k]);
                    }
                }
            }
            for (t, own) in reduced.chunks_exact_mut(L).enumerate() {
                self.stack.triangles[t].backward::<L>(own.as_flattened_mut(), LANES);
            }
            self.found.extend_from_slice(&reduced);
        }
    }
}
