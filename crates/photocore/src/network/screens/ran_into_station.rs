//! Points that run into a station while a network is adjusted.

use super::leaving::{Ended, Leaves};
use crate::network::Image;
use crate::network::median::median;
use crate::network::model::Bundle;
use crate::network::selection::{Dropped, Reason};
use crate::network::stations::{Station, Stations};

/// A point has run into a station when its share in what the station learns is so many times that of the others in the mean: it is
/// ten thousand times nearer than they are, and rounding leaves eight digits of what they say.
const NEAR: f64 = 1e8;
/// A point a hundred times nearer than the others is on its way there,
const ON_ITS_WAY: f64 = 1e4;
/// when no other photo tells it from the station: their images there, before and after a step, are closer than so many standard
/// deviations.
const SAME_PLACE: f64 = 3.0;

/// Points that an adjustment has stopped for, so that it can go on without them: they have run into a station, or out of the network.
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
    /// Its share in what the station learns, in those of the others in the mean.
    share: f64,
}

/// What the points that a photo sees have as shares in what its station learns.
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

    /// A share in those of the others in the mean, of so many images; None unless it is much larger.
    fn ratio(&self, own: f64, images: usize) -> Option<f64> {
        let others = (self.sum - own).max(0.0) / (images as f64 - 1.0).max(1.0);
        (others > 0.0 && own > ON_ITS_WAY * others).then(|| own / others)
    }
}

impl Bundle {
    /// Points that have run into a station, or are on their way there: two rays that meet there ask for it.
    pub fn run_into_stations(&self, before: &[f64], after: &Stations) -> Vec<usize> {
        let mut near = self.near_stations(after);
        if !near.is_empty() {
            let before = self.evaluated(before);
            near.retain(|near| near.share > NEAR || self.is_same_place(near, &before, after));
        }
        near.dedup_by_key(|near| near.point);
        near.iter().map(|near| near.point).collect()
    }

    /// Points much nearer to a station than the others that it sees.
    ///
    /// The image of a point turns by 1 / distance when point or station move; what its station learns from it, and loses again when
    /// the point is eliminated, is the square of that.
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

    /// Whether nothing but its image on that photo tells a point from the station it is near to, a step having changed nothing in that.
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
