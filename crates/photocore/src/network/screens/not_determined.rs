//! Points and photos that their images do not determine, where they are few.

use super::leaving::{Ended, FEW, Leaves};
use crate::adjustment::{AdjustError, Adjustment};
use crate::network::problem::Assembled;
use crate::network::selection::{Dropped, Reason};

/// Photos that are not determined, each by itself, are few where there are so many times as many: a network of some photos has few.
const HALF: usize = 2;

/// What an adjustment has ended with because its images do not determine it.
pub(super) fn look(ended: &Ended<'_>) -> Leaves {
    match ended.adjusted {
        Ok(Adjustment { undetermined: Some(error), .. }) | Err(error) => {
            let points = ended.assembled.few_points(error).into_iter();
            let reason = Reason::NotDetermined;
            Leaves {
                points: points.map(|point| Dropped { point, reason }).collect(),
                photos: ended.assembled.few_photos(error),
            }
        }
        Ok(_) => Leaves::default(),
    }
}

impl Assembled {
    /// The points that an adjustment has ended with because their rays do not determine them, where they are so few that the others make
    /// up a network without them: indices into it. None where observations beside images touch them.
    fn few_points(&self, error: &AdjustError) -> Vec<usize> {
        let AdjustError::UndeterminedLocals(locals) = error else { return vec![] };
        let free = |&local: &usize| self.problem.model.points[local].held() == [false; 3];
        let few = FEW * locals.len() <= self.problem.model.locals && locals.iter().all(free);
        if few { locals.iter().map(|&local| self.points[local]).collect() } else { vec![] }
    }

    /// The photos that an adjustment has ended with because their images do not determine them, each by itself, where they are few.
    fn few_photos(&self, error: &AdjustError) -> Vec<usize> {
        let AdjustError::Undetermined(combinations) = error else { return vec![] };
        let model = &self.problem.model;
        let alone = |blocks: &Vec<usize>| match blocks[..] {
            [block] => (block < model.cameras.len() && model.images_on[block] > 0).then_some(block),
            _ => None,
        };
        let Some(mut photos) = combinations.iter().map(alone).collect::<Option<Vec<usize>>>() else {
            return vec![];
        };
        photos.sort_unstable();
        photos.dedup();
        let is_frame = |photo: usize| model.mounts.all().any(|mount| mount.frame() == Some(photo));
        let few = HALF * photos.len() <= model.cameras.len() && !photos.iter().any(|&photo| is_frame(photo));
        if few { photos } else { vec![] }
    }
}
