//! Resection of photos from known points: samples of three points give poses, the other points select among them.

use super::model::Model;
use super::{FirstValuesError, RESECTED, Search, Source};
use crate::relative_orientation::Samples;
use crate::resection::three_points;
use photocore::geometry::{Pose, Ray, Vector3};
use photocore::internal::median;

/// Number of samples of three points; each is the widest of a few.
const SAMPLES: usize = 60;
const TRIES: usize = 3;
/// Limits within which half of the points of a valid pose fit: an angle in radians, and a multiple of the standard deviation.
const LIMIT: f64 = 0.01;
const DEVIATIONS: f64 = 10.0;
/// Multiple of the median within which a point fits.
const SPREAD: f64 = 5.0;

/// Pose and its misfit.
struct JudgedPose {
    pose: Pose,
    misfit: f64,
}

impl Search<'_> {
    /// Resects photos of a model successively, largest number of known points first, and intersects their points.
    pub fn grow(
        &mut self,
        model: &mut Model,
        admitted: &dyn Fn(usize) -> bool,
    ) -> Result<(), FirstValuesError> {
        // Number of known points at which each photo failed.
        let mut failed = vec![0; self.given.photos.len()];
        let mut since = 0;
        let mut at_rest = true;
        loop {
            let next = (0..self.given.photos.len())
                .filter(|&photo| model.poses[photo].is_none() && admitted(photo))
                .map(|photo| (self.known_points(model, photo).len(), photo))
                .filter(|&(known, photo)| known >= RESECTED && known > failed[photo])
                .max_by_key(|&(known, photo)| (known, std::cmp::Reverse(photo)));
            let Some((known, photo)) = next else {
                if at_rest {
                    return Ok(());
                }
                // An adjustment may improve points so that further photos succeed.
                self.adjust(model)?;
                (at_rest, since) = (true, 0);
                continue;
            };
            match self.resected(model, photo)? {
                None => failed[photo] = known,
                Some(pose) => {
                    model.poses[photo] = Some((pose, Source::Resected));
                    self.place_points_of(model, photo);
                    since += 1;
                    at_rest = false;
                    if since >= 5.max(model.count() / 6) {
                        self.adjust(model)?;
                        since = 0;
                    }
                }
            }
        }
    }

    /// Intersects the points of a photo again.
    pub fn place_points_of(&self, model: &mut Model, photo: usize) {
        for &image in &self.of_photo[photo] {
            model.place(self, self.given.sightings[image].point);
        }
    }

    /// Returns the pose of a photo from its known points; None if too few of them agree.
    fn resected(&mut self, model: &Model, photo: usize) -> Result<Option<Pose>, FirstValuesError> {
        let images = self.known_points(model, photo);
        let sights: Vec<(Vector3, Vector3)> = images
            .iter()
            .filter_map(|&image| {
                let sighting = &self.given.sightings[image];
                Some((sighting.direction, model.points[sighting.point]?))
            })
            .collect();
        let sd = images.iter().map(|&image| self.given.sightings[image].sd).fold(0.0, f64::max);
        let limit = LIMIT.max(DEVIATIONS * sd).max(model.tolerance.min(5.0 * LIMIT));
        let Some(best) = consensus(&sights).filter(|best| best.misfit <= limit) else { return Ok(None) };
        let within = (SPREAD * best.misfit).max(DEVIATIONS * sd);
        let fitting = |&k: &usize| miss(&best.pose, &sights[k]) <= within;
        let good: Vec<usize> = (0..sights.len()).filter(fitting).collect();
        if good.len() < RESECTED || 2 * good.len() < sights.len() {
            return Ok(None);
        }
        let good: Vec<usize> = good.into_iter().map(|k| images[k]).collect();
        self.adjusted_photo(model, photo, best.pose, &good).map(Some)
    }
}

/// Returns the pose with the smallest median misfit, among the poses of samples of three points.
fn consensus(sights: &[(Vector3, Vector3)]) -> Option<JudgedPose> {
    if sights.len() < RESECTED {
        return None;
    }
    let mut samples = Samples::new(sights.len());
    let span = |triple: &[usize; 3]| {
        let area = |of: &dyn Fn(usize) -> Vector3| {
            let [a, b, c] = triple.map(of);
            (b - a).cross(&(c - a)).norm()
        };
        area(&|k| sights[k].0) * area(&|k| sights[k].1)
    };
    let mut best: Option<JudgedPose> = None;
    for _ in 0..SAMPLES {
        let tries: [[usize; 3]; TRIES] = std::array::from_fn(|_| samples.draw::<3>());
        let Some(triple) = tries.into_iter().max_by(|a, b| span(a).total_cmp(&span(b))) else { continue };
        let (rays, points) = (triple.map(|k| sights[k].0), triple.map(|k| sights[k].1));
        for placement in three_points(&rays, &points) {
            let pose = Pose { position: placement.centre, attitude: placement.to_photo.transpose() };
            let others = (0..sights.len()).filter(|k| !triple.contains(k));
            let Some(misfit) = median(others.map(|k| miss(&pose, &sights[k])).collect()) else { continue };
            if best.as_ref().is_none_or(|best| misfit < best.misfit) {
                best = Some(JudgedPose { pose, misfit });
            }
        }
    }
    best
}

fn miss(pose: &Pose, (direction, point): &(Vector3, Vector3)) -> f64 {
    super::model::misfit(&Ray { origin: pose.position, direction: pose.attitude * direction }, point)
}
