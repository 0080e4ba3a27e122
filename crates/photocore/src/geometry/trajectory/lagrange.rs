//! Interpolation by the polynomial through neighbouring records.

use smallvec::SmallVec;

/// Records on each side where there are so many.
const EACH_SIDE: usize = 4;

/// For the records about an interval, from the first on: what each counts at a time, and how that changes in a second. There are as many
/// on either side: near the ends 6, 4 and 2 (Community Sensor Model).
pub fn weights(times: &[f64], interval: usize, time: f64) -> (usize, SmallVec<[(f64, f64); 8]>) {
    let side = EACH_SIDE.min(interval + 1).min(times.len() - 1 - interval);
    let first = interval + 1 - side;
    let nodes = &times[first..interval + 1 + side];
    let of = |j: usize| {
        let others = || (0..nodes.len()).filter(move |&m| m != j);
        let ratio = |m: usize| (time - nodes[m]) / (nodes[j] - nodes[m]);
        let without = |left: usize| others().filter(|&m| m != left).map(ratio).product::<f64>();
        (others().map(ratio).product(), others().map(|m| without(m) / (nodes[j] - nodes[m])).sum())
    };
    (first, (0..nodes.len()).map(of).collect())
}
