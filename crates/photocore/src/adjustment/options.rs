//! How to adjust: which steps are taken and when they stop, what they say of the next, and the events on the way.

use super::loss::Loss;

/// How to adjust. By default: squares, to a hundred-thousandth of the standard deviations, with cofactors.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// Which steps to take, and when to stop.
    pub method: Method,
    /// Iterations at the most.
    pub max_iterations: usize,
    /// Whether to compute cofactors and redundancy numbers.
    pub covariance: bool,
    /// What takes the place of the squares of the observations; None for least squares.
    pub loss: Option<Loss>,
    /// Threads that are started for it; 0 for one on each processor. Without meaning where the caller gives its own.
    pub threads: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self { method: Method::default(), max_iterations: 100, covariance: true, loss: None, threads: 0 }
    }
}

/// How an adjustment ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// The rule of the method was met.
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
    /// Weighted sum of squares after its corrections, of losses instead of squares where the options ask for a loss.
    pub sum_of_squares: f64,
    /// No unknown changed by more than this multiple of its standard deviation (a priori unit weight).
    pub largest_change: f64,
    /// Damping of its step, a fraction of the diagonal of the normal matrix; 0 for a Gauss-Newton step.
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

/// An event of an adjustment that runs.
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

/// How an adjustment goes to the solution: the control of its steps, each with the rules by which it can stop.
///
/// Where a rule looks at a step before it is taken ([`Stop::Fraction`], [`Stop::Foreseen`], [`Published::Length`]) the last one is taken nevertheless, and the
/// cofactors are those of the normal equations that gave it; where it looks at the sum of squares after a step ([`Stop::Decrease`],
/// [`Published::Percent`]) the normal equations are formed once more, at the values reached. A trust region, whose last equations may
/// be damped, always forms them once more.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// Full steps (Gauss-Newton) whatever becomes of the sum of squares, in the unknowns of the published programs.
    Full(Published),
    /// Full steps; one that raises the sum of squares is taken back and damped (Levenberg-Marquardt), and so are those after it until they
    /// do without. Where the last steps fall slowly ([`super::Model::ends_slowly`]) one of them is followed by a chord.
    Damped(Stop),
    /// Steps damped from the first one on, by how well the linearized equations predict what they do (Levenberg-Marquardt with the gain
    /// ratio of Nielsen 1999): for far starts. The damping takes the place of a datum where there is none; one is held at the end, for
    /// the cofactors.
    TrustRegion(Stop),
}

/// Damping of the first step in a trust region.
pub(super) const FIRST_DAMPING: f64 = 1e-4;

impl Default for Method {
    /// Full steps, damped where they fail, to a hundred-thousandth of the standard deviations.
    fn default() -> Self {
        Self::Damped(Stop::Fraction(1e-5))
    }
}

/// When steps that are controlled have led to the solution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stop {
    /// When no unknown changes by more than this fraction of its standard deviation (a priori unit weight), or when the rate of
    /// convergence shows that none would in the next iteration.
    Fraction(f64),
    /// When a step lowers the sum of squares, or would by the linearized equations, by less than this fraction of it.
    Decrease(f64),
    /// When a full step moves no unknown by more than this multiple of its standard deviation, or when the next one would not: with c^2
    /// the decrease of the sum of squares that the linearized equations foresee, what it falls short of that is, in the order that counts,
    /// the decrease that the next step would bring. For adjustments that are gone on from, where a step is dearer than its last digits.
    Foreseen(f64),
}

impl Stop {
    /// Whether a step is the last one that changes no unknown by more than `change` standard deviations.
    pub(super) fn at_change(self, change: f64) -> bool {
        matches!(self, Self::Fraction(fraction) | Self::Foreseen(fraction) if change <= fraction)
    }

    /// Whether a step is the last one that lowers a sum of squares by `decrease`.
    pub(super) fn at_decrease(self, decrease: f64, sum: f64) -> bool {
        self.least_decrease(sum).is_some_and(|least| decrease <= least)
    }

    /// By how much a step must lower a sum of squares to go on, where that counts.
    pub(super) fn least_decrease(self, sum: f64) -> Option<f64> {
        if let Self::Decrease(fraction) = self { Some(fraction * sum) } else { None }
    }
}

/// When published programs stopped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Published {
    /// When the weighted sum of squares changes by less than this percentage from one iteration to the next, as in the 1987 program
    /// (GIANT guide, section 6); diverged when it rises by more.
    Percent(f64),
    /// When the corrections of some unknowns, taken as one vector, are shorter than `limit`, as in program W5344 (USGS Computer
    /// Contribution 2, 1969).
    Length {
        /// The first of these unknowns, in the order of the layout.
        first: usize,
        /// How many there are.
        count: usize,
        /// In their units.
        limit: f64,
    },
}

/// A Gauss-Newton step that changes no unknown by more than this multiple of its standard deviation is accepted as it is:
/// it lowers the sum of squares by less than the square of this, which may drown in the rounding errors of the computed
/// observations (geocentric coordinates are good to a nanometre only).
pub(super) const NEGLIGIBLE: f64 = 1e-3;
/// Nor does one that changes them by no more than this in the mean bring about other cofactors: the bound on the change of any one unknown
/// grows with the root of their number.
pub(super) const IN_THE_MEAN: f64 = 1e-5;

/// Whether cofactors before a step that changes so many unknowns by `change` standard deviations together are those after it.
pub(super) fn leaves_cofactors(change: f64, unknowns: usize) -> bool {
    change <= NEGLIGIBLE.max(IN_THE_MEAN * (unknowns as f64).sqrt())
}

/// So many full steps, the last of which is longer than this part of the first, do not fall any more.
const ALIKE: usize = 5;
const ALIKE_FALL: f64 = 0.9;
/// Steps that change the unknowns by less than this multiple of their standard deviations leave the normal equations as they are, to much
/// less than what a chord gains.
const CLOSE: f64 = 30.0;
/// And by more than this one: after a shorter step the next one is the last.
const NOT_YET: f64 = 10.0 * NEGLIGIBLE;
/// A step so small a part of the one before is on the way to the end, and so is a chord after it.
const FALLING: f64 = 0.1;

/// The steps of an adjustment so far.
#[derive(Debug, Clone, Copy)]
pub struct History<'a> {
    /// One after the other.
    pub iterations: &'a [Iteration],
    /// The length of the chord that followed the last step, where one did.
    pub chord: Option<f64>,
    /// How many unknowns there are.
    pub unknowns: usize,
}

impl History<'_> {
    /// Whether a full step leaves cofactors as they are and, the steps falling at the rate of the last two, chords counted, all further ones
    /// together would not exceed a limit (Hairer and Wanner 1996, section IV.8).
    pub fn leaves_less_than(&self, limit: f64, change: f64) -> bool {
        let rate = self.before().map_or(1.0, |before| change / self.chord.unwrap_or(before.largest_change));
        leaves_cofactors(change, self.unknowns) && rate < 1.0 && rate / (1.0 - rate) * change <= limit
    }

    /// Whether full steps are negligible and have long been as long as this one: what still moves, the observations do not determine
    /// beyond the rounding of its equations.
    pub fn falls_no_more(&self, change: f64) -> bool {
        let last = self.iterations.len().checked_sub(ALIKE).map(|first| &self.iterations[first..]);
        last.is_some_and(|last| {
            let negligible = |step: &Iteration| step.damping == 0.0 && step.largest_change <= NEGLIGIBLE;
            change <= NEGLIGIBLE
                && last.iter().all(negligible)
                && change > ALIKE_FALL * last[0].largest_change
        })
    }

    /// Whether a chord pays after a full step.
    pub fn is_for_chord(&self, change: f64) -> bool {
        (NOT_YET..CLOSE).contains(&change)
            && self.before().is_some_and(|before| change <= FALLING * before.largest_change)
    }

    /// Whether a chord after a full step is taken: what is not a number does not fall.
    pub fn is_chord(chord: f64, change: f64) -> bool {
        chord <= FALLING * change
    }

    /// The last step, where it was a full one.
    fn before(&self) -> Option<&Iteration> {
        self.iterations.last().filter(|iteration| iteration.damping == 0.0)
    }
}
