//! Additional parameters of the computed observations, l = A x + C d + v: how well the residuals test them, what they would be, and what
//! they would change, from one factor and without adjusting again.
//!
//! With weights P and cofactors Q of the unknowns: score u = C^T P v, right-hand sides N = A^T P C, redundancy R = C^T P C - N^T Q N
//! (Baarda 1968; Förstner 1983). If the observations have the error C d, the unknowns change by Q N d. Local blocks are eliminated as they
//! are formed, so that only unknowns of retained blocks are solved for.

use std::ops::Range;

use nalgebra::{DMatrix, DMatrixView, DVector};
use pulp::{Arch, Simd, WithSimd};

use super::equations::{EquationOf, ObservationEquations, Row};
use super::group_test::SmallVector;
use super::linearized::Linearized;
use super::problem::AnyProblem;
use super::walk::Buffers;
use crate::normals::{LANES, Layout};
use crate::{Threads, parallel};

/// An observation equation of unit weight.
#[derive(Debug, Clone, Copy)]
pub struct Equation<'a> {
    /// Its observation.
    pub of: EquationOf,
    /// Standard deviation of the observation; 1 if its components are weighted together.
    pub sd: f64,
    pub(super) row: &'a Row<'a>,
}

impl Equation<'_> {
    /// Unknowns, fixed ones among them, with their coefficients.
    pub fn coefficients(&self) -> impl Iterator<Item = (usize, f64)> {
        self.row.entries()
    }
}

/// Additional parameters: which computed observations depend on them, and how.
pub trait AdditionalParameters: Sync {
    /// Number of parameters.
    fn count(&self) -> usize;

    /// The local blocks whose observations, or whose unknowns as observations, depend on any of them; None for all.
    fn locals(&self) -> Option<Vec<usize>>;

    /// Appends the parameters that an equation depends on, with its partials in unit weight. The equations of a group follow each other.
    fn partials(&self, equation: &Equation<'_>, shared: &mut Shared, partials: &mut Vec<(usize, f64)>);
}

/// Values that are computed once for all equations of a group.
#[derive(Debug, Default)]
pub struct Shared {
    /// The group.
    pub group: Option<usize>,
    /// Its values.
    pub values: Vec<f64>,
}

/// Sums over all observations that test additional parameters.
#[derive(Debug)]
pub struct Additional {
    /// u = C^T P v.
    pub score: DVector<f64>,
    /// C^T P C.
    pub squares: DMatrix<f64>,
    /// R = C^T P Q_vv P C.
    pub redundancy: DMatrix<f64>,
    /// By how much each unknown that is not local changes with an error of each parameter, a column per parameter.
    pub effects: DMatrix<f64>,
    /// Number of observations that depend on each.
    pub observations: Vec<usize>,
}

/// The equations of a local block.
#[derive(Default)]
pub(super) struct LocalRows {
    /// Number of unknowns of the block.
    width: usize,
    /// The observation of each equation.
    of: Vec<EquationOf>,
    /// Of each equation: observed minus computed; the coefficients of the unknowns of the block.
    constants: Vec<f64>,
    own: Vec<f64>,
    /// Where the coefficients of other unknowns, and the partials by the parameters, of each equation end.
    ends: Vec<(usize, usize)>,
    others: Vec<(usize, f64)>,
    partials: Vec<(usize, f64)>,
    /// Room for the partials of one equation.
    scratch: Vec<(usize, f64)>,
    shared: Shared,
}

/// A problem at given values with additional parameters.
pub(super) struct Extended<'a> {
    equations: ObservationEquations<'a>,
    fixed: Vec<bool>,
    parameters: &'a dyn AdditionalParameters,
}

impl LocalRows {
    /// Number of unknowns of the block.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Coefficients of the unknowns of the block in each equation.
    pub fn own(&self) -> &[f64] {
        &self.own
    }

    /// The observation of each equation.
    pub fn of(&self) -> &[EquationOf] {
        &self.of
    }

    fn clear(&mut self, width: usize) {
        self.width = width;
        self.of.clear();
        self.constants.clear();
        self.own.clear();
        self.ends.clear();
        self.others.clear();
        self.partials.clear();
    }

    /// Adds an equation; `first` is the first unknown of the block.
    fn push(&mut self, to: &Extended<'_>, row: &Row<'_>, first: usize) {
        let Self { width, of: all, constants, own, ends, others, partials, scratch, shared } = self;
        let (of, sd) = (row.of, to.equations.deviation(row.number));
        all.push(of);
        scratch.clear();
        to.parameters.partials(&Equation { of, sd, row }, shared, scratch);
        // All rows of a term, whose components are whitened together, depend on the same parameters.
        let is_term = matches!(of, EquationOf::Term { .. });
        partials.extend(scratch.iter().filter(|partial| is_term || partial.1 != 0.0));
        let start = own.len();
        own.resize(start + *width, 0.0);
        row.entries().filter(|own| !to.fixed[own.0]).for_each(|(unknown, value)| {
            match unknown.checked_sub(first) {
                Some(k) if k < *width => own[start + k] = value,
                _ => others.push((unknown, value)),
            }
        });
        constants.push(row.constant);
        ends.push((others.len(), partials.len()));
    }

    /// Each equation: observed minus computed, its coefficients of the block and of others, its partials.
    #[allow(clippy::type_complexity, reason = "the parts of an equation")]
    pub fn rows(&self) -> impl Iterator<Item = (f64, &[f64], &[(usize, f64)], &[(usize, f64)])> {
        self.constants.iter().enumerate().map(|(k, &constant)| {
            let (others, partials) = if k == 0 { (0, 0) } else { self.ends[k - 1] };
            let ends = self.ends[k];
            let own = &self.own[k * self.width..][..self.width];
            (constant, own, &self.others[others..ends.0], &self.partials[partials..ends.1])
        })
    }
}

impl<'a> Extended<'a> {
    /// Adds parameters to equations at values with some unknowns constrained.
    pub fn new(
        equations: ObservationEquations<'a>,
        held: &[usize],
        parameters: &'a dyn AdditionalParameters,
    ) -> Self {
        let fixed = equations.problem().fixed(held);
        Self { equations: equations.with_fixed_columns(), fixed, parameters }
    }

    /// Writes the equations of a local block: its groups, its terms and its unknowns as observations.
    pub fn write(&self, buffers: &mut Buffers, local: usize, rows: &mut LocalRows) {
        let range = self.equations.problem().layout().local_range(local);
        rows.clear(range.len());
        self.equations.each_row_of_local(buffers, local, |row| rows.push(self, row, range.start));
    }

    /// Calls `add` with each equation of retained blocks, as a block without unknowns of its own: terms, then unknowns as observations.
    pub fn each_retained(&self, mut add: impl FnMut(&LocalRows)) {
        let first = self.equations.problem().layout().all_locals().end;
        let mut rows = LocalRows::default();
        self.equations.each_other_row(true, |row| {
            rows.clear(0);
            rows.push(self, row, first);
            add(&rows);
        });
    }

    /// The inverse of the normal matrix of a local block; zero if it has none.
    pub fn inverse(&self, local: usize, rows: &LocalRows) -> SmallVector {
        match rows.width {
            // Points: with a constant size, loops are unrolled.
            3 => self.inverse_of::<3>(local, rows),
            _ => self.inverse_of::<0>(local, rows),
        }
    }

    fn inverse_of<const D: usize>(&self, local: usize, rows: &LocalRows) -> SmallVector {
        let range = self.equations.problem().layout().local_range(local);
        let count = if D > 0 { D } else { range.len() };
        let mut normal = SmallVector::from_elem(0.0, count * count);
        for (_, own, ..) in rows.rows() {
            for (a, row) in own.iter().zip(normal.chunks_exact_mut(count)) {
                row.iter_mut().zip(own).for_each(|(sum, b)| *sum += a * b);
            }
        }
        range
            .enumerate()
            .filter(|(_, unknown)| self.fixed[*unknown])
            .for_each(|(k, _)| normal[k * count + k] = 1.0);
        invert(&mut normal, count);
        normal
    }
}

/// Inverts a positive definite matrix by exchanging each unknown with its equation; sets others to zero.
#[inline(always)]
fn invert(matrix: &mut [f64], count: usize) {
    for k in 0..count {
        let pivot = matrix[k * count + k];
        if pivot.is_nan() || pivot <= 0.0 {
            return matrix.fill(0.0);
        }
        matrix[k * count + k] = 1.0;
        matrix[k * count..][..count].iter_mut().for_each(|value| *value /= pivot);
        for i in (0..count).filter(|&i| i != k) {
            let factor = std::mem::take(&mut matrix[i * count + k]);
            (0..count).for_each(|j| matrix[i * count + j] -= factor * matrix[k * count + j]);
        }
    }
}

/// The sums over some observations. Matrices are stored row by row; parameters are numbered as they appear, because those on which most
/// equations depend then stand together.
struct Sums {
    /// Number of each parameter, and the parameters by their numbers.
    numbers: Vec<u32>,
    parameters: Vec<usize>,
    observations: Vec<usize>,
    /// Length of the rows: the number of parameters and zeros, a multiple of the lanes.
    stride: usize,
    score: Vec<f64>,
    squares: Vec<f64>,
    /// What local blocks take up of the squares.
    entries: Vec<f64>,
    /// Right-hand sides of unknowns that are not local: a row for each of these unknowns, which are numbered as they appear.
    rights: Vec<f64>,
    places: Vec<u32>,
    unknowns: Vec<usize>,
    /// First unknown that is not local.
    first: usize,
}

/// Buffers of a thread for the equations of one block: their partials, right-hand sides of its unknowns, and solutions, row by row.
#[derive(Default)]
struct Work {
    partials: Vec<f64>,
    right: Vec<f64>,
    solved: Vec<f64>,
}

/// A number that is not given yet.
const NONE: u32 = u32::MAX;

/// sum += factor times a vector of as many elements, a multiple of the lanes.
#[inline(always)]
fn add_multiple<S: Simd>(simd: S, sum: &mut [f64], factor: f64, own: &[f64]) {
    let (sum, own, factor) = (S::as_mut_simd_f64s(sum).0, S::as_simd_f64s(own).0, simd.splat_f64s(factor));
    sum.iter_mut().zip(own).for_each(|(sum, own)| *sum = simd.mul_add_f64s(*own, factor, *sum));
}

/// The number of an object, the next one if it has none yet.
#[inline(always)]
fn numbered(numbers: &mut [u32], all: &mut Vec<usize>, object: usize) -> usize {
    if numbers[object] == NONE {
        numbers[object] = all.len() as u32;
        all.push(object);
    }
    numbers[object] as usize
}

/// Adds the equations of a block to sums; `inverse` is that of its normal matrix, `width` the length of the rows of `work`.
struct Add<'a> {
    sums: &'a mut Sums,
    work: &'a mut Work,
    rows: &'a LocalRows,
    inverse: &'a [f64],
    width: usize,
}

impl WithSimd for Add<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { sums, work: Work { partials, right, solved }, rows, inverse, width } = self;
        let (stride, size) = (sums.stride, rows.width);
        for (k, partials) in partials.chunks_exact(width).enumerate() {
            add_multiple(simd, &mut sums.score[..width], rows.constants[k], partials);
            for (row, &first) in partials.iter().enumerate().filter(|own| *own.1 != 0.0) {
                add_multiple(simd, &mut sums.squares[row * stride..][..width], first, partials);
            }
            for (right, &own) in right.chunks_exact_mut(width).zip(&rows.own[k * size..]) {
                add_multiple(simd, right, own, partials);
            }
        }
        for (solved, inverse) in solved.chunks_exact_mut(width).zip(inverse.chunks_exact(size.max(1))) {
            right
                .chunks_exact(width)
                .zip(inverse)
                .for_each(|(right, &own)| add_multiple(simd, solved, own, right));
        }
        for (right, solved) in right.chunks_exact(width).zip(solved.chunks_exact(width)) {
            for (row, &right) in right.iter().enumerate().filter(|own| *own.1 != 0.0) {
                add_multiple(simd, &mut sums.entries[row * stride..][..width], right, solved);
            }
        }
        let mut start = 0;
        for (k, left) in partials.chunks_exact_mut(width).enumerate() {
            for (solved, &own) in solved.chunks_exact(width).zip(&rows.own[k * size..]) {
                add_multiple(simd, left, -own, solved);
            }
            let end = rows.ends[k].0;
            for &(unknown, coefficient) in &rows.others[start..end] {
                let place = sums.places[unknown - sums.first] as usize;
                add_multiple(simd, &mut sums.rights[place * stride..][..width], coefficient, left);
            }
            start = end;
        }
    }
}

impl Sums {
    fn new(layout: &Layout, count: usize) -> Self {
        let (first, stride) = (layout.all_locals().end, count.next_multiple_of(LANES));
        Self {
            numbers: vec![NONE; count],
            parameters: vec![],
            observations: vec![0; count],
            stride,
            score: vec![0.0; stride],
            squares: vec![0.0; stride * count],
            entries: vec![0.0; stride * count],
            rights: vec![],
            places: vec![NONE; layout.unknowns() - first],
            unknowns: vec![],
            first,
        }
    }

    /// Adds the equations of a block; `inverse` is that of its normal matrix.
    fn add(&mut self, rows: &LocalRows, inverse: &[f64], work: &mut Work) {
        let mut last = 0;
        for &(parameter, partial) in &rows.partials {
            self.observations[parameter] += usize::from(partial != 0.0);
            last = last.max(numbered(&mut self.numbers, &mut self.parameters, parameter));
        }
        for &(unknown, _) in &rows.others {
            numbered(&mut self.places, &mut self.unknowns, unknown - self.first);
        }
        self.rights.resize(self.unknowns.len() * self.stride, 0.0);
        let width = (last + 1).next_multiple_of(LANES);
        for (matrix, count) in [
            (&mut work.partials, rows.of.len()),
            (&mut work.right, rows.width),
            (&mut work.solved, rows.width),
        ] {
            matrix.clear();
            matrix.resize(count * width, 0.0);
        }
        for ((.., partials), to) in rows.rows().zip(work.partials.chunks_exact_mut(width)) {
            partials.iter().for_each(|own| to[self.numbers[own.0] as usize] += own.1);
        }
        Arch::new().dispatch(Add { sums: self, work, rows, inverse, width });
    }
}

impl Linearized {
    pub(super) fn extended<'a>(
        &self,
        problem: &'a AnyProblem<'a>,
        parameters: &'a dyn AdditionalParameters,
        threads: &Threads,
    ) -> Extended<'a> {
        Extended::new(self.equations(problem, threads), &self.held, parameters)
    }

    /// Tests additional parameters against the residuals at these values.
    pub fn additional(
        &self,
        problem: &AnyProblem<'_>,
        parameters: &dyn AdditionalParameters,
        threads: &Threads,
    ) -> Additional {
        let (count, layout) = (parameters.count(), problem.layout());
        let extended = self.extended(problem, parameters, threads);
        let of_locals = |locals: &mut dyn Iterator<Item = usize>| {
            let (mut sums, mut work) = (Sums::new(layout, count), Work::default());
            let (mut rows, mut buffers) = (LocalRows::default(), Buffers::default());
            for local in locals {
                extended.write(&mut buffers, local, &mut rows);
                if !rows.partials.is_empty() {
                    sums.add(&rows, &extended.inverse(local, &rows), &mut work);
                }
            }
            sums
        };
        let mut parts = match parameters.locals() {
            Some(some) => vec![of_locals(&mut some.into_iter())],
            None => {
                let (all, length) = (layout.locals(), layout.locals().div_ceil(PARTS).max(AT_LEAST));
                let ranges = (0..all).step_by(length).map(|first| first..all.min(first + length)).collect();
                threads
                    .install(|| parallel::map_each(ranges, &|mut range: Range<usize>| of_locals(&mut range)))
            }
        };
        parts.push(retained(&extended, count));

        let (mut score, mut observations) = (DVector::zeros(count), vec![0; count]);
        let [mut squares, mut entries] = [(); 2].map(|()| DMatrix::zeros(count, count));
        // A parameter per row: the elements of an unknown follow each other.
        let mut rights = DMatrix::zeros(count, layout.unknowns() - layout.all_locals().end);
        for part in parts {
            observations.iter_mut().zip(&part.observations).for_each(|(sum, own)| *sum += own);
            for (i, &parameter) in part.parameters.iter().enumerate() {
                score[parameter] += part.score[i];
                for (j, &other) in part.parameters.iter().enumerate() {
                    squares[(other, parameter)] += part.squares[i * part.stride + j];
                    entries[(other, parameter)] += part.entries[i * part.stride + j];
                }
            }
            for (&unknown, own) in part.unknowns.iter().zip(part.rights.chunks_exact(part.stride.max(1))) {
                let mut sum = rights.column_mut(unknown);
                part.parameters.iter().zip(own).for_each(|(&parameter, own)| sum[parameter] += own);
            }
        }
        let mut effects = rights.transpose();
        // An even number of equal parts, so that two threads have the same work.
        let together = count.div_ceil(count.div_ceil(SOLVED).next_multiple_of(2).max(1));
        let length = (effects.nrows() * together).max(1);
        let solve = |rights: &[f64]| self.factor.solve_reduced(rights);
        let some = effects.as_slice().chunks(length).collect();
        let solved = threads.install(|| parallel::map_each(some, &solve));
        let parts = effects.as_mut_slice().chunks_mut(length);
        parts.zip(solved).for_each(|(part, own)| part.copy_from_slice(&own));
        entries += rights * &effects;
        let redundancy = &squares - (&entries + entries.transpose()) / 2.0;
        Additional { score, squares, redundancy, effects, observations }
    }

    /// By how much the unknowns of some local blocks change with errors: for each block its unknowns by errors, a column per error.
    ///
    /// * `effects`: changes of the unknowns that are not local, a column per error;
    /// * `errors`: the errors of the parameters, a column per error.
    pub fn changes_of_locals(
        &self,
        problem: &AnyProblem<'_>,
        parameters: &dyn AdditionalParameters,
        (effects, errors): (DMatrixView<'_, f64>, &DMatrix<f64>),
        locals: &[usize],
        threads: &Threads,
    ) -> Vec<DMatrix<f64>> {
        let extended = self.extended(problem, parameters, threads);
        let (first, count) = (problem.layout().all_locals().end, errors.ncols());
        // An error per row: its elements follow each other.
        let (effects, errors) = (effects.transpose(), errors.transpose());
        let changes = |some: Range<usize>| -> Vec<DMatrix<f64>> {
            let (mut rows, mut buffers) = (LocalRows::default(), Buffers::default());
            let mut left = DVector::zeros(count);
            let change = |&local: &usize| {
                extended.write(&mut buffers, local, &mut rows);
                let inverse = extended.inverse(local, &rows);
                let width = rows.width;
                let mut right = DMatrix::zeros(count, width);
                for (_, own, others, partials) in rows.rows() {
                    left.fill(0.0);
                    for &(unknown, value) in others {
                        left.axpy(-value, &effects.column(unknown - first), 1.0);
                    }
                    for &(parameter, partial) in partials {
                        left.axpy(partial, &errors.column(parameter), 1.0);
                    }
                    own.iter()
                        .enumerate()
                        .for_each(|(k, value)| right.column_mut(k).axpy(*value, &left, 1.0));
                }
                DMatrix::from_row_slice(width, width, &inverse) * right.transpose()
            };
            locals[some].iter().map(change).collect()
        };
        threads.install(|| parallel::by_parts(locals.len(), AT_LEAST, &changes))
    }
}

/// Local blocks that a thread takes at least.
pub(super) const AT_LEAST: usize = 32;
/// Largest number of parameters that are solved for together, for any number of threads: the rounding of products depends on it.
const SOLVED: usize = 32;
/// Parts whose sums are separate, for any number of threads: the sums are the same, bit by bit.
pub(super) const PARTS: usize = 64;

/// The sums over terms of retained blocks and over unknowns that are not local.
fn retained(extended: &Extended<'_>, count: usize) -> Sums {
    let layout = extended.equations.problem().layout();
    let (mut sums, mut work) = (Sums::new(layout, count), Work::default());
    extended.each_retained(|rows| {
        if rows.partials.iter().any(|own| own.1 != 0.0) {
            sums.add(rows, &[], &mut work);
        }
    });
    sums
}

#[cfg(test)]
mod tests {
    use super::invert;

    #[test]
    fn inverse_of_a_definite_matrix() {
        let matrix = [4.0, 1.0, -2.0, 1.0, 3.0, 0.5, -2.0, 0.5, 5.0];
        let mut inverse = matrix;
        invert(&mut inverse, 3);
        for k in 0..9 {
            let product: f64 = (0..3).map(|j| matrix[k / 3 * 3 + j] * inverse[3 * j + k % 3]).sum();
            assert!((product - f64::from(u8::from(k % 4 == 0))).abs() < 1e-15);
        }
        let mut singular = [1.0, 1.0, 1.0, 1.0];
        invert(&mut singular, 2);
        assert_eq!(singular, [0.0; 4]);
    }
}
