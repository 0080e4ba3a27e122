//! Equations of images with corrections after projection, and their blocks.

use std::ops::Range;

use smallvec::{SmallVec, smallvec};

use super::commons::{CommonState, InBlock};
use super::film::{FilmOf, Read};
use super::image_corrections::ImageCommons;
use super::input::Image;
use super::linearization_point::{LinearizationPoint, PhotoState};
use super::model::Bundle;
use super::mounts::Composed;
use super::simd::{FEWEST, ImageObservation, linearize_simd};
use crate::geometry::camera::{LensDirection, Matrix2, SplinedStereographic, each_camera};
use crate::geometry::{Camera, CameraModel, Matrix3, Vector3};
use crate::normals::{Cofactors, GroupRows};
use crate::parallel;

/// Distance, in knot spacings, that an image may move before other knots become active.
const MARGIN: f64 = 0.5;
/// Identity transformation of rows.
const UNIT: Matrix2 = [[1.0, 0.0], [0.0, 1.0]];
/// Image at zero: its residual is the negative computed position.
const NOWHERE: Image = Image { photo: 0, point: 0, xy: [0.0; 2], sd: [1.0; 2] };

/// First column of a block among the shared columns of an image; None for the main block.
#[derive(Debug, Clone, Copy)]
struct ColumnRange {
    block: usize,
    first: Option<usize>,
}

/// Column layout of an image with corrections. The main block begins with pose and camera. The shared columns are other blocks of the pose,
/// blocks of the corrections, and the camera.
pub(super) struct ImageColumns {
    slots: SmallVec<[ColumnRange; 32]>,
    /// Number of columns of pose and camera in the main block.
    main: usize,
    /// Number of columns of other pose blocks, first column of the camera, and total number.
    poses: usize,
    camera: usize,
    all: usize,
}

impl ImageColumns {
    /// Adds the partials of the computed position by one parameter.
    #[inline]
    fn add(&self, rows: &mut GroupRows<'_>, place: InBlock, k: usize, by: [f64; 2]) {
        if let Some(slot) = self.slot(place.block, 0) {
            self.add_at(rows, slot, place.first + k, by);
        }
    }

    /// Returns the slot of a block, searching from slot `from` on.
    #[inline]
    fn slot(&self, block: usize, from: usize) -> Option<usize> {
        let is_it = |slot: &ColumnRange| slot.block == block;
        let (before, after) = self.slots.split_at(from);
        after.iter().position(is_it).map(|place| from + place).or_else(|| before.iter().position(is_it))
    }

    /// Adds the partials of the computed position by a parameter of the block of a slot.
    #[inline]
    fn add_at(&self, rows: &mut GroupRows<'_>, slot: usize, k: usize, by: [f64; 2]) {
        let (to, start) = match self.slots[slot].first {
            Some(first) => (&mut *rows.shared, first),
            None => (&mut *rows.retained, 0),
        };
        let width = to.len() / 2;
        (0..2).for_each(|row| to[width * row + start + k] += by[row]);
    }

    /// Allocates equations of pose, point and camera for `count` images.
    fn with_plain(&self, count: usize, take: impl FnOnce(&mut GroupRows<'_>)) {
        let beside = self.poses + self.all - self.camera;
        let ends = [1, 3, self.main, beside].map(|width| 2 * count * width);
        let mut room: SmallVec<[f64; 64]> = smallvec![0.0; ends.iter().sum()];
        let (constant, rest) = room.split_at_mut(ends[0]);
        let (local, rest) = rest.split_at_mut(ends[1]);
        let (retained, shared) = rest.split_at_mut(ends[2]);
        take(&mut GroupRows { constant, local, retained, shared });
    }

    /// Copies the equations of pose, point and camera to their columns, multiplied by `by`; all others are zero.
    fn spread(&self, plain: &GroupRows<'_>, by: &Matrix2, rows: &mut GroupRows<'_>) {
        let beside = plain.shared.len() / 2;
        lead(by, (&*plain.local, 0..3), (&mut *rows.local, 0));
        rows.retained.fill(0.0);
        lead(by, (&*plain.retained, 0..self.main), (&mut *rows.retained, 0));
        rows.shared.fill(0.0);
        lead(by, (&*plain.shared, 0..self.poses), (&mut *rows.shared, 0));
        lead(by, (&*plain.shared, self.poses..beside), (&mut *rows.shared, self.camera));
    }
}

/// Multiplies two rows of columns by a matrix and writes them from column `first` on.
#[inline(always)]
fn lead(by: &Matrix2, (from, columns): (&[f64], Range<usize>), (to, first): (&mut [f64], usize)) {
    let ((x, y), width) = (from.split_at(from.len() / 2), to.len() / 2);
    let (to_x, to_y) = to.split_at_mut(width);
    let sources = x[columns.clone()].iter().zip(&y[columns]);
    for ((x, y), (to_x, to_y)) in sources.zip(to_x[first..].iter_mut().zip(&mut to_y[first..])) {
        (*to_x, *to_y) = (by[0][0] * x + by[0][1] * y, by[1][0] * x + by[1][1] * y);
    }
}

impl Bundle {
    /// Returns the shared parameters of the corrections of an image.
    fn correction_commons(&self, image: usize) -> ImageCommons {
        let photo = self.images[image].photo;
        let columns = splined(&self.cameras[photo]).map_or(0, SplinedStereographic::columns);
        self.image_corrections.commons((image, photo, self.point_of(image)), columns)
    }

    /// Determines the active knots of all images at given parameter values, and counts the images that depend on each shared parameter.
    pub(super) fn activate_knots(&mut self, unknowns: &[f64]) {
        if !self.image_corrections.lenses().is_empty() {
            let windows = self.of_seen(unknowns, |own, u| own.window(u, MARGIN));
            self.image_corrections.open(windows);
        }
        if self.image_corrections.is_empty() {
            return;
        }
        // Number of images with equal corrections by photo, and one of them.
        let mut uniform = vec![(0, 0); self.cameras.len()];
        let mut individual = vec![];
        for (index, image) in self.images.iter().enumerate() {
            if self.has_uniform_corrections(image.photo) {
                uniform[image.photo] = (uniform[image.photo].0 + 1, index);
            } else {
                individual.push((1, index));
            }
        }
        for (count, image) in uniform.into_iter().chain(individual).filter(|&(count, _)| count > 0) {
            self.correction_commons(image).into_iter().for_each(|common| self.commons[common].uses += count);
        }
    }

    /// Returns true if all images of a photo have the same retained blocks, independent of point and position.
    pub(super) fn has_uniform_corrections(&self, photo: usize) -> bool {
        let cells = || self.image_corrections.film(photo).is_some_and(FilmOf::has_cells);
        let difference = || {
            self.image_corrections.have_figures() || self.image_corrections.lens(photo).is_some() || cells()
        };
        !self.mounts.are_timed(photo) && (self.image_corrections.is_empty() || !difference())
    }

    /// Returns the number of images whose knots are outside their active knots.
    pub(super) fn images_beyond_knots(&self, unknowns: &[f64]) -> usize {
        if self.image_corrections.lenses().is_empty() {
            return 0;
        }
        let patches = self.of_seen(unknowns, |own, u| own.patch(u));
        let is_beyond = |&(image, patch): &(usize, &Option<_>)| {
            let window = self.image_corrections.window(image);
            patch.as_ref().is_some_and(|patch| window.is_none_or(|window| !window.has(patch)))
        };
        patches.iter().enumerate().filter(is_beyond).count()
    }

    /// Evaluates `take` for each image with a spline lens, given its camera and the point in camera axes.
    fn of_seen<T: Send>(
        &self,
        unknowns: &[f64],
        take: impl Fn(&SplinedStereographic, &Vector3) -> Option<T> + Sync,
    ) -> Vec<Option<T>> {
        let linearization = self.evaluated(unknowns);
        let of_point = |point: usize| {
            let images = self.point_images.start[point]..self.point_images.start[point + 1];
            let of_image = |image: usize| {
                let photo = self.images[image].photo;
                self.image_corrections.lens(photo)?;
                let camera = splined(&linearization.photos[photo].camera)?;
                take(camera, &self.corrected_sight(&linearization, image, point))
            };
            images.map(of_image).collect::<Vec<_>>()
        };
        parallel::map(self.points.len(), 64, of_point).into_iter().flatten().collect()
    }

    /// Returns the distinct retained blocks of the corrections of an image, without the main one.
    pub(super) fn blocks_of_image_corrections(&self, image: usize) -> SmallVec<[usize; 32]> {
        let mut blocks = SmallVec::new();
        if self.image_corrections.is_empty() {
            return blocks;
        }
        let main = self.main_block(image);
        for common in self.correction_commons(image) {
            if let Some(place) = self.blocks.of_common[common]
                && place.block != main
                && !blocks.contains(&place.block)
            {
                blocks.push(place.block);
            }
        }
        blocks
    }

    /// Returns the column layout of an image with `all` shared columns.
    fn columns(&self, image: usize, all: usize) -> ImageColumns {
        let (photo, block) = (self.images[image].photo, self.main_block(image));
        let mut slots: SmallVec<[ColumnRange; 32]> = smallvec![ColumnRange { block, first: None }];
        let mut place = |blocks: &mut dyn Iterator<Item = usize>, mut first: usize| {
            for block in blocks {
                slots.push(ColumnRange { block, first: Some(first) });
                first += self.of_block(block).len();
            }
            first
        };
        let poses = place(&mut self.blocks_of_pose(photo, self.time_of(image)).skip(1), 0);
        let camera = place(&mut self.blocks_of_image_corrections(image).into_iter(), poses);
        let main = if block == photo { self.of_photo(photo) } else { self.of_block(block) }.len();
        ImageColumns { slots, main, poses, camera, all }
    }

    /// Writes the equations of an image with corrections into `rows`. It is not inlined, so that plain images do not pay for it; `own` is
    /// reused storage for the pose.
    #[inline(never)]
    pub(super) fn write_corrected(
        &self,
        linearization: &LinearizationPoint,
        group: usize,
        local: usize,
        rows: &mut GroupRows<'_>,
        own: &mut Composed,
    ) {
        if self.image_corrections.is_empty() {
            let timed = self.compose_timed(linearization, group, own);
            return linearization.write(self.space, timed.then_some(&*own), &self.images[group], local, rows);
        }
        // With corrections, the equations follow from those of pose, point and camera.
        let columns = self.columns(group, rows.shared.len() / 2);
        columns.with_plain(1, |plain| {
            let timed = self.compose_timed(linearization, group, own).then_some(&*own);
            linearization.write(self.space, timed, &self.images[group], local, plain);
            self.pass(linearization, (group, local), &columns, plain, rows, &mut Read::default());
        });
    }

    /// Writes the equations of images of one photo with equal blocks in one batch; returns false if this is impossible.
    pub(super) fn write_corrected_batch(
        &self,
        linearization: &LinearizationPoint,
        locals: &[u32],
        groups: &[u32],
        rows: &mut GroupRows<'_>,
    ) -> bool {
        let (first, count) = (groups[0] as usize, groups.len());
        if self.image_corrections.is_empty() || linearization.mounted.is_some() || count < FEWEST {
            return false;
        }
        let columns = self.columns(first, rows.shared.len() / (2 * count));
        columns.with_plain(count, |plain| {
            if !self.linearize_plain_simd(linearization, locals, groups, plain) {
                for (t, (&local, &group)) in locals.iter().zip(groups).enumerate() {
                    let image = &self.images[group as usize];
                    linearization.write(self.space, None, image, local as usize, &mut plain.part(t, count));
                }
            }
            let mut read = Read::default();
            for (t, (&local, &group)) in locals.iter().zip(groups).enumerate() {
                let (image, own) = ((group as usize, local as usize), &mut rows.part(t, count));
                self.pass(linearization, image, &columns, &plain.part(t, count), own, &mut read);
            }
        });
        true
    }

    /// Writes the equations of pose, point and camera of images of one photo by SIMD; returns false if this is impossible.
    fn linearize_plain_simd(
        &self,
        linearization: &LinearizationPoint,
        locals: &[u32],
        groups: &[u32],
        plain: &mut GroupRows<'_>,
    ) -> bool {
        let photo = self.images[groups[0] as usize].photo;
        let PhotoState { orientation, camera } = &linearization.photos[photo];
        let scanned = linearization.film(photo).is_some();
        let to_camera_frame = |t: usize| {
            let image = if scanned { &NOWHERE } else { &self.images[groups[t] as usize] };
            ImageObservation { point: &linearization.points[locals[t] as usize], image, sd: [1.0; 2] }
        };
        linearization.refracted.is_none()
            && each_camera!(camera, camera => {
                (!scanned || is_forward(camera))
                    && linearize_simd(orientation, camera, groups.len(), &to_camera_frame, plain)
            })
    }

    /// Writes the equations of an image, given the equations of pose, point and camera.
    fn pass(
        &self,
        linearization: &LinearizationPoint,
        (group, local): (usize, usize),
        columns: &ImageColumns,
        plain: &GroupRows<'_>,
        rows: &mut GroupRows<'_>,
        read: &mut Read,
    ) {
        let photo = self.images[group].photo;
        let (Some(film), Some(at)) = (self.image_corrections.film(photo), linearization.film(photo)) else {
            columns.spread(plain, &UNIT, rows);
            rows.constant.copy_from_slice(plain.constant);
            self.add_figure_partials(local, columns, rows);
            return self.add_knot_partials(linearization, group, local, columns, rows);
        };
        let cell = self.image_corrections.cell(group);
        at.read([-plain.constant[0], -plain.constant[1]], cell, read);
        columns.spread(plain, &read.reading.by_q, rows);
        (0..2).for_each(|k| rows.constant[k] = self.images[group].xy[k] - read.reading.xy[k]);
        self.add_figure_partials(local, columns, rows);
        let commons = film.commons(cell);
        film.partials(read, |slot, by| {
            let common = commons[slot].0;
            let Some(place) = self.blocks.of_common[common] else { return };
            for (k, &(_, component, _)) in self.commons[common].kind.unknowns().iter().enumerate() {
                columns.add(rows, place, k, [by[(0, component)], by[(1, component)]]);
            }
        });
    }

    /// Determines the pattern cells of all images at the given values.
    pub(super) fn assign_cells(&mut self) {
        let grid = |photo| self.image_corrections.film(photo).is_some_and(FilmOf::has_cells);
        if !(0..self.cameras.len()).any(grid) {
            return;
        }
        let given: Vec<CommonState> =
            self.commons.iter().map(|own| own.at(&vec![0.0; own.kind.unknowns().len()])).collect();
        let films = self.image_corrections.films(&given);
        let cell =
            |image: &Image| films[image.photo].as_ref().map_or(0, |film| film.cell_of_reading(image.xy));
        self.image_corrections.cells = self.images.iter().map(cell).collect();
    }

    /// Adds the partials by the knots of a lens.
    fn add_knot_partials(
        &self,
        linearization: &LinearizationPoint,
        group: usize,
        local: usize,
        columns: &ImageColumns,
        rows: &mut GroupRows<'_>,
    ) {
        let photo = self.images[group].photo;
        let (lens, camera) =
            (self.image_corrections.lens(photo), splined(&linearization.photos[photo].camera));
        let (Some(lens), Some(camera)) = (lens, camera) else { return };
        let Some(patch) = camera.patch(&self.corrected_sight(linearization, group, local)) else { return };
        let [fx, fy, ..] = camera.parameters();
        let mut last = 0;
        for (knot, weight) in patch.knots(camera.columns()) {
            let place = self.blocks.of_common[self.image_corrections.lenses()[lens].commons[knot]];
            if let Some((InBlock { first, .. }, slot)) =
                place.and_then(|place| Some((place, columns.slot(place.block, last)?)))
            {
                columns.add_at(rows, slot, first, [fx * weight, 0.0]);
                columns.add_at(rows, slot, first + 1, [0.0, fy * weight]);
                last = slot;
            }
        }
    }

    /// Adds the partials by the parameters of a figure: the partials by the point times its displacement vectors.
    fn add_figure_partials(&self, local: usize, columns: &ImageColumns, rows: &mut GroupRows<'_>) {
        let Some((figure, k)) = self.image_corrections.figure(local) else { return };
        let Some(place) = self.blocks.of_common[figure.common] else { return };
        let by_point: [f64; 2 * 3] = std::array::from_fn(|i| rows.local[i]);
        for (number, shift) in figure.shifts[k].column_iter().enumerate() {
            let by = |row: usize| (0..3).map(|i| by_point[3 * row + i] * shift[i]).sum();
            columns.add(rows, place, number, [by(0), by(1)]);
        }
    }

    /// Returns coordinates and cofactors of a point that a figure displaces; None for others. `unknowns` contains the parameters of
    /// [`Bundle::parameter_unknowns`].
    pub(super) fn shifted(
        &self,
        point: usize,
        unknowns: &[f64],
        cofactors: Option<&Cofactors>,
    ) -> Option<([f64; 3], Matrix3)> {
        let (figure, k) = self.image_corrections.figure(point)?;
        let (given, shifts) = (self.points[point].coordinates, figure.shifts[k]);
        let shift = figure.shift(k, &self.common_state(figure.common, unknowns).vector());
        let own = cofactors.map(|all| self.cofactors_of_common(all, figure.common));
        let found = match own {
            None => Matrix3::repeat(f64::NAN),
            // Fixed parameters of the figure.
            Some(own) if own.is_empty() => Matrix3::zeros(),
            Some(own) => shifts * own.fixed_view::<2, 2>(0, 0) * shifts.transpose(),
        };
        Some((std::array::from_fn(|i| given[i] + shift[i]), found))
    }
}

/// Returns true if a camera projects without a measured image.
fn is_forward<C: CameraModel>(_: &C) -> bool {
    C::LENS == LensDirection::Forward
}

/// Returns a camera with a spline; None for others.
fn splined(camera: &Camera) -> Option<&SplinedStereographic> {
    match camera {
        Camera::SplinedStereographic(own) => Some(own),
        _ => None,
    }
}
