//! Groups of observations that are tested together for a gross error: an image, control of a point, position or attitude of a photo, an
//! additional observation, parameters of a camera or a shared parameter.

use std::ops::Range;
use std::sync::OnceLock;

use super::model::Owner;
use super::problem::Assembled;
use crate::geometry::PoseNumbers;

/// Type of a test group.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum TestKind {
    /// Both coordinates of an image.
    Image,
    /// The weighted coordinates of a point.
    Control,
    /// The weighted components of a photo's position.
    Position,
    /// The weighted components of a photo's attitude.
    Attitude,
    /// An additional observation.
    Observation,
    /// The weighted parameters of a camera.
    Camera,
    /// The weighted components of a shared parameter.
    Common,
}

/// Object of a test group.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct GroupId {
    /// Type.
    pub kind: TestKind,
    /// Index among the images, points, photos, ... of the network.
    pub index: u32,
}

/// Active test groups in the order of their types, and of the network. Their rows are numbered consecutively.
#[derive(Debug, Default)]
pub struct TestGroups {
    ids: Vec<GroupId>,
    /// Point of an image or of control, and photo of an image, position or attitude.
    points: Vec<u32>,
    photos: Vec<u32>,
    row_starts: Vec<usize>,
    block_starts: Vec<usize>,
    /// Equation of each row, numbered as in [`crate::adjustment::ObservationRows`]: groups, terms, parameters as their own observations.
    equations: Vec<u32>,
    components: Vec<u32>,
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

impl TestGroups {
    /// Returns the test groups of a network with `count` images and the given cameras of its photos.
    pub(super) fn new(assembled: &Assembled, count: usize, camera_of_photo: &dyn Fn(usize) -> usize) -> Self {
        let model = &assembled.problem.model;
        let mut all = Self::empty(model.images.len() + model.points.len() + model.observations.len());
        all.add_images(assembled, count);
        all.add_points(assembled);
        all.add_photos(assembled);
        all.add_observations(assembled);
        all.add_blocks(assembled, camera_of_photo);
        all
    }

    /// Returns no groups, with room for some.
    fn empty(count: usize) -> Self {
        let starts = || {
            let mut starts = Vec::with_capacity(count + 1);
            starts.push(0);
            starts
        };
        Self {
            ids: Vec::with_capacity(count),
            points: Vec::with_capacity(count),
            photos: Vec::with_capacity(count),
            row_starts: starts(),
            block_starts: starts(),
            equations: Vec::with_capacity(2 * count),
            components: Vec::with_capacity(2 * count),
            deviations: Vec::with_capacity(2 * count),
            ..Self::default()
        }
    }

    /// Adds a group with its point and photo, and the equation, component and standard deviation of each row; nothing without rows.
    fn push(
        &mut self,
        (kind, index): (TestKind, usize),
        [point, photo]: [u32; 2],
        rows: impl Iterator<Item = (usize, usize, f64)>,
    ) {
        let first = self.equations.len();
        for (equation, component, deviation) in rows {
            self.equations.push(equation as u32);
            self.components.push(component as u32);
            self.deviations.push(deviation);
        }
        let size = self.equations.len() - first;
        if size > 0 {
            self.ids.push(GroupId { kind, index: index as u32 });
            self.points.push(point);
            self.photos.push(photo);
            self.row_starts.push(first + size);
            self.block_starts.push(self.block_starts[self.block_starts.len() - 1] + size.pow(2));
        }
    }

    /// Returns observations of unit weight, each a group, without points and photos.
    #[cfg(test)]
    pub(super) fn of_single_rows(count: usize, kind: TestKind) -> Self {
        let mut all = Self::empty(count);
        (0..count).for_each(|row| all.push((kind, row), [NONE; 2], std::iter::once((row, 0, 1.0))));
        all
    }

    /// Returns the number of groups.
    pub(super) fn len(&self) -> usize {
        self.ids.len()
    }

    /// Returns the type of a group.
    pub(super) fn kind(&self, group: usize) -> TestKind {
        self.ids[group].kind
    }

    /// Returns the point of an image or of control.
    pub(super) fn point(&self, group: usize) -> Option<usize> {
        Some(self.points[group]).filter(|&point| point != NONE).map(|point| point as usize)
    }

    /// Returns the photo of an image, a position or an attitude.
    pub(super) fn photo(&self, group: usize) -> Option<usize> {
        Some(self.photos[group]).filter(|&photo| photo != NONE).map(|photo| photo as usize)
    }

    /// Returns the rows of a group among all rows.
    pub(super) fn rows(&self, group: usize) -> Range<usize> {
        self.row_starts[group]..self.row_starts[group + 1]
    }

    /// Returns the equation of each row of a group.
    pub(super) fn equations_of(&self, group: usize) -> &[u32] {
        &self.equations[self.rows(group)]
    }

    /// Returns the equations of all rows.
    pub(super) fn equations(&self) -> &[u32] {
        &self.equations
    }

    /// Returns the start of the square block of each group, and the end of the last one.
    pub(super) fn block_starts(&self) -> &[usize] {
        &self.block_starts
    }

    /// Returns the first row of each of some groups among their rows, and the number of these at the end.
    pub(super) fn starts_among(&self, groups: &[usize]) -> Vec<usize> {
        let (mut starts, mut sum) = (Vec::with_capacity(groups.len() + 1), 0);
        starts.push(sum);
        for &group in groups {
            sum += self.rows(group).len();
            starts.push(sum);
        }
        starts
    }

    /// Returns the groups of a type, which are consecutive.
    pub(super) fn of_kind(&self, kind: TestKind) -> Range<usize> {
        let [first, end] = [kind as u8, kind as u8 + 1]
            .map(|number| self.ids.partition_point(|id| (id.kind as u8) < number));
        first..end
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
    pub fn ids(&self) -> &[GroupId] {
        &self.ids
    }

    /// Returns the first row of each group among all rows, and the number of rows at the end.
    pub fn row_starts(&self) -> &[usize] {
        &self.row_starts
    }

    /// Returns the component of each row.
    pub fn components(&self) -> &[u32] {
        &self.components
    }

    /// Returns the given standard deviation of each row, in its unit.
    pub fn deviations(&self) -> &[f64] {
        &self.deviations
    }
}

impl TestGroups {
    /// Adds the active ones among `count` images, in their order.
    fn add_images(&mut self, assembled: &Assembled, count: usize) {
        let (problem, model) = (&assembled.problem, &assembled.problem.model);
        let mut of_image = vec![(NONE, NONE); count];
        for (point, images) in model.point_images.start.windows(2).enumerate() {
            (images[0]..images[1])
                .for_each(|place| of_image[model.point_images.order[place]] = (place as u32, point as u32));
        }
        for (image, (place, point)) in of_image.into_iter().enumerate().filter(|own| own.1.0 != NONE) {
            let first = 2 * place as usize;
            let on = [assembled.points[point as usize], model.images[place as usize].photo];
            let row = |k| (first + k, k, problem.observation_sd[first + k]);
            self.push((TestKind::Image, image), on.map(|own| own as u32), [row(0), row(1)].into_iter());
        }
    }

    fn add_points(&mut self, assembled: &Assembled) {
        let mut places: Vec<usize> = (0..assembled.points.len()).collect();
        places.sort_by_key(|&place| assembled.points[place]);
        for place in places {
            let (point, unknowns) = (assembled.points[place], assembled.problem.model.of_point(place));
            self.add_weighted(assembled, (TestKind::Control, point), [point as u32, NONE], unknowns);
        }
    }

    fn add_photos(&mut self, assembled: &Assembled) {
        let model = &assembled.problem.model;
        let halves = match model.poses {
            PoseNumbers::Angles(_) => [0, 3],
            PoseNumbers::Vectors => [3, 0],
        };
        for (kind, half) in [TestKind::Position, TestKind::Attitude].into_iter().zip(halves) {
            for photo in 0..model.cameras.len() {
                let first = model.of_block(photo).start + half;
                self.add_weighted(assembled, (kind, photo), [NONE, photo as u32], first..first + 3);
            }
        }
    }

    fn add_observations(&mut self, assembled: &Assembled) {
        let (model, layout) = (&assembled.problem.model, assembled.problem.layout());
        let mut order: Vec<usize> = (0..model.observations.len()).collect();
        order.sort_by_key(|&i| model.observations[i].index);
        for i in order {
            let active = &model.observations[i];
            let first = layout.equations_of_term(model.image_terms() + i).start;
            let rows = active.root.row_iter().enumerate().map(|(k, row)| (first + k, k, row.norm()));
            self.push((TestKind::Observation, active.index), [NONE; 2], rows);
        }
    }

    /// Adds groups of the weighted parameters of cameras and shared parameters.
    fn add_blocks(&mut self, assembled: &Assembled, camera_of_photo: &dyn Fn(usize) -> usize) {
        let model = &assembled.problem.model;
        for photo in (0..model.cameras.len()).filter(|&photo| model.has_own_camera(photo)) {
            let (id, own) = ((TestKind::Camera, camera_of_photo(photo)), model.of_photo(photo));
            self.add_weighted(assembled, id, [NONE; 2], own.start + 6..own.end);
        }
        for (owner, unknowns) in (0..model.parameter_blocks()).flat_map(|block| model.owners(block)) {
            let id = match owner {
                Owner::Camera(camera) => (TestKind::Camera, camera),
                Owner::Common(common) => (TestKind::Common, common),
                Owner::Photo(_) => continue,
            };
            self.add_weighted(assembled, id, [NONE; 2], unknowns);
        }
    }

    /// Adds a group of the weighted ones among some parameters, if there are any.
    fn add_weighted(
        &mut self,
        assembled: &Assembled,
        id: (TestKind, usize),
        on: [u32; 2],
        unknowns: Range<usize>,
    ) {
        let problem = &assembled.problem;
        let first = problem.layout().equations();
        let weighted = unknowns.zip(0..).filter(|own| problem.is_weighted(own.0));
        let rows = weighted.map(|(unknown, k)| (first + unknown, k, problem.sd[unknown]));
        self.push(id, on, rows);
    }
}
