//! The form of the network as control and positions of photos have it: its scale, its bending.

use std::ops::Range;

use nalgebra::Vector3;

use super::catalogue::{Catalogue, Seen};
use super::places::Place;

/// Plausible error of scale.
const SCALE: f64 = 1e-2;
/// Observed positions that bending takes.
const FEWEST: usize = 5;

pub(super) fn add(catalogue: &mut Catalogue<'_>, points: &[(usize, Place)]) {
    let centre = catalogue.centre();
    let axes = catalogue.axes_at(centre);
    let positions = catalogue.positions();
    let positions = positions.iter().map(|own| (Seen::Positions, own.1));
    let places: Vec<(Seen, Place)> =
        positions.chain(points.iter().map(|own| (Seen::Control, own.1))).collect();
    if places.len() < 2 {
        return;
    }
    let scale = catalogue.add(("scale", None), &["scale"], &[SCALE]);
    for (seen, place) in &places {
        catalogue.displace_place(*seen, place, scale[0], &(place.position - centre));
    }
    // Heights bend by d (x / half width)^2 and the same in y: d is the error at the edge, relative to the middle.
    let plan: Vec<Vector3<f64>> = places.iter().map(|own| axes * (own.1.position - centre)).collect();
    let half = |axis: usize| plan.iter().map(|own| own[axis].abs()).fold(0.0, f64::max);
    if places.len() >= FEWEST && half(0) > 0.0 && half(1) > 0.0 {
        let halves = [half(0), half(1)];
        let mut bend = |code, range: Range<usize>| {
            let columns = catalogue.add((code, None), &["x2", "y2"], &[]);
            for ((seen, place), plan) in places[range.clone()].iter().zip(&plan[range]) {
                for axis in 0..2 {
                    let height = (plan[axis] / halves[axis]).powi(2);
                    catalogue.displace(*seen, place.first + 2, columns[axis], height);
                }
            }
        };
        bend("bending", 0..places.len());
        // Control behind the positions, which may contradict it.
        if (FEWEST..places.len()).contains(&points.len()) {
            bend("control-bending", places.len() - points.len()..places.len());
        }
    }
}
