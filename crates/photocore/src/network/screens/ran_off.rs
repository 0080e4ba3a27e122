//! Points that diverge to infinity during the adjustment.

use super::leaving::{Ended, FEW, Leaves};
use crate::adjustment::{Method, Status};
use crate::network::input::Image;
use crate::network::median::median;
use crate::network::model::Bundle;
use crate::network::selection::{Dropped, Reason};
use crate::network::stations::{Station, Stations};

/// Ratio of own to median station distance above which a point may be diverging.
const FAR: f64 = 100.0;
/// Distance of its images from the images of infinity, in standard deviations, below which the point may be at infinity.
const AT_INFINITY: f64 = 1.0;
/// Minimum relative growth of its distance in a step.
const GROWS: f64 = 0.003;
/// Multiple of the distance of a point that represents infinity.
const INFINITE: f64 = 1e6;
/// Ratio to the median station distance above which (or below its reciprocal) a point has diverged.
const ASTRAY: f64 = 1e3;

/// Returns free points that an adjustment without convergence has moved out of the network or to a station, if these are few.
///
/// Diverging rays fit best at infinity, which least squares approaches slowly while photos rotate accordingly.
pub(super) fn look(ended: &Ended<'_>) -> Leaves {
    let Ok(adjusted) = ended.adjusted else { return Leaves::default() };
    let damped = matches!(ended.options.adjustment.method, Method::Damped(_));
    if adjusted.status != Status::NotConverged || !damped {
        return Leaves::default();
    }
    let squares = ended.assembled.nearest_stations(&adjusted.unknowns);
    let Some(middle) = median(squares.clone()) else { return Leaves::default() };
    let model = &ended.assembled.problem.model;
    let is_out = |&local: &usize| {
        let apart = (squares[local] / middle).sqrt();
        model.points[local].held() == [false; 3] && !(ASTRAY.recip()..=ASTRAY).contains(&apart)
    };
    let mut out: Vec<usize> = (0..model.locals).filter(is_out).collect();
    if FEW * out.len() > model.locals {
        out.clear();
    }
    let dropped = |i: usize| Dropped { point: ended.assembled.points[i], reason: Reason::RanOff };
    Leaves { points: out.into_iter().map(dropped).collect(), photos: vec![] }
}

impl Bundle {
    /// Returns free points that diverging or parallel rays move out of the network, if these are few.
    ///
    /// Steps are changes of coordinates, so that a point at infinity is only a limit: the image residuals decrease with the reciprocal
    /// distance.
    pub fn lead_nowhere(&self, before: &[f64], after: &Stations) -> Vec<usize> {
        let squares: Vec<f64> = (0..self.locals).map(|point| self.nearest(point, after)).collect();
        let Some(middle) = median(squares.clone()) else { return vec![] };
        let is_far =
            |&point: &usize| squares[point] > FAR * FAR * middle && self.is_at_infinity(point, after);
        let mut out: Vec<usize> = (0..self.locals).filter(is_far).collect();
        if out.is_empty() {
            return out;
        }
        let before = self.evaluated(before);
        let grown = (1.0 + GROWS) * (1.0 + GROWS);
        out.retain(|&point| squares[point] > grown * self.nearest(point, &before));
        if FEW * out.len() <= self.locals { out } else { vec![] }
    }

    /// Returns the squared distance of a point from the nearest station that observes it.
    fn nearest(&self, point: usize, stations: &Stations) -> f64 {
        let place = stations.points[point].position();
        let square =
            |image: &Image| (place - stations.photos[image.photo].orientation.centre()).norm_squared();
        self.images_of(point).iter().map(square).fold(f64::INFINITY, f64::min)
    }

    /// Returns true if a free point may as well be at infinity, on the ray of its first image.
    fn is_at_infinity(&self, point: usize, stations: &Stations) -> bool {
        let images = self.images_of(point);
        let Some(first) = images.first().filter(|_| self.points[point].held() == [false; 3]) else {
            return false;
        };
        let place = stations.points[point].position();
        let station = stations.photos[first.photo].orientation.centre();
        let places = [place, station + INFINITE * (place - station)];
        images.iter().all(|image| {
            let Station { orientation, camera } = &stations.photos[image.photo];
            let [here, there] = places.map(|place| camera.image(&orientation.pose().sight(&place)));
            let sd = stations.sd_in_camera(image);
            (0..2).all(|k| (here[k] - there[k]).abs() < AT_INFINITY * sd[k])
        })
    }
}
