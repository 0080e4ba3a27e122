//! Positions of photos (GNSS) that were assigned to the next photo, or to the one before.

use nalgebra::Vector3;

use super::catalogue::{Catalogue, Seen};

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
    let ways: Vec<(usize, Vector3<f64>)> =
        photos.windows(2).map(|pair| (pair[0].1, pair[1].2 - pair[0].2)).collect();
    let next = catalogue.add(("gnss-next", None), &["photos"], &[SHARE])[0];
    let previous = catalogue.add(("gnss-previous", None), &["photos"], &[SHARE])[0];
    for ((first, way), pair) in ways.iter().zip(photos.windows(2)) {
        catalogue.displace_all(Seen::Positions, *first, next, way);
        catalogue.displace_all(Seen::Positions, pair[1].1, previous, &-way);
    }
}
