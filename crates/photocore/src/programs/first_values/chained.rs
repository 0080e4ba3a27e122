//! Models of photos of which nothing but images is known: a pair, and what can be chained to it.

use std::collections::BTreeMap;

use super::model::{FITS, Model};
use super::{FirstValuesError, Search, Source};
use crate::geometry::{Matrix3, Pose, Vector3};
use crate::network::median;
use crate::programs::relative_orientation::{Candidate, relative_orientation};
use crate::sorting::sort_by;

/// Common points that a pair needs: five, and three to check.
pub(super) const COMMON: usize = 8;
/// Pairs that are oriented before one is chosen.
const TRIED: usize = 12;
/// Angles at which rays meet count up to this, radians: wider ones are no better.
const WIDE: f64 = 0.5;
/// A pair holds when two fifths of its points fit within this angle, radians.
const LIMIT: f64 = 0.01;

struct Pair {
    photos: [usize; 2],
    candidates: Vec<Candidate>,
    merit: f64,
}

impl Search<'_> {
    /// A model of some of the free photos: None where no two of them can be oriented to each other.
    pub fn relative_model(&mut self, free: &[bool]) -> Result<Option<Model>, FirstValuesError> {
        let mut pairs: Vec<Pair> =
            self.pairs(free).into_iter().filter_map(|photos| self.oriented(photos)).collect();
        sort_by(&mut pairs, &|a, b| b.merit.total_cmp(&a.merit));
        let mut best: Option<Model> = None;
        for pair in &pairs {
            // Where two poses fit alike (a plane), the other photos decide.
            for candidate in &pair.candidates {
                let mut model = self.of_pair(pair.photos, candidate)?;
                self.grow(&mut model, &|photo| free[photo])?;
                let better = |other: &Model| rank(self, &model) > rank(self, other);
                if model.count() > 1 && best.as_ref().is_none_or(better) {
                    best = Some(model);
                }
            }
            if best.as_ref().is_some_and(|best| best.count() > 2) {
                break;
            }
        }
        Ok(best)
    }

    /// Pairs of free photos with enough common points, those with most first.
    fn pairs(&self, free: &[bool]) -> Vec<[usize; 2]> {
        let mut common: BTreeMap<[usize; 2], usize> = BTreeMap::new();
        for images in &self.of_point {
            let photos: Vec<usize> = images
                .iter()
                .map(|&image| self.given.sightings[image].photo)
                .filter(|&photo| free[photo])
                .collect();
            for (k, &second) in photos.iter().enumerate() {
                photos[..k].iter().for_each(|&first| *common.entry([first, second]).or_default() += 1);
            }
        }
        let mut pairs: Vec<(usize, [usize; 2])> =
            common.into_iter().map(|(pair, count)| (count, pair)).collect();
        pairs.retain(|(count, _)| *count >= COMMON);
        sort_by(&mut pairs, &|a, b| b.0.cmp(&a.0).then(a.1.cmp(&b.1)));
        pairs.into_iter().take(TRIED).map(|(_, pair)| pair).collect()
    }

    fn common_rays(&self, [first, second]: [usize; 2]) -> Vec<[Vector3; 2]> {
        let of_first: BTreeMap<usize, usize> =
            self.of_photo[first].iter().map(|&image| (self.given.sightings[image].point, image)).collect();
        let both = |&image: &usize| {
            let sighting = &self.given.sightings[image];
            let other = &self.given.sightings[*of_first.get(&sighting.point)?];
            Some([other.direction, sighting.direction])
        };
        self.of_photo[second].iter().filter_map(both).collect()
    }

    fn oriented(&self, photos: [usize; 2]) -> Option<Pair> {
        let rays = self.common_rays(photos);
        let candidates = relative_orientation(&rays);
        let best = candidates.first().filter(|best| best.misfit <= LIMIT)?;
        let angle = median(rays.iter().map(|pair| best.oriented.angle(pair)).collect())?;
        let merit = rays.len() as f64 * angle.min(WIDE);
        Some(Pair { photos, candidates, merit })
    }

    /// The model of two photos, adjusted.
    fn of_pair(
        &mut self,
        [first, second]: [usize; 2],
        candidate: &Candidate,
    ) -> Result<Model, FirstValuesError> {
        let mut model = Model::empty(self.given);
        let pose = |position, attitude| Some((Pose { position, attitude }, Source::Oriented));
        model.poses[first] = pose(Vector3::zeros(), Matrix3::identity());
        model.poses[second] = pose(candidate.oriented.base, candidate.oriented.attitude);
        model.tolerance = (FITS * candidate.misfit).max(f64::MIN_POSITIVE);
        model.intersect(self);
        self.adjust(&mut model)?;
        Ok(model)
    }
}

/// More images that fit, then the smaller median.
fn rank(search: &Search<'_>, model: &Model) -> (usize, f64) {
    let misfits = model.misfits(search);
    let middle = median(misfits.iter().map(|(_, misfit)| *misfit).collect()).unwrap_or(1.0);
    (misfits.len(), -middle)
}
