//! Orientation of a model by least squares.

use super::error::{Cause, SimilarityError};
use super::misclosures::Weighted;
use super::model::{AsControl, CHANGES, SCALE};
use super::solution::Solution;
use super::start::Chosen;
use super::transform::Similarity;
use super::{Method, Options, Start, Station, determinacy, published, start};
use photocore::adjustment::{self, AdjustError, Problem, Status, Stop};
use photocore::normals::{Layout, Ordering, System};
use photocore::{Context, Threads};

/// Determines the seven parameters by least squares, on one new thread: control networks are small.
///
/// # Errors
/// The errors of [`orient_on`], or a thread that cannot be started.
pub fn orient(stations: &[Station], options: &Options) -> Result<Solution, SimilarityError> {
    orient_on(stations, options, &mut Context::new(&Threads::new(1)?))
}

/// Determines the parameters on the caller's threads, with progress.
///
/// # Errors
/// Control that does not determine the parameters, unavailable initial values, a mirror image, an interruption.
pub fn orient_on(
    stations: &[Station],
    options: &Options,
    context: &mut Context<'_>,
) -> Result<Solution, SimilarityError> {
    let held = options.scale.is_some();
    determinacy::check_counts(stations, held)?;
    // The library's solvers query the number of threads, which would start the global pool outside of `install`.
    let chosen = context.threads.install(|| {
        let chosen = start::choose(stations, options.start, options.scale)?;
        determinacy::check_geometry(stations, &chosen.similarity, held).map(|()| chosen)
    })?;
    match options.method {
        Method::Rigorous => adjust(stations, options, chosen, None, context),
        Method::Report | Method::FillIn => {
            let cycles = published::iterate(stations, options, &chosen.similarity)?;
            adjust(stations, options, chosen, Some(cycles), context)
        }
    }
}

/// Determines the seven parameters by least squares with equal weights, in closed form for full control.
///
/// # Errors
/// Control that does not determine the parameters, or a mirror image.
pub fn closed_form(stations: &[Station]) -> Result<Similarity, SimilarityError> {
    determinacy::check_counts(stations, false)?;
    Ok(start::choose(stations, Start::ClosedForm, None)?.similarity)
}

/// Adjusts by the engine; after the cycles of the bulletin only for cofactors and statistics.
fn adjust(
    stations: &[Station],
    options: &Options,
    chosen: Chosen,
    cycles: Option<published::Cycles>,
    context: &mut Context<'_>,
) -> Result<Solution, SimilarityError> {
    let start = cycles.as_ref().map_or(chosen.similarity, |cycles| cycles.similarity);
    if start.scale.is_nan() || start.scale <= 0.0 {
        return Err(SimilarityError::Scale(start.scale));
    }
    let weighted = Weighted::new(stations, &chosen)?;
    let problem = context.threads.install(|| problem(&weighted.stations, &start, options.scale.is_some()))?;
    let engine = adjustment::Options {
        method: adjustment::Method::Damped(Stop::Fraction(options.tolerance)),
        max_iterations: if cycles.is_some() { 0 } else { options.max_iterations },
        ..Default::default()
    };
    let mut adjusted = adjustment::adjust(&problem, &engine, context).map_err(|error| match error {
        AdjustError::Layout(error) => error.into(),
        AdjustError::Stopped(stopped) => SimilarityError::Stopped(stopped),
        AdjustError::NotFinite => SimilarityError::NotFinite,
        AdjustError::UndeterminedLocals(stations) => {
            SimilarityError::Undetermined { cause: Cause::Singular, stations }
        }
        AdjustError::Undetermined(_) => {
            SimilarityError::Undetermined { cause: Cause::Singular, stations: vec![] }
        }
    })?;
    if let Some(cycles) = &cycles {
        adjusted.status = if cycles.converged { Status::Converged } else { Status::NotConverged };
    }
    let solution = context
        .threads
        .install(|| Solution::new(&weighted, &problem, &adjusted, chosen, cycles, options.scale.is_some()))?;
    let scale = solution.similarity.scale;
    if scale.is_nan() || scale <= 0.0 { Err(SimilarityError::Scale(scale)) } else { Ok(solution) }
}

/// Builds the least-squares problem: control coordinates are local blocks of three, the seven parameters one retained block.
fn problem(
    stations: &[Station],
    start: &Similarity,
    held: bool,
) -> Result<Problem<AsControl>, SimilarityError> {
    let (mut initial, mut prior, mut sd) = (vec![], vec![], vec![]);
    for station in stations {
        let known = station.known();
        let given = start.centred(&station.control);
        let carried = start.centred(&start.control_at(&station.model));
        for k in 0..3 {
            initial.push(if known[k] { given[k] } else { carried[k] });
            prior.push(if known[k] { given[k] } else { 0.0 });
            sd.push(if known[k] { station.control_sd[k] } else { f64::INFINITY });
        }
    }
    let [x, y, z] = start.shift.into();
    let parameters = [0.0, 0.0, 0.0, start.scale, x, y, z];
    initial.extend(parameters);
    prior.extend(parameters);
    sd.extend((0..CHANGES).map(|i| if held && i == SCALE { 0.0 } else { f64::INFINITY }));
    let count = stations.len();
    let layout = Layout::new(3, 3, &[CHANGES], (0..=count).collect(), vec![0; count])?;
    Ok(Problem {
        model: AsControl::new(stations, start),
        system: System::new(layout, Ordering::Input)?,
        observation_sd: stations.iter().flat_map(|station| station.model_sd).collect(),
        initial,
        prior,
        sd,
    })
}
