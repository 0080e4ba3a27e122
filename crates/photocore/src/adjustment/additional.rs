//! Additional parameters of the computed observations, l = A x + C d + v: how well the residuals test them, what they would be, and what
//! they would change, from one factor and without adjusting again.
//!
//! With weights P and cofactors Q of the unknowns: score u = C^T P v, right-hand sides N = A^T P C, redundancy R = C^T P C - N^T Q N
//! (Baarda 1968; Förstner 1983). If the observations have the error C d, the unknowns change by Q N d. Local blocks are eliminated as they
//! are formed, so that only unknowns of retained blocks are solved for.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::equations::{ObservationEquations, Row};
use super::group_test::Few;
use super::linearized::Linearized;
use super::loss::Reweighting;
use super::problem::AnyProblem;
use super::terms::Terms;
use super::walk::Buffers;
use crate::normals::{Layout, dot};
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
        self.row.taken()
    }
}

/// The observation of an equation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum EquationOf {
    /// A row of a group, which belongs to a local block.
    Group {
        /// The group.
        group: usize,
        /// Its local block.
        local: usize,
        /// The row in the group.
        row: usize,
    },
    /// A row of a tie.
    Tie {
        /// The tie.
        tie: usize,
        /// The row in the tie.
        row: usize,
    },
    /// An unknown as an observation of itself.
    Unknown(usize),
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
    terms: Terms<'a>,
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
    fn push(&mut self, to: &Extended<'_>, (of, sd, row): (EquationOf, f64, &Row<'_>), first: usize) {
        let Self { width, of: all, constants, own, ends, others, partials, scratch, shared } = self;
        all.push(of);
        scratch.clear();
        to.parameters.partials(&Equation { of, sd, row }, shared, scratch);
        // All rows of a tie, whose components are whitened together, depend on the same parameters.
        let is_tie = matches!(of, EquationOf::Tie { .. });
        partials.extend(scratch.iter().filter(|partial| is_tie || partial.1 != 0.0));
        let start = own.len();
        own.resize(start + *width, 0.0);
        for (unknown, value) in row.taken().filter(|own| !to.fixed[own.0]) {
            match unknown.checked_sub(first) {
                Some(k) if k < *width => own[start + k] = value,
                _ => others.push((unknown, value)),
            }
        }
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
    /// Evaluates a problem at given values with some unknowns constrained.
    pub fn new(
        problem: &'a AnyProblem<'a>,
        reweighting: Option<Reweighting>,
        (values, held): (&'a [f64], &[usize]),
        parameters: &'a dyn AdditionalParameters,
        threads: &Threads,
    ) -> Self {
        let equations = ObservationEquations::new(problem, reweighting, values, held, threads);
        Self {
            equations: equations.with_fixed_columns(),
            terms: problem.terms(values),
            fixed: problem.fixed(held),
            parameters,
        }
    }

    /// Writes the equations of a local block: its groups, its ties and its unknowns as observations.
    pub fn write(&self, buffers: &mut Buffers, local: usize, rows: &mut LocalRows) {
        let problem = self.equations.problem();
        let layout = problem.layout();
        let range = layout.local_range(local);
        let (first, width, size) = (range.start, range.len(), layout.rows());
        rows.clear(width);
        self.equations.each_row(buffers, local, |row| {
            let of = EquationOf::Group { group: row.number / size, local, row: row.number % size };
            rows.push(self, (of, self.equations.deviation(row.number), row), first);
        });
        for tie in layout.ties_of(local).iter().map(|&tie| tie as usize) {
            let before = layout.groups() * size + layout.tie_rows(tie).start;
            self.equations.each_row_of_tie(buffers, tie, |row| {
                let of = EquationOf::Tie { tie, row: row.number - before };
                rows.push(self, (of, self.equations.deviation(row.number), row), first);
            });
        }
        self.equations.each_prior(&self.terms, range, |unknown, row| {
            rows.push(self, (EquationOf::Unknown(unknown), problem.sd[unknown], row), first);
        });
    }

    /// Calls `add` with the equations of retained blocks: ties, then unknowns as observations, each with its standard deviation.
    pub fn each_retained(&self, mut add: impl FnMut(EquationOf, f64, &Row<'_>)) {
        let problem = self.equations.problem();
        let (layout, mut buffers) = (problem.layout(), Buffers::default());
        let (groups, first) = (layout.groups() * layout.rows(), layout.all_locals().end);
        for tie in (0..layout.ties().len()).filter(|&tie| layout.ties()[tie].local.is_none()) {
            self.equations.each_row_of_tie(&mut buffers, tie, |row| {
                let of = EquationOf::Tie { tie, row: row.number - groups - layout.tie_rows(tie).start };
                add(of, self.equations.deviation(row.number), row);
            });
        }
        self.equations.each_prior(&self.terms, first..layout.unknowns(), |unknown, row| {
            add(EquationOf::Unknown(unknown), problem.sd[unknown], row);
        });
    }

    /// Unknowns of an equation that are not fixed, with their coefficients.
    pub fn free(&self, row: &Row<'_>) -> impl Iterator<Item = (usize, f64)> {
        row.taken().filter(|own| !self.fixed[own.0])
    }

    /// The inverse of the normal matrix of a local block; zero if it has none.
    pub fn inverse(&self, local: usize, rows: &LocalRows) -> Few {
        match rows.width {
            // Points: with a constant size, loops are unrolled.
            3 => self.inverse_of::<3>(local, rows),
            _ => self.inverse_of::<0>(local, rows),
        }
    }

    fn inverse_of<const D: usize>(&self, local: usize, rows: &LocalRows) -> Few {
        let range = self.equations.problem().layout().local_range(local);
        let count = if D > 0 { D } else { range.len() };
        let mut normal = Few::from_elem(0.0, count * count);
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

/// The sums over some observations.
struct Sums {
    score: DVector<f64>,
    squares: DMatrix<f64>,
    /// What local blocks take up of the squares.
    taken: DMatrix<f64>,
    observations: Vec<usize>,
    /// Unknowns that are not local, with their right-hand sides: an element per parameter.
    unknowns: Vec<usize>,
    rights: Vec<f64>,
}

/// Buffers of a thread for sums.
struct Work {
    /// First unknown that is not local.
    first: usize,
    /// Place of each of these in the sums.
    places: Vec<u32>,
    /// Parameters that the equations of a local block depend on, and the place of each parameter among them.
    columns: Vec<usize>,
    active: Vec<Option<usize>>,
    /// Right-hand sides of a local block by these parameters, its solutions, and partials of an equation.
    right: Vec<f64>,
    solved: Vec<f64>,
    left: Vec<f64>,
}

/// A place that is not used.
const NONE: u32 = u32::MAX;

impl Work {
    fn new(layout: &Layout, count: usize) -> Self {
        let first = layout.all_locals().end;
        Self {
            first,
            places: vec![NONE; layout.unknowns() - first],
            columns: vec![],
            active: vec![None; count],
            right: vec![],
            solved: vec![],
            left: vec![],
        }
    }

    /// Sets the parameters of the next equations.
    fn select(&mut self, partials: &[(usize, f64)]) {
        self.columns.drain(..).for_each(|column| self.active[column] = None);
        for &(column, _) in partials {
            if self.active[column].is_none() {
                self.active[column] = Some(self.columns.len());
                self.columns.push(column);
            }
        }
    }

    /// Calls `add` with the place of each parameter among the active ones, and its partial.
    fn each_active(active: &[Option<usize>], partials: &[(usize, f64)], mut add: impl FnMut(usize, f64)) {
        partials
            .iter()
            .for_each(|&(column, partial)| active[column].into_iter().for_each(|k| add(k, partial)));
    }
}

impl Sums {
    fn new(count: usize) -> Self {
        Self {
            score: DVector::zeros(count),
            squares: DMatrix::zeros(count, count),
            taken: DMatrix::zeros(count, count),
            observations: vec![0; count],
            unknowns: vec![],
            rights: vec![],
        }
    }

    /// Adds an equation to scores and squares.
    fn add(&mut self, constant: f64, partials: &[(usize, f64)]) {
        for &(i, first) in partials {
            self.observations[i] += 1;
            self.score[i] += first * constant;
            partials.iter().for_each(|&(j, second)| self.squares[(i, j)] += first * second);
        }
    }

    /// Adds an equation to the right-hand sides, with its partials `left` by the selected parameters.
    fn reduce(&mut self, others: &[(usize, f64)], work: &mut Work) {
        let count = self.observations.len();
        for &(unknown, coefficient) in others {
            let place = &mut work.places[unknown - work.first];
            if *place == NONE {
                *place = self.unknowns.len() as u32;
                self.unknowns.push(unknown);
                self.rights.resize(self.unknowns.len() * count, 0.0);
            }
            let right = &mut self.rights[*place as usize * count..][..count];
            work.columns.iter().zip(&work.left).for_each(|(&k, partial)| right[k] += partial * coefficient);
        }
    }

    /// Adds a local block.
    fn add_local(&mut self, to: &Extended<'_>, local: usize, rows: &LocalRows, work: &mut Work) {
        if rows.partials.is_empty() {
            return;
        }
        work.select(&rows.partials);
        let (width, count) = (rows.width, work.columns.len());
        work.right.clear();
        work.right.resize(width * count, 0.0);
        for (constant, own, _, partials) in rows.rows() {
            self.add(constant, partials);
            let right = &mut work.right;
            Work::each_active(&work.active, partials, |column, partial| {
                let right = &mut right[column * width..][..width];
                right.iter_mut().zip(own).for_each(|(sum, value)| *sum += value * partial);
            });
        }
        let inverse = to.inverse(local, rows);
        work.solved.clear();
        for right in work.right.chunks_exact(width) {
            let rows = inverse.chunks_exact(width);
            work.solved.extend(rows.map(|row| dot(row, right)));
        }
        for (i, right) in work.columns.iter().zip(work.right.chunks_exact(width)) {
            for (j, solved) in work.columns.iter().zip(work.solved.chunks_exact(width)) {
                self.taken[(*i, *j)] += dot(right, solved);
            }
        }
        for (_, own, others, partials) in rows.rows() {
            work.left.clear();
            work.left.extend(work.solved.chunks_exact(width).map(|solved| -dot(own, solved)));
            let left = &mut work.left;
            Work::each_active(&work.active, partials, |column, partial| left[column] += partial);
            self.reduce(others, work);
        }
    }
}

impl Linearized {
    pub(super) fn extended<'a>(
        &'a self,
        problem: &'a AnyProblem<'a>,
        parameters: &'a dyn AdditionalParameters,
        threads: &Threads,
    ) -> Extended<'a> {
        Extended::new(problem, self.reweighting, (&self.values, &self.held), parameters, threads)
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
            let (mut sums, mut work) = (Sums::new(count), Work::new(layout, count));
            let (mut rows, mut buffers) = (LocalRows::default(), Buffers::default());
            for local in locals {
                extended.write(&mut buffers, local, &mut rows);
                sums.add_local(&extended, local, &rows, &mut work);
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

        let (mut sums, first) = (Sums::new(count), layout.all_locals().end);
        // A parameter per row: the elements of an unknown follow each other.
        let mut rights = DMatrix::zeros(count, layout.unknowns() - first);
        for part in parts {
            sums.score += part.score;
            sums.squares += part.squares;
            sums.taken += part.taken;
            sums.observations.iter_mut().zip(part.observations).for_each(|(sum, own)| *sum += own);
            for (unknown, own) in part.unknowns.iter().zip(part.rights.chunks_exact(count.max(1))) {
                rights.column_mut(unknown - first).iter_mut().zip(own).for_each(|(sum, own)| *sum += own);
            }
        }
        let columns = rights.transpose();
        // An even number of equal parts, so that two threads have the same work.
        let together = count.div_ceil(count.div_ceil(SOLVED).next_multiple_of(2).max(1));
        let some = columns.as_slice().chunks((columns.nrows() * together).max(1)).collect();
        let solve = |rights: &[f64]| self.factor.solve_reduced(layout, rights);
        let solved = threads.install(|| parallel::map_each(some, &solve)).concat();
        let effects = DMatrix::from_vec(columns.nrows(), count, solved);
        let taken = sums.taken + rights * &effects;
        let redundancy = &sums.squares - (&taken + taken.transpose()) / 2.0;
        let Sums { score, squares, observations, .. } = sums;
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
        (effects, errors): (&DMatrix<f64>, &DMatrix<f64>),
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

/// The sums over ties of retained blocks and over unknowns that are not local.
fn retained(extended: &Extended<'_>, count: usize) -> Sums {
    let layout = extended.equations.problem().layout();
    let (mut sums, mut work) = (Sums::new(count), Work::new(layout, count));
    let (mut partials, mut shared, mut others) = (vec![], Shared::default(), vec![]);
    extended.each_retained(|of, sd, row| {
        partials.clear();
        extended.parameters.partials(&Equation { of, sd, row }, &mut shared, &mut partials);
        if partials.iter().all(|own| own.1 == 0.0) {
            return;
        }
        sums.add(row.constant, &partials);
        work.select(&partials);
        work.left.clear();
        work.left.resize(work.columns.len(), 0.0);
        let left = &mut work.left;
        Work::each_active(&work.active, &partials, |column, partial| left[column] += partial);
        others.clear();
        others.extend(extended.free(row));
        sums.reduce(&others, &mut work);
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
