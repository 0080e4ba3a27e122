//! Groups of observations by point and photo, and the observations that become useless without a group.

use std::collections::BTreeSet;
use std::ops::Range;
use std::sync::Arc;

use super::super::mounts::Mounts;
use super::super::test_groups::{TestGroups, TestKind};
use super::super::trial::{Excluded, Trial};
use super::settings::{ControlParts, Settings};

/// Smallest number of images of a photo with a free pose.
const SUPPORT: usize = 3;

/// Objects of an additional observation.
#[derive(Debug, Clone, Default)]
struct Objects {
    points: Vec<usize>,
    photos: Vec<usize>,
    trajectory: Option<usize>,
}

/// Groups of observations of a network.
#[derive(Debug, Clone)]
pub(super) struct Groups {
    pub table: Arc<TestGroups>,
    pub control: ControlParts,
    /// Whether the cofactors of all rows together are small enough to be computed.
    pub is_small: bool,
    /// Whether the pose of each photo is determined without images.
    pub is_supported: Vec<bool>,
    /// Objects of the groups from the first additional observation on.
    objects: Vec<Objects>,
    first_observation: usize,
    /// Photos on each trajectory.
    on_trajectories: Vec<Vec<usize>>,
}

impl Groups {
    pub fn new(trial: &Trial, settings: &Settings) -> Self {
        let (table, mounts) = (trial.groups(), &trial.assembled.problem.model.mounts);
        let photos = settings.is_supported.len();
        let mut on_trajectories = vec![vec![]; mounts.trajectories().len()];
        for photo in 0..photos {
            if let Some(trajectory) = mounts.trajectory_of(photo) {
                on_trajectories[trajectory].push(photo);
            }
        }
        let observations = table.of_kind(TestKind::Observation);
        let first_observation = observations.start;
        let of = |group: usize| Some(objects(trial, trial.observation(group)?, photos));
        Self {
            objects: observations.map(|group| of(group).unwrap_or_default()).collect(),
            first_observation,
            on_trajectories,
            control: settings.control,
            is_small: table.row_starts()[table.len()] <= settings.max_rows,
            is_supported: settings.is_supported.clone(),
            table: table.clone(),
        }
    }

    /// Returns observations of unit weight, each a group, without points and photos.
    #[cfg(test)]
    pub fn of_single_rows(count: usize, kind: TestKind) -> Self {
        Self {
            table: Arc::new(TestGroups::of_single_rows(count, kind)),
            control: ControlParts::default(),
            is_small: true,
            is_supported: vec![],
            objects: vec![Objects::default(); count],
            first_observation: 0,
            on_trajectories: vec![],
        }
    }

    pub fn len(&self) -> usize {
        self.table.len()
    }

    /// Returns exclusions of none of the rows.
    pub fn none_excluded(&self) -> Excluded {
        Excluded { rows: vec![false; self.table.row_starts()[self.len()]], ..Excluded::default() }
    }

    pub fn rows(&self, group: usize) -> Range<usize> {
        self.table.rows(group)
    }

    pub fn point(&self, group: usize) -> Option<usize> {
        self.table.point(group)
    }

    pub fn photo(&self, group: usize) -> Option<usize> {
        self.table.photo(group)
    }

    pub fn kind(&self, group: usize) -> TestKind {
        self.table.kind(group)
    }

    pub fn is_image(&self, group: usize) -> bool {
        self.kind(group) == TestKind::Image
    }

    /// Returns whether data snooping may exclude a group.
    pub fn is_removable(&self, group: usize) -> bool {
        !matches!(self.kind(group), TestKind::Camera | TestKind::Common)
    }

    fn photos_of_point(&self, point: usize) -> impl Iterator<Item = usize> {
        self.table
            .on_point(point)
            .iter()
            .filter(|&&group| self.is_image(group))
            .filter_map(|&group| self.photo(group))
    }

    /// Returns the photos that a group affects: those that observe its point.
    pub fn affected_photos(&self, group: usize) -> BTreeSet<usize> {
        match (
            self.point(group),
            self.photo(group),
            self.objects.get(group.wrapping_sub(self.first_observation)),
        ) {
            (Some(point), ..) => self.photos_of_point(point).collect(),
            (None, Some(photo), _) => BTreeSet::from([photo]),
            (None, None, None) => BTreeSet::new(),
            (None, None, Some(Objects { trajectory: Some(trajectory), .. })) => {
                self.on_trajectories[*trajectory].iter().copied().collect()
            }
            (None, None, Some(Objects { points, photos, .. })) => {
                let of_points = points.iter().flat_map(|&point| self.photos_of_point(point));
                of_points.chain(photos.iter().copied()).collect()
            }
        }
    }

    /// Returns the photo of a group; without one, the photos that observe its point.
    pub fn own_photos(&self, group: usize) -> BTreeSet<usize> {
        self.photo(group).map_or_else(|| self.affected_photos(group), |photo| BTreeSet::from([photo]))
    }

    /// Returns the rows of the separate parts of a group, numbered in the group; None if the group is one whole.
    pub fn parts(&self, group: usize) -> Option<Vec<Vec<usize>>> {
        let count = self.rows(group).len();
        if count < 2 || self.control == ControlParts::Whole {
            return None;
        }
        let single = (0..count).map(|row| vec![row]);
        match (self.kind(group), self.control) {
            (TestKind::Control, ControlParts::PlanAndHeight) if count == 3 => {
                Some(vec![vec![0, 1, 2], vec![2], vec![0, 1]])
            }
            (TestKind::Control, ControlParts::Components) => {
                Some(single.chain([(0..count).collect()]).collect())
            }
            (TestKind::Control | TestKind::Position | TestKind::Attitude, _) => Some(single.collect()),
            _ => None,
        }
    }

    /// Returns the point that has too few rays without a group, and whether a photo has too few images.
    pub fn consequences(&self, out: &Excluded, group: usize) -> (Option<usize>, bool) {
        let (mut lost, mut leaving) = (None, vec![]);
        let mut photos: Vec<usize> = self.photo(group).filter(|_| self.is_image(group)).into_iter().collect();
        if let Some(point) = self.point(group).filter(|point| !out.points.contains(point)) {
            let (images, others): (Vec<usize>, Vec<usize>) =
                self.table.on_point(point).iter().partition(|&&own| self.is_image(own));
            let rays: Vec<usize> = images.into_iter().filter(|&image| self.is_in(out, image)).collect();
            let components =
                others.into_iter().flat_map(|own| self.rows(own)).filter(|&row| !out.rows[row]).count();
            if rays.is_empty() || (rays.len() == 1 && components <= 1) {
                photos.extend(rays.iter().filter_map(|&image| self.photo(image)));
                (lost, leaving) = (Some(point), rays);
            }
        }
        (lost, photos.into_iter().any(|photo| self.loses_support(out, photo, &leaving)))
    }

    /// Returns whether the first row of an image is in use.
    fn is_in(&self, out: &Excluded, image: usize) -> bool {
        !out.rows[self.rows(image).start]
    }

    /// Returns whether a photo has too few images, without the `leaving` ones.
    fn loses_support(&self, out: &Excluded, photo: usize, leaving: &[usize]) -> bool {
        if self.is_supported.get(photo).is_some_and(|is_supported| *is_supported)
            || out.photos.contains(&photo)
        {
            return false;
        }
        let images = || self.table.on_photo(photo).iter().filter(|&&group| self.is_image(group));
        let used = images().filter(|&&image| self.is_in(out, image)).count();
        used < SUPPORT + images().filter(|image| leaving.contains(image)).count()
    }
}

/// Returns the objects of an additional observation by its index in the model. `photos`: number of photos without records of trajectories.
fn objects(trial: &Trial, index: usize, photos: usize) -> Objects {
    let model = &trial.assembled.problem.model;
    let touches = &model.observations[index].touches;
    let mounts: &Mounts = &model.mounts;
    let of_record = touches
        .photos
        .iter()
        .filter(|&&photo| photo >= photos)
        .find_map(|&photo| mounts.trajectory_of(photo));
    let of_coefficient = || {
        let is_alone = touches.photos.is_empty() && touches.points.is_empty();
        let has = |common: usize| {
            mounts.trajectories().iter().position(|own| own.coefficients().any(|one| one == common))
        };
        touches.commons.first().filter(|_| is_alone).and_then(|&(common, _)| has(common))
    };
    Objects {
        points: touches.points.iter().map(|&point| trial.assembled.points[point]).collect(),
        photos: touches.photos.clone(),
        trajectory: of_record.or_else(of_coefficient),
    }
}
