//! Models of photos without a-priori orientation: relative orientation of a pair, extended by further photos.
//!
//! Models are joined by similarities from common points, control, and observed projection centres.

use std::collections::BTreeMap;

use super::model::{FITS, Model};
use super::{FirstValuesError, Search, Source};
use crate::relative_orientation::Samples;
use crate::relative_orientation::{Candidate, relative_orientation};
use crate::similarity::{Similarity, Station, closed_form};
use photocore::geometry::{Matrix3, Pose, Vector3};
use photocore::internal::median;

/// Minimum number of common points of a pair: five, and three for a check.
pub(super) const COMMON: usize = 8;
/// Maximum number of pairs that are oriented before one is chosen.
const TRIED: usize = 12;
/// Intersection angle, radians, above which a pair gains no further merit.
const WIDE: f64 = 0.5;
/// Angle, radians, within which two fifths of the points of a valid pair fit.
const LIMIT: f64 = 0.01;

struct PhotoPair {
    photos: [usize; 2],
    candidates: Vec<Candidate>,
    merit: f64,
}

impl Search<'_> {
    /// Returns a model of some of the free photos; None if no pair can be oriented.
    pub fn relative_model(&mut self, free: &[bool]) -> Result<Option<Model>, FirstValuesError> {
        let mut pairs: Vec<PhotoPair> =
            self.pairs(free).into_iter().filter_map(|photos| self.oriented(photos)).collect();
        pairs.sort_by(|a, b| b.merit.total_cmp(&a.merit));
        let mut best: Option<Model> = None;
        for pair in &pairs {
            // If two poses fit equally well (a plane), the other photos decide.
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

    /// Returns pairs of free photos with enough common points, largest number first.
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
        pairs.sort_by(|a, b| b.0.cmp(&a.0).then(a.1.cmp(&b.1)));
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

    fn oriented(&self, photos: [usize; 2]) -> Option<PhotoPair> {
        let rays = self.common_rays(photos);
        let candidates = relative_orientation(&rays);
        let best = candidates.first().filter(|best| best.misfit <= LIMIT)?;
        let angle = median(rays.iter().map(|pair| best.oriented.angle(pair)).collect())?;
        let merit = rays.len() as f64 * angle.min(WIDE);
        Some(PhotoPair { photos, candidates, merit })
    }

    /// Returns the adjusted model of two photos.
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

/// Ranks by the number of fitting image observations, then by the smaller median.
fn rank(search: &Search<'_>, model: &Model) -> (usize, f64) {
    let misfits = model.misfits(search);
    let middle = median(misfits.iter().map(|(_, misfit)| *misfit).collect()).unwrap_or(1.0);
    (misfits.len(), -middle)
}

/// Minimum number of common positions of two models.
const JOINT: usize = 3;
/// Number of samples of three positions.
const SAMPLES: usize = 60;
/// Relative misfit, as a fraction of the extent, within which half of the common positions of a valid similarity fit.
const JOINT_MISFIT: f64 = 0.05;
/// Multiple of the median misfit, or fraction of the extent, within which a position is used.
const SPREAD: f64 = 5.0;
const ROUNDING: f64 = 1e-6;
/// Initial tolerance of rays of joined models, as a multiple of the tolerance of each model.
const WIDER: f64 = 3.0;
/// Ratio of width to length below which common points are collinear.
const LINE: f64 = 0.02;

impl Search<'_> {
    /// Joins models to the object as far as possible, and resects the photos that become solvable.
    pub fn join_all(&mut self, object: &mut Model, apart: &mut Vec<Model>) -> Result<(), FirstValuesError> {
        while let Some((index, similarity)) = self.next_join(object, apart) {
            let carried = apart.remove(index).carried(&similarity);
            self.take_in(object, &carried)?;
        }
        Ok(())
    }

    /// Returns the next model that can be joined, with its similarity. A larger model that agrees only with the a-priori data replaces
    /// resected photos: four points, one of them wrong, may give a false pose.
    fn next_join(&self, object: &mut Model, apart: &[Model]) -> Option<(usize, Similarity)> {
        let join = |object: &Model| {
            let similarity = |(index, model)| Some((index, self.onto(&self.common(object, model))?));
            apart.iter().enumerate().find_map(similarity)
        };
        join(object).or_else(|| {
            let mut beforehand = object.clone();
            for pose in &mut beforehand.poses {
                *pose = pose.filter(|(_, source)| matches!(source, Source::Given | Source::Observed));
            }
            beforehand.intersect(self);
            let found = object.object.then(|| join(&beforehand)).flatten();
            let larger = |&(index, _): &(usize, Similarity)| apart[index].count() > object.count();
            let found = found.filter(larger)?;
            *object = beforehand;
            Some(found)
        })
    }

    /// Joins the models outside of the object with each other.
    pub fn join_among(&mut self, apart: &mut Vec<Model>) -> Result<(), FirstValuesError> {
        let mut index = 0;
        while index < apart.len() {
            let mut model = apart.remove(index);
            let before = apart.len();
            self.join_all(&mut model, apart)?;
            // The join may have removed earlier models.
            apart.insert(index.min(apart.len()), model);
            index = if before + 1 > apart.len() { 0 } else { index + 1 };
        }
        Ok(())
    }

    fn take_in(&mut self, object: &mut Model, carried: &Model) -> Result<(), FirstValuesError> {
        for (own, other) in object.poses.iter_mut().zip(&carried.poses) {
            *own = own.or(*other);
        }
        object.tolerance = WIDER * object.tolerance.max(carried.tolerance);
        object.intersect(self);
        self.adjust(object)?;
        self.grow(object, &|_| true)
    }

    /// Returns pairs of positions in the two models: points, and observed projection centres if the first model is the object.
    pub fn common(&self, object: &Model, model: &Model) -> Vec<[Vector3; 2]> {
        let pair = |(a, b): (&Option<Vector3>, &Option<Vector3>)| Some([(*a)?, (*b)?]);
        let points = object.points.iter().zip(&model.points).filter_map(pair);
        let centre = |photo: usize| {
            let (pose, _) = model.poses[photo]?;
            let own = object.poses[photo].map(|(pose, _)| pose.position);
            let observed = self.given.photos[photo].position.filter(|_| object.object);
            Some([own.or(observed)?, pose.position])
        };
        points.chain((0..model.poses.len()).filter_map(centre)).collect()
    }

    /// Returns the similarity that maps a model onto the common positions; None if undetermined or inconsistent.
    fn onto(&self, common: &[[Vector3; 2]]) -> Option<Similarity> {
        if common.len() < JOINT {
            return None;
        }
        let extent = extent(common)?;
        let miss = |similarity: &Similarity, pair: &[Vector3; 2]| {
            (similarity.control_at(&pair[1]) - pair[0]).norm() / extent
        };
        let mut samples = Samples::new(common.len());
        let mut best: Option<(f64, Similarity)> = None;
        for _ in 0..if common.len() == JOINT { 1 } else { SAMPLES } {
            let triple = samples.draw::<JOINT>().map(|k| common[k]);
            let Some(similarity) = fitted(&triple) else { continue };
            let misfits: Vec<f64> = common.iter().map(|pair| miss(&similarity, pair)).collect();
            let Some(misfit) = median(misfits) else { continue };
            if best.as_ref().is_none_or(|(least, _)| misfit < *least) {
                best = Some((misfit, similarity));
            }
        }
        let (misfit, similarity) = best.filter(|(misfit, _)| *misfit <= JOINT_MISFIT)?;
        let within = (SPREAD * misfit).max(ROUNDING);
        let good: Vec<[Vector3; 2]> =
            common.iter().filter(|pair| miss(&similarity, pair) <= within).copied().collect();
        fitted(&good)
    }
}

fn fitted(common: &[[Vector3; 2]]) -> Option<Similarity> {
    extent(common)?;
    let station = |&[control, model]: &[Vector3; 2]| Station {
        control,
        control_sd: [0.0; 3],
        model,
        model_sd: [1.0; 3],
    };
    closed_form(&common.iter().map(station).collect::<Vec<_>>()).ok()
}

/// Returns the extent of the positions; None if they are collinear.
fn extent(common: &[[Vector3; 2]]) -> Option<f64> {
    let centre = common.iter().map(|[own, _]| own).sum::<Vector3>() / common.len() as f64;
    let from = |[own, _]: &[Vector3; 2]| own - centre;
    let farthest = common.iter().map(from).max_by(|a, b| a.norm().total_cmp(&b.norm()))?;
    let axis = farthest.try_normalize(f64::MIN_POSITIVE)?;
    let across = common.iter().map(|pair| from(pair).cross(&axis).norm()).fold(0.0, f64::max);
    (across > LINE * farthest.norm()).then(|| farthest.norm())
}
