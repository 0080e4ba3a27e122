//! Iteration to the least-squares solution.

use std::ops::{ControlFlow, Range};
use std::time::Instant;

use rayon::ThreadPool;
use thiserror::Error;

use super::problem::{Linearized, Model, Problem};
use super::statistics::Counts;
use crate::normals::{Cofactors, Factor, Inversion, Operations, Ordering, Prior};

/// When to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Criterion {
    /// When no unknown changes by more than this fraction of its standard deviation (a priori unit weight), or when the rate of
    /// convergence shows that none would in the next iteration. Steps that raise the sum of squares are damped
    /// (Levenberg-Marquardt).
    Fraction(f64),
    /// When the weighted sum of squares changes by less than this percentage from one iteration to the next, as in the
    /// 1987 program (GIANT guide, section 6); no damping.
    Percent(f64),
    /// When the corrections of some unknowns, taken as one vector, are shorter than `limit`, as in program W5344 (USGS Computer
    /// Contribution 2, 1969); no damping. The cofactors are those of the normal equations that gave the last corrections.
    Length {
        /// The first of these unknowns, in the order of the layout.
        first: usize,
        /// How many there are.
        count: usize,
        /// In their units.
        limit: f64,
    },
}

/// How to adjust.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// When to stop.
    pub criterion: Criterion,
    /// Iterations at the most.
    pub max_iterations: usize,
    /// Whether to compute cofactors and redundancy numbers.
    pub covariance: bool,
}

/// How an adjustment ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// The criterion was met.
    Converged,
    /// The iterations ran out.
    NotConverged,
    /// The sum of squares rose, and no shorter step lowered it.
    Diverged,
}

/// One iteration.
#[derive(Debug, Clone, Copy)]
pub struct Iteration {
    /// From 1.
    pub number: usize,
    /// Weighted sum of squares after its corrections.
    pub sum_of_squares: f64,
    /// No unknown changed by more than this multiple of its standard deviation (a priori unit weight).
    pub largest_change: f64,
    /// Damping of its step; 0 for a Gauss-Newton step.
    pub damping: f64,
}

/// What the adjustment is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// Forming the normal equations and factoring them, which go together.
    Form,
    /// Solving them.
    Solve,
    /// Inverting them, with cofactors and redundancy numbers.
    Invert,
}

/// What is told while the adjustment runs.
#[derive(Debug, Clone, Copy)]
pub enum Event {
    /// A phase has come so far: `done` of `total` local blocks.
    Progress {
        /// The phase.
        phase: Phase,
        /// Local blocks done.
        done: usize,
        /// Local blocks in all.
        total: usize,
    },
    /// An iteration is over.
    Iteration(Iteration),
}

/// Time spent in each phase, in seconds, over all iterations.
#[derive(Debug, Clone, Copy, Default)]
pub struct Seconds {
    /// Forming, with the reduction of local blocks.
    pub form: f64,
    /// Factoring.
    pub factor: f64,
    /// Solving.
    pub solve: f64,
    /// Inverting.
    pub invert: f64,
    /// Cofactors and redundancy numbers.
    pub cofactors: f64,
}

/// The adjusted unknowns and how good they are.
#[derive(Debug)]
pub struct Adjustment {
    /// How it ended.
    pub status: Status,
    /// Weighted sum of squares at the initial values.
    pub initial_sum_of_squares: f64,
    /// Every iteration.
    pub iterations: Vec<Iteration>,
    /// All unknowns that are not local, in the order of the layout: at first and after each iteration.
    pub history: Vec<Vec<f64>>,
    /// The corrections of the local unknowns in the last iteration; zero where there was none.
    pub last_local_corrections: Vec<f64>,
    /// Adjusted unknowns, in the order of the layout.
    pub unknowns: Vec<f64>,
    /// Observed minus computed, in the order of groups and rows, in the units of the observations.
    pub residuals: Vec<f64>,
    /// Cofactors (a priori unit weight), when asked for; none where a diverged adjustment has lost unknowns.
    pub cofactors: Option<Cofactors>,
    /// Redundancy number of each observation, when asked for.
    pub redundancy: Option<Vec<f64>>,
    /// Redundancy number of each unknown as an observation of itself (zero unless weighted), when asked for.
    pub prior_redundancy: Option<Vec<f64>>,
    /// Counts for the degrees of freedom.
    pub counts: Counts,
    /// Predicted multiply-adds of each phase, once.
    pub operations: Operations,
    /// Formations and factorisations carried out.
    pub formations: usize,
    /// Time by phase.
    pub seconds: Seconds,
    /// The ordering in force.
    pub ordering: Ordering,
    /// The orderings that were tried, each with the predicted multiply-adds of a factorisation.
    pub predictions: Vec<(Ordering, f64)>,
    /// Kept blocks (the border is the block after the last) in the order of their elimination.
    pub order: Vec<usize>,
}

impl Adjustment {
    /// For every iteration, the corrections of all unknowns that are not local, in the order of the layout.
    pub fn corrections(&self) -> impl Iterator<Item = Vec<f64>> + '_ {
        self.history.windows(2).map(|pair| pair[0].iter().zip(&pair[1]).map(|(from, to)| to - from).collect())
    }
}

/// Why there is no adjustment.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum AdjustError {
    /// Local blocks that their observations do not determine.
    #[error("{} local blocks are not determined by their observations", .0.len())]
    UndeterminedLocals(Vec<usize>),
    /// Combinations of kept unknowns that the observations do not determine: for each the kept blocks it moves (the
    /// border is the block after the last).
    #[error("{} combinations of unknowns are not determined by the observations", .0.len())]
    Undetermined(Vec<Vec<usize>>),
    /// The initial values give observations that are not finite.
    #[error("the initial values give computed observations that are not finite")]
    NotFinite,
    /// The caller asked to stop.
    #[error("interrupted")]
    Interrupted,
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
    watch: &mut dyn FnMut(Event) -> ControlFlow<()>,
) -> Result<Adjustment, AdjustError> {
    let mut run = Run {
        problem,
        options,
        pool,
        watch,
        seconds: Seconds::default(),
        formations: 0,
        iterations: vec![],
        history: vec![problem.initial[problem.layout().all_locals().end..].to_vec()],
        last_local_corrections: vec![0.0; problem.layout().all_locals().len()],
    };
    let start = run.form(problem.initial.clone(), 0.0)?;
    if !start.sum_of_squares.is_finite() {
        return Err(AdjustError::NotFinite);
    }
    let initial_sum_of_squares = start.sum_of_squares;
    let end = match options.criterion {
        Criterion::Fraction(fraction) => run.strictly(start, fraction)?,
        Criterion::Percent(percent) => run.as_published(start, percent)?,
        Criterion::Length { first, count, limit } => run.until_short(start, first..first + count, limit)?,
    };
    run.finish(end, initial_sum_of_squares)
}

/// The problem linearized at some values, and its normal equations factored.
struct State<'a, M: Model> {
    unknowns: Vec<f64>,
    equations: Linearized<'a, M>,
    prior: Prior,
    factor: Factor,
    damping: f64,
    sum_of_squares: f64,
}

/// What cofactors are computed from: the factor of the normal equations, and what they were formed from.
struct Basis<'a, M: Model> {
    equations: Linearized<'a, M>,
    prior: Prior,
    factor: Factor,
}

/// Normal equations solved.
struct Solved<'a, M: Model> {
    basis: Basis<'a, M>,
    step: Vec<f64>,
    change: f64,
}

/// Where the iterations ended. There are no cofactors where the last values leave unknowns undetermined.
struct End<'a, M: Model> {
    status: Status,
    unknowns: Vec<f64>,
    basis: Option<Basis<'a, M>>,
    /// The last iteration and its step, still to be applied: the cofactors hold before it.
    last: Option<(Iteration, Vec<f64>)>,
}

struct Run<'a, 'w, M: Model> {
    problem: &'a Problem<M>,
    options: &'a Options,
    pool: &'a ThreadPool,
    watch: &'w mut dyn FnMut(Event) -> ControlFlow<()>,
    seconds: Seconds,
    formations: usize,
    iterations: Vec<Iteration>,
    history: Vec<Vec<f64>>,
    last_local_corrections: Vec<f64>,
}

/// A step is accepted when the sum of squares does not rise by more than its own rounding error.
const ROUNDING: f64 = 1e-12;
/// A Gauss-Newton step that changes no unknown by more than this multiple of its standard deviation is accepted as it is:
/// it lowers the sum of squares by less than the square of this, which may drown in the rounding errors of the computed
/// observations (geocentric coordinates are good to a nanometre only).
const NEGLIGIBLE: f64 = 1e-3;
/// A step that changes the unknowns by more than this multiple of their standard deviations, in the mean, is so long that local
/// unknowns are better computed afresh than linearized.
const FAR: f64 = 30.0;
/// First damping after a step that failed; it falls by ten after a success, and below [`LEAST_DAMPING`] to zero.
const FIRST_DAMPING: f64 = 1e-3;
const LEAST_DAMPING: f64 = 1e-5;
/// With this damping a step follows the gradient; if that does not lower the sum of squares, nothing will.
const MOST_DAMPING: f64 = 1e9;

impl<'a, M: Model> Run<'a, '_, M> {
    /// Gauss-Newton with step control until the corrections are a small fraction of the standard deviations.
    ///
    /// With dx the step and N the normal matrix, dx_i^2 <= q_ii dx^T N dx (Cauchy-Schwarz), and dx^T N dx is the predicted
    /// decrease of the sum of squares: its root bounds every correction in standard deviations, without an inverse.
    fn strictly(&mut self, start: State<'a, M>, fraction: f64) -> Result<End<'a, M>, AdjustError> {
        let mut state = start;
        let mut best = state.sum_of_squares;
        while self.iterations.len() < self.options.max_iterations && state.damping <= MOST_DAMPING {
            let (unknowns, damping) = (state.unknowns.clone(), state.damping);
            let harder = (10.0 * damping).max(FIRST_DAMPING);
            let Some(solved) = self.solve_unless_lost(state)? else {
                state = self.form(unknowns, harder)?;
                continue;
            };
            let number = self.iterations.len() + 1;
            let iteration =
                Iteration { number, sum_of_squares: best, largest_change: solved.change, damping };
            if damping == 0.0 && (solved.change <= fraction || self.leaves_less_than(fraction, solved.change))
            {
                let last = Some((iteration, solved.step));
                return Ok(End { status: Status::Converged, unknowns, basis: Some(solved.basis), last });
            }
            solved.basis.factor.recycle(&self.problem.system);
            let trial: Vec<f64> = unknowns.iter().zip(&solved.step).map(|(x, dx)| x + dx).collect();
            let relaxed = if damping / 10.0 < LEAST_DAMPING { 0.0 } else { damping / 10.0 };
            let far = solved.change > FAR * (unknowns.len() as f64).sqrt();
            let next = self.form(if far { self.relocated(trial) } else { trial }, relaxed)?;
            let negligible = damping == 0.0 && solved.change <= NEGLIGIBLE;
            let highest = if negligible { f64::MAX } else { best * (1.0 + ROUNDING) };
            // A sum of squares that is not a number is a failure too, and so is a step that loses a local block.
            if next.sum_of_squares <= highest && next.factor.deficient_locals.is_empty() {
                best = next.sum_of_squares;
                self.accept(Iteration { sum_of_squares: best, ..iteration }, &unknowns, &next.unknowns)?;
                state = next;
            } else {
                state = self.form(unknowns, harder)?;
            }
        }
        let status = if state.damping > MOST_DAMPING { Status::Diverged } else { Status::NotConverged };
        self.stay(state, status)
    }

    /// Whether a step is negligible itself and, the steps falling at the rate of the last two, all further ones together would be
    /// well below a limit (Hairer and Wanner 1996, section IV.8).
    fn leaves_less_than(&self, limit: f64, change: f64) -> bool {
        let before = self.iterations.last().filter(|iteration| iteration.damping == 0.0);
        let rate = before.map_or(1.0, |iteration| change / iteration.largest_change);
        change <= NEGLIGIBLE && rate < 1.0 && rate / (1.0 - rate) * change <= limit / 10.0
    }

    /// The same unknowns, with the local ones computed afresh where that lowers the sum of squares.
    fn relocated(&self, unknowns: Vec<f64>) -> Vec<f64> {
        let mut other = unknowns.clone();
        let sum = |values: &[f64]| {
            let residuals = self.problem.residuals(self.pool, values);
            self.problem.sum_of_squares(&residuals) + self.problem.prior_sum_of_squares(values)
        };
        let relocated = self.pool.install(|| self.problem.model.relocate(&mut other));
        let lower = relocated && sum(&other) < sum(&unknowns);
        if lower { other } else { unknowns }
    }

    /// The iteration of the 1987 program: full steps until the sum of squares changes by less than `percent`.
    fn as_published(&mut self, start: State<'a, M>, percent: f64) -> Result<End<'a, M>, AdjustError> {
        let mut state = start;
        let mut previous: Option<f64> = None;
        for number in 1..=self.options.max_iterations {
            let unknowns = state.unknowns.clone();
            let Some(solved) = self.solve_unless_lost(state)? else {
                return Ok(End { status: Status::Diverged, unknowns, basis: None, last: None });
            };
            let values = unknowns.iter().zip(&solved.step).map(|(x, dx)| x + dx).collect();
            state = self.form(values, 0.0)?;
            let sum_of_squares = state.sum_of_squares;
            if !sum_of_squares.is_finite() {
                return Ok(End { status: Status::Diverged, unknowns, basis: Some(solved.basis), last: None });
            }
            let iteration = Iteration { number, sum_of_squares, largest_change: solved.change, damping: 0.0 };
            self.accept(iteration, &unknowns, &state.unknowns)?;
            match previous.map(|before| (sum_of_squares - before) / before * 100.0) {
                Some(change) if change.abs() < percent => return self.stay(state, Status::Converged),
                Some(change) if change >= percent => return self.stay(state, Status::Diverged),
                _ => previous = Some(sum_of_squares),
            }
        }
        self.stay(state, Status::NotConverged)
    }

    /// The iteration of program W5344: full steps until the corrections of the unknowns in `tested` are short.
    fn until_short(
        &mut self,
        start: State<'a, M>,
        tested: Range<usize>,
        limit: f64,
    ) -> Result<End<'a, M>, AdjustError> {
        let mut state = start;
        loop {
            let unknowns = state.unknowns.clone();
            let Some(Solved { basis, step, change }) = self.solve_unless_lost(state)? else {
                return Ok(End { status: Status::Diverged, unknowns, basis: None, last: None });
            };
            let number = self.iterations.len() + 1;
            let length = step[tested.clone()].iter().map(|dx| dx * dx).sum::<f64>().sqrt();
            let values: Vec<f64> = unknowns.iter().zip(&step).map(|(x, dx)| x + dx).collect();
            let mut iteration =
                Iteration { number, sum_of_squares: f64::NAN, largest_change: change, damping: 0.0 };
            if length < limit || number >= self.options.max_iterations {
                let status = if length < limit { Status::Converged } else { Status::NotConverged };
                return Ok(End { status, unknowns, basis: Some(basis), last: Some((iteration, step)) });
            }
            state = self.form(values, 0.0)?;
            iteration.sum_of_squares = state.sum_of_squares;
            if !iteration.sum_of_squares.is_finite() {
                return Ok(End { status: Status::Diverged, unknowns, basis: Some(basis), last: None });
            }
            self.accept(iteration, &unknowns, &state.unknowns)?;
        }
    }

    /// Ends at the values reached, without a further step.
    fn stay(&mut self, state: State<'a, M>, status: Status) -> Result<End<'a, M>, AdjustError> {
        let unknowns = state.unknowns.clone();
        let state = if state.damping == 0.0 { state } else { self.form(state.unknowns, 0.0)? };
        let determined = self.determined(&state.factor).is_ok();
        let State { equations, prior, factor, .. } = state;
        let basis = determined.then_some(Basis { equations, prior, factor });
        let status = if basis.is_some() { status } else { Status::Diverged };
        Ok(End { status, unknowns, basis, last: None })
    }

    /// Solves; None where an earlier step has led to values that leave unknowns undetermined. That the initial values do is an
    /// error: then the observations do.
    fn solve_unless_lost(&mut self, state: State<'a, M>) -> Result<Option<Solved<'a, M>>, AdjustError> {
        match self.solve(state) {
            Err(AdjustError::UndeterminedLocals(_) | AdjustError::Undetermined(_))
                if !self.iterations.is_empty() =>
            {
                Ok(None)
            }
            solved => solved.map(Some),
        }
    }

    fn form(&mut self, unknowns: Vec<f64>, damping: f64) -> Result<State<'a, M>, AdjustError> {
        let start = Instant::now();
        let equations = self.pool.install(|| Linearized::new(self.problem, &unknowns));
        let prior = self.problem.prior_equations(&unknowns);
        let total = self.problem.layout().locals();
        let mut between = between(&mut *self.watch, Phase::Form, total);
        let factored = self.problem.system.factor(self.pool, &equations, &prior, damping, &mut between);
        let ControlFlow::Continue(factor) = factored else { return Err(AdjustError::Interrupted) };
        let sum_of_squares = factor.sum_of_squares + self.problem.prior_sum_of_squares(&unknowns);
        let seconds = start.elapsed().as_secs_f64();
        self.seconds.form += seconds * factor.formation_share;
        self.seconds.factor += seconds * (1.0 - factor.formation_share);
        self.formations += 1;
        Ok(State { unknowns, equations, prior, factor, damping, sum_of_squares })
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
        let State { equations, prior, factor, damping, .. } = state;
        let start = Instant::now();
        let mut between = between(&mut *self.watch, Phase::Solve, self.problem.layout().locals());
        let system = &self.problem.system;
        let solved = system.solve(self.pool, &factor, &equations, &prior, damping, &mut between);
        let ControlFlow::Continue(step) = solved else { return Err(AdjustError::Interrupted) };
        self.seconds.solve += start.elapsed().as_secs_f64();
        let change = factor.decrease.sqrt();
        Ok(Solved { basis: Basis { equations, prior, factor }, step, change })
    }

    fn finish(mut self, end: End<'a, M>, initial_sum_of_squares: f64) -> Result<Adjustment, AdjustError> {
        let problem = self.problem;
        let mut unknowns = end.unknowns.clone();
        if let Some((_, step)) = &end.last {
            unknowns.iter_mut().zip(step).for_each(|(x, dx)| *x += dx);
        }
        let residuals = problem.residuals(self.pool, &unknowns);
        if let Some((last, _)) = end.last {
            let sum_of_squares = problem.sum_of_squares(&residuals) + problem.prior_sum_of_squares(&unknowns);
            self.accept(Iteration { sum_of_squares, ..last }, &end.unknowns, &unknowns)?;
        }
        let cofactors = match end.basis {
            Some(basis) if self.options.covariance => Some(self.cofactors(basis)?),
            _ => None,
        };
        let (cofactors, prior_redundancy) = cofactors.unzip();
        let redundancy =
            |cofactors: &Cofactors| cofactors.equations.iter().map(|share| 1.0 - share).collect();
        Ok(Adjustment {
            status: end.status,
            initial_sum_of_squares,
            iterations: self.iterations,
            history: self.history,
            last_local_corrections: self.last_local_corrections,
            unknowns,
            residuals,
            redundancy: cofactors.as_ref().map(redundancy),
            prior_redundancy,
            cofactors,
            counts: problem.counts(),
            operations: problem.system.symbolic().operations(problem.layout()),
            formations: self.formations,
            seconds: self.seconds,
            ordering: problem.system.symbolic().ordering(),
            predictions: problem.system.symbolic().predictions().to_vec(),
            order: problem.system.symbolic().order().to_vec(),
        })
    }

    /// Cofactors, and the redundancy number of each unknown as an observation of itself.
    fn cofactors(&mut self, basis: Basis<'a, M>) -> Result<(Cofactors, Vec<f64>), AdjustError> {
        let Basis { equations, prior, factor } = basis;
        let start = Instant::now();
        let mut between = between(&mut *self.watch, Phase::Invert, self.problem.layout().locals());
        let found = self.problem.system.invert(self.pool, factor, &equations, &prior, &mut between);
        let ControlFlow::Continue(Inversion { mut cofactors, inversion_share, .. }) = found else {
            return Err(AdjustError::Interrupted);
        };
        let prior_redundancy = self.problem.finish_cofactors(&mut cofactors);
        let seconds = start.elapsed().as_secs_f64();
        self.seconds.invert = seconds * inversion_share;
        self.seconds.cofactors = seconds * (1.0 - inversion_share);
        Ok((cofactors, prior_redundancy))
    }

    /// Keeps an iteration that stands, with its corrections, and tells of it.
    fn accept(&mut self, iteration: Iteration, before: &[f64], after: &[f64]) -> Result<(), AdjustError> {
        let locals = self.problem.layout().all_locals();
        let corrections =
            before[locals.clone()].iter().zip(&after[locals.clone()]).map(|(from, to)| to - from);
        self.last_local_corrections = corrections.collect();
        self.history.push(after[locals.end..].to_vec());
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

fn between(
    watch: &mut dyn FnMut(Event) -> ControlFlow<()>,
    phase: Phase,
    total: usize,
) -> impl FnMut(usize) -> ControlFlow<()> {
    move |done| watch(Event::Progress { phase, done, total })
}
