//! The observation equations of a collection.

use super::Image;
use crate::adjustment::Model;
use crate::geometry::vector::{apply, difference};
use crate::geometry::{BundlerPhoto, Vector3};
use crate::normals::GroupRows;

/// Images by photos with nine unknowns each.
#[derive(Debug)]
pub struct Bundle {
    /// How many points take part: the local blocks.
    pub points: usize,
    /// The images, point by point: the groups of observations.
    pub images: Vec<Image>,
    /// How many of them each photo has.
    pub images_on: Vec<usize>,
    /// Whether the position of anything is weighted or fixed: then the datum is the user's.
    pub placed: bool,
}

/// Photos and points at given values of the unknowns.
#[derive(Debug)]
pub struct Stations {
    photos: Vec<BundlerPhoto>,
    points: Vec<Vector3>,
}

impl Bundle {
    /// The photos at given values of all unknowns.
    pub fn photos(&self, unknowns: &[f64]) -> Vec<BundlerPhoto> {
        unknowns[3 * self.points..].as_chunks().0.iter().map(|&values| BundlerPhoto::new(values)).collect()
    }
}

impl Model for Bundle {
    type Prepared = Stations;

    fn prepare(&self, unknowns: &[f64]) -> Stations {
        let points = unknowns[..3 * self.points].as_chunks().0.to_vec();
        Stations { photos: self.photos(unknowns), points }
    }

    #[inline(always)]
    fn observe(&self, stations: &Stations, local: usize, group: usize, rows: &mut GroupRows<'_>) {
        let observed = &self.images[group];
        let image = stations.photos[observed.photo].linearize(&stations.points[local]);
        for row in 0..2 {
            rows.constant[row] = observed.xy[row] - image.xy[row];
            rows.local[3 * row..][..3].copy_from_slice(&image.point[row]);
            rows.kept[9 * row..][..9].copy_from_slice(&image.photo[row]);
        }
    }

    /// Rotation and translation of the first photo, and the component of a translation that changes most when the scale does.
    fn datum(&self, unknowns: &[f64]) -> Vec<usize> {
        let photos = self.photos(unknowns);
        let with_images = || (0..photos.len()).filter(|&photo| self.images_on[photo] > 0);
        let (false, Some(first)) = (self.placed, with_images().next()) else { return vec![] };
        let centre = photos[first].centre();
        let shifts = with_images().filter(|&photo| photo != first).flat_map(|photo| {
            let shift = apply(photos[photo].rotation(), &difference(&photos[photo].centre(), &centre));
            (0..3).map(move |k| (shift[k].abs(), 9 * photo + 3 + k))
        });
        let scale = shifts.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, unknown)| unknown);
        (9 * first..9 * first + 6).chain(scale).map(|unknown| 3 * self.points + unknown).collect()
    }
}
