//! Points and photos that their images do not determine, if these are few.

use super::leaving::{Ended, FEW, Leaves};
use crate::adjustment::{AdjustError, Adjustment};
use crate::network::problem::Assembled;
use crate::network::selection::{Dropped, Reason};

/// Minimum ratio of all photos to undetermined ones, for which these count as few.
const HALF: usize = 2;

/// Returns the undetermined points and photos at which the adjustment has ended.
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
    /// Returns the points that their rays do not determine, as indices into the network. The list is empty if they are many, or for points
    /// with additional observations.
    fn few_points(&self, error: &AdjustError) -> Vec<usize> {
        let AdjustError::UndeterminedLocals(locals) = error else { return vec![] };
        let free = |&local: &usize| self.problem.model.points[local].held() == [false; 3];
        let few = FEW * locals.len() <= self.problem.model.locals && locals.iter().all(free);
        if few { locals.iter().map(|&local| self.points[local]).collect() } else { vec![] }
    }

    /// Returns the photos that their images individually do not determine, if these are few.
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
