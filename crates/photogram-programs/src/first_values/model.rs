//! Model: photos and points in one frame, and the intersection of its rays.
//!
//! Intermediate adjustments use the network engine with images in the plane at unit distance and a robust loss.

use super::{FirstValues, FirstValuesError, KnownPoint, Search, Sighting, Source};
use crate::similarity::Similarity;
use photocore::adjustment::{Loss, Method, Options as AdjustmentOptions, Stop};
use photocore::geometry::{Matrix3, Perspective, Pose, Ray, Vector3, rotation_angles};
use photocore::internal::median;
use photocore::network::{
    Camera, Image, Network, NetworkError, Options, Photo, Point, Solution, Start, meet,
};

/// Minimum intersection angle of the rays of a point, radians.
const LEAST_ANGLE: f64 = 0.01;
/// Multiples of the standard deviation (from the median of all misfits, and a priori) within which an observation fits.
pub(super) const FITS: f64 = 6.0;
const FITS_OWN: f64 = 4.0;
/// Maximum angle, radians, between used control and its rays.
const NEAR: f64 = 0.1;
/// Maximum number of trial pairs if the rays of a point do not all intersect.
const PAIRS: usize = 45;
/// Median length of a vector with two components of standard deviation 1.
pub(super) const MEDIAN_LENGTH: f64 = 1.1774;

/// Photos and points in one frame.
#[derive(Debug, Clone)]
pub struct Model {
    pub poses: Vec<Option<(Pose, Source)>>,
    pub points: Vec<Option<Vector3>>,
    /// Whether each observation is rejected.
    pub aside: Vec<bool>,
    /// Whether the observations of a control point agree with each other but contradict its coordinates.
    pub contradicted: Vec<bool>,
    /// Angle within which an observation fits, radians.
    pub tolerance: f64,
    /// Whether the frame is the object space, so that control applies.
    pub object: bool,
}

impl Model {
    /// Returns a model without photos and points.
    pub fn empty(given: &FirstValues) -> Self {
        Self {
            poses: vec![None; given.photos.len()],
            points: vec![None; given.points.len()],
            aside: vec![false; given.sightings.len()],
            contradicted: vec![false; given.points.len()],
            tolerance: 0.0,
            object: false,
        }
    }

    /// Returns the model of given poses and control.
    pub fn of_known(search: &Search<'_>) -> Self {
        let mut model = Self::empty(search.given);
        model.object = true;
        for (pose, known) in model.poses.iter_mut().zip(&search.given.photos) {
            *pose = known.pose.map(|pose| (pose, Source::Given));
        }
        model.intersect(search);
        model
    }

    /// Returns the number of photos with a pose.
    pub fn count(&self) -> usize {
        self.poses.iter().flatten().count()
    }

    pub fn is_empty(&self) -> bool {
        self.poses.iter().all(Option::is_none)
    }

    /// Returns whether control or observed positions define the datum.
    pub fn is_anchored(&self, search: &Search<'_>) -> bool {
        let held = |sd: &f64| sd.is_finite();
        search.given.points.iter().any(|point| point.sd.iter().any(held))
            || search.given.photos.iter().any(|photo| photo.position.is_some())
    }

    fn ray(&self, search: &Search<'_>, image: usize) -> Option<Ray> {
        let sighting = &search.given.sightings[image];
        let (pose, _) = self.poses[sighting.photo]?;
        Some(Ray { origin: pose.position, direction: pose.attitude * sighting.direction })
    }

    /// Returns the rays of a point with their observations.
    fn rays(&self, search: &Search<'_>, point: usize) -> Vec<(usize, Ray)> {
        search.of_point[point].iter().filter_map(|&image| Some((image, self.ray(search, image)?))).collect()
    }

    fn fits(&self, search: &Search<'_>, at: &Vector3, (image, ray): &(usize, Ray)) -> bool {
        misfit(ray, at) <= self.tolerance.max(FITS_OWN * search.given.sightings[*image].sd)
    }

    /// Returns whether a ray agrees with a position that has a standard deviation.
    fn reaches(&self, search: &Search<'_>, at: &Vector3, sd: f64, ray: &(usize, Ray)) -> bool {
        let towards = at - ray.1.origin;
        let least = misfit(&ray.1, at) - FITS * sd / towards.norm();
        least <= self.tolerance.max(FITS_OWN * search.given.sightings[ray.0].sd)
    }

    /// Intersects all points twice: first to estimate the tolerance, then with the fitting rays.
    pub fn intersect(&mut self, search: &Search<'_>) {
        if self.tolerance == 0.0 {
            self.tolerance = f64::INFINITY;
            (0..self.points.len()).for_each(|point| self.place(search, point));
            self.narrow(search);
        }
        (0..self.points.len()).for_each(|point| self.place(search, point));
    }

    /// Estimates the tolerance from the median of all misfits.
    pub fn narrow(&mut self, search: &Search<'_>) {
        let sizes = self.misfits(search).into_iter().map(|(_, misfit)| misfit).collect();
        self.tolerance = median(sizes).map_or(0.0, |middle| FITS * middle / MEDIAN_LENGTH);
    }

    /// Returns the angular misfits of the observations of known points, without rejected ones.
    pub fn misfits(&self, search: &Search<'_>) -> Vec<(usize, f64)> {
        let of = |image: usize| {
            let point = self.points[search.given.sightings[image].point]?;
            Some((image, misfit(&self.ray(search, image)?, &point)))
        };
        (0..self.aside.len()).filter(|&image| !self.aside[image]).filter_map(of).collect()
    }

    /// Intersects a point, or uses its control coordinates if equally many rays agree with them. Rejects rays that do not fit.
    pub fn place(&mut self, search: &Search<'_>, point: usize) {
        let rays = self.rays(search, point);
        let known = Some(&search.given.points[point]).filter(|_| self.object);
        let control = known.and_then(KnownPoint::position);
        let all: Vec<Ray> = rays.iter().map(|(_, ray)| *ray).collect();
        let fitting = |at: &Vector3| rays.iter().filter(|ray| self.fits(search, at, ray)).count();
        let met = || {
            let at = meet(&all).filter(|at| fitting(at) == rays.len());
            at.or_else(|| self.consensus(search, &rays))
        };
        let at_control = control.map(|at| fitting(&at));
        let placed = if at_control == Some(rays.len()) {
            control
        } else {
            met().filter(|at| at_control.is_none_or(|count| fitting(at) > count)).or(control)
        };
        // Control counts with its standard deviation, and only in its known components.
        let contradicted = known.zip(placed).is_some_and(|(known, at)| {
            let (own, sd) = known.at(&at);
            rays.iter().filter(|ray| self.reaches(search, &own, sd, ray)).count() < fitting(&at)
        });
        for ray in &rays {
            let fits = placed.is_some_and(|at| self.fits(search, &at, ray));
            self.aside[ray.0] = !fits && (rays.len() > 1 || control.is_some());
        }
        self.contradicted[point] = contradicted;
        self.points[point] = placed.filter(|_| control.is_some() || widest(&all) > LEAST_ANGLE);
    }

    /// Returns whether all rays of a point pass near a position.
    fn is_near(&self, search: &Search<'_>, point: usize, at: &Vector3) -> bool {
        self.rays(search, point).iter().all(|(_, ray)| misfit(ray, at) < NEAR)
    }

    /// Returns the point on which most of three or more rays agree; pairs of rays propose candidates.
    fn consensus(&self, search: &Search<'_>, rays: &[(usize, Ray)]) -> Option<Vector3> {
        if rays.len() < 3 {
            return None;
        }
        let fitting = |at: &Vector3| -> Vec<Ray> {
            rays.iter().filter(|ray| self.fits(search, at, ray)).map(|(_, ray)| *ray).collect()
        };
        let pairs = (0..rays.len()).flat_map(|i| (0..i).map(move |j| [i, j])).take(PAIRS);
        let places = pairs.filter_map(|pair| meet(&pair.map(|k| rays[k].1)));
        let best = places.map(|at| fitting(&at)).max_by_key(Vec::len).filter(|best| best.len() > 1)?;
        meet(&best)
    }

    /// Transforms the model by the inverse of a similarity from object (control) to this model.
    pub fn carried(&self, similarity: &Similarity) -> Self {
        let mut carried = self.clone();
        let attitude = |a: &Matrix3| similarity.rotation.tr_mul(a);
        for (pose, _) in carried.poses.iter_mut().flatten() {
            let position = similarity.control_at(&pose.position);
            *pose = Pose { position, attitude: attitude(&pose.attitude) };
        }
        carried.points.iter_mut().flatten().for_each(|point| *point = similarity.control_at(point));
        carried
    }

    /// Makes the first photo the origin and the base to the next photo the unit; returns the index of the first photo.
    pub fn count_from_first_photo(&mut self) -> usize {
        let Some((first, (origin, _))) =
            self.poses.iter().enumerate().find_map(|(k, pose)| Some((k, (*pose)?)))
        else {
            return 0;
        };
        let others = self.poses.iter().enumerate().skip(first + 1).filter_map(|(_, pose)| *pose);
        let base = others.map(|(pose, _)| (pose.position - origin.position).norm()).next().unwrap_or(1.0);
        let to_first = Similarity {
            rotation: origin.attitude,
            scale: if base > 0.0 { base } else { 1.0 },
            shift: Vector3::zeros(),
            control_centre: Vector3::zeros(),
            model_centre: origin.position,
        };
        *self = self.carried(&to_first);
        first
    }
}

/// Returns the angle between a ray and the direction to a point, radians; more than 1 behind the photo.
pub(super) fn misfit(ray: &Ray, point: &Vector3) -> f64 {
    let to = point - ray.origin;
    let length = to.norm();
    if length > 0.0 { (to / length - ray.direction).norm() } else { 2.0 }
}

/// Returns the largest angle between two rays.
fn widest(rays: &[Ray]) -> f64 {
    let angles = rays
        .iter()
        .enumerate()
        .flat_map(|(i, a)| rays[..i].iter().map(move |b| a.direction.cross(&b.direction).norm()));
    angles.fold(0.0, f64::max)
}

/// Threshold of the robust loss, in standard deviations estimated from the median of the residuals.
const SETS_IN: f64 = 3.0;
/// Maximum number of iterations, and the convergence limit as a fraction of the standard deviation of an unknown.
const ITERATIONS: usize = 30;
const FRACTION: f64 = 0.1;
/// Image plane at unit distance: x = -u1/u3, y = -u2/u3.
const PRINCIPAL_DISTANCE: f64 = -1.0;

impl Search<'_> {
    /// Adjusts poses and points of a model and re-evaluates the fit. A model that cannot be adjusted is unchanged.
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
            // Contradicted control gets at least the discrepancy as standard deviation; far from its rays it is ignored.
            let (control, _) = known.at(&at);
            let (counts, least) = match model.contradicted[point] {
                true => (model.is_near(self, point, &control), (control - at).norm()),
                false => (true, 0.0),
            };
            let held: [bool; 3] = std::array::from_fn(|k| model.object && counts && known.sd[k].is_finite());
            Point {
                coordinates: std::array::from_fn(|k| if held[k] { known.coordinates[k] } else { at[k] }),
                sd: std::array::from_fn(|k| if held[k] { known.sd[k].max(least) } else { f64::INFINITY }),
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

    /// Adjusts the pose of one photo with fixed points; returns the initial pose if this fails.
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

    /// Returns the adjusted network; None if it cannot be adjusted or is not finite.
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
        match network.adjustment(&options).run_in(&mut self.context) {
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

/// Returns the standard deviation of a component, estimated from the median of the angles.
fn spread(misfits: impl Iterator<Item = f64>) -> f64 {
    photocore::internal::median(misfits.collect()).map_or(0.0, |middle| middle / MEDIAN_LENGTH)
}

fn to_numbers(pose: &Pose) -> [f64; 6] {
    let ([x, y, z], [omega, phi, kappa]): ([f64; 3], _) =
        (pose.position.into(), rotation_angles(&pose.attitude.transpose()));
    [x, y, z, omega, phi, kappa]
}

fn of_numbers(&[x, y, z, omega, phi, kappa]: &[f64; 6]) -> Pose {
    Pose {
        position: [x, y, z].into(),
        attitude: photocore::geometry::rotation([omega, phi, kappa]).transpose(),
    }
}
