//! The adjustments in between: the network engine on images in the plane at unit distance, with a robust loss.

use super::model::{MEDIAN_LENGTH, Model};
use super::{FirstValuesError, Search, Sighting};
use crate::adjustment::{Loss, Method, Options as AdjustmentOptions, Stop};
use crate::geometry::{Perspective, Pose, rotation_angles};
use crate::network::{Camera, Image, Network, NetworkError, Options, Photo, Point, Solution, Start};

/// Where the loss sets in, in standard deviations that the median of the residuals says.
const SETS_IN: f64 = 3.0;
/// Iterations at the most, and the fraction of its standard deviation by which no unknown changes any more.
const ITERATIONS: usize = 30;
const FRACTION: f64 = 0.1;
/// The image plane is at unit distance: x = -u1/u3, y = -u2/u3.
const PRINCIPAL_DISTANCE: f64 = -1.0;

impl Search<'_> {
    /// Adjusts poses and points of a model, and looks anew at what fits. A model that cannot be adjusted stays as it is.
    pub fn adjust(&mut self, model: &mut Model) -> Result<(), FirstValuesError> {
        let photos: Vec<usize> = (0..model.poses.len()).filter(|&k| model.poses[k].is_some()).collect();
        let misfits = model.misfits(self);
        let mut rays = vec![0; model.points.len()];
        misfits.iter().for_each(|(image, _)| rays[self.given.sightings[*image].point] += 1);
        let held = |point: usize| model.object && self.given.points[point].sd.iter().any(|sd| sd.is_finite());
        let used = |point: usize| rays[point] > 1 || rays[point] == 1 && held(point);
        let points: Vec<usize> = (0..model.points.len()).filter(|&point| used(point)).collect();
        let images: Vec<usize> = misfits.iter().map(|(image, _)| *image).collect();
        let sd = spread(misfits.into_iter().map(|(_, misfit)| misfit));
        let weighted = |point: usize| {
            let known = &self.given.points[point];
            let at = model.points[point].unwrap_or_default();
            let held: [bool; 3] = std::array::from_fn(|k| model.object && known.sd[k].is_finite());
            Point {
                coordinates: std::array::from_fn(|k| if held[k] { known.coordinates[k] } else { at[k] }),
                sd: std::array::from_fn(|k| if held[k] { known.sd[k] } else { f64::INFINITY }),
            }
        };
        let poses: Vec<Pose> = photos.iter().filter_map(|&photo| Some(model.poses[photo]?.0)).collect();
        let own: Vec<Point> = points.iter().map(|&point| weighted(point)).collect();
        let network = self.network(&photos, &poses, &points, own, &images, sd);
        let Some(solution) = self.solved(&network)? else { return Ok(()) };
        for (&photo, adjusted) in photos.iter().zip(&solution.photos) {
            if let Some((pose, _)) = &mut model.poses[photo] {
                *pose = of_numbers(&adjusted.pose);
            }
        }
        for (&point, adjusted) in points.iter().zip(&solution.points) {
            if let Some(adjusted) = adjusted {
                model.points[point] = Some(adjusted.coordinates.into());
            }
        }
        model.narrow(self);
        model.intersect(self);
        Ok(())
    }

    /// Adjusts the pose of one photo alone, its points fixed; from where it is if that fails.
    pub fn adjusted_photo(
        &mut self,
        model: &Model,
        photo: usize,
        pose: Pose,
        images: &[usize],
    ) -> Result<Pose, FirstValuesError> {
        let points: Vec<usize> = images.iter().map(|&image| self.given.sightings[image].point).collect();
        let fixed = |&point: &usize| Point {
            coordinates: model.points[point].unwrap_or_default().into(),
            sd: [0.0; 3],
        };
        let sd = images.iter().map(|&image| self.given.sightings[image].sd).fold(0.0, f64::max);
        let own = points.iter().map(fixed).collect();
        let network = self.network(&[photo], &[pose], &points, own, images, sd);
        let solution = self.solved(&network)?;
        Ok(solution.map_or(pose, |solution| of_numbers(&solution.photos[0].pose)))
    }

    fn network(
        &self,
        photos: &[usize],
        poses: &[Pose],
        points: &[usize],
        own: Vec<Point>,
        images: &[usize],
        sd: f64,
    ) -> Network {
        let place = |of: &[usize], count: usize| {
            let mut place = vec![usize::MAX; count];
            of.iter().enumerate().for_each(|(k, &index)| place[index] = k);
            place
        };
        let (of_photo, of_point) =
            (place(photos, self.given.photos.len()), place(points, self.given.points.len()));
        let image = |sighting: &Sighting| {
            let u = sighting.direction;
            let sd = [sd.max(sighting.sd); 2];
            let (photo, point) = (of_photo[sighting.photo], of_point[sighting.point]);
            let there = photo != usize::MAX && point != usize::MAX;
            there.then_some(Image { photo, point, xy: [-u.x / u.z, -u.y / u.z], sd })
        };
        let photo = |pose: &Pose| Photo::free(to_numbers(pose), 0);
        Network {
            cameras: vec![Camera::held(Perspective { principal_distance: PRINCIPAL_DISTANCE }.into())],
            photos: poses.iter().map(photo).collect(),
            points: own,
            images: images.iter().filter_map(|&index| image(&self.given.sightings[index])).collect(),
            ..Network::new()
        }
    }

    /// The adjusted network; None where it cannot be adjusted, or not with a finite result.
    fn solved(&mut self, network: &Network) -> Result<Option<Solution>, FirstValuesError> {
        let options = Options {
            adjustment: AdjustmentOptions {
                method: Method::Damped(Stop::Fraction(FRACTION)),
                max_iterations: ITERATIONS,
                covariance: false,
                loss: Some(Loss::Huber(SETS_IN)),
                ..AdjustmentOptions::default()
            },
            start: Start::Given,
            hold_unused: true,
            ..Options::default()
        };
        match network.adjustment(&options).on(self.threads).watched(self.watch).run() {
            Ok(solution) => {
                let finite =
                    solution.photos.iter().all(|photo| photo.pose.iter().all(|value| value.is_finite()));
                Ok(finite.then_some(solution))
            }
            Err(NetworkError::Stopped(stopped)) => Err(stopped.into()),
            Err(_) => Ok(None),
        }
    }
}

/// The standard deviation of a component that the median of the angles says.
fn spread(misfits: impl Iterator<Item = f64>) -> f64 {
    crate::network::median(misfits.collect()).map_or(0.0, |middle| middle / MEDIAN_LENGTH)
}

fn to_numbers(pose: &Pose) -> [f64; 6] {
    let ([x, y, z], [omega, phi, kappa]): ([f64; 3], _) =
        (pose.position.into(), rotation_angles(&pose.attitude.transpose()));
    [x, y, z, omega, phi, kappa]
}

fn of_numbers(&[x, y, z, omega, phi, kappa]: &[f64; 6]) -> Pose {
    Pose { position: [x, y, z].into(), attitude: crate::geometry::rotation([omega, phi, kappa]).transpose() }
}
