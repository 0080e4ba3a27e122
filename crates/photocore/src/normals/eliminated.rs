//! What the elimination of local blocks leaves, kept from the formation to the solution: it need not evaluate any equation again.

use std::ops::Range;

use pulp::Simd;
use smallvec::SmallVec;

use super::incidence::Incidence;
use super::layout::Layout;
use super::panels::skip_ref;
use super::stack::{Stack, dot, parts_of, united};
use super::system::System;
use super::triangle::Triangle;
use super::vectorised::{Kernel, run, size};

/// For each supernode, and last for the local blocks without equations: V, v and L of every stack at home there (see [`Stack`]), one after
/// the other; nothing where it is not kept.
pub(super) type Eliminated = Vec<Vec<f64>>;

/// Numbers that are kept of so many local blocks of one pattern, at the most.
pub(super) fn numbers_of(layout: &Layout, first: usize, count: usize) -> usize {
    let l = layout.local_dim();
    let border = if layout.has_common() { layout.border_dim() } else { 0 };
    count * (l * (layout.reduced_width(first) + border + 1) + Triangle::numbers(l))
}

/// The same of all local blocks at home in a supernode.
pub(super) fn numbers_at(incidence: &Incidence, layout: &Layout, index: usize) -> usize {
    let of_stack =
        |run: &[u32]| run.first().map_or(0, |&first| numbers_of(layout, first as usize, run.len()));
    incidence.stacks_at(index).iter().map(of_stack).sum()
}

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
            let parts = groups.iter().flat_map(|&group| parts_of(layout, symbolic, group as usize));
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
/// stack is taken off the front of `kept`. `others` are in the order of elimination.
pub(super) fn solve(
    system: &System,
    locals: &[u32],
    coupled: &mut Coupled,
    kept: &mut &[f64],
    others: &[f64],
    found: &mut Vec<f64>,
) {
    let Some(&first) = locals.first() else { return };
    coupled.find(system, first);
    let dim = coupled.main_dim();
    run(&system.layout, dim, Solve { coupled, depth: locals.len(), kept, others, found });
}

struct Solve<'a, 'k> {
    coupled: &'a Coupled,
    depth: usize,
    kept: &'a mut &'k [f64],
    others: &'a [f64],
    found: &'a mut Vec<f64>,
}

impl Kernel for Solve<'_, '_> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const L: usize, const D: usize>(self, _: S) {
        let (count, start) = (L * self.depth, self.found.len());
        let width: usize = self.coupled.ranges.iter().map(Range::len).sum();
        let coupling = skip_ref(self.kept, count * width);
        self.found.extend_from_slice(skip_ref(self.kept, count));
        let triangles = skip_ref(self.kept, self.depth * Triangle::numbers(L));
        let own = &mut self.found[start..];
        let mut at = 0;
        for (index, range) in self.coupled.ranges.iter().enumerate() {
            let width = if index < self.coupled.main { size::<D>(range.len()) } else { range.len() };
            let x = &self.others[range.start..][..width];
            for (value, row) in own.iter_mut().zip(coupling[at..].chunks_exact(width.max(1))) {
                *value -= dot(row, x);
            }
            at += count * width;
        }
        for (own, numbers) in own.chunks_exact_mut(L).zip(triangles.chunks_exact(Triangle::numbers(L))) {
            Triangle::of(L, numbers).backward::<L>(own, 1);
        }
    }
}
