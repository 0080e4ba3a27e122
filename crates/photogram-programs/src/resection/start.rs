//! Initial poses from well-distributed triples of points, each checked against all others.

use super::degenerate::collinear;
use super::three_points::{Placement, three_points};
use super::{ControlPoint, Known, Pose, Resection, ResectionError};
use photocore::geometry::rotation::unit;
use photocore::geometry::{
    CameraModel, Matrix3, ObjectSpace, Perspective, RotationSense, Vector3, local_vertical, nearest_turns,
    rotation_angles,
};

/// Number of points from which triples are formed, and number of triples.
const SPREAD_POINTS: usize = 8;
const TRIPLES: usize = 12;
/// Maximum number of initial poses, and their minimum separation in radians or as a fraction of the mean distance.
const STARTS: usize = 8;
const APART: f64 = 0.05;
/// Largest ratio of squared directional misfits of an initial pose and the best one.
const WORSE: f64 = 400.0;

/// Unit rays in the photo, and cartesian points.
pub(super) struct Sight {
    rays: Vec<Vector3>,
    pub points: Vec<Vector3>,
    /// Expected mean square of the directional errors, from the standard deviations of the image coordinates.
    noise: f64,
}

impl Resection {
    /// Returns poses that fit, best first.
    ///
    /// # Errors
    /// Too few points, collinear points, or rays without a pose in front of the camera.
    pub(super) fn starts(&self) -> Result<Vec<Pose>, ResectionError> {
        let known = [self.position.value, self.attitude.value].concat();
        let given = known.iter().all(|value| value.is_finite());
        let given = given.then_some(Pose { position: self.position.value, attitude: self.attitude.value });
        let mut placements = match (self.enough_points(), given) {
            (Ok(()), _) => self.sight().placements(),
            (Err(_), Some(_)) => vec![],
            (Err(why), None) => return Err(why),
        };
        placements.truncate(STARTS);
        let found = placements.iter().map(|placement| self.held(self.pose(placement)));
        let starts: Vec<Pose> = given.into_iter().chain(found).collect();
        if starts.is_empty() { Err(ResectionError::NoPlacement) } else { Ok(starts) }
    }

    /// Checks that the points can determine a pose: at least three of them, not on one line.
    pub(super) fn enough_points(&self) -> Result<(), ResectionError> {
        if self.points.len() < 3 {
            Err(ResectionError::TooFewPoints(self.points.len()))
        } else if collinear(&self.sight().points) {
            Err(ResectionError::Collinear)
        } else {
            Ok(())
        }
    }

    /// Returns the rays of the image observations and the cartesian positions of the points.
    pub(super) fn sight(&self) -> Sight {
        let c = self.principal_distance;
        let camera = Perspective { principal_distance: c };
        let ray = |xy| camera.direction(xy).unwrap_or_else(|| Vector3::repeat(f64::NAN));
        let count = self.points.len().max(1) as f64;
        let noise = |point: &ControlPoint| (point.xy_sd[0].powi(2) + point.xy_sd[1].powi(2)) / (c * c);
        Sight {
            rays: self.points.iter().map(|point| ray(point.xy)).collect(),
            points: self.points.iter().map(|point| self.space.cartesian(point.coordinates)).collect(),
            noise: self.points.iter().map(noise).sum::<f64>() / count,
        }
    }

    /// Returns position and attitude of a placement.
    fn pose(&self, placement: &Placement) -> Pose {
        let position = self.space.coordinates(placement.centre);
        let vertical = match self.space {
            ObjectSpace::Rectangular => Matrix3::identity(),
            ObjectSpace::Geographic(_) => local_vertical(position[0], position[1]),
        };
        // G = M R or M^T R.
        let turn = placement.to_photo * vertical.transpose();
        let attitude = match self.sense {
            RotationSense::GroundToPhoto => rotation_angles(&turn),
            RotationSense::PhotoToGround => rotation_angles(&turn.transpose()),
        };
        Pose { position, attitude: nearest_turns(attitude, self.attitude.value) }
    }

    /// Replaces fixed components by the given values.
    fn held(&self, pose: Pose) -> Pose {
        let hold = |found: [f64; 3], known: &Known| -> [f64; 3] {
            std::array::from_fn(|k| if known.sd[k] == 0.0 { known.value[k] } else { found[k] })
        };
        Pose { position: hold(pose.position, &self.position), attitude: hold(pose.attitude, &self.attitude) }
    }
}

impl Sight {
    /// Returns different placements that fit, best first.
    fn placements(&self) -> Vec<Placement> {
        let mut scored: Vec<(f64, Placement)> = Vec::new();
        for [i, j, k] in self.triples() {
            let rays = [self.rays[i], self.rays[j], self.rays[k]];
            let points = [self.points[i], self.points[j], self.points[k]];
            scored.extend(three_points(&rays, &points).into_iter().map(|place| (self.misfit(&place), place)));
        }
        scored.retain(|(misfit, _)| misfit.is_finite());
        scored.sort_by(|a, b| a.0.total_cmp(&b.0));
        let limit = scored.first().map_or(0.0, |best| WORSE * best.0.max(self.noise));
        let mut chosen: Vec<Placement> = Vec::new();
        for (_, place) in scored.into_iter().take_while(|(misfit, _)| *misfit <= limit) {
            if !chosen.iter().any(|other| self.alike(other, &place)) {
                chosen.push(place);
            }
        }
        chosen
    }

    /// Returns the mean square of the chords between observed and computed directions; up to 4 behind the camera.
    fn misfit(&self, place: &Placement) -> f64 {
        let chord = |(ray, point): (&Vector3, &Vector3)| {
            let seen = unit(&(place.to_photo * (point - place.centre)));
            seen.map_or(f64::NAN, |seen| (seen - ray).norm_squared())
        };
        self.rays.iter().zip(&self.points).map(chord).sum::<f64>() / self.points.len() as f64
    }

    fn alike(&self, a: &Placement, b: &Placement) -> bool {
        let offset = a.centre - b.centre;
        let from = self.points[0] - a.centre;
        let trace = a.to_photo.dot(&b.to_photo);
        let angle = ((trace - 1.0) / 2.0).clamp(-1.0, 1.0).acos();
        angle < APART && offset.norm_squared() < APART * APART * from.norm_squared()
    }

    /// Returns the triples with the largest spans, in the image and in space.
    fn triples(&self) -> Vec<[usize; 3]> {
        let spread = self.spread();
        let mut triples: Vec<(f64, [usize; 3])> = Vec::new();
        for (a, &i) in spread.iter().enumerate() {
            for (b, &j) in spread.iter().enumerate().skip(a + 1) {
                for &k in &spread[b + 1..] {
                    triples.push((self.span([i, j, k]), [i, j, k]));
                }
            }
        }
        triples.sort_by(|a, b| b.0.total_cmp(&a.0));
        triples.into_iter().take(TRIPLES).map(|(_, triple)| triple).collect()
    }

    /// Returns the area of the triangle in the image (in directions) times its area in space.
    fn span(&self, [i, j, k]: [usize; 3]) -> f64 {
        let area = |p: &[Vector3]| (p[j] - p[i]).cross(&(p[k] - p[i])).norm();
        area(&self.rays) * area(&self.points)
    }

    /// Selects distant points in the image: each point is the farthest from those chosen before.
    fn spread(&self) -> Vec<usize> {
        let mean = self.rays.iter().sum::<Vector3>() / self.rays.len() as f64;
        let chord = |ray: &Vector3, other: &Vector3| (ray - other).norm_squared();
        let mut nearest: Vec<f64> = self.rays.iter().map(|ray| chord(ray, &mean)).collect();
        let mut chosen = Vec::new();
        while chosen.len() < SPREAD_POINTS.min(self.rays.len()) {
            let free = (0..self.rays.len()).filter(|index| !chosen.contains(index));
            let Some(next) = free.max_by(|&a, &b| nearest[a].total_cmp(&nearest[b])) else { break };
            if chosen.is_empty() {
                nearest.fill(f64::INFINITY);
            }
            chosen.push(next);
            for (distance, ray) in nearest.iter_mut().zip(&self.rays) {
                *distance = distance.min(chord(ray, &self.rays[next]));
            }
        }
        chosen
    }
}
