//! What observations and weights leave open of a network as a whole, and what to hold where nothing else gives a datum.
//!
//! A motion of the whole (a shift, a rotation, a change of scale) moves the unknowns along a vector g. Observations leave it open when no row
//! of their partials changes: A g = 0. Of several candidates, the columns of G, all combinations z are found with A G z = 0, from the
//! normal matrix of the candidates, (A G)^T (A G), which takes one pass over the observations and no factorisation.
//!
//! What keeps a network from moving as a whole, kind by kind.

use faer::{Mat, Side};

use super::equations::{ObservationEquations, Row};
use super::problem::{AnyProblem, Motions};
use super::walk::Buffers;
use crate::normals::{Equations, TieRows};
use crate::{Threads, parallel};

/// The combinations of motions that are open at some values of the unknowns.
pub(super) struct Open {
    /// Motions (rows) in each combination (columns).
    pub combinations: Mat<f64>,
    /// As many unknowns as combinations, where there are so many that tell these apart.
    pub hold: Vec<usize>,
}

/// What a combination may change of the observations, as the square of a share of what its parts change, and be rounding: the eigenvalues
/// of a matrix of ones are good to 1e-15. Positions of photos that are observed to a hundred metres change a hundred times as much; the
/// verticals of an ellipsoid, which attitudes to a thousandth tell apart over kilometres only, 2e-14, which a factor cannot tell from nothing.
const NULL: f64 = 1e-12;
/// An unknown holds a combination when that moves it by more than this share of what its parts do: the first that do so well, or at all. Up at a
/// plumb line moves latitudes, too, over metres by a millionth, and a network that is held by these is so weakly.
const HOLDS: [f64; 2] = [1e-2, 1e-6];
/// Local blocks that are added up one after the other.
const AT_ONCE: usize = 256;

/// Local blocks that are looked at at the least where all are known to leave all motions open.
const SAMPLE: usize = 1024;

/// Candidates are taken so many at once, in the registers of one instruction: there are seven, and one that moves nothing.
const LANES: usize = 8;

/// Sums over rows a, for candidates k and m. The second and third take the unknowns apart that the first lets act together.
pub(super) struct Sums {
    /// (a . g_k) (a . g_m), and the same of every unknown that is weighted or fixed.
    together: Vec<f64>,
    /// The sum of (a_i g_ik)^2 over the unknowns i.
    apart: Vec<[f64; LANES]>,
    /// Room for the a . g_k of a row.
    along: Vec<[f64; LANES]>,
}

impl Sums {
    /// For candidates that fill so many times the lanes.
    fn zero(parts: usize) -> Self {
        let none = vec![[0.0; LANES]; parts];
        Self { together: vec![0.0; (parts * LANES).pow(2)], apart: none.clone(), along: none }
    }

    /// The greatest share of what one of so many candidates changes that remains when the unknowns act together.
    pub fn share(&self, count: usize) -> f64 {
        let stride = self.apart.len() * LANES;
        let share = |k: usize| {
            let apart = self.apart.as_flattened()[k];
            if apart > 0.0 { (self.together[k * stride + k] / apart).sqrt() } else { 0.0 }
        };
        (0..count).map(share).fold(0.0, f64::max)
    }

    fn multiply(&mut self, factor: f64) {
        let apart = self.apart.as_flattened_mut().iter_mut();
        self.together.iter_mut().chain(apart).for_each(|sum| *sum *= factor);
    }

    fn add(&mut self, other: &Self) {
        self.together.iter_mut().zip(&other.together).for_each(|(sum, value)| *sum += value);
        let (own, other) = (self.apart.as_flattened_mut(), other.apart.as_flattened());
        own.iter_mut().zip(other).for_each(|(sum, value)| *sum += value);
    }
}

/// The candidates, unknown by unknown, and which of the unknowns are fixed.
pub(super) struct Candidates<'a> {
    parts: usize,
    by_unknown: &'a [[f64; LANES]],
    fixed: &'a [bool],
}

impl<'a> Candidates<'a> {
    pub fn new(motions: &Motions, by_unknown: &'a [[f64; LANES]], fixed: &'a [bool]) -> Self {
        Self { parts: motions.vectors.len().div_ceil(LANES), by_unknown, fixed }
    }

    /// How motions move each of so many unknowns.
    pub fn by_unknown(motions: &Motions, unknowns: usize) -> Vec<[f64; LANES]> {
        let parts = motions.vectors.len().div_ceil(LANES);
        let moved = |at: usize| {
            let (unknown, first) = (at / parts, at % parts * LANES);
            std::array::from_fn(|k| motions.vectors.get(first + k).map_or(0.0, |vector| vector[unknown]))
        };
        (0..unknowns * parts).map(moved).collect()
    }

    /// No sums yet.
    pub fn sums(&self) -> Sums {
        Sums::zero(self.parts)
    }

    /// Whether any of them moves a fixed unknown.
    fn move_fixed(&self) -> bool {
        let moved = |unknown: usize| self.of(unknown).as_flattened().iter().any(|&change| change != 0.0);
        self.fixed.iter().enumerate().any(|(unknown, &fixed)| fixed && moved(unknown))
    }

    /// How they move an unknown.
    fn of(&self, unknown: usize) -> &[[f64; LANES]] {
        &self.by_unknown[unknown * self.parts..][..self.parts]
    }

    /// Adds one row of partials. A fixed unknown is an observation of the weight that this row gives it.
    pub fn add_row(&self, sums: &mut Sums, row: impl Iterator<Item = (usize, f64)>) {
        sums.along.fill([0.0; LANES]);
        self.add_to_row(sums, row);
    }

    /// Adds the rows of a tie, without what the motions make of the displacement that it misses by (see [`Evaluated::carried`]).
    pub fn add_tie(
        &self,
        sums: &mut Sums,
        equations: &ObservationEquations<'_>,
        tie: usize,
        rows: &mut TieRows<'_>,
    ) {
        equations.write_tie(tie, rows);
        let layout = equations.problem().layout();
        let carried = equations.at().carried(tie);
        let first = layout.groups() * layout.rows() + layout.tie_rows(tie).start;
        let width = layout.tie_columns(tie).count();
        for (k, row) in rows.coefficients.chunks_exact(width.max(1)).enumerate() {
            sums.along.fill([0.0; LANES]);
            if let Some((motion, carried)) = &carried {
                let along = sums.along.as_flattened_mut()[*motion..].iter_mut();
                let sd = equations.deviation(first + k);
                if sd.is_finite() {
                    along.zip(&carried[k]).for_each(|(along, by)| *along = by / sd);
                }
            }
            self.add_to_row(sums, layout.tie_columns(tie).zip(row.iter().copied()));
        }
    }

    /// Adds a row to what the candidates make of it already.
    fn add_to_row(&self, sums: &mut Sums, row: impl Iterator<Item = (usize, f64)>) {
        for (unknown, coefficient) in row {
            let moved = self.of(unknown);
            for ((along, apart), moved) in sums.along.iter_mut().zip(&mut sums.apart).zip(moved) {
                for k in 0..LANES {
                    let change = coefficient * moved[k];
                    along[k] += change;
                    apart[k] += change * change;
                }
            }
            if self.fixed[unknown] {
                add_square(&mut sums.together, coefficient * coefficient, moved);
            }
        }
        add_square(&mut sums.together, 1.0, &sums.along);
    }
}

/// Adds w (b b^T).
fn add_square(sum: &mut [f64], weight: f64, b: &[[f64; LANES]]) {
    let rows = sum.chunks_exact_mut(b.len() * LANES);
    for (row, &left) in rows.zip(b.as_flattened()) {
        let parts = row.as_chunks_mut::<LANES>().0.iter_mut().zip(b);
        parts.for_each(|(sum, right)| (0..LANES).for_each(|k| sum[k] += weight * left * right[k]));
    }
}

impl AnyProblem<'_> {
    /// Which of some motions observations and weights leave open at given values, so many at the least; None where it is none.
    pub(super) fn open(
        &self,
        values: &[f64],
        motions: &Motions,
        least: usize,
        threads: &Threads,
    ) -> Option<Open> {
        self.open_without(values, motions, (&[], least), threads)
    }

    /// How many motions would be open at given values if what is known of some unknowns themselves (ascending) were not: with as many
    /// of these, and a network that is determined, they give a datum and nothing more.
    pub fn open_if_free(&self, values: &[f64], released: &[usize], threads: &Threads) -> usize {
        let motions = threads.install(|| self.model.all_motions(values));
        let open = motions.and_then(|motions| self.open_without(values, &motions, (released, 0), threads));
        open.map_or(0, |open| open.combinations.ncols())
    }

    fn open_without(
        &self,
        values: &[f64],
        motions: &Motions,
        (released, least): (&[usize], usize),
        threads: &Threads,
    ) -> Option<Open> {
        let sums = self.sums(values, motions, released, threads);
        let count = motions.vectors.len();
        let stride = sums.apart.len() * LANES;
        let scale: Vec<f64> = sums.apart.as_flattened()[..count]
            .iter()
            .map(|&sum| if sum > 0.0 { sum.sqrt().recip() } else { 0.0 })
            .collect();
        let scaled = Mat::from_fn(count, count, |k, m| {
            // What moves nothing that is observed is no motion of this network.
            if k == m && scale[k] == 0.0 { 1.0 } else { sums.together[k * stride + m] * scale[k] * scale[m] }
        });
        let eigen = threads.install(|| scaled.self_adjoint_eigen(Side::Lower)).ok()?;
        let open: Vec<usize> = (0..count).filter(|&k| k < least || eigen.S()[k] < NULL).collect();
        let combinations =
            Mat::from_fn(count, open.len(), |k, column| scale[k] * eigen.U()[(k, open[column])]);
        let length = |&unknown: &usize| {
            let square = |k: usize| (motions.vectors[k][unknown] * scale[k]).powi(2);
            (unknown, (0..count).map(square).sum::<f64>().sqrt())
        };
        let free = motions.preferred.iter().filter(|&&unknown| self.sd[unknown] != 0.0);
        let hold = to_hold(motions, &combinations, free.map(length));
        (!open.is_empty()).then_some(Open { combinations, hold })
    }

    /// The unknowns to hold at given values; none where there is a datum.
    pub(crate) fn to_hold(&self, values: &[f64], threads: &Threads) -> Vec<usize> {
        let motions = threads.install(|| self.model.motions(values));
        let open = motions.and_then(|motions| self.open(values, &motions, 0, threads));
        open.map_or(vec![], |open| open.hold)
    }

    fn sums(&self, values: &[f64], motions: &Motions, released: &[usize], threads: &Threads) -> Sums {
        let layout = self.layout();
        let by_unknown = Candidates::by_unknown(motions, values.len());
        let stays = |unknown: &usize| released.binary_search(unknown).is_err();
        let fixed: Vec<bool> = (0..values.len()).map(|i| self.sd[i] == 0.0 && stays(&i)).collect();
        let candidates = Candidates::new(motions, &by_unknown, &fixed);
        let equations = ObservationEquations::of_all(self, values, threads);
        let known = self.model.groups_leave_open() && !candidates.move_fixed();
        // One of so many local blocks is taken for them all.
        let stride = if known { (layout.locals() / SAMPLE).max(1) } else { 1 };
        let sample = layout.locals().div_ceil(stride);
        let chunk = |chunk: usize| {
            let (mut sums, mut buffers) = (candidates.sums(), Buffers::default());
            for local in chunk * AT_ONCE..((chunk + 1) * AT_ONCE).min(sample) {
                let add = |row: &Row<'_>| candidates.add_row(&mut sums, row.taken());
                equations.each_row(&mut buffers, local * stride, add);
            }
            sums
        };
        let mut sums = candidates.sums();
        threads
            .install(|| parallel::map(sample.div_ceil(AT_ONCE), 1, chunk))
            .iter()
            .for_each(|part| sums.add(part));
        sums.multiply(stride as f64);
        self.for_ties(|tie, rows| {
            candidates.add_tie(&mut sums, &equations, tie, rows);
        });
        for term in
            self.terms(values).within(0..values.len()).filter(|term| term.unknowns().all(|i| stays(&i)))
        {
            for row in term.rows() {
                candidates.add_row(&mut sums, term.unknowns().zip(row.iter().copied()));
            }
        }
        sums
    }
}

/// How a combination of motions moves an unknown.
fn along(motions: &Motions, combinations: &Mat<f64>, unknown: usize, column: usize) -> f64 {
    motions.vectors.iter().enumerate().map(|(k, vector)| vector[unknown] * combinations[(k, column)]).sum()
}

/// The first of some unknowns, with the lengths of what moves them, that tell the null vectors apart (Gram and Schmidt).
fn to_hold(
    motions: &Motions,
    combinations: &Mat<f64>,
    unknowns: impl Iterator<Item = (usize, f64)> + Clone,
) -> Vec<usize> {
    let d = combinations.ncols();
    let (mut basis, mut held): (Vec<Vec<f64>>, _) = (vec![], vec![]);
    for (share, (unknown, length)) in
        HOLDS.iter().flat_map(|share| unknowns.clone().map(move |own| (share, own)))
    {
        if held.len() == d {
            break;
        }
        let mut row: Vec<f64> = (0..d).map(|k| along(motions, combinations, unknown, k)).collect();
        for direction in &basis {
            let along: f64 = row.iter().zip(direction).map(|(x, y)| x * y).sum();
            row.iter_mut().zip(direction).for_each(|(x, y)| *x -= along * y);
        }
        let rest = row.iter().map(|x| x * x).sum::<f64>().sqrt();
        if rest > share * length {
            basis.push(row.iter().map(|x| x / rest).collect());
            held.push(unknown);
        }
    }
    held
}

/// Kinds of observations, by their numbers: groups are of the first.
#[derive(Debug, Clone, Copy)]
pub struct Classes<'a> {
    /// How many kinds there are.
    pub count: usize,
    /// Of each tie.
    pub of_ties: &'a [usize],
    /// Of each unknown, as an observation of itself.
    pub of_unknowns: &'a [usize],
}

impl AnyProblem<'_> {
    /// For each kind of observation the share of what a motion changes in it that remains when all unknowns move together, the greatest
    /// of all motions: one for what is fixed, and rounding where the kind leaves all of them open.
    pub fn resistance(&self, values: &[f64], classes: &Classes<'_>, threads: &Threads) -> Vec<f64> {
        let none = vec![0.0; classes.count];
        let Some(motions) = threads.install(|| self.model.all_motions(values)) else { return none };
        let (layout, count) = (self.layout(), motions.vectors.len());
        let moved = Candidates::by_unknown(&motions, values.len());
        let free = vec![false; values.len()];
        let candidates = Candidates::new(&motions, &moved, &free);
        let equations = ObservationEquations::of_all(self, values, threads);
        let mut sums: Vec<Sums> = (0..classes.count).map(|_| candidates.sums()).collect();
        let mut buffers = Buffers::default();
        if let Some(groups) = sums.first_mut() {
            for local in 0..layout.locals() {
                equations.each_row(&mut buffers, local, |row| candidates.add_row(groups, row.taken()));
            }
        }
        self.for_ties(|tie, rows| {
            candidates.add_tie(&mut sums[classes.of_ties[tie]], &equations, tie, rows);
        });
        let mut observed: Vec<bool> = self.sd.iter().map(|&sd| sd == 0.0).collect();
        self.terms(values).within(0..values.len()).for_each(|term| observed[term.unknowns()].fill(true));
        let mut shares: Vec<f64> = sums.iter().map(|own| own.share(count)).collect();
        for (unknown, &class) in classes.of_unknowns.iter().enumerate() {
            if observed[unknown] && motions.vectors.iter().any(|vector| vector[unknown] != 0.0) {
                shares[class] = 1.0;
            }
        }
        shares
    }
}
