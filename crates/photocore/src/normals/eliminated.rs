//! Local eliminations for the solution phase: cached from the formation or computed again. They reduce right-hand sides and solve for the
//! local blocks.

use std::ops::Range;

use pulp::Simd;
use smallvec::SmallVec;

use super::batch::{Batch, parts_of, unite};
use super::equations::Equations;
use super::incidence::Batches;
use super::layout::Layout;
use super::panels::skip_ref;
use super::system::System;
use super::triangle::Triangle;
use super::vectorised::{Kernel, Rows, dot_by_fours, dot_columns, run, size, subtract_rights};
use super::workspace::Eliminated;
use crate::context::Control;
use crate::parallel;

/// Number of batches per task if they are eliminated again.
const CHUNK: usize = 64;

impl Batch {
    /// Appends the elimination of the batch: V, v and L.
    pub fn cache(&mut self, layout: &Layout, cached: &mut Vec<f64>) {
        let end = self.end + self.numbers_beside(layout) - self.start;
        cached.extend_from_slice(&self.eliminated(layout)[..end]);
    }

    /// Stores the elimination in the buffer of V; the next batch follows it.
    pub fn cache_in_place(&mut self, layout: &Layout) {
        self.eliminated(layout);
        self.start = self.end + self.numbers_beside(layout);
    }

    /// Appends v and L to V. The padding behind them is read by vector loads but not used.
    pub fn eliminated(&mut self, layout: &Layout) -> &[f64] {
        let l = layout.local_dim();
        let (own, rest) = self.coupling[self.end..].split_at_mut(self.reduced.len());
        own.copy_from_slice(&self.reduced);
        let triangles = rest.chunks_exact_mut(Triangle::numbers(l));
        self.triangles.iter().zip(triangles).for_each(|(triangle, numbers)| triangle.write_to(l, numbers));
        &self.coupling[self.start..]
    }

    /// Number of values in v and L.
    pub(super) fn numbers_beside(&self, layout: &Layout) -> usize {
        let l = layout.local_dim();
        self.locals.len() * (l + Triangle::numbers(l))
    }
}

/// Ranges of the unknowns coupled to a batch, in elimination order.
#[derive(Default)]
pub(super) struct Coupled {
    ranges: SmallVec<[Range<usize>; 16]>,
    /// Number of main blocks, which are first.
    main: usize,
    /// Set of shared block lists of the last batch, and its ranges.
    set: Option<u32>,
    shared: SmallVec<[Range<usize>; 4]>,
}

impl Coupled {
    /// Determines the ranges of a batch from its first unit: main blocks, then segments, as in [`Batch`].
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
        self.ranges.extend(self.shared.iter().cloned());
    }

    /// Determines the ranges of a set of shared block lists.
    fn find_common(&mut self, system: &System, set: u32) {
        let (layout, symbolic) = (&system.layout, &*system.symbolic);
        let numbers = system.incidence.members(set).iter();
        let groups = numbers.map(|&number| system.incidence.group_with(number));
        let parts = groups.flat_map(|group| parts_of(layout, symbolic, group));
        let mut spans = vec![];
        unite(parts.map(|(position, unknowns, _)| (position, unknowns)), &mut spans);
        let place = |(position, unknowns): (usize, Range<usize>)| {
            let start = symbolic.range(position).start;
            start + unknowns.start..start + unknowns.end
        };
        self.shared = spans.into_iter().map(place).collect();
    }

    /// Returns the number of unknowns in a range: D for a main block, if D is known.
    #[inline(always)]
    fn width<const D: usize>(&self, index: usize) -> usize {
        let width = self.ranges[index].len();
        if index < self.main { size::<D>(width) } else { width }
    }

    /// Number of values in V, v and L of `depth` local blocks.
    fn numbers(&self, layout: &Layout, depth: usize) -> usize {
        let l = layout.local_dim();
        depth * (l * (self.all_width() + 1) + Triangle::numbers(l))
    }

    /// Number of unknowns in all ranges.
    #[inline(always)]
    fn all_width(&self) -> usize {
        self.ranges.iter().map(Range::len).sum()
    }

    /// Returns the number of unknowns per main block, if equal for all.
    fn main_dim(&self) -> Option<usize> {
        let dim = self.ranges[..self.main].first()?.len();
        self.ranges[..self.main].iter().all(|range| range.len() == dim).then_some(dim)
    }
}

/// Elimination of a batch.
#[derive(Clone, Copy)]
pub(super) struct EliminatedBatch<'a> {
    coupled: &'a Coupled,
    /// Number of local blocks.
    depth: usize,
    /// V, v and L, with padding that is read but not used.
    numbers: &'a [f64],
}

impl<'a> EliminatedBatch<'a> {
    /// Creates the view of an eliminated batch.
    pub fn new(system: &System, batch: &'a mut Batch, coupled: &'a mut Coupled) -> Self {
        let depth = batch.locals.len();
        batch.locals.iter().take(1).for_each(|&first| coupled.find(system, first));
        Self { coupled, depth, numbers: batch.eliminated(&system.layout) }
    }

    /// Returns V with the data behind it, and the triangles L.
    #[inline(always)]
    fn parts<const L: usize>(self) -> (&'a [f64], impl Iterator<Item = Triangle>) {
        let triangles = &self.numbers[L * self.depth * (self.coupled.all_width() + 1)..];
        let triangles = triangles.chunks_exact(Triangle::numbers(L)).take(self.depth);
        (self.numbers, triangles.map(|numbers| Triangle::of(L, numbers)))
    }

    /// Returns v, the reduced right-hand side of the equations.
    fn right(self, layout: &Layout) -> &'a [f64] {
        let count = layout.local_dim() * self.depth;
        &self.numbers[count * self.coupled.all_width()..][..count]
    }

    /// Replaces the local right-hand sides r of `found`, from index `start`, by L^-1 r. Appends -V^T L^-1 r, the change of other right-hand
    /// sides in `block`.
    pub fn reduce<const C: usize>(self, layout: &Layout, block: usize, start: usize, found: &mut Reduced<C>) {
        run(layout, self.coupled.main_dim(), Reduce { batch: self, block, start, found });
    }

    /// Solves for the local blocks from their reduced right-hand sides and the solutions of the others: x = L^-T (L^-1 r - V x_o). `others`
    /// are in elimination order.
    pub fn solve<const C: usize>(self, layout: &Layout, others: &[[f64; C]], own: &mut [[f64; C]]) {
        run(layout, self.coupled.main_dim(), Solve { batch: self, others, own });
    }
}

/// Right-hand sides, C per block, reduced by some local blocks.
#[derive(Default)]
pub(super) struct Reduced<const C: usize> {
    /// Rows of the local blocks, batch by batch; per batch one block of C right-hand sides after the other.
    pub own: Vec<[f64; C]>,
    /// Changes of the other right-hand sides, range by range.
    pub values: Vec<[f64; C]>,
    /// Block of right-hand sides, and range of unknowns in elimination order.
    ranges: Vec<(usize, Range<usize>)>,
}

impl<const C: usize> Reduced<C> {
    /// Appends zeros for other unknowns in the right-hand sides of a block.
    pub fn room(&mut self, block: usize, range: Range<usize>) {
        self.values.resize(self.values.len() + range.len(), [0.0; C]);
        self.ranges.push((block, range));
    }

    /// Returns the changes of one right-hand side, with positions in elimination order.
    pub fn entries(&self) -> Vec<(usize, f64)> {
        let places = self.ranges.iter().flat_map(|(_, range)| range.clone());
        places.zip(self.values.as_flattened().iter().copied()).collect()
    }

    /// Adds the changes to right-hand sides of `count` unknowns in elimination order, one after the other.
    pub fn add_to(&self, others: &mut [f64], count: usize) {
        let mut values = &self.values[..];
        for (block, range) in &self.ranges {
            let own = skip_ref(&mut values, range.len());
            for k in 0..C {
                let first = (block * C + k) * count + range.start;
                let column = others.get_mut(first..first + range.len()).unwrap_or_default();
                column.iter_mut().zip(own).for_each(|(right, value)| *right += value[k]);
            }
        }
    }
}

/// Elimination of all local blocks, cached or repeated.
pub(super) struct Elimination<'a> {
    pub system: &'a System,
    pub cached: &'a Eliminated,
    pub equations: &'a dyn Equations,
    pub damping: f64,
    pub control: &'a Control,
}

/// Batches of a supernode that are processed by one task.
type Part<'a> = (usize, Batches<'a>);

impl Elimination<'_> {
    /// Returns all batches in the order of the incidence: the cache of a supernode is read from its start.
    pub fn parts(&self) -> Vec<Part<'_>> {
        let at = |node: usize| self.system.incidence.batches_of_locals_at(node);
        let nodes = 0..=self.system.symbolic.supernode_count();
        match self.cached.is_empty() {
            true => nodes
                .flat_map(|node| at(node).parts(CHUNK).into_iter().map(move |part| (node, part)))
                .collect(),
            false => nodes.map(|node| (node, at(node))).collect(),
        }
    }

    fn reader(&self) -> Reader<'_> {
        Reader { elimination: self, cached: None, batch: Batch::default(), coupled: Coupled::default() }
    }

    /// Reduces right-hand sides over all unknowns, one after the other; one result per part.
    pub fn reduce<const C: usize>(&self, rights: &[f64]) -> Vec<Reduced<C>> {
        let layout = &self.system.layout;
        let unknowns = layout.unknowns().max(1);
        let reduce = |reader: &mut Reader<'_>, (node, batches): Part<'_>| {
            let mut found = Reduced::default();
            reader.begin(node);
            for locals in batches.iter().take_while(|_| !self.control.stopped()) {
                let (start, count) = (found.own.len(), locals.len() * layout.local_dim());
                for rights in rights.chunks(C * unknowns) {
                    let own = locals.iter().flat_map(|&local| layout.local_range(local as usize));
                    let row = |unknown: usize| {
                        std::array::from_fn(|k| {
                            rights.get(k * unknowns + unknown).copied().unwrap_or_default()
                        })
                    };
                    found.own.extend(own.map(row));
                }
                let idle = |own: &[[f64; C]]| own.as_flattened().iter().all(|&value| value == 0.0);
                if idle(&found.own[start..]) {
                    reader.pass(locals);
                    continue;
                }
                let batch = reader.next(locals);
                for (block, start) in (start..found.own.len()).step_by(count).enumerate() {
                    if !idle(&found.own[start..][..count]) {
                        batch.reduce(layout, block, start, &mut found);
                    }
                }
            }
            found
        };
        parallel::map_each_with(self.parts(), || self.reader(), reduce)
    }

    /// Solves for all local blocks, part by part. `others` contains the solutions of the other unknowns in elimination order, C per block.
    /// `own` contains the reduced right-hand sides; None for that of the equations.
    pub fn solve<const C: usize>(
        &self,
        own: Option<Vec<Vec<[f64; C]>>>,
        others: &[Vec<[f64; C]>],
    ) -> Vec<Vec<[f64; C]>> {
        let (layout, parts) = (&self.system.layout, self.parts());
        let is_given = own.is_some();
        let own = own.unwrap_or_else(|| vec![Vec::new(); parts.len()]);
        let solve = |reader: &mut Reader<'_>, ((node, batches), mut own): (Part<'_>, Vec<[f64; C]>)| {
            let mut at = 0;
            reader.begin(node);
            own.reserve(if is_given { 0 } else { batches.units() * layout.local_dim() });
            for locals in batches.iter().take_while(|_| !self.control.stopped()) {
                let (batch, count) = (reader.next(locals), locals.len() * layout.local_dim());
                for others in others {
                    if !is_given {
                        own.extend(batch.right(layout).iter().map(|&value| [value; C]));
                    }
                    batch.solve(layout, others, &mut own[at..at + count]);
                    at += count;
                }
                self.control.count(locals.len());
            }
            own
        };
        parallel::map_each_with(parts.into_iter().zip(own).collect(), || self.reader(), solve)
    }
}

/// Sequential reader of the eliminations of batches.
struct Reader<'a> {
    elimination: &'a Elimination<'a>,
    cached: Option<&'a [f64]>,
    batch: Batch,
    coupled: Coupled,
}

impl Reader<'_> {
    /// Starts with the batches of a supernode, or with a part of them if they are not cached.
    fn begin(&mut self, node: usize) {
        self.cached = self.elimination.cached.get(node).map(|cached| &cached[..]);
    }

    /// Returns the elimination of the next batch, with these local blocks.
    fn next(&mut self, locals: &[u32]) -> EliminatedBatch<'_> {
        let Elimination { system, equations, damping, .. } = *self.elimination;
        self.coupled.find(system, locals[0]);
        let (coupled, depth) = (&self.coupled, locals.len());
        let numbers = match &mut self.cached {
            Some(cached) => {
                let here = *cached;
                skip_ref(cached, coupled.numbers(&system.layout, depth));
                here
            }
            None => {
                self.batch.gather(equations, system, locals);
                self.batch.eliminate(&system.layout, equations.prior(), damping);
                self.batch.eliminated(&system.layout)
            }
        };
        EliminatedBatch { coupled, depth, numbers }
    }

    /// Skips a batch.
    fn pass(&mut self, locals: &[u32]) {
        if self.cached.is_some() {
            self.next(locals);
        }
    }
}

struct Reduce<'a, const C: usize> {
    batch: EliminatedBatch<'a>,
    block: usize,
    start: usize,
    found: &'a mut Reduced<C>,
}

impl<const C: usize> Kernel for Reduce<'_, C> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const L: usize, const D: usize>(self, simd: S) {
        let Self { batch, block, start, found } = self;
        let (mut coupling, triangles) = batch.parts::<L>();
        let (coupled, count) = (batch.coupled, L * batch.depth);
        let Reduced { own, values, ranges } = found;
        let own = &mut own[start..start + count];
        for (own, triangle) in own.as_chunks_mut::<L>().0.iter_mut().zip(triangles) {
            triangle.forward::<L>(own.as_flattened_mut(), C);
        }
        for (index, range) in coupled.ranges.iter().enumerate() {
            let (width, end) = (coupled.width::<D>(index), values.len());
            values.resize(end + width, [0.0; C]);
            ranges.push((block, range.clone()));
            let rows = Rows { values: coupling, width, stride: width, count };
            subtract_rights(simd, &mut values[end..], rows, own);
            skip_ref(&mut coupling, count * width);
        }
    }
}

struct Solve<'a, const C: usize> {
    batch: EliminatedBatch<'a>,
    others: &'a [[f64; C]],
    own: &'a mut [[f64; C]],
}

impl<const C: usize> Kernel for Solve<'_, C> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const L: usize, const D: usize>(self, _: S) {
        let Self { batch, others, own } = self;
        let (coupling, triangles) = batch.parts::<L>();
        let (coupled, mut at) = (batch.coupled, 0);
        for (index, range) in coupled.ranges.iter().enumerate() {
            let width = coupled.width::<D>(index);
            let x = &others[range.start..][..width];
            let rows = own.iter_mut().zip(coupling[at..].chunks_exact(width.max(1)));
            let subtract = |own: &mut [f64; C], product: [f64; C]| {
                own.iter_mut().zip(product).for_each(|(value, product)| *value -= product);
            };
            // The compiler knows the width of a main block, so that its sum needs no loop.
            if index < coupled.main {
                rows.for_each(|(own, row)| subtract(own, dot_columns(row, x)));
            } else {
                rows.for_each(|(own, row)| subtract(own, dot_by_fours(row, x)));
            }
            at += L * batch.depth * width;
        }
        for (own, triangle) in own.as_chunks_mut::<L>().0.iter_mut().zip(triangles) {
            triangle.backward::<L>(own.as_flattened_mut(), C);
        }
    }
}
