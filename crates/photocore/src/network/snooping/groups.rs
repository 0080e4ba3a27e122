//! Groups of observations by point and photo, and the observations that become useless without a group.

use std::collections::BTreeSet;
use std::ops::Range;

use super::super::mounts::Mounts;
use super::super::suspects::{Home, Subject, Suspect, Suspects};
use super::super::trial::Trial;
use super::settings::{ControlParts, Settings};

/// Smallest number of images of a photo with a free pose.
const SUPPORT: usize = 3;

/// Excluded observations.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Excluded {
    /// Whether each row is excluded, with the rows of all groups concatenated.
    pub rows: Vec<bool>,
    /// Points excluded with all their observations.
    pub points: BTreeSet<usize>,
    /// Photos excluded with all their observations.
    pub photos: BTreeSet<usize>,
}

impl Excluded {
    pub(super) fn set(&mut self, rows: impl IntoIterator<Item = usize>, is_excluded: bool) {
        rows.into_iter().for_each(|row| self.rows[row] = is_excluded);
    }
}

/// Groups in the order of some objects.
#[derive(Debug, Clone, Default)]
struct Lists {
    starts: Vec<usize>,
    groups: Vec<usize>,
}

impl Lists {
    fn new(objects: &[Option<usize>]) -> Self {
        let count = objects.iter().flatten().max().map_or(0, |&last| last + 1);
        let mut starts = vec![0; count + 1];
        objects.iter().flatten().for_each(|&object| starts[object + 1] += 1);
        (0..count).for_each(|k| starts[k + 1] += starts[k]);
        let (mut next, mut groups) = (starts.clone(), vec![0; starts[count]]);
        for (group, &object) in objects.iter().enumerate() {
            if let Some(object) = object {
                groups[next[object]] = group;
                next[object] += 1;
            }
        }
        Self { starts, groups }
    }

    fn of(&self, object: usize) -> &[usize] {
        let range = self.starts.get(object..object + 2).map_or(0..0, |ends| ends[0]..ends[1]);
        &self.groups[range]
    }
}

/// Objects of an additional observation.
#[derive(Debug, Clone, Default)]
struct Objects {
    points: Vec<usize>,
    photos: Vec<usize>,
    trajectory: Option<usize>,
}

/// Groups of observations of a network.
#[derive(Debug, Clone, Default)]
pub(super) struct Groups {
    pub subjects: Vec<Subject>,
    /// First row of each group, and the number of rows at the end.
    pub row_starts: Vec<usize>,
    /// Start of the square block of each group.
    pub block_starts: Vec<usize>,
    /// Point and photo of each group; tests of groups of one point depend on each other.
    pub points: Vec<Option<usize>>,
    pub photos: Vec<Option<usize>>,
    /// Standard deviation of each row, in its unit.
    pub deviations: Vec<f64>,
    pub control: ControlParts,
    /// Whether the cofactors of all rows together are small enough to be computed.
    pub is_small: bool,
    /// Whether the pose of each photo is determined without images.
    pub is_supported: Vec<bool>,
    by_point: Lists,
    by_photo: Lists,
    /// Objects of the groups from the first additional observation on.
    objects: Vec<Objects>,
    first_observation: usize,
    /// Photos on each trajectory.
    on_trajectories: Vec<Vec<usize>>,
}

impl Groups {
    pub fn new(trial: &Trial, settings: &Settings) -> Self {
        let (suspects, model) = (trial.suspects(), &trial.assembled.problem.model);
        let mounts = &model.mounts;
        let photos = settings.is_supported.len();
        let mut on_trajectories = vec![vec![]; mounts.trajectories().len()];
        for photo in 0..photos {
            if let Some(trajectory) = mounts.trajectory_of(photo) {
                on_trajectories[trajectory].push(photo);
            }
        }
        let is_observation = |suspect: &Suspect| matches!(suspect.subject, Subject::Observation(_));
        let of = |suspect: &Suspect| match suspect.home {
            Home::Tie(tie) if is_observation(suspect) => objects(trial, tie - model.tied_images(), photos),
            _ => Objects::default(),
        };
        let mut of_point = vec![0; model.images.len()];
        for (point, ends) in model.point_images.start.windows(2).enumerate() {
            of_point[ends[0]..ends[1]].fill(point);
        }
        let place = |suspect: &Suspect| match suspect.home {
            Home::Group { group, .. } => group,
            Home::Tie(tie) => model.point_images.start[model.locals] + tie,
            Home::Point(_) | Home::Block(_) => usize::MAX,
        };
        let point = |suspect: &Suspect| match suspect.subject {
            Subject::Image(_) => Some(trial.assembled.points[of_point[place(suspect)]]),
            Subject::Control(point) => Some(point),
            _ => None,
        };
        let photo = |suspect: &Suspect| match suspect.subject {
            Subject::Image(_) => Some(model.images[place(suspect)].photo),
            Subject::Position(photo) | Subject::Attitude(photo) => Some(photo),
            _ => None,
        };
        let all = &suspects.all;
        Self {
            block_starts: trial.block_starts.clone(),
            objects: all.iter().filter(|own| is_observation(own)).map(of).collect(),
            first_observation: all.iter().position(is_observation).unwrap_or(all.len()),
            on_trajectories,
            ..Self::of_rows(
                suspects,
                all.iter().map(point).collect(),
                all.iter().map(photo).collect(),
                settings,
            )
        }
    }

    fn of_rows(
        suspects: &Suspects,
        points: Vec<Option<usize>>,
        photos: Vec<Option<usize>>,
        settings: &Settings,
    ) -> Self {
        let row_starts = suspects.row_starts().to_vec();
        Self {
            subjects: suspects.subjects().collect(),
            by_point: Lists::new(&points),
            by_photo: Lists::new(&photos),
            points,
            photos,
            deviations: suspects.deviations().to_vec(),
            control: settings.control,
            is_small: row_starts.last().is_some_and(|&rows| rows <= settings.max_rows),
            is_supported: settings.is_supported.clone(),
            row_starts,
            ..Self::default()
        }
    }

    /// Returns observations of unit weight, each a group, without points and photos.
    #[cfg(test)]
    pub fn of_single_rows(count: usize, subject: fn(usize) -> Subject) -> Self {
        Self {
            subjects: (0..count).map(subject).collect(),
            row_starts: (0..=count).collect(),
            block_starts: (0..=count).collect(),
            points: vec![None; count],
            photos: vec![None; count],
            deviations: vec![1.0; count],
            is_small: true,
            objects: vec![Objects::default(); count],
            ..Self::default()
        }
    }

    pub fn len(&self) -> usize {
        self.subjects.len()
    }

    pub fn rows(&self, group: usize) -> Range<usize> {
        self.row_starts[group]..self.row_starts[group + 1]
    }

    /// Returns the type of a group; see [`Subject::kind`].
    pub fn kind(&self, group: usize) -> usize {
        self.subjects[group].kind()
    }

    pub fn is_image(&self, group: usize) -> bool {
        matches!(self.subjects[group], Subject::Image(_))
    }

    /// Returns whether data snooping may exclude a group.
    pub fn is_removable(&self, group: usize) -> bool {
        !matches!(self.subjects[group], Subject::Camera(_) | Subject::Common(_))
    }

    pub fn on_point(&self, point: usize) -> &[usize] {
        self.by_point.of(point)
    }

    pub fn on_photo(&self, photo: usize) -> &[usize] {
        self.by_photo.of(photo)
    }

    /// Returns the number of photos with groups.
    pub fn photo_count(&self) -> usize {
        self.by_photo.starts.len().saturating_sub(1)
    }

    fn photos_of_point(&self, point: usize) -> impl Iterator<Item = usize> {
        self.on_point(point)
            .iter()
            .filter(|&&group| self.is_image(group))
            .filter_map(|&group| self.photos[group])
    }

    /// Returns the photos that a group affects: those that observe its point.
    pub fn affected_photos(&self, group: usize) -> BTreeSet<usize> {
        match (
            self.points[group],
            self.photos[group],
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
        self.photos[group].map_or_else(|| self.affected_photos(group), |photo| BTreeSet::from([photo]))
    }

    /// Returns the rows of the separate parts of a group, numbered in the group; None if the group is one whole.
    pub fn parts(&self, group: usize) -> Option<Vec<Vec<usize>>> {
        let count = self.rows(group).len();
        if count < 2 || self.control == ControlParts::Whole {
            return None;
        }
        let single = (0..count).map(|row| vec![row]);
        match (self.subjects[group], self.control) {
            (Subject::Control(_), ControlParts::PlanAndHeight) if count == 3 => {
                Some(vec![vec![0, 1, 2], vec![2], vec![0, 1]])
            }
            (Subject::Control(_), ControlParts::Components) => {
                Some(single.chain([(0..count).collect()]).collect())
            }
            (Subject::Control(_) | Subject::Position(_) | Subject::Attitude(_), _) => Some(single.collect()),
            _ => None,
        }
    }

    /// Returns the point that has too few rays without a group, and whether a photo has too few images.
    pub fn consequences(&self, out: &Excluded, group: usize) -> (Option<usize>, bool) {
        let (mut lost, mut leaving) = (None, vec![]);
        let mut photos: Vec<usize> =
            self.photos[group].filter(|_| self.is_image(group)).into_iter().collect();
        if let Some(point) = self.points[group].filter(|point| !out.points.contains(point)) {
            let (images, others): (Vec<usize>, Vec<usize>) =
                self.on_point(point).iter().partition(|&&own| self.is_image(own));
            let rays: Vec<usize> = images.into_iter().filter(|&image| self.is_in(out, image)).collect();
            let components =
                others.into_iter().flat_map(|own| self.rows(own)).filter(|&row| !out.rows[row]).count();
            if rays.is_empty() || (rays.len() == 1 && components <= 1) {
                photos.extend(rays.iter().filter_map(|&image| self.photos[image]));
                (lost, leaving) = (Some(point), rays);
            }
        }
        (lost, photos.into_iter().any(|photo| self.loses_support(out, photo, &leaving)))
    }

    /// Returns whether the first row of an image is in use.
    fn is_in(&self, out: &Excluded, image: usize) -> bool {
        !out.rows[self.row_starts[image]]
    }

    /// Returns whether a photo has too few images, without the `leaving` ones.
    fn loses_support(&self, out: &Excluded, photo: usize, leaving: &[usize]) -> bool {
        if self.is_supported.get(photo).is_some_and(|is_supported| *is_supported)
            || out.photos.contains(&photo)
        {
            return false;
        }
        let images = || self.on_photo(photo).iter().filter(|&&group| self.is_image(group));
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
