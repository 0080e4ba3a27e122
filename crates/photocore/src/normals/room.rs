//! Numbers that there is room for: in vectors, and in what the elimination of local blocks leaves.

use super::incidence::Incidence;
use super::layout::Layout;
use super::triangle::Triangle;

/// Numbers for each unknown: values, steps, priors and their copies, cofactors, what is made of them for the caller.
const PER_UNKNOWN: usize = 38;
/// Numbers for each equation beside its coefficients: observed value, standard deviation, residual, redundancy number and test value,
/// as given, as ordered for the adjustment and as handed back.
const PER_EQUATION: usize = 18;
/// Of these, the part that is made of the results after the last solution: what is cached from the formation to the solution may take it.
const LATER: f64 = 0.65;

/// Numbers in vectors, the problem itself and its results counted.
pub(super) fn vectors(layout: &Layout) -> usize {
    PER_UNKNOWN * layout.unknowns() + PER_EQUATION * layout.equations()
}

/// Numbers in what is made of results only.
pub(super) fn made_of_results(layout: &Layout) -> usize {
    (LATER * vectors(layout) as f64) as usize
}

/// Numbers that are cached of so many local blocks of one pattern, at the most.
fn numbers_of(layout: &Layout, first: usize, count: usize) -> usize {
    let l = layout.local_dim();
    count * (l * (layout.reduced_width(first) + 1) + Triangle::numbers(l))
}

/// The same of all local blocks assembled in a supernode.
pub(super) fn numbers_at(incidence: &Incidence, layout: &Layout, index: usize) -> usize {
    let of_batch =
        |run: &[u32]| run.first().map_or(0, |&first| numbers_of(layout, first as usize, run.len()));
    incidence.batches_of_locals_at(index).iter().map(of_batch).sum()
}
