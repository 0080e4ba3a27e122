//! Implementation of the adjustment's model by the bundle, at given parameter values.

use super::linearization_point::{LinearizationPoint, PhotoState, write};
use super::model::{Bundle, MOTIONS};
use super::mounts::Composed;
use super::simd::{FEWEST, ImageObservation, linearize_simd};
use crate::adjustment::{Evaluated, Model, Motions, PriorTerms};
use crate::geometry::angle_axis::rotation_angle_axis;
use crate::geometry::camera::{CameraModel, each_camera};
use crate::geometry::{AttitudeNumbers, Vector3};
use crate::normals::GroupRows;

/// A bundle at given parameter values.
pub(super) struct At<'a> {
    pub bundle: &'a Bundle,
    pub linearization: LinearizationPoint,
}

impl Bundle {
    pub(super) fn observe(
        &self,
        linearization: &LinearizationPoint,
        local: usize,
        group: usize,
        rows: &mut GroupRows<'_>,
    ) {
        if !linearization.plain {
            return self.write_corrected(linearization, group, local, rows, &mut Composed::new(true));
        }
        let image = &self.images[group];
        let PhotoState { orientation, camera } = &linearization.photos[image.photo];
        let point = &linearization.points[local];
        each_camera!(camera, camera => write(orientation, camera, point, Some(image.xy), rows));
    }

    pub(super) fn observe_term(
        &self,
        linearization: &LinearizationPoint,
        term: usize,
        rows: &mut GroupRows<'_>,
    ) {
        let Some(observation) = term.checked_sub(self.image_terms()) else {
            return self.observe_image_term(linearization, self.point_images.start[self.locals] + term, rows);
        };
        let own = &self.observations[observation];
        let first_linear = self.observations.len() - self.linear.len();
        if let Some(linear) = observation.checked_sub(first_linear) {
            return self.linear[linear].write(&linearization.coordinates, rows);
        }
        let coefficients = if rows.local.is_empty() { &mut *rows.shared } else { &mut *rows.local };
        self.with_model_values(linearization, |model| own.write(model, rows.constant, coefficients));
    }
}

impl Model for Bundle {
    fn at<'a>(&'a self, unknowns: &[f64]) -> Box<dyn Evaluated + 'a> {
        Box::new(At { bundle: self, linearization: self.evaluated(unknowns) })
    }

    /// Angles of photos that step by a rotation vector are updated through their rotation matrix.
    fn advance(&self, unknowns: &mut [f64], step: &[f64]) {
        let start = self.parameter_unknowns().start + 3;
        let turn = |photo: usize| {
            let (first, sense) = (start + self.blocks.first[photo], self.rotation_vector_sense(photo)?);
            let [angles, rho] = [&*unknowns, step].map(|values| std::array::from_fn(|k| values[first + k]));
            Some((first, sense.stepped(angles, &Vector3::from(rho))))
        };
        let turned: Vec<(usize, [f64; 3])> = (0..self.cameras.len()).filter_map(turn).collect();
        unknowns.iter_mut().zip(step).for_each(|(x, dx)| *x += dx);
        turned.into_iter().for_each(|(first, angles)| unknowns[first..first + 3].copy_from_slice(&angles));
    }

    /// Rotation vectors between attitudes satisfy A^T B = Exp(rho).
    fn step_between(&self, from: &[f64], to: &[f64]) -> Vec<f64> {
        let mut step: Vec<f64> = to.iter().zip(from).map(|(to, from)| to - from).collect();
        let start = self.parameter_unknowns().start + 3;
        for photo in 0..self.cameras.len() {
            let Some(sense) = self.rotation_vector_sense(photo) else { continue };
            let first = start + self.blocks.first[photo];
            let attitude = |values: &[f64]| {
                let angles = std::array::from_fn(|k| values[first + k]);
                AttitudeNumbers::OmegaPhiKappa(sense).attitude(angles)
            };
            let turn = rotation_angle_axis(&attitude(from).tr_mul(&attitude(to)));
            step[first..first + 3].copy_from_slice(turn.as_slice());
        }
        step
    }

    fn prior_terms(&self, values: &[f64], prior: &[f64], sd: &[f64]) -> PriorTerms {
        let mut prior_terms = PriorTerms::default();
        self.add_weighted_angles(values, prior, sd, &mut prior_terms);
        self.camera_priors.iter().for_each(|own| own.add_to(&mut prior_terms, values, prior));
        prior_terms
    }

    /// Intersects the points again.
    fn relocate(&self, unknowns: &mut [f64]) -> bool {
        let photos = self.parameter_unknowns();
        let Ok(coordinates) = self.intersect(&self.without_points(&unknowns[photos.clone()])) else {
            return false;
        };
        let (local, retained) = coordinates.split_at(self.locals);
        unknowns[..photos.start].copy_from_slice(local.as_flattened());
        unknowns[photos.end..].copy_from_slice(retained.as_flattened());
        true
    }

    /// Shared cameras are correlated with attitudes, positions and heights, which slows convergence.
    fn converges_linearly(&self) -> bool {
        !self.blocks.shared.is_empty()
    }

    /// A common displacement of all knots is nearly a rotation of all photos.
    fn may_oscillate(&self) -> bool {
        !self.image_corrections.lenses().is_empty()
    }

    fn pattern_violations(&self, unknowns: &[f64]) -> usize {
        self.images_beyond_knots(unknowns)
    }

    /// Straight rays are invariant to similarity transformations; frames may contain known lengths.
    fn groups_leave_open(&self) -> bool {
        self.refraction.is_none() && self.mounts.is_empty()
    }

    fn motions(&self, unknowns: &[f64]) -> Option<Motions> {
        if self.datum.placed { None } else { self.rigid_motions(unknowns) }
    }

    fn all_motions(&self, unknowns: &[f64]) -> Option<Motions> {
        self.rigid_motions(unknowns)
    }

    fn move_along(&self, unknowns: &mut [f64], amounts: &[f64]) {
        self.move_rigidly(unknowns, amounts);
    }
}

impl Evaluated for At<'_> {
    fn observe(&self, local: usize, group: usize, rows: &mut GroupRows<'_>) {
        self.bundle.observe(&self.linearization, local, group, rows);
    }

    fn observe_batch(&self, locals: &[u32], groups: &[u32], sd: &[f64], rows: &mut GroupRows<'_>) -> bool {
        let Self { bundle, linearization } = self;
        let to_camera_frame = |t: usize| {
            let group = groups[t] as usize;
            let (image, sd) = (&bundle.images[group], [sd[2 * group], sd[2 * group + 1]]);
            ImageObservation { point: &linearization.points[locals[t] as usize], image, sd }
        };
        if !linearization.plain {
            let together = bundle.write_corrected_batch(linearization, locals, groups, rows);
            let mut pose = Composed::new(true);
            for (t, (&local, &group)) in locals.iter().zip(groups).enumerate() {
                let mut own = rows.part(t, locals.len());
                if !together {
                    let image = (group as usize, local as usize);
                    bundle.write_corrected(linearization, image.0, image.1, &mut own, &mut pose);
                }
                own.weigh(&sd[2 * group as usize..][..2]);
            }
            return true;
        }
        // The main block of an image without mounts is its photo.
        locals.len() >= FEWEST
            && {
                let PhotoState { orientation, camera } =
                    &linearization.photos[bundle.images[groups[0] as usize].photo];
                each_camera!(camera, camera => linearize_simd(orientation, camera, locals.len(), &to_camera_frame, rows))
            }
    }

    fn write_misclosure(&self, local: usize, group: usize, constant: &mut [f64]) -> bool {
        let Self { bundle, linearization } = self;
        let image = &bundle.images[group];
        let PhotoState { orientation, camera } = &linearization.photos[image.photo];
        let u = match linearization.plain {
            true => orientation.to_camera_frame(&linearization.points[local]),
            false => bundle.corrected_sight(linearization, group, local),
        };
        let missing = each_camera!(camera, camera => match linearization.film(image.photo) {
            None => camera.compare(&u, image.xy).0,
            Some(film) => film.missing(camera.image(&u), bundle.image_corrections.cell(group), image.xy),
        });
        constant.copy_from_slice(&missing);
        true
    }

    fn observe_term(&self, term: usize, rows: &mut GroupRows<'_>) {
        self.bundle.observe_term(&self.linearization, term, rows);
    }

    fn collapsed(&self, before: &[f64]) -> Vec<usize> {
        let Self { bundle, linearization } = self;
        if bundle.screens.ran_into_station {
            bundle.find_points_at_stations(before, linearization)
        } else {
            vec![]
        }
    }

    fn diverging(&self, before: &[f64]) -> Vec<usize> {
        let Self { bundle, linearization } = self;
        if bundle.screens.ran_off { bundle.find_diverging_points(before, linearization) } else { vec![] }
    }

    fn carried(&self, term: usize) -> Option<(usize, Vec<[f64; MOTIONS]>)> {
        self.bundle.carried_by_motions(&self.linearization, term.checked_sub(self.bundle.image_terms())?)
    }
}
