//! What the elimination of local blocks leaves, kept from the formation to the solution: it need not evaluate any equation again.

use std::ops::Range;

use pulp::Simd;
use smallvec::SmallVec;

use super::layout::Layout;
use super::panels::skip_ref;
use super::stack::{Stack, parts_of, united, unlike};
use super::system::System;
use super::triangle::Triangle;
use super::vectorised::{Kernel, dot, dot_by_fours, run, size};

impl Stack {
    /// Appends what the elimination has left.
    pub fn keep(&self, layout: &Layout, kept: &mut Vec<f64>) {
        kept.extend_from_slice(self.coupling());
        kept.extend_from_slice(&self.reduced);
        let l = layout.local_dim();
        self.triangles.iter().for_each(|triangle| triangle.append_to(l, kept));
    }
}

/// Where the unknowns that stacks are tied to stand in the order of elimination.
#[derive(Default)]
pub(super) struct Coupled {
    ranges: SmallVec<[Range<usize>; 16]>,
    /// How many of them are main blocks, the first.
    main: usize,
}

impl Coupled {
    /// Of the stack that begins with a local block: main blocks, then segments, as [`Stack`] has them.
    fn find(&mut self, system: &System, first: u32) {
        let (layout, symbolic) = (&system.layout, &*system.symbolic);
        self.ranges.clear();
        let mut last = None;
        for &position in system.incidence.positions_of(layout, first as usize) {
            if last.replace(position) != Some(position) {
                self.ranges.push(symbolic.range(position as usize));
            }
        }
        self.main = self.ranges.len();
        if layout.has_common() {
            let groups = system.incidence.groups_of(layout, first as usize);
            let parts =
                unlike(layout, groups).into_iter().flat_map(|group| parts_of(layout, symbolic, group));
            for (position, unknowns) in united(parts.map(|(position, unknowns, _)| (position, unknowns))) {
                let start = symbolic.range(position).start;
                self.ranges.push(start + unknowns.start..start + unknowns.end);
            }
        }
    }

    /// Unknowns of every main block, where all have the same number.
    fn main_dim(&self) -> Option<usize> {
        let dim = self.ranges[..self.main].first()?.len();
        self.ranges[..self.main].iter().all(|range| range.len() == dim).then_some(dim)
    }
}

/// Solves for the local blocks of a stack with the others in place, x = L^-T (v - V x_o), and adds them to `found`; what is kept of the
/// stack is taken off the front of `kept`, and so is v of `own` where there is another right-hand side. `others` are in the order of
/// elimination.
pub(super) fn solve<'k>(
    system: &System,
    locals: &[u32],
    coupled: &mut Coupled,
    kept: &mut &'k [f64],
    own: Option<&mut &'k [f64]>,
    others: &[f64],
    found: &mut Vec<f64>,
) {
    let Some(&first) = locals.first() else { return };
    coupled.find(system, first);
    let dim = coupled.main_dim();
    run(&system.layout, dim, Solve { coupled, depth: locals.len(), kept, own, others, found });
}

/// What local blocks take off another right-hand side of the others.
#[derive(Default)]
pub(super) struct Taken {
    /// L^-1 r, local block by local block.
    pub own: Vec<f64>,
    /// V^T L^-1 r where unknowns are coupled, which stand in `ranges`, stack by stack.
    values: Vec<f64>,
    ranges: Vec<Range<usize>>,
}

impl Taken {
    /// Takes it off.
    pub fn subtract_from(&self, others: &mut [f64]) {
        let mut values = &self.values[..];
        for range in &self.ranges {
            let own = skip_ref(&mut values, range.len());
            others[range.clone()].iter_mut().zip(own).for_each(|(right, value)| *right -= value);
        }
    }
}

/// Reduces another right-hand side, over all unknowns, by a stack; what is kept of it is taken off the front of `kept`.
pub(super) fn reduce(
    system: &System,
    locals: &[u32],
    coupled: &mut Coupled,
    kept: &mut &[f64],
    right: &[f64],
    found: &mut Taken,
) {
    let Some(&first) = locals.first() else { return };
    coupled.find(system, first);
    run(
        &system.layout,
        coupled.main_dim(),
        Reduce { layout: &system.layout, locals, coupled, kept, right, found },
    );
}

struct Reduce<'a, 'k> {
    layout: &'a Layout,
    locals: &'a [u32],
    coupled: &'a Coupled,
    kept: &'a mut &'k [f64],
    right: &'a [f64],
    found: &'a mut Taken,
}

impl Kernel for Reduce<'_, '_> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const L: usize, const D: usize>(self, _: S) {
        let (count, start) = (L * self.locals.len(), self.found.own.len());
        let width: usize = self.coupled.ranges.iter().map(Range::len).sum();
        let coupling = skip_ref(self.kept, count * width);
        skip_ref(self.kept, count);
        let triangles = skip_ref(self.kept, self.locals.len() * Triangle::numbers(L));
        for (&local, numbers) in self.locals.iter().zip(triangles.chunks_exact(Triangle::numbers(L))) {
            let mut own = [0.0; L];
            own.copy_from_slice(&self.right[self.layout.local_range(local as usize)]);
            Triangle::of(L, numbers).forward::<L>(&mut own, 1);
            self.found.own.extend_from_slice(&own);
        }
        let mut at = 0;
        for range in &self.coupled.ranges {
            let first = self.found.values.len();
            self.found.values.resize(first + range.len(), 0.0);
            let sums = &mut self.found.values[first..];
            let rows = coupling[at..][..count * range.len()].chunks_exact(range.len().max(1));
            for (row, value) in rows.zip(&self.found.own[start..]) {
                sums.iter_mut().zip(row).for_each(|(sum, v)| *sum += v * value);
            }
            self.found.ranges.push(range.clone());
            at += count * range.len();
        }
    }
}

struct Solve<'a, 'k> {
    coupled: &'a Coupled,
    depth: usize,
    kept: &'a mut &'k [f64],
    own: Option<&'a mut &'k [f64]>,
    others: &'a [f64],
    found: &'a mut Vec<f64>,
}

impl Kernel for Solve<'_, '_> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const L: usize, const D: usize>(self, _: S) {
        let (count, start) = (L * self.depth, self.found.len());
        let width: usize = self.coupled.ranges.iter().map(Range::len).sum();
        let coupling = skip_ref(self.kept, count * width);
        let reduced = skip_ref(self.kept, count);
        self.found.extend_from_slice(self.own.map_or(reduced, |own| skip_ref(own, count)));
        let triangles = skip_ref(self.kept, self.depth * Triangle::numbers(L));
        let own = &mut self.found[start..];
        let mut at = 0;
        for (index, range) in self.coupled.ranges.iter().enumerate() {
            let width = if index < self.coupled.main { size::<D>(range.len()) } else { range.len() };
            let x = &self.others[range.start..][..width];
            let rows = own.iter_mut().zip(coupling[at..].chunks_exact(width.max(1)));
            // The width of a main block is known where this is compiled: its sum needs no loop.
            if index < self.coupled.main {
                rows.for_each(|(value, row)| *value -= dot(row, x));
            } else {
                rows.for_each(|(value, row)| *value -= dot_by_fours(row, x));
            }
            at += count * width;
        }
        for (own, numbers) in own.chunks_exact_mut(L).zip(triangles.chunks_exact(Triangle::numbers(L))) {
            Triangle::of(L, numbers).backward::<L>(own, 1);
        }
    }
}
