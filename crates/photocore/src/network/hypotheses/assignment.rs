//! Positions of photos (GNSS) that were assigned to the next photo, or to the one before.

use nalgebra::Vector3;

use super::catalogue::{Catalogue, Seen};
use super::places::Place;

/// Plausible share of the way to the other photo: all of it.
const SHARE: f64 = 1.0;
/// Photos that an order takes.
const FEWEST: usize = 3;

pub(super) fn add(catalogue: &mut Catalogue<'_>) {
    let mut photos = catalogue.positions();
    if photos.len() < FEWEST {
        return;
    }
    let times = &catalogue.facts.times;
    let time = |photo: usize| times.get(photo).copied().unwrap_or(f64::NAN);
    if photos.iter().all(|own| time(own.0).is_finite()) {
        photos.sort_by(|one, other| time(one.0).total_cmp(&time(other.0)));
    }
    // The error is in the observed positions: the next photo has the position that this one should have, except at the ends.
    let observed = |own: &(usize, Place)| {
        let coordinates = catalogue.facts.observed.get(own.0);
        let known = coordinates.filter(|own| own.iter().all(|value| value.is_finite()));
        known.map_or(own.1.position, |&own| catalogue.position(own))
    };
    let positions: Vec<Vector3<f64>> = photos.iter().map(observed).collect();
    let last = photos.len() - 1;
    let next = catalogue.add(("gnss-next", None), &["photos"], &[SHARE])[0];
    let previous = catalogue.add(("gnss-previous", None), &["photos"], &[SHARE])[0];
    for (k, (_, place)) in photos.iter().enumerate() {
        let (start, end) = (k.max(1) - 1, (k + 1).min(last));
        let ways = [positions[start + 1] - positions[start], positions[end - 1] - positions[end]];
        catalogue.displace_place(Seen::Positions, place, next, &ways[0]);
        catalogue.displace_place(Seen::Positions, place, previous, &ways[1]);
    }
}
