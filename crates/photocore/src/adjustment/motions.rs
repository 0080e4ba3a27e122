//! Datum transformations that observations and weights leave free, and the unknowns to constrain for a datum.
//!
//! A motion of the whole network (translation, rotation, change of scale) moves the unknowns along a vector g. Observations leave it free
//! if A g = 0. From candidate columns G, all combinations z with A G z = 0 are found. They are null vectors of (A G)^T (A G), which needs a
//! single pass over the observations and no factorisation.
//!
//! Datum information of each type of observation.

use faer::{Mat, Side};

use super::equations::{EquationOf, ObservationEquations, Row};
use super::problem::{AnyProblem, Motions};
use super::walk::Buffers;
use crate::{Threads, parallel};

/// Free combinations of motions at some values of the unknowns.
pub(super) struct Open {
    /// Matrix of motions (rows) in combinations (columns).
    pub combinations: Mat<f64>,
    /// One unknown per combination to constrain, if there are enough independent ones.
    pub hold: Vec<usize>,
}

/// Maximum eigenvalue of a free combination: squared change of the observations relative to the changes by its parts. Rounding errors are
/// about 1e-15. Photo positions with a standard deviation of 100 m give a hundred times this limit. Ellipsoid normals, which attitudes
/// separate only over kilometres, give 2e-14, which a factor cannot distinguish from zero.
const NULL: f64 = 1e-12;
/// Minimum relative change of an unknown by a combination that it may constrain: preferred, or at all. Example of a weak constraint: the
/// height at a plumb line changes the latitude by 1e-6 over some metres.
const HOLDS: [f64; 2] = [1e-2, 1e-6];
/// Number of local blocks that are summed serially.
const AT_ONCE: usize = 256;

/// Minimum number of sampled local blocks, if all are known to leave all motions free.
const SAMPLE: usize = 1024;

/// Number of candidates per vector instruction: seven, and a zero one.
const LANES: usize = 8;

/// Sums over rows a, for candidates k and m.
pub(super) struct Sums {
    /// (a . g_k) (a . g_m), and separate terms of weighted or fixed unknowns.
    together: Vec<f64>,
    /// Sum of (a_i g_ik)^2 over the unknowns i.
    difference: Vec<[f64; LANES]>,
    /// Scratch memory for the a . g_k of a row.
    along: Vec<[f64; LANES]>,
}

impl Sums {
    /// Creates zero sums for `parts` vectors of candidates.
    fn zero(parts: usize) -> Self {
        let none = vec![[0.0; LANES]; parts];
        Self { together: vec![0.0; (parts * LANES).pow(2)], difference: none.clone(), along: none }
    }

    /// Returns the maximum over `count` candidates of the joint change relative to the separate changes by single unknowns.
    pub fn share(&self, count: usize) -> f64 {
        let stride = self.difference.len() * LANES;
        let share = |k: usize| {
            let difference = self.difference.as_flattened()[k];
            if difference > 0.0 { (self.together[k * stride + k] / difference).sqrt() } else { 0.0 }
        };
        (0..count).map(share).fold(0.0, f64::max)
    }

    fn multiply(&mut self, factor: f64) {
        let difference = self.difference.as_flattened_mut().iter_mut();
        self.together.iter_mut().chain(difference).for_each(|sum| *sum *= factor);
    }

    fn add(&mut self, other: &Self) {
        self.together.iter_mut().zip(&other.together).for_each(|(sum, value)| *sum += value);
        let (own, other) = (self.difference.as_flattened_mut(), other.difference.as_flattened());
        own.iter_mut().zip(other).for_each(|(sum, value)| *sum += value);
    }
}

/// Candidates by unknown, with flags of fixed unknowns.
pub(super) struct Candidates<'a> {
    parts: usize,
    by_unknown: &'a [[f64; LANES]],
    fixed: &'a [bool],
}

impl<'a> Candidates<'a> {
    pub fn new(motions: &Motions, by_unknown: &'a [[f64; LANES]], fixed: &'a [bool]) -> Self {
        Self { parts: motions.vectors.len().div_ceil(LANES), by_unknown, fixed }
    }

    /// Returns the change of each unknown by the motions.
    pub fn by_unknown(motions: &Motions, unknowns: usize) -> Vec<[f64; LANES]> {
        let parts = motions.vectors.len().div_ceil(LANES);
        let moved = |at: usize| {
            let (unknown, first) = (at / parts, at % parts * LANES);
            std::array::from_fn(|k| motions.vectors.get(first + k).map_or(0.0, |vector| vector[unknown]))
        };
        (0..unknowns * parts).map(moved).collect()
    }

    /// Creates zero sums.
    pub fn sums(&self) -> Sums {
        Sums::zero(self.parts)
    }

    /// Whether a candidate moves a fixed unknown.
    fn move_fixed(&self) -> bool {
        let moved = |unknown: usize| self.of(unknown).as_flattened().iter().any(|&change| change != 0.0);
        self.fixed.iter().enumerate().any(|(unknown, &fixed)| fixed && moved(unknown))
    }

    /// Returns the changes of an unknown.
    fn of(&self, unknown: usize) -> &[[f64; LANES]] {
        &self.by_unknown[unknown * self.parts..][..self.parts]
    }

    /// Adds one row of partials. Fixed unknowns count as observations with the weight in this row.
    pub fn add_row(&self, sums: &mut Sums, row: impl Iterator<Item = (usize, f64)>) {
        sums.along.fill([0.0; LANES]);
        self.add_to_row(sums, row);
    }

    /// Adds a row of a term or prior, with corrections for the transformation of its misclosure (see [`Evaluated::carried`]).
    pub fn add_other_row(&self, sums: &mut Sums, equations: &ObservationEquations<'_>, row: &Row<'_>) {
        sums.along.fill([0.0; LANES]);
        let sd = equations.deviation(row.number);
        if let EquationOf::Term { term, row } = row.of
            && sd.is_finite()
            && let Some((motion, carried)) = equations.at().carried(term)
        {
            let along = sums.along.as_flattened_mut()[motion..].iter_mut();
            along.zip(&carried[row]).for_each(|(along, by)| *along = by / sd);
        }
        self.add_to_row(sums, row.entries());
    }

    /// Adds a row to the current changes in `sums.along`.
    fn add_to_row(&self, sums: &mut Sums, row: impl Iterator<Item = (usize, f64)>) {
        for (unknown, coefficient) in row {
            let moved = self.of(unknown);
            for ((along, difference), moved) in sums.along.iter_mut().zip(&mut sums.difference).zip(moved) {
                for k in 0..LANES {
                    let change = coefficient * moved[k];
                    along[k] += change;
                    difference[k] += change * change;
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
    /// Returns the free combinations of motions at given values, at least `least`; None if there are none.
    pub(super) fn open(
        &self,
        values: &[f64],
        motions: &Motions,
        least: usize,
        threads: &Threads,
    ) -> Option<Open> {
        self.open_without(values, motions, (&[], least), threads)
    }

    /// Returns the number of free motions without the priors of some unknowns (ascending). If the number of these unknowns is equal and the
    /// network is determined, their priors only define the datum.
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
        let stride = sums.difference.len() * LANES;
        let scale: Vec<f64> = sums.difference.as_flattened()[..count]
            .iter()
            .map(|&sum| if sum > 0.0 { sum.sqrt().recip() } else { 0.0 })
            .collect();
        let scaled = Mat::from_fn(count, count, |k, m| {
            // A motion without effect on observations is not a motion of this network.
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

    /// Returns the unknowns to constrain at given values; empty if a datum is defined.
    #[doc(hidden)]
    pub fn to_hold(&self, values: &[f64], threads: &Threads) -> Vec<usize> {
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
        let equations = ObservationEquations::new(self, None, values, &[], threads).with_fixed_columns();
        let known = self.model.groups_leave_open() && !candidates.move_fixed();
        // A sample represents all local blocks.
        let stride = if known { (layout.locals() / SAMPLE).max(1) } else { 1 };
        let sample = layout.locals().div_ceil(stride);
        let chunk = |chunk: usize| {
            let (mut sums, mut buffers) = (candidates.sums(), Buffers::default());
            for local in chunk * AT_ONCE..((chunk + 1) * AT_ONCE).min(sample) {
                let add = |row: &Row<'_>| candidates.add_row(&mut sums, row.entries());
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
        let is_released = |row: &Row<'_>| {
            matches!(row.of, EquationOf::Unknown(_)) && !row.entries().all(|(unknown, _)| stays(&unknown))
        };
        equations.each_other_row(false, |row| {
            if !is_released(row) {
                candidates.add_other_row(&mut sums, &equations, row);
            }
        });
        sums
    }
}

/// Returns the change of an unknown by a combination of motions.
fn along(motions: &Motions, combinations: &Mat<f64>, unknown: usize, column: usize) -> f64 {
    motions.vectors.iter().enumerate().map(|(k, vector)| vector[unknown] * combinations[(k, column)]).sum()
}

/// Returns the first unknowns, with lengths of their motion vectors, that separate the null vectors (Gram-Schmidt).
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

/// Observation types by index; groups have type 0.
#[derive(Debug, Clone, Copy)]
pub struct Classes<'a> {
    /// Number of types.
    pub count: usize,
    /// Type of each term.
    pub of_terms: &'a [usize],
    /// Type of each unknown, as an observation of itself.
    pub of_unknowns: &'a [usize],
}

impl AnyProblem<'_> {
    /// Returns for each observation type the joint change by a motion relative to the changes by single unknowns, maximum over the motions.
    /// The value is 1 for fixed unknowns, and a rounding error if the type leaves all motions free.
    pub fn resistance(&self, values: &[f64], classes: &Classes<'_>, threads: &Threads) -> Vec<f64> {
        let none = vec![0.0; classes.count];
        let Some(motions) = threads.install(|| self.model.all_motions(values)) else { return none };
        let (layout, count) = (self.layout(), motions.vectors.len());
        let moved = Candidates::by_unknown(&motions, values.len());
        let free = vec![false; values.len()];
        let candidates = Candidates::new(&motions, &moved, &free);
        let equations = ObservationEquations::new(self, None, values, &[], threads).with_fixed_columns();
        let mut sums: Vec<Sums> = (0..classes.count).map(|_| candidates.sums()).collect();
        let mut buffers = Buffers::default();
        if let Some(groups) = sums.first_mut() {
            for local in 0..layout.locals() {
                equations.each_row(&mut buffers, local, |row| candidates.add_row(groups, row.entries()));
            }
        }
        let mut observed: Vec<bool> = self.sd.iter().map(|&sd| sd == 0.0).collect();
        equations.each_other_row(false, |row| match row.of {
            EquationOf::Term { term, .. } => {
                candidates.add_other_row(&mut sums[classes.of_terms[term]], &equations, row);
            }
            _ => row.entries().for_each(|(unknown, _)| observed[unknown] = true),
        });
        let mut shares: Vec<f64> = sums.iter().map(|own| own.share(count)).collect();
        for (unknown, &class) in classes.of_unknowns.iter().enumerate() {
            if observed[unknown] && motions.vectors.iter().any(|vector| vector[unknown] != 0.0) {
                shares[class] = 1.0;
            }
        }
        shares
    }
}
