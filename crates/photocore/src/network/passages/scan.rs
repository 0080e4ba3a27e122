//! Photos that are scanned films, or plates measured on a comparator.

use super::{Facts, PassageModel};
use crate::network::commons::CommonKind;
use crate::network::film::FilmOf;

/// The images of a photo are readings: those that its film, its scanner have where its camera has the image.
#[derive(Debug, Clone, PartialEq)]
pub struct Scan {
    /// The photo.
    pub photo: usize,
    /// Its film.
    pub film: FilmOf,
}

impl Scan {
    /// The name under which [`super::Passage::from_numbers`] knows it.
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

    /// All but weights of a pattern of several cells.
    fn everywhere(&self) -> Vec<usize> {
        let all = self.unknowns().into_iter().map(|(own, _)| own);
        all.filter(|own| !(self.film.has_cells() && self.film.weights.contains(own))).collect()
    }

    /// Knots of a lens step with images of the camera alone.
    fn is_of(&self, network: &Facts<'_>) -> bool {
        let camera = network.photos.get(self.photo).map(|&camera| network.cameras[camera]);
        camera.is_some_and(|own| own.knots().is_none()) && self.film.is_sound()
    }
}
