//! Models joined by a similarity: on common points, control, and observed projection centres.

use super::model::Model;
use super::{FirstValuesError, Search, Source};
use crate::geometry::Vector3;
use crate::network::median;
use crate::programs::sampling::Samples;
use crate::programs::similarity::{Similarity, Station, closed_form};

/// What two models must have in common.
const COMMON: usize = 3;
/// Samples of three that are solved.
const SAMPLES: usize = 60;
/// A similarity holds when half of what is common fits within this part of its extent,
const LIMIT: f64 = 0.05;
/// and what fits within this multiple of the median, or part of the extent, takes part.
const SPREAD: f64 = 5.0;
const ROUNDING: f64 = 1e-6;
/// What rays of two models may miss each other by at first, in what they may in each.
const WIDER: f64 = 3.0;
/// Common points are on one line when their extent across it is this part of that along it.
const LINE: f64 = 0.02;

impl Search<'_> {
    /// Joins what can be joined to the object, and resects what that makes known.
    pub fn join_all(&mut self, object: &mut Model, apart: &mut Vec<Model>) -> Result<(), FirstValuesError> {
        while let Some((index, similarity)) = self.next_join(object, apart) {
            let carried = apart.remove(index).carried(&similarity);
            self.take_in(object, &carried)?;
        }
        Ok(())
    }

    /// A model that can be joined, and how. One that agrees with what was known beforehand, but not with a smaller object, takes the
    /// place of what was resected: four points of which one is wrong may give a pose.
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

    /// Joins models that are not the object's among each other.
    pub fn join_among(&mut self, apart: &mut Vec<Model>) -> Result<(), FirstValuesError> {
        let mut index = 0;
        while index < apart.len() {
            let mut model = apart.remove(index);
            let before = apart.len();
            self.join_all(&mut model, apart)?;
            // It may have taken in those before it, too.
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

    /// Pairs of positions, in the first model and in the second: points, and observed projection centres if the first is the object.
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

    /// The similarity that carries a model onto what it has in common; None where that does not say, or does not agree.
    fn onto(&self, common: &[[Vector3; 2]]) -> Option<Similarity> {
        if common.len() < COMMON {
            return None;
        }
        let extent = extent(common)?;
        let miss = |similarity: &Similarity, pair: &[Vector3; 2]| {
            (similarity.control_at(&pair[1]) - pair[0]).norm() / extent
        };
        let mut samples = Samples::new(common.len());
        let mut best: Option<(f64, Similarity)> = None;
        for _ in 0..if common.len() == COMMON { 1 } else { SAMPLES } {
            let triple = samples.draw::<COMMON>().map(|k| common[k]);
            let Some(similarity) = fitted(&triple) else { continue };
            let misfits: Vec<f64> = common.iter().map(|pair| miss(&similarity, pair)).collect();
            let Some(misfit) = median(misfits) else { continue };
            if best.as_ref().is_none_or(|(least, _)| misfit < *least) {
                best = Some((misfit, similarity));
            }
        }
        let (misfit, similarity) = best.filter(|(misfit, _)| *misfit <= LIMIT)?;
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

/// How far the positions reach; None where they are on one line.
fn extent(common: &[[Vector3; 2]]) -> Option<f64> {
    let centre = common.iter().map(|[own, _]| own).sum::<Vector3>() / common.len() as f64;
    let from = |[own, _]: &[Vector3; 2]| own - centre;
    let farthest = common.iter().map(from).max_by(|a, b| a.norm().total_cmp(&b.norm()))?;
    let axis = farthest.try_normalize(f64::MIN_POSITIVE)?;
    let across = common.iter().map(|pair| from(pair).cross(&axis).norm()).fold(0.0, f64::max);
    (across > LINE * farthest.norm()).then(|| farthest.norm())
}
