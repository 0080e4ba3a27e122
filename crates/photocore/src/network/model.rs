//! Observation equations of a network.

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use nalgebra::DMatrix;

use super::blocks::Blocks;
use super::camera_priors::CameraPrior;
use super::commons::{CartesianCommon, CommonState, InBlock};
use super::image_corrections::ImageCorrections;
use super::input::{Image, Minimum, Point, Screens};
use super::linearization_point::{LinearizationPoint, PhotoState, Refracted};
use super::mounts::{AT_PHOTO, Mounts};
use super::neighbourhood::ByPoint;
use super::observations::{
    AssembledObservation, CommonSite, LOCAL, Linear, ModelValues, PhotoSite, PointSite, Touches,
};
use crate::geometry::{
    self, AttitudeNumbers, Camera, ObjectSpace, Orientation, POSE, PoseNumbers, Refraction, RotationSense,
    Vector3, Vertical,
};
use crate::normals::{Cofactors, GroupRows, Term};
use crate::parallel;

/// Model of a network. Local blocks are the points that no observation connects with other objects. Retained blocks are, in this order,
/// photos (pose and own free camera), shared cameras, shared parameters, and all other points. Image observations of these points and
/// additional observations are the terms, in this order; an observation of a local point alone is a term of its local block.
#[derive(Debug)]
pub struct Bundle {
    pub space: ObjectSpace,
    pub poses: PoseNumbers,
    /// None if images are free of refraction.
    pub refraction: Option<Refraction>,
    /// Camera of each photo with initial values.
    pub cameras: Vec<Camera>,
    /// Positions of the parameters of photos, shared cameras and shared parameters.
    pub blocks: Blocks,
    /// Observed camera parameters with a covariance matrix.
    pub camera_priors: Vec<CameraPrior>,
    pub commons: Vec<CartesianCommon>,
    /// Relations of photos to rig frames and trajectories.
    pub mounts: Mounts,
    /// Number of each image on the time scale of its photo; empty if all are zero.
    pub image_times: Vec<f64>,
    /// Corrections of images after the projection.
    pub image_corrections: ImageCorrections,
    /// Origin of the coordinates.
    pub origin: [f64; 3],
    /// Points, local ones first; coordinates are relative to the origin.
    pub points: Vec<Point>,
    /// Number of local points.
    pub locals: usize,
    /// Image observations, sorted by point: first the groups of local points, then terms.
    pub images: Vec<Image>,
    /// Range of the images of each point, and their indices in the network.
    pub point_images: ByPoint,
    /// Number of images of each photo.
    pub images_on: Vec<usize>,
    /// Photos with steps by a rotation vector about their own axes: those without a fixed angle.
    pub turning: Vec<bool>,
    /// Additional observations, last those of single local points.
    pub observations: Vec<AssembledObservation>,
    /// Equations of these last observations in rectangular space, if they are computed.
    pub linear: Vec<Linear>,
    /// Datum information of the network and the user.
    pub datum: GivenDatum,
    pub screens: Screens,
    /// Connected components, computed at first use from all fields above.
    pub parts: OnceLock<Components>,
}

/// Photos connected by points and observations; a shared camera does not connect them.
#[derive(Debug)]
pub(super) struct Component {
    pub photos: Vec<usize>,
    /// Photo of the preferred datum: chosen by the user or by fixed positions, else the one with most images.
    pub central: usize,
}

/// Components of a network that contain images, the largest first, and the component of each photo, point and shared parameter.
#[derive(Debug)]
pub(super) struct Components {
    pub all: Vec<Component>,
    pub of_photo: Vec<Option<usize>>,
    pub of_point: Vec<Option<usize>>,
    pub of_common: Vec<Option<usize>>,
}

/// Number of datum parameters: translations, rotations about Cartesian axes, and scale.
pub(super) const MOTIONS: usize = 7;

/// Maximum number of components with a datum: a network with more of them is assumed to be a mistake.
pub(super) const MOST_PARTS: usize = 8;

/// Datum information that is available before any computation.
#[derive(Debug)]
pub struct GivenDatum {
    /// Whether the datum is given: any position is weighted, or positions of several photos are fixed.
    pub placed: bool,
    /// The only photo with a fixed position, if no other position is given: it is the origin chosen by the user.
    pub anchor: Option<usize>,
    /// The user's datum, in force if no other information defines one.
    pub minimum: Option<Minimum>,
}

/// Owner of a retained block: indices into the network.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Owner {
    Photo(usize),
    Camera(usize),
    Common(usize),
}

impl Owner {
    /// Returns the index of the owner if it is this variant.
    pub fn index(self, of: fn(usize) -> Self) -> Option<usize> {
        let (Self::Photo(own) | Self::Camera(own) | Self::Common(own)) = self;
        (of(own) == self).then_some(own)
    }
}

impl Bundle {
    /// Returns the range of parameters of photos, shared cameras and shared parameters among all.
    pub fn parameter_unknowns(&self) -> Range<usize> {
        let start = 3 * self.locals;
        start..start + self.blocks.first[self.parameter_blocks()]
    }

    /// Returns the number of blocks of photos, shared cameras and shared parameters: the first retained blocks.
    pub fn parameter_blocks(&self) -> usize {
        self.blocks.first.len() - 1
    }

    /// Returns the range of parameters of a photo, shared camera or shared parameter among all.
    pub fn of_block(&self, block: usize) -> Range<usize> {
        let start = 3 * self.locals;
        start + self.blocks.first[block]..start + self.blocks.first[block + 1]
    }

    /// Returns the range of parameters of a photo among all: its pose and its own free camera, the first of its block.
    pub fn of_photo(&self, photo: usize) -> Range<usize> {
        let all = self.of_block(photo);
        let beside = self.blocks.commons_of(photo).first().and_then(|&common| self.of_common(common));
        all.start..beside.map_or(all.end, |beside| beside.start)
    }

    /// Returns true if a photo has a camera with free parameters that no other photo shares.
    pub fn has_own_camera(&self, photo: usize) -> bool {
        self.of_photo(photo).len() > POSE
    }

    /// Returns the range of coordinates of a point among all parameters.
    pub fn of_point(&self, point: usize) -> Range<usize> {
        let start = if point < self.locals { 0 } else { self.parameter_unknowns().len() };
        start + 3 * point..start + 3 * point + 3
    }

    /// Returns the coordinates of all points, relative to the origin, at given parameter values.
    pub fn coordinates<'a>(&self, unknowns: &'a [f64]) -> impl Iterator<Item = &'a [f64; 3]> + use<'a> {
        let (local, retained) = self.all_coordinates(unknowns);
        local.iter().chain(retained)
    }

    /// Returns the coordinates of local points, and of all others.
    pub fn all_coordinates<'a>(&self, unknowns: &'a [f64]) -> (&'a [[f64; 3]], &'a [[f64; 3]]) {
        let photos = self.parameter_unknowns();
        (unknowns[..photos.start].as_chunks().0, unknowns[photos.end..].as_chunks().0)
    }

    /// Returns the terms: images of points that are not local, then additional observations.
    pub fn terms(&self) -> Vec<Term> {
        let images = (self.point_images.start[self.locals]..self.images.len()).map(|image| {
            let point = self.point_of(image);
            let others = self.blocks_of_image(image);
            let blocks = std::iter::once(self.block_of_point(point)).chain(others);
            Term { rows: 2, local: None, retained: blocks.map(|block| block as u32).collect() }
        });
        let observations = self.observations.iter().map(|active| {
            let (rows, local) = (active.root.nrows(), active.local().map(|point| point as u32));
            let retained = active.blocks.iter().filter(|_| local.is_none()).map(|&block| block as u32);
            Term { rows, local, retained: retained.collect() }
        });
        images.chain(observations).collect()
    }

    /// Returns the retained block of a point; [`LOCAL`] for a local one.
    fn block_of_point(&self, point: usize) -> usize {
        point.checked_sub(self.locals).map_or(LOCAL, |index| self.parameter_blocks() + index)
    }

    /// Returns the number of parameters of a retained block.
    fn width(&self, block: usize) -> usize {
        if block < self.parameter_blocks() { self.of_block(block).len() } else { 3 }
    }

    /// Returns the retained blocks of an image: blocks of its pose (main block first), of its corrections, and its shared camera.
    pub fn blocks_of_image(&self, image: usize) -> impl Iterator<Item = usize> {
        let photo = self.images[image].photo;
        let passed = self.blocks_of_image_corrections(image);
        self.blocks_of_pose(photo, self.time_of(image)).chain(passed).chain(self.blocks.of_camera[photo])
    }

    /// Returns the number of an image on the time scale of its photo.
    #[inline]
    pub fn time_of(&self, image: usize) -> f64 {
        self.image_times.get(image).copied().unwrap_or(AT_PHOTO)
    }

    /// Returns the main block of an image.
    pub fn main_block(&self, image: usize) -> usize {
        let photo = self.images[image].photo;
        if self.mounts.is_empty() { photo } else { self.main_block_of_pose(photo) }
    }

    /// Returns the distinct retained blocks of an observation, sorted; points are numbered as in the model.
    pub fn blocks_of(&self, touches: &Touches) -> Vec<usize> {
        let points = touches.points.iter().map(|&point| self.block_of_point(point));
        let photos = touches.photos.iter().flat_map(|&photo| self.blocks_of_pose(photo, AT_PHOTO));
        let commons =
            touches.commons.iter().filter_map(|&(common, _)| Some(self.blocks.of_common[common]?.block));
        let mut blocks: Vec<usize> = points.chain(photos).chain(commons).collect();
        blocks.sort_unstable();
        blocks.dedup();
        blocks
    }

    /// Returns the number of terms that are image observations.
    pub fn image_terms(&self) -> usize {
        self.images.len() - self.point_images.start[self.locals]
    }

    pub(super) fn point_of(&self, image: usize) -> usize {
        self.point_images.start.partition_point(|&start| start <= image) - 1
    }

    /// Writes the equations of an image observation of a point that is not local.
    pub(super) fn observe_image_term(
        &self,
        linearization: &LinearizationPoint,
        image: usize,
        rows: &mut GroupRows<'_>,
    ) {
        let all = rows.shared.len() / 2;
        let width = self.of_block(self.main_block(image)).len();
        let shared = all - 3 - width;
        let (mut local, mut retained, mut common) = ([0.0; 6], vec![0.0; 2 * width], vec![0.0; 2 * shared]);
        let constant = &mut *rows.constant;
        let mut difference =
            GroupRows { constant, local: &mut local, retained: &mut retained, shared: &mut common };
        self.observe(linearization, self.point_of(image), image, &mut difference);
        for (row, together) in rows.shared.chunks_exact_mut(all).enumerate() {
            together[..3].copy_from_slice(&local[3 * row..][..3]);
            together[3..3 + width].copy_from_slice(&retained[width * row..][..width]);
            together[3 + width..].copy_from_slice(&common[shared * row..][..shared]);
        }
    }

    /// Calls `take` with the model of additional observations at the linearization point.
    pub(super) fn with_model_values<T>(
        &self,
        linearization: &LinearizationPoint,
        take: impl FnOnce(&ModelValues<'_>) -> T,
    ) -> T {
        let point = |point: usize| PointSite {
            point: linearization.points[point],
            coordinates: linearization.coordinates[point],
            block: self.block_of_point(point),
        };
        let mounted = linearization.mounted.as_ref();
        let photo = |photo: usize| match mounted.and_then(|mounted| mounted.of(photo)) {
            None => PhotoSite {
                orientation: &linearization.photos[photo].orientation,
                block: photo,
                made_of: None,
            },
            Some(own) => {
                let block = self.main_block_of_pose(photo);
                PhotoSite { orientation: &own.orientation, block, made_of: Some(own) }
            }
        };
        let common = |common: usize| CommonSite {
            state: &linearization.commons[common],
            place: self.blocks.of_common[common],
        };
        let moving =
            |photo: usize| self.moving(linearization.mounted.as_ref()?, &linearization.commons, photo);
        take(&ModelValues {
            space: self.space,
            origin: self.origin,
            moving: &moving,
            point: &point,
            photo: &photo,
            common: &common,
            width: &|block| self.width(block),
        })
    }

    /// Returns photos and shared parameters, without points, at given values of the parameters of [`Bundle::parameter_unknowns`].
    pub fn without_points(&self, unknowns: &[f64]) -> LinearizationPoint {
        let commons = self.common_states(unknowns);
        let lenses = self.image_corrections.lenses().iter().map(|own| own.commons.iter());
        let knots: Vec<Arc<[[f64; 2]]>> =
            lenses.map(|own| own.map(|&knot| commons[knot].vector().xy().into()).collect()).collect();
        let photo = |photo: usize| {
            let (pose, camera) =
                unknowns[self.blocks.first[photo]..][..self.of_photo(photo).len()].split_at(POSE);
            let pose = std::array::from_fn(|k| pose[k]);
            let shared = self.blocks.of_camera[photo]
                .map(|block| self.blocks.first[block]..self.blocks.first[block + 1]);
            let (own, camera) = (&self.cameras[photo], shared.map_or(camera, |range| &unknowns[range]));
            let camera = own.with_parameters(camera).unwrap_or_else(|| own.clone());
            let lens =
                self.image_corrections.lens(photo).and_then(|lens| camera.with_knots(knots[lens].clone()));
            PhotoState { orientation: self.orientation(photo, &pose), camera: lens.unwrap_or(camera) }
        };
        let mut photos: Vec<PhotoState> = (0..self.cameras.len()).map(photo).collect();
        let mounted = self.mount_all(&mut photos, &commons);
        let films = self.image_corrections.films(&commons);
        let plain = self.refraction.is_none() && mounted.is_none() && self.image_corrections.is_empty();
        LinearizationPoint {
            photos,
            commons,
            mounted,
            films,
            refracted: None,
            points: vec![],
            coordinates: vec![],
            plain,
        }
    }

    pub fn photos(&self, unknowns: &[f64]) -> Vec<PhotoState> {
        self.without_points(unknowns).photos
    }

    pub fn common_states(&self, unknowns: &[f64]) -> Vec<CommonState> {
        (0..self.commons.len()).map(|common| self.common_state(common, unknowns)).collect()
    }

    pub fn common_state(&self, common: usize, unknowns: &[f64]) -> CommonState {
        let start = 3 * self.locals;
        let own = self.of_common(common).map_or(0..0, |own| own.start - start..own.end - start);
        self.commons[common].at(&unknowns[own])
    }

    /// Returns the range of a shared parameter among all; None if it is fixed.
    pub fn of_common(&self, common: usize) -> Option<Range<usize>> {
        let InBlock { block, first, .. } = self.blocks.of_common[common]?;
        let start = self.of_block(block).start + first;
        Some(start..start + self.commons[common].kind.unknowns().len())
    }

    /// Returns the owners of a retained block, each with the range of its parameters among all.
    pub fn owners(&self, block: usize) -> Vec<(Owner, Range<usize>)> {
        let photos = self.cameras.len();
        let first = match self.blocks.shared.get(block.wrapping_sub(photos)) {
            _ if block < photos => Some((Owner::Photo(block), self.of_photo(block))),
            camera => camera.map(|&camera| (Owner::Camera(camera), self.of_block(block))),
        };
        let commons = self.blocks.commons_of(block).iter();
        let commons = commons.filter_map(|&common| Some((Owner::Common(common), self.of_common(common)?)));
        first.into_iter().chain(commons).collect()
    }

    /// Returns the owner of one of these parameters and its number there; None for points.
    pub fn owner(&self, unknown: usize) -> Option<(Owner, usize)> {
        let all = self.parameter_unknowns();
        let retained = all.contains(&unknown).then(|| unknown - all.start)?;
        let block = self.blocks.first.partition_point(|&start| start <= retained) - 1;
        let own = self.owners(block).into_iter().find(|(_, range)| range.contains(&unknown));
        own.map(|(owner, range)| (owner, unknown - range.start))
    }

    pub fn cofactors_of_block<'a>(&self, all: &'a Cofactors, block: usize) -> &'a [f64] {
        &all.retained[self.blocks.squares[block]..self.blocks.squares[block + 1]]
    }

    /// Returns the cofactors of a shared parameter; empty if it is fixed.
    pub fn cofactors_of_common(&self, all: &Cofactors, common: usize) -> DMatrix<f64> {
        self.cofactors_in_block(all, common, common)
    }

    /// Returns the cofactors of a shared parameter with another one of its block; empty if one is fixed.
    pub fn cofactors_in_block(&self, all: &Cofactors, common: usize, other: usize) -> DMatrix<f64> {
        let (Some(own), Some(to)) = (self.blocks.of_common[common], self.blocks.of_common[other]) else {
            return DMatrix::zeros(0, 0);
        };
        let square = self.cofactors_of_block(all, own.block);
        let [rows, columns] = [common, other].map(|own| self.commons[own].kind.unknowns().len());
        DMatrix::from_fn(rows, columns, |i, j| square[own.width * (own.first + i) + to.first + j])
    }

    /// Returns the preceding shared parameter of the same block.
    pub fn former_in_block(&self, common: usize) -> Option<usize> {
        let InBlock { block, .. } = self.blocks.of_common[common]?;
        let own = self.blocks.commons_of(block);
        let place = own.iter().position(|&other| other == common)?;
        Some(own[place.checked_sub(1)?])
    }

    /// Returns the orientation of a photo at a given pose, with the partials by its parameters.
    pub fn orientation(&self, photo: usize, pose: &[f64; POSE]) -> Orientation {
        let [x, y, z, omega, phi, kappa] = *pose;
        match self.rotation_vector_sense(photo) {
            Some(sense) => {
                let local = AttitudeNumbers::OmegaPhiKappa(sense).attitude([omega, phi, kappa]);
                Orientation::stepping(self.space, [x, y, z], &local)
            }
            None => Orientation::new(self.poses, self.space, pose),
        }
    }

    /// Returns the verticals at the photos; `unknowns` contains the parameters of [`Bundle::parameter_unknowns`].
    fn verticals_at_photos(
        &self,
        refraction: &Refraction,
        unknowns: &[f64],
        photos: &[PhotoState],
    ) -> Vec<Vertical> {
        let place = |(photo, station): (usize, &PhotoState)| {
            if self.is_carried(photo) {
                self.space.coordinates(station.orientation.centre())
            } else {
                std::array::from_fn(|k| unknowns[self.blocks.first[photo] + k])
            }
        };
        let places = photos.iter().enumerate().map(place);
        places.map(|place: [f64; 3]| refraction.vertical(self.space, place)).collect()
    }

    /// Returns the sense of the angles of a photo that steps by a rotation vector; None for all others.
    pub fn rotation_vector_sense(&self, photo: usize) -> Option<RotationSense> {
        match self.poses {
            PoseNumbers::Angles(sense) if self.turning[photo] => Some(sense),
            PoseNumbers::Angles(_) | PoseNumbers::Vectors => None,
        }
    }

    pub fn images_of(&self, point: usize) -> &[Image] {
        &self.images[self.point_images.start[point]..self.point_images.start[point + 1]]
    }
}

impl Bundle {
    /// Evaluates photos, points and shared parameters at given parameter values.
    pub fn evaluated(&self, unknowns: &[f64]) -> LinearizationPoint {
        let photos = &unknowns[self.parameter_unknowns()];
        let (local, retained) = self.all_coordinates(unknowns);
        let mut linearization = self.without_points(photos);
        linearization.refracted = self.refraction.map(|refraction| Refracted {
            refraction,
            at_photos: self.verticals_at_photos(&refraction, photos, &linearization.photos),
            at_points: verticals(&refraction, self.space, local.iter().chain(retained)),
        });
        let place = |&coordinates: &[f64; 3]| geometry::Point::new(self.space, coordinates);
        linearization.points = if self.image_corrections.have_figures() {
            let commons = &linearization.commons;
            let shift = |point| self.image_corrections.shift(point, |common| commons[common].vector());
            let shifted = |point| place(&(Vector3::from(local[point]) + shift(point)).into());
            parallel::map_in_place(local.len(), 1024, &shifted)
        } else {
            parallel::map_in_place(local.len(), 1024, &|point| place(&local[point]))
        };
        linearization.points.extend(retained.iter().map(place));
        linearization.coordinates =
            if self.observations.is_empty() { vec![] } else { [local, retained].concat() };
        linearization
    }
}

/// Returns the verticals at positions.
fn verticals<'a>(
    refraction: &Refraction,
    space: ObjectSpace,
    positions: impl Iterator<Item = &'a [f64; 3]>,
) -> Vec<Vertical> {
    positions.map(|&position| refraction.vertical(space, position)).collect()
}
