//! Implementation of the adjustment's model by the bundle, at given parameter values.

use super::in_lanes::{FEWEST, Sight, write_in_lanes};
use super::model::{Bundle, MOTIONS};
use super::mounts::Composed;
use super::stations::{Station, Stations, write};
use crate::adjustment::{Evaluated, Model, Motions, Terms};
use crate::geometry::angle_axis::rotation_angle_axis;
use crate::geometry::camera::{CameraModel, each_camera};
use crate::geometry::{AttitudeNumbers, Vector3};
use crate::normals::GroupRows;

/// A bundle at given parameter values.
pub(super) struct At<'a> {
    pub bundle: &'a Bundle,
    pub stations: Stations,
}

impl Bundle {
    pub(super) fn observe(&self, stations: &Stations, local: usize, group: usize, rows: &mut GroupRows<'_>) {
        if !stations.plain {
            return self.observe_bent(stations, group, local, rows, &mut Composed::new(true));
        }
        let image = &self.images[group];
        let Station { orientation, camera } = &stations.photos[image.photo];
        let point = &stations.points[local];
        each_camera!(camera, camera => write(orientation, camera, point, Some(image.xy), rows));
    }

    pub(super) fn observe_tie(&self, stations: &Stations, tie: usize, rows: &mut GroupRows<'_>) {
        let Some(observation) = tie.checked_sub(self.tied_images()) else {
            return self.observe_tied_image(stations, self.point_images.start[self.locals] + tie, rows);
        };
        let own = &self.observations[observation];
        let first_linear = self.observations.len() - self.linear.len();
        if let Some(linear) = observation.checked_sub(first_linear) {
            return self.linear[linear].write(&stations.coordinates, rows);
        }
        let coefficients = if rows.local.is_empty() { &mut *rows.shared } else { &mut *rows.local };
        self.with_tied(stations, |model| own.write(model, rows.constant, coefficients));
    }
}

impl Model for Bundle {
    fn at<'a>(&'a self, unknowns: &[f64]) -> Box<dyn Evaluated + 'a> {
        Box::new(At { bundle: self, stations: self.evaluated(unknowns) })
    }

    /// Angles of photos that step by a rotation vector are updated through their rotation matrix.
    fn advance(&self, unknowns: &mut [f64], step: &[f64]) {
        let start = self.of_stations().start + 3;
        let turn = |photo: usize| {
            let (first, sense) = (start + self.blocks.first[photo], self.turning_sense(photo)?);
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
        let start = self.of_stations().start + 3;
        for photo in 0..self.cameras.len() {
            let Some(sense) = self.turning_sense(photo) else { continue };
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

    fn terms(&self, values: &[f64], prior: &[f64], sd: &[f64]) -> Terms {
        let mut terms = Terms::default();
        self.add_weighted_angles(values, prior, sd, &mut terms);
        self.camera_priors.iter().for_each(|own| own.add_to(&mut terms, values, prior));
        terms
    }

    /// Intersects the points again.
    fn relocate(&self, unknowns: &mut [f64]) -> bool {
        let photos = self.of_stations();
        let Ok(coordinates) = self.intersect(&self.without_points(&unknowns[photos.clone()])) else {
            return false;
        };
        let (local, tied) = coordinates.split_at(self.locals);
        unknowns[..photos.start].copy_from_slice(local.as_flattened());
        unknowns[photos.end..].copy_from_slice(tied.as_flattened());
        true
    }

    /// Shared cameras are correlated with attitudes, positions and heights, which slows convergence.
    fn ends_slowly(&self) -> bool {
        !self.blocks.shared.is_empty()
    }

    /// A common displacement of all knots is nearly a rotation of all photos.
    fn steps_swing(&self) -> bool {
        !self.passages.lenses().is_empty()
    }

    fn outgrown(&self, unknowns: &[f64]) -> usize {
        self.beyond_windows(unknowns)
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
        self.bundle.observe(&self.stations, local, group, rows);
    }

    fn observe_alike(&self, locals: &[u32], groups: &[u32], sd: &[f64], rows: &mut GroupRows<'_>) -> bool {
        let Self { bundle, stations } = self;
        let sight = |t: usize| {
            let group = groups[t] as usize;
            let (image, sd) = (&bundle.images[group], [sd[2 * group], sd[2 * group + 1]]);
            Sight { point: &stations.points[locals[t] as usize], image, sd }
        };
        if !stations.plain {
            let together = bundle.observe_all_passing(stations, locals, groups, rows);
            let mut pose = Composed::new(true);
            for (t, (&local, &group)) in locals.iter().zip(groups).enumerate() {
                let mut own = rows.part(t, locals.len());
                if !together {
                    let image = (group as usize, local as usize);
                    bundle.observe_bent(stations, image.0, image.1, &mut own, &mut pose);
                }
                own.weigh(&sd[2 * group as usize..][..2]);
            }
            return true;
        }
        // The main block of an image without mounts is its photo.
        locals.len() >= FEWEST && {
            let Station { orientation, camera } = &stations.photos[bundle.images[groups[0] as usize].photo];
            each_camera!(camera, camera => write_in_lanes(orientation, camera, locals.len(), &sight, rows))
        }
    }

    fn misclose(&self, local: usize, group: usize, constant: &mut [f64]) -> bool {
        let Self { bundle, stations } = self;
        let image = &bundle.images[group];
        let Station { orientation, camera } = &stations.photos[image.photo];
        let u = match stations.plain {
            true => orientation.sight(&stations.points[local]),
            false => bundle.sight_bent(stations, group, local),
        };
        let missing = each_camera!(camera, camera => match stations.film(image.photo) {
            None => camera.compare(&u, image.xy).0,
            Some(film) => film.missing(camera.image(&u), bundle.passages.cell(group), image.xy),
        });
        constant.copy_from_slice(&missing);
        true
    }

    fn observe_tie(&self, tie: usize, rows: &mut GroupRows<'_>) {
        self.bundle.observe_tie(&self.stations, tie, rows);
    }

    fn collapsed(&self, before: &[f64]) -> Vec<usize> {
        let Self { bundle, stations } = self;
        if bundle.screens.ran_into_station { bundle.run_into_stations(before, stations) } else { vec![] }
    }

    fn run_off(&self, before: &[f64]) -> Vec<usize> {
        let Self { bundle, stations } = self;
        if bundle.screens.ran_off { bundle.lead_nowhere(before, stations) } else { vec![] }
    }

    fn carried(&self, tie: usize) -> Option<(usize, Vec<[f64; MOTIONS]>)> {
        self.bundle.carried_by_motions(&self.stations, tie.checked_sub(self.bundle.tied_images())?)
    }
}
