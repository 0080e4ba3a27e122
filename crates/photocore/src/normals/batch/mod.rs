//! Local blocks whose equations touch the same unknowns, gathered and eliminated side by side.

mod add;
mod apart;
mod chord;
mod eliminate;
mod gather;
mod place;

use std::ops::Range;

use smallvec::SmallVec;

use super::front::Strip;
use super::symbolic::Symbolic;
use super::triangle::Triangle;
use super::vectorised::{Rows, size};

pub(super) use place::{parts_of, unite};

/// A main retained block that the local blocks are tied to.
#[derive(Debug, Clone)]
pub(super) struct Slot {
    /// Its place in the order of elimination.
    pub position: usize,
    /// Its first row in the front.
    pub row: usize,
    /// Its unknowns.
    pub dim: usize,
    /// Its groups, counted in the pattern.
    pub groups: Range<usize>,
    constants: usize,
    retained: usize,
    coupling: usize,
}

/// Consecutive unknowns of a shared block that the local blocks are tied to. They stand in the order of their
/// positions, and so of their rows in the front.
#[derive(Debug, Clone)]
pub(super) struct Segment {
    /// Place of the block in the order of elimination.
    pub position: usize,
    /// Counted from the start of the block.
    pub unknowns: Range<usize>,
    /// Its first row in the front.
    pub row: usize,
    coupling: usize,
    /// The groups that touch all of it, each the only one on its main block.
    runs: SmallVec<[Run; 4]>,
    /// Whether they are all that touch it.
    plain: bool,
}

/// Consecutive groups of the pattern whose coefficients in a segment stand one below the other.
#[derive(Debug, Clone)]
struct Run {
    places: Range<usize>,
    /// The first of their columns among those that each has in common with others.
    column: usize,
}

impl Segment {
    /// The run that a group of the pattern belongs to.
    #[inline(always)]
    fn run_of(&self, p: usize) -> Option<&Run> {
        self.runs.iter().find(|run| run.places.contains(&p))
    }

    /// Where its unknowns stand in the order of elimination.
    pub fn range(&self, symbolic: &Symbolic) -> Range<usize> {
        let start = symbolic.range(self.position).start;
        start + self.unknowns.start..start + self.unknowns.end
    }
}

/// A group of equations in the pattern: what it has in common with others.
#[derive(Debug, Clone)]
struct Place {
    /// Among the parts of the batch.
    parts: Range<usize>,
    /// Of all its parts.
    width: usize,
    rows: usize,
}

/// What some groups of the pattern have in common with others.
#[derive(Debug, Clone)]
struct Common {
    /// Its number, and a group that has it.
    number: u32,
    group: usize,
    /// Among the parts of the batch.
    parts: Range<usize>,
    /// Of all its parts.
    width: usize,
    /// The first position of its shared blocks; that of none.
    first: usize,
}

/// A part of what a group has in common with others: unknowns of a shared block that are not held.
#[derive(Debug, Clone)]
pub(super) struct Part {
    position: usize,
    unknowns: Range<usize>,
    /// The segment that it lies in, and how far from its start.
    pub segment: usize,
    pub shift: usize,
    /// The first of its columns among those that the group has in common with others.
    column: usize,
}

impl Part {
    /// How many unknowns it has.
    pub fn width(&self) -> usize {
        self.unknowns.len()
    }
}

/// Sums over the equations of groups apart that have a number of columns in common with others.
#[derive(Debug, Default)]
struct Together {
    /// Of the products of these columns with themselves, from the diagonal down, and with those of the main block: column by column, as many
    /// rows as there are of the first; empty where parts are multiplied one by one.
    products: Vec<f64>,
    /// Of their products with the right-hand sides.
    right: Vec<f64>,
    /// The columns that stand together in the front.
    runs: Vec<Stretch>,
}

/// Consecutive columns, from one on, that are consecutive in the front.
#[derive(Debug)]
struct Stretch {
    at: usize,
    column: usize,
    width: usize,
}

/// The equations of some local blocks of one pattern and what their elimination leaves: for each of them, with N = L L^T its
/// normal matrix, v = L^-1 n and V = L^-1 N_local,other. The normal equations of the others lose V^T V, their right-hand side V^T v.
///
/// What belongs to one retained block stands together, local block by local block.
#[derive(Debug, Default)]
pub(super) struct Batch {
    /// The local block of each unit.
    pub locals: Vec<u32>,
    /// Whether the units are groups apart.
    pub apart: bool,
    pub slots: Vec<Slot>,
    pub segments: Vec<Segment>,
    pub triangles: Vec<Triangle>,
    /// Sum of squares of the right-hand sides of the equations.
    pub sum_of_squares: f64,
    /// Sum of |v|^2: the decrease of the sum of squares that the local unknowns bring about.
    pub decrease: f64,
    /// Local blocks that their equations do not determine.
    pub deficient: Vec<usize>,
    /// Whether V is anything but zero: local blocks that are held leave nothing to others.
    coupled: bool,
    together: Together,
    places: Vec<Place>,
    /// The supernode that the local blocks are assembled in.
    node: usize,
    /// The set of what their groups have in common with others, and what is in it, by number.
    set: Option<u32>,
    commons: Vec<Common>,
    parts: Vec<Part>,
    /// Room for the unknowns of the segments.
    spans: Vec<(usize, Range<usize>)>,
    constants: Vec<f64>,
    local_rows: Vec<f64>,
    retained_rows: Vec<f64>,
    shared_rows: Vec<f64>,
    /// V, from `start` to `end`: what is kept of batches before may stand before it.
    pub coupling: Vec<f64>,
    pub start: usize,
    pub end: usize,
    pub reduced: Vec<f64>,
}

impl Batch {
    /// Unknowns of every main block that the local blocks are tied to, where all have the same number: kernels are chosen by it.
    pub fn retained_dim(&self) -> Option<usize> {
        let dim = self.slots.first()?.dim;
        self.slots.iter().all(|slot| slot.dim == dim).then_some(dim)
    }

    /// How many local blocks have a coupling: none of groups apart.
    #[inline(always)]
    fn coupled_locals(&self) -> usize {
        if self.apart { 0 } else { self.locals.len() }
    }

    /// The coupling of local blocks of l unknowns to a main block, local block by local block.
    #[inline(always)]
    pub fn slot_coupling<const D: usize>(&self, slot: &Slot, l: usize) -> Strip<'_> {
        let (width, count) = (size::<D>(slot.dim), self.coupled_locals() * l);
        let values = &self.coupling[slot.coupling..];
        Strip { at: slot.row, rows: Rows { values, width, stride: width, count } }
    }

    /// The coupling of local blocks of l unknowns to a segment, local block by local block.
    #[inline(always)]
    pub fn segment_coupling(&self, segment: &Segment, l: usize) -> Strip<'_> {
        let (width, count) = (segment.unknowns.len(), self.coupled_locals() * l);
        let values = &self.coupling[segment.coupling..];
        Strip { at: segment.row, rows: Rows { values, width, stride: width, count } }
    }

    /// Where the unknowns that it is tied to stand in the order of elimination: main blocks before segments.
    pub fn ranges<'s>(&'s self, symbolic: &'s Symbolic) -> impl Iterator<Item = Range<usize>> + 's {
        let of_segments = self.segments.iter().map(|segment| segment.range(symbolic));
        self.slots.iter().map(|slot| symbolic.range(slot.position)).chain(of_segments)
    }

    /// The coefficients of a main block in all its equations, local block by local block.
    #[inline(always)]
    pub fn slot_rows<const D: usize>(&self, slot: &Slot, rows: usize) -> Strip<'_> {
        let (width, count) = (size::<D>(slot.dim), slot.groups.len() * self.locals.len() * rows);
        let values = &self.retained_rows[slot.retained..];
        Strip { at: slot.row, rows: Rows { values, width, stride: width, count } }
    }

    /// The coefficients of local block `t` of the batch in group `p` of the pattern.
    #[inline(always)]
    pub fn local_rows<const L: usize>(&self, t: usize, p: usize, rows: usize) -> &[[f64; L]] {
        self.local_rows[(p * self.locals.len() + t) * rows * L..][..rows * L].as_chunks().0
    }

    /// The coefficients of a segment in all equations of some groups of one of its runs, group by group and local block by local block.
    #[inline(always)]
    fn run_rows(&self, segment: &Segment, run: &Run, places: Range<usize>, rows: usize) -> Strip<'_> {
        let Place { width: stride, rows: start, .. } = self.places[places.start];
        let values = &self.shared_rows[start + run.column..];
        let count = places.len() * self.locals.len() * rows;
        Strip { at: segment.row, rows: Rows { values, width: segment.unknowns.len(), stride, count } }
    }

    /// What group `p` of the pattern has in common with others.
    #[inline(always)]
    pub fn parts(&self, p: usize) -> &[Part] {
        &self.parts[self.places[p].parts.clone()]
    }

    /// The coefficients of a part of group `p` of the pattern in some of its equations, which are counted local block by local block.
    #[inline(always)]
    pub fn part_rows(&self, p: usize, part: &Part, equations: Range<usize>) -> Strip<'_> {
        let Place { width: stride, rows: start, .. } = self.places[p];
        let values = &self.shared_rows[start + equations.start * stride + part.column..];
        let at = self.segments[part.segment].row + part.shift;
        Strip { at, rows: Rows { values, width: part.width(), stride, count: equations.len() } }
    }
}
