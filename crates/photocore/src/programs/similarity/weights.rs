//! Standard deviations as the adjustment gets them: in a unit of its own, and none so small that a misclosure drowns in rounding.

use super::determinacy;
use super::start::Chosen;
use super::{SimilarityError, Station};

/// Standard deviations, as a fraction of the size of the model, to which those of the model are scaled inside at the most, and all of
/// them at the least: the criterion of convergence must mean something where the unit weight is arbitrary, and where the standard
/// deviations are far below the rounding of the coordinates.
const INNER_SD: f64 = 1e-7;
/// Beside the smallest positive standard deviation of its control, a model point is as good as exact with this fraction of it: the
/// cofactors of its misclosures differ by 1e-8 of themselves, and the normal equations keep half of their digits.
const EXACT: f64 = 1e-4;

/// Stations with their standard deviations multiplied by `inner`.
#[derive(Debug)]
pub struct Weighted {
    /// The stations.
    pub stations: Vec<Station>,
    /// The factor of all standard deviations.
    pub inner: f64,
}

impl Weighted {
    /// Scales the standard deviations of some stations; those of the model are raised where they are as good as exact.
    ///
    /// # Errors
    /// Standard deviations that make no unit of weight.
    pub fn new(stations: &[Station], start: &Chosen) -> Result<Self, SimilarityError> {
        let scale = start.similarity.scale;
        let misclosures = median(stations.iter().flat_map(|s| misclosure_sd(s, scale)));
        let model_sd = |station: &Station| {
            let control = positive_control_sd(station).fold(f64::INFINITY, f64::min) * scale;
            let least = EXACT * if control.is_finite() { control } else { misclosures };
            station.model_sd.map(|sd| sd.max(least))
        };
        let unit = INNER_SD * determinacy::spread(stations);
        let inner = (unit / median(stations.iter().flat_map(model_sd))).min((unit / misclosures).max(1.0));
        if !(inner.is_finite() && inner > 0.0) {
            return Err(SimilarityError::NotFinite);
        }
        let scaled = |station: &Station| Station {
            control_sd: station.control_sd.map(|sd| inner * sd),
            model_sd: model_sd(station).map(|sd| inner * sd),
            ..*station
        };
        Ok(Self { stations: stations.iter().map(scaled).collect(), inner })
    }
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_unstable_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Standard deviations of the known components that are neither exact nor without part.
fn positive_control_sd(station: &Station) -> impl Iterator<Item = f64> {
    let known = station.known();
    let sd = station.control_sd;
    (0..3).filter(move |&k| known[k] && sd[k] > 0.0).map(move |k| sd[k])
}

/// About the standard deviations of the misclosures of the known components, whatever the rotation.
fn misclosure_sd(station: &Station, scale: f64) -> impl Iterator<Item = f64> {
    let known = station.known();
    let [x, y, z] = station.model_sd;
    let model = x.hypot(y).hypot(z) / 3.0_f64.sqrt();
    let sd = station.control_sd;
    (0..3).filter(move |&k| known[k]).map(move |k| model.hypot(scale * sd[k]))
}
