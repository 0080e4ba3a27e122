//! A rolling shutter: the lines of an image are read one after the other while the photo moves.

use nalgebra::{DMatrix, Vector3};

use super::super::trial::Trial;
use super::cameras::{MOST_CAMERAS, equal_cameras};
use super::catalogue::{Catalogue, Cause, put};
use super::hypothesis::{About, Hypothesis};
use crate::Threads;
use crate::adjustment::{Equation, Groups, Leverages, Linearized};

/// Plausible readout time of a whole image, in units of time of the velocities.
const READOUT: f64 = 0.1;
/// Codes of the errors of a readout by rows, and by columns.
const CODES: [&str; 2] = ["readout-time", "readout-time-columns"];

pub(super) fn add(catalogue: &mut Catalogue<'_>, trial: &Trial) {
    let facts = catalogue.facts;
    let moves = |photo: usize| {
        facts.velocities.get(photo).is_some_and(|velocity| velocity.iter().all(|value| value.is_finite()))
    };
    let lines_of = |photo: usize| -> &[[f64; 3]] {
        facts.readouts.get(trial.camera_of_photo[photo]).map_or(&[], Vec::as_slice)
    };
    for mut photos in equal_cameras(catalogue).into_iter().take(MOST_CAMERAS) {
        photos.retain(|&photo| moves(photo) && !lines_of(photo).is_empty());
        let Some(&first) = photos.first() else { continue };
        let camera = Some(trial.camera_of_photo[first]);
        let columns = CODES.map(|code| catalogue.add((code, camera), &["readout"], &[READOUT])[0]);
        for photo in photos {
            catalogue.shutters[photo] = columns.into_iter().zip(lines_of(photo).iter().copied()).collect();
            let velocity = Vector3::from(facts.velocities[photo]);
            catalogue.velocities[photo] = catalogue.place_of_photo(photo).change(&velocity);
        }
    }
}

/// Adds the standard deviations of significant readout times. Their lines are not wrong by one velocity if photos also rotate.
pub(super) fn add_sd_between_photos(
    (trial, found, linearized, catalogue): (&Trial, &Leverages, &Linearized, &Catalogue<'_>),
    effects: &DMatrix<f64>,
    hypotheses: &mut [Hypothesis],
    threads: &Threads,
) {
    let facts = catalogue.facts;
    let tested = |own: &&mut Hypothesis| {
        CODES.contains(&own.code) && own.judged.rank > 0 && own.judged.probability < facts.detection.0
    };
    let mut tested: Vec<&mut Hypothesis> = hypotheses.iter_mut().filter(tested).collect();
    if tested.is_empty() {
        return;
    }
    let of_all = catalogue.causes.iter().filter(|cause| CODES.contains(&cause.code));
    let of_all: Vec<usize> = of_all.map(|cause| cause.columns[0][0].0).collect();
    let mut alone = Catalogue::new(trial, found, facts);
    add(&mut alone, trial);
    // Observations other than images are a group of their own.
    let photos = alone.bundle.cameras.len();
    let group = |of| alone.image_of(of).map_or(photos, |own| alone.bundle.images[own.0].photo);
    let groups: Groups<'_> = (photos + 1, &group);
    let problem = &trial.assembled.problem;
    let parts = linearized.score_parts(problem, &alone, &effects.select_columns(&of_all), groups, threads);
    for own in &mut tested {
        let same = |cause: &Cause| cause.code == own.code && About::Set(cause.set) == own.about;
        own.sd_between_photos = alone.causes.iter().position(same).map(|column| parts.sd(column));
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
