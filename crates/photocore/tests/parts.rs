//! Systems partitioned into the nodes of a tree (Helmert blocking) compared with the unpartitioned systems.

#![allow(clippy::unwrap_used, clippy::panic)]

use std::collections::BTreeSet;
use std::fmt::Debug;
use std::sync::Arc;

use crate::cut::{Cut, TREES};
use photocore::normals::{
    Chord, Contribution, Equations, Factor, FactorOptions, GroupRows, InvertOptions, Layout, LayoutError,
    Ordering, Prior, ReducedRights, SolveOptions, System, Term,
};
use photocore::{Context, Threads};
use proptest::prelude::*;

/// Returns a number between -1 and 1, determined by a seed and two indices.
fn number(seed: u64, i: usize, j: usize) -> f64 {
    let mut state = seed
        ^ (i as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)
        ^ (j as u64).wrapping_mul(0xD1B5_4A32_D192_ED03);
    for _ in 0..2 {
        state = (state ^ (state >> 31)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    }
    (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// Equations of a system or of one node: local blocks, observations, constraints and retained blocks have the numbers of the whole system.
struct Piece<'a> {
    seed: u64,
    layout: Layout,
    locals: Vec<usize>,
    groups: Vec<usize>,
    terms: Vec<usize>,
    retained: Vec<usize>,
    prior: Prior,
    below: Vec<Contribution<'a>>,
}

impl Piece<'_> {
    /// Fills the coefficients of parameter blocks, each given by its number in the whole system.
    fn fill(&self, row: usize, target: &mut [f64], blocks: impl Iterator<Item = (usize, usize)>) {
        let columns = blocks.flat_map(|(block, dim)| (0..dim).map(move |k| 16 * block + k));
        target.iter_mut().zip(columns).for_each(|(value, column)| *value = number(self.seed, row, column));
    }

    fn own(&self, block: usize) -> (usize, usize) {
        (1 + self.retained[block], self.layout.retained_dim(block))
    }
}

impl Equations for Piece<'_> {
    fn write(&self, _: usize, group: usize, rows: &mut GroupRows<'_>) {
        let (layout, whole) = (&self.layout, self.groups[group]);
        for k in 0..layout.rows() {
            let row = 8 * whole + k;
            rows.constant[k] = number(self.seed, row, 7);
            let l = layout.local_dim();
            self.fill(row, &mut rows.local[l * k..][..l], [(1000, l)].into_iter());
            let main = layout.retained_of(group);
            let width = layout.retained_dim(main);
            self.fill(row, &mut rows.retained[width * k..][..width], [self.own(main)].into_iter());
            let width = layout.shared_width(group);
            let further = layout.shared_of(group).iter().map(|&block| self.own(block as usize));
            self.fill(row, &mut rows.shared[width * k..][..width], further);
        }
    }

    fn write_term(&self, term: usize, rows: &mut GroupRows<'_>) {
        let (layout, whole) = (&self.layout, self.terms[term]);
        let width = layout.term_columns(term).count();
        for (k, constant) in rows.constant.iter_mut().enumerate() {
            let row = 100_000 + 8 * whole + k;
            *constant = number(self.seed, row, 7);
            let retained = layout.terms()[term].retained.iter().map(|&block| self.own(block as usize));
            self.fill(row, &mut rows.shared[width * k..][..width], retained);
        }
    }

    fn prior(&self) -> &Prior {
        &self.prior
    }

    fn contribution(&self, below: usize) -> Option<&Contribution<'_>> {
        self.below.get(below)
    }
}

/// Returns an unpartitioned system.
fn whole(layout: Layout, seed: u64) -> Piece<'static> {
    let unknowns = layout.unknowns();
    let weight: Vec<f64> = (0..unknowns).map(|i| 0.5 + 0.4 * number(seed, i, 11)).collect();
    let right = (0..unknowns).map(|i| number(seed, i, 13)).collect();
    Piece {
        seed,
        locals: (0..layout.locals()).collect(),
        groups: (0..layout.groups()).collect(),
        terms: (0..layout.terms().len()).collect(),
        retained: (0..layout.retained()).collect(),
        prior: Prior { weight, right, between: vec![] },
        below: vec![],
        layout,
    }
}

/// Returns the retained blocks of each local block, then of each constraint.
fn touched(layout: &Layout) -> Vec<Vec<usize>> {
    let of_local = |local| {
        let blocks: BTreeSet<usize> =
            layout.groups_of(local).flat_map(|group| layout.blocks_of(group)).collect();
        blocks.into_iter().collect()
    };
    let terms = layout.terms().iter().map(|term| term.retained.iter().map(|&block| block as usize).collect());
    (0..layout.locals()).map(of_local).chain(terms).collect()
}

/// Returns node `p` of a partitioned system.
fn piece<'a>(all: &Piece<'_>, cut: &Cut, p: usize) -> Piece<'a> {
    let layout = &all.layout;
    let retained = cut.blocks(p);
    let place = |block: usize| retained.iter().position(|&own| own == block).unwrap() as u32;
    let homes = &cut.homes;
    let locals: Vec<usize> = (0..layout.locals()).filter(|&local| homes[local] == p).collect();
    let terms: Vec<usize> =
        (0..layout.terms().len()).filter(|&term| homes[layout.locals() + term] == p).collect();
    let groups: Vec<usize> = locals.iter().flat_map(|&local| layout.groups_of(local)).collect();
    let (mut ptr, mut shared_ptr, mut further) = (vec![0], vec![0], vec![]);
    locals.iter().for_each(|&local| ptr.push(ptr[ptr.len() - 1] + layout.groups_of(local).len()));
    for &group in &groups {
        further.extend(layout.shared_of(group).iter().map(|&block| place(block as usize)));
        shared_ptr.push(further.len());
    }
    let dims: Vec<usize> = retained.iter().map(|&block| layout.retained_dim(block)).collect();
    let main = groups.iter().map(|&group| place(layout.retained_of(group))).collect();
    let term = |&term: &usize| {
        let Term { rows, retained, .. } = layout.terms()[term].clone();
        Term { rows, local: None, retained: retained.iter().map(|&block| place(block as usize)).collect() }
    };
    let children = cut.children(p);
    let below = children.iter().map(|&child| cut.outer[child].iter().map(|&block| place(block)).collect());
    let own = Layout::new(layout.rows(), layout.local_dim(), &dims, ptr, main).unwrap();
    let own =
        own.with_shared(shared_ptr, further).unwrap().with_terms(terms.iter().map(term).collect()).unwrap();
    let outer = cut.outer[p].iter().map(|&block| place(block)).collect();
    let own = own.as_part(outer, below.collect()).unwrap();
    let unknowns = locals.iter().flat_map(|&local| layout.local_range(local));
    let unknowns: Vec<usize> =
        unknowns.chain(retained.iter().flat_map(|&block| layout.retained_range(block))).collect();
    let mut prior = Prior {
        weight: unknowns.iter().map(|&unknown| all.prior.weight[unknown]).collect(),
        right: unknowns.iter().map(|&unknown| all.prior.right[unknown]).collect(),
        between: vec![],
    };
    let outer: Vec<usize> = own.unknowns_of(own.outer()).collect();
    outer.iter().for_each(|&unknown| (prior.weight[unknown], prior.right[unknown]) = (0.0, 0.0));
    Piece { seed: all.seed, layout: own, locals, groups, terms, retained, prior, below: vec![] }
}

fn threads(count: usize) -> Threads {
    Threads::new(count).unwrap()
}

fn done<T, E: Debug>(result: Result<T, E>) -> T {
    result.unwrap()
}

/// Forms and eliminates all nodes of a tree from the leaves up.
fn upward<'a>(
    all: &Piece<'_>,
    cut: &Cut,
    ordering: Ordering,
    threads: &Threads,
) -> Vec<(Piece<'a>, Arc<System>, Factor)> {
    let mut left: Vec<Option<Contribution<'static>>> = vec![];
    let mut nodes = vec![];
    for p in 0..cut.parent.len() {
        let mut piece = piece(all, cut, p);
        piece.below = cut.children(p).iter().map(|&child| left[child].take().unwrap()).collect();
        let system = System::new(piece.layout.clone(), ordering).unwrap();
        let mut factor = done(system.factor(&piece, &FactorOptions::default(), &mut Context::new(threads)));
        assert!(factor.deficient_locals.is_empty() && factor.deficiency().is_none());
        let contribution = factor.take_contribution();
        let outer = system.symbolic().outer_unknowns();
        assert!(
            contribution.is_over(outer) && outer == piece.layout.unknowns_of(piece.layout.outer()).count()
        );
        left.push(Some(contribution));
        nodes.push((piece, system, factor));
    }
    nodes
}

fn assert_close(actual: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((actual - expected).abs() <= tolerance, "{what}: {actual:e} instead of {expected:e}");
}

/// Returns the unknowns of a node as numbered by the whole system.
fn unknowns_of(all: &Piece<'_>, piece: &Piece<'_>) -> Vec<usize> {
    let locals = piece.locals.iter().flat_map(|&local| all.layout.local_range(local));
    locals.chain(piece.retained.iter().flat_map(|&block| all.layout.retained_range(block))).collect()
}

/// Number of right-hand sides: more than the elimination of local blocks processes together.
const COLUMNS: usize = 9;

/// Equations, system and factor of each node.
type Nodes<'a> = Vec<(Piece<'a>, Arc<System>, Factor)>;

/// Returns right-hand sides reduced from the leaves up, and the sum of their products.
fn reduced(
    rights: &[f64],
    (all, cut, nodes): (&Piece<'_>, &Cut, &Nodes<'_>),
    threads: &Threads,
) -> (Vec<ReducedRights>, Vec<f64>) {
    let count = all.layout.unknowns();
    let (mut found, mut products): (Vec<ReducedRights>, _) = (vec![], vec![0.0; COLUMNS * COLUMNS]);
    for (p, (piece, system, factor)) in nodes.iter().enumerate() {
        let (own, names) = (system.layout(), unknowns_of(all, piece));
        let columns = rights.chunks_exact(count);
        let mut here: Vec<f64> = columns.flat_map(|right| names.iter().map(|&name| right[name])).collect();
        for right in here.chunks_exact_mut(names.len().max(1)) {
            own.unknowns_of(own.outer()).for_each(|unknown| right[unknown] = 0.0);
        }
        for (child, blocks) in cut.children(p).into_iter().zip(own.contributions()) {
            let places: Vec<usize> = own.unknowns_of(blocks).collect();
            for (i, value) in found[child].left().iter().enumerate() {
                here[i / places.len() * names.len() + places[i % places.len()]] += value;
            }
        }
        let of = piece as &dyn Equations;
        let reduced = done(factor.reduce_rights(of, &here, &mut Context::new(threads)));
        products.iter_mut().zip(&reduced.products).for_each(|(sum, value)| *sum += value);
        found.push(reduced);
    }
    (found, products)
}

/// Compares forward and back substitution through a partitioned system with the unpartitioned one.
fn compare_rights(all: &Piece<'_>, cut: &Cut, ordering: Ordering, threads: &Threads) {
    let (system, count) = (System::new(all.layout.clone(), ordering).unwrap(), all.layout.unknowns());
    let rights: Vec<f64> = (0..COLUMNS * count).map(|i| number(all.seed, i, 17)).collect();
    let factor = done(system.factor(all, &FactorOptions::default(), &mut Context::new(threads)));
    let options = SolveOptions { rights: Some(&rights), ..SolveOptions::default() };
    let expected = done(factor.solve(all, &options, &mut Context::new(threads)));
    let largest = expected.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let nodes = upward(all, cut, ordering, threads);
    let (mut found, products) = reduced(&rights, (all, cut, &nodes), threads);
    for (at, product) in products.iter().enumerate() {
        let (right, x) = (&rights[at / COLUMNS * count..], &expected[at % COLUMNS * count..]);
        let exact = right.iter().zip(x).take(count).map(|(b, x)| b * x).sum();
        assert_close(*product, exact, 1e-9 * largest * count as f64, "product");
    }
    let mut handed: Vec<Vec<f64>> = vec![vec![]; nodes.len()];
    for (p, (piece, system, factor)) in nodes.into_iter().enumerate().rev() {
        let (own, names) = (system.layout(), unknowns_of(all, &piece));
        let (of, outer) = (&piece as &dyn Equations, std::mem::take(&mut handed[p]));
        let reduced = found.remove(p);
        let x = done(factor.solve_reduced_rights(of, reduced, &outer, &mut Context::new(threads)));
        for (child, blocks) in cut.children(p).into_iter().zip(own.contributions()) {
            let of_column = |column: &[f64]| own.unknowns_of(blocks).map(|at| column[at]).collect::<Vec<_>>();
            handed[child] = x.chunks_exact(names.len().max(1)).flat_map(of_column).collect();
        }
        for (at, x) in x.iter().enumerate() {
            let exact = expected[at / names.len() * count + names[at % names.len()]];
            assert_close(*x, exact, 1e-9 * largest, "solution of a right-hand side");
        }
    }
}

/// Compares the chord step with other equations between partitioned and unpartitioned systems.
fn compare_chord(all: &Piece<'_>, cut: &Cut, ordering: Ordering, threads: &Threads) {
    let elsewhere = whole(all.layout.clone(), all.seed.wrapping_add(1));
    let system = System::new(all.layout.clone(), ordering).unwrap();
    let factor = done(system.factor(all, &FactorOptions::default(), &mut Context::new(threads)));
    assert!(factor.has_cached());
    let of = &elsewhere as &dyn Equations;
    let Chord { step: expected, decrease, .. } = done(factor.chord(of, &mut Context::new(threads)));
    let largest = expected.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let nodes = upward(all, cut, ordering, threads);
    let mut found: Vec<(Piece<'_>, ReducedRights<1>)> = vec![];
    for (p, (_, system, factor)) in nodes.iter().enumerate() {
        let (own, piece) = (system.layout(), piece(&elsewhere, cut, p));
        let mut rights = piece.prior.right.clone();
        for (child, blocks) in cut.children(p).into_iter().zip(own.contributions()) {
            let left = found[child].1.left();
            own.unknowns_of(blocks).zip(left).for_each(|(unknown, value)| rights[unknown] += value);
        }
        let of = &piece as &dyn Equations;
        let reduced = done(factor.reduce_chord(of, &rights, &mut Context::new(threads)));
        found.push((piece, reduced));
    }
    let sum: f64 = found.iter().map(|(_, reduced)| reduced.products[0]).sum();
    assert_close(sum, decrease, 1e-9 * decrease, "decrease of a chord");
    let mut handed: Vec<Vec<f64>> = vec![vec![]; nodes.len()];
    for (p, (piece, system, factor)) in nodes.into_iter().enumerate().rev() {
        let (own, outer) = (system.layout(), std::mem::take(&mut handed[p]));
        let (of, (_, reduced)) = (&piece as &dyn Equations, found.remove(p));
        let chord = done(factor.solve_reduced_rights(of, reduced, &outer, &mut Context::new(threads)));
        for (child, blocks) in cut.children(p).into_iter().zip(own.contributions()) {
            handed[child] = own.unknowns_of(blocks).map(|unknown| chord[unknown]).collect();
        }
        for (x, unknown) in chord.iter().zip(unknowns_of(all, &piece)) {
            assert_close(*x, expected[unknown], 1e-9 * largest, "chord");
        }
    }
}

/// Compares solution, sums and cofactors of a partitioned system with the unpartitioned one.
fn compare(layout: Layout, tree: &[Option<usize>], node_of: Vec<usize>, seed: u64, ordering: Ordering) {
    let threads = threads(2);
    let cut = Cut::new(tree, &touched(&layout), node_of);
    let all = whole(layout, seed);
    let system = System::new(all.layout.clone(), ordering).unwrap();
    let factor = done(system.factor(&all, &FactorOptions::default(), &mut Context::new(&threads)));
    let expected = done(factor.solve(&all, &SolveOptions::default(), &mut Context::new(&threads)));
    let (sum, decrease) = (factor.sum_of_squares, factor.decrease);
    let cofactors = done(factor.invert(&all, &InvertOptions::default(), &mut Context::new(&threads)));
    compare_rights(&all, &cut, ordering, &threads);
    compare_chord(&all, &cut, ordering, &threads);
    let nodes = upward(&all, &cut, ordering, &threads);
    let sums = nodes.iter().map(|(.., factor)| factor.sum_of_squares).sum();
    assert_close(sums, sum, 1e-12 * sum, "sum of squares");
    assert_close(
        nodes.iter().map(|(.., factor)| factor.decrease).sum(),
        decrease,
        1e-9 * decrease,
        "decrease",
    );
    let largest = expected.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let mut handed: Vec<(Vec<f64>, Vec<f64>)> = vec![Default::default(); nodes.len()];
    for (p, (piece, system, factor)) in nodes.into_iter().enumerate().rev() {
        let (outer_step, outer_cofactors) = std::mem::take(&mut handed[p]);
        let step = done(factor.solve(
            &piece,
            &SolveOptions { outer: &outer_step, ..SolveOptions::default() },
            &mut Context::new(&threads),
        ));
        let own = system.layout();
        for (x, unknown) in step.iter().zip(unknowns_of(&all, &piece)) {
            assert_close(*x, expected[unknown], 1e-9 * largest, "solution");
        }
        let found = done(factor.invert(
            &piece,
            &InvertOptions { outer: &outer_cofactors, ..InvertOptions::default() },
            &mut Context::new(&threads),
        ));
        for (child, blocks) in cut.children(p).into_iter().zip(own.contributions()) {
            let outer_step = own.unknowns_of(blocks).map(|unknown| step[unknown]).collect();
            handed[child] = (outer_step, found.selected.triangle(own, blocks).unwrap());
        }
        for (i, &block) in piece.retained.iter().enumerate() {
            let pair =
                [found.selected.block(i, i), cofactors.selected.block(block, block)].map(Result::unwrap);
            pair[0]
                .iter()
                .zip(&pair[1])
                .for_each(|(q, exact)| assert_close(*q, *exact, 1e-9, "retained cofactor"));
        }
        let squares = own.local_dim() * own.local_dim();
        for (i, &local) in piece.locals.iter().enumerate() {
            for k in 0..squares {
                let exact = cofactors.cofactors.local[squares * local + k];
                assert_close(found.cofactors.local[squares * i + k], exact, 1e-9, "local cofactor");
            }
        }
        let rows = own.rows();
        let of_groups = piece.groups.iter().flat_map(|&group| rows * group..rows * (group + 1));
        let of_terms = piece.terms.iter().flat_map(|&term| all.layout.equations_of_term(term));
        for (share, row) in found.cofactors.equations.iter().zip(of_groups.chain(of_terms)) {
            assert_close(*share, cofactors.cofactors.equations[row], 1e-9, "adjusted equation");
        }
    }
}

const ALL: [Ordering; 4] =
    [Ordering::Auto, Ordering::Input, Ordering::MinimumDegree, Ordering::DissectionByGraph];

/// Systems of local blocks on one to three of some main blocks, with common blocks and constraints.
fn systems() -> impl Strategy<Value = (Layout, u64)> {
    let shape = (1..4usize, prop::collection::vec(1..8usize, 4..16), 0..3u32);
    let of_shape = |(l, retained, common): (usize, Vec<usize>, u32)| {
        let main = common..retained.len() as u32;
        let further = prop::collection::btree_set(0..common.max(1), 0..=common as usize);
        let groups = prop::collection::vec(prop::collection::vec((main, further), 1..4), 1..40);
        let tied = prop::collection::btree_set(0..retained.len() as u32, 1..4);
        (Just((l, retained)), groups, prop::collection::vec((1..4usize, tied), 0..6), any::<u64>())
    };
    shape.prop_flat_map(of_shape).prop_map(|((l, retained), locals, terms, seed)| {
        let mut ptr = vec![0];
        locals.iter().for_each(|groups| ptr.push(ptr[ptr.len() - 1] + groups.len()));
        let (main, further): (Vec<u32>, Vec<BTreeSet<u32>>) = locals.into_iter().flatten().unzip();
        let mut shared_ptr = vec![0];
        further.iter().for_each(|own| shared_ptr.push(shared_ptr[shared_ptr.len() - 1] + own.len()));
        let further = further.into_iter().flatten().collect();
        let term = |(rows, retained): (usize, BTreeSet<u32>)| Term {
            rows,
            local: None,
            retained: retained.into_iter().collect(),
        };
        let layout =
            Layout::new(2, l, &retained, ptr, main).unwrap().with_shared(shared_ptr, further).unwrap();
        (layout.with_terms(terms.into_iter().map(term).collect()).unwrap(), seed)
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, ..ProptestConfig::default() })]

    #[test]
    fn parts_agree_with_one_piece(
        (layout, seed) in systems(),
        ordering in prop::sample::select(ALL.to_vec()),
        tree in 0..TREES.len(),
    ) {
        let tree = TREES[tree];
        let place = |block: usize| (number(seed, block, 17).abs() * tree.len() as f64) as usize;
        let node_of = (0..layout.retained()).map(place).collect();
        compare(layout, tree, node_of, seed, ordering);
    }
}

/// Returns a block of strips, with a camera for every strip.
fn strips(count: usize, length: usize) -> Layout {
    let (mut ptr, mut retained, mut shared_ptr, mut further) = (vec![0], vec![], vec![0], vec![]);
    for strip in 0..count {
        for photo in 0..length {
            for reach in [2, 3] {
                for s in strip..count.min(strip + 2) {
                    for p in photo..length.min(photo + reach) {
                        retained.push((s * length + p) as u32);
                        further.push((count * length + s) as u32);
                        shared_ptr.push(further.len());
                    }
                }
                ptr.push(retained.len());
            }
        }
    }
    let dims = [vec![6; count * length], vec![3; count]].concat();
    Layout::new(2, 3, &dims, ptr, retained).unwrap().with_shared(shared_ptr, further).unwrap()
}

#[test]
fn a_block_with_cameras_in_seven_nodes_agrees_with_one_piece() {
    let (count, length) = (5, 24);
    let layout = strips(count, length);
    // Four leaves across the strips; shared blocks move up.
    let node_of = (0..count * length).map(|photo| [0, 1, 3, 4][4 * (photo % length) / length]);
    let node_of: Vec<usize> = node_of.chain([6; 5]).collect();
    compare(
        layout,
        &[Some(2), Some(2), Some(6), Some(5), Some(5), Some(6), None],
        node_of,
        3,
        Ordering::Auto,
    );
}

#[test]
fn bits_of_a_node_do_not_depend_on_the_number_of_threads() {
    let layout = strips(4, 30);
    let node_of = (0..120).map(|photo| usize::from(photo % 30 >= 15)).chain([2; 4]).collect();
    let cut = Cut::new(&[Some(2), Some(2), None], &touched(&layout), node_of);
    let all = whole(layout, 5);
    let left = [1, 3].map(|count| {
        let threads = threads(count);
        let mut numbers = vec![];
        for p in 0..2 {
            let piece = piece(&all, &cut, p);
            let system = System::new(piece.layout.clone(), Ordering::Auto).unwrap();
            let mut factor =
                done(system.factor(&piece, &FactorOptions::default(), &mut Context::new(&threads)));
            let Contribution { matrix, right, diagonal } = factor.take_contribution();
            numbers.extend([matrix, right, diagonal].concat());
            assert!(factor.take_contribution().matrix.is_empty(), "handed out once");
        }
        numbers
    });
    assert!(left[0].iter().zip(&left[1]).all(|(a, b)| a.to_bits() == b.to_bits()));
}

#[test]
fn parts_that_contradict_their_layout_are_refused() {
    let layout = || Layout::new(1, 1, &[1, 1], vec![0, 2], vec![0, 1]).unwrap();
    for (outer, below) in
        [(vec![2], vec![]), (vec![1, 1], vec![]), (vec![], vec![vec![0, 2]]), (vec![], vec![vec![1, 1]])]
    {
        assert_eq!(layout().as_part(outer, below).err(), Some(LayoutError::Outer));
    }
    assert!(layout().as_part(vec![1], vec![]).is_ok());
}
