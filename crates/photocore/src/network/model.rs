//! The observation equations of a network.

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use nalgebra::DMatrix;

use super::blocks::Blocks;
use super::camera_priors::CameraPrior;
use super::commons::{CommonState, PlacedCommon};
use super::in_block::InBlock;
use super::mounts::{AT_PHOTO, Mounts};
use super::observations::{CommonSite, PhotoSite, PointSite, TiedModel, TiedObservation, Touches};
use super::parts::Parts;
use super::passages::Passages;
use super::selection::PointImages;
use super::stations::{Bent, Placed, Refracted, Station, Stations};
use super::{Image, Minimum, Point, Screens};
use crate::geometry::{
    self, AttitudeNumbers, Camera, ObjectSpace, Orientation, POSE, PoseNumbers, Refraction, RotationSense,
    Vector3, Vertical,
};
use crate::normals::{Cofactors, GroupRows, Tie, TieRows};
use crate::parallel;

/// Images of points by photos, and other observations of these: the local blocks are the points that no such observation touches, the
/// retained blocks the photos with their pose and, unless it is held or shared, their camera, then the cameras that several photos share,
/// then common unknowns, then all other points. The images of these are ties, and so are the observations, in this order.
#[derive(Debug)]
pub struct Bundle {
    pub space: ObjectSpace,
    pub poses: PoseNumbers,
    /// None where images are free of refraction.
    pub refraction: Option<Refraction>,
    /// Of each photo, with the parameters that it starts from.
    pub cameras: Vec<Camera>,
    /// Where the unknowns of photos, shared cameras and common unknowns are.
    pub blocks: Blocks,
    /// What was observed of cameras with a covariance matrix.
    pub camera_priors: Vec<CameraPrior>,
    /// The common unknowns.
    pub commons: Vec<PlacedCommon>,
    /// Which photos are on a frame, or on a trajectory.
    pub mounts: Mounts,
    /// The number of each image on the scale of its photo's time; none at all where all are zero.
    pub image_times: Vec<f64>,
    /// What images pass beside pose, point and camera.
    pub passages: Passages,
    /// What coordinates are counted from.
    pub origin: [f64; 3],
    /// The points, local ones first; coordinates counted from the origin.
    pub points: Vec<Point>,
    /// How many of them are local.
    pub locals: usize,
    /// The images, point by point: the groups of observations, then the first ties.
    pub images: Vec<Image>,
    /// Which of them are of each point, and their indices in the network.
    pub point_images: PointImages,
    /// How many images each photo has.
    pub images_on: Vec<usize>,
    /// Which photos step by a rotation vector about their own axes: those without a fixed angle.
    pub turning: Vec<bool>,
    /// What else was observed.
    pub observations: Vec<TiedObservation>,
    /// What network and user say of the datum.
    pub datum: GivenDatum,
    /// What may leave while it is adjusted.
    pub screens: Screens,
    /// What hangs together, once it was asked for: it depends on all above.
    pub parts: OnceLock<Parts>,
}

/// What is known of the datum before anything is computed.
#[derive(Debug)]
pub struct GivenDatum {
    /// Whether the position of anything is weighted, or of more than one photo fixed: then the datum is the user's.
    pub placed: bool,
    /// The only photo whose position is fixed, where nothing else is placed: the user has chosen what to hold.
    pub anchor: Option<usize>,
    /// What the user wants to be held where nothing else gives a datum.
    pub minimum: Option<Minimum>,
}

/// What a retained block belongs to: indices into the network.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Owner {
    Photo(usize),
    Camera(usize),
    Common(usize),
}

impl Bundle {
    /// The unknowns that are those of photos, shared cameras and common unknowns, of all.
    pub fn of_stations(&self) -> Range<usize> {
        let start = 3 * self.locals;
        start..start + self.blocks.first[self.stations()]
    }

    /// Number of photos, shared cameras and common unknowns: the first retained blocks.
    pub fn stations(&self) -> usize {
        self.blocks.first.len() - 1
    }

    /// The unknowns of a photo, shared camera or common unknown, of all.
    pub fn of_block(&self, block: usize) -> Range<usize> {
        let start = 3 * self.locals;
        start + self.blocks.first[block]..start + self.blocks.first[block + 1]
    }

    /// The unknowns of a photo that are those of its pose and, unless that is held or shared, its camera, of all: the first of its block.
    pub fn of_photo(&self, photo: usize) -> Range<usize> {
        let all = self.of_block(photo);
        let beside = self.blocks.commons_of(photo).first().and_then(|&common| self.of_common(common));
        all.start..beside.map_or(all.end, |beside| beside.start)
    }

    /// Whether a photo has a camera with unknown parameters that is no other's.
    pub fn has_own_camera(&self, photo: usize) -> bool {
        self.of_photo(photo).len() > POSE
    }

    /// Where the coordinates of a point stand among the unknowns.
    pub fn of_point(&self, point: usize) -> Range<usize> {
        let start = if point < self.locals { 0 } else { self.of_stations().len() };
        start + 3 * point..start + 3 * point + 3
    }

    /// The coordinates of all points, counted from the origin, at given values of the unknowns.
    pub fn coordinates<'a>(&self, unknowns: &'a [f64]) -> impl Iterator<Item = &'a [f64; 3]> + use<'a> {
        let (local, tied) = self.all_coordinates(unknowns);
        local.iter().chain(tied)
    }

    /// The same of local points, and of all others.
    pub fn all_coordinates<'a>(&self, unknowns: &'a [f64]) -> (&'a [[f64; 3]], &'a [[f64; 3]]) {
        let photos = self.of_stations();
        (unknowns[..photos.start].as_chunks().0, unknowns[photos.end..].as_chunks().0)
    }

    /// The ties: images of points that are not local, then observations.
    pub fn ties(&self) -> Vec<Tie> {
        let images = (self.point_images.start[self.locals]..self.images.len()).map(|image| {
            let point = self.point_of(image);
            let others = self.blocks_of_image(image);
            let blocks = std::iter::once(self.block_of_point(point)).chain(others);
            Tie { rows: 2, retained: blocks.map(|block| block as u32).collect() }
        });
        let observations = self.observations.iter().map(|tied| Tie {
            rows: tied.root.nrows(),
            retained: tied.blocks.iter().map(|&block| block as u32).collect(),
        });
        images.chain(observations).collect()
    }

    /// The retained block of a point that is not local.
    fn block_of_point(&self, point: usize) -> usize {
        self.stations() + point - self.locals
    }

    /// How many unknowns a retained block has.
    fn width(&self, block: usize) -> usize {
        if block < self.stations() { self.of_block(block).len() } else { 3 }
    }

    /// The retained blocks of an image: those of its pose, the main one first, then those of what it passes, then the camera where that is
    /// shared.
    pub fn blocks_of_image(&self, image: usize) -> impl Iterator<Item = usize> {
        let photo = self.images[image].photo;
        let passed = self.blocks_of_passages(image);
        self.blocks_of_pose(photo, self.time_of(image)).chain(passed).chain(self.blocks.of_camera[photo])
    }

    /// The number of an image on the scale of its photo's time.
    #[inline]
    pub fn time_of(&self, image: usize) -> f64 {
        self.image_times.get(image).copied().unwrap_or(AT_PHOTO)
    }

    /// The retained block that the equations of an image are kept with.
    pub fn main_block(&self, image: usize) -> usize {
        let photo = self.images[image].photo;
        if self.mounts.is_empty() { photo } else { self.main_block_of_pose(photo) }
    }

    /// The retained blocks of what an observation touches, each once; points as the model numbers them.
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

    /// How many ties are images.
    pub fn tied_images(&self) -> usize {
        self.images.len() - self.point_images.start[self.locals]
    }

    /// The point of an image.
    pub(super) fn point_of(&self, image: usize) -> usize {
        self.point_images.start.partition_point(|&start| start <= image) - 1
    }

    /// Writes the equations of an image whose point is not local.
    pub(super) fn observe_tied_image(&self, stations: &Stations, image: usize, rows: &mut TieRows<'_>) {
        let all = rows.coefficients.len() / 2;
        let width = self.of_block(self.main_block(image)).len();
        let shared = all - 3 - width;
        let (mut local, mut retained, mut common) = ([0.0; 6], vec![0.0; 2 * width], vec![0.0; 2 * shared]);
        let constant = &mut *rows.constant;
        let mut apart =
            GroupRows { constant, local: &mut local, retained: &mut retained, shared: &mut common };
        self.observe(stations, self.point_of(image), image, &mut apart);
        for (row, together) in rows.coefficients.chunks_exact_mut(all).enumerate() {
            together[..3].copy_from_slice(&local[3 * row..][..3]);
            together[3..3 + width].copy_from_slice(&retained[width * row..][..width]);
            together[3 + width..].copy_from_slice(&common[shared * row..][..shared]);
        }
    }

    /// Hands over what observations are computed from, at given values of the unknowns.
    pub(super) fn with_tied<T>(&self, stations: &Stations, take: impl FnOnce(&TiedModel<'_>) -> T) -> T {
        let point = |point: usize| PointSite {
            point: stations.points[point],
            coordinates: stations.tied[point - self.locals],
            block: self.block_of_point(point),
        };
        let mounted = stations.bent.as_ref().and_then(|bent| bent.mounted.as_ref());
        let photo = |photo: usize| match mounted.and_then(|mounted| mounted.of(photo)) {
            None => {
                PhotoSite { orientation: &stations.photos[photo].orientation, block: photo, made_of: None }
            }
            Some(own) => {
                let block = self.main_block_of_pose(photo);
                PhotoSite { orientation: &own.orientation, block, made_of: Some(own) }
            }
        };
        let common = |common: usize| CommonSite {
            state: &stations.commons[common],
            place: self.blocks.of_common[common],
        };
        let moving =
            |photo: usize| self.moving(stations.bent.as_ref()?.mounted.as_ref()?, &stations.commons, photo);
        take(&TiedModel {
            space: self.space,
            origin: self.origin,
            moving: &moving,
            point: &point,
            photo: &photo,
            common: &common,
            width: &|block| self.width(block),
        })
    }

    /// Photos and common unknowns at given values of the unknowns of photos, shared cameras and common unknowns.
    pub fn placed(&self, unknowns: &[f64]) -> Placed {
        let commons = self.common_states(unknowns);
        let lenses = self.passages.lenses().iter().map(|own| own.commons.iter());
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
            let bent = self.passages.lens(photo).and_then(|lens| camera.with_knots(knots[lens].clone()));
            Station { orientation: self.orientation(photo, &pose), camera: bent.unwrap_or(camera) }
        };
        let mut photos: Vec<Station> = (0..self.cameras.len()).map(photo).collect();
        let mounted = self.mount_all(&mut photos, &commons);
        let films = self.passages.films(&commons);
        Placed { photos, commons, mounted, films }
    }

    /// The photos alone.
    pub fn photos(&self, unknowns: &[f64]) -> Vec<Station> {
        self.placed(unknowns).photos
    }

    /// The common unknowns at given values of the same unknowns.
    pub fn common_states(&self, unknowns: &[f64]) -> Vec<CommonState> {
        (0..self.commons.len()).map(|common| self.common_state(common, unknowns)).collect()
    }

    /// One of them.
    pub fn common_state(&self, common: usize, unknowns: &[f64]) -> CommonState {
        let start = 3 * self.locals;
        let own = self.of_common(common).map_or(0..0, |own| own.start - start..own.end - start);
        self.commons[common].at(&unknowns[own])
    }

    /// The unknowns of a common unknown, of all; None where it is known.
    pub fn of_common(&self, common: usize) -> Option<Range<usize>> {
        let InBlock { block, first, .. } = self.blocks.of_common[common]?;
        let start = self.of_block(block).start + first;
        Some(start..start + self.commons[common].kind.unknowns().len())
    }

    /// What a block of photos, shared cameras and common unknowns belongs to, with the unknowns of each, of all.
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

    /// What one of their unknowns, of all, belongs to, and its number there; None for those of points.
    pub fn owner(&self, unknown: usize) -> Option<(Owner, usize)> {
        let all = self.of_stations();
        let retained = all.contains(&unknown).then(|| unknown - all.start)?;
        let block = self.blocks.first.partition_point(|&start| start <= retained) - 1;
        let own = self.owners(block).into_iter().find(|(_, range)| range.contains(&unknown));
        own.map(|(owner, range)| (owner, unknown - range.start))
    }

    /// The cofactors of such a block.
    pub fn cofactors_of_block<'a>(&self, all: &'a Cofactors, block: usize) -> &'a [f64] {
        &all.retained[self.blocks.squares[block]..self.blocks.squares[block + 1]]
    }

    /// The cofactors of a common unknown; none where it is known.
    pub fn cofactors_of_common(&self, all: &Cofactors, common: usize) -> DMatrix<f64> {
        self.cofactors_in_block(all, common, common)
    }

    /// The cofactors of a common unknown with another of its block; none where it is known.
    pub fn cofactors_in_block(&self, all: &Cofactors, common: usize, other: usize) -> DMatrix<f64> {
        let (Some(own), Some(to)) = (self.blocks.of_common[common], self.blocks.of_common[other]) else {
            return DMatrix::zeros(0, 0);
        };
        let square = self.cofactors_of_block(all, own.block);
        let [rows, columns] = [common, other].map(|own| self.commons[own].kind.unknowns().len());
        DMatrix::from_fn(rows, columns, |i, j| square[own.width * (own.first + i) + to.first + j])
    }

    /// The common unknown before another in their block.
    pub fn former_in_block(&self, common: usize) -> Option<usize> {
        let InBlock { block, .. } = self.blocks.of_common[common]?;
        let own = self.blocks.commons_of(block);
        let place = own.iter().position(|&other| other == common)?;
        Some(own[place.checked_sub(1)?])
    }

    /// The orientation of a photo, its pose given, with the columns of its unknowns.
    pub fn orientation(&self, photo: usize, pose: &[f64; POSE]) -> Orientation {
        let [x, y, z, omega, phi, kappa] = *pose;
        match self.turning_sense(photo) {
            Some(sense) => {
                let local = AttitudeNumbers::OmegaPhiKappa(sense).attitude([omega, phi, kappa]);
                Orientation::stepping(self.space, [x, y, z], &local)
            }
            None => Orientation::new(self.poses, self.space, pose),
        }
    }

    /// The verticals at the photos; `unknowns` are those of all stations.
    fn verticals_at_photos(
        &self,
        refraction: &Refraction,
        unknowns: &[f64],
        photos: &[Station],
    ) -> Vec<Vertical> {
        let place = |(photo, station): (usize, &Station)| {
            if self.is_carried(photo) {
                self.space.coordinates(station.orientation.centre())
            } else {
                std::array::from_fn(|k| unknowns[self.blocks.first[photo] + k])
            }
        };
        let places = photos.iter().enumerate().map(place);
        places.map(|place: [f64; 3]| refraction.vertical(self.space, place)).collect()
    }

    /// The sense of the angles of a photo that steps by a rotation vector; None for all others.
    pub fn turning_sense(&self, photo: usize) -> Option<RotationSense> {
        match self.poses {
            PoseNumbers::Angles(sense) if self.turning[photo] => Some(sense),
            PoseNumbers::Angles(_) | PoseNumbers::Vectors => None,
        }
    }

    /// The images of a point.
    pub fn images_of(&self, point: usize) -> &[Image] {
        &self.images[self.point_images.start[point]..self.point_images.start[point + 1]]
    }
}

impl Bundle {
    /// Everything at given values of the unknowns.
    pub fn evaluated(&self, unknowns: &[f64]) -> Stations {
        let photos = &unknowns[self.of_stations()];
        let (local, tied) = (&unknowns[..3 * self.locals], &unknowns[self.of_stations().end..]);
        let tied = tied.as_chunks().0.to_vec();
        let Placed { photos: stations, commons, mounted, films } = self.placed(photos);
        let refracted = self.refraction.map(|refraction| Refracted {
            refraction,
            at_photos: self.verticals_at_photos(&refraction, photos, &stations),
            at_points: verticals(
                &refraction,
                self.space,
                local.chunks(3).chain(tied.as_flattened().chunks(3)),
            ),
        });
        let plain = refracted.is_none() && mounted.is_none() && self.passages.is_empty();
        let bent = (!plain).then_some(Bent { refracted, mounted, films });
        let place = |&coordinates: &[f64; 3]| geometry::Point::new(self.space, coordinates);
        let local: &[[f64; 3]] = local.as_chunks().0;
        let mut points = if self.passages.have_figures() {
            let shift = |point| self.passages.shift(point, |common| commons[common].vector());
            let shifted = |point| place(&(Vector3::from(local[point]) + shift(point)).into());
            parallel::map_in_place(local.len(), 1024, &shifted)
        } else {
            parallel::map_in_place(local.len(), 1024, &|point| place(&local[point]))
        };
        points.extend(tied.iter().map(place));
        Stations { photos: stations, points, tied, commons, bent }
    }
}

/// The verticals at positions, the first three unknowns of each.
fn verticals<'a>(
    refraction: &Refraction,
    space: ObjectSpace,
    unknowns: impl Iterator<Item = &'a [f64]>,
) -> Vec<Vertical> {
    unknowns.map(|values| refraction.vertical(space, std::array::from_fn(|k| values[k]))).collect()
}
