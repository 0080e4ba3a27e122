//! What all iterations share: forming, factoring, solving, and the end with its cofactors.

use std::ops::ControlFlow;
use std::time::Instant;

use super::datum::{Adjusted, Basis, Datum, Target, moved};
use super::equations::ObservationEquations;
use super::linearized::Linearized;
use super::loss::Reweighting;
use super::options::{Event, Iteration, Options, Phase, Status};
use super::options::{FIRST_DAMPING, Method, leaves_cofactors};
use super::problem::{AnyProblem, Evaluated, Model, Problem};
use super::result::{AdjustError, Adjustment, Seconds};
use super::secants::Secants;
use crate::normals::{FactorOptions, InvertOptions, SolveOptions};
use crate::{Stopped, Threads};

/// Called with what is going on, on the calling thread; breaking stops the work.
pub type Watch<'a> = &'a mut dyn FnMut(Event) -> ControlFlow<()>;

/// Nobody watches.
pub(crate) fn go_on(_: Event) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

impl<M: Model> Problem<M> {
    /// Adjusts by least squares, on threads of its own; [`adjust`] takes those of its caller and tells what is going on.
    ///
    /// # Errors
    /// Lengths that contradict the layout, unknowns that are not determined, or observations that cannot be computed; threads that cannot
    /// be started.
    pub fn adjust(&self, options: &Options) -> Result<Adjustment, AdjustError> {
        adjust(self.any(), options, &Threads::new(options.threads)?, &mut go_on)
    }
}

/// Adjusts a problem by least squares.
///
/// `watch` is called on the calling thread with what is going on; when it breaks, the adjustment stops.
///
/// # Errors
/// Lengths that contradict the layout, unknowns that are not determined, observations that cannot be computed, or an interruption.
pub fn adjust(
    problem: &AnyProblem<'_>,
    options: &Options,
    threads: &Threads,
    watch: Watch<'_>,
) -> Result<Adjustment, AdjustError> {
    adjusted(problem, options, None, threads, watch, None)
}

/// Adjusts a network that is free, to end in a datum: it is moved there before the last formation, so that this one serves the cofactors
/// in that datum. [`Adjustment::lost`] says whether it has; otherwise there are no cofactors, and [`Adjustment::take_to`] is still to do.
///
/// * `reference`: the values from which the carriers move least, usually the initial ones.
///
/// # Errors
/// Those of [`adjust`].
pub fn adjust_in_datum(
    problem: &AnyProblem<'_>,
    options: &Options,
    datum: &Datum,
    reference: &[f64],
    threads: &Threads,
    watch: Watch<'_>,
) -> Result<Adjustment, AdjustError> {
    adjusted(problem, options, Some(Target { datum, reference }), threads, watch, None)
}

/// Adjusts, and keeps what tests of groups of observations need: [`Leverages::of`] takes it over.
///
/// * `joint`: unknowns whose cofactors with each other are kept too ([`Adjustment::joint`]), from the last factor;
/// * `memory`: where they take no more bytes than these (None: any number).
///
/// # Errors
/// Those of [`adjust`].
///
/// [`Leverages::of`]: super::Leverages::of
pub fn adjust_by_groups(
    problem: &AnyProblem<'_>,
    options: &Options,
    (joint, memory): (&[usize], Option<usize>),
    threads: &Threads,
    watch: Watch<'_>,
) -> Result<Adjustment, AdjustError> {
    adjusted(problem, options, None, threads, watch, Some((joint, memory)))
}

fn adjusted(
    problem: &AnyProblem<'_>,
    options: &Options,
    target: Option<Target<'_>>,
    threads: &Threads,
    watch: Watch<'_>,
    by_groups: Option<(&[usize], Option<usize>)>,
) -> Result<Adjustment, AdjustError> {
    problem.check_lengths(&problem.initial)?;
    let mut run = Run {
        problem,
        options,
        by_groups,
        target,
        is_near: false,
        has_moved: false,
        threads,
        watch,
        seconds: Seconds::default(),
        formations: 0,
        iterations: vec![],
        history: vec![problem.initial[problem.layout().all_locals().end..].to_vec()],
        last_local_corrections: vec![0.0; problem.layout().all_locals().len()],
        datum: vec![],
        chord: None,
        secants: Secants::default(),
        curved: false,
        weak: vec![],
        collapsed: vec![],
    };
    let damping = match options.method {
        Method::TrustRegion(_) => FIRST_DAMPING,
        Method::Full(_) | Method::Damped(_) => {
            run.datum = problem.to_hold(&problem.initial, threads);
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
        Method::Damped(stop) => run.damped_steps(start, stop)?,
        Method::TrustRegion(stop) => run.in_trust_region(start, stop)?,
    };
    run.finish(end, initial_sum_of_squares)
}

/// A step that changes the unknowns by less than this multiple of their standard deviations leads to where the second-order term of
/// a loss does no harm.
pub(super) const NEAR: f64 = 1.0;

/// Where the iterations are.
pub(super) struct State<'a> {
    pub equations: ObservationEquations<'a>,
    pub linearized: Linearized,
    /// The values before the network was moved to its datum, where it was.
    before: Option<Vec<f64>>,
}

impl State<'_> {
    pub fn values(&self) -> &[f64] {
        &self.linearized.values
    }

    /// The unknowns as the last step has left them.
    pub fn reached(&self) -> &[f64] {
        self.before.as_deref().unwrap_or(self.values())
    }

    /// Gives its memory back for the next one; its values.
    pub fn recycle(self) -> Vec<f64> {
        self.linearized.recycle(self.equations.problem())
    }

    /// The unknowns that a step moves most.
    pub fn moved(&self, step: &[f64]) -> Vec<usize> {
        self.linearized.factor.moved(&self.equations.problem().system, step)
    }
}

/// Where the iterations ended. There are no cofactors where the last values leave unknowns undetermined.
pub(super) struct End<'a> {
    pub status: Status,
    pub unknowns: Vec<f64>,
    /// What cofactors are computed from.
    pub state: Option<State<'a>>,
    /// Why there is none.
    pub undetermined: Option<AdjustError>,
    /// The last iteration and its step, still to be applied: the cofactors hold before it.
    pub last: Option<(Iteration, Vec<f64>)>,
}

impl<'a> End<'a> {
    /// At given values, without cofactors.
    pub fn at(status: Status, unknowns: Vec<f64>) -> Self {
        Self { status, unknowns, state: None, undetermined: None, last: None }
    }

    /// At values with all that their cofactors are computed from.
    pub fn with(status: Status, state: State<'a>) -> Self {
        let unknowns = state.values().to_vec();
        Self { state: Some(state), ..Self::at(status, unknowns) }
    }

    /// After one more step, with the cofactors of the equations that have given it.
    pub fn after(status: Status, state: State<'a>, step: Vec<f64>, iteration: Iteration) -> Self {
        Self { last: Some((iteration, step)), ..Self::with(status, state) }
    }
}

pub(super) struct Run<'a, 'w> {
    pub problem: &'a AnyProblem<'a>,
    pub options: &'a Options,
    /// Where what tests of groups need is kept: unknowns whose cofactors with each other are kept too, and the bytes that these may take.
    by_groups: Option<(&'a [usize], Option<usize>)>,
    /// The datum to end in.
    target: Option<Target<'a>>,
    /// Whether the next formation will be the last one, there being a datum to end in.
    is_near: bool,
    /// Whether the network was moved on its way.
    has_moved: bool,
    pub threads: &'a Threads,
    pub(super) watch: &'w mut dyn FnMut(Event) -> ControlFlow<()>,
    pub(super) seconds: Seconds,
    formations: usize,
    pub iterations: Vec<Iteration>,
    history: Vec<Vec<f64>>,
    last_local_corrections: Vec<f64>,
    /// Unknowns held for a datum; in a trust region empty until the iterations are over.
    pub datum: Vec<usize>,
    /// The length of the chord that followed the last step, where one did.
    pub chord: Option<f64>,
    /// What full steps have shown where they fall slowly.
    pub secants: Secants,
    /// Whether to take in the second-order term of the loss from now on: once the steps are short.
    pub curved: bool,
    /// Unknowns that a combination moves which full steps cannot follow (see [`Adjustment::weak`]).
    pub weak: Vec<usize>,
    /// Local blocks that harm all others, or leave them (see [`Adjustment::collapsed`]).
    pub collapsed: Vec<usize>,
}

impl<'a> Run<'a, '_> {
    /// Ends at the values reached, without a further step. Cofactors are those of the reweighted equations, whose weights can be
    /// reported, without second-order term.
    pub(super) fn stay(&mut self, state: State<'a>, status: Status) -> Result<End<'a>, AdjustError> {
        let plain = state.linearized.damping() == 0.0 && !state.linearized.is_curved();
        self.curved = false;
        let state = if plain { state } else { self.form(state.recycle(), 0.0)? };
        let Some(error) = state.linearized.undetermined() else { return Ok(End::with(status, state)) };
        let status = if status == Status::Converged { status } else { Status::Diverged };
        Ok(End { undetermined: Some(error), ..End::at(status, state.recycle()) })
    }

    /// The step; None where an earlier one has led to values that leave unknowns undetermined. That the initial values do is an
    /// error: then the observations do.
    pub(super) fn step(&mut self, state: &State<'a>) -> Result<Option<Vec<f64>>, AdjustError> {
        match state.linearized.undetermined() {
            Some(_) if !self.iterations.is_empty() => return Ok(None),
            Some(error) => return Err(error),
            None => {}
        }
        let start = Instant::now();
        let mut between = between(&mut *self.watch, Phase::Solve, self.problem.layout().locals());
        let step =
            state.linearized.solve(&state.equations, &SolveOptions::default(), self.threads, &mut between)?;
        self.seconds.solve += start.elapsed().as_secs_f64();
        Ok(Some(step))
    }

    /// Solves the same equations for another right-hand side.
    pub(super) fn solve_again(&mut self, state: &State<'a>, right: &[f64]) -> Result<Vec<f64>, AdjustError> {
        let start = Instant::now();
        let mut between = between(&mut *self.watch, Phase::Solve, self.problem.layout().locals());
        let options = SolveOptions { rights: Some(right), ..SolveOptions::default() };
        let found = state.linearized.solve(&state.equations, &options, self.threads, &mut between)?;
        self.seconds.solve += start.elapsed().as_secs_f64();
        Ok(found)
    }

    /// The weighted sum of squares, of losses where the options ask for a loss, at the given values.
    pub(super) fn objective(&self, unknowns: &[f64]) -> f64 {
        self.objective_at(unknowns, &*self.threads.install(|| self.problem.model.at(unknowns)))
    }

    /// The same of a model that is evaluated already.
    pub(super) fn objective_at(&self, unknowns: &[f64], at: &dyn Evaluated) -> f64 {
        self.problem.objective(unknowns, &self.problem.residuals_at(self.threads, at), self.options.loss)
    }

    pub(super) fn form(&mut self, unknowns: Vec<f64>, damping: f64) -> Result<State<'a>, AdjustError> {
        let near = std::mem::take(&mut self.is_near);
        let (unknowns, basis, before) = match damping == 0.0 && near {
            true => self.at_its_target(unknowns),
            false => (unknowns, None, None),
        };
        let at = self.threads.install(|| self.problem.model.at(&unknowns));
        let mut state = self.formed(unknowns, at, damping)?;
        state.linearized.basis = basis;
        Ok(State { before, ..state })
    }

    /// Says that the next formation is that after a step, which will be the last one where full steps that converge quadratically say so.
    pub(super) fn look_ahead(&mut self, last: &Iteration) {
        let full = |iteration: &Iteration| iteration.damping == 0.0;
        let before = self.iterations.last().filter(|before| full(before) && full(last));
        let next = before.map(|before| last.largest_change.powi(3) / before.largest_change.powi(2));
        let unknowns = self.problem.layout().unknowns();
        self.is_near = self.target.is_some() && next.is_some_and(|next| leaves_cofactors(next, unknowns));
    }

    /// Moves the network to the datum that it is to end in; it stays where it cannot be moved there. Also where it was.
    fn at_its_target(&mut self, unknowns: Vec<f64>) -> (Vec<f64>, Option<Basis>, Option<Vec<f64>>) {
        let Some(Target { datum, reference }) = self.target else { return (unknowns, None, None) };
        let adjusted = Adjusted { unknowns: &unknowns, held: &self.datum, loss: None };
        match moved(self.problem, adjusted, datum, reference, self.threads) {
            Ok((there, basis)) => {
                self.has_moved = true;
                (there, Some(basis), Some(unknowns))
            }
            Err(_) => (unknowns, None, None),
        }
    }

    /// The same at a model that is evaluated already.
    pub(super) fn formed(
        &mut self,
        unknowns: Vec<f64>,
        at: Box<dyn Evaluated + 'a>,
        damping: f64,
    ) -> Result<State<'a>, AdjustError> {
        let reweighting = self.options.loss.map(|loss| Reweighting { loss, curved: self.curved });
        let equations = ObservationEquations::evaluated(self.problem, at, &self.datum, reweighting);
        let held = self.datum.clone();
        let mut linearized = {
            let mut between = between(&mut *self.watch, Phase::Form, self.problem.layout().locals());
            let options = FactorOptions { damping, ..FactorOptions::default() };
            Linearized::of(&equations, unknowns, held, &options, self.threads, &mut between)?
        };
        self.seconds.add(&std::mem::take(&mut linearized.seconds));
        self.formations += 1;
        if self.options.loss.is_some() {
            linearized.sum_of_squares = self.objective(&linearized.values);
        }
        Ok(State { equations, linearized, before: None })
    }

    fn finish(mut self, mut end: End<'a>, initial_sum_of_squares: f64) -> Result<Adjustment, AdjustError> {
        let (problem, options) = (self.problem, self.options);
        let mut unknowns = end.unknowns.clone();
        let is_at_target = end.state.as_ref().is_some_and(|state| state.linearized.basis.is_some());
        if let Some(state) = end.state.as_mut().filter(|_| !is_at_target) {
            // Nothing is solved for any more: what elimination has left makes room for the results.
            state.linearized.factor.forget();
        }
        let basis = end.state.as_ref().and_then(|state| state.linearized.basis.as_ref());
        if let Some((_, step)) = &mut end.last {
            basis.into_iter().for_each(|basis| basis.take(step));
            problem.model.advance(&mut unknowns, step);
        }
        let mut adjustment = Adjustment::at(problem, options.loss, unknowns, self.threads);
        if let Some((last, _)) = end.last {
            let reached = &adjustment.unknowns;
            let sum_of_squares = problem.objective(reached, &adjustment.residuals, options.loss);
            self.accept(Iteration { sum_of_squares, ..last }, &end.unknowns, reached)?;
        }
        drop(end.unknowns);
        let asked = options.covariance && (self.target.is_none() || is_at_target);
        if let Some(State { equations, mut linearized, .. }) = end.state.filter(|_| asked) {
            let locals = problem.layout().locals();
            {
                let mut between = between(&mut *self.watch, Phase::Solve, locals);
                linearized.take_to_datum(&equations, self.threads, &mut between)?;
            }
            if let Some((joint, memory)) = self.by_groups.filter(|(joint, _)| !joint.is_empty()) {
                let mut between = between(&mut *self.watch, Phase::Invert, locals);
                adjustment.joint = linearized.joint(problem, joint, memory, self.threads, &mut between)?;
            }
            let what = InvertOptions { by_groups: self.by_groups.is_some(), ..InvertOptions::default() };
            let mut between = between(&mut *self.watch, Phase::Invert, locals);
            adjustment.put(problem, linearized.invert(&equations, &what, self.threads, &mut between)?);
            adjustment.redundancy_excess = options.loss.is_none().then(|| adjustment.excess());
        }
        adjustment.effort.seconds.add(&self.seconds);
        adjustment.effort.formations = self.formations;
        Ok(Adjustment {
            status: end.status,
            initial_sum_of_squares,
            iterations: self.iterations,
            history: self.history,
            last_local_corrections: self.last_local_corrections,
            undetermined: end.undetermined,
            counts: problem.counts(&self.datum),
            datum: self.datum,
            weak: self.weak,
            collapsed: self.collapsed,
            ..adjustment
        })
    }

    /// Whether a step has led local blocks to where they harm all others; keeps them.
    pub(super) fn has_collapsed(&mut self, before: &[f64], after: &dyn Evaluated) -> bool {
        self.collapsed = self.threads.install(|| after.collapsed(before));
        !self.collapsed.is_empty()
    }

    /// Whether a step has led local blocks out of the whole; keeps them.
    pub(super) fn has_run_off(&mut self, before: &[f64], after: &dyn Evaluated) -> bool {
        self.collapsed = self.threads.install(|| after.run_off(before));
        !self.collapsed.is_empty()
    }

    /// Keeps an iteration that stands, with its corrections, and tells of it.
    pub(super) fn accept(
        &mut self,
        iteration: Iteration,
        before: &[f64],
        after: &[f64],
    ) -> Result<(), AdjustError> {
        let locals = self.problem.layout().all_locals();
        let corrections =
            before[locals.clone()].iter().zip(&after[locals.clone()]).map(|(from, to)| to - from);
        self.last_local_corrections = corrections.collect();
        self.curved = self.options.loss.is_some() && iteration.largest_change <= NEAR;
        let corrected = match (self.has_moved, self.history.last()) {
            // A move is no correction.
            (true, Some(last)) => {
                let steps = before[locals.end..].iter().zip(&after[locals.end..]);
                last.iter().zip(steps).map(|(value, (from, to))| value + (to - from)).collect()
            }
            _ => after[locals.end..].to_vec(),
        };
        self.history.push(corrected);
        self.iterations.push(iteration);
        stopped((self.watch)(Event::Iteration(iteration)))
    }
}

fn stopped(flow: ControlFlow<()>) -> Result<(), AdjustError> {
    match flow {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(Stopped::Interrupted.into()),
    }
}

/// Tells of local blocks done.
pub(super) fn between(
    watch: &mut dyn FnMut(Event) -> ControlFlow<()>,
    phase: Phase,
    total: usize,
) -> impl FnMut(usize) -> ControlFlow<()> {
    move |done| watch(Event::Progress { phase, done, total })
}
