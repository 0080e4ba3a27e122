//! Attitudes of photos: a misalignment of camera and inertial unit (boresight).

use super::catalogue::{Catalogue, Seen};

/// Plausible misalignment, radians (5 degrees).
const BORESIGHT: f64 = 0.0873;

pub(super) fn add(catalogue: &mut Catalogue<'_>) {
    let bundle = catalogue.bundle;
    if !catalogue.has_attitudes() {
        return;
    }
    let columns = catalogue.add(("boresight", None), &["x", "y", "z"], &[BORESIGHT; 3]);
    for photo in (0..bundle.cameras.len()).filter(|&photo| bundle.turning[photo]) {
        let first = bundle.of_block(photo).start + 3;
        // The last three unknowns step by a rotation about the axes of the photo.
        (0..3).for_each(|k| catalogue.displace(Seen::Attitudes, first + k, columns[k], 1.0));
    }
}
