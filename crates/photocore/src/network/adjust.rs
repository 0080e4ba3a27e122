//! The adjustment of a network: iterations, and what leaves it between them.

use std::ops::ControlFlow;

use rayon::ThreadPool;

use super::problem::{Assembled, Reached};
use super::screens::{Begin, Ended, Screening};
use super::{Converged, InnerConstraints, Network, NetworkDatum, NetworkError, Options, Solution, State};
use crate::adjustment::{self, AdjustError, Adjustment, Event, Method};

impl Network {
    /// Adjusts the network by least squares.
    ///
    /// Points that their image points cannot determine are left out first (see [`super::Dropped`]). So are points that run into the station
    /// of a photo: the adjustment goes on without them from where it was. `watch` is called on the calling thread; when it breaks, the
    /// adjustment stops. Observations of points that are left out do not take part.
    ///
    /// # Errors
    /// A network that contradicts itself, has nothing to adjust, or leaves unknowns undetermined; an interruption.
    pub fn adjust(
        &self,
        options: &Options,
        pool: &ThreadPool,
        watch: &mut dyn FnMut(Event) -> ControlFlow<()>,
    ) -> Result<Solution, NetworkError> {
        self.adjusted(options, (None, false), None, pool, watch)
    }

    /// The same, and keeps what tests of it need ([`Solution::converged`]) where it converges by least squares and there is memory: it
    /// takes about a twentieth longer.
    ///
    /// # Errors
    /// Those of [`Network::adjust`].
    pub fn adjust_and_keep(
        &self,
        options: &Options,
        pool: &ThreadPool,
        watch: &mut dyn FnMut(Event) -> ControlFlow<()>,
    ) -> Result<Solution, NetworkError> {
        self.adjusted(options, (None, true), None, pool, watch)
    }

    /// Adjusts the network from where an adjustment of it has ended, perhaps with other weights: in the order that was in force, and
    /// without the points that had run into a station.
    ///
    /// # Errors
    /// Those of [`Network::adjust`]; a state that is not of this network.
    pub fn adjust_again(
        &self,
        options: &Options,
        state: &State,
        pool: &ThreadPool,
        watch: &mut dyn FnMut(Event) -> ControlFlow<()>,
    ) -> Result<Solution, NetworkError> {
        let options = Options { ordering: state.ordering, ..*options };
        self.adjusted(&options, (None, false), Some(state), pool, watch)
    }

    /// Adjusts a network that is free, and takes it to the datum of inner constraints.
    ///
    /// # Errors
    /// Those of [`Network::adjust`]; a network that is not free, or points and photos that do not carry its datum.
    pub fn adjust_in_datum(
        &self,
        options: &Options,
        datum: &InnerConstraints,
        pool: &ThreadPool,
        watch: &mut dyn FnMut(Event) -> ControlFlow<()>,
    ) -> Result<Solution, NetworkError> {
        self.adjusted(options, (Some(datum), false), None, pool, watch)
    }

    fn adjusted(
        &self,
        options: &Options,
        (datum, keep): (Option<&InnerConstraints>, bool),
        mut start: Option<&State>,
        pool: &ThreadPool,
        watch: &mut dyn FnMut(Event) -> ControlFlow<()>,
    ) -> Result<Solution, NetworkError> {
        self.check()?;
        let mut screening = Screening::new(self.left_out(self.untouched_photos(), start)?);
        let mut before: Option<(Adjustment, Reached)> = None;
        loop {
            let reached = before.as_ref().map(|(_, reached)| reached);
            let mut assembled = self.assembled(options, &screening.leaving.left_out, reached, pool)?;
            if let Some(state) = start.take() {
                assembled.go_on_from(state)?;
            }
            datum.map_or(Ok(()), |inner| self.check_carriers(inner, &assembled))?;
            let done = before.as_ref().map_or(0, |(before, _)| before.iterations.len());
            let ended = iterated(&assembled, options, (datum, keep), done, pool, watch);
            let begin = screening.look(&Ended { adjusted: &ended, assembled: &assembled, options });
            match (begin, ended) {
                (Some(Begin::FromStart), _) => before = None,
                (Some(Begin::AsBefore), _) => {}
                (Some(Begin::FromHere), Ok(mut ended)) => {
                    ended.go_on_from(before.take().map(|(earlier, _)| earlier));
                    let reached = assembled.reached(&ended.unknowns, self.points.len());
                    before = Some((ended, reached));
                }
                (None, Ok(mut ended)) => {
                    ended.go_on_from(before.map(|(earlier, _)| earlier));
                    return self.solved(options, datum, assembled, ended, screening, pool, watch);
                }
                (_, Err(error)) => {
                    let error = NetworkError::new(error, &assembled);
                    return Err(self.name(error, &assembled, &assembled.problem.initial, pool));
                }
            }
        }
    }

    /// What has been found, in the datum that is asked for.
    fn solved(
        &self,
        options: &Options,
        datum: Option<&InnerConstraints>,
        assembled: Assembled,
        mut ended: Adjustment,
        Screening { leaving, .. }: Screening,
        pool: &ThreadPool,
        watch: &mut dyn FnMut(Event) -> ControlFlow<()>,
    ) -> Result<Solution, NetworkError> {
        let lost = match (ended.lost, datum) {
            (None, Some(inner)) => take_to(inner, &options.adjustment, &assembled, &mut ended, pool, watch)?,
            (lost, _) => lost.unwrap_or(0.0),
        };
        let left_out = &leaving.left_out.points;
        let collapsed = (0..left_out.len()).filter(|&point| left_out[point]).collect();
        let minimal = datum.is_none() && assembled.is_minimal(&ended.unknowns, pool);
        let (mut solution, found) =
            pool.install(|| Solution::with_tried(self, options, &assembled, ended, collapsed));
        let undetermined = solution.undetermined.take();
        solution.undetermined =
            undetermined.map(|error| self.name(error, &assembled, &solution.state.unknowns, pool));
        solution.minimal_control = minimal;
        solution.state.datum = datum.cloned().map(NetworkDatum::Inner);
        solution.relative_error = lost;
        solution.dropped.extend(leaving.harmful);
        solution.dropped.sort_unstable_by_key(|dropped| dropped.point);
        solution.converged =
            found.map(|found| Box::new(Converged::new(assembled, options.adjustment, found)));
        Ok(solution)
    }
}

/// Iterates, after so many iterations that were done before.
fn iterated(
    assembled: &Assembled,
    options: &Options,
    (datum, keep): (Option<&InnerConstraints>, bool),
    done: usize,
    pool: &ThreadPool,
    watch: &mut dyn FnMut(Event) -> ControlFlow<()>,
) -> Result<Adjustment, AdjustError> {
    let (problem, mut own) = (&assembled.problem, options.adjustment);
    own.max_iterations = own.max_iterations.saturating_sub(done);
    let plain = own.covariance && own.loss.is_none();
    match datum {
        // Cofactors are those of the datum that is asked for; weights that a loss leaves are known at the end only.
        Some(inner) if plain && matches!(own.method, Method::Damped(_)) => {
            let (datum, reference) = assembled.datum(inner);
            return adjustment::adjust_in_datum(problem, &own, &datum, &reference, pool, watch);
        }
        Some(_) => own.covariance = false,
        None => {}
    }
    let by_groups = keep && datum.is_none() && plain && !matches!(own.method, Method::Full(_));
    if by_groups && assembled.may_keep(options) {
        adjustment::adjust_by_groups(problem, &own, pool, watch)
    } else {
        adjustment::adjust(problem, &own, pool, watch)
    }
}

/// Takes an adjusted network to the datum of inner constraints; returns how large a part of its variances may be rounding.
fn take_to(
    inner: &InnerConstraints,
    options: &adjustment::Options,
    assembled: &Assembled,
    adjusted: &mut Adjustment,
    pool: &ThreadPool,
    watch: &mut dyn FnMut(Event) -> ControlFlow<()>,
) -> Result<f64, NetworkError> {
    let (datum, reference) = assembled.datum(inner);
    let total = assembled.points.len();
    let mut between = |done| watch(Event::Progress { phase: adjustment::Phase::Invert, done, total });
    let problem = &assembled.problem;
    Ok(adjusted.take_to(problem, options, &datum, &reference, pool, &mut between)?)
}
