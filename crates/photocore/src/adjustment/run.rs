//! What all iterations share: forming, factoring, solving, and the end with its cofactors.

use std::ops::ControlFlow;
use std::time::Instant;

use rayon::{ThreadPool, ThreadPoolBuilder};

use super::datum::{Adjusted, AtTarget, Datum, Target, moved};
use super::loss::Reweighting;
use super::method::{FIRST_DAMPING, Method, leaves_cofactors};
use super::options::{Event, Iteration, Options, Phase, Status};
use super::problem::{Linearized, Model, Problem};
use super::result::{AdjustError, Adjustment, Seconds, unless_stopped};
use crate::normals::{Cofactors, Factor, Inversion, Prior};

/// Whoever is told on the calling thread what is going on; breaking stops the work.
pub type Watch<'a> = &'a mut dyn FnMut(Event) -> ControlFlow<()>;

/// Bytes that the stack of a thread takes: none is started where there is no memory for it.
const STACK: usize = 2 << 20;

/// Does work on all processors with nobody watching it: for callers without threads of their own.
///
/// # Errors
/// Threads that cannot be started, as [`AdjustError::OutOfMemory`].
pub fn on_all_processors<T>(work: impl FnOnce(&ThreadPool, Watch<'_>) -> T) -> Result<T, AdjustError> {
    let pool = ThreadPoolBuilder::new().build().map_err(|_| AdjustError::OutOfMemory(STACK))?;
    Ok(work(&pool, &mut |_| ControlFlow::Continue(())))
}

impl<M: Model> Problem<M> {
    /// Adjusts by least squares on all processors; [`adjust`] takes threads of its caller and tells what is going on.
    ///
    /// # Errors
    /// Unknowns that are not determined, or observations that cannot be computed; threads that cannot be started.
    pub fn adjust(&self, options: &Options) -> Result<Adjustment, AdjustError> {
        on_all_processors(|pool, watch| adjust(self, options, pool, watch))?
    }
}

/// Adjusts a problem by least squares.
///
/// `watch` is called on the calling thread with what is going on; when it breaks, the adjustment stops.
///
/// # Errors
/// Unknowns that are not determined, observations that cannot be computed, or an interruption.
pub fn adjust<M: Model>(
    problem: &Problem<M>,
    options: &Options,
    pool: &ThreadPool,
    watch: Watch<'_>,
) -> Result<Adjustment, AdjustError> {
    adjusted(problem, options, None, pool, watch, false)
}

/// Adjusts a network that is free, to end in a datum: it is moved there before the last formation, so that this one serves the cofactors
/// in that datum. [`Adjustment::lost`] says whether it has; otherwise there are no cofactors, and [`Adjustment::take_to`] is still to do.
///
/// * `reference`: the values from which the carriers move least, usually the initial ones.
///
/// # Errors
/// Those of [`adjust`].
pub fn adjust_in_datum<M: Model>(
    problem: &Problem<M>,
    options: &Options,
    datum: &Datum,
    reference: &[f64],
    pool: &ThreadPool,
    watch: Watch<'_>,
) -> Result<Adjustment, AdjustError> {
    adjusted(problem, options, Some(Target { datum, reference }), pool, watch, false)
}

/// Adjusts, and keeps what tests of groups of observations need: [`Tried::of`] takes it over.
///
/// # Errors
/// Those of [`adjust`].
///
/// [`Tried::of`]: super::Tried::of
pub fn adjust_by_groups<M: Model>(
    problem: &Problem<M>,
    options: &Options,
    pool: &ThreadPool,
    watch: Watch<'_>,
) -> Result<Adjustment, AdjustError> {
    adjusted(problem, options, None, pool, watch, true)
}

fn adjusted<M: Model>(
    problem: &Problem<M>,
    options: &Options,
    target: Option<Target<'_>>,
    pool: &ThreadPool,
    watch: Watch<'_>,
    by_groups: bool,
) -> Result<Adjustment, AdjustError> {
    let mut run = Run {
        problem,
        options,
        by_groups,
        target,
        is_near: false,
        has_moved: false,
        pool,
        watch,
        seconds: Seconds::default(),
        formations: 0,
        iterations: vec![],
        history: vec![problem.initial[problem.layout().all_locals().end..].to_vec()],
        last_local_corrections: vec![0.0; problem.layout().all_locals().len()],
        datum: vec![],
        chord: None,
        curved: false,
        weak: vec![],
        collapsed: vec![],
    };
    let damping = match options.method {
        Method::TrustRegion(_) => FIRST_DAMPING,
        Method::Full(_) | Method::Damped(_) => {
            run.datum = problem.to_hold(&problem.initial, pool);
            0.0
        }
    };
    let start = run.form(problem.initial.clone(), damping)?;
    if !start.sum_of_squares.is_finite() {
        return Err(AdjustError::NotFinite);
    }
    let initial_sum_of_squares = start.sum_of_squares;
    let end = match options.method {
        Method::Full(rule) => run.full_steps(start, rule)?,
        Method::Damped(stop) => run.damped_steps(start, stop)?,
        Method::TrustRegion(stop) => run.in_trust_region(start, stop)?,
    };
    run.finish(end, initial_sum_of_squares)
}

/// A step that changes the unknowns by less than this multiple of their standard deviations leads to where the second-order term of
/// a loss does no harm.
const SHORT: f64 = 1.0;

/// The problem linearized at some values, and its normal equations factored.
pub(super) struct State<'a, M: Model> {
    pub unknowns: Vec<f64>,
    pub equations: Linearized<'a, M>,
    pub prior: Prior,
    pub factor: Factor,
    pub damping: f64,
    /// Whether the second-order term of the loss is taken in.
    pub curved: bool,
    pub sum_of_squares: f64,
    /// Where the network was moved to its datum for it.
    pub at_target: Option<AtTarget>,
}

impl<M: Model> State<'_, M> {
    /// The unknowns as the last step has left them.
    pub fn reached(&self) -> &[f64] {
        self.at_target.as_ref().map_or(&self.unknowns, |at| &at.before)
    }
}

/// What cofactors are computed from: the factor of the normal equations, and what they were formed from.
pub(super) struct Basis<'a, M: Model> {
    pub equations: Linearized<'a, M>,
    pub prior: Prior,
    pub factor: Factor,
    pub at_target: Option<AtTarget>,
}

/// Normal equations solved.
pub(super) struct Solved<'a, M: Model> {
    pub basis: Basis<'a, M>,
    pub step: Vec<f64>,
    pub change: f64,
}

/// Where the iterations ended. There are no cofactors where the last values leave unknowns undetermined.
pub(super) struct End<'a, M: Model> {
    pub status: Status,
    pub unknowns: Vec<f64>,
    pub basis: Option<Basis<'a, M>>,
    /// Why there is no basis.
    pub undetermined: Option<AdjustError>,
    /// The last iteration and its step, still to be applied: the cofactors hold before it.
    pub last: Option<(Iteration, Vec<f64>)>,
}

impl<'a, M: Model> End<'a, M> {
    /// At given values, with what their cofactors are computed from.
    pub fn at(status: Status, unknowns: Vec<f64>, basis: Option<Basis<'a, M>>) -> Self {
        Self { status, unknowns, basis, undetermined: None, last: None }
    }

    /// After one more step, with the cofactors of the equations that have given it.
    pub fn after(status: Status, unknowns: Vec<f64>, solved: Solved<'a, M>, iteration: Iteration) -> Self {
        let last = Some((iteration, solved.step));
        Self { last, ..Self::at(status, unknowns, Some(solved.basis)) }
    }

    /// Diverged to values that leave unknowns undetermined.
    pub fn lost(unknowns: Vec<f64>, undetermined: Option<AdjustError>) -> Self {
        Self { undetermined, ..Self::at(Status::Diverged, unknowns, None) }
    }
}

pub(super) struct Run<'a, 'w, M: Model> {
    pub problem: &'a Problem<M>,
    pub options: &'a Options,
    /// Whether to keep what tests of groups need.
    by_groups: bool,
    /// The datum to end in.
    target: Option<Target<'a>>,
    /// Whether the next formation will be the last one, there being a datum to end in.
    is_near: bool,
    /// Whether the network was moved on its way.
    has_moved: bool,
    pub pool: &'a ThreadPool,
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
    /// Whether to take in the second-order term of the loss from now on: once the steps are short.
    pub curved: bool,
    /// Unknowns that a combination moves which full steps cannot follow (see [`Adjustment::weak`]).
    pub weak: Vec<usize>,
    /// Local blocks that harm all others, or leave them (see [`Adjustment::collapsed`]).
    pub collapsed: Vec<usize>,
}

impl<'a, M: Model> Run<'a, '_, M> {
    /// Ends at the values reached, without a further step. Cofactors are those of the reweighted equations, whose weights can be
    /// told, without second-order term.
    pub(super) fn stay(&mut self, state: State<'a, M>, status: Status) -> Result<End<'a, M>, AdjustError> {
        let unknowns = state.unknowns.clone();
        let plain = state.damping == 0.0 && !state.curved;
        self.curved = false;
        let state = if plain { state } else { self.form(state.unknowns, 0.0)? };
        match self.determined(&state.factor) {
            Ok(()) => {
                let State { equations, prior, factor, at_target, .. } = state;
                let basis = Some(Basis { equations, prior, factor, at_target });
                Ok(End::at(status, unknowns, basis))
            }
            Err(error) => {
                let status = if status == Status::Converged { status } else { Status::Diverged };
                Ok(End { status, ..End::lost(unknowns, Some(error)) })
            }
        }
    }

    /// Solves; None where an earlier step has led to values that leave unknowns undetermined. That the initial values do is an
    /// error: then the observations do.
    pub(super) fn solve_unless_lost(
        &mut self,
        state: State<'a, M>,
    ) -> Result<Option<Solved<'a, M>>, AdjustError> {
        match self.solve(state) {
            Err(AdjustError::UndeterminedLocals(_) | AdjustError::Undetermined(_))
                if !self.iterations.is_empty() =>
            {
                Ok(None)
            }
            solved => solved.map(Some),
        }
    }

    /// The weighted sum of squares, of losses where the options ask for a loss, at the given values.
    pub(super) fn objective(&self, unknowns: &[f64]) -> f64 {
        self.objective_at(unknowns, &self.pool.install(|| self.problem.model.prepare(unknowns)))
    }

    /// The same of values that are prepared already.
    pub(super) fn objective_at(&self, unknowns: &[f64], prepared: &M::Prepared) -> f64 {
        let residuals = self.problem.residuals_at(self.pool, prepared);
        self.observed_sum(&residuals) + self.problem.prior_sum_of_squares(unknowns, 0..unknowns.len())
    }

    /// The observations' part of it.
    fn observed_sum(&self, residuals: &[f64]) -> f64 {
        match self.options.loss {
            None => self.problem.sum_of_squares(residuals),
            Some(loss) => self.problem.group_squares(residuals).map(|square| loss.value(square)).sum(),
        }
    }

    pub(super) fn form(&mut self, unknowns: Vec<f64>, damping: f64) -> Result<State<'a, M>, AdjustError> {
        let near = std::mem::take(&mut self.is_near);
        let (unknowns, at_target) = match damping == 0.0 && near {
            true => self.at_its_target(unknowns),
            false => (unknowns, None),
        };
        let prepared = self.pool.install(|| self.problem.model.prepare(&unknowns));
        let rights = at_target.as_ref().map_or(&[][..], |at| &at.rights);
        let state = self.formed(unknowns, prepared, damping, rights)?;
        Ok(State { at_target, ..state })
    }

    /// Says that the next formation is that after a step, which will be the last one where full steps that converge quadratically say so.
    pub(super) fn look_ahead(&mut self, last: &Iteration) {
        let full = |iteration: &Iteration| iteration.damping == 0.0;
        let before = self.iterations.last().filter(|before| full(before) && full(last));
        let next = before.map(|before| last.largest_change.powi(3) / before.largest_change.powi(2));
        let unknowns = self.problem.layout().unknowns();
        self.is_near = self.target.is_some() && next.is_some_and(|next| leaves_cofactors(next, unknowns));
    }

    /// Moves the network to the datum that it is to end in; it stays where it cannot be moved there.
    fn at_its_target(&mut self, unknowns: Vec<f64>) -> (Vec<f64>, Option<AtTarget>) {
        let Some(Target { datum, reference }) = self.target else { return (unknowns, None) };
        let adjusted = Adjusted { unknowns: &unknowns, held: &self.datum, loss: None };
        match moved(self.problem, adjusted, datum, reference, self.pool) {
            Ok((there, basis)) => {
                let rights = basis.rights(self.problem, there.len(), &self.datum, datum);
                self.has_moved = true;
                (there, Some(AtTarget { basis, rights, before: unknowns }))
            }
            Err(_) => (unknowns, None),
        }
    }

    /// The same at values that are prepared already.
    pub(super) fn form_at(
        &mut self,
        unknowns: Vec<f64>,
        prepared: M::Prepared,
        damping: f64,
    ) -> Result<State<'a, M>, AdjustError> {
        self.formed(unknowns, prepared, damping, &[])
    }

    /// The same with further right-hand sides.
    fn formed(
        &mut self,
        unknowns: Vec<f64>,
        prepared: M::Prepared,
        damping: f64,
        rights: &[f64],
    ) -> Result<State<'a, M>, AdjustError> {
        let start = Instant::now();
        let reweighting = self.options.loss.map(|loss| Reweighting { loss, curved: self.curved });
        let equations = Linearized::prepared(self.problem, prepared, &self.datum, reweighting);
        let prior = self.problem.prior_equations(&unknowns, &self.datum);
        let total = self.problem.layout().locals();
        let factored = {
            let mut between = between(&mut *self.watch, Phase::Form, total);
            let system = &self.problem.system;
            match rights.is_empty() {
                true => system.factor(self.pool, &equations, &prior, damping, &mut between),
                false => system.factor_with(self.pool, &equations, &prior, rights, true, &mut between),
            }
        };
        let factor = unless_stopped(factored)?;
        let seconds = start.elapsed().as_secs_f64();
        self.seconds.form += seconds * factor.formation_share;
        self.seconds.factor += seconds * (1.0 - factor.formation_share);
        let sum_of_squares = match self.options.loss {
            None => factor.sum_of_squares + self.problem.prior_sum_of_squares(&unknowns, 0..unknowns.len()),
            Some(_) => self.objective(&unknowns),
        };
        self.formations += 1;
        let curved = self.curved;
        let at_target = None;
        Ok(State { unknowns, equations, prior, factor, damping, curved, sum_of_squares, at_target })
    }

    /// Whether everything is determined.
    fn determined(&self, factor: &Factor) -> Result<(), AdjustError> {
        if !factor.deficient_locals.is_empty() {
            return Err(AdjustError::UndeterminedLocals(factor.deficient_locals.clone()));
        }
        factor.deficiency().map_or(Ok(()), |found| Err(AdjustError::Undetermined(found.blocks())))
    }

    fn solve(&mut self, state: State<'a, M>) -> Result<Solved<'a, M>, AdjustError> {
        self.determined(&state.factor)?;
        let State { equations, prior, factor, damping, at_target, .. } = state;
        let start = Instant::now();
        let mut between = between(&mut *self.watch, Phase::Solve, self.problem.layout().locals());
        let system = &self.problem.system;
        let solved = system.solve(self.pool, &factor, &equations, &prior, damping, &mut between);
        let step = unless_stopped(solved)?;
        self.seconds.solve += start.elapsed().as_secs_f64();
        let change = factor.decrease.sqrt();
        Ok(Solved { basis: Basis { equations, prior, factor, at_target }, step, change })
    }

    /// Solves the same equations for another right-hand side.
    pub(super) fn solve_again(
        &mut self,
        basis: &Basis<'a, M>,
        damping: f64,
        right: &[f64],
    ) -> Result<Vec<f64>, AdjustError> {
        let start = Instant::now();
        let mut between = between(&mut *self.watch, Phase::Solve, self.problem.layout().locals());
        let Basis { equations, prior, factor, .. } = basis;
        let system = &self.problem.system;
        let solved = system.solve_again(self.pool, factor, equations, prior, damping, right, &mut between);
        let found = unless_stopped(solved)?;
        self.seconds.solve += start.elapsed().as_secs_f64();
        Ok(found)
    }

    fn finish(mut self, mut end: End<'a, M>, initial_sum_of_squares: f64) -> Result<Adjustment, AdjustError> {
        let problem = self.problem;
        let mut unknowns = end.unknowns.clone();
        let at_target = end.basis.as_mut().and_then(|basis| basis.at_target.take()).zip(self.target);
        if let Some((_, step)) = &mut end.last {
            if let Some((at, target)) = &at_target {
                at.basis.take(step, target.datum);
            }
            problem.model.advance(&mut unknowns, step);
        }
        let residuals = problem.residuals(self.pool, &unknowns);
        if let Some((last, _)) = end.last {
            let sum_of_squares =
                self.observed_sum(&residuals) + problem.prior_sum_of_squares(&unknowns, 0..unknowns.len());
            self.accept(Iteration { sum_of_squares, ..last }, &end.unknowns, &unknowns)?;
        }
        let (mut cofactors, mut prior_redundancy, mut selected, mut lost) = (None, None, None, None);
        let asked = self.options.covariance && (self.target.is_none() || at_target.is_some());
        if let Some(basis) = end.basis.filter(|_| asked) {
            let (mut found, redundancy) = self.cofactors(basis, &end.unknowns, &at_target)?;
            lost = at_target.map(|(at, target)| {
                let transformation = at.basis.transformation(found.further, target.datum);
                self.pool.install(|| transformation.apply(problem.layout(), &mut found.cofactors))
            });
            (cofactors, prior_redundancy) = (Some(found.cofactors), Some(redundancy));
            selected = self.by_groups.then_some(found.selected);
        }
        let redundancy: Option<Vec<f64>> = cofactors
            .as_ref()
            .map(|cofactors: &Cofactors| cofactors.equations.iter().map(|share| 1.0 - share).collect());
        let counts = problem.counts(self.datum.len());
        let all = redundancy.iter().chain(&prior_redundancy).flatten();
        let excess = all.sum::<f64>() - counts.degrees_of_freedom() as f64;
        Ok(Adjustment {
            status: end.status,
            initial_sum_of_squares,
            iterations: self.iterations,
            history: self.history,
            last_local_corrections: self.last_local_corrections,
            weights: self
                .options
                .loss
                .map(|loss| problem.group_squares(&residuals).map(|square| loss.weight(square)).collect()),
            unknowns,
            residuals,
            redundancy_excess: (cofactors.is_some() && self.options.loss.is_none()).then_some(excess),
            redundancy,
            prior_redundancy,
            cofactors,
            lost,
            selected,
            undetermined: end.undetermined,
            counts,
            datum: self.datum,
            weak: self.weak,
            collapsed: self.collapsed,
            operations: problem.system.symbolic().operations(problem.layout()),
            formations: self.formations,
            seconds: self.seconds,
            ordering: problem.system.symbolic().ordering(),
            predictions: problem.system.symbolic().predictions().to_vec(),
            order: problem.system.symbolic().order().to_vec(),
        })
    }

    /// Cofactors, and the redundancy number of each unknown as an observation of itself; `values` are those of the basis.
    fn cofactors(
        &mut self,
        basis: Basis<'a, M>,
        values: &[f64],
        at_target: &Option<(AtTarget, Target<'a>)>,
    ) -> Result<(Inversion, Vec<f64>), AdjustError> {
        let Basis { equations, prior, factor, .. } = basis;
        let start = Instant::now();
        let mut between = between(&mut *self.watch, Phase::Invert, self.problem.layout().locals());
        let system = &self.problem.system;
        let mut found = unless_stopped(match self.by_groups {
            true => system.invert_by_groups(self.pool, factor, &equations, &prior, &mut between),
            false => {
                let rights = at_target.as_ref().map_or(&[][..], |(at, _)| &at.rights);
                system.invert_with(self.pool, factor, &equations, &prior, rights, &mut between)
            }
        })?;
        let prior_redundancy = self.problem.finish_cofactors(&mut found.cofactors, &self.datum, values);
        let seconds = start.elapsed().as_secs_f64();
        self.seconds.invert = seconds * found.inversion_share;
        self.seconds.cofactors = seconds * (1.0 - found.inversion_share);
        Ok((found, prior_redundancy))
    }

    /// Whether a step has led local blocks to where they harm all others; keeps them.
    pub(super) fn has_collapsed(&mut self, before: &[f64], after: &M::Prepared) -> bool {
        self.collapsed = self.problem.model.collapsed(before, after);
        !self.collapsed.is_empty()
    }

    /// Whether a step has led local blocks out of the whole; keeps them.
    pub(super) fn has_run_off(&mut self, before: &[f64], after: &M::Prepared) -> bool {
        self.collapsed = self.problem.model.run_off(before, after);
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
        self.curved = self.options.loss.is_some() && iteration.largest_change <= SHORT;
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
        ControlFlow::Break(()) => Err(AdjustError::Interrupted),
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
