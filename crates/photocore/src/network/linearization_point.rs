//! Photos and points at given parameter values, and the equations of images.

use super::commons::CommonState;
use super::film::FilmAt;
use super::input::Image;
use super::mounts::Composed;
use crate::geometry::camera::{LensDirection, each_camera};
use crate::geometry::{
    self, Camera, CameraModel, ObjectSpace, Orientation, POSE, Refraction, Vector3, Vertical,
};
use crate::normals::GroupRows;

/// Photos, shared parameters and points at given parameter values.
#[derive(Debug)]
pub struct LinearizationPoint {
    pub photos: Vec<PhotoState>,
    pub commons: Vec<CommonState>,
    /// None without mounts.
    pub mounted: Option<Mounted>,
    /// Film of each photo, None without a scan; empty without scans.
    pub films: Vec<Option<FilmAt>>,
    /// None without refraction, and if points are not evaluated.
    pub refracted: Option<Refracted>,
    /// Points; empty if they are not evaluated.
    pub points: Vec<geometry::Point>,
    /// Coordinates of the points if there are additional observations, otherwise empty.
    pub coordinates: Vec<[f64; 3]>,
    /// Whether the images have neither refraction nor mounts nor corrections.
    pub plain: bool,
}

#[derive(Debug)]
pub struct Mounted {
    /// Orientations of all photos from their own six parameters.
    pub own: Vec<Orientation>,
    /// Composed pose of each photo at its time; None for photos without mounts.
    pub composed: Vec<Option<Composed>>,
}

/// A photo at given parameter values.
#[derive(Debug, Clone)]
pub struct PhotoState {
    pub orientation: Orientation,
    pub camera: Camera,
}

/// Refraction, with the verticals that it requires.
#[derive(Debug)]
pub struct Refracted {
    pub refraction: Refraction,
    pub at_photos: Vec<Vertical>,
    pub at_points: Vec<Vertical>,
}

impl Mounted {
    /// Returns the pose of a mounted photo.
    pub fn of(&self, photo: usize) -> Option<&Composed> {
        self.composed[photo].as_ref()
    }
}

impl LinearizationPoint {
    /// Returns the approximate standard deviations of an image in the unit of its camera.
    pub fn sd_in_camera(&self, image: &Image) -> [f64; 2] {
        image.sd.map(|sd| self.film(image.photo).map_or(sd, |film| sd / film.units()))
    }

    pub fn film(&self, photo: usize) -> Option<&FilmAt> {
        self.films.get(photo)?.as_ref()
    }

    /// Writes an image, with its own pose if it is timed; for a scanned photo, writes its position in the camera.
    pub fn write(
        &self,
        space: ObjectSpace,
        timed: Option<&Composed>,
        image: &Image,
        local: usize,
        rows: &mut GroupRows<'_>,
    ) {
        let composed = timed.or_else(|| self.mounted.as_ref()?.of(image.photo));
        let camera = &self.photos[image.photo].camera;
        let timed = timed.map(|own| &own.orientation);
        self.seen(space, timed, image.photo, local, |orientation, point| {
            // The position in the camera is not observed for scans.
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

    /// Calls `take` with the orientation and the refracted point; `timed` is the pose of the image if it differs from the photo.
    pub fn seen<T>(
        &self,
        space: ObjectSpace,
        timed: Option<&Orientation>,
        photo: usize,
        local: usize,
        take: impl FnOnce(&Orientation, &geometry::Point) -> T,
    ) -> T {
        let at_photo = || Some(&self.mounted.as_ref()?.of(photo)?.orientation);
        let orientation = timed.or_else(at_photo).unwrap_or(&self.photos[photo].orientation);
        let point = &self.points[local];
        let Some(Refracted { refraction, at_photos, at_points }) = &self.refracted else {
            return take(orientation, point);
        };
        let from = timed.map(|_| refraction.vertical(space, space.coordinates(orientation.centre())));
        let from = from.as_ref().unwrap_or(&at_photos[photo]);
        let offset = refraction.offset(orientation, from, point, &at_points[local]);
        take(&orientation.with_offset(&offset), &point.with_offset(&offset))
    }
}

/// Writes the two equations of an image: observed minus computed, and the partials of the computed. Without a measurement, the position in
/// the camera is compared with zero.
#[inline(never)]
pub fn write<C: CameraModel>(
    orientation: &Orientation,
    camera: &C,
    point: &geometry::Point,
    measured: Option<[f64; 2]>,
    rows: &mut GroupRows<'_>,
) {
    let u = orientation.to_camera_frame(point);
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
        // The number of camera parameters is known at compile time.
        let camera = projection.camera[row].as_ref();
        if width > POSE {
            rows.retained[width * row + POSE..][..camera.len()].copy_from_slice(camera);
        }
        if shared > 0 {
            rows.shared[shared * row..][..camera.len()].copy_from_slice(camera);
        }
    }
}
