//! Scanned films, or plates measured on a comparator.

use super::{Facts, PassageModel};
use crate::network::commons::CommonKind;
use crate::network::film::FilmOf;

/// Images of this photo are scanner readings: camera image -> film -> scanner.
#[derive(Debug, Clone, PartialEq)]
pub struct Scan {
    /// Photo.
    pub photo: usize,
    /// Film of the photo.
    pub film: FilmOf,
}

impl Scan {
    /// Name in [`super::Passage::from_numbers`].
    pub const NAME: &'static str = "scan";

    /// See [`FilmOf::from_numbers`].
    pub(super) fn from_numbers(commons: &[usize], of: &[usize], numbers: &[f64]) -> Option<Self> {
        let &[photo] = of else { return None };
        Some(Self { photo, film: FilmOf::from_numbers(commons, numbers)? })
    }
}

impl PassageModel for Scan {
    fn unknowns(&self) -> Vec<(usize, CommonKind)> {
        let film = self.film.commons(0);
        film.into_iter().chain(self.film.weights.iter().map(|&own| (own, CommonKind::Pattern))).collect()
    }

    fn photo(&self) -> Option<usize> {
        Some(self.photo)
    }

    /// All except the weights of a pattern of several cells.
    fn everywhere(&self) -> Vec<usize> {
        let all = self.unknowns().into_iter().map(|(own, _)| own);
        all.filter(|own| !(self.film.has_cells() && self.film.weights.contains(own))).collect()
    }

    /// Lenses with knots are excluded, because their partials require images in the camera.
    fn is_of(&self, network: &Facts<'_>) -> bool {
        let camera = network.photos.get(self.photo).map(|&camera| network.cameras[camera]);
        camera.is_some_and(|own| own.knots().is_none()) && self.film.is_sound()
    }
}
