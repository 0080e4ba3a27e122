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
    // The error is in the observed positions: the next photo has the position that this one should have, except at the ends.
    let origin = Vector3::from(catalogue.bundle.origin);
    let observed = |&(photo, _, adjusted): &(usize, usize, Vector3<f64>)| {
        let own = catalogue.facts.observed.get(photo).map(|&own| Vector3::from(own) - origin);
        own.filter(|own| own.iter().all(|value| value.is_finite())).unwrap_or(adjusted)
    };
    let places: Vec<Vector3<f64>> = photos.iter().map(observed).collect();
    let last = photos.len() - 1;
    let next = catalogue.add(("gnss-next", None), &["photos"], &[SHARE])[0];
    let previous = catalogue.add(("gnss-previous", None), &["photos"], &[SHARE])[0];
    for (k, &(_, first, _)) in photos.iter().enumerate() {
        let (start, end) = (k.max(1) - 1, (k + 1).min(last));
        catalogue.displace_all(Seen::Positions, first, next, &(places[start + 1] - places[start]));
        catalogue.displace_all(Seen::Positions, first, previous, &(places[end - 1] - places[end]));
    }
}
