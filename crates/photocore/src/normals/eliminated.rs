//! What the elimination of local blocks leaves, kept from the formation to the solution: it need not evaluate any equation again.

use std::ops::Range;

use pulp::Simd;
use smallvec::SmallVec;

use super::layout::Layout;
use super::panels::skip_ref;
use super::stack::{Stack, parts_of, united};
use super::system::System;
use super::triangle::Triangle;
use super::vectorised::{Kernel, Rows, add_right, dot, dot_by_fours, run, size};

impl Stack {
    /// Appends what the elimination has left: V, v and L.
    pub fn keep(&self, layout: &Layout, kept: &mut Vec<f64>) {
        kept.extend_from_slice(self.coupling());
        let end = kept.len();
        kept.resize(end + self.numbers_beside(layout), 0.0);
        self.write_beside(layout, &mut kept[end..]);
    }

    /// Leaves V in its buffer and writes v and L behind it; the V of the next stack goes behind these.
    pub fn keep_in_place(&mut self, layout: &Layout) {
        let mut kept = std::mem::take(&mut self.coupling);
        self.write_beside(layout, &mut kept[self.end..]);
        self.start = self.end + self.numbers_beside(layout);
        self.coupling = kept;
    }

    /// Numbers in v and L.
    pub(super) fn numbers_beside(&self, layout: &Layout) -> usize {
        let l = layout.local_dim();
        self.locals.len() * (l + Triangle::numbers(l))
    }

    fn write_beside(&self, layout: &Layout, kept: &mut [f64]) {
        let (own, rest) = kept.split_at_mut(self.reduced.len());
        own.copy_from_slice(&self.reduced);
        let l = layout.local_dim();
        let triangles = rest.chunks_exact_mut(Triangle::numbers(l));
        self.triangles.iter().zip(triangles).for_each(|(triangle, numbers)| triangle.write_to(l, numbers));
    }
}

/// Where the unknowns that stacks are tied to stand in the order of elimination.
#[derive(Default)]
pub(super) struct Coupled {
    ranges: SmallVec<[Range<usize>; 16]>,
    /// How many of them are main blocks, the first.
    main: usize,
    /// The set of what the groups of the last stack had in common with others, and where that stands.
    set: Option<u32>,
    common: SmallVec<[Range<usize>; 4]>,
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
        let set = system.incidence.set_of(first as usize);
        if self.set.replace(set) != Some(set) {
            self.find_common(system, set);
        }
        self.ranges.extend(self.common.iter().cloned());
    }

    /// Of a set of what groups have in common with others.
    fn find_common(&mut self, system: &System, set: u32) {
        let (layout, symbolic) = (&system.layout, &*system.symbolic);
        let numbers = system.incidence.members(set).iter();
        let groups = numbers.map(|&number| system.incidence.group_with(number));
        let parts = groups.flat_map(|group| parts_of(layout, symbolic, group));
        let all = united(parts.map(|(position, unknowns, _)| (position, unknowns))).into_iter();
        let place = |(position, unknowns): (usize, Range<usize>)| {
            let start = symbolic.range(position).start;
            start + unknowns.start..start + unknowns.end
        };
        self.common = all.map(place).collect();
    }

    /// Unknowns in a range: D in a main block, where that is known.
    #[inline(always)]
    fn width<const D: usize>(&self, index: usize) -> usize {
        let width = self.ranges[index].len();
        if index < self.main { size::<D>(width) } else { width }
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

/// Parts of a right-hand side that the local blocks of one home make.
#[derive(Default)]
pub(super) struct OfHome {
    /// Local block by local block.
    pub own: Vec<f64>,
    /// Of other unknowns, which stand in `ranges`, stack by stack.
    pub values: Vec<f64>,
    ranges: Vec<Range<usize>>,
}

impl OfHome {
    /// Appends zeros for coupled unknowns; returns where their values start.
    pub fn room(&mut self, range: Range<usize>) -> usize {
        let start = self.values.len();
        self.values.resize(start + range.len(), 0.0);
        self.ranges.push(range);
        start
    }

    /// Adds the part of the others to a right-hand side in the order of elimination.
    pub fn add_to(&self, others: &mut [f64]) {
        let mut values = &self.values[..];
        for range in &self.ranges {
            let own = skip_ref(&mut values, range.len());
            others[range.clone()].iter_mut().zip(own).for_each(|(right, value)| *right += value);
        }
    }
}

/// Reduces another right-hand side by a stack, whose local blocks have the last of `found`: they become L^-1 r, and -V^T L^-1 r of the others is
/// appended. What is kept of the stack is taken off the front of `kept`.
pub(super) fn reduce(
    system: &System,
    locals: &[u32],
    coupled: &mut Coupled,
    kept: &mut &[f64],
    found: &mut OfHome,
) {
    let Some(&first) = locals.first() else { return };
    coupled.find(system, first);
    run(&system.layout, coupled.main_dim(), Reduce { depth: locals.len(), coupled, kept, found });
}

struct Reduce<'a, 'k> {
    depth: usize,
    coupled: &'a Coupled,
    kept: &'a mut &'k [f64],
    found: &'a mut OfHome,
}

impl Kernel for Reduce<'_, '_> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const L: usize, const D: usize>(self, simd: S) {
        let Self { coupled, kept, found, .. } = self;
        let count = L * self.depth;
        let width: usize = coupled.ranges.iter().map(Range::len).sum();
        // What follows V is read, and not used.
        let mut coupling = *kept;
        skip_ref(kept, count * width + count);
        let triangles = skip_ref(kept, self.depth * Triangle::numbers(L));
        let start = found.own.len() - count;
        let own = found.own[start..].as_chunks_mut::<L>().0;
        for (own, numbers) in own.iter_mut().zip(triangles.chunks_exact(Triangle::numbers(L))) {
            Triangle::of(L, numbers).forward::<L>(own, 1);
        }
        for (index, range) in coupled.ranges.iter().enumerate() {
            let width = coupled.width::<D>(index);
            let rows = Rows { values: coupling, width, stride: width, count };
            let first = found.room(range.clone());
            add_right(simd, &mut found.values[first..], None, -1.0, rows, &found.own[start..]);
            skip_ref(&mut coupling, count * width);
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
            let width = self.coupled.width::<D>(index);
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
