//! Local blocks whose equations touch the same unknowns, gathered and eliminated side by side.

use std::ops::Range;

use pulp::Simd;

use super::equations::{Equations, GroupRows, Prior};
use super::front::{Columns, Strip};
use super::layout::Layout;
use super::system::System;
use super::triangle::Triangle;
use super::vectorised::{Kernel, LANES, Rows, run, run_unsized, size};

/// A kept block that the local blocks are tied to.
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
    kept: usize,
    coupling: usize,
}

/// A group of equations in the pattern.
#[derive(Debug, Clone)]
pub(super) struct Place {
    /// The part of the border that it touches.
    pub border: Range<usize>,
    /// The segment that this part lies in.
    pub segment: usize,
    rows: usize,
}

/// Consecutive unknowns of the border that the local blocks are tied to.
#[derive(Debug, Clone)]
pub(super) struct Segment {
    /// Counted from the start of the border.
    pub border: Range<usize>,
    coupling: usize,
}

/// The equations of some local blocks of one pattern and what their elimination leaves: for each of them, with N = L L^T its
/// normal matrix, v = L^-1 n and V = L^-1 N_local,other. The normal equations of the others lose V^T V, their right-hand side V^T v.
///
/// What belongs to one kept block stands together, local block by local block.
#[derive(Debug, Default)]
pub(super) struct Stack {
    pub locals: Vec<u32>,
    pub slots: Vec<Slot>,
    pub places: Vec<Place>,
    pub segments: Vec<Segment>,
    pub triangles: Vec<Triangle>,
    /// Sum of squares of the right-hand sides of the equations.
    pub sum_of_squares: f64,
    /// Sum of |v|^2: the decrease of the sum of squares that the local unknowns bring about.
    pub decrease: f64,
    /// Local blocks that their equations do not determine.
    pub deficient: Vec<usize>,
    constants: Vec<f64>,
    local_rows: Vec<f64>,
    kept_rows: Vec<f64>,
    border_rows: Vec<f64>,
    coupling: Vec<f64>,
    reduced: Vec<f64>,
}

impl Stack {
    /// Gathers the equations of local blocks of one pattern.
    pub fn gather(&mut self, system: &System, equations: &impl Equations, locals: &[u32]) {
        self.place(system, locals);
        run_unsized(Gather { stack: self, system, equations });
    }

    #[inline(always)]
    fn write(&mut self, system: &System, equations: &impl Equations) {
        let (rows, l) = (system.layout.rows(), system.layout.local_dim());
        for (t, &local) in self.locals.iter().enumerate() {
            let groups = system.incidence.groups_of(&system.layout, local as usize);
            for slot in &self.slots {
                for (k, p) in slot.groups.clone().enumerate() {
                    let (at, place) = (t * slot.groups.len() + k, &self.places[p]);
                    let width = place.border.len();
                    let mut part = GroupRows {
                        constant: &mut self.constants[slot.constants + at * rows..][..rows],
                        local: &mut self.local_rows[(t * groups.len() + p) * rows * l..][..rows * l],
                        kept: &mut self.kept_rows[slot.kept + at * rows * slot.dim..][..rows * slot.dim],
                        border: &mut self.border_rows[place.rows + t * rows * width..][..rows * width],
                    };
                    equations.write(local as usize, groups[p] as usize, &mut part);
                }
            }
        }
    }

    /// Lays out the buffers for local blocks of one pattern.
    fn place(&mut self, system: &System, locals: &[u32]) {
        let (layout, symbolic) = (&system.layout, &*system.symbolic);
        let (rows, l, depth) = (layout.rows(), layout.local_dim(), locals.len());
        self.locals.clear();
        self.locals.extend_from_slice(locals);
        self.slots.clear();
        self.places.clear();
        let Some(&first) = locals.first() else { return };
        let groups = system.incidence.groups_of(layout, first as usize);
        let positions = system.incidence.positions_of(layout, first as usize);
        let home = positions.first().map_or(0, |&position| symbolic.supernode_of(position as usize));
        let mut border_rows = 0;
        for (p, (&group, &position)) in groups.iter().zip(positions).enumerate() {
            match self.slots.last_mut() {
                Some(slot) if slot.position == position as usize => slot.groups.end += 1,
                _ => self.slots.push(Slot {
                    position: position as usize,
                    // Every kept block of a local block is in the pattern of its home.
                    row: symbolic.panel_row(home, position as usize).unwrap_or_default(),
                    dim: symbolic.dim(position as usize),
                    groups: p..p + 1,
                    constants: 0,
                    kept: 0,
                    coupling: 0,
                }),
            }
            let border = layout.border_of(group as usize);
            let width = border.len();
            self.places.push(Place { border, segment: 0, rows: border_rows });
            border_rows += depth * rows * width;
        }
        let (mut kept, mut coupling) = (0, 0);
        for slot in &mut self.slots {
            slot.constants = slot.groups.start * rows * depth;
            (slot.kept, slot.coupling) = (kept, coupling);
            kept += slot.groups.len() * rows * depth * slot.dim;
            coupling += l * depth * slot.dim;
        }
        coupling = self.place_segments(l * depth, coupling);
        self.constants.resize(groups.len() * rows * depth, 0.0);
        self.local_rows.resize(groups.len() * rows * depth * l, 0.0);
        // Products read beyond the end.
        self.kept_rows.resize(kept + LANES, 0.0);
        self.border_rows.resize(border_rows + LANES, 0.0);
        self.coupling.resize(coupling + LANES, 0.0);
        self.reduced.resize(l * depth, 0.0);
        self.triangles.resize(depth, Triangle::default());
    }

    /// Unites the parts of the border that the groups touch; each segment takes `depth` rows of the coupling from `start` on.
    fn place_segments(&mut self, depth: usize, start: usize) -> usize {
        self.segments.clear();
        let mut parts: Vec<Range<usize>> =
            self.places.iter().map(|place| place.border.clone()).filter(|part| !part.is_empty()).collect();
        parts.sort_unstable_by_key(|part| part.start);
        for part in parts {
            match self.segments.last_mut() {
                Some(last) if part.start <= last.border.end => {
                    last.border.end = last.border.end.max(part.end)
                }
                _ => self.segments.push(Segment { border: part, coupling: 0 }),
            }
        }
        let mut coupling = start;
        for segment in &mut self.segments {
            segment.coupling = coupling;
            coupling += depth * segment.border.len();
        }
        for place in &mut self.places {
            let after = self.segments.partition_point(|segment| segment.border.start <= place.border.start);
            place.segment = after.saturating_sub(1);
        }
        coupling
    }

    /// Unknowns of every kept block that the local blocks are tied to, where all have the same number: kernels are chosen by it.
    pub fn kept_dim(&self) -> Option<usize> {
        let dim = self.slots.first()?.dim;
        self.slots.iter().all(|slot| slot.dim == dim).then_some(dim)
    }

    /// Eliminates the unknowns of the local blocks. `damping` is added to the diagonal of each as a fraction of it.
    pub fn eliminate(&mut self, layout: &Layout, prior: &Prior, damping: f64) {
        (self.sum_of_squares, self.decrease) = (0.0, 0.0);
        self.deficient.clear();
        run(layout, self.kept_dim(), Eliminate { stack: self, layout, prior, damping });
    }

    #[inline(always)]
    fn eliminate_one<const L: usize, const D: usize>(
        &mut self,
        t: usize,
        rows: usize,
        mut normal: [[f64; L]; L],
        mut right: [f64; L],
        damping: f64,
    ) {
        for slot in &self.slots {
            for (k, p) in slot.groups.clone().enumerate() {
                let constants =
                    &self.constants[slot.constants + (t * slot.groups.len() + k) * rows..][..rows];
                let own = &self.local_rows[(t * self.places.len() + p) * rows * L..][..rows * L];
                for (row, constant) in own.as_chunks::<L>().0.iter().zip(constants) {
                    for a in 0..L {
                        right[a] += row[a] * constant;
                        for b in 0..=a {
                            normal[a][b] += row[a] * row[b];
                        }
                    }
                    self.sum_of_squares += constant * constant;
                }
            }
        }
        (0..L).for_each(|d| normal[d][d] *= 1.0 + damping);
        let mut triangle = Triangle::default();
        if !triangle.factor(&normal) {
            self.deficient.push(self.locals[t] as usize);
        }
        triangle.forward::<L>(&mut right, 1);
        self.decrease += right.iter().map(|v| v * v).sum::<f64>();
        self.reduced[t * L..][..L].copy_from_slice(&right);
        self.couple::<L, D>(t, rows, &triangle);
        self.triangles[t] = triangle;
    }

    /// Computes the coupling V of local block `t` of the stack to the kept blocks and the border.
    #[inline(always)]
    fn couple<const L: usize, const D: usize>(&mut self, t: usize, rows: usize, triangle: &Triangle) {
        for slot in &self.slots {
            let dim = size::<D>(slot.dim);
            let coupling = &mut self.coupling[slot.coupling + t * L * dim..][..L * dim];
            coupling.fill(0.0);
            for (k, p) in slot.groups.clone().enumerate() {
                let own = &self.local_rows[(t * self.places.len() + p) * rows * L..][..rows * L];
                let at = slot.kept + (t * slot.groups.len() + k) * rows * dim;
                add_product::<L>(coupling, dim, 0, own, &self.kept_rows[at..][..rows * dim], dim);
            }
            triangle.forward::<L>(coupling, dim);
        }
        for segment in &self.segments {
            let width = segment.border.len();
            self.coupling[segment.coupling + t * L * width..][..L * width].fill(0.0);
        }
        for (p, place) in self.places.iter().enumerate().filter(|(_, place)| !place.border.is_empty()) {
            let segment = &self.segments[place.segment];
            let (stride, width) = (segment.border.len(), place.border.len());
            let own = &self.local_rows[(t * self.places.len() + p) * rows * L..][..rows * L];
            let common = &self.border_rows[place.rows + t * rows * width..][..rows * width];
            let coupling = &mut self.coupling[segment.coupling + t * L * stride..][..L * stride];
            add_product::<L>(coupling, stride, place.border.start - segment.border.start, own, common, width);
        }
        for segment in &self.segments {
            let width = segment.border.len();
            triangle.forward::<L>(&mut self.coupling[segment.coupling + t * L * width..][..L * width], width);
        }
    }

    /// Adds what the elimination leaves to columns of the front of the home; `border` is the first row of the border there.
    pub fn add_to(&self, columns: &mut Columns<'_>, layout: &Layout, border: usize) {
        run(layout, self.kept_dim(), AddTo { stack: self, columns, rows: layout.rows(), border });
    }

    #[inline(always)]
    fn add_sized<S: Simd, const L: usize, const D: usize>(
        &self,
        simd: S,
        columns: &mut Columns<'_>,
        rows: usize,
        border: usize,
    ) {
        for (index, slot) in self.slots.iter().enumerate() {
            if !columns.contain(slot.row) {
                continue;
            }
            let v = self.slot_coupling::<L, D>(slot);
            let own = self.slot_rows::<D>(slot, rows);
            let constants = &self.constants[slot.constants..][..slot.groups.len() * self.locals.len() * rows];
            columns.add_difference(simd, own, v, self.locals.len());
            columns.add_diagonal::<D>(own);
            columns.add_right::<D>(1.0, own, constants);
            columns.add_right::<D>(-1.0, v, &self.reduced);
            for other in &self.slots[index + 1..] {
                columns.add_product(simd, -1.0, self.slot_coupling::<L, D>(other), v);
            }
            for segment in &self.segments {
                columns.add_product(simd, -1.0, self.segment_coupling::<L>(segment, border), v);
            }
            for (k, p) in slot.groups.clone().enumerate() {
                self.add_border_by_kept(simd, columns, slot, k, p, rows, border);
            }
        }
        if columns.contain(border) && !self.segments.is_empty() {
            self.add_border::<S, L>(simd, columns, rows, border);
        }
    }

    /// Adds the products of the coefficients of the border and of a kept block in group `k` of that block, `p` of the pattern.
    #[inline(always)]
    fn add_border_by_kept<S: Simd>(
        &self,
        simd: S,
        columns: &mut Columns<'_>,
        slot: &Slot,
        k: usize,
        p: usize,
        rows: usize,
        border: usize,
    ) {
        let place = &self.places[p];
        let width = place.border.len();
        for t in (0..self.locals.len()).filter(|_| width > 0) {
            let at = slot.kept + (t * slot.groups.len() + k) * rows * slot.dim;
            let kept = Rows { values: &self.kept_rows[at..], width: slot.dim, count: rows };
            let common = self.border_strip(t, p, rows, border);
            columns.add_product(simd, 1.0, common, Strip { at: slot.row, rows: kept });
        }
    }

    /// Adds the part of the border itself.
    #[inline(always)]
    fn add_border<S: Simd, const L: usize>(
        &self,
        simd: S,
        columns: &mut Columns<'_>,
        rows: usize,
        border: usize,
    ) {
        for slot in &self.slots {
            for (k, p) in slot.groups.clone().enumerate().filter(|&(_, p)| !self.places[p].border.is_empty())
            {
                for t in 0..self.locals.len() {
                    let own = self.border_strip(t, p, rows, border);
                    let at = slot.constants + (t * slot.groups.len() + k) * rows;
                    columns.add_product(simd, 1.0, own, own);
                    columns.add_diagonal::<0>(own);
                    columns.add_right::<0>(1.0, own, &self.constants[at..][..rows]);
                }
            }
        }
        for (index, segment) in self.segments.iter().enumerate() {
            let v = self.segment_coupling::<L>(segment, border);
            columns.add_right::<0>(-1.0, v, &self.reduced);
            for other in &self.segments[index..] {
                columns.add_product(simd, -1.0, self.segment_coupling::<L>(other, border), v);
            }
        }
    }

    /// Solves for the local blocks with the others in place: N x = A^T (l - A_other x_other). `others` are the unknowns that are
    /// not local, in the order of elimination; the solutions are added to `found`, one after the other.
    pub fn solve(&self, system: &System, prior: &Prior, damping: f64, others: &[f64], found: &mut Vec<f64>) {
        run(&system.layout, self.kept_dim(), Solve { stack: self, system, prior, damping, others, found });
    }

    #[inline(always)]
    fn solve_one<'a, const L: usize, const D: usize>(
        &self,
        t: usize,
        rows: usize,
        (mut normal, mut right): ([[f64; L]; L], [f64; L]),
        damping: f64,
        others: impl Fn(&Slot) -> &'a [f64],
        border: &[f64],
    ) -> [f64; L] {
        for slot in &self.slots {
            let dim = size::<D>(slot.dim);
            let other = &others(slot)[..dim];
            for (k, p) in slot.groups.clone().enumerate() {
                let common = &border[self.places[p].border.clone()];
                let common_rows = self.border_rows(t, p, rows);
                let own = self.local_rows::<L>(t, p, rows);
                for row in 0..rows {
                    let at = (t * slot.groups.len() + k) * rows + row;
                    let left = self.constants[slot.constants + at]
                        - dot(&self.kept_rows[slot.kept + at * dim..][..dim], other)
                        - dot(&common_rows[row * common.len()..][..common.len()], common);
                    for a in 0..L {
                        right[a] += own[row][a] * left;
                        (0..=a).for_each(|b| normal[a][b] += own[row][a] * own[row][b]);
                    }
                }
            }
        }
        (0..L).for_each(|d| normal[d][d] *= 1.0 + damping);
        let mut triangle = Triangle::default();
        // Whether it is regular the elimination has found out.
        triangle.factor(&normal);
        triangle.forward::<L>(&mut right, 1);
        triangle.backward::<L>(&mut right, 1);
        right
    }

    /// The coupling to a kept block, local block by local block.
    #[inline(always)]
    pub fn slot_coupling<const L: usize, const D: usize>(&self, slot: &Slot) -> Strip<'_> {
        let (width, count) = (size::<D>(slot.dim), self.locals.len() * L);
        Strip { at: slot.row, rows: Rows { values: &self.coupling[slot.coupling..], width, count } }
    }

    /// The coupling to a segment of the border, local block by local block.
    #[inline(always)]
    pub fn segment_coupling<const L: usize>(&self, segment: &Segment, border: usize) -> Strip<'_> {
        let (width, count) = (segment.border.len(), self.locals.len() * L);
        let rows = Rows { values: &self.coupling[segment.coupling..], width, count };
        Strip { at: border + segment.border.start, rows }
    }

    /// The coefficients of a kept block in all its equations, local block by local block.
    #[inline(always)]
    pub fn slot_rows<const D: usize>(&self, slot: &Slot, rows: usize) -> Strip<'_> {
        let (width, count) = (size::<D>(slot.dim), slot.groups.len() * self.locals.len() * rows);
        Strip { at: slot.row, rows: Rows { values: &self.kept_rows[slot.kept..], width, count } }
    }

    /// The coefficients of the border in group `p` of the pattern, for local block `t` of the stack.
    #[inline(always)]
    fn border_strip(&self, t: usize, p: usize, rows: usize, border: usize) -> Strip<'_> {
        let place = &self.places[p];
        let width = place.border.len();
        let values = &self.border_rows[place.rows + t * rows * width..];
        Strip { at: border + place.border.start, rows: Rows { values, width, count: rows } }
    }

    /// The coefficients of local block `t` of the stack in group `p` of the pattern.
    #[inline(always)]
    pub fn local_rows<const L: usize>(&self, t: usize, p: usize, rows: usize) -> &[[f64; L]] {
        self.local_rows[(t * self.places.len() + p) * rows * L..][..rows * L].as_chunks().0
    }

    /// The coefficients of the border in group `p` of the pattern, for local block `t` of the stack.
    #[inline(always)]
    pub fn border_rows(&self, t: usize, p: usize, rows: usize) -> &[f64] {
        let place = &self.places[p];
        let width = place.border.len();
        &self.border_rows[place.rows + t * rows * width..][..rows * width]
    }
}

struct Gather<'a, E> {
    stack: &'a mut Stack,
    system: &'a System,
    equations: &'a E,
}

impl<E: Equations> Kernel for Gather<'_, E> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const L: usize, const D: usize>(self, _: S) {
        self.stack.write(self.system, self.equations);
    }
}

struct Eliminate<'a> {
    stack: &'a mut Stack,
    layout: &'a Layout,
    prior: &'a Prior,
    damping: f64,
}

impl Kernel for Eliminate<'_> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const L: usize, const D: usize>(self, _: S) {
        for t in 0..self.stack.locals.len() {
            let (normal, right) = self.prior.of_local::<L>(self.layout, self.stack.locals[t] as usize);
            self.stack.eliminate_one::<L, D>(t, size::<R>(self.layout.rows()), normal, right, self.damping);
        }
    }
}

struct AddTo<'a, 'b> {
    stack: &'a Stack,
    columns: &'a mut Columns<'b>,
    rows: usize,
    border: usize,
}

impl Kernel for AddTo<'_, '_> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const L: usize, const D: usize>(self, simd: S) {
        self.stack.add_sized::<S, L, D>(simd, self.columns, size::<R>(self.rows), self.border);
    }
}

struct Solve<'a> {
    stack: &'a Stack,
    system: &'a System,
    prior: &'a Prior,
    damping: f64,
    others: &'a [f64],
    found: &'a mut Vec<f64>,
}

impl Kernel for Solve<'_> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const L: usize, const D: usize>(self, _: S) {
        let (layout, others) = (&self.system.layout, self.others);
        let border = &others[others.len() - layout.border_dim()..];
        let kept = |slot: &Slot| &others[self.system.symbolic.range(slot.position)];
        for t in 0..self.stack.locals.len() {
            let start = self.prior.of_local::<L>(layout, self.stack.locals[t] as usize);
            let x =
                self.stack.solve_one::<L, D>(t, size::<R>(layout.rows()), start, self.damping, kept, border);
            self.found.extend_from_slice(&x);
        }
    }
}

/// target[d][first + c] += sum over rows of local[row][d] * other[row][c].
#[inline(always)]
fn add_product<const L: usize>(
    target: &mut [f64],
    stride: usize,
    first: usize,
    local: &[f64],
    other: &[f64],
    width: usize,
) {
    for (row, values) in local.chunks_exact(L).zip(other.chunks_exact(width.max(1))) {
        for d in 0..L {
            for (sum, value) in target[d * stride + first..][..width].iter_mut().zip(values) {
                *sum += row[d] * value;
            }
        }
    }
}

#[inline(always)]
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}
