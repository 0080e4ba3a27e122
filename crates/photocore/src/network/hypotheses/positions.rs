//! Positions of photos (GNSS): a shift, wrong heights, a drift, a shift of one set, an offset of the clock, a forgotten lever arm.

use nalgebra::Vector3;

use super::catalogue::{Catalogue, Seen};
use super::places::Place;
use crate::adjustment::median;

/// Plausible shift, lever arm and drift (over all photos) in units of the object space.
const SHIFT: f64 = 1.0;
/// Plausible error of heights: another surface.
const HEIGHTS: f64 = 100.0;
/// Plausible offset of clocks, in units of time of the velocities.
const CLOCK: f64 = 1.0;
/// Photos of each half of a flight.
const FEWEST_OF_HALF: usize = 3;
/// Least pause between two flights, in median times between photos.
const NOTABLE_PAUSE: f64 = 10.0;
/// Sets that are tested.
const MOST_SETS: usize = 8;

pub(super) fn add(catalogue: &mut Catalogue<'_>) {
    let photos = catalogue.positions();
    if photos.is_empty() {
        return;
    }
    let facts = catalogue.facts;
    let axes = catalogue.axis_names();
    let heights = catalogue.add(("gnss-heights", None), &axes[2..], &[HEIGHTS]);
    let shift = catalogue.add(("gnss-shift", None), &axes, &[SHIFT; 3]);
    let lever = catalogue.add(("lever-arm", None), &["x", "y", "z"], &[SHIFT; 3]);
    for (photo, place) in &photos {
        catalogue.displace(Seen::Positions, place.first + 2, heights[0], 1.0);
        catalogue.shift_place(Seen::Positions, place, &shift, 1.0);
        let attitude = catalogue.pose(*photo).attitude;
        for (k, &column) in lever.iter().enumerate() {
            catalogue.displace_place(Seen::Positions, place, column, &attitude.column(k).into_owned());
        }
    }
    let velocity = |photo: usize| facts.velocities.get(photo).filter(|own| own.iter().all(|v| v.is_finite()));
    if photos.iter().any(|own| velocity(own.0).is_some()) {
        let clock = catalogue.add(("time-offset", None), &["time"], &[CLOCK]);
        for (photo, place) in &photos {
            if let Some(&velocity) = velocity(*photo) {
                catalogue.displace_place(Seen::Positions, place, clock[0], &Vector3::from(velocity));
            }
        }
    }
    drift(catalogue, &photos);
    let are_halves = facts.position_sets.iter().flatten().max() == Some(&1);
    if !are_halves && photos.len() >= 2 * FEWEST_OF_HALF {
        halves(catalogue, &photos, &shift);
    }
    let set_of = |photo: usize| facts.position_sets.get(photo).copied().flatten();
    let count = photos.iter().filter_map(|own| set_of(own.0)).max().map_or(0, |last| last + 1);
    if (2..=MOST_SETS).contains(&count) {
        let sets: Vec<_> =
            (0..count).map(|set| catalogue.add(("gnss-set", Some(set)), &axes, &[SHIFT; 3])).collect();
        for (photo, place) in &photos {
            if let Some(set) = set_of(*photo) {
                catalogue.shift_place(Seen::Positions, place, &sets[set], 1.0);
            }
        }
    }
}

/// The first and the second half of the photos, such as two flights with different reference stations; two strips are these halves.
fn halves(catalogue: &mut Catalogue<'_>, photos: &[(usize, Place)], shift: &[usize]) {
    let (axes, first) = (catalogue.axis_names(), &photos[..split(catalogue, photos)]);
    let columns = catalogue.add(("gnss-half", Some(0)), &axes, &[SHIFT; 3]);
    for (_, place) in first {
        catalogue.shift_place(Seen::Positions, place, &columns, 1.0);
    }
    let rest = shift.iter().zip(&columns).map(|(&all, &first)| vec![(all, 1.0), (first, -1.0)]).collect();
    catalogue.add_combination(("gnss-half", Some(1)), &axes, &[SHIFT; 3], rest);
}

/// The number of photos before the longest pause if it is notable and photos are in order of their times, else half of the photos.
fn split(catalogue: &Catalogue<'_>, photos: &[(usize, Place)]) -> usize {
    let time = |own: &(usize, Place)| catalogue.facts.times.get(own.0).copied().unwrap_or(f64::NAN);
    let pauses: Vec<f64> = photos.windows(2).map(|pair| time(&pair[1]) - time(&pair[0])).collect();
    let within = FEWEST_OF_HALF - 1..pauses.len() + 1 - FEWEST_OF_HALF;
    let longest = within.max_by(|&i, &j| pauses[i].total_cmp(&pauses[j]));
    let usual = median(pauses.clone()).unwrap_or(f64::NAN);
    let in_order = pauses.iter().all(|own| *own > 0.0);
    longest.filter(|&k| in_order && pauses[k] > NOTABLE_PAUSE * usual).map_or(photos.len() / 2, |k| k + 1)
}

/// A drift is linear in time, from -1/2 to 1/2: its parameters are the change from the first to the last photo.
fn drift(catalogue: &mut Catalogue<'_>, photos: &[(usize, Place)]) {
    let time = |photo: usize| catalogue.facts.times.get(photo).copied().filter(|time| time.is_finite());
    let times: Vec<(Place, f64)> =
        photos.iter().filter_map(|&(photo, place)| Some((place, time(photo)?))).collect();
    let range = |start: f64, pick: fn(f64, f64) -> f64| times.iter().map(|own| own.1).fold(start, pick);
    let (least, most) = (range(f64::INFINITY, f64::min), range(f64::NEG_INFINITY, f64::max));
    if most > least {
        let columns = catalogue.add(("gnss-drift", None), &catalogue.axis_names(), &[SHIFT; 3]);
        for (place, time) in &times {
            catalogue.shift_place(Seen::Positions, place, &columns, (time - least) / (most - least) - 0.5);
        }
    }
}
