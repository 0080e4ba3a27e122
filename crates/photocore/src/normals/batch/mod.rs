//! Batches: local blocks with equal patterns, gathered and eliminated in parallel lanes.

mod add;
mod chord;
mod eliminate;
mod gather;
mod place;
mod uncoupled;

use std::ops::Range;

use smallvec::SmallVec;

use super::front::PanelView;
use super::symbolic::Symbolic;
use super::triangle::Triangle;
use super::vectorised::{Rows, size};

pub(super) use place::{parts_of, unite};

/// Main retained block that is coupled to the local blocks.
#[derive(Debug, Clone)]
pub(super) struct MainBlock {
    /// Position in elimination order.
    pub position: usize,
    /// First row in the front.
    pub row: usize,
    /// Number of unknowns.
    pub dim: usize,
    /// Groups of the pattern on this block.
    pub groups: Range<usize>,
    constants: usize,
    retained: usize,
    coupling: usize,
}

/// Consecutive unknowns of a shared block that are coupled to the local blocks. Segments are in the order of their positions, which is the
/// order of their rows in the front.
#[derive(Debug, Clone)]
pub(super) struct SharedSpan {
    /// Position of the block in elimination order.
    pub position: usize,
    /// Range of unknowns in the block.
    pub unknowns: Range<usize>,
    /// First row in the front.
    pub row: usize,
    coupling: usize,
    /// Runs of groups that involve the complete segment, each the only group on its main block.
    runs: SmallVec<[Run; 4]>,
    /// Whether other groups do not involve the segment.
    plain: bool,
}

/// Consecutive groups of the pattern whose coefficients in a segment form one matrix.
#[derive(Debug, Clone)]
struct Run {
    places: Range<usize>,
    /// First column in the shared coefficients of each group.
    column: usize,
}

impl SharedSpan {
    /// Returns the run of a group of the pattern.
    #[inline(always)]
    fn run_of(&self, p: usize) -> Option<&Run> {
        self.runs.iter().find(|run| run.places.contains(&p))
    }

    /// Returns the range of the unknowns in elimination order.
    pub fn range(&self, symbolic: &Symbolic) -> Range<usize> {
        let start = symbolic.range(self.position).start;
        start + self.unknowns.start..start + self.unknowns.end
    }
}

/// Shared coefficients of one group of the pattern.
#[derive(Debug, Clone)]
struct Place {
    /// Range in the parts of the batch.
    parts: Range<usize>,
    /// Number of columns of all its parts.
    width: usize,
    rows: usize,
}

/// Shared block list of some groups of the pattern.
#[derive(Debug, Clone)]
struct Common {
    /// Number of the list, and an example group.
    number: u32,
    group: usize,
    /// Range in the parts of the batch.
    parts: Range<usize>,
    /// Number of columns of all its parts.
    width: usize,
    /// First position of its shared blocks; `usize::MAX` for an empty list.
    first: usize,
}

/// Part of the shared coefficients of a group: consecutive free unknowns of a shared block.
#[derive(Debug, Clone)]
pub(super) struct Part {
    position: usize,
    unknowns: Range<usize>,
    /// Segment that contains the part, and offset in it.
    pub span: usize,
    pub shift: usize,
    /// First column in the shared coefficients of the group.
    column: usize,
}

impl Part {
    /// Number of unknowns.
    pub fn width(&self) -> usize {
        self.unknowns.len()
    }
}

/// Sums over the equations of independent groups with many narrow shared parts.
#[derive(Debug, Default)]
struct JointProducts {
    /// Products of the shared columns with themselves, from the diagonal, and with the columns of the main block. Stored by columns, one
    /// row per shared column; empty if parts are multiplied separately.
    products: Vec<f64>,
    /// Products of the shared columns with the right-hand sides.
    right: Vec<f64>,
    /// Columns that are contiguous in the front.
    runs: Vec<ColumnRun>,
}

/// Consecutive columns that are also consecutive in the front.
#[derive(Debug)]
struct ColumnRun {
    at: usize,
    column: usize,
    width: usize,
}

/// Normal equations of the terms of one local block: lower triangle, right-hand side and sum of squares.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct TermSums {
    pub normal: [[f64; 3]; 3],
    pub right: [f64; 3],
    pub sum_of_squares: f64,
}

/// Equations of local blocks of one pattern, with their elimination. With the normal matrix N = L L^T of a local block, v = L^-1 n and V =
/// L^-1 N_local,other. The Schur complement subtracts V^T V from the other normal equations, and V^T v from their right-hand side.
///
/// Data of one retained block is contiguous, local block by local block.
#[derive(Debug, Default)]
pub(super) struct Batch {
    /// Local block of each unit.
    pub locals: Vec<u32>,
    /// Whether the units are independent groups.
    pub uncoupled: bool,
    pub main_blocks: Vec<MainBlock>,
    pub spans: Vec<SharedSpan>,
    pub triangles: Vec<Triangle>,
    /// Sum of squares of the right-hand sides of the equations.
    pub sum_of_squares: f64,
    /// Sum of |v|^2: decrease of the sum of squares by the local unknowns.
    pub decrease: f64,
    /// Local blocks that their equations do not determine.
    pub deficient: Vec<usize>,
    /// Whether V is nonzero; fixed local blocks have zero coupling.
    coupled: bool,
    together: JointProducts,
    places: Vec<Place>,
    /// Assembly node of the local blocks.
    node: usize,
    /// Set of shared block lists of the batch, and these lists, by number.
    set: Option<u32>,
    commons: Vec<Common>,
    parts: Vec<Part>,
    /// Scratch memory for the unknowns of the spans.
    ranges: Vec<(usize, Range<usize>)>,
    /// Normal equations of the terms of each local block; empty if no term is local.
    own: Vec<TermSums>,
    constants: Vec<f64>,
    local_rows: Vec<f64>,
    retained_rows: Vec<f64>,
    shared_rows: Vec<f64>,
    /// V, from `start` to `end`; cached data of earlier batches may precede it.
    pub coupling: Vec<f64>,
    pub start: usize,
    pub end: usize,
    pub reduced: Vec<f64>,
}

impl Batch {
    /// Returns the number of unknowns per main block, if it is equal for all: it selects the kernel.
    pub fn retained_dim(&self) -> Option<usize> {
        let dim = self.main_blocks.first()?.dim;
        self.main_blocks.iter().all(|main| main.dim == dim).then_some(dim)
    }

    /// Number of local blocks with a coupling: zero for independent groups.
    #[inline(always)]
    fn coupled_locals(&self) -> usize {
        if self.uncoupled { 0 } else { self.locals.len() }
    }

    /// Returns the coupling of local blocks with l unknowns to a main block, local block by local block.
    #[inline(always)]
    pub fn main_coupling<const D: usize>(&self, main: &MainBlock, l: usize) -> PanelView<'_> {
        let (width, count) = (size::<D>(main.dim), self.coupled_locals() * l);
        let values = &self.coupling[main.coupling..];
        PanelView { at: main.row, rows: Rows { values, width, stride: width, count } }
    }

    /// Returns the coupling of local blocks with l unknowns to a segment, local block by local block.
    #[inline(always)]
    pub fn span_coupling(&self, span: &SharedSpan, l: usize) -> PanelView<'_> {
        let (width, count) = (span.unknowns.len(), self.coupled_locals() * l);
        let values = &self.coupling[span.coupling..];
        PanelView { at: span.row, rows: Rows { values, width, stride: width, count } }
    }

    /// Returns the ranges of coupled unknowns in elimination order: main blocks before segments.
    pub fn ranges<'s>(&'s self, symbolic: &'s Symbolic) -> impl Iterator<Item = Range<usize>> + 's {
        let of_segments = self.spans.iter().map(|span| span.range(symbolic));
        self.main_blocks.iter().map(|main| symbolic.range(main.position)).chain(of_segments)
    }

    /// Returns the coefficients of a main block in all equations, local block by local block.
    #[inline(always)]
    pub fn main_rows<const D: usize>(&self, main: &MainBlock, rows: usize) -> PanelView<'_> {
        let (width, count) = (size::<D>(main.dim), main.groups.len() * self.locals.len() * rows);
        let values = &self.retained_rows[main.retained..];
        PanelView { at: main.row, rows: Rows { values, width, stride: width, count } }
    }

    /// Returns the coefficients of local block `t` of the batch in group `p` of the pattern.
    #[inline(always)]
    pub fn local_rows<const L: usize>(&self, t: usize, p: usize, rows: usize) -> &[[f64; L]] {
        self.local_rows[(p * self.locals.len() + t) * rows * L..][..rows * L].as_chunks().0
    }

    /// Returns the coefficients of a segment in all equations of some groups of a run, by group and local block.
    #[inline(always)]
    fn run_rows(&self, span: &SharedSpan, run: &Run, places: Range<usize>, rows: usize) -> PanelView<'_> {
        let Place { width: stride, rows: start, .. } = self.places[places.start];
        let values = &self.shared_rows[start + run.column..];
        let count = places.len() * self.locals.len() * rows;
        PanelView { at: span.row, rows: Rows { values, width: span.unknowns.len(), stride, count } }
    }

    /// Returns the shared parts of group `p` of the pattern.
    #[inline(always)]
    pub fn parts(&self, p: usize) -> &[Part] {
        &self.parts[self.places[p].parts.clone()]
    }

    /// Returns the coefficients of a part of group `p` of the pattern in a range of its equations, which are numbered by local block.
    #[inline(always)]
    pub fn part_rows(&self, p: usize, part: &Part, equations: Range<usize>) -> PanelView<'_> {
        let Place { width: stride, rows: start, .. } = self.places[p];
        let values = &self.shared_rows[start + equations.start * stride + part.column..];
        let at = self.spans[part.span].row + part.shift;
        PanelView { at, rows: Rows { values, width: part.width(), stride, count: equations.len() } }
    }
}
