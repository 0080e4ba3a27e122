//! Relative orientation: the pose of one photo in the axes of another, from the rays of common points.
//!
//! The first photo is at the origin, its attitude is the identity, and the base has length 1. Samples of five points give essential
//! matrices ([`five_points`]). Samples of four points give the poses of a homography, the alternative for plane scenes. The score of a pose
//! is the largest angular misfit of the best two fifths of the pairs of rays; pairs that intersect behind a photo (u3 > 0) count as
//! misfits. Least squares follows in `first_values`.
//!
//! ```
//! use photocore::geometry::{Pose, Vector3, rotation};
//! use photogram_programs::relative_orientation::relative_orientation;
//!
//! let second = Pose { position: Vector3::new(1.0, 0.0, 0.0), attitude: rotation([0.1, -0.2, 0.3]).transpose() };
//! let point = |k: usize| Vector3::new((k % 4) as f64 - 1.0, (k / 4) as f64 - 1.0, -4.0 - (k * k % 5) as f64);
//! let pairs: Vec<[Vector3; 2]> =
//!     (0..12).map(point).map(|p| [p.normalize(), second.to_camera_frame(&p).normalize()]).collect();
//! let best = &relative_orientation(&pairs)[0];
//! assert!((best.oriented.base - second.position).norm() < 1e-6);
//! assert!((best.oriented.attitude - second.attitude).norm() < 1e-6);
//! ```

mod five_points;

pub use five_points::{five_points, over_plane};

use photocore::geometry::{Matrix3, Vector3};

/// Number of samples: if a third of the pairs is wrong, one sample in eight is free of errors.
const SAMPLES: usize = 80;
/// Maximum number of pairs for the score of a pose, evenly distributed.
const JUDGES: usize = 120;
/// Maximum ratio of scores of an alternative and the best pose.
const RIVAL: f64 = 3.0;
/// Maximum number of poses returned.
const MOST: usize = 3;
/// Maximum number of steps of a decomposition.
const STEPS: usize = 1000;

/// Pose and its score.
#[derive(Debug, Clone, Copy)]
pub struct Candidate {
    /// Pose.
    pub oriented: Oriented,
    /// Score: largest misfit of the best two fifths of the pairs of rays, radians.
    pub misfit: f64,
}

/// Returns the poses of the second photo that agree with pairs of unit rays, each in the axes of its photo: the best and similarly good
/// alternatives (two over a plane). The result is empty for fewer than six pairs, or if every pose has half of them behind.
pub fn relative_orientation(pairs: &[[Vector3; 2]]) -> Vec<Candidate> {
    if pairs.len() < 6 {
        return vec![];
    }
    let step = pairs.len().div_ceil(JUDGES);
    let judges: Vec<[Vector3; 2]> = pairs.iter().step_by(step).copied().collect();
    let mut samples = Samples::new(pairs.len());
    let mut found: Vec<Candidate> = Vec::new();
    for _ in 0..SAMPLES {
        let of_five = samples.draw::<5>().map(|k| pairs[k]);
        let of_four = samples.draw::<4>().map(|k| pairs[k]);
        let spatial = five_points(&of_five).into_iter().filter_map(|e| in_front(&e, &of_five));
        let all: Vec<Oriented> = spatial.chain(over_plane(&of_four)).collect();
        let judged = all.into_iter().map(|oriented| Candidate { oriented, misfit: oriented.score(&judges) });
        found.extend(judged.filter(|candidate| candidate.misfit < 0.5));
        found = rivals(found);
    }
    found
}

/// Returns the best pose, and different poses that fit nearly as well.
fn rivals(mut found: Vec<Candidate>) -> Vec<Candidate> {
    found.sort_by(|a, b| a.misfit.total_cmp(&b.misfit));
    let Some(best) = found.first().map(|candidate| candidate.misfit) else { return found };
    let mut retained: Vec<Candidate> = Vec::new();
    for candidate in found {
        let another = !retained.iter().any(|other| other.oriented.is_like(&candidate.oriented));
        if another && retained.len() < MOST && candidate.misfit <= RIVAL * best {
            retained.push(candidate);
        }
    }
    retained
}

/// Returns the pose with most pairs in front of both photos, among the four poses of an essential matrix E = [b]x A.
fn in_front(e: &Matrix3, pairs: &[[Vector3; 2]]) -> Option<Oriented> {
    let svd = e.try_svd(true, true, f64::EPSILON, STEPS)?;
    let (u, v_t) = (svd.u?, svd.v_t?);
    let upright = |m: Matrix3| if m.determinant() < 0.0 { -m } else { m };
    let turn = Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
    let base = Vector3::from(u.column(2));
    let all = [turn, turn.transpose()].into_iter().flat_map(|turn| {
        let attitude = upright(u * turn * v_t);
        [base, -base].map(|base| Oriented { base, attitude })
    });
    let count = |oriented: &Oriented| {
        pairs.iter().filter(|pair| oriented.distances(pair).iter().all(|&distance| distance > 0.0)).count()
    };
    all.max_by_key(count)
}

/// Fraction of the pairs that must fit: if a quarter of the observations is wrong, nearly half of the pairs are wrong.
const JUDGED: f64 = 0.4;
/// Largest difference of the direction cosines of equal poses.
const SAME: f64 = 0.02;

/// Pose of the second photo in the axes of the first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Oriented {
    /// Unit vector from the first projection centre to the second.
    pub base: Vector3,
    /// A, second photo to first.
    pub attitude: Matrix3,
}

impl Oriented {
    /// Returns the distances along two rays to their closest approach, in units of the base.
    pub fn distances(&self, [first, second]: &[Vector3; 2]) -> [f64; 2] {
        let turned = self.attitude * second;
        let normal = first.cross(&turned);
        let square = normal.norm_squared();
        [self.base.cross(&turned).dot(&normal) / square, self.base.cross(first).dot(&normal) / square]
    }

    /// Returns the angle by which two rays fail to intersect, radians; 1 if they intersect behind a photo.
    pub fn misfit(&self, pair: &[Vector3; 2]) -> f64 {
        let [first, second] = pair;
        let turned = self.attitude * second;
        let (in_first, in_second) = (self.base.cross(&turned), first.cross(&self.base));
        let size = (in_first.norm_squared() + in_second.norm_squared()).sqrt();
        if size == 0.0 || self.distances(pair).iter().any(|&distance| distance < 0.0) {
            return 1.0;
        }
        first.dot(&in_first).abs() / size
    }

    /// Returns the intersection angle of two rays, radians.
    pub fn angle(&self, [first, second]: &[Vector3; 2]) -> f64 {
        first.angle(&(self.attitude * second))
    }

    /// Returns the largest misfit of the fraction of the pairs that must fit.
    pub(super) fn score(&self, pairs: &[[Vector3; 2]]) -> f64 {
        let mut misfits: Vec<f64> = pairs.iter().map(|pair| self.misfit(pair)).collect();
        let judge = (JUDGED * misfits.len() as f64) as usize;
        *misfits.select_nth_unstable_by(judge, f64::total_cmp).1
    }

    /// Returns whether two poses are equal.
    pub(super) fn is_like(&self, other: &Self) -> bool {
        (self.attitude - other.attitude).amax() < SAME && (self.base - other.base).amax() < 5.0 * SAME
    }
}

/// Generator of indices below a count: xorshift (Marsaglia 2003) with a fixed seed.
#[derive(Debug)]
pub(crate) struct Samples {
    count: usize,
    state: u64,
}

impl Samples {
    /// Creates a generator of indices below `count`.
    pub fn new(count: usize) -> Self {
        Self { count, state: 0x9E37_79B9_7F4A_7C15 }
    }

    /// Returns N different indices; `count` must be at least N.
    pub fn draw<const N: usize>(&mut self) -> [usize; N] {
        let mut drawn = [usize::MAX; N];
        for k in 0..N.min(self.count) {
            drawn[k] = loop {
                let next = self.next();
                if !drawn[..k].contains(&next) {
                    break next;
                }
            };
        }
        drawn
    }

    fn next(&mut self) -> usize {
        self.state ^= self.state << 13;
        self.state ^= self.state >> 7;
        self.state ^= self.state << 17;
        ((self.state >> 11) % self.count.max(1) as u64) as usize
    }
}
