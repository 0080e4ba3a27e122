//! Points that move to the position of a station during the adjustment.

use super::leaving::{Ended, Leaves};
use crate::network::input::Image;
use crate::network::median::median;
use crate::network::model::Bundle;
use crate::network::selection::{Dropped, Reason};
use crate::network::stations::{Station, Stations};

/// Ratio of a point's share of the station's information to the mean of the others, above which it is at the station. The point is 10,000
/// times nearer, and rounding leaves eight digits for the others.
const NEAR: f64 = 1e8;
/// Ratio above which a point is approaching the station: it is 100 times nearer than the others.
const ON_ITS_WAY: f64 = 1e4;
/// Distance of point and station in other photos, in standard deviations, below which their images are equal (before and after a step).
const SAME_PLACE: f64 = 3.0;

/// Returns the points for which an adjustment has stopped: they ran into a station or out of the network.
pub(super) fn look(ended: &Ended<'_>) -> Leaves {
    let Ok(adjusted) = ended.adjusted else { return Leaves::default() };
    if adjusted.collapsed.is_empty() {
        return Leaves::default();
    }
    let squares = ended.assembled.nearest_stations(&adjusted.unknowns);
    let middle = median(squares.clone()).unwrap_or(f64::INFINITY);
    let dropped = |&local: &usize| Dropped {
        point: ended.assembled.points[local],
        reason: if squares[local] > middle { Reason::RanOff } else { Reason::RanIntoStation },
    };
    Leaves { points: adjusted.collapsed.iter().map(dropped).collect(), photos: vec![] }
}

/// A point much nearer to a station than the others.
struct NearStation {
    point: usize,
    photo: usize,
    /// Ratio of its share of the station's information to the mean of the others.
    share: f64,
}

/// Shares of the points of a photo in the information of its station.
#[derive(Debug, Clone, Copy, Default)]
struct Shares {
    sum: f64,
    largest: f64,
}

impl Shares {
    fn add(&mut self, share: f64) {
        self.sum += share;
        self.largest = self.largest.max(share);
    }

    /// Returns the ratio of a share to the mean of the others, for `images` images; None unless it is large.
    fn ratio(&self, own: f64, images: usize) -> Option<f64> {
        let others = (self.sum - own).max(0.0) / (images as f64 - 1.0).max(1.0);
        (others > 0.0 && own > ON_ITS_WAY * others).then(|| own / others)
    }
}

impl Bundle {
    /// Returns points at a station or approaching it, to which their rays lead them.
    pub fn run_into_stations(&self, before: &[f64], after: &Stations) -> Vec<usize> {
        let mut near = self.near_stations(after);
        if !near.is_empty() {
            let before = self.evaluated(before);
            near.retain(|near| near.share > NEAR || self.is_same_place(near, &before, after));
        }
        near.dedup_by_key(|near| near.point);
        near.iter().map(|near| near.point).collect()
    }

    /// Returns points much nearer to a station than its other points.
    ///
    /// The image of a point rotates by 1 / distance per displacement of point or station. Its share of the station's information, which the
    /// elimination of the point removes again, is the square of this.
    fn near_stations(&self, stations: &Stations) -> Vec<NearStation> {
        let share = |point: usize, image: &Image| {
            let centre = stations.photos[image.photo].orientation.centre();
            (stations.points[point].position() - centre).norm_squared().recip()
        };
        let mut shares = vec![Shares::default(); stations.photos.len()];
        for point in 0..self.points.len() {
            self.images_of(point).iter().for_each(|image| shares[image.photo].add(share(point, image)));
        }
        let has_near = |(shares, &images): (&Shares, &usize)| shares.ratio(shares.largest, images).is_some();
        if !shares.iter().zip(&self.images_on).any(has_near) {
            return vec![];
        }
        let near_station = |point: usize, image: &Image| {
            let photo = image.photo;
            let share = shares[photo].ratio(share(point, image), self.images_on[photo])?;
            Some(NearStation { point, photo, share })
        };
        let of_point =
            |point| self.images_of(point).iter().filter_map(move |image| near_station(point, image));
        (0..self.points.len()).flat_map(of_point).collect()
    }

    /// Returns true if, before and after the step, all other images of a point agree with the image of the station.
    fn is_same_place(&self, near: &NearStation, before: &Stations, after: &Stations) -> bool {
        let is_same = |image: &Image| {
            let images = [before, after].map(|stations| {
                let station = stations.photos[near.photo].orientation.centre();
                let Station { orientation, camera } = &stations.photos[image.photo];
                [stations.points[near.point].position(), station]
                    .map(|place| camera.image(&orientation.pose().sight(&place)))
            });
            let [.., station] = images[1];
            let sd = after.sd_in_camera(image);
            let is_close = |xy: &[f64; 2]| (0..2).all(|k| (xy[k] - station[k]).abs() < SAME_PLACE * sd[k]);
            images.as_flattened().iter().all(is_close)
        };
        let mut elsewhere =
            self.images_of(near.point).iter().filter(|image| image.photo != near.photo).peekable();
        let free = self.points[near.point].held() == [false; 3];
        free && elsewhere.peek().is_some() && elsewhere.all(is_same)
    }
}
