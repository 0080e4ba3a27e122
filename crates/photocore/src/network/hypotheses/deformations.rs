//! Deformations of the images of a camera that its parameters do not describe: other scales of both axes, axes that are not orthogonal,
//! radial distortion of a camera without it.

use super::super::trial::Trial;
use super::cameras::{MOST_CAMERAS, POINTS, equal_cameras};
use super::catalogue::{Catalogue, Deformations, put};
use crate::adjustment::Equation;

/// Plausible difference of scales, and shear.
const AFFINITY: f64 = 1e-2;
/// Plausible radial distortion of the first order, in the unit of the tangent.
const RADIAL: f64 = 5e-2;

pub(super) fn add(catalogue: &mut Catalogue<'_>, trial: &Trial) {
    for photos in equal_cameras(catalogue).into_iter().take(MOST_CAMERAS) {
        let camera = &catalogue.linearization.photos[photos[0]].camera;
        let (names, values, distance) = (camera.parameter_names(), camera.parameters(), camera.scale());
        // Images of cameras without a principal point are measured from it.
        let value = |axis: usize| {
            let named = names.iter().position(|own| [POINTS[axis], POINTS[axis + 2]].contains(&own.0));
            named.map_or(0.0, |place| values[place])
        };
        let has_radial = names.iter().any(|own| own.0.starts_with(['k', 'K']));
        let index = Some(trial.camera_of_photo[photos[0]]);
        let columns = catalogue.add(("camera-affinity", index), &["scale", "shear"], &[AFFINITY; 2]);
        let radial = (!has_radial && distance > 0.0)
            .then(|| catalogue.add(("camera-radial", index), &["k1"], &[RADIAL])[0]);
        let own = Deformations {
            principal_point: [value(0), value(1)],
            distance,
            affinity: [columns[0], columns[1]],
            radial,
        };
        photos.into_iter().for_each(|photo| catalogue.deformations[photo] = Some(own));
    }
}

impl Catalogue<'_> {
    /// Partials of an image by these deformations.
    pub(super) fn deformation_partials(
        &self,
        (image, _, row): (usize, usize, usize),
        equation: &Equation<'_>,
        partials: &mut Vec<(usize, f64)>,
    ) {
        let observed = &self.bundle.images[image];
        let Some(own) = self.deformations[observed.photo].as_ref().filter(|_| equation.sd.is_finite()) else {
            return;
        };
        let xy: [f64; 2] = std::array::from_fn(|axis| observed.xy[axis] - own.principal_point[axis]);
        if row == 0 {
            put(partials, own.affinity[0], xy[0] / equation.sd);
            put(partials, own.affinity[1], xy[1] / equation.sd);
        }
        if let Some(column) = own.radial {
            let square = (xy[0] * xy[0] + xy[1] * xy[1]) / (own.distance * own.distance);
            put(partials, column, xy[row] * square / equation.sd);
        }
    }
}
