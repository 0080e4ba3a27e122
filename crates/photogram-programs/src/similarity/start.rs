//! Initial values of the absolute orientation.

use super::determinacy::{known_mean, spread};
use super::moments::Moments;
use super::transform::Similarity;
use super::{SimilarityError, Start, Station};
use photocore::geometry::{Vector3, rotation};

/// Largest ratio of sums of squares of another minimum and the best one, for an equal fit.
const AS_WELL: f64 = 4.0;
/// Largest difference of direction cosines from which initial values lead to the goal.
const CLOSE: f64 = 0.5;
/// Largest difference of the direction cosines of two rotations of the same minimum.
const SAME: f64 = 1e-4;
/// Misclosures, as a fraction of the size of the model, that are rounding.
const ROUNDING: f64 = 1e-9;

/// Source of the initial values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Started {
    /// Former result.
    Restart,
    /// Values of the report.
    Report,
    /// Closed form.
    ClosedForm,
}

/// Initial values, and alternatives.
#[derive(Debug)]
pub struct Chosen {
    pub similarity: Similarity,
    pub started: Started,
    /// Alternative orientations with a similar fit.
    pub alternatives: Vec<Similarity>,
}

/// Chooses initial values by the requested method; the scale may be fixed.
pub fn choose(stations: &[Station], start: Start, held: Option<f64>) -> Result<Chosen, SimilarityError> {
    let (control_centre, model_centre) = centres(stations);
    let only = |similarity, started| Chosen { similarity, started, alternatives: vec![] };
    match start {
        Start::Given(parameters) => {
            let mut given = Similarity::from_parameters(&parameters, control_centre, model_centre);
            given.scale = held.unwrap_or(given.scale);
            Ok(only(given, Started::Restart))
        }
        Start::Report => Ok(only(report(stations, control_centre, model_centre, held)?, Started::Report)),
        Start::ClosedForm | Start::Auto => {
            let moments = Moments::new(stations, control_centre, model_centre, held);
            let mut minima = moments.best()?;
            let report = report(stations, control_centre, model_centre, held).ok();
            let report = report.filter(|_| start == Start::Auto);
            let sum = |similarity: &Similarity| sum_of_squares(stations, similarity);
            minima.sort_by(|a, b| sum(a).total_cmp(&sum(b)));
            let Some(best) = minima.first().copied() else {
                // All minima are mirror images: the report's values will expose it.
                return report.map(|r| only(r, Started::Report)).ok_or(SimilarityError::Scale(f64::NAN));
            };
            let rounding = (ROUNDING * spread(stations)).powi(2);
            let as_well = |similarity: &Similarity| sum(similarity) <= AS_WELL * sum(&best) + rounding;
            let reached = report.and_then(|r| moments.descend(&r.rotation, &[])).filter(&as_well);
            let goal = reached.unwrap_or(best);
            let (similarity, started) = match report {
                Some(report) if apart(&report, &goal) < CLOSE => (report, Started::Report),
                _ => (goal, Started::ClosedForm),
            };
            let other = |minimum: &Similarity| as_well(minimum) && apart(minimum, &goal) > SAME;
            Ok(Chosen { similarity, started, alternatives: minima.into_iter().filter(other).collect() })
        }
    }
}

/// Returns the means of the known control coordinates and of the model.
fn centres(stations: &[Station]) -> (Vector3, Vector3) {
    let control = |k: usize, _| known_mean(stations, |s| s.known()[k].then(|| s.control[k]));
    let model = |k: usize, _| known_mean(stations, |s| Some(s.model[k]));
    (Vector3::from_fn(control), Vector3::from_fn(model))
}

fn sum_of_squares(stations: &[Station], similarity: &Similarity) -> f64 {
    let squares = |station: &Station| -> f64 {
        let u = similarity.misclosure(&station.control, &station.model);
        u.iter().zip(station.known()).filter(|(_, known)| *known).map(|(u, _)| u * u).sum()
    };
    stations.iter().map(squares).sum()
}

/// Returns the largest difference of the direction cosines of two rotations.
fn apart(a: &Similarity, b: &Similarity) -> f64 {
    (a.rotation - b.rotation).amax()
}

/// Returns initial values from the first two stations (TB 19, section 3, with kappa = theta_X - theta_x in the right quadrant): omega = phi
/// = 0, s from the distance, translations as means.
fn report(
    stations: &[Station],
    control_centre: Vector3,
    model_centre: Vector3,
    held: Option<f64>,
) -> Result<Similarity, SimilarityError> {
    let [first, second, ..] = stations else {
        return Err(SimilarityError::FirstStations("are not there"));
    };
    if !(first.pair() && second.pair()) {
        return Err(SimilarityError::FirstStations("have no horizontal coordinates"));
    }
    let [mut control, mut model] = [second.control - first.control, second.model - first.model];
    let ([x, y, _], [p, q, _]): ([f64; 3], [f64; 3]) = (control.into(), model.into());
    let kappa = (y * p - x * q).atan2(x * p + y * q);
    if !(first.elevation() && second.elevation()) {
        (control.z, model.z) = (0.0, 0.0);
    }
    let length = |v: Vector3| v[0].hypot(v[1]).hypot(v[2]);
    let scale = held.unwrap_or(length(model) / length(control));
    if !(x.hypot(y) > 0.0 && p.hypot(q) > 0.0) {
        return Err(SimilarityError::FirstStations("coincide in plan"));
    }
    let mut similarity = Similarity {
        rotation: rotation([0.0, 0.0, kappa]),
        scale,
        shift: Vector3::zeros(),
        control_centre,
        model_centre,
    };
    // With omega = phi = 0 neither sum needs a missing coordinate.
    let shift = |station: &Station, j: usize| {
        let known = station.known();
        let centred = similarity.centred(&station.control);
        let needed = Vector3::from_fn(|k, _| if known[k] { centred[k] } else { 0.0 });
        similarity.reduced(&station.model)[j] - scale * (similarity.rotation * needed)[j]
    };
    similarity.shift = Vector3::from_fn(|j, _| {
        let counts = |s: &Station| if j < 2 { s.pair() } else { s.elevation() };
        known_mean(stations, |station| counts(station).then(|| shift(station, j)))
    });
    Ok(similarity)
}
