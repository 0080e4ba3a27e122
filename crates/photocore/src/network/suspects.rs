//! Groups of observations that are tested together for a gross error: an image, control of a point, position or attitude of a photo, an
//! additional observation.

use smallvec::SmallVec;

use std::ops::Range;
use std::sync::OnceLock;

use super::model::{Bundle, Owner};
use super::problem::Assembled;
use crate::geometry::PoseNumbers;

/// Object of a test group: indices into the network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Subject {
    /// Both coordinates of an image.
    Image(usize),
    /// The weighted coordinates of a point.
    Control(usize),
    /// The weighted components of a photo's position.
    Position(usize),
    /// The weighted components of a photo's attitude.
    Attitude(usize),
    /// An additional observation.
    Observation(usize),
    /// The weighted parameters of a camera.
    Camera(usize),
    /// The weighted components of a shared parameter.
    Common(usize),
}

/// Subjects of each type, in the order of the types.
const SUBJECTS: [fn(usize) -> Subject; 7] = [
    Subject::Image,
    Subject::Control,
    Subject::Position,
    Subject::Attitude,
    Subject::Observation,
    Subject::Camera,
    Subject::Common,
];

impl Subject {
    /// Returns the number of its type, in the order of the types.
    pub fn kind(self) -> usize {
        match self {
            Self::Image(_) => 0,
            Self::Control(_) => 1,
            Self::Position(_) => 2,
            Self::Attitude(_) => 3,
            Self::Observation(_) => 4,
            Self::Camera(_) => 5,
            Self::Common(_) => 6,
        }
    }

    /// Returns its index among those of its type.
    pub fn index(self) -> usize {
        let (Self::Image(index)
        | Self::Control(index)
        | Self::Position(index)
        | Self::Attitude(index)
        | Self::Observation(index)
        | Self::Camera(index)
        | Self::Common(index)) = self;
        index
    }
}

/// Location of the parameters of a test group.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Home {
    /// An image of a local point, as a group of equations.
    Group { group: usize, point: usize },
    /// A tie, by its index among the ties.
    Tie(usize),
    /// A point, numbered as in the model.
    Point(usize),
    /// The retained block of a photo, camera or shared parameter.
    Block(usize),
}

/// A row of a test group, numbered as in [`crate::adjustment::ObservationRows`] (equations of groups, of ties, then parameters as their
/// own observations), and its component.
pub(super) type Row = (u32, u32);

/// A test group.
#[derive(Debug, Clone, Copy)]
pub(super) struct Suspect<'a> {
    pub subject: Subject,
    pub home: Home,
    /// Point of an image, or of its control.
    pub point: Option<usize>,
    /// Photo of an image, or of its position or attitude.
    pub photo: Option<usize>,
    pub rows: &'a [Row],
}

/// Active test groups: images in their order, then control, positions, attitudes, additional observations, cameras, shared parameters.
/// Their rows are numbered consecutively.
#[derive(Debug)]
pub struct Suspects {
    /// Number of equations of groups, of these and ties.
    equations: [usize; 2],
    /// Type and index of the subject of each group.
    subjects: Vec<(u8, u32)>,
    /// Point of an image, else the index of its home.
    homes: Vec<u32>,
    points: Vec<u32>,
    photos: Vec<u32>,
    rows: Vec<Row>,
    row_starts: Vec<usize>,
    block_starts: Vec<usize>,
    deviations: Vec<f64>,
    by_point: OnceLock<Lists>,
    by_photo: OnceLock<Lists>,
}

/// Number of an object that a group does not have, or place of an excluded image.
const NONE: u32 = u32::MAX;

/// Groups in the order of some objects.
#[derive(Debug)]
struct Lists {
    starts: Vec<usize>,
    groups: Vec<usize>,
}

impl Lists {
    fn new(objects: &[u32]) -> Self {
        let some = || objects.iter().enumerate().filter(|own| *own.1 != NONE);
        let some = || some().map(|(group, &object)| (group, object as usize));
        let count = some().map(|own| own.1 + 1).max().unwrap_or(0);
        let mut starts = vec![0; count + 1];
        some().for_each(|own| starts[own.1 + 1] += 1);
        (0..count).for_each(|k| starts[k + 1] += starts[k]);
        let (mut next, mut groups) = (starts.clone(), vec![0; starts[count]]);
        for (group, object) in some() {
            groups[next[object]] = group;
            next[object] += 1;
        }
        Self { starts, groups }
    }

    fn of(&self, object: usize) -> &[usize] {
        let range = self.starts.get(object..object + 2).map_or(0..0, |ends| ends[0]..ends[1]);
        &self.groups[range]
    }
}

impl Suspects {
    /// Returns the test groups of a network with `count` images and the given cameras of its photos.
    pub(super) fn new(assembled: &Assembled, count: usize, camera_of_photo: &dyn Fn(usize) -> usize) -> Self {
        let (model, layout) = (&assembled.problem.model, assembled.problem.layout());
        let groups = layout.groups() * layout.rows();
        let mut all = Self::empty(
            [groups, layout.equations()],
            model.images.len() + model.points.len() + model.observations.len(),
        );
        all.add_images(assembled, count);
        all.add_points(assembled);
        all.add_photos(assembled);
        all.add_observations(assembled);
        all.add_blocks(assembled, camera_of_photo);
        all
    }

    /// Returns no groups, with room for some.
    fn empty(equations: [usize; 2], count: usize) -> Self {
        let starts = || {
            let mut starts = Vec::with_capacity(count + 1);
            starts.push(0);
            starts
        };
        Self {
            equations,
            subjects: Vec::with_capacity(count),
            homes: Vec::with_capacity(count),
            points: Vec::with_capacity(count),
            photos: Vec::with_capacity(count),
            rows: Vec::with_capacity(2 * count),
            row_starts: starts(),
            block_starts: starts(),
            deviations: Vec::with_capacity(2 * count),
            by_point: OnceLock::new(),
            by_photo: OnceLock::new(),
        }
    }

    /// Adds a group, with the standard deviation of each row.
    fn push(&mut self, suspect: &Suspect<'_>, deviations: impl Iterator<Item = f64>) {
        let (subject, home) = (suspect.subject, suspect.home);
        self.subjects.push((subject.kind() as u8, subject.index() as u32));
        let (Home::Group { point: index, .. } | Home::Tie(index) | Home::Point(index) | Home::Block(index)) =
            home;
        self.homes.push(index as u32);
        let number = |object: Option<usize>| object.map_or(NONE, |object| object as u32);
        self.points.push(number(suspect.point));
        self.photos.push(number(suspect.photo));
        self.rows.extend_from_slice(suspect.rows);
        self.row_starts.push(self.rows.len());
        self.block_starts.push(self.block_starts[self.block_starts.len() - 1] + suspect.rows.len().pow(2));
        self.deviations.extend(deviations);
    }

    /// Adds a group of an assembled network.
    fn add(&mut self, assembled: &Assembled, suspect: &Suspect<'_>) {
        let problem = &assembled.problem;
        let sd = (&problem.observation_sd[..], &problem.sd[..]);
        self.push(suspect, suspect.rows.iter().map(|&row| deviation(&problem.model, suspect, row, sd)));
    }

    /// Returns observations of unit weight, each a group, without points and photos.
    #[cfg(test)]
    pub(super) fn of_single_rows(count: usize, subject: fn(usize) -> Subject) -> Self {
        let mut all = Self::empty([0, count], count);
        for row in 0..count {
            let rows = &[(row as u32, 0)];
            let suspect =
                Suspect { subject: subject(row), home: Home::Tie(row), point: None, photo: None, rows };
            all.push(&suspect, std::iter::once(1.0));
        }
        all
    }

    /// Returns a group.
    pub(super) fn get(&self, index: usize) -> Suspect<'_> {
        let (subject, rows, home) =
            (self.subject(index), &self.rows[self.rows(index)], self.homes[index] as usize);
        let size = rows.len();
        let home = match subject {
            Subject::Image(_) if (rows[0].0 as usize) < self.equations[0] => {
                Home::Group { group: rows[0].0 as usize / size, point: home }
            }
            Subject::Image(_) | Subject::Observation(_) => Home::Tie(home),
            Subject::Control(_) => Home::Point(home),
            _ => Home::Block(home),
        };
        let object = |number: u32| (number != NONE).then_some(number as usize);
        Suspect { subject, home, point: object(self.points[index]), photo: object(self.photos[index]), rows }
    }

    /// Returns all groups.
    pub(super) fn all(&self) -> impl Iterator<Item = Suspect<'_>> {
        (0..self.len()).map(|index| self.get(index))
    }

    fn subject(&self, index: usize) -> Subject {
        let (kind, index) = self.subjects[index];
        SUBJECTS[kind as usize](index as usize)
    }

    /// Returns the number of groups.
    pub(super) fn len(&self) -> usize {
        self.subjects.len()
    }

    /// Returns the rows of a group among all rows.
    pub(super) fn rows(&self, group: usize) -> Range<usize> {
        self.row_starts[group]..self.row_starts[group + 1]
    }

    /// Returns the start of the square block of each group, and the end of the last one.
    pub(super) fn block_starts(&self) -> &[usize] {
        &self.block_starts
    }

    /// Returns the first row of each of some groups among their rows, and the number of these at the end.
    pub(super) fn starts_among(&self, groups: &[usize]) -> Vec<usize> {
        starts(groups.iter().map(|&group| self.rows(group).len()))
    }

    /// Returns the groups of a point: its images and its control.
    pub(super) fn on_point(&self, point: usize) -> &[usize] {
        self.by_point.get_or_init(|| Lists::new(&self.points)).of(point)
    }

    /// Returns the groups of a photo: its images, its position and its attitude.
    pub(super) fn on_photo(&self, photo: usize) -> &[usize] {
        self.by_photo().of(photo)
    }

    fn by_photo(&self) -> &Lists {
        self.by_photo.get_or_init(|| Lists::new(&self.photos))
    }

    /// Returns the number of photos with groups.
    pub(super) fn photo_count(&self) -> usize {
        self.by_photo().starts.len() - 1
    }

    /// Returns the object of each group.
    pub fn subjects(&self) -> impl Iterator<Item = Subject> {
        (0..self.len()).map(|index| self.subject(index))
    }

    /// Returns the first row of each group among all rows, and the number of rows at the end.
    pub fn row_starts(&self) -> &[usize] {
        &self.row_starts
    }

    /// Returns the component of each row.
    pub fn components(&self) -> impl Iterator<Item = usize> {
        self.rows.iter().map(|&(_, component)| component as usize)
    }

    /// Returns the given standard deviation of each row, in its unit.
    pub fn deviations(&self) -> &[f64] {
        &self.deviations
    }

    /// Returns the numbers of the rows of some groups in [`crate::adjustment::ObservationRows`].
    pub(super) fn rows_of(&self, some: Range<usize>) -> impl Iterator<Item = usize> {
        self.rows[self.row_starts[some.start]..self.row_starts[some.end]].iter().map(|&(row, _)| row as usize)
    }
}

/// Returns the sums of sizes before each of them, and of all.
fn starts(sizes: impl ExactSizeIterator<Item = usize>) -> Vec<usize> {
    let (mut all, mut sum) = (Vec::with_capacity(sizes.len() + 1), 0);
    all.push(sum);
    for size in sizes {
        sum += size;
        all.push(sum);
    }
    all
}

/// Returns the standard deviation of a row of a group, given those of the equations and of the parameters.
pub(super) fn deviation(
    model: &Bundle,
    suspect: &Suspect<'_>,
    (row, component): Row,
    (of_equations, of_unknowns): (&[f64], &[f64]),
) -> f64 {
    match (suspect.subject, suspect.home, (row as usize).checked_sub(of_equations.len())) {
        (Subject::Observation(_), Home::Tie(tie), _) => {
            model.observations[tie - model.tied_images()].root.row(component as usize).norm()
        }
        (.., None) => of_equations[row as usize],
        (.., Some(unknown)) => of_unknowns[unknown],
    }
}

impl Suspects {
    /// Adds the active ones among `count` images, in their order.
    fn add_images(&mut self, assembled: &Assembled, count: usize) {
        let (model, layout) = (&assembled.problem.model, assembled.problem.layout());
        let groups = layout.groups();
        let mut of_image = vec![(NONE, NONE); count];
        for (point, images) in model.point_images.start.windows(2).enumerate() {
            (images[0]..images[1])
                .for_each(|place| of_image[model.point_images.order[place]] = (place as u32, point as u32));
        }
        for (image, (place, point)) in of_image.into_iter().enumerate().filter(|own| own.1.0 != NONE) {
            let (place, point) = (place as usize, point as usize);
            let home = match place.checked_sub(groups) {
                None => Home::Group { group: place, point },
                Some(tie) => Home::Tie(tie),
            };
            let first = (layout.rows() * place) as u32;
            let suspect = Suspect {
                subject: Subject::Image(image),
                home,
                point: Some(assembled.points[point]),
                photo: Some(model.images[place].photo),
                rows: &[(first, 0), (first + 1, 1)],
            };
            self.add(assembled, &suspect);
        }
    }

    fn add_points(&mut self, assembled: &Assembled) {
        let mut places: Vec<usize> = (0..assembled.points.len()).collect();
        places.sort_by_key(|&place| assembled.points[place]);
        for place in places {
            let subject = Subject::Control(assembled.points[place]);
            self.add_weighted(
                assembled,
                subject,
                Home::Point(place),
                assembled.problem.model.of_point(place),
            );
        }
    }

    fn add_photos(&mut self, assembled: &Assembled) {
        let model = &assembled.problem.model;
        let halves = match model.poses {
            PoseNumbers::Angles(_) => [0, 3],
            PoseNumbers::Vectors => [3, 0],
        };
        let subjects: [fn(usize) -> Subject; 2] = [Subject::Position, Subject::Attitude];
        for (subject, half) in subjects.into_iter().zip(halves) {
            for photo in 0..model.cameras.len() {
                let first = model.of_block(photo).start + half;
                self.add_weighted(assembled, subject(photo), Home::Block(photo), first..first + 3);
            }
        }
    }

    fn add_observations(&mut self, assembled: &Assembled) {
        let (model, layout) = (&assembled.problem.model, assembled.problem.layout());
        let mut order: Vec<usize> = (0..model.observations.len()).collect();
        order.sort_by_key(|&i| model.observations[i].index);
        for i in order {
            let tie = model.tied_images() + i;
            let rows = layout.tie_rows(tie).map(|row| (self.equations[0] + row) as u32).zip(0..);
            let rows: SmallVec<[Row; 3]> = rows.collect();
            let subject = Subject::Observation(model.observations[i].index);
            let suspect = Suspect { subject, home: Home::Tie(tie), point: None, photo: None, rows: &rows };
            self.add(assembled, &suspect);
        }
    }

    /// Adds groups of the weighted parameters of cameras and shared parameters.
    fn add_blocks(&mut self, assembled: &Assembled, camera_of_photo: &dyn Fn(usize) -> usize) {
        let model = &assembled.problem.model;
        for photo in (0..model.cameras.len()).filter(|&photo| model.has_own_camera(photo)) {
            let (subject, block) = (Subject::Camera(camera_of_photo(photo)), model.of_photo(photo));
            self.add_weighted(assembled, subject, Home::Block(photo), block.start + 6..block.end);
        }
        for block in 0..model.stations() {
            for (owner, unknowns) in model.owners(block) {
                let subject = match owner {
                    Owner::Camera(camera) => Subject::Camera(camera),
                    Owner::Common(common) => Subject::Common(common),
                    Owner::Photo(_) => continue,
                };
                self.add_weighted(assembled, subject, Home::Block(block), unknowns);
            }
        }
    }

    /// Adds a group of the weighted ones among some parameters, if there are any.
    fn add_weighted(&mut self, assembled: &Assembled, subject: Subject, home: Home, unknowns: Range<usize>) {
        let weighted = unknowns.zip(0..).filter(|own| assembled.problem.is_weighted(own.0));
        let number = |(unknown, component)| ((self.equations[1] + unknown) as u32, component);
        let rows: SmallVec<[Row; 3]> = weighted.map(number).collect();
        let (point, photo) = match subject {
            Subject::Control(point) => (Some(point), None),
            Subject::Position(photo) | Subject::Attitude(photo) => (None, Some(photo)),
            _ => (None, None),
        };
        if !rows.is_empty() {
            self.add(assembled, &Suspect { subject, home, point, photo, rows: &rows });
        }
    }
}
