//! Cofactors of local blocks and their equations, from the inverse over all coupled unknowns.

use pulp::{NullaryFnOnce, Simd};
use smallvec::{SmallVec, smallvec};

use crate::normals::batch::{Batch, MainBlock, Part};
use crate::normals::layout::Layout;
use crate::normals::vectorised::{Kernel, LANES, Rows, add_rows, copy_few, dot, run, size};

/// Cofactors of the local blocks at one supernode and of their equations, in the order of the incidence.
#[derive(Default)]
pub(in crate::normals) struct NodeCofactors {
    pub local: Vec<f64>,
    pub equations: Vec<f64>,
    /// Leverage matrices of the terms at this supernode, in order.
    pub terms: Vec<f64>,
    /// Leverage matrices of groups in the order of the incidence; empty if not requested.
    pub leverages: Vec<f64>,
    /// Computing time in seconds.
    pub seconds: f64,
}

/// Inverse over all unknowns coupled to the local blocks of a batch: main blocks in the order of the slots, then segments.
#[derive(Default)]
pub(super) struct CoupledInverse {
    /// First row in the front, first row here and width of each block.
    strips: Vec<(usize, usize, usize)>,
    width: usize,
    /// Row stride of the following matrices: full vectors, zero beyond the width.
    stride: usize,
    /// Q, the inverse over the coupled unknowns, full square, row by row, followed by zeros for vector loads.
    inverse: Vec<f64>,
    /// H = N_ll^-1 N_lo, row by row.
    h: Vec<f64>,
    /// H Q, row by row, followed by zeros.
    hq: Vec<f64>,
    /// Whether to compute leverage matrices of groups.
    by_group: bool,
}

/// Coefficients of two equations in consecutive unknowns.
#[derive(Clone, Copy)]
struct RowPair<'a> {
    /// Index of the first unknown in the coupled unknowns.
    start: usize,
    width: usize,
    /// Coefficients, followed by at least [`LANES`] readable elements.
    x: [&'a [f64]; 2],
}

impl<'a> RowPair<'a> {
    #[inline(always)]
    fn coefficients(&self) -> [&'a [f64]; 2] {
        self.x.map(|x| &x[..self.width])
    }
}

/// Group of equations: local block of the batch, slot, first coupled unknown of the slot, and indices in slot and pattern.
#[derive(Clone, Copy)]
struct Group<'a> {
    t: usize,
    main: &'a MainBlock,
    start: usize,
    k: usize,
    p: usize,
    rows: usize,
}

impl CoupledInverse {
    pub fn new(by_group: bool) -> Self {
        Self { by_group, ..Self::default() }
    }

    /// Collects the inverse over the unknowns coupled to a batch; reused if the previous batch has the same.
    pub fn gather(&mut self, batch: &Batch, front: &[f64], height: usize) {
        let main_blocks = batch.main_blocks.iter().map(|main| (main.row, main.dim));
        let spans = batch.spans.iter().map(|span| (span.row, span.unknowns.len()));
        let all = main_blocks.chain(spans);
        if self.strips.iter().map(|&(row, _, width)| (row, width)).eq(all.clone()) {
            return;
        }
        self.strips.clear();
        self.width = 0;
        for (row, width) in all {
            self.strips.push((row, self.width, width));
            self.width += width;
        }
        self.stride = self.width.next_multiple_of(LANES);
        self.h.clear();
        self.hq.clear();
        self.inverse.resize((self.width + 1) * self.stride, 0.0);
        self.inverse[self.width * self.stride..].fill(0.0);
        for &(from_column, to_column, columns) in &self.strips {
            for k in 0..columns {
                let source = &front[(from_column + k) * height..][..height];
                let target = &mut self.inverse[(to_column + k) * self.stride..][..self.stride];
                target.last_chunk_mut::<LANES>().into_iter().for_each(|end| *end = [0.0; LANES]);
                for &(from_row, to_row, rows) in &self.strips {
                    copy_few(&source[from_row..from_row + rows], &mut target[to_row..to_row + rows]);
                }
            }
        }
    }

    /// Computes cofactors. With H = N_ll^-1 N_lo and Q_oo the inverse over the others o: Q_ll = N_ll^-1 + H Q_oo H^T, Q_lo = -H Q_oo, and a
    /// Q a^T for each equation.
    pub fn cofactors(&mut self, batch: &Batch, layout: &Layout, found: &mut NodeCofactors) {
        run(layout, batch.retained_dim(), Find { others: self, batch, rows: layout.rows(), found });
    }

    #[inline(always)]
    fn cofactors_of<S: Simd, const R: usize, const L: usize, const D: usize>(
        &mut self,
        simd: S,
        batch: &Batch,
        t: usize,
        rows: usize,
        found: &mut NodeCofactors,
    ) {
        let rows = size::<R>(rows);
        let own = if batch.uncoupled {
            self.without_local::<L>()
        } else {
            simd.vectorize(OfLocal::<S, L> { simd, others: self, batch, t, found })
        };
        for (main, &(_, start, _)) in batch.main_blocks.iter().zip(&self.strips) {
            for (k, p) in main.groups.clone().enumerate() {
                let group = Group { t, main, start, k, p, rows };
                self.equations::<S, L, D>(simd, batch, group, &own, found);
            }
        }
    }

    /// Computes a Q a^T of each equation of a group and, if requested, a Q b^T of each pair.
    #[inline(always)]
    fn equations<S: Simd, const L: usize, const D: usize>(
        &self,
        simd: S,
        batch: &Batch,
        group: Group<'_>,
        own: &[[f64; L]; L],
        found: &mut NodeCofactors,
    ) {
        let (rows, last) = (group.rows, group.rows - 1);
        let (diagonal, block) = (found.equations.len(), found.leverages.len());
        found.equations.resize(diagonal + rows, 0.0);
        let count = if self.by_group { (rows * last / 2).max(1) } else { rows.div_ceil(2) };
        if self.by_group {
            found.leverages.resize(block + rows * rows, 0.0);
        }
        let [mut i, mut j] = [1.min(last), 0];
        for _ in 0..count {
            let leverages = self.leverages::<S, L, D>(simd, batch, group, [i, j], own);
            found.equations[diagonal + i] = leverages[0][0];
            found.equations[diagonal + j] = leverages[1][1];
            if self.by_group {
                for at in [i * rows + j, j * rows + i] {
                    found.leverages[block + at] = leverages[0][1];
                }
            }
            [i, j] = match self.by_group {
                true if j + 1 < i => [i, j + 1],
                true => [i + 1, 0],
                // Two equations at a time; the last of an odd number is paired with itself.
                false => [(j + 3).min(last), j + 2],
            };
        }
        if self.by_group {
            for i in 0..rows {
                found.leverages[block + i * (rows + 1)] = found.equations[diagonal + i];
            }
        }
    }

    /// Computes H = L^-T V for local block `t` of the batch.
    #[inline(always)]
    fn reduce<const L: usize>(&mut self, batch: &Batch, t: usize) {
        let stride = self.stride;
        self.h.resize(L * stride, 0.0);
        let main_blocks = batch.main_blocks.iter().map(|main| batch.main_coupling::<0>(main, L));
        let spans = batch.spans.iter().map(|span| batch.span_coupling(span, L));
        for (v, &(_, start, _)) in main_blocks.chain(spans).zip(&self.strips) {
            for d in 0..L {
                let row = &v.rows.values[(t * L + d) * v.rows.width..][..v.rows.width];
                copy_few(row, &mut self.h[d * stride + start..][..row.len()]);
            }
        }
        batch.triangles[t].backward::<L>(&mut self.h, stride);
    }

    /// Sets H and H Q of an independent group to zero, and returns zero as its Q_ll.
    fn without_local<const L: usize>(&mut self) -> [[f64; L]; L] {
        for (matrix, rows) in [(&mut self.h, L), (&mut self.hq, L + 1)] {
            matrix.clear();
            matrix.resize(rows * self.stride, 0.0);
        }
        [[0.0; L]; L]
    }

    /// Computes H Q.
    #[inline(always)]
    fn multiply<S: Simd, const L: usize>(&mut self, simd: S) {
        self.hq.resize((L + 1) * self.stride, 0.0);
        let (mut first, vectors) = (0, self.stride / S::F64_LANES);
        while first < vectors {
            // Five vectors are split into three and two, not four and one, for independent operations.
            first += match vectors - first {
                _ if const { S::F64_LANES == 1 } => self.multiply_vectors::<S, L, 1>(simd, first),
                1 => self.multiply_vectors::<S, L, 1>(simd, first),
                2 => self.multiply_vectors::<S, L, 2>(simd, first),
                3 | 5 | 6 => self.multiply_vectors::<S, L, 3>(simd, first),
                _ => self.multiply_vectors::<S, L, 4>(simd, first),
            };
        }
    }

    /// Computes V vectors of the columns of H Q; returns V.
    #[inline(always)]
    fn multiply_vectors<S: Simd, const L: usize, const V: usize>(&mut self, simd: S, first: usize) -> usize {
        let vectors = self.stride / S::F64_LANES;
        let h: [&[f64]; L] = std::array::from_fn(|d| &self.h[d * self.stride..][..self.width]);
        let mut sums = [[simd.splat_f64s(0.0); V]; L];
        let rows = S::as_simd_f64s(&self.inverse).0[first..].windows(V).step_by(vectors);
        for (i, row) in rows.take(self.width).enumerate() {
            for d in 0..L {
                let factor = simd.splat_f64s(h[d][i]);
                for v in 0..V {
                    sums[d][v] = simd.mul_add_f64s(row[v], factor, sums[d][v]);
                }
            }
        }
        let product = S::as_mut_simd_f64s(&mut self.hq).0;
        for d in 0..L {
            product[d * vectors + first..][..V].copy_from_slice(&sums[d]);
        }
        V
    }

    /// Computes Q_ll of local block `t` of the batch.
    #[inline(always)]
    fn own<S: Simd, const L: usize>(
        &self,
        simd: S,
        batch: &Batch,
        t: usize,
        found: &mut NodeCofactors,
    ) -> [[f64; L]; L] {
        let mut own = [[0.0; L]; L];
        for a in 0..L {
            let mut unit = [0.0; L];
            unit[a] = 1.0;
            batch.triangles[t].forward::<L>(&mut unit, 1);
            batch.triangles[t].backward::<L>(&mut unit, 1);
            let hq = S::as_simd_f64s(&self.hq[a * self.stride..][..self.stride]).0;
            for b in 0..=a {
                let h = S::as_simd_f64s(&self.h[b * self.stride..][..self.stride]).0;
                let mut sum = simd.splat_f64s(0.0);
                for (x, y) in hq.iter().zip(h) {
                    sum = simd.mul_add_f64s(*x, *y, sum);
                }
                let value = unit[b] + simd.reduce_sum_f64s(sum);
                (own[a][b], own[b][a]) = (value, value);
            }
        }
        found.local.extend_from_slice(own.as_flattened());
        own
    }

    /// Computes a Q b^T of all pairs of two rows of a group.
    #[inline(always)]
    fn leverages<S: Simd, const L: usize, const D: usize>(
        &self,
        simd: S,
        batch: &Batch,
        group: Group<'_>,
        picked: [usize; 2],
        own: &[[f64; L]; L],
    ) -> [[f64; 2]; 2] {
        let Group { t, main, start, k, p, rows } = group;
        let dim = size::<D>(main.dim);
        let local = batch.local_rows::<L>(t, p, rows);
        let local = picked.map(|row| &local[row]);
        let at = (t * main.groups.len() + k) * rows;
        let coefficients = &batch.main_rows::<D>(main, rows).rows.values[at * dim..];
        let retained = RowPair { start, width: dim, x: picked.map(|row| &coefficients[row * dim..]) };
        let mut form = [[simd.splat_f64s(0.0); 2]; 2];
        self.add_unknowns(simd, &mut form, local, &[], retained);
        if !batch.parts(p).is_empty() {
            let form = &mut form;
            simd.vectorize(OfShared { simd, others: self, batch, group, picked, local, retained, form });
        }
        let mut found = [[0.0; 2]; 2];
        for i in 0..2 {
            for j in 0..2 {
                found[i][j] = 0.5 * simd.reduce_sum_f64s(simd.add_f64s(form[i][j], form[j][i]));
                for d in 0..L {
                    found[i][j] += local[i][d] * dot(&own[d], local[j]);
                }
            }
        }
        found
    }

    /// Returns the coefficients of a shared part of a group in two of its rows.
    #[inline(always)]
    fn shared<'s>(
        &self,
        batch: &'s Batch,
        Group { t, p, rows, .. }: Group<'_>,
        picked: [usize; 2],
        part: &Part,
    ) -> RowPair<'s> {
        let Rows { values, width, stride, .. } = batch.part_rows(p, part, t * rows..(t + 1) * rows).rows;
        let start = self.strips[batch.main_blocks.len() + part.span].1 + part.shift;
        RowPair { start, width, x: picked.map(|row| &values[row * stride..]) }
    }

    /// Adds the contribution of coefficients x of further unknowns to a Q a^T: (x Q + 2 y Q - 2 a H Q) x^T, in lanes. Here a belongs to the
    /// local unknowns, and y to unknowns added before. The contribution to a Q b^T is the mean of two elements.
    #[inline(always)]
    fn add_unknowns<S: Simd, const L: usize>(
        &self,
        simd: S,
        form: &mut [[S::f64s; 2]; 2],
        a: [&[f64; L]; 2],
        before: &[RowPair<'_>],
        own: RowPair<'_>,
    ) {
        let (stride, two) = (self.stride, simd.splat_f64s(2.0));
        for first in (0..own.width).step_by(LANES) {
            let column = own.start + first;
            let rows = |start: usize| &self.inverse[start * stride + column..];
            let [mut local, mut others, mut along] = [[[simd.splat_f64s(0.0); LANES]; 2]; 3];
            add_rows(simd, &mut local, &self.hq[column..], stride, a.map(|a| &a[..]));
            for pair in before {
                add_rows(simd, &mut others, rows(pair.start), stride, pair.coefficients());
            }
            add_rows(simd, &mut along, rows(own.start), stride, own.coefficients());
            for k in 0..LANES / S::F64_LANES {
                let places = S::as_simd_f64s(&PLACES).0[k];
                let within = simd.less_than_f64s(places, simd.splat_f64s((own.width - first) as f64));
                for j in 0..2 {
                    let x = S::as_simd_f64s(&own.x[j][first..][..LANES]).0[k];
                    let x = simd.select_f64s(within, x, simd.splat_f64s(0.0));
                    for i in 0..2 {
                        let twice = simd.mul_f64s(simd.sub_f64s(others[i][k], local[i][k]), two);
                        let sum = simd.add_f64s(along[i][k], twice);
                        form[i][j] = simd.mul_add_f64s(sum, x, form[i][j]);
                    }
                }
            }
        }
    }
}

/// Computation of Q_ll, H and H Q of a local block, compiled once for all sizes of retained blocks.
struct OfLocal<'a, S, const L: usize> {
    simd: S,
    others: &'a mut CoupledInverse,
    batch: &'a Batch,
    t: usize,
    found: &'a mut NodeCofactors,
}

impl<S: Simd, const L: usize> NullaryFnOnce for OfLocal<'_, S, L> {
    type Output = [[f64; L]; L];

    #[inline(always)]
    fn call(self) -> Self::Output {
        let Self { simd, others, batch, t, found } = self;
        others.reduce::<L>(batch, t);
        others.multiply::<S, L>(simd);
        others.own::<S, L>(simd, batch, t, found)
    }
}

/// Contribution of shared coefficients to the leverages of two rows of a group, compiled once for all sizes.
struct OfShared<'a, 'b, S: Simd, const L: usize> {
    simd: S,
    others: &'a CoupledInverse,
    batch: &'b Batch,
    group: Group<'b>,
    picked: [usize; 2],
    local: [&'a [f64; L]; 2],
    retained: RowPair<'b>,
    form: &'a mut [[S::f64s; 2]; 2],
}

impl<S: Simd, const L: usize> NullaryFnOnce for OfShared<'_, '_, S, L> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { simd, others, batch, group, picked, local, retained, form } = self;
        let mut before: SmallVec<[_; 4]> = smallvec![retained];
        for part in batch.parts(group.p) {
            let shared = others.shared(batch, group, picked, part);
            others.add_unknowns(simd, form, local, &before, shared);
            before.push(shared);
        }
    }
}

/// Indices of the lanes.
const PLACES: [f64; LANES] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

struct Find<'a> {
    others: &'a mut CoupledInverse,
    batch: &'a Batch,
    rows: usize,
    found: &'a mut NodeCofactors,
}

impl Kernel for Find<'_> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const L: usize, const D: usize>(self, simd: S) {
        for t in 0..self.batch.locals.len() {
            self.others.cofactors_of::<S, R, L, D>(simd, self.batch, t, self.rows, self.found);
        }
    }
}
