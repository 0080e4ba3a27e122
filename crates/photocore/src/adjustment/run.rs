//! Operations common to all iterations: formation, factorisation, solution and final cofactors.

use std::ops::ControlFlow;
use std::time::Instant;

use super::anderson::AndersonHistory;
use super::control::{AFTER_FAILURES, ALWAYS, NEAR};
use super::datum::{Adjusted, Basis, Datum, moved};
use super::equations::ObservationEquations;
use super::linearized::Linearized;
use super::loss::Reweighting;
use super::options::{Method, Options, Published, Status, leaves_cofactors};
use super::problem::{AnyProblem, Evaluated, Model, Problem};
use super::result::{AdjustError, Adjustment, PhaseTimes};
use crate::normals::{FactorOptions, InvertOptions, SolveOptions};
use crate::{Context, Event, Iteration, Threads};

impl<M: Model> Problem<M> {
    /// Adjusts by least squares on its own threads; [`adjust`] uses those of the caller and reports progress.
    ///
    /// # Errors
    /// Lengths that contradict the layout, undetermined unknowns, observations that cannot be computed, or threads that cannot be started.
    pub fn adjust(&self, options: &Options) -> Result<Adjustment, AdjustError> {
        adjust(self.any(), options, &mut Context::new(&Threads::new(options.threads)?))
    }
}

/// Adjusts a problem by least squares.
///
/// # Errors
/// Lengths that contradict the layout, undetermined unknowns, observations that cannot be computed, or an interruption.
pub fn adjust(
    problem: &AnyProblem<'_>,
    options: &Options,
    context: &mut Context<'_>,
) -> Result<Adjustment, AdjustError> {
    adjust_with(problem, options, Requests::default(), context)
}

/// Further results of an adjustment.
#[derive(Debug, Clone, Copy, Default)]
pub struct Requests<'a> {
    /// Datum of a free network, and the values from which its carriers move least, usually the initial values. The network is transformed
    /// before the last formation, which then also provides the cofactors. If this succeeds, [`Adjustment::lost`] is set. Otherwise cofactors
    /// are missing, and the caller must call [`Adjustment::take_to`].
    pub datum: Option<(&'a Datum, &'a [f64])>,
    /// Data for tests of groups of observations, which [`Leverages::of`] uses: unknowns with mutual cofactors ([`Adjustment::joint`]),
    /// computed from the last factor, and the maximum size of these in bytes, above which they are omitted (None for unlimited).
    ///
    /// [`Leverages::of`]: super::Leverages::of
    pub by_groups: Option<(&'a [usize], Option<usize>)>,
    /// Number of the first retained unknowns whose values are stored at every iteration ([`Adjustment::history`]).
    pub history: usize,
}

/// Adjusts as [`adjust`], with further results.
///
/// # Errors
/// As for [`adjust`].
pub fn adjust_with(
    problem: &AnyProblem<'_>,
    options: &Options,
    requests: Requests<'_>,
    context: &mut Context<'_>,
) -> Result<Adjustment, AdjustError> {
    problem.check_lengths(&problem.initial)?;
    let mut run = Run {
        problem,
        options,
        requests,
        is_near: false,
        has_moved: false,
        context: context.reborrow(),
        seconds: PhaseTimes::default(),
        formations: 0,
        iterations: vec![],
        history: vec![],
        last_corrections: vec![0.0; problem.initial.len()],
        datum: vec![],
        chord: None,
        anderson: AndersonHistory::default(),
        curved: false,
        weak: vec![],
        collapsed: vec![],
    };
    let damping = match options.method {
        Method::TrustRegion(_) => ALWAYS.first,
        Method::Full(_) | Method::Damped(_) => {
            run.datum = problem.to_hold(&problem.initial, run.context.threads);
            0.0
        }
    };
    let start = run.form(problem.initial.clone(), damping)?;
    let initial_sum_of_squares = start.linearized.sum_of_squares;
    if !initial_sum_of_squares.is_finite() {
        return Err(AdjustError::NotFinite);
    }
    let end = match options.method {
        Method::Full(rule) => run.full_steps(start, rule)?,
        Method::Damped(stop) => run.controlled_steps(start, stop, &AFTER_FAILURES)?,
        Method::TrustRegion(stop) => run.controlled_steps(start, stop, &ALWAYS)?,
    };
    run.finish(end, initial_sum_of_squares)
}

/// Current linearization of the iterations.
pub(super) struct Iterate<'a> {
    pub equations: ObservationEquations<'a>,
    pub linearized: Linearized,
    /// Values before the transformation to the datum, if any.
    before: Option<Vec<f64>>,
}

impl Iterate<'_> {
    pub fn values(&self) -> &[f64] {
        &self.linearized.values
    }

    /// Returns the unknowns after the last step, before a transformation to the datum.
    pub fn reached(&self) -> &[f64] {
        self.before.as_deref().unwrap_or(self.values())
    }

    /// Releases its memory for the next linearization and returns its values.
    pub fn recycle(self) -> Vec<f64> {
        self.linearized.recycle()
    }

    /// Returns the unknowns that a step moves most.
    pub fn moved(&self, step: &[f64]) -> Vec<usize> {
        self.linearized.factor.moved(step)
    }
}

/// Final state of the iterations, without cofactors if the final values leave unknowns undetermined.
pub(super) struct End<'a> {
    pub status: Status,
    pub unknowns: Vec<f64>,
    /// Linearization for the cofactors.
    pub state: Option<Iterate<'a>>,
    /// Reason for a missing linearization.
    pub undetermined: Option<AdjustError>,
    /// Last iteration and its step, not applied yet; cofactors refer to the values before it.
    pub last: Option<(Iteration, Vec<f64>)>,
}

impl<'a> End<'a> {
    /// Ends at given values, without cofactors.
    pub fn at(status: Status, unknowns: Vec<f64>) -> Self {
        Self { status, unknowns, state: None, undetermined: None, last: None }
    }

    /// Ends at the values of a linearization, with cofactors.
    pub fn with(status: Status, state: Iterate<'a>) -> Self {
        let unknowns = state.values().to_vec();
        Self { state: Some(state), ..Self::at(status, unknowns) }
    }

    /// Ends after one more step, with cofactors from the equations before it.
    pub fn after(status: Status, state: Iterate<'a>, step: Vec<f64>, iteration: Iteration) -> Self {
        Self { last: Some((iteration, step)), ..Self::with(status, state) }
    }
}

/// Next linearization, or the end of the iterations.
pub(super) type Next<'a> = Result<ControlFlow<End<'a>, Iterate<'a>>, AdjustError>;

pub(super) struct Run<'a, 'w> {
    pub problem: &'a AnyProblem<'a>,
    pub options: &'a Options,
    requests: Requests<'a>,
    /// Whether the next formation is expected to be the last, if a datum is requested.
    is_near: bool,
    /// Whether the network was transformed during the iterations.
    has_moved: bool,
    pub context: Context<'w>,
    pub(super) seconds: PhaseTimes,
    formations: usize,
    pub iterations: Vec<Iteration>,
    history: Vec<Vec<f64>>,
    last_corrections: Vec<f64>,
    /// Unknowns constrained for a datum; in a trust region empty until the iterations have ended.
    pub datum: Vec<usize>,
    /// Length of the chord after the last step, if any.
    pub chord: Option<f64>,
    /// History of full steps for their acceleration in case of slow convergence.
    pub anderson: AndersonHistory,
    /// Whether to use the second-order term of the loss: as soon as steps are short.
    pub curved: bool,
    /// Unknowns in a combination that full steps cannot follow (see [`Adjustment::weak`]).
    pub weak: Vec<usize>,
    /// Ill-conditioned or diverging local blocks (see [`Adjustment::collapsed`]).
    pub collapsed: Vec<usize>,
}

impl<'a> Run<'a, '_> {
    /// Computes the step; None if an earlier step led to values that leave unknowns undetermined. An error if the initial values already
    /// do.
    pub(super) fn step(&mut self, state: &Iterate<'a>) -> Result<Option<Vec<f64>>, AdjustError> {
        match state.linearized.undetermined() {
            Some(_) if !self.iterations.is_empty() => return Ok(None),
            Some(error) => return Err(error),
            None => {}
        }
        self.solved(state, SolveOptions::default()).map(Some)
    }

    /// Computes the step, or solves the same equations for the right-hand sides in the options.
    pub(super) fn solved(
        &mut self,
        state: &Iterate<'a>,
        options: SolveOptions<'_>,
    ) -> Result<Vec<f64>, AdjustError> {
        let start = Instant::now();
        let found = state.linearized.solve(&state.equations, &options, &mut self.context)?;
        self.seconds.solve += start.elapsed().as_secs_f64();
        Ok(found)
    }

    /// Returns the weighted sum of squares at given values; with a loss, the sum of losses.
    pub(super) fn objective(&self, unknowns: &[f64]) -> f64 {
        self.evaluated(unknowns).1
    }

    /// Evaluates the model, and its objective.
    pub(super) fn evaluated(&self, unknowns: &[f64]) -> (Box<dyn Evaluated + 'a>, f64) {
        let at = self.context.threads.install(|| self.problem.model.at(unknowns));
        let objective = self.objective_at(unknowns, &*at);
        (at, objective)
    }

    /// Returns the objective at an evaluated model.
    pub(super) fn objective_at(&self, unknowns: &[f64], at: &dyn Evaluated) -> f64 {
        self.problem.objective(
            unknowns,
            &self.problem.residuals_at(self.context.threads, at),
            self.options.loss,
        )
    }

    pub(super) fn form(&mut self, unknowns: Vec<f64>, damping: f64) -> Result<Iterate<'a>, AdjustError> {
        let near = std::mem::take(&mut self.is_near);
        let (unknowns, basis, before) = match damping == 0.0 && near {
            true => self.at_its_target(unknowns),
            false => (unknowns, None, None),
        };
        let at = self.context.threads.install(|| self.problem.model.at(&unknowns));
        let mut state = self.formed(unknowns, at, damping)?;
        state.linearized.basis = basis;
        Ok(Iterate { before, ..state })
    }

    /// Predicts from quadratic convergence of full steps whether the next linearization is the last.
    pub(super) fn predict_last(&mut self, last: &Iteration) {
        let full = |iteration: &Iteration| iteration.damping == 0.0;
        let before = self.iterations.last().filter(|before| full(before) && full(last));
        let next = before.map(|before| last.largest_change.powi(3) / before.largest_change.powi(2));
        let unknowns = self.problem.layout().unknowns();
        self.is_near =
            self.requests.datum.is_some() && next.is_some_and(|next| leaves_cofactors(next, unknowns));
    }

    /// Transforms the values to the requested datum if possible. Also returns the values before the transformation.
    fn at_its_target(&mut self, unknowns: Vec<f64>) -> (Vec<f64>, Option<Basis>, Option<Vec<f64>>) {
        let Some((datum, reference)) = self.requests.datum else { return (unknowns, None, None) };
        let adjusted = Adjusted { unknowns: &unknowns, held: &self.datum, loss: None };
        match moved(self.problem, adjusted, datum, reference, self.context.threads) {
            Ok((there, basis)) => {
                self.has_moved = true;
                (there, Some(basis), Some(unknowns))
            }
            Err(_) => (unknowns, None, None),
        }
    }

    /// Forms the normal equations at an evaluated model.
    pub(super) fn formed(
        &mut self,
        unknowns: Vec<f64>,
        at: Box<dyn Evaluated + 'a>,
        damping: f64,
    ) -> Result<Iterate<'a>, AdjustError> {
        let reweighting = self.options.loss.map(|loss| Reweighting { loss, curved: self.curved });
        let equations =
            ObservationEquations::evaluated(self.problem, at, &unknowns, &self.datum, reweighting);
        let held = self.datum.clone();
        let options = FactorOptions { damping, ..FactorOptions::default() };
        let mut linearized = Linearized::of(&equations, unknowns, held, &options, &mut self.context)?;
        self.seconds.add(&std::mem::take(&mut linearized.seconds));
        self.formations += 1;
        if self.options.loss.is_some() {
            linearized.sum_of_squares = self.objective(&linearized.values);
        }
        Ok(Iterate { equations, linearized, before: None })
    }

    fn finish(mut self, mut end: End<'a>, initial_sum_of_squares: f64) -> Result<Adjustment, AdjustError> {
        let (problem, options) = (self.problem, self.options);
        let mut unknowns = end.unknowns.clone();
        let is_at_target = end.state.as_ref().is_some_and(|state| state.linearized.basis.is_some());
        if let Some(state) = end.state.as_mut().filter(|_| !is_at_target) {
            // Cached local eliminations are no longer needed; their memory is released for the results.
            state.linearized.factor.forget();
        }
        let basis = end.state.as_ref().and_then(|state| state.linearized.basis.as_ref());
        if let Some((_, step)) = &mut end.last {
            basis.into_iter().for_each(|basis| basis.take(step));
            problem.model.advance(&mut unknowns, step);
        }
        let mut adjustment = Adjustment::at(problem, options.loss, unknowns, self.context.threads);
        if let Some((last, _)) = end.last {
            let reached = &adjustment.unknowns;
            let sum_of_squares = problem.objective(reached, &adjustment.residuals, options.loss);
            self.accept(Iteration { sum_of_squares, ..last }, &end.unknowns, reached)?;
        }
        drop(end.unknowns);
        let asked = options.covariance && (self.requests.datum.is_none() || is_at_target);
        if let Some(Iterate { equations, mut linearized, .. }) = end.state.filter(|_| asked) {
            linearized.take_to_datum(&equations, &mut self.context)?;
            if let Some((joint, memory)) = self.requests.by_groups.filter(|(joint, _)| !joint.is_empty()) {
                adjustment.joint = linearized.joint(problem, joint, memory, &mut self.context)?;
            }
            adjustment.factor =
                self.requests.by_groups.and_then(|_| linearized.small_factor(self.context.threads));
            let what =
                InvertOptions { by_groups: self.requests.by_groups.is_some(), ..InvertOptions::default() };
            adjustment.put(problem, linearized.invert(&equations, &what, &mut self.context)?);
            adjustment.redundancy_excess = options.loss.is_none().then(|| adjustment.excess());
        }
        adjustment.effort.seconds.add(&self.seconds);
        adjustment.effort.formations = self.formations;
        Ok(Adjustment {
            status: end.status,
            initial_sum_of_squares,
            iterations: self.iterations,
            history: self.history,
            last_corrections: self.last_corrections,
            undetermined: end.undetermined,
            counts: problem.counts(&self.datum),
            datum: self.datum,
            weak: self.weak,
            collapsed: self.collapsed,
            ..adjustment
        })
    }

    /// Stores and reports an accepted iteration with its corrections.
    pub(super) fn accept(
        &mut self,
        iteration: Iteration,
        before: &[f64],
        after: &[f64],
    ) -> Result<(), AdjustError> {
        self.last_corrections.clear();
        self.last_corrections.extend(before.iter().zip(after).map(|(from, to)| to - from));
        self.curved = self.options.loss.is_some() && iteration.largest_change <= NEAR;
        let layout = self.problem.layout();
        let first = layout.all_locals().end;
        let kept = first..layout.unknowns().min(first.saturating_add(self.requests.history));
        if !kept.is_empty() {
            if self.history.is_empty() {
                self.history.push(self.problem.initial[kept.clone()].to_vec());
            }
            let corrected = match self.history.last().filter(|_| self.has_moved) {
                // A datum transformation is not a correction.
                Some(last) => {
                    last.iter().zip(&self.last_corrections[kept]).map(|(value, step)| value + step).collect()
                }
                None => after[kept].to_vec(),
            };
            self.history.push(corrected);
        }
        self.iterations.push(iteration);
        Ok(self.context.report(Event::Iteration(iteration))?)
    }
}

impl<'a> Run<'a, '_> {
    /// Iterates with full steps, without control of the sum of squares.
    pub(super) fn full_steps(&mut self, start: Iterate<'a>, rule: Published) -> Result<End<'a>, AdjustError> {
        let mut state = start;
        let mut previous: Option<f64> = None;
        for number in 1..=self.options.max_iterations {
            let Some(step) = self.step(&state)? else {
                return Ok(End::at(Status::Diverged, state.recycle()));
            };
            let largest_change = state.linearized.change();
            let mut iteration = Iteration { number, sum_of_squares: f64::NAN, largest_change, damping: 0.0 };
            if let Published::Length { first, count, limit } = rule {
                let length = step[first..first + count].iter().map(|dx| dx * dx).sum::<f64>().sqrt();
                if length < limit || number == self.options.max_iterations {
                    let status = if length < limit { Status::Converged } else { Status::NotConverged };
                    return Ok(End::after(status, state, step, iteration));
                }
            }
            let next = self.form(self.problem.advanced(state.values(), &step), 0.0)?;
            let sum = next.linearized.sum_of_squares;
            if !sum.is_finite() {
                return Ok(End::with(Status::Diverged, state));
            }
            iteration.sum_of_squares = sum;
            self.accept(iteration, state.values(), next.values())?;
            state.recycle();
            state = next;
            if let Published::Percent(percent) = rule {
                match previous.map(|before| (sum - before) / before * 100.0) {
                    Some(change) if change.abs() < percent => return self.stay(state, Status::Converged),
                    Some(change) if change >= percent => return self.stay(state, Status::Diverged),
                    _ => previous = Some(sum),
                }
            }
        }
        self.stay(state, Status::NotConverged)
    }
}
