//! Block normal equations compared with dense algebra.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::collections::BTreeSet;
use std::fmt::Debug;

use faer::Mat;
use faer::linalg::solvers::Solve;
use photocore::normals::{
    Chord, Equations, Factor, FactorOptions, Function, GroupRows, InvertOptions, Layout, LayoutError,
    Ordering, Prior, SelectedInverse, SolveOptions, System, SystemError, Term,
};
use photocore::{Context, Threads};
use proptest::prelude::*;

/// Dense system of given equations.
#[derive(Debug)]
struct Dense {
    layout: Layout,
    /// Coefficients, one row per equation.
    matrix: Mat<f64>,
    right: Vec<f64>,
    prior: Prior,
}

impl Equations for Dense {
    fn write(&self, local: usize, group: usize, rows: &mut GroupRows<'_>) {
        let layout = &self.layout;
        let places: [(&mut [f64], Vec<usize>); 3] = [
            (rows.local, layout.local_range(local).collect()),
            (rows.retained, layout.retained_range(layout.retained_of(group)).collect()),
            (rows.shared, layout.shared_columns(group).collect()),
        ];
        for row in 0..layout.rows() {
            rows.constant[row] = self.right[group * layout.rows() + row];
        }
        for (target, columns) in places {
            for row in 0..layout.rows() {
                for (k, &column) in columns.iter().enumerate() {
                    target[row * columns.len() + k] = self.matrix[(group * layout.rows() + row, column)];
                }
            }
        }
    }

    fn write_term(&self, term: usize, rows: &mut GroupRows<'_>) {
        let columns: Vec<usize> = self.layout.term_columns(term).collect();
        for (k, row) in self.layout.equations_of_term(term).enumerate() {
            rows.constant[k] = self.right[row];
            for (value, &column) in rows.of_term()[k * columns.len()..].iter_mut().zip(&columns) {
                *value = self.matrix[(row, column)];
            }
        }
    }

    fn prior(&self) -> &Prior {
        &self.prior
    }
}

impl Dense {
    /// Returns the equations of the groups of a local block as functions.
    fn rows_of(&self, local: usize) -> Vec<Vec<(usize, f64)>> {
        let layout = &self.layout;
        let of_group = |group: usize| {
            let retained = layout.retained_range(layout.retained_of(group));
            let columns: Vec<usize> =
                layout.local_range(local).chain(retained).chain(layout.shared_columns(group)).collect();
            (0..layout.rows()).map(move |row| self.row_of(group * layout.rows() + row, &columns))
        };
        layout.groups_of(local).flat_map(of_group).collect()
    }

    /// Returns the equations of the terms of a local block as functions.
    fn terms_of(&self, local: usize) -> Vec<Vec<(usize, f64)>> {
        let layout = &self.layout;
        let of_term = |&term: &u32| {
            let columns: Vec<usize> = layout.term_columns(term as usize).collect();
            layout.equations_of_term(term as usize).map(move |row| self.row_of(row, &columns))
        };
        layout.terms_of(local).iter().flat_map(of_term).collect()
    }

    fn row_of(&self, row: usize, columns: &[usize]) -> Vec<(usize, f64)> {
        columns.iter().map(|&column| (column, self.matrix[(row, column)])).collect()
    }

    /// Fills the system with random numbers between -1 and 1, reproducible by seed.
    fn new(layout: Layout, seed: u64) -> Self {
        let mut state = seed.wrapping_mul(2).wrapping_add(1);
        let mut number = move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        };
        let equations = layout.equations();
        let mut matrix = Mat::zeros(equations, layout.unknowns());
        for local in 0..layout.locals() {
            for group in layout.groups_of(local) {
                let columns = layout
                    .local_range(local)
                    .chain(layout.retained_range(layout.retained_of(group)))
                    .chain(layout.shared_columns(group));
                for column in columns {
                    for row in 0..layout.rows() {
                        matrix[(group * layout.rows() + row, column)] = number();
                    }
                }
            }
        }
        for term in 0..layout.terms().len() {
            for row in layout.equations_of_term(term) {
                for column in layout.term_columns(term) {
                    matrix[(row, column)] = number();
                }
            }
        }
        let right = (0..equations).map(|_| number()).collect();
        let mut weight: Vec<f64> = (0..layout.unknowns()).map(|_| 0.5 + 0.4 * number()).collect();
        let mut prior_right: Vec<f64> = weight.iter().map(|w| w * number()).collect();
        let held = (0..layout.locals()).filter(|&local| layout.has_uncoupled_groups(local));
        for unknown in held.flat_map(|local| layout.local_range(local)) {
            (weight[unknown], prior_right[unknown]) = (1.0, 0.0);
            (0..equations).for_each(|row| matrix[(row, unknown)] = 0.0);
        }
        Self { layout, matrix, right, prior: Prior { weight, right: prior_right, between: vec![] } }
    }

    fn normal_matrix(&self) -> Mat<f64> {
        let mut normal = self.matrix.transpose() * &self.matrix;
        for (i, weight) in self.prior.weight.iter().enumerate() {
            normal[(i, i)] += weight;
        }
        normal
    }

    fn normal_right(&self) -> Mat<f64> {
        let mut right = Mat::from_fn(self.prior.right.len(), 1, |i, _| self.prior.right[i]);
        right += self.matrix.transpose() * Mat::from_fn(self.right.len(), 1, |i, _| self.right[i]);
        right
    }
}

fn threads(count: usize) -> Threads {
    Threads::new(count).unwrap()
}

fn done<T, E: Debug>(result: Result<T, E>) -> T {
    result.unwrap()
}

fn solved_for(rights: &[f64]) -> SolveOptions<'_> {
    SolveOptions { rights: Some(rights), ..SolveOptions::default() }
}

const ALL: [Ordering; 6] = [
    Ordering::Auto,
    Ordering::Input,
    Ordering::ReverseCuthillMckee,
    Ordering::MinimumDegree,
    Ordering::DissectionByPlace,
    Ordering::DissectionByGraph,
];

/// Random systems: local blocks of 1 to 3 unknowns, retained blocks of 1 to 7, optionally a shared one. Observations of a local block may
/// repeat a retained block and have two further ones; constraints join up to three blocks and the shared one, or belong to a local block.
fn systems() -> impl Strategy<Value = (Dense, Ordering)> {
    let blocks = (prop::collection::vec(1..8usize, 1..12), 0..4usize);
    let shape = (1..4usize, 1..3usize, blocks, 0..5usize);
    shape
        .prop_flat_map(|(l, rows, (retained, common), shared)| {
            // Main blocks precede or follow the common ones.
            let common = common.min(retained.len() - 1) as u32;
            let main = if l == 2 { 0..retained.len() as u32 - common } else { common..retained.len() as u32 };
            let start = if l == 2 { main.end } else { 0 };
            let further = prop::collection::btree_set(start..start + common.max(1), 0..3);
            let further = further.prop_map(move |further| if common > 0 { further } else { BTreeSet::new() });
            let groups = prop::collection::vec(prop::collection::vec((main, further), 0..5), 1..25);
            let tied = prop::collection::btree_set(0..retained.len() as u32, 0..4);
            let terms = prop::collection::vec((1..4usize, tied, any::<bool>()), 0..6);
            let of_locals = prop::collection::vec((1..4usize, any::<prop::sample::Index>()), 0..6);
            (
                Just((l, rows, retained, shared)),
                groups,
                (terms, of_locals),
                any::<u64>(),
                prop::sample::select(ALL.to_vec()),
            )
        })
        .prop_map(|((l, rows, mut retained, shared), locals, (terms, of_locals), seed, ordering)| {
            let last = retained.len() as u32;
            retained.extend((shared > 0).then_some(shared));
            // Constraints and observations use an order different from the order of the blocks.
            let blocks = |own: BTreeSet<u32>, too: bool| -> Vec<u32> {
                own.into_iter().rev().chain((shared > 0 && too).then_some(last)).collect()
            };
            let term = |(rows, own, too): (usize, BTreeSet<u32>, bool)| Term {
                rows,
                local: None,
                retained: blocks(own, too),
            };
            let of_local = |(rows, local): &(usize, prop::sample::Index)| Term {
                rows: *rows,
                local: Some(local.index(locals.len()) as u32),
                retained: vec![],
            };
            let of_locals: Vec<Term> = of_locals.iter().map(of_local).collect();
            let (first, last_terms) = of_locals.split_at(of_locals.len() / 2);
            let terms = terms.into_iter().map(term).filter(|term| !term.retained.is_empty());
            let terms = first.iter().cloned().chain(terms).chain(last_terms.iter().cloned()).collect();
            let mut ptr = vec![0];
            for groups in &locals {
                ptr.push(ptr[ptr.len() - 1] + groups.len());
            }
            let (group_retained, further): (Vec<u32>, Vec<BTreeSet<u32>>) =
                locals.into_iter().flatten().unzip();
            let (mut shared_ptr, mut all) = (vec![0], vec![]);
            for (g, own) in further.into_iter().enumerate() {
                all.extend(blocks(own, g % 4 > 0));
                shared_ptr.push(all.len());
            }
            let layout = Layout::new(rows, l, &retained, ptr, group_retained).unwrap();
            let layout = layout.with_shared(shared_ptr, all).unwrap();
            (Dense::new(layout.with_terms(terms).unwrap(), seed), ordering)
        })
}

/// Returns a block with several supernodes, subtrees and tiles; observations share a last block of `shared` unknowns.
fn block(strips: usize, length: usize, shared: usize) -> Dense {
    let (mut ptr, mut retained) = (vec![0], Vec::new());
    for strip in 0..strips {
        for photo in 0..length {
            for reach in [2, 3] {
                for s in strip..strips.min(strip + 2) {
                    retained.extend((photo..length.min(photo + reach)).map(|p| (s * length + p) as u32));
                }
                ptr.push(retained.len());
            }
        }
    }
    let photos = strips * length;
    let mut places: Vec<[f64; 3]> =
        (0..photos).map(|k| [(k % length) as f64, (k / length) as f64 * 1.7, 0.0]).collect();
    if shared == 0 {
        let layout = Layout::new(2, 3, &vec![6; photos], ptr, retained).unwrap();
        return Dense::new(layout.with_places(places).unwrap(), 7);
    }
    let further = vec![photos as u32; retained.len()];
    let layout = Layout::new(2, 3, &[vec![6; photos], vec![shared]].concat(), ptr, retained).unwrap();
    let layout = layout.with_shared((0..=further.len()).collect(), further).unwrap();
    places.push([0.0; 3]);
    Dense::new(layout.with_places(places).unwrap(), 7)
}

fn assert_close(actual: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((actual - expected).abs() <= tolerance, "{what}: {actual:e} instead of {expected:e}");
}

/// Compares solution, all selected blocks, local cofactors and adjusted equations with the dense inverse.
fn compare_with_dense(dense: &Dense, ordering: Ordering) {
    let threads = threads(2);
    let system = System::new(dense.layout.clone(), ordering).unwrap();
    let layout = system.layout();
    let factor = done(system.factor(dense, &FactorOptions::default(), &mut Context::new(&threads)));
    assert!(factor.deficient_locals.is_empty() && factor.deficiency().is_none());
    let solution = done(factor.solve(dense, &SolveOptions::default(), &mut Context::new(&threads)));
    let rights = vec![1.0; 11 * layout.unknowns()];
    let alone = done(system.factor(dense, &FactorOptions::UNCACHED, &mut Context::new(&threads)));
    let written = done(alone.solve(dense, &SolveOptions::default(), &mut Context::new(&threads)));
    let further = done(alone.solve(dense, &solved_for(&rights), &mut Context::new(&threads)));
    let cholesky = dense.normal_matrix().llt(faer::Side::Lower).unwrap();
    let ones = cholesky.solve(Mat::<f64>::full(layout.unknowns(), 1, 1.0));
    for (i, value) in further.iter().enumerate() {
        assert_close(*value, ones[(i % layout.unknowns(), 0)], 1e-9 * ones.norm_max(), "further solution");
    }
    let logarithm: f64 = (0..layout.unknowns()).map(|i| 2.0 * cholesky.L()[(i, i)].ln()).sum();
    assert_close(determinant(dense, &factor), logarithm, 1e-9 * logarithm.abs().max(1.0), "determinant");
    let expected = cholesky.solve(dense.normal_right());
    for (i, value) in solution.iter().enumerate() {
        assert_close(*value, expected[(i, 0)], 1e-9 * expected.norm_max(), "solution");
        assert_close(written[i], *value, 1e-12 * expected.norm_max(), "solution from the equations");
    }
    let right: Vec<f64> = dense.normal_right().col(0).iter().copied().collect();
    let again = done(factor.solve(dense, &solved_for(&right), &mut Context::new(&threads)));
    for (value, other) in again.iter().zip(&solution) {
        assert_close(*value, *other, 1e-11 * expected.norm_max(), "solution for its right-hand side");
    }
    if factor.has_cached() {
        let Chord { step: chord, decrease, .. } = done(factor.chord(dense, &mut Context::new(&threads)));
        assert_close(decrease, factor.decrease, 1e-11 * factor.decrease, "decrease");
        for (value, other) in chord.iter().zip(&solution) {
            assert_close(*value, *other, 1e-11 * expected.norm_max(), "chord from the same values");
        }
        compare_chord(dense, &factor);
    }
    let inverse = cholesky.solve(Mat::<f64>::identity(layout.unknowns(), layout.unknowns()));
    compare_columns(dense, &system, &factor, &inverse);
    compare_functions(dense, &system, &factor, &inverse);
    let found = done(factor.invert(dense, &InvertOptions::default(), &mut Context::new(&threads)));
    let (cofactors, selected) = (found.cofactors, found.selected);
    compare_blocks(layout, &selected, &inverse);
    let l = layout.local_dim();
    for local in 0..layout.locals() {
        let range = layout.local_range(local);
        for (a, i) in range.clone().enumerate() {
            for (b, j) in range.clone().enumerate() {
                let value = cofactors.local[local * l * l + a * l + b];
                let scale = (inverse[(i, i)] * inverse[(j, j)]).sqrt();
                assert_close(value, inverse[(i, j)], 1e-9 * scale, "local cofactor");
            }
        }
    }
    let adjusted = &dense.matrix * &inverse;
    compare_equation_blocks(dense, &system, &selected, &adjusted);
    for (k, value) in cofactors.equations.iter().enumerate() {
        let exact: f64 = (0..layout.unknowns()).map(|i| adjusted[(k, i)] * dense.matrix[(k, i)]).sum();
        assert_close(*value, exact, 1e-9, "adjusted equation");
    }
}

/// Compares a chord step (modified Newton) with equations of other coefficients. Their own normal matrices L L^T eliminate the local blocks
/// from the right-hand side; the rest uses the old factor.
fn compare_chord(dense: &Dense, factor: &Factor) {
    let there = Dense::new(dense.layout.clone(), 97);
    let chord = done(factor.chord(&there, &mut Context::new(&threads(2)))).step;
    let count = dense.layout.locals() * dense.layout.local_dim();
    let (before, after, right) = (dense.normal_matrix(), there.normal_matrix(), there.normal_right());
    let (right, others) = right.split_at_row(count);
    let local = |normal: &Mat<f64>| normal.submatrix(0, 0, count, count).llt(faer::Side::Lower).unwrap();
    let coupling = |normal: &Mat<f64>| normal.submatrix(0, count, count, others.nrows()).to_owned();
    let reduced = others - coupling(&after).transpose() * local(&after).solve(right);
    let all = before.llt(faer::Side::Lower).unwrap();
    let alone = Mat::from_fn(before.nrows(), 1, |i, _| if i < count { 0.0 } else { reduced[(i - count, 0)] });
    let others = all.solve(alone).subrows(count, others.nrows()).to_owned();
    let root = local(&before).L().to_owned();
    let own = local(&after).L().partial_piv_lu().solve(right);
    let coupled = root.partial_piv_lu().solve(coupling(&before) * &others);
    let locals = root.transpose().partial_piv_lu().solve(own - coupled);
    let largest = locals.norm_max().max(others.norm_max());
    for (i, value) in chord.iter().enumerate() {
        let expected = if i < count { locals[(i, 0)] } else { others[(i - count, 0)] };
        assert_close(*value, expected, 1e-9 * largest, "chord from other values");
    }
}

/// Compares a Q a^T of all pairs of equations of some local blocks; `adjusted` is A Q.
fn compare_equation_blocks(dense: &Dense, system: &System, selected: &SelectedInverse, adjusted: &Mat<f64>) {
    let layout = system.layout();
    let exact = adjusted * dense.matrix.transpose();
    for local in (0..layout.locals()).step_by(layout.locals().div_ceil(20).max(1)) {
        let groups = layout.groups_of(local);
        let (first, count) = (groups.start * layout.rows(), groups.len() * layout.rows());
        let (rows, terms) = (dense.rows_of(local), dense.terms_of(local));
        let formed = [rows.clone(), terms].concat();
        let found = done(system.local_cofactors(selected, (&formed, &dense.prior.weight), &rows, local));
        assert_eq!(found.rows(), count);
        let group = |row: usize| row / layout.rows();
        for (k, value) in found.equations.iter().enumerate() {
            if layout.has_uncoupled_groups(local) && group(k / count) != group(k % count) {
                assert!(value.is_nan(), "no pattern has it");
                continue;
            }
            assert_close(*value, exact[(first + k / count, first + k % count)], 1e-9, "block of equations");
        }
    }
}

/// Returns the logarithm of the determinant: the sum for the reduced normal equations and the local blocks.
fn determinant(dense: &Dense, factor: &Factor) -> f64 {
    let (layout, normal) = (&dense.layout, dense.normal_matrix());
    let local = |local: usize| {
        let range = layout.local_range(local);
        normal.submatrix(range.start, range.start, range.len(), range.len()).determinant().ln()
    };
    factor.log_determinant().unwrap() + (0..layout.locals()).map(local).sum::<f64>()
}

/// Compares further right-hand sides: some columns of the inverse, and their sum.
fn compare_columns(dense: &Dense, system: &System, factor: &Factor, inverse: &Mat<f64>) {
    let unknowns = system.layout().unknowns();
    let columns: Vec<usize> = (0..unknowns).step_by(unknowns.div_ceil(20)).collect();
    let mut rights = vec![0.0; (columns.len() + 1) * unknowns];
    for (k, column) in columns.iter().enumerate() {
        rights[k * unknowns + column] = 1.0;
        rights[columns.len() * unknowns + column] = 1.0;
    }
    let threads = threads(2);
    let solved = done(factor.solve(dense, &solved_for(&rights), &mut Context::new(&threads)));
    let largest = inverse.norm_max();
    for i in 0..unknowns {
        let mut sum = 0.0;
        for (k, &column) in columns.iter().enumerate() {
            let scale = (inverse[(i, i)] * inverse[(column, column)]).sqrt();
            assert_close(solved[k * unknowns + i], inverse[(i, column)], 1e-9 * scale, "column");
            sum += inverse[(i, column)];
        }
        let value = solved[columns.len() * unknowns + i];
        assert_close(value, sum, 1e-9 * largest * columns.len() as f64, "sum of columns");
    }
}

/// Compares cofactors of unknowns and of their sums, all pairs and cross-cofactors.
fn compare_functions(dense: &Dense, system: &System, factor: &Factor, inverse: &Mat<f64>) {
    let (unknowns, threads) = (system.layout().unknowns(), threads(2));
    let several: Vec<Function> =
        (0..unknowns).rev().step_by(unknowns.div_ceil(40)).map(|unknown| vec![(unknown, 1.0)]).collect();
    // One function contains an unknown twice, and one contains all.
    let all: Function =
        (0..unknowns).map(|unknown| (unknown, 1.0 + unknown as f64 / unknowns as f64)).collect();
    let few: Vec<Function> = vec![vec![(unknowns - 1, 0.5), (0, -2.0), (0, 1.0)], all];
    let with: Vec<Function> = several[..several.len().min(5)].to_vec();
    for (rows, columns) in [
        (&several, None),
        (&few, None),
        (&few, Some(&with)),
        (&few, Some(&several)),
        (&several, Some(&few)),
        (&several, Some(&vec![])),
    ] {
        let reduced =
            done(factor.reduce(dense, rows, columns.map(Vec::as_slice), &mut Context::new(&threads)));
        assert!(factor.memory_of(&reduced) >= 8 * rows.len() * columns.map_or(rows.len(), Vec::len));
        let found = done(factor.cofactors_of(&reduced, &mut Context::new(&threads)));
        let others = columns.unwrap_or(rows);
        assert_eq!(found.len(), rows.len() * others.len());
        let along = |functions: &[Function]| {
            let mut dense = Mat::zeros(unknowns, functions.len());
            for (k, function) in functions.iter().enumerate() {
                function.iter().for_each(|&(unknown, value)| dense[(unknown, k)] += value);
            }
            dense
        };
        let (f, g) = (along(rows), along(others));
        let (qf, qg) = (inverse * &f, inverse * &g);
        let own = |f: &Mat<f64>, qf: &Mat<f64>, k: usize| -> f64 {
            (0..unknowns).map(|i| f[(i, k)] * qf[(i, k)]).sum()
        };
        let expected = f.transpose() * &qg;
        for i in 0..rows.len() {
            for j in 0..others.len() {
                let scale = (own(&f, &qf, i) * own(&g, &qg, j)).sqrt();
                assert_close(found[i * others.len() + j], expected[(i, j)], 1e-9 * scale, "function");
            }
        }
    }
}

fn compare_blocks(layout: &Layout, selected: &SelectedInverse, inverse: &Mat<f64>) {
    let (blocks, range) = (layout.retained(), |block: usize| layout.retained_range(block));
    for row in 0..blocks {
        assert!(selected.block(row, row).is_ok());
        for column in 0..blocks {
            let Ok(values) = selected.block(row, column) else { continue };
            let indices = range(row).flat_map(|i| range(column).map(move |j| (i, j)));
            for ((i, j), value) in indices.zip(values) {
                let scale = (inverse[(i, i)] * inverse[(j, j)]).sqrt();
                assert_close(value, inverse[(i, j)], 1e-9 * scale, "selected inverse");
            }
        }
    }
    for local in (0..layout.locals()).filter(|&local| !layout.has_uncoupled_groups(local)) {
        let blocks: BTreeSet<usize> =
            layout.groups_of(local).flat_map(|group| layout.blocks_of(group)).collect();
        for (&one, &other) in blocks.iter().flat_map(|one| blocks.iter().map(move |other| (one, other))) {
            assert!(selected.block(one, other).is_ok(), "a pair that shares a local block");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    #[test]
    fn random_systems_agree_with_dense_algebra((dense, ordering) in systems()) {
        compare_with_dense(&dense, ordering);
    }
}

#[test]
fn strip_and_block_agree_with_dense_algebra() {
    for ordering in ALL {
        compare_with_dense(&block(1, 60, 0), ordering);
        compare_with_dense(&block(7, 12, 0), ordering);
        compare_with_dense(&block(7, 12, 9), ordering);
    }
}

/// Thirty cameras of ten unknowns in turn: every observation depends on one of them.
#[test]
fn cameras_in_turn_agree_with_dense_algebra() {
    let plain = block(5, 10, 0).layout;
    let mut ptr = vec![0];
    ptr.extend((0..plain.locals()).map(|local| plain.groups_of(local).end));
    let retained: Vec<u32> = (0..plain.groups()).map(|group| plain.retained_of(group) as u32).collect();
    let cameras = retained.iter().map(|photo| 50 + photo % 30).collect();
    let layout = Layout::new(2, 3, &[[6; 50].as_slice(), &[10; 30]].concat(), ptr, retained).unwrap();
    let layout = layout.with_shared((0..=plain.groups()).collect(), cameras).unwrap();
    for ordering in [Ordering::ReverseCuthillMckee, Ordering::DissectionByPlace] {
        compare_with_dense(&Dense::new(layout.clone(), 11), ordering);
    }
}

/// Returns a block of photographs with one camera of three unknowns per strip and a shared one of ten; if `first`, the cameras precede the
/// photographs.
fn with_cameras(strips: usize, length: usize, first: bool) -> Layout {
    let (plain, photos) = (block(strips, length, 0).layout, strips * length);
    let shift = if first { strips + 1 } else { 0 };
    let camera = |index: usize| (if first { index } else { photos + index }) as u32;
    let group = |group: usize| plain.retained_of(group);
    let dims = if first {
        [vec![3; strips], vec![10], vec![6; photos]].concat()
    } else {
        [vec![6; photos], vec![3; strips], vec![10]].concat()
    };
    let mut ptr = vec![0];
    ptr.extend((0..plain.locals()).map(|local| plain.groups_of(local).end));
    let retained = (0..plain.groups()).map(|g| (group(g) + shift) as u32).collect();
    let further = (0..plain.groups()).flat_map(|g| [camera(strips), camera(group(g) / length)]).collect();
    let layout = Layout::new(2, 3, &dims, ptr, retained).unwrap();
    let layout = layout.with_shared((0..=plain.groups()).map(|g| 2 * g).collect(), further).unwrap();
    let of_photos = plain.places().unwrap();
    let of_cameras: Vec<[f64; 3]> =
        (0..=strips).map(|strip| of_photos[strip.min(strips - 1) * length + length / 2]).collect();
    let places = if first { [&of_cameras, of_photos] } else { [of_photos, &of_cameras] };
    layout.with_places(places.concat()).unwrap()
}

#[test]
fn shared_cameras_agree_with_dense_algebra() {
    for ordering in ALL {
        compare_with_dense(&Dense::new(with_cameras(1, 60, true), 13), ordering);
        compare_with_dense(&Dense::new(with_cameras(7, 12, false), 14), ordering);
        compare_with_dense(&Dense::new(with_cameras(5, 12, true), 15), ordering);
    }
}

/// Returns views of a target with fixed first points and a lens of 60 knots, on which each observation depends locally.
fn target(views: usize, points: usize, held: usize) -> Dense {
    let (near, lens) = (|k: usize| views + k % 52, |k: usize| views + 60 + k % 2);
    let ptr: Vec<usize> = (0..=points).map(|point| point * views).collect();
    let view = (0..points).flat_map(|_| 0..views as u32).collect();
    let dims = [vec![6; views], vec![2; 60], vec![9; 2]].concat();
    let layout = Layout::new(2, 3, &dims, ptr, view).unwrap();
    let about = |group: usize| {
        let first = near(group / 3 + group % views);
        (first..first + 8).step_by(1 + group % 2).chain([lens(group % views)]).map(|block| block as u32)
    };
    let shared: Vec<Vec<u32>> = (0..points * views).map(|group| about(group).collect()).collect();
    let ends = shared.iter().scan(0, |end, own| {
        *end += own.len();
        Some(*end)
    });
    let layout = layout.with_shared(std::iter::once(0).chain(ends).collect(), shared.concat()).unwrap();
    let known: Vec<bool> = (0..layout.unknowns()).map(|unknown| unknown < 3 * held).collect();
    Dense::new(layout.with_held(&known), 23)
}

#[test]
fn groups_of_held_local_blocks_stand_apart() {
    for ordering in ALL {
        compare_with_dense(&target(12, 30, 30), ordering);
        compare_with_dense(&target(12, 30, 20), ordering);
    }
}

/// The cofactors of the equations of a fixed local block are computed as cofactors of functions.
#[test]
fn equations_of_a_held_local_block_are_functions() {
    let dense = target(12, 30, 20);
    let (threads, system) = (threads(2), System::new(dense.layout.clone(), Ordering::Auto).unwrap());
    let factor = done(system.factor(&dense, &FactorOptions::default(), &mut Context::new(&threads)));
    let functions = dense.rows_of(7);
    let reduced = done(factor.reduce(&dense, &functions, None, &mut Context::new(&threads)));
    let found = done(factor.cofactors_of(&reduced, &mut Context::new(&threads)));
    let count = dense.layout.unknowns();
    let inverse =
        dense.normal_matrix().llt(faer::Side::Lower).unwrap().solve(Mat::<f64>::identity(count, count));
    let all = &dense.matrix * inverse * dense.matrix.transpose();
    let (rows, first) = (functions.len(), 2 * dense.layout.groups_of(7).start);
    assert_eq!(rows, 24);
    for (k, value) in found.iter().enumerate() {
        assert_close(*value, all[(first + k / rows, first + k % rows)], 1e-10, "of two views");
    }
}

/// The camera of the whole block is coupled to all blocks: it is eliminated last, and the others are ordered as without it.
#[test]
fn what_is_joined_to_everything_is_eliminated_last() {
    for (strips, length) in [(1, 200), (12, 40)] {
        let layout = with_cameras(strips, length, true);
        let plain = block(strips, length, 0).layout;
        for ordering in &ALL[2..] {
            let system = System::new(layout.clone(), *ordering).unwrap();
            assert_eq!(system.symbolic().order().last(), Some(&strips), "{ordering:?}");
            let cost = |layout: &Layout| {
                System::new(layout.clone(), *ordering).unwrap().symbolic().operations(layout).factor
            };
            // Thirteen additional unknowns in every front of twenty to a hundred.
            let (with, without) = (cost(&layout), cost(&plain));
            assert!(with < 4.0 * without, "{ordering:?}: {with} beside {without}");
        }
    }
}

#[test]
fn what_a_shared_camera_and_photos_leave_open_is_named() {
    let mut dense = Dense::new(with_cameras(3, 8, false), 17);
    let layout = dense.layout.clone();
    let camera = 24 + 3;
    dense.prior.weight[layout.retained_range(camera)].fill(0.0);
    dense.prior.weight[layout.retained_range(5)].fill(0.0);
    // The second unknown of the shared camera compensates the first of photo 5: only their sum is determined.
    let (photo, own) = (layout.retained_range(5).start, layout.retained_range(camera).start + 1);
    for row in 0..dense.right.len() {
        dense.matrix[(row, own)] = dense.matrix[(row, photo)];
    }
    let system = System::new(layout, Ordering::Auto).unwrap();
    let factor = done(system.factor(&dense, &FactorOptions::default(), &mut Context::new(&threads(2))));
    let deficiency = factor.deficiency().unwrap();
    assert_eq!(deficiency.blocks(), vec![vec![5, camera]]);
    assert_eq!(deficiency.unknowns(), vec![vec![photo, own]]);
}

#[test]
fn bits_do_not_depend_on_the_number_of_threads() {
    same_bits(block(8, 40, 5).layout);
    same_bits(with_cameras(8, 40, true));
    same_bits_of(&target(5, 400, 390));
}

fn same_bits(plain: Layout) {
    let term = |k: u32| Term { rows: 2, local: None, retained: vec![k, k + 40, 7] };
    same_bits_of(&Dense::new(plain.with_terms((10..30).map(term).collect()).unwrap(), 3));
}

fn same_bits_of(dense: &Dense) {
    let rights: Vec<f64> = (0..20 * dense.layout.unknowns()).map(|k| (k % 17) as f64 - 8.0).collect();
    let run = |count: usize| {
        let threads = threads(count);
        let system = System::new(dense.layout.clone(), Ordering::Auto).unwrap();
        let factor = done(system.factor(dense, &FactorOptions::default(), &mut Context::new(&threads)));
        let solution = done(factor.solve(dense, &SolveOptions::default(), &mut Context::new(&threads)));
        let more = done(factor.solve(dense, &solved_for(&rights), &mut Context::new(&threads)));
        let alone = done(system.factor(dense, &FactorOptions::UNCACHED, &mut Context::new(&threads)));
        let written = done(alone.solve(dense, &solved_for(&rights), &mut Context::new(&threads)));
        let functions: Vec<Function> =
            (0..dense.layout.unknowns()).step_by(3).map(|unknown| vec![(unknown, 1.0)]).collect();
        let reduced = done(factor.reduce(dense, &functions, None, &mut Context::new(&threads)));
        let of_functions = done(factor.cofactors_of(&reduced, &mut Context::new(&threads)));
        let cofactors =
            done(factor.invert(dense, &InvertOptions::default(), &mut Context::new(&threads))).cofactors;
        let numbers =
            [solution, more, written, of_functions, cofactors.local, cofactors.retained, cofactors.equations];
        numbers.concat().into_iter().map(f64::to_bits).collect::<Vec<u64>>()
    };
    let one = run(1);
    assert_eq!(one, run(2));
    assert_eq!(one, run(5));
}

#[test]
fn what_the_equations_do_not_determine_is_named() {
    let mut dense = block(1, 12, 0);
    let layout = dense.layout.clone();
    dense.prior.weight[layout.retained_range(3)].fill(0.0);
    // Two unknowns of photo 3 have equal columns: only their sum is determined.
    let range = layout.retained_range(3);
    for row in 0..dense.right.len() {
        dense.matrix[(row, range.start + 4)] = dense.matrix[(row, range.start + 1)];
    }
    let system = System::new(layout, Ordering::ReverseCuthillMckee).unwrap();
    let factor = done(system.factor(&dense, &FactorOptions::default(), &mut Context::new(&threads(2))));
    let deficiency = factor.deficiency().unwrap();
    assert_eq!(deficiency.blocks(), vec![vec![3]]);
}

/// Differences of consecutive unknowns in chains of [`Chains::LENGTH`].
struct Chains(Prior);

impl Chains {
    const LENGTH: usize = 30;
}

impl Equations for Chains {
    fn write(&self, _: usize, _: usize, _: &mut GroupRows<'_>) {}

    fn write_term(&self, term: usize, rows: &mut GroupRows<'_>) {
        let weight = if term.is_multiple_of(3) { 10.0 } else { 1.0 };
        rows.constant[0] = 0.0;
        rows.shared.copy_from_slice(&[-weight, weight]);
    }

    fn prior(&self) -> &Prior {
        &self.0
    }
}

#[test]
fn many_doubtful_pivots_are_told_from_lost_ones() {
    // Weak weights determine every other chain; the last pivots of all chains are small.
    let chains = 2 * 700;
    let unknowns = chains * Chains::LENGTH;
    let ends = (0..unknowns as u32 - 1).filter(|k| !(*k as usize + 1).is_multiple_of(Chains::LENGTH));
    let terms = ends.map(|k| Term { rows: 1, local: None, retained: vec![k, k + 1] }).collect();
    let layout = Layout::new(1, 1, &vec![1; unknowns], vec![0], vec![]).unwrap().with_terms(terms).unwrap();
    let mut prior = Prior { weight: vec![0.0; unknowns], right: vec![0.0; unknowns], between: vec![] };
    prior.weight.iter_mut().step_by(2 * Chains::LENGTH).for_each(|weight| *weight = 1e-9);
    let chains_of = Chains(prior);
    let chain = |chain: usize| (chain * Chains::LENGTH..(chain + 1) * Chains::LENGTH).collect();
    let expected: Vec<Vec<usize>> = (0..chains).skip(1).step_by(2).map(chain).collect();
    let system = System::new(layout, Ordering::Auto).unwrap();
    for count in [1, 3] {
        let options = FactorOptions::default();
        let factor = done(system.factor(&chains_of, &options, &mut Context::new(&threads(count))));
        let mut found = factor.deficiency().unwrap().blocks();
        found.sort();
        assert_eq!(found, expected);
    }
}

#[test]
fn local_block_without_equations_is_named() {
    let layout = Layout::new(2, 3, &[6, 6], vec![0, 2, 2, 4], vec![0, 1, 0, 1]).unwrap();
    let mut dense = Dense::new(layout.clone(), 5);
    dense.prior.weight[layout.local_range(1)].fill(0.0);
    let system = System::new(layout, Ordering::Auto).unwrap();
    let factor = done(system.factor(&dense, &FactorOptions::default(), &mut Context::new(&threads(1))));
    assert_eq!(factor.deficient_locals, vec![1]);
}

#[test]
fn more_than_can_be_numbered_is_refused() {
    let many = u32::MAX as usize;
    for retained in [[many, 1], [usize::MAX, usize::MAX]] {
        let found = Layout::new(2, 3, &retained, vec![0, 1], vec![0]);
        assert!(matches!(found, Err(LayoutError::TooMany(_))), "{retained:?}");
    }
}

#[test]
fn layouts_that_contradict_themselves_are_refused() {
    assert!(Layout::new(2, 4, &[6], vec![0, 1], vec![0]).is_err());
    assert!(Layout::new(2, 3, &[6], vec![0, 2], vec![0]).is_err());
    assert!(Layout::new(2, 3, &[6], vec![1, 1], vec![0]).is_err());
    assert!(Layout::new(2, 3, &[6], vec![0, 1], vec![1]).is_err());
    let layout = Layout::new(2, 3, &[6], vec![0, 1], vec![0]).unwrap();
    assert!(layout.clone().with_places(vec![]).is_err());
    let two = Layout::new(2, 3, &[6, 6, 3], vec![0, 2], vec![0, 0]).unwrap();
    assert!(two.clone().with_shared(vec![0, 1, 3], vec![2, 1, 2]).is_ok());
    for (ptr, blocks) in [
        (vec![0, 1], vec![2]),
        (vec![0, 2, 1], vec![2]),
        (vec![0, 1, 1], vec![2, 1]),
        (vec![0, 1, 1], vec![0]),
        (vec![0, 1, 1], vec![3]),
        (vec![0, 2, 2], vec![2, 2]),
    ] {
        assert!(two.clone().with_shared(ptr, blocks).is_err());
    }
    let refused = |rows, retained: &[u32]| {
        layout.clone().with_terms(vec![Term { rows, local: None, retained: retained.to_vec() }]).is_err()
    };
    assert!(refused(1, &[1]));
    assert!(refused(1, &[0, 0]));
    assert!(refused(1, &[]));
    assert!(refused(0, &[0]));
    assert!(!refused(1, &[0]));
    let of_local = |local, retained| {
        layout.clone().with_terms(vec![Term { rows: 1, local: Some(local), retained }]).is_err()
    };
    assert!(of_local(1, vec![]) && of_local(0, vec![0]) && !of_local(0, vec![]));
}

#[test]
fn slices_of_other_lengths_are_refused() {
    let dense = block(1, 3, 0);
    let system = System::new(dense.layout.clone(), Ordering::Auto).unwrap();
    let (threads, unknowns) = (threads(1), dense.layout.unknowns());
    let factor = |of: &Dense| system.factor(of, &FactorOptions::default(), &mut Context::new(&threads));
    let length =
        |field, length, required| SystemError::Layout(LayoutError::Length { field, length, required });
    let [mut short, mut long] = [0; 2].map(|seed| block(1, 3, seed));
    short.prior.weight.pop();
    long.prior.right.push(0.0);
    assert_eq!(factor(&short).unwrap_err(), length("Prior::weight", unknowns - 1, unknowns));
    assert_eq!(factor(&long).unwrap_err(), length("Prior::right", unknowns + 1, unknowns));
    let formed = factor(&dense).unwrap();
    let solve = |of: &Dense, options| formed.solve(of, &options, &mut Context::new(&threads));
    let refused = solve(&short, SolveOptions::default()).unwrap_err();
    assert_eq!(refused, length("Prior::weight", unknowns - 1, unknowns));
    for count in [1, unknowns - 1, 2 * unknowns + 1] {
        let expected = LayoutError::Columns { field: "SolveOptions::rights", length: count, unknowns };
        let rights = vec![0.0; count];
        let refused = formed.solve(&dense, &solved_for(&rights), &mut Context::new(&threads));
        assert_eq!(refused.unwrap_err(), SystemError::Layout(expected));
    }
    let outer = SolveOptions { outer: &[0.0], ..SolveOptions::default() };
    assert_eq!(solve(&dense, outer).unwrap_err(), length("SolveOptions::outer", 1, 0));
    let options = InvertOptions::default();
    let refused = formed.invert(&short, &options, &mut Context::new(&threads)).unwrap_err();
    assert_eq!(refused, length("Prior::weight", unknowns - 1, unknowns));
}

#[test]
fn blocks_outside_the_pattern_are_refused_unless_they_are_asked_for() {
    // Chain of twenty photos: the first and the last are not connected by a point.
    let dense = block(1, 20, 0);
    let count = dense.layout.unknowns();
    let inverse =
        dense.normal_matrix().llt(faer::Side::Lower).unwrap().solve(Mat::<f64>::identity(count, count));
    let inverted = |layout: Layout| {
        let system = System::new(layout, Ordering::Input).unwrap();
        let factoring = FactorOptions::default();
        let factor = done(system.factor(&dense, &factoring, &mut Context::new(&threads(1))));
        let options = InvertOptions::default();
        (done(factor.invert(&dense, &options, &mut Context::new(&threads(1)))), system)
    };
    let (found, _) = inverted(dense.layout.clone());
    let outside = LayoutError::Block { row: 0, column: 19 };
    assert_eq!(found.selected.block(0, 19).unwrap_err(), outside);
    assert!(matches!(found.selected.triangle(&dense.layout, &[0, 19]), Err(LayoutError::Block { .. })));
    let (with_pair, _) = inverted(dense.layout.clone().with_pairs(vec![[0, 19]]).unwrap());
    let (rows, columns) = (dense.layout.retained_range(0), dense.layout.retained_range(19));
    for (k, value) in with_pair.cofactors.pairs.iter().enumerate() {
        let (i, j) = (rows.start + k / 6, columns.start + k % 6);
        let scale = (inverse[(i, i)] * inverse[(j, j)]).sqrt();
        assert_close(*value, inverse[(i, j)], 1e-9 * scale, "pair");
    }
    assert_eq!(with_pair.cofactors.pairs.len(), 36);
    // Inverse of a system without coupling between the photos of a point.
    let count = dense.layout.groups();
    let groups: Vec<u32> = (0..count).map(|group| dense.layout.retained_of(group) as u32).collect();
    let apart = Dense::new(Layout::new(2, 3, &[6; 20], (0..=count).collect(), groups).unwrap(), 3);
    let system = System::new(apart.layout.clone(), Ordering::Input).unwrap();
    let factor = done(system.factor(&apart, &FactorOptions::default(), &mut Context::new(&threads(1))));
    let options = InvertOptions::default();
    let foreign = done(factor.invert(&apart, &options, &mut Context::new(&threads(1)))).selected;
    let (_, whole) = inverted(dense.layout.clone());
    let rows = dense.rows_of(0);
    let refused = whole.local_cofactors(&foreign, (&rows, &dense.prior.weight), &rows, 0);
    assert!(matches!(refused, Err(LayoutError::Block { .. })));
}

/// A network connected only by constraints, such as two points of equal height.
#[test]
fn terms_alone_are_a_system() {
    let layout = Layout::new(1, 1, &[1; 6], vec![0], vec![]).unwrap();
    let term = |k: u32| Term { rows: 1, local: None, retained: vec![k, (k + 1) % 6] };
    let dense = Dense::new(layout.with_terms((0..6).map(term).collect()).unwrap(), 9);
    for ordering in ALL {
        compare_with_dense(&dense, ordering);
    }
}
