//! Images and records with the pose of a trajectory at their time: rolling shutters, line scanners, satellite positions between exposures.

use nalgebra::Matrix3xX;

use super::chain::{shifting, turning};
use super::{MountModel, Mounts, PartialPose, PhotoMotion, PoseInputs, Trajectory};
use crate::geometry::trajectory::{Flight, Motion};
use crate::geometry::{Matrix3, Vector3};
use crate::network::commons::CommonKind;

/// Mount of a photo on a trajectory. An image has the pose of the time
///
/// ```text
/// t = time + rate a + offset
/// ```
///
/// with its number a (`Network::image_times`); a = 0 is the photo itself. For a rolling shutter, a is row / rows and the rate is the
/// readout time of all rows. For a line scanner, a is the time of the line relative to the photo. Its rate is a factor of all line rates,
/// about 1; the offset is a clock error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OnTrajectory {
    /// Photo. Its own pose is only an approximate position.
    pub photo: usize,
    /// Trajectory.
    pub trajectory: usize,
    /// Time of the photo, in seconds.
    pub time: f64,
    /// Shared parameter of the rate; 1 if None.
    pub rate: Option<usize>,
    /// Shared parameter of the offset; 0 if None.
    pub offset: Option<usize>,
}

impl OnTrajectory {
    /// Returns the time of an image, given the values of shared parameters.
    fn time_of(&self, at: f64, value: impl Fn(usize) -> f64) -> f64 {
        self.time + at * self.rate.map_or(1.0, &value) + self.offset.map_or(0.0, &value)
    }

    /// Returns the ranges of active coefficients of positions and rotations, extended if the time has free parameters.
    fn active(&self, at: f64, known: &Mounts) -> [std::ops::Range<usize>; 2] {
        let time = self.time_of(at, |common| known.given(common).0);
        let exactly = self.scalars().all(|common| known.given(common).1);
        let course = &known.trajectory(self.trajectory).course;
        [course.position.near(time, exactly), course.rotation.near(time, exactly)]
    }

    /// Returns the time of an image.
    fn time(&self, at: f64, pose_inputs: &PoseInputs<'_>) -> f64 {
        self.time_of(at, |common| pose_inputs.common(common).0.vector().x)
    }

    fn flown_at(&self, time: f64, pose_inputs: &PoseInputs<'_>) -> Flight {
        let Trajectory { course, position, rotation } = pose_inputs.known().trajectory(self.trajectory);
        let value = |all: &[usize], k: usize| pose_inputs.common(all[k]).0.vector();
        course.at(time, &|k| value(position, k), &|k| value(rotation, k))
    }

    /// Returns the shared parameters of the time, each with the partial of the time.
    fn scaled(&self, at: f64) -> impl Iterator<Item = (usize, f64)> {
        self.rate.map(|own| (own, at)).into_iter().chain(self.offset.map(|own| (own, 1.0)))
    }

    fn scalars(&self) -> impl Iterator<Item = usize> {
        self.rate.into_iter().chain(self.offset)
    }
}

impl MountModel for OnTrajectory {
    fn photo(&self) -> usize {
        self.photo
    }

    fn unknowns(&self) -> Vec<(usize, CommonKind)> {
        let rate = self.rate.map(|common| (common, CommonKind::Readout));
        rate.into_iter().chain(self.offset.map(|common| (common, CommonKind::Clock))).collect()
    }

    fn trajectory(&self) -> Option<usize> {
        Some(self.trajectory)
    }

    fn flight(&self, at: f64, known: &Mounts) -> Option<(usize, f64)> {
        Some((self.trajectory, self.time_of(at, |common| known.given(common).0)))
    }

    fn always(&self, known: &Mounts) -> Vec<usize> {
        self.everywhere(known).chain(self.scalars()).collect()
    }

    fn commons(&self, at: f64, known: &Mounts) -> Vec<usize> {
        let Trajectory { position, rotation, .. } = known.trajectory(self.trajectory);
        let [p, r] = self.active(at, known);
        position[p].iter().chain(&rotation[r]).copied().chain(self.scalars()).collect()
    }

    fn replaces(&self) -> bool {
        true
    }

    fn everywhere<'a>(&self, known: &'a Mounts) -> Box<dyn Iterator<Item = usize> + 'a> {
        Box::new(known.trajectory(self.trajectory).everywhere())
    }

    fn is_timed(&self) -> bool {
        true
    }

    /// The partials by a clock offset are central differences over one millisecond.
    fn moving(&self, at: f64, pose_inputs: &PoseInputs<'_>) -> Option<PhotoMotion> {
        const HALF: f64 = 5e-4;
        let known = pose_inputs.known();
        let Trajectory { position, rotation, .. } = known.trajectory(self.trajectory);
        let time = self.time(at, pose_inputs);
        let flight = self.flown_at(time, pose_inputs);
        let mut found = PhotoMotion {
            velocity: flight.motion.velocity,
            rate: flight.motion.rate,
            velocity_by: vec![],
            rate_by: vec![],
        };
        let block = |common: usize| pose_inputs.common(common).1;
        let whole = |partials: &Matrix3| Matrix3xX::from_column_slice(partials.as_slice());
        let [p, r] = self.active(at, known);
        let by = p.filter_map(|k| Some((block(position[k])?, whole(&flight.velocity_by_position(k)))));
        found.velocity_by.extend(by);
        let by = r.filter_map(|k| Some((block(rotation[k])?, whole(&flight.rate_by_rotation(k)))));
        found.rate_by.extend(by);
        let [before, after] = [-HALF, HALF].map(|step| self.flown_at(time + step, pose_inputs).motion);
        for (common, times) in self.scaled(at) {
            let Some(block) = block(common) else { continue };
            let slope = |of: &dyn Fn(&Motion) -> Vector3| {
                Matrix3xX::from_columns(&[times * (of(&after) - of(&before)) / (2.0 * HALF)])
            };
            found.velocity_by.push((block, slope(&|motion| motion.velocity)));
            found.rate_by.push((block, slope(&|motion| motion.rate)));
        }
        Some(found)
    }

    fn compose(&self, at: f64, pose_inputs: &PoseInputs<'_>, pose: &mut PartialPose) {
        let known = pose_inputs.known();
        let Trajectory { position, rotation, .. } = known.trajectory(self.trajectory);
        let flight = self.flown_at(self.time(at, pose_inputs), pose_inputs);
        let Motion { velocity, rate, pose: reached } = flight.motion;
        pose.set_pose(reached);
        if !pose.steps() {
            return;
        }
        let block = |common: usize| pose_inputs.common(common).1;
        let [p, r] = self.active(at, known);
        let of = |k: usize| Some((block(position[k])?, flight.position.value(k)));
        pose.add(p.filter_map(of), shifting(&flight.axes));
        let of = |k: usize| Some((block(rotation[k])?, flight.rotation.value(k)));
        pose.add(r.filter_map(of), turning(&flight.jacobian));
        let of = |(common, times): (usize, f64)| Some((block(common)?, times));
        pose.add(self.scaled(at).filter_map(of), [(velocity, rate)]);
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::super::tests::agrees;
    use super::{CommonKind, OnTrajectory, Trajectory, Vector3};
    use crate::geometry::rotation;
    use crate::geometry::trajectory::{
        self, Attitudes, Axes, Basis, Interpolation, Polynomial, Positions, Rotations, Spline,
    };

    /// Returns a curve with a linear and a spline correction; `turning` separates body and table.
    fn trajectory(turning: bool) -> Trajectory {
        let times: Vec<f64> = (0..6).map(|k| -4.0 + 1.6 * f64::from(k)).collect();
        let places = times.iter().map(|t| Vector3::new(150.0 + t.cos(), 200.0 + 0.3 * t, 170.0)).collect();
        let turned = times.iter().map(|t| rotation([0.3 * t.sin(), 0.1, 0.2 * t])).collect();
        let attitudes = Attitudes::new(times.clone(), turned, Interpolation::Linear).unwrap();
        let positions = Positions::new(times, places, vec![], Interpolation::Lagrange).unwrap();
        let position = Basis::Polynomial(Polynomial { degree: 1, reference: 0.3, scale: 2.0 });
        let knots = (0..9).map(|k| -7.0 + 1.9 * f64::from(k)).collect();
        let rotation = Basis::Spline(Spline { degree: 3, knots });
        let body = turning.then(|| attitudes.clone());
        let course = trajectory::Trajectory {
            positions,
            attitudes,
            position,
            rotation,
            body,
            axes: Axes::Flight,
            rotations: if turning { Rotations::Zxz } else { Rotations::Vector },
        };
        Trajectory { course, position: vec![0, 1], rotation: vec![2, 3, 4, 5, 6] }
    }

    #[test]
    fn steps_agree_with_differences() {
        let kinds = [
            vec![CommonKind::PositionCoefficient; 2],
            vec![CommonKind::RotationCoefficient; 5],
            vec![CommonKind::Readout, CommonKind::Clock],
        ]
        .concat();
        for turning in [false, true] {
            for (rate, offset) in [(None, None), (Some(7), None), (Some(7), Some(8))] {
                let mount = OnTrajectory { photo: 0, trajectory: 0, time: 0.1, rate, offset };
                agrees(mount.into(), &kinds, &[trajectory(turning)]);
            }
        }
    }
}
