//! Photos and points at given values of the unknowns, and the equations of images there.
//!
//! The unknowns of photos, shared cameras and common unknowns before the adjustment: values, observed values, standard deviations.

use super::commons::CommonState;
use super::film::FilmAt;
use super::median::median;
use super::model::Bundle;
use super::mounts::Composed;
use super::surroundings::Surroundings;
use super::{Image, Network, Photo};
use crate::geometry::camera::{LensDirection, each_camera};
use crate::geometry::{
    self, Camera, CameraModel, ObjectSpace, Orientation, POSE, PoseNumbers, Refraction, Vector3, Vertical,
    nearest_turns,
};
use crate::normals::GroupRows;

/// Photos and points at given values of the unknowns.
#[derive(Debug)]
pub struct Stations {
    pub photos: Vec<Station>,
    pub points: Vec<geometry::Point>,
    /// The coordinates of the points that are not local.
    pub tied: Vec<[f64; 3]>,
    pub commons: Vec<CommonState>,
    pub bent: Option<Bent>,
}

impl Stations {
    /// The standard deviations of an image in the unit of its camera, about.
    pub fn sd_in_camera(&self, image: &Image) -> [f64; 2] {
        let film = self.bent.as_ref().and_then(|bent| bent.film(image.photo));
        image.sd.map(|sd| film.map_or(sd, |film| sd / film.units()))
    }
}

/// What images need besides where they are not plain.
#[derive(Debug)]
pub struct Bent {
    pub refracted: Option<Refracted>,
    pub mounted: Option<Mounted>,
    /// By photo, of those that are scanned; nothing at all where none is.
    pub films: Vec<Option<FilmAt>>,
}

/// Photos that are mounted.
#[derive(Debug)]
pub struct Mounted {
    /// All photos as their own six unknowns have them.
    pub own: Vec<Orientation>,
    /// By photo, at its time; None of photos that are not mounted.
    pub composed: Vec<Option<Composed>>,
}

/// Photos and common unknowns at given values.
pub struct Placed {
    pub photos: Vec<Station>,
    pub commons: Vec<CommonState>,
    /// None where no photo is.
    pub mounted: Option<Mounted>,
    /// See [`Bent::films`].
    pub films: Vec<Option<FilmAt>>,
}

/// A photo at given values of its unknowns.
#[derive(Debug, Clone)]
pub struct Station {
    pub orientation: Orientation,
    pub camera: Camera,
}

/// What refraction needs besides.
#[derive(Debug)]
pub struct Refracted {
    pub refraction: Refraction,
    pub at_photos: Vec<Vertical>,
    pub at_points: Vec<Vertical>,
}

impl Mounted {
    /// The pose of a photo that is mounted.
    pub fn of(&self, photo: usize) -> Option<&Composed> {
        self.composed[photo].as_ref()
    }
}

impl Bent {
    /// The film of a photo.
    pub fn film(&self, photo: usize) -> Option<&FilmAt> {
        self.films.get(photo)?.as_ref()
    }

    /// Writes an image, with its pose where it is not that of the photo at its time; where the photo is scanned, its place in the camera.
    pub fn write(
        &self,
        space: ObjectSpace,
        stations: &Stations,
        timed: Option<&Composed>,
        image: &Image,
        local: usize,
        rows: &mut GroupRows<'_>,
    ) {
        let composed = timed.or_else(|| self.mounted.as_ref()?.of(image.photo));
        let camera = &stations.photos[image.photo].camera;
        let timed = timed.map(|own| &own.orientation);
        self.seen(space, stations, timed, image.photo, local, |orientation, point| {
            // Nothing is observed of the place in the camera itself.
            let measured = self.film(image.photo).is_none().then_some(image.xy);
            let write = |rows: &mut GroupRows<'_>| {
                each_camera!(camera, camera => write(orientation, camera, point, measured, rows));
            };
            match composed {
                None => write(rows),
                Some(composed) => composed.write(rows, write),
            }
        });
    }

    /// Hands over what a photo sees of a point, and from where; `timed` is its pose where that is not the one at its time.
    pub fn seen<T>(
        &self,
        space: ObjectSpace,
        stations: &Stations,
        timed: Option<&Orientation>,
        photo: usize,
        local: usize,
        take: impl FnOnce(&Orientation, &geometry::Point) -> T,
    ) -> T {
        let at_photo = || Some(&self.mounted.as_ref()?.of(photo)?.orientation);
        let orientation = timed.or_else(at_photo).unwrap_or(&stations.photos[photo].orientation);
        let point = &stations.points[local];
        let Some(Refracted { refraction, at_photos, at_points }) = &self.refracted else {
            return take(orientation, point);
        };
        let from = timed.map(|_| refraction.vertical(space, space.coordinates(orientation.centre())));
        let from = from.as_ref().unwrap_or(&at_photos[photo]);
        let lift = refraction.lift(orientation, from, point, &at_points[local]);
        take(&orientation.under(&lift), &point.lifted(&lift))
    }
}

/// The two equations of an image: observed minus computed, and the partials of the computed. Where nothing is measured, those of its
/// place in the camera, compared with zero.
#[inline(never)]
pub fn write<C: CameraModel>(
    orientation: &Orientation,
    camera: &C,
    point: &geometry::Point,
    measured: Option<[f64; 2]>,
    rows: &mut GroupRows<'_>,
) {
    let u = orientation.sight(point);
    let (residual, computed) = match measured {
        None if C::LENS == LensDirection::Backward => {
            let place = camera.linearize(&u);
            (place.xy.map(|value| -value), place)
        }
        _ => camera.compare(&u, measured.unwrap_or_default()),
    };
    put(orientation, &u, (residual, &computed), point, rows);
}

#[inline(always)]
fn put<P: AsRef<[f64]> + Copy>(
    orientation: &Orientation,
    u: &Vector3,
    (residual, computed): ([f64; 2], &geometry::Image<P>),
    point: &geometry::Point,
    rows: &mut GroupRows<'_>,
) {
    let projection = orientation.projection(u, computed, point);
    let (width, shared) = (rows.retained.len() / 2, rows.shared.len() / 2);
    for row in 0..2 {
        rows.constant[row] = residual[row];
        rows.local[3 * row..][..3].copy_from_slice(&projection.point[row]);
        rows.retained[width * row..][..POSE].copy_from_slice(&projection.photo[row]);
        // As many as the camera has, which is known where this is compiled.
        let camera = projection.camera[row].as_ref();
        if width > POSE {
            rows.retained[width * row + POSE..][..camera.len()].copy_from_slice(camera);
        }
        if shared > 0 {
            rows.shared[shared * row..][..camera.len()].copy_from_slice(camera);
        }
    }
}

impl Network {
    /// The projection centre of given six unknowns.
    pub(super) fn centre(&self, pose: &[f64; POSE]) -> Vector3 {
        match self.poses {
            PoseNumbers::Angles(_) => self.space.cartesian([pose[0], pose[1], pose[2]]),
            PoseNumbers::Vectors => Orientation::new(self.poses, self.space, pose).centre(),
        }
    }

    /// A point near the photos: coordinates are counted from it while the network is adjusted, so that no digits are lost in
    /// large ones. Medians, so that a single photo with a wrong position does not move it. Geographic coordinates stay as they
    /// are, differences being formed in geocentric space; so do poses in vectors, whose translations turn with the rotation, and
    /// coordinates on a body that turns under inertial tables, which are counted from its centre.
    pub(super) fn origin(&self, middle: [f64; 3]) -> [f64; 3] {
        let turns = self.trajectories.iter().any(|own| own.course.body.is_some());
        match (self.space, self.poses) {
            (ObjectSpace::Rectangular, PoseNumbers::Angles(_)) if !turns => middle.map(f64::round),
            _ => [0.0; 3],
        }
    }

    /// The medians of the coordinates of the photos.
    pub(super) fn middle(&self) -> [f64; 3] {
        let middle = |k: usize| median(self.photos.iter().map(|photo| photo.pose[k]).collect());
        std::array::from_fn(|k| middle(k).unwrap_or_default())
    }

    pub(super) fn camera(&self, photo: &Photo) -> &super::Camera {
        &self.cameras[photo.camera]
    }

    /// Standard deviations of the unknowns of photos, shared cameras and common unknowns; those of `unused` and of carried photos, of
    /// cameras that have no others, and of common unknowns that nothing which takes part is of, are held.
    pub(super) fn station_sd(
        &self,
        model: &Bundle,
        surroundings: &Surroundings,
        unused: impl Fn(usize) -> bool,
    ) -> Vec<f64> {
        let mut all = Vec::new();
        let mut used = vec![false; self.cameras.len()];
        surroundings.cameras().into_iter().for_each(|camera| used[camera] = true);
        let (commons, photos) = (surroundings.commons(), surroundings.photos());
        let of_commons = |own: &[usize], elsewhere: bool| {
            let of_common = |&common: &usize| {
                let is_used = elsewhere || model.commons[common].uses > 0 || commons.contains(&common);
                self.commons[common].sd.iter().map(move |&sd| if is_used { sd } else { 0.0 })
            };
            own.iter().flat_map(of_common).collect::<Vec<f64>>()
        };
        for (index, photo) in self.photos.iter().enumerate() {
            let own = if model.has_own_camera(index) { &self.camera(photo).sd[..] } else { &[] };
            used[photo.camera] |= !unused(index);
            let held = unused(index) || model.is_carried(index);
            all.extend(photo.sd.iter().chain(own).map(|&sd| if held { 0.0 } else { sd }));
            all.extend(of_commons(model.blocks.commons_of(index), photos.contains(&index)));
        }
        for &camera in &model.blocks.shared {
            all.extend(self.cameras[camera].sd.iter().map(|&sd| if used[camera] { sd } else { 0.0 }));
        }
        model.blocks.commons.iter().for_each(|own| all.extend(of_commons(own, false)));
        all
    }

    /// The values of the unknowns of photos, with the given poses, of shared cameras and common unknowns.
    pub(super) fn station_values(&self, model: &Bundle, pose: impl Fn(&Photo) -> [f64; POSE]) -> Vec<f64> {
        let mut all = Vec::new();
        for (index, photo) in self.photos.iter().enumerate() {
            all.extend(pose(photo));
            if model.has_own_camera(index) {
                all.extend(self.camera(photo).camera.parameters());
            }
            // Common unknowns count from what is given.
            all.resize(all.len() + model.of_block(index).len() - model.of_photo(index).len(), 0.0);
        }
        all.extend(model.blocks.shared.iter().flat_map(|&camera| self.cameras[camera].camera.parameters()));
        all.resize(model.of_stations().len(), 0.0);
        all
    }

    /// The observed pose of a photo, as near to the initial one as whole turns bring it.
    pub(super) fn observed_pose(&self, photo: &Photo) -> [f64; POSE] {
        let near = nearest_turns(photo.observed, photo.pose);
        let turning = |k: usize| match self.poses {
            PoseNumbers::Angles(_) => k >= 3 || k == 0 && self.space != ObjectSpace::Rectangular,
            PoseNumbers::Vectors => false,
        };
        std::array::from_fn(|k| if turning(k) { near[k] } else { photo.observed[k] })
    }

    /// Whether a photo's attitude steps by a rotation vector: a fixed angle keeps its bits.
    pub(super) fn turns(&self, photo: usize) -> bool {
        let fixed = self.photos[photo].sd[3..].contains(&0.0);
        !fixed && matches!(self.poses, PoseNumbers::Angles(_))
    }
}
