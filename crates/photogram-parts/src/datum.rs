//! Datum of a network that is adjusted in parts: defined for the whole network, applied by each node.
//!
//! The whole network is transformed and yields B and T ([`DatumColumns`]). Its nodes reduce B from children to parents. Then W = Q B and the
//! cofactors of outer parameters are passed from parents to children, and each node transforms its own cofactors.

use faer::Mat;
use photocore::Threads;
use photocore::adjustment::Adjusted;
use photocore::internal::{Assembled, Selected, Transformation, moved};
use photocore::network::{InnerConstraints, Interface, Network, NetworkError, Options};

/// Owner of a parameter (0: photo, 1: shared camera, 2: shared parameter, 3: point), its index in the network, and the number of the
/// parameter there.
pub type UnknownName = [usize; 3];

/// Results of a network that was adjusted in parts.
#[derive(Debug, Clone, Copy)]
pub struct AdjustedInParts<'a> {
    /// Centre that was passed to all nodes ([`Interface::middle`]).
    pub middle: Option<[f64; 3]>,
    /// Photos with the numbers of their fixed parameters.
    pub held: &'a [(usize, usize)],
    /// Names of all parameters; parameters of several nodes may be repeated.
    pub names: &'a [UnknownName],
    /// Adjusted values.
    pub values: &'a [f64],
}

/// Matrices for the datum transformation of the whole network: columns over all parameters, one after the other.
#[derive(Debug)]
pub struct DatumColumns {
    /// The matrix B.
    pub b: Vec<f64>,
    /// T = G (B^T G)^-1.
    pub t: Vec<f64>,
    /// Condition of B^T G with scaled columns.
    pub condition: f64,
    /// Whether the number of carriers equals the number of columns: they are then fixed by the datum.
    pub exact: bool,
}

/// Matrices for the transformation of a node's cofactors to a datum of the whole network. They have columns over the parameters of the
/// node, including outer ones, one after the other.
#[derive(Debug, Clone, Copy)]
pub struct DatumOfPart<'a> {
    /// T, as in [`DatumColumns`].
    pub t: &'a [f64],
    /// W = Q B.
    pub w: &'a [f64],
    /// B^T W of the whole network, row by row.
    pub common: &'a [f64],
    /// Last step, before the transformation to the datum.
    pub last: &'a [f64],
    /// Condition of B^T G of the whole network.
    pub condition: f64,
    /// Parameters that are fixed by the new datum, ascending.
    pub staying: &'a [usize],
}

impl DatumOfPart<'_> {
    /// Returns true if the matrices fit a number of parameters.
    pub fn is_over(&self, unknowns: usize) -> bool {
        let d = self.common.len().isqrt();
        let columns = [self.t.len(), self.w.len()] == [d * unknowns; 2];
        columns && self.common.len() == d * d && self.last.len() == unknowns
    }

    /// Returns the transformation of the cofactors.
    pub fn transformation(&self, unknowns: usize) -> Transformation {
        let d = self.common.len().isqrt();
        let by_rows = |columns: &[f64]| {
            (0..unknowns).flat_map(|unknown| (0..d).map(move |k| columns[k * unknowns + unknown])).collect()
        };
        Transformation {
            t: by_rows(self.t),
            w: by_rows(self.w),
            common: Mat::from_fn(d, d, |i, j| self.common[i * d + j]),
            condition: self.condition,
            staying: self.staying.to_vec(),
        }
    }
}

/// Returns the active parts of the whole network.
fn select_whole(
    network: &Network,
    middle: Option<[f64; 3]>,
    threads: &Threads,
) -> Result<Selected, NetworkError> {
    network.check()?;
    let left_out = network.left_out(network.untouched_photos(), None)?;
    let interface = Interface { middle, ..Interface::default() };
    Ok(threads.install(|| network.select(&left_out, interface)))
}

/// Returns the parameters that an adjustment of the whole network fixes as its datum: photo and number of the pose parameter (see
/// [`Interface::held`]). The list is empty if the network defines a datum.
///
/// # Errors
/// Errors of [`Network::adjust`] before its first iteration.
pub fn held_for_datum(
    network: &Network,
    options: &Options,
    threads: &Threads,
) -> Result<Vec<(usize, usize)>, NetworkError> {
    let selected = select_whole(network, None, threads)?;
    if network.is_placed(&selected) {
        return Ok(vec![]);
    }
    let assembled = threads.install(|| network.assemble(options, selected, None))?;
    let problem = assembled.problem();
    let (names, held) = (assembled.names(), problem.to_hold(&problem.initial, threads));
    let in_photo = |&unknown: &usize| match names[unknown] {
        [0, photo, number] => Ok((photo, number)),
        _ => Err(NetworkError::Node(
            "in parts trajectories take no datum: it would be held by their coefficients",
        )),
    };
    held.iter().map(in_photo).collect()
}

/// Transforms a network that was adjusted in parts to inner constraints; returns values, B and T in the order of the names.
///
/// # Errors
/// Errors of [`photocore::network::NetworkAdjustment::run`] with such a datum; names that do not cover all parameters.
pub fn parts_in_datum(
    network: &Network,
    options: &Options,
    inner: &InnerConstraints,
    adjusted: AdjustedInParts<'_>,
    threads: &Threads,
) -> Result<(Vec<f64>, DatumColumns), NetworkError> {
    let selected = select_whole(network, adjusted.middle, threads)?;
    let assembled = threads.install(|| network.assemble(options, selected, None))?;
    network.check_carriers(inner, &assembled)?;
    let problem = assembled.problem();
    let places = places_of(&assembled, adjusted.names).ok_or(NetworkError::State)?;
    let mut unknowns = vec![f64::NAN; problem.initial.len()];
    places.iter().zip(adjusted.values).for_each(|(&place, &value)| unknowns[place] = value);
    if unknowns.iter().any(|value| value.is_nan()) {
        return Err(NetworkError::State);
    }
    let (datum, reference) = threads.install(|| assembled.datum(inner));
    let held = assembled.of_photos(adjusted.held);
    let whole = Adjusted { unknowns: &unknowns, held: &held, loss: None };
    let (moved, basis) = moved(problem, whole, &datum, &reference, threads)?;
    let named = |all: &[f64]| -> Vec<f64> { places.iter().map(|&place| all[place]).collect() };
    let (count, d) = (moved.len(), basis.t.len() / moved.len().max(1));
    let (mut b, mut t) = (vec![], vec![]);
    for k in 0..d {
        let mut column = vec![0.0; count];
        basis.carriers.iter().enumerate().for_each(|(row, &carrier)| column[carrier] = basis.b[(row, k)]);
        b.extend(named(&column));
        t.extend(places.iter().map(|&place| basis.t[place * d + k]));
    }
    let exact = basis.carriers.len() == d;
    Ok((named(&moved), DatumColumns { b, t, condition: basis.condition, exact }))
}

/// Returns the indices of named parameters; None if one is missing.
fn places_of(assembled: &Assembled, names: &[UnknownName]) -> Option<Vec<usize>> {
    let own = assembled.names();
    let mut order: Vec<usize> = (0..own.len()).collect();
    order.sort_by_key(|&unknown| own[unknown]);
    let place = |name: &UnknownName| order.binary_search_by_key(name, |&unknown| own[unknown]).ok();
    names.iter().map(|name| place(name).map(|at| order[at])).collect()
}
