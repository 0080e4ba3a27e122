//! The observation equations of a block.

use rayon::prelude::*;

use super::Image;
use crate::adjustment::Model;
use crate::geometry::{ObjectSpace, Photo, Point, Projection, Refraction, RotationSense, Vertical};
use crate::normals::GroupRows;

/// Central perspective images: the collinearity equations.
#[derive(Debug)]
pub struct CentralPerspective {
    pub space: ObjectSpace,
    pub sense: RotationSense,
    /// None where images are free of refraction.
    pub refraction: Option<Refraction>,
    /// Of each photograph, in millimetres.
    pub principal_distances: Vec<f64>,
    /// The points, the local blocks; coordinates counted from the local origin.
    pub points: Vec<super::Point>,
    /// The images, point by point: the groups of observations.
    pub images: Vec<Image>,
    /// The images of point i are `images[start[i]..start[i + 1]]`.
    pub start: Vec<usize>,
    /// Index of each of them in the block.
    pub order: Vec<usize>,
}

/// Photographs and points at given values of the unknowns.
#[derive(Debug)]
pub struct Stations {
    photos: Vec<Photo>,
    points: Vec<Point>,
    refracted: Option<Refracted>,
}

/// What refraction needs besides.
#[derive(Debug)]
struct Refracted {
    refraction: Refraction,
    at_photos: Vec<Vertical>,
    at_points: Vec<Vertical>,
}

impl Refracted {
    /// Out of line, so that images without refraction do not pay for it.
    #[inline(never)]
    fn linearize(&self, stations: &Stations, photo: usize, point: usize) -> Projection {
        let (from, to) = (&stations.photos[photo], &stations.points[point]);
        let lift =
            self.refraction.lift(&from.orientation, &self.at_photos[photo], to, &self.at_points[point]);
        from.linearize_lifted(to, &lift)
    }
}

impl CentralPerspective {
    /// The photographs at given values of their unknowns, six each.
    pub fn photos(&self, unknowns: &[f64]) -> Vec<Photo> {
        let photos = unknowns.as_chunks().0.iter().zip(&self.principal_distances);
        let photo = |(&[x, y, z, omega, phi, kappa], &principal_distance): (&[f64; 6], &f64)| {
            Photo::new(self.space, self.sense, [x, y, z], [omega, phi, kappa], principal_distance)
        };
        photos.map(photo).collect()
    }
}

impl Model for CentralPerspective {
    type Prepared = Stations;

    fn prepare(&self, unknowns: &[f64]) -> Stations {
        let (points, photos) = unknowns.split_at(3 * self.points.len());
        let coordinates = points.as_chunks().0;
        let refracted = self.refraction.map(|refraction| Refracted {
            refraction,
            at_photos: verticals(&refraction, self.space, photos.as_chunks::<6>().0),
            at_points: verticals(&refraction, self.space, coordinates),
        });
        let points = coordinates.par_iter().with_min_len(1024);
        let points = points.map(|&coordinates| Point::new(self.space, coordinates)).collect();
        Stations { photos: self.photos(photos), points, refracted }
    }

    /// Intersects the points anew.
    fn relocate(&self, unknowns: &mut [f64]) -> bool {
        let (points, photos) = unknowns.split_at_mut(3 * self.points.len());
        let Ok(coordinates) = self.intersect(&self.photos(photos)) else { return false };
        points.copy_from_slice(coordinates.as_flattened());
        true
    }

    #[inline(always)]
    fn observe(&self, stations: &Stations, local: usize, group: usize, rows: &mut GroupRows<'_>) {
        let image = &self.images[group];
        let projection = match &stations.refracted {
            None => stations.photos[image.photo].linearize(&stations.points[local]),
            Some(refracted) => refracted.linearize(stations, image.photo, local),
        };
        for row in 0..2 {
            rows.constant[row] = image.xy[row] - projection.xy[row];
            rows.local[3 * row..][..3].copy_from_slice(&projection.point[row]);
            rows.kept[6 * row..][..6].copy_from_slice(&projection.photo[row]);
        }
    }
}

/// The verticals at positions, the first three unknowns of each.
fn verticals<const N: usize>(
    refraction: &Refraction,
    space: ObjectSpace,
    unknowns: &[[f64; N]],
) -> Vec<Vertical> {
    let position = |values: &[f64; N]| std::array::from_fn(|k| values[k]);
    unknowns.iter().map(|values| refraction.vertical(space, position(values))).collect()
}
