//! A rolling shutter: the lines of an image are read one after the other while the photo moves.

use nalgebra::Vector3;

use super::super::trial::Trial;
use super::catalogue::{Catalogue, put};
use crate::adjustment::Equation;

/// Plausible readout time of a whole image, in units of time of the velocities.
const READOUT: f64 = 0.1;
/// Codes of the errors of a readout by rows, and by columns.
const CODES: [&str; 2] = ["readout-time", "readout-time-columns"];

pub(super) fn add(catalogue: &mut Catalogue<'_>, trial: &Trial) {
    let facts = catalogue.facts;
    let moves = |photo: usize| {
        facts.velocities.get(photo).is_some_and(|velocity| velocity.iter().all(|value| value.is_finite()))
    };
    for (camera, lines) in facts.readouts.iter().enumerate().filter(|(_, lines)| !lines.is_empty()) {
        let photos: Vec<usize> = (0..catalogue.bundle.cameras.len())
            .filter(|&photo| trial.camera_of_photo[photo] == camera && moves(photo))
            .collect();
        if photos.is_empty() {
            continue;
        }
        let add = |(code, &line): (&&'static str, &[f64; 3])| {
            (catalogue.add((*code, Some(camera)), &["readout"], &[READOUT])[0], line)
        };
        let columns: Vec<(usize, [f64; 3])> = CODES.iter().zip(lines).map(add).collect();
        for photo in photos {
            catalogue.shutters[photo].clone_from(&columns);
            let velocity = Vector3::from(facts.velocities[photo]);
            catalogue.velocities[photo] = catalogue.place_of_photo(photo).change(&velocity);
        }
    }
}

impl Catalogue<'_> {
    /// Partial of an image by the readout time: the photo has moved by velocity times the time of the line.
    pub(super) fn shutter_partials(
        &self,
        (image, ..): (usize, usize, usize),
        equation: &Equation<'_>,
        partials: &mut Vec<(usize, f64)>,
    ) {
        let observed = &self.bundle.images[image];
        let photo = observed.photo;
        if self.shutters[photo].is_empty() {
            return;
        }
        let (first, velocity) = (self.bundle.of_block(photo).start, &self.velocities[photo]);
        let own = equation.coefficients().filter(|own| (first..first + 3).contains(&own.0));
        let change: f64 = own.map(|(unknown, value)| value * velocity[unknown - first]).sum();
        for &(column, [a, b, c]) in &self.shutters[photo] {
            put(partials, column, change * (a * observed.xy[0] + b * observed.xy[1] + c));
        }
    }
}
