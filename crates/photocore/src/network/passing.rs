//! Images that pass more than pose and camera: their blocks, and the equations there.

use smallvec::{SmallVec, smallvec};

use super::Image;
use super::commons::CommonState;
use super::film::FilmOf;
use super::in_block::InBlock;
use super::model::Bundle;
use super::mounts::Composed;
use super::passages::Own;
use super::stations::{Bent, Stations};
use crate::geometry::camera::SplinedStereographic;
use crate::geometry::{Camera, CameraModel, Matrix3, Vector3};
use crate::normals::{Cofactors, GroupRows};
use crate::parallel;

/// How far an image may move, in distances of knots, before it depends on others than those that it may step with.
const MARGIN: f64 = 0.25;

/// Where the columns of a block are among those that an image has in common with others; None of the main block.
#[derive(Debug, Clone, Copy)]
struct Slot {
    block: usize,
    first: Option<usize>,
}

/// The rows of an image, and where the columns of each block stand.
struct Columns<'a, 'b> {
    rows: &'a mut GroupRows<'b>,
    slots: SmallVec<[Slot; 32]>,
}

impl Columns<'_, '_> {
    /// Adds the partials of the computed position by one of the unknowns at a place.
    fn add(&mut self, place: InBlock, k: usize, by: [f64; 2]) {
        let slot = self.slots.iter().find(|slot| slot.block == place.block);
        let (to, start) = match slot.map(|slot| slot.first) {
            Some(Some(first)) => (&mut *self.rows.shared, first),
            Some(None) => (&mut *self.rows.retained, 0),
            None => return,
        };
        let width = to.len() / 2;
        (0..2).for_each(|row| to[width * row + start + place.first + k] += by[row]);
    }
}

impl Bundle {
    /// The common unknowns that an image steps with by what it passes.
    fn passed_by(&self, image: usize) -> Own {
        let photo = self.images[image].photo;
        let columns = splined(&self.cameras[photo]).map_or(0, SplinedStereographic::columns);
        self.passages.commons((image, photo, self.point_of(image)), columns)
    }

    /// Finds the knots that images may step with, from where points and photos stand at given values of the unknowns, and counts which common
    /// unknowns they step with by what they pass.
    pub(super) fn open_windows(&mut self, unknowns: &[f64]) {
        if !self.passages.lenses().is_empty() {
            let windows = self.of_seen(unknowns, |own, u| own.window(u, MARGIN));
            self.passages.open(windows);
        }
        for image in 0..self.images.len() {
            self.passed_by(image).into_iter().for_each(|common| self.commons[common].uses += 1);
        }
    }

    /// Whether there are images of which the knots are others than those that they may step with.
    pub(super) fn is_beyond_windows(&self, unknowns: &[f64]) -> bool {
        if self.passages.lenses().is_empty() {
            return false;
        }
        let patches = self.of_seen(unknowns, |own, u| own.patch(u));
        patches.iter().enumerate().any(|(image, patch)| {
            let window = self.passages.window(image);
            patch.is_some_and(|patch| window.is_none_or(|window| !window.has(&patch)))
        })
    }

    /// Takes something of each image with a lens of knots, by its camera and by what that sees of the point.
    fn of_seen<T: Send>(
        &self,
        unknowns: &[f64],
        take: impl Fn(&SplinedStereographic, &Vector3) -> Option<T> + Sync,
    ) -> Vec<Option<T>> {
        let stations = self.evaluated(unknowns);
        let Some(bent) = &stations.bent else { return vec![] };
        let of_point = |point: usize| {
            let images = self.point_images.start[point]..self.point_images.start[point + 1];
            let of_image = |image: usize| {
                let photo = self.images[image].photo;
                self.passages.lens(photo)?;
                let camera = splined(&stations.photos[photo].camera)?;
                take(camera, &self.sight_bent((&stations, bent), image, point))
            };
            images.map(of_image).collect::<Vec<_>>()
        };
        parallel::map(self.points.len(), 64, of_point).into_iter().flatten().collect()
    }

    /// The retained blocks of these, each once.
    pub(super) fn blocks_of_passages(&self, image: usize) -> SmallVec<[usize; 32]> {
        let mut blocks = SmallVec::new();
        if self.passages.is_empty() {
            return blocks;
        }
        for common in self.passed_by(image) {
            if let Some(place) = self.blocks.of_common[common]
                && !blocks.contains(&place.block)
            {
                blocks.push(place.block);
            }
        }
        blocks
    }

    /// Writes the equations of an image that passes more than pose and camera: those of pose, point and camera first.
    pub(super) fn observe_passing(
        &self,
        (stations, bent): (&Stations, &Bent),
        group: usize,
        local: usize,
        rows: &mut GroupRows<'_>,
        own: &mut Composed,
    ) {
        let (photo, cell) = (self.images[group].photo, self.passages.cell(group));
        let (main, all) = (self.main_block(group), rows.shared.len() / 2);
        let mut slots: SmallVec<[Slot; 32]> = smallvec![Slot { block: main, first: None }];
        let mut place = |blocks: &mut dyn Iterator<Item = usize>, mut first: usize| {
            for block in blocks {
                slots.push(Slot { block, first: Some(first) });
                first += self.of_block(block).len();
            }
            first
        };
        let poses = place(&mut self.blocks_of_pose(photo, self.time_of(group)).skip(1), 0);
        let passed = place(&mut self.blocks_of_passages(group).into_iter(), poses);
        let plain = poses + all - passed;
        let mut shared: SmallVec<[f64; 64]> = smallvec![0.0; 2 * plain];
        let (constant, point, retained) = (&mut *rows.constant, &mut *rows.local, &mut *rows.retained);
        let mut inner = GroupRows { constant, local: point, retained, shared: &mut shared };
        let timed = self.compose_timed((stations, bent), group, own);
        let own = timed.then_some(&*own);
        let read = bent.write(self.space, stations, own, (&self.images[group], cell), local, &mut inner);
        for (row, to) in rows.shared.chunks_exact_mut(all.max(1)).enumerate() {
            let from = &shared[plain * row..][..plain];
            to[..poses].copy_from_slice(&from[..poses]);
            to[poses..passed].fill(0.0);
            to[passed..].copy_from_slice(&from[poses..]);
        }
        let mut columns = Columns { rows, slots };
        self.step_figure(local, &mut columns);
        if let (Some(film), Some(read)) = (self.passages.film(photo), read) {
            let commons = film.commons(cell);
            film.partials(&read, |slot, by| {
                let common = commons[slot].0;
                let Some(place) = self.blocks.of_common[common] else { return };
                for (k, &(_, component, _)) in self.commons[common].kind.unknowns().iter().enumerate() {
                    columns.add(place, k, [by[(0, component)], by[(1, component)]]);
                }
            });
        }
        self.step_knots((stations, bent), group, local, &mut columns);
    }

    /// Finds in which cells of patterns images are, at the values that are given.
    pub(super) fn find_cells(&mut self) {
        let grid = |photo| self.passages.film(photo).is_some_and(FilmOf::has_cells);
        if !(0..self.cameras.len()).any(grid) {
            return;
        }
        let given: Vec<CommonState> =
            self.commons.iter().map(|own| own.at(&vec![0.0; own.kind.unknowns().len()])).collect();
        let films = self.passages.films(&given);
        let cell =
            |image: &Image| films[image.photo].as_ref().map_or(0, |film| film.cell_of_reading(image.xy));
        self.passages.cells = self.images.iter().map(cell).collect();
    }

    /// The partials by the knots of a lens.
    fn step_knots(
        &self,
        (stations, bent): (&Stations, &Bent),
        group: usize,
        local: usize,
        columns: &mut Columns<'_, '_>,
    ) {
        let photo = self.images[group].photo;
        let (lens, camera) = (self.passages.lens(photo), splined(&stations.photos[photo].camera));
        let (Some(lens), Some(camera)) = (lens, camera) else { return };
        let Some(patch) = camera.patch(&self.sight_bent((stations, bent), group, local)) else { return };
        let [fx, fy, ..] = camera.parameters();
        for (knot, weight) in patch.knots(camera.columns()) {
            if let Some(place) = self.blocks.of_common[self.passages.lenses()[lens].commons[knot]] {
                columns.add(place, 0, [fx * weight, 0.0]);
                columns.add(place, 1, [0.0, fy * weight]);
            }
        }
    }

    /// The partials by the numbers of a figure: by the point, times how that is shifted.
    fn step_figure(&self, local: usize, columns: &mut Columns<'_, '_>) {
        let Some((figure, k)) = self.passages.figure(local) else { return };
        let Some(place) = self.blocks.of_common[figure.common] else { return };
        let by_point: [f64; 2 * 3] = std::array::from_fn(|i| columns.rows.local[i]);
        for (number, shift) in figure.shifts[k].column_iter().enumerate() {
            let by = |row: usize| (0..3).map(|i| by_point[3 * row + i] * shift[i]).sum();
            columns.add(place, number, [by(0), by(1)]);
        }
    }

    /// The coordinates of a point that a figure shifts, and the cofactors that it has by it; None of all others. `unknowns` are those of all
    /// stations.
    pub(super) fn shifted(
        &self,
        point: usize,
        unknowns: &[f64],
        cofactors: Option<&Cofactors>,
    ) -> Option<([f64; 3], Matrix3)> {
        let (figure, k) = self.passages.figure(point)?;
        let (given, shifts) = (self.points[point].coordinates, figure.shifts[k]);
        let shift = figure.shift(k, &self.common_state(figure.common, unknowns).vector());
        let own = cofactors.map(|all| self.cofactors_of_common(all, figure.common));
        let found = match own {
            None => Matrix3::repeat(f64::NAN),
            // Of numbers that are known.
            Some(own) if own.is_empty() => Matrix3::zeros(),
            Some(own) => shifts * own.fixed_view::<2, 2>(0, 0) * shifts.transpose(),
        };
        Some((std::array::from_fn(|i| given[i] + shift[i]), found))
    }
}

/// A camera as one with a spline; None of all others.
fn splined(camera: &Camera) -> Option<&SplinedStereographic> {
    match camera {
        Camera::SplinedStereographic(own) => Some(own),
        _ => None,
    }
}
