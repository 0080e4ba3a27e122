//! The groups of observations of a network that are tested together for a gross error: an image, the control of a point, the position or
//! the attitude of a photo, an observation beside images.

use smallvec::SmallVec;

use std::ops::Range;

use super::model::{Bundle, Owner};
use super::problem::Assembled;
use crate::geometry::PoseNumbers;
use crate::sorting::sort_by;

/// What a group of observations is of: indices into the network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Subject {
    /// Both coordinates of an image.
    Image(usize),
    /// The weighted components of a point.
    Control(usize),
    /// The weighted components of a photo's position.
    Position(usize),
    /// The same of its attitude.
    Attitude(usize),
    /// An observation beside images.
    Observation(usize),
    /// The weighted parameters of a camera.
    Camera(usize),
    /// The weighted components of a common unknown.
    Common(usize),
}

/// One observation of a group.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Row {
    /// An equation, in the order of groups and rows, then of ties and rows.
    Equation(usize),
    /// An unknown as an observation of itself.
    Unknown(usize),
}

/// Where the unknowns of a group stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Home {
    /// A group of equations, of a local block.
    Group { group: usize, point: usize },
    /// A tie.
    Tie(usize),
    /// The unknowns of a point, as the model numbers them.
    Point(usize),
    /// Those of a photo, camera or common unknown: its retained block.
    Block(usize),
}

/// Observations that are tested together.
#[derive(Debug, Clone)]
pub(super) struct Suspect {
    pub subject: Subject,
    pub home: Home,
    /// Each with the component that it is.
    pub rows: SmallVec<[(Row, usize); 3]>,
}

/// The groups of observations that take part: images in their order, then control, positions, attitudes, observations beside images,
/// cameras, common unknowns. Their rows are counted one after the other.
#[derive(Debug)]
pub struct Suspects {
    pub(super) all: Vec<Suspect>,
    row_starts: Vec<usize>,
    deviations: Vec<f64>,
}

impl Suspects {
    /// Those of a network of so many images, and of these cameras of its photos.
    pub(super) fn new(assembled: &Assembled, count: usize, camera_of_photo: &dyn Fn(usize) -> usize) -> Self {
        let mut all = images(assembled, count);
        all.extend(of_points(assembled));
        all.extend(of_photos(assembled));
        all.extend(observations(assembled));
        all.extend(of_blocks(assembled, camera_of_photo));
        let mut row_starts = vec![0];
        row_starts.extend(all.iter().scan(0, |rows, suspect| {
            *rows += suspect.rows.len();
            Some(*rows)
        }));
        let problem = &assembled.problem;
        let own = |suspect: &Suspect, row| {
            deviation(&problem.model, suspect, row, (&problem.observation_sd, &problem.sd))
        };
        let deviations =
            all.iter().flat_map(|suspect| suspect.rows.iter().map(|&row| own(suspect, row))).collect();
        Self { all, row_starts, deviations }
    }

    /// What each group is of.
    pub fn subjects(&self) -> impl Iterator<Item = Subject> {
        self.all.iter().map(|suspect| suspect.subject)
    }

    /// Where the rows of each start among all rows; one more at the end.
    pub fn row_starts(&self) -> &[usize] {
        &self.row_starts
    }

    /// The component that each row is.
    pub fn components(&self) -> impl Iterator<Item = usize> {
        self.all.iter().flat_map(|suspect| suspect.rows.iter().map(|&(_, component)| component))
    }

    /// Standard deviation of each row as it is given, in its unit; of unit weight where the components of an observation are correlated.
    pub fn deviations(&self) -> &[f64] {
        &self.deviations
    }

    /// The rows of some of them, as [`crate::adjustment::ObservationRows`] counts: equations, then unknowns.
    pub(super) fn rows_of(&self, some: Range<usize>, equations: usize) -> impl Iterator<Item = usize> {
        let number = move |&(row, _): &(Row, usize)| match row {
            Row::Equation(equation) => equation,
            Row::Unknown(unknown) => equations + unknown,
        };
        self.all[some].iter().flat_map(move |suspect| suspect.rows.iter().map(number))
    }
}

/// Standard deviation of a row of a suspect, from those of equations and of unknowns.
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

/// The weighted parameters of cameras and components of common unknowns.
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

/// Those of so many images that take part, in their order.
fn images(assembled: &Assembled, count: usize) -> Vec<Suspect> {
    let (model, layout) = (&assembled.problem.model, assembled.problem.layout());
    let groups = layout.groups();
    let mut of_image = vec![None; count];
    for (point, images) in model.point_images.start.windows(2).enumerate() {
        (images[0]..images[1])
            .for_each(|place| of_image[model.point_images.order[place]] = Some((place, point)));
    }
    let suspect = |(image, taken): (usize, Option<(usize, usize)>)| {
        let (place, point) = taken?;
        let first = layout.rows() * place;
        let home = match place.checked_sub(groups) {
            None => Home::Group { group: place, point },
            Some(tie) => Home::Tie(tie),
        };
        let rows = (0..2).map(|k| (Row::Equation(first + k), k)).collect();
        Some(Suspect { subject: Subject::Image(image), home, rows })
    };
    of_image.into_iter().enumerate().filter_map(suspect).collect()
}

fn of_points(assembled: &Assembled) -> Vec<Suspect> {
    let of = |(place, &point): (usize, &usize)| {
        let unknowns = assembled.problem.model.of_point(place);
        Some((point, weighted(assembled, Subject::Control(point), Home::Point(place), unknowns)?))
    };
    let mut all: Vec<(usize, Suspect)> = assembled.points.iter().enumerate().filter_map(of).collect();
    sort_by(&mut all, &|a, b| a.0.cmp(&b.0));
    all.into_iter().map(|(_, suspect)| suspect).collect()
}

fn observations(assembled: &Assembled) -> Vec<Suspect> {
    let (model, layout) = (&assembled.problem.model, assembled.problem.layout());
    let first = layout.groups() * layout.rows();
    let of = |(i, tied): (usize, &super::observations::TiedObservation)| {
        let tie = model.tied_images() + i;
        let rows = layout.tie_rows(tie).enumerate().map(|(k, row)| (Row::Equation(first + row), k)).collect();
        Suspect { subject: Subject::Observation(tied.index), home: Home::Tie(tie), rows }
    };
    model.observations.iter().enumerate().map(of).collect()
}

/// The weighted ones of some unknowns as observations of themselves; None where none is.
fn weighted(assembled: &Assembled, subject: Subject, home: Home, unknowns: Range<usize>) -> Option<Suspect> {
    let of = |(k, unknown): (usize, usize)| {
        assembled.problem.is_weighted(unknown).then_some((Row::Unknown(unknown), k))
    };
    let rows: SmallVec<[(Row, usize); 3]> = unknowns.enumerate().filter_map(of).collect();
    (!rows.is_empty()).then_some(Suspect { subject, home, rows })
}
