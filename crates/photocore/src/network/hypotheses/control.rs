//! All control, or one set of it: a shift, wrong heights, another scale, another orientation.

use nalgebra::Vector3;

use super::catalogue::{Catalogue, Seen};
use crate::geometry::ObjectSpace;

/// Plausible shift of a whole control: another system of heights or coordinates, in units of the object space.
const SHIFT: f64 = 100.0;
/// Plausible shift of one set of control.
const SET_SHIFT: f64 = 1.0;
/// Plausible error of scale: another unit, or none of the scale of a map projection.
const SCALE: f64 = 1e-2;
/// Plausible rotation in radians.
const ROTATION: f64 = 1e-2;
/// Sets that are tested.
const MOST_SETS: usize = 8;
/// Control points that a rotation or a scale takes.
const FEWEST: usize = 3;

pub(super) fn add(catalogue: &mut Catalogue<'_>, points: &[(usize, usize)]) {
    if points.is_empty() {
        return;
    }
    let firsts: Vec<usize> = points.iter().map(|own| catalogue.bundle.of_point(own.1).start).collect();
    let heights = catalogue.add(("control-heights", None), &["Z"], &[SHIFT]);
    firsts.iter().for_each(|first| catalogue.displace(Seen::Control, first + 2, heights[0], 1.0));
    if catalogue.bundle.space != ObjectSpace::Rectangular {
        return;
    }
    shift(catalogue, ("control-shift", None), &firsts, SHIFT);
    let sets = &catalogue.facts.control_sets;
    let set_of = |own: &(usize, usize)| sets.get(own.0).copied().flatten();
    let count = points.iter().filter_map(set_of).max().map_or(0, |last| last + 1);
    let members = |set: usize| -> Vec<usize> {
        let own = points.iter().zip(&firsts).filter(|(own, _)| set_of(own) == Some(set));
        own.map(|(_, &first)| first).collect()
    };
    let sets: Vec<Vec<usize>> = (0..count.min(MOST_SETS)).map(members).collect();
    if sets.len() > 1 {
        for (set, firsts) in sets.iter().enumerate() {
            shift(catalogue, ("control-set", Some(set)), firsts, SET_SHIFT);
        }
    }
    if points.len() < FEWEST {
        return;
    }
    let centre = catalogue.centre();
    let places: Vec<Vector3<f64>> = points.iter().map(|own| catalogue.place(own.1) - centre).collect();
    let scale = catalogue.add(("control-scale", None), &["scale"], &[SCALE]);
    let names = ["omega", "phi", "kappa"];
    let turns = catalogue.add(("control-rotation", None), &names, &[ROTATION; 3]);
    for (&first, place) in firsts.iter().zip(&places) {
        catalogue.displace_all(Seen::Control, first, scale[0], place);
        for (k, &column) in turns.iter().enumerate() {
            let axis = Vector3::from_fn(|i, _| f64::from(u8::from(i == k)));
            catalogue.displace_all(Seen::Control, first, column, &axis.cross(place));
        }
    }
}

fn shift(catalogue: &mut Catalogue<'_>, of: (&'static str, Option<usize>), firsts: &[usize], size: f64) {
    let columns = catalogue.add(of, &["X", "Y", "Z"], &[size; 3]);
    for first in firsts {
        (0..3).for_each(|k| catalogue.displace(Seen::Control, first + k, columns[k], 1.0));
    }
}

impl Catalogue<'_> {
    /// A point of the model, counted from its origin.
    pub(super) fn place(&self, place: usize) -> Vector3<f64> {
        self.stations.points[place].position()
    }
}
