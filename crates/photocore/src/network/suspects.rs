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
}

/// One component of a test group.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Row {
    /// An equation, in the order of groups and rows, then of ties and rows.
    Equation(usize),
    /// A parameter as its own observation.
    Unknown(usize),
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

/// A test group.
#[derive(Debug, Clone)]
pub(super) struct Suspect {
    pub subject: Subject,
    pub home: Home,
    /// Point of an image, or of its control.
    pub point: Option<usize>,
    /// Photo of an image, or of its position or attitude.
    pub photo: Option<usize>,
    /// Rows, each with its component.
    pub rows: SmallVec<[(Row, usize); 3]>,
}

/// Active test groups: images in their order, then control, positions, attitudes, additional observations, cameras, shared parameters.
/// Their rows are numbered consecutively.
#[derive(Debug)]
pub struct Suspects {
    pub(super) all: Vec<Suspect>,
    row_starts: Vec<usize>,
    block_starts: Vec<usize>,
    deviations: Vec<f64>,
    by_point: OnceLock<Lists>,
    by_photo: OnceLock<Lists>,
}

/// Groups in the order of some objects.
#[derive(Debug)]
struct Lists {
    starts: Vec<usize>,
    groups: Vec<usize>,
}

impl Lists {
    fn new(objects: impl Iterator<Item = Option<usize>> + Clone) -> Self {
        let count = objects.clone().flatten().max().map_or(0, |last| last + 1);
        let mut starts = vec![0; count + 1];
        objects.clone().flatten().for_each(|object| starts[object + 1] += 1);
        (0..count).for_each(|k| starts[k + 1] += starts[k]);
        let (mut next, mut groups) = (starts.clone(), vec![0; starts[count]]);
        for (group, object) in objects.enumerate() {
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

impl Suspects {
    /// Returns the test groups of a network with `count` images and the given cameras of its photos.
    pub(super) fn new(assembled: &Assembled, count: usize, camera_of_photo: &dyn Fn(usize) -> usize) -> Self {
        let model = &assembled.problem.model;
        let mut all = Vec::with_capacity(model.images.len() + model.points.len() + model.observations.len());
        all.extend(images(assembled, count));
        all.extend(of_points(assembled));
        all.extend(of_photos(assembled));
        all.extend(observations(assembled));
        all.extend(of_blocks(assembled, camera_of_photo));
        let problem = &assembled.problem;
        let own = |suspect: &Suspect, row| {
            deviation(&problem.model, suspect, row, (&problem.observation_sd, &problem.sd))
        };
        let mut deviations = Vec::with_capacity(all.iter().map(|suspect| suspect.rows.len()).sum());
        for suspect in &all {
            deviations.extend(suspect.rows.iter().map(|&row| own(suspect, row)));
        }
        Self::of_rows(all, deviations)
    }

    fn of_rows(all: Vec<Suspect>, deviations: Vec<f64>) -> Self {
        let sizes = || all.iter().map(|suspect| suspect.rows.len());
        Self {
            row_starts: starts(sizes()),
            block_starts: starts(sizes().map(|size| size.pow(2))),
            deviations,
            by_point: OnceLock::new(),
            by_photo: OnceLock::new(),
            all,
        }
    }

    /// Returns observations of unit weight, each a group, without points and photos.
    #[cfg(test)]
    pub(super) fn of_single_rows(count: usize, subject: fn(usize) -> Subject) -> Self {
        let suspect = |row| Suspect {
            subject: subject(row),
            home: Home::Tie(row),
            point: None,
            photo: None,
            rows: SmallVec::from_iter([(Row::Equation(row), 0)]),
        };
        Self::of_rows((0..count).map(suspect).collect(), vec![1.0; count])
    }

    /// Returns the number of groups.
    pub(super) fn len(&self) -> usize {
        self.all.len()
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
        self.by_point.get_or_init(|| Lists::new(self.all.iter().map(|suspect| suspect.point))).of(point)
    }

    /// Returns the groups of a photo: its images, its position and its attitude.
    pub(super) fn on_photo(&self, photo: usize) -> &[usize] {
        self.by_photo().of(photo)
    }

    fn by_photo(&self) -> &Lists {
        self.by_photo.get_or_init(|| Lists::new(self.all.iter().map(|suspect| suspect.photo)))
    }

    /// Returns the number of photos with groups.
    pub(super) fn photo_count(&self) -> usize {
        self.by_photo().starts.len() - 1
    }

    /// Returns the object of each group.
    pub fn subjects(&self) -> impl Iterator<Item = Subject> {
        self.all.iter().map(|suspect| suspect.subject)
    }

    /// Returns the first row of each group among all rows, and the number of rows at the end.
    pub fn row_starts(&self) -> &[usize] {
        &self.row_starts
    }

    /// Returns the component of each row.
    pub fn components(&self) -> impl Iterator<Item = usize> {
        self.all.iter().flat_map(|suspect| suspect.rows.iter().map(|&(_, component)| component))
    }

    /// Returns the given standard deviation of each row, in its unit.
    pub fn deviations(&self) -> &[f64] {
        &self.deviations
    }

    /// Returns the rows of some groups as numbered in [`crate::adjustment::ObservationRows`]: equations, then parameters.
    pub(super) fn rows_of(&self, some: Range<usize>, equations: usize) -> impl Iterator<Item = usize> {
        let number = move |&(row, _): &(Row, usize)| match row {
            Row::Equation(equation) => equation,
            Row::Unknown(unknown) => equations + unknown,
        };
        self.all[some].iter().flat_map(move |suspect| suspect.rows.iter().map(number))
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

/// Returns the standard deviation of a row of a group, given the standard deviations of equations and parameters.
pub(super) fn deviation(
    model: &Bundle,
    suspect: &Suspect,
    (row, component): (Row, usize),
    (of_equations, of_unknowns): (&[f64], &[f64]),
) -> f64 {
    match (row, suspect.subject, suspect.home) {
        (_, Subject::Observation(_), Home::Tie(tie)) => {
            model.observations[tie - model.tied_images()].root.row(component).norm()
        }
        (Row::Equation(equation), ..) => of_equations[equation],
        (Row::Unknown(unknown), ..) => of_unknowns[unknown],
    }
}

fn of_photos(assembled: &Assembled) -> Vec<Suspect> {
    let model = &assembled.problem.model;
    let halves = match model.poses {
        PoseNumbers::Angles(_) => [0..3, 3..6],
        PoseNumbers::Vectors => [3..6, 0..3],
    };
    let subjects: [fn(usize) -> Subject; 2] = [Subject::Position, Subject::Attitude];
    let half = |(subject, half): (fn(usize) -> Subject, Range<usize>)| {
        (0..model.cameras.len()).filter_map(move |photo| {
            let first = model.of_block(photo).start + half.start;
            weighted(assembled, subject(photo), Home::Block(photo), first..first + 3)
        })
    };
    subjects.into_iter().zip(halves).flat_map(half).collect()
}

/// Returns groups of the weighted parameters of cameras and shared parameters.
fn of_blocks(assembled: &Assembled, camera_of_photo: &dyn Fn(usize) -> usize) -> Vec<Suspect> {
    let model = &assembled.problem.model;
    let with_camera = (0..model.cameras.len()).filter(|&photo| model.has_own_camera(photo));
    let own = with_camera.filter_map(|photo| {
        let block = model.of_photo(photo);
        let subject = Subject::Camera(camera_of_photo(photo));
        weighted(assembled, subject, Home::Block(photo), block.start + 6..block.end)
    });
    let shared = (0..model.stations()).flat_map(|block| {
        let all = model.owners(block).into_iter();
        all.filter_map(move |(owner, unknowns)| {
            let subject = match owner {
                Owner::Camera(camera) => Subject::Camera(camera),
                Owner::Common(common) => Subject::Common(common),
                Owner::Photo(_) => return None,
            };
            weighted(assembled, subject, Home::Block(block), unknowns)
        })
    });
    own.chain(shared).collect()
}

/// Place of an excluded image.
const OUT: u32 = u32::MAX;

/// Returns groups of the active ones among `count` images, in their order.
fn images(assembled: &Assembled, count: usize) -> impl Iterator<Item = Suspect> {
    let (model, layout) = (&assembled.problem.model, assembled.problem.layout());
    let groups = layout.groups();
    let mut of_image = vec![(OUT, OUT); count];
    for (point, images) in model.point_images.start.windows(2).enumerate() {
        (images[0]..images[1])
            .for_each(|place| of_image[model.point_images.order[place]] = (place as u32, point as u32));
    }
    let suspect = move |(image, (place, point)): (usize, (u32, u32))| {
        if place == OUT {
            return None;
        }
        let (place, point) = (place as usize, point as usize);
        let first = layout.rows() * place;
        let home = match place.checked_sub(groups) {
            None => Home::Group { group: place, point },
            Some(tie) => Home::Tie(tie),
        };
        Some(Suspect {
            subject: Subject::Image(image),
            home,
            point: Some(assembled.points[point]),
            photo: Some(model.images[place].photo),
            rows: SmallVec::from_slice(&[(Row::Equation(first), 0), (Row::Equation(first + 1), 1)]),
        })
    };
    of_image.into_iter().enumerate().filter_map(suspect)
}

fn of_points(assembled: &Assembled) -> Vec<Suspect> {
    let of = |(place, &point): (usize, &usize)| {
        let unknowns = assembled.problem.model.of_point(place);
        Some((point, weighted(assembled, Subject::Control(point), Home::Point(place), unknowns)?))
    };
    let mut all: Vec<(usize, Suspect)> = assembled.points.iter().enumerate().filter_map(of).collect();
    all.sort_by_key(|own| own.0);
    all.into_iter().map(|(_, suspect)| suspect).collect()
}

fn observations(assembled: &Assembled) -> Vec<Suspect> {
    let (model, layout) = (&assembled.problem.model, assembled.problem.layout());
    let first = layout.groups() * layout.rows();
    let of = |(i, tied): (usize, &super::observations::TiedObservation)| {
        let tie = model.tied_images() + i;
        let rows = layout.tie_rows(tie).enumerate().map(|(k, row)| (Row::Equation(first + row), k)).collect();
        Suspect {
            subject: Subject::Observation(tied.index),
            home: Home::Tie(tie),
            point: None,
            photo: None,
            rows,
        }
    };
    let mut order: Vec<usize> = (0..model.observations.len()).collect();
    order.sort_by_key(|&i| model.observations[i].index);
    order.into_iter().map(|i| of((i, &model.observations[i]))).collect()
}

/// Returns a group of the weighted ones among some parameters; None if there are none.
fn weighted(assembled: &Assembled, subject: Subject, home: Home, unknowns: Range<usize>) -> Option<Suspect> {
    let of = |(k, unknown): (usize, usize)| {
        assembled.problem.is_weighted(unknown).then_some((Row::Unknown(unknown), k))
    };
    let rows: SmallVec<[(Row, usize); 3]> = unknowns.enumerate().filter_map(of).collect();
    let (point, photo) = match subject {
        Subject::Control(point) => (Some(point), None),
        Subject::Position(photo) | Subject::Attitude(photo) => (None, Some(photo)),
        _ => (None, None),
    };
    (!rows.is_empty()).then_some(Suspect { subject, home, point, photo, rows })
}
