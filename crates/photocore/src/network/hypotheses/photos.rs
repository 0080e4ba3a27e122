//! Photos: a shift of all image observations of one of them, such as another origin of its image coordinates.

use super::super::trial::Trial;
use super::catalogue::{Catalogue, put};
use crate::adjustment::Equation;

/// Plausible shift, in widths of the image.
const SHIFT: f64 = 0.1;

pub(super) fn add(catalogue: &mut Catalogue<'_>, trial: &Trial) {
    let facts = catalogue.facts;
    // Image coordinates of a scanned film are not those of its camera.
    for &photo in facts.photos.iter().filter(|_| catalogue.bundle.image_corrections.is_empty()) {
        let width = trial.camera_of_photo.get(photo).and_then(|&camera| facts.widths.get(camera)).copied();
        let Some(width) = width.filter(|width| width.is_finite() && catalogue.bundle.images_on[photo] > 0)
        else {
            continue;
        };
        let columns = catalogue.add(("photo", Some(photo)), &["x", "y"], &[SHIFT * width; 2]);
        catalogue.shifts[photo] = Some([columns[0], columns[1]]);
    }
}

impl Catalogue<'_> {
    /// Partial of an image by the shift of its photo.
    pub(super) fn shift_partials(
        &self,
        (image, _, row): (usize, usize, usize),
        equation: &Equation<'_>,
        partials: &mut Vec<(usize, f64)>,
    ) {
        let shift = self.shifts[self.bundle.images[image].photo];
        if let Some(columns) = shift.filter(|_| equation.sd.is_finite()) {
            put(partials, columns[row], equation.sd.recip());
        }
    }
}
