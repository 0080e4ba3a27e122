//! Photos and points at given values of the unknowns, and the equations of images there.

use super::Image;
use super::commons::CommonState;
use super::mounts::Composed;
use crate::geometry::camera::each_camera;
use crate::geometry::{
    self, Camera, CameraModel, ObjectSpace, Orientation, POSE, Ray, Refraction, Steps, Vertical,
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

/// What images need besides where they are not plain.
#[derive(Debug)]
pub struct Bent {
    pub refracted: Option<Refracted>,
    pub mounted: Option<Mounted>,
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

impl Mounted {
    /// The pose of a photo that is mounted.
    pub fn of(&self, photo: usize) -> Option<&Composed> {
        self.composed[photo].as_ref()
    }
}

impl Bent {
    /// Writes an image, with its pose where it is not that of the photo at its time.
    pub fn write(
        &self,
        space: ObjectSpace,
        stations: &Stations,
        timed: Option<&Composed>,
        image: &Image,
        local: usize,
        rows: &mut GroupRows<'_>,
    ) {
        let Station { orientation, camera } = &stations.photos[image.photo];
        let composed = timed.or_else(|| self.mounted.as_ref()?.of(image.photo));
        let mut orientation = composed.map_or(*orientation, |own| own.orientation);
        let mut point = stations.points[local];
        if let Some(Refracted { refraction, at_photos, at_points }) = &self.refracted {
            let from = timed.map(|_| refraction.vertical(space, space.coordinates(orientation.centre())));
            let from = from.as_ref().unwrap_or(&at_photos[image.photo]);
            let lift = refraction.lift(&orientation, from, &point, &at_points[local]);
            (orientation, point) = (orientation.under(&lift), point.lifted(&lift));
        }
        let write = |rows: &mut GroupRows<'_>| {
            each_camera!(camera, camera => write(&orientation, camera, &point, image, rows));
        };
        match composed {
            None => write(rows),
            Some(composed) => composed.write(rows, write),
        }
    }
}

impl Composed {
    /// Writes an image: `write` does so as if its photo had six unknowns of its own. They are those of the parts, of which the first is the
    /// main block and the others the first of what is common with others; the camera is the last of that.
    fn write(&self, rows: &mut GroupRows<'_>, write: impl FnOnce(&mut GroupRows<'_>)) {
        let (main, common) = (rows.retained.len() / 2, rows.shared.len() / 2);
        let parts: usize = self.parts[1..].iter().map(|(_, steps)| steps.ncols()).sum();
        let (mut pose, mut camera) = ([0.0; 2 * POSE], vec![0.0; 2 * (common - parts)]);
        let (constant, local) = (&mut *rows.constant, &mut *rows.local);
        write(&mut GroupRows { constant, local, retained: &mut pose, shared: &mut camera });
        rows.retained.fill(0.0);
        for (row, pose) in pose.as_chunks::<POSE>().0.iter().enumerate() {
            let by = |steps: &Steps, to: &mut [f64]| {
                let columns = steps.column_iter();
                to.iter_mut()
                    .zip(columns)
                    .for_each(|(to, by)| *to = pose.iter().zip(&by).map(|(a, b)| a * b).sum());
            };
            by(&self.parts[0].1, &mut rows.retained[main * row..][..main]);
            let mut rest = &mut rows.shared[common * row..][..common];
            for (_, steps) in &self.parts[1..] {
                let (own, after) = rest.split_at_mut(steps.ncols());
                by(steps, own);
                rest = after;
            }
            rest.copy_from_slice(&camera[rest.len() * row..][..rest.len()]);
        }
    }
}

/// The two equations of an image: observed minus computed, and the partials of the computed.
#[inline(never)]
pub fn write<C: CameraModel>(
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
