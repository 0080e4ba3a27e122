//! All control, or one set of it: a shift, wrong heights, another scale, another orientation.

use super::catalogue::{Catalogue, Seen};
use super::places::Place;

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

pub(super) fn add(catalogue: &mut Catalogue<'_>, points: &[(usize, Place)]) {
    if points.is_empty() {
        return;
    }
    let heights = catalogue.add(("control-heights", None), &catalogue.axis_names()[2..], &[SHIFT]);
    points.iter().for_each(|own| catalogue.displace(Seen::Control, own.1.first + 2, heights[0], 1.0));
    let places: Vec<Place> = points.iter().map(|own| own.1).collect();
    shift(catalogue, ("control-shift", None), &places, SHIFT);
    let sets = &catalogue.facts.control_sets;
    let set_of = |own: &(usize, Place)| sets.get(own.0).copied().flatten();
    let count = points.iter().filter_map(set_of).max().map_or(0, |last| last + 1);
    let members = |set: usize| -> Vec<Place> {
        points.iter().filter(|own| set_of(own) == Some(set)).map(|own| own.1).collect()
    };
    let sets: Vec<Vec<Place>> = (0..count.min(MOST_SETS)).map(members).collect();
    if sets.len() > 1 {
        for (set, places) in sets.iter().enumerate() {
            shift(catalogue, ("control-set", Some(set)), places, SET_SHIFT);
        }
    }
    if points.len() < FEWEST {
        return;
    }
    let centre = catalogue.centre();
    let axes = catalogue.axes_at(centre);
    let scale = catalogue.add(("control-scale", None), &["scale"], &[SCALE]);
    let names = ["omega", "phi", "kappa"];
    let turns = catalogue.add(("control-rotation", None), &names, &[ROTATION; 3]);
    for place in &places {
        let away = place.position - centre;
        catalogue.displace_place(Seen::Control, place, scale[0], &away);
        for (k, &column) in turns.iter().enumerate() {
            catalogue.displace_place(Seen::Control, place, column, &axes.row(k).transpose().cross(&away));
        }
    }
}

fn shift(catalogue: &mut Catalogue<'_>, of: (&'static str, Option<usize>), places: &[Place], size: f64) {
    let columns = catalogue.add(of, &catalogue.axis_names(), &[size; 3]);
    places.iter().for_each(|place| catalogue.shift_place(Seen::Control, place, &columns, 1.0));
}
