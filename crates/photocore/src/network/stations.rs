//! Photos and points at given values of the unknowns, and the equations of images there.

use nalgebra::Matrix2x6;

use super::Image;
use super::commons::CommonState;
use super::mounts::Mounted;
use crate::geometry::camera::each_camera;
use crate::geometry::{self, Camera, CameraModel, Orientation, Ray, Refraction, Vertical};
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

/// What images need besides where they are not plain.
#[derive(Debug)]
pub struct Bent {
    pub refracted: Option<Refracted>,
    /// By photo; none at all where there are no rigs.
    pub mounted: Vec<Option<Mounted>>,
}

/// Photos and common unknowns at given values.
pub struct Placed {
    pub photos: Vec<Station>,
    pub commons: Vec<CommonState>,
    /// By photo; none at all where there are no rigs.
    pub mounted: Vec<Option<Mounted>>,
}

/// A photo at given values of its unknowns.
#[derive(Debug, Clone, Copy)]
pub struct Station {
    pub orientation: Orientation,
    pub camera: Camera,
}

impl Station {
    /// The ray of an image position; None where no direction has it.
    pub fn ray(&self, xy: [f64; 2]) -> Option<Ray> {
        self.camera.direction(xy).map(|direction| self.orientation.ray(&direction))
    }
}

/// What refraction needs besides.
#[derive(Debug)]
pub struct Refracted {
    pub refraction: Refraction,
    pub at_photos: Vec<Vertical>,
    pub at_points: Vec<Vertical>,
}

impl Refracted {
    /// The orientation and the place of a point as its image has them.
    fn lifted(&self, stations: &Stations, image: &Image, local: usize) -> (Orientation, geometry::Point) {
        let Station { orientation, .. } = &stations.photos[image.photo];
        let (from, to) = (&self.at_photos[image.photo], &self.at_points[local]);
        let point = &stations.points[local];
        let lift = self.refraction.lift(orientation, from, point, to);
        (orientation.under(&lift), point.lifted(&lift))
    }
}

impl Bent {
    /// Out of line, so that plain images do not pay for it.
    #[inline(never)]
    pub fn write(&self, stations: &Stations, image: &Image, local: usize, rows: &mut GroupRows<'_>) {
        let Station { orientation, camera } = &stations.photos[image.photo];
        let (orientation, point) = match &self.refracted {
            None => (*orientation, stations.points[local]),
            Some(refracted) => refracted.lifted(stations, image, local),
        };
        let write = |rows: &mut GroupRows<'_>| {
            each_camera!(camera, camera => write_in_its_place(&orientation, camera, &point, image, rows));
        };
        match self.mounted.get(image.photo).and_then(Option::as_ref) {
            None => write(rows),
            Some(mounted) => mounted.write(rows, write),
        }
    }
}

impl Mounted {
    /// Writes an image of its photo: `write` does so as if the photo had six unknowns of its own. They are those of the frame, the main
    /// block, and of the sensor, the first of what is common with others where it is as wide as there is room besides the camera.
    fn write(&self, rows: &mut GroupRows<'_>, write: impl FnOnce(&mut GroupRows<'_>)) {
        let (width, common) = (rows.retained.len() / 2, rows.shared.len() / 2);
        let sensor = if self.sensor_is_unknown { 6 } else { 0 };
        let (mut pose, mut camera) = ([0.0; 12], vec![0.0; 2 * (common - sensor)]);
        let (constant, local) = (&mut *rows.constant, &mut *rows.local);
        write(&mut GroupRows { constant, local, retained: &mut pose, shared: &mut camera });
        let pose = Matrix2x6::from_row_slice(&pose);
        let (by_frame, by_sensor) = (pose * self.by_frame, pose * self.by_sensor);
        rows.retained.fill(0.0);
        for row in 0..2 {
            (0..6).for_each(|k| rows.retained[width * row + k] = by_frame[(row, k)]);
            let own = &mut rows.shared[common * row..][..common];
            (0..sensor).for_each(|k| own[k] = by_sensor[(row, k)]);
            own[sensor..].copy_from_slice(&camera[(common - sensor) * row..][..common - sensor]);
        }
    }
}

/// [`write`], in line or called: what is compiled at every place should be small.
#[inline(always)]
pub fn write_in_its_place<C: CameraModel>(
    orientation: &Orientation,
    camera: &C,
    point: &geometry::Point,
    image: &Image,
    rows: &mut GroupRows<'_>,
) {
    if C::IN_LINE {
        write(orientation, camera, point, image, rows);
    } else {
        write_apart(orientation, camera, point, image, rows);
    }
}

#[inline(never)]
fn write_apart<C: CameraModel>(
    orientation: &Orientation,
    camera: &C,
    point: &geometry::Point,
    image: &Image,
    rows: &mut GroupRows<'_>,
) {
    write(orientation, camera, point, image, rows);
}

/// The two equations of an image: observed minus computed, and the partials of the computed.
#[inline(always)]
fn write<C: CameraModel>(
    orientation: &Orientation,
    camera: &C,
    point: &geometry::Point,
    image: &Image,
    rows: &mut GroupRows<'_>,
) {
    let u = orientation.sight(point);
    let (residual, computed) = camera.compare(&u, image.xy);
    let projection = orientation.projection(&u, &computed, point);
    let (width, shared) = (rows.retained.len() / 2, rows.shared.len() / 2);
    for row in 0..2 {
        rows.constant[row] = residual[row];
        rows.local[3 * row..][..3].copy_from_slice(&projection.point[row]);
        rows.retained[width * row..][..6].copy_from_slice(&projection.photo[row]);
        // As many as the camera has, which is known where this is compiled.
        let camera = projection.camera[row].as_ref();
        if width > 6 {
            rows.retained[width * row + 6..][..camera.len()].copy_from_slice(camera);
        }
        if shared > 0 {
            rows.shared[shared * row..][..camera.len()].copy_from_slice(camera);
        }
    }
}
