//! Adjustment of a network: iterations, and exclusions between them.

use std::sync::Arc;

use nalgebra::DMatrix;

use super::error::NetworkError;
use super::input::{InnerConstraints, Network, NetworkDatum, Options, State};
use super::problem::{Assembled, Reached};
use super::screens::{Restart, ScreenInput, Screening};
use super::solution::{Joint, Solution};
use super::trial::Converged;
use crate::adjustment::{self, AdjustError, Adjustment, Method, Requests};
use crate::{Context, Threads};

/// An adjustment to be run: initial state, threads, progress function and datum.
///
/// ```no_run
/// # use photocore::network::{Network, NetworkError, Options, Solution};
/// # fn again(network: &Network, before: &Solution) -> Result<Solution, NetworkError> {
/// let options = Options::default();
/// network.adjustment(&options).from_state(&before.state).run()
/// # }
/// ```
pub struct NetworkAdjustment<'a> {
    network: &'a Network,
    options: Options,
    state: Option<&'a State>,
    datum: Option<&'a InnerConstraints>,
    /// Points with joint cofactors; Some if the results for tests are stored.
    keep: Option<&'a [usize]>,
}

impl<'a> NetworkAdjustment<'a> {
    /// Starts from the final state of an adjustment of the network, perhaps with other weights. The elimination order and the exclusion of
    /// points at stations are adopted.
    #[must_use]
    pub fn from_state(mut self, state: &'a State) -> Self {
        self.options.ordering = state.ordering;
        self.state = Some(state);
        self
    }

    /// Transforms a free network to the datum of inner constraints.
    #[must_use]
    pub fn in_datum(mut self, datum: &'a InnerConstraints) -> Self {
        self.datum = Some(datum);
        self
    }

    /// Stores the results for tests ([`Solution::converged`]) if the adjustment converges by least squares and memory suffices; it costs 5
    /// % of the time. Joint cofactors of some points ([`Solution::joint`]) are also computed from the last factor.
    #[must_use]
    pub fn kept(mut self, points: &'a [usize]) -> Self {
        self.keep = Some(points);
        self
    }

    /// Runs the adjustment on threads of its own ([`NetworkAdjustment::run_in`]).
    ///
    /// # Errors
    /// The errors of [`NetworkAdjustment::run_in`], or threads that cannot be started.
    pub fn run(&self) -> Result<Solution, NetworkError> {
        self.run_in(&mut Context::new(&Threads::new(self.options.adjustment.threads)?))
    }

    /// Runs the adjustment on threads of the caller, with progress.
    ///
    /// # Errors
    /// An inconsistent or empty network, undetermined parameters, a state of another network. A datum for a network that is not free, or
    /// that its points and photos cannot define. An interruption.
    pub fn run_in(&self, context: &mut Context<'_>) -> Result<Solution, NetworkError> {
        let Self { network, options, datum, .. } = self;
        network.check()?;
        let mut start = self.state;
        let mut screening = Screening::new(network.left_out(network.untouched_photos(), start)?);
        let mut before: Option<(Adjustment, Reached)> = None;
        loop {
            let reached = before.as_ref().map(|(_, reached)| reached);
            let mut assembled =
                network.assembled(options, &screening.leaving.left_out, reached, context.threads)?;
            if let Some(state) = start.take() {
                assembled.start_from(state)?;
            }
            datum.map_or(Ok(()), |inner| network.check_carriers(inner, &assembled))?;
            let done = before.as_ref().map_or(0, |(before, _)| before.iterations.len());
            let joint = self.keep.map(|points| assembled.taking_part(points));
            let ended = self.iterated(&assembled, joint.as_deref(), done, context);
            let reopened = ended.as_ref().ok().and_then(|ended| reopened(&assembled, ended));
            let detect =
                || screening.detect(&ScreenInput { adjusted: &ended, assembled: &assembled, options });
            let begin = reopened.or_else(detect);
            match (begin, ended) {
                (Some(Restart::FromStart), _) => before = None,
                (Some(Restart::AsBefore), _) => {}
                (Some(Restart::FromHere), Ok(mut ended)) => {
                    ended.prepend(before.take().map(|(earlier, _)| earlier));
                    let reached = assembled.reached(&ended.unknowns, network.points.len());
                    before = Some((ended, reached));
                }
                (None, Ok(mut ended)) => {
                    ended.prepend(before.map(|(earlier, _)| earlier));
                    return self.solved(joint, assembled, ended, screening, context);
                }
                (_, Err(error)) => {
                    let error = NetworkError::new(error, &assembled);
                    return Err(network.name(error, &assembled, &assembled.problem.initial, context.threads));
                }
            }
        }
    }

    /// Iterates; `done` is the number of preceding iterations.
    fn iterated(
        &self,
        assembled: &Assembled,
        joint: Option<&[(usize, usize)]>,
        done: usize,
        context: &mut Context<'_>,
    ) -> Result<Adjustment, AdjustError> {
        let (problem, mut own) = (&assembled.problem, self.options.adjustment);
        own.max_iterations = own.max_iterations.saturating_sub(done);
        let plain = own.covariance && own.loss.is_none();
        let in_datum;
        let mut requests = Requests::default();
        match self.datum {
            // The adjustment runs in the requested datum. Exceptions: weights of a loss are known only at the end; trajectories follow a
            // transformation only approximately, so that steps after it would not be short.
            Some(inner)
                if plain
                    && matches!(own.method, Method::Damped(_))
                    && problem.model.mounts.trajectories().is_empty() =>
            {
                in_datum = assembled.datum(inner);
                requests.datum = Some((&in_datum.0, &in_datum.1));
            }
            Some(_) => own.covariance = false,
            None => {}
        }
        let by_groups = self.datum.is_none() && plain && !matches!(own.method, Method::Full(_));
        let joint =
            joint.filter(|_| by_groups && assembled.may_keep(&self.options, context.threads)).map(|points| {
                let unknowns = |&(_, place): &(usize, usize)| problem.model.of_point(place);
                points.iter().flat_map(unknowns).collect::<Vec<usize>>()
            });
        if self.options.photo_corrections {
            requests.history = problem.model.blocks.first[self.network.photos.len()];
        }
        requests.by_groups = joint.as_deref().map(|joint| (joint, self.options.memory));
        adjustment::adjust_with(problem, &own, requests, context)
    }

    /// Returns the solution in the requested datum.
    fn solved(
        &self,
        joint: Option<Vec<(usize, usize)>>,
        assembled: Assembled,
        mut ended: Adjustment,
        Screening { leaving, .. }: Screening,
        context: &mut Context<'_>,
    ) -> Result<Solution, NetworkError> {
        let Self { network, options, datum, .. } = self;
        let lost = match (ended.lost, datum) {
            (None, Some(inner)) => take_to(inner, &options.adjustment, &assembled, &mut ended, context)?,
            (lost, _) => lost.unwrap_or(0.0),
        };
        let joint = joint.zip(ended.joint.take()).map(|(points, found)| {
            let (points, size) = (points.into_iter().map(|(point, _)| point).collect(), found.len().isqrt());
            Joint { points, cofactors: DMatrix::from_vec(size, size, found) }
        });
        let left_out = &leaving.left_out.points;
        let collapsed = (0..left_out.len()).filter(|&point| left_out[point]).collect();
        let minimal = datum.is_none() && assembled.is_minimal(&ended.unknowns, context.threads);
        let (mut solution, found) = context
            .threads
            .install(|| Solution::with_leverages(network, options, &assembled, ended, collapsed));
        let undetermined = solution.undetermined.take();
        solution.undetermined = undetermined
            .map(|error| network.name(error, &assembled, &solution.state.unknowns, context.threads));
        solution.datum.minimal_control = minimal;
        solution.state.datum = datum.cloned().map(NetworkDatum::Inner);
        solution.datum.relative_error = lost;
        solution.dropped.extend(leaving.harmful);
        solution.dropped.sort_by_key(|own| own.point);
        solution.joint = joint.filter(|_| found.is_some()).map(Arc::new);
        solution.converged =
            found.map(|found| Box::new(Converged::new(assembled, options.adjustment, found)));
        Ok(solution)
    }
}

impl Network {
    /// Adjusts the network by least squares, on its own threads.
    ///
    /// Points that their image observations cannot determine are excluded first (see [`super::Dropped`]). Points that move to the station
    /// of a photo are excluded later, and the adjustment continues without them. Observations of excluded points are ignored.
    ///
    /// # Errors
    /// Errors of [`NetworkAdjustment::run`].
    pub fn adjust(&self, options: &Options) -> Result<Solution, NetworkError> {
        self.adjustment(options).run()
    }

    /// Returns an adjustment with further options: initial state and datum.
    pub fn adjustment(&self, options: &Options) -> NetworkAdjustment<'_> {
        NetworkAdjustment { network: self, options: *options, state: None, datum: None, keep: None }
    }
}

/// Returns a restart if images have moved beyond the active knots of their lens spline.
fn reopened(assembled: &Assembled, ended: &Adjustment) -> Option<Restart> {
    (assembled.problem.model.images_beyond_knots(&ended.unknowns) > 0).then_some(Restart::FromHere)
}

/// Transforms an adjusted network to the datum of inner constraints; returns the relative rounding error of its variances.
fn take_to(
    inner: &InnerConstraints,
    options: &adjustment::Options,
    assembled: &Assembled,
    adjusted: &mut Adjustment,
    context: &mut Context<'_>,
) -> Result<f64, NetworkError> {
    let (datum, reference) = assembled.datum(inner);
    let problem = &assembled.problem;
    Ok(adjusted.take_to(problem, options, &datum, &reference, context)?)
}
