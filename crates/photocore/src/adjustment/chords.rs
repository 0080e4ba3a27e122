//! Chains of chord steps with one factor and Anderson acceleration, for full steps that oscillate or creep near the solution.
//!
//! N = L L^T is the factor of the last normal equations. A chord at any values is p = N^-1 A^T l, with A and l formed there. It is
//! computed from y = L^-1 A^T l, and y^T y' equals p^T N p'. Acceleration ([`super::secants`]) therefore needs no pass over the
//! observations. Slow convergence is due to the neglected second derivatives; a new factor would not improve it.

use std::time::Instant;

use nalgebra::DMatrix;

use super::damped::ROUNDING;
use super::equations::ObservationEquations;
use super::options::{Iteration, NEGLIGIBLE, Phase, Stop};
use super::result::AdjustError;
use super::run::{Run, State, between};
use super::secants::Secants;
use crate::normals::{Chord, dot};

/// Maximum change, in standard deviations, of a step followed by chords; farther from the solution chords raise the sum of squares.
const CLOSE: f64 = 3.0;
/// Maximum number of chords after a step, and of stored differences.
const MOST: usize = 40;
/// Number of chords, and the ratio that their lengths must fall below; otherwise new normal equations are more effective.
const LONG: usize = 10;
const FALL: f64 = 0.5;

/// Values with the chord from them.
struct Link {
    values: Vec<f64>,
    sum_of_squares: f64,
    chord: Chord,
}

impl<'a> Run<'a, '_> {
    /// Whether a full step is followed by chords until convergence.
    pub(super) fn is_followed(&self, state: &State<'a>, step: &Iteration) -> bool {
        step.damping == 0.0
            && step.largest_change < CLOSE
            && self.options.loss.is_none()
            && self.problem.model.steps_swing()
            && state.linearized.factor.has_cached()
    }

    /// Returns the values after chords from given values.
    pub(super) fn chords(
        &mut self,
        state: &State<'a>,
        values: Vec<f64>,
        above: (f64, Stop),
    ) -> Result<Vec<f64>, AdjustError> {
        let found = self.followed(state, values.clone(), above)?;
        self.chord = found.as_ref().map(|&(_, length)| length);
        Ok(found.map_or(values, |(values, _)| values))
    }

    /// Returns the best values of a chain of chords and the length of the chord there. None if the sum of squares at the given values is
    /// above `best`.
    fn followed(
        &mut self,
        state: &State<'a>,
        values: Vec<f64>,
        (best, stop): (f64, Stop),
    ) -> Result<Option<(Vec<f64>, f64)>, AdjustError> {
        let start = Instant::now();
        let (mut secants, mut differences) = (Secants::default(), Vec::<Vec<f64>>::new());
        let mut here = self.link(state, values)?;
        if here.is_higher_than(best) {
            return Ok(None);
        }
        let (mut end, mut lowest) = ((here.values.clone(), here.change()), here.sum_of_squares);
        let mut lengths = vec![here.change()];
        while lengths.len() < MOST && falls(&lengths) && !is_enough(stop, &here) {
            let taken = here.corrected(&secants, &differences);
            let next = self.link(state, self.problem.advanced(&here.values, &taken))?;
            // An accelerated chord may temporarily raise the sum of squares, by no more than the last predicted decrease.
            if next.is_higher_than(lowest + here.chord.decrease) {
                break;
            }
            if !next.is_higher_than(lowest) {
                (end, lowest) = ((next.values.clone(), next.change()), lowest.min(next.sum_of_squares));
            }
            secants.keep(taken, minus(&next.chord.step, &here.chord.step), MOST);
            differences.push(minus(&next.chord.reduced, &here.chord.reduced));
            lengths.push(next.change());
            here = next;
        }
        self.seconds.solve += start.elapsed().as_secs_f64();
        Ok(Some(end))
    }

    /// Computes the chord and the sum of squares at given values.
    fn link(&mut self, state: &State<'a>, values: Vec<f64>) -> Result<Link, AdjustError> {
        let (equations, chord) = self.chord_at(state, &values)?;
        let sum_of_squares = self.objective_at(&values, equations.at());
        Ok(Link { values, sum_of_squares, chord })
    }

    /// Forms the equations at given values and computes their chord.
    pub(super) fn chord_at(
        &mut self,
        state: &State<'a>,
        values: &[f64],
    ) -> Result<(ObservationEquations<'a>, Chord), AdjustError> {
        let (problem, threads) = (self.problem, self.threads);
        let equations = ObservationEquations::new(problem, None, values, &self.datum, threads);
        let prior = problem.prior_equations(&problem.terms(values), &self.datum);
        let mut between = between(&mut *self.watch, Phase::Solve, problem.layout().locals());
        let of = (&equations as _, &prior);
        let chord = problem.system.chord(threads, &state.linearized.factor, of, &mut between);
        Ok((equations, chord?))
    }
}

impl Link {
    /// Length of the chord in standard deviations.
    fn change(&self) -> f64 {
        self.chord.decrease.sqrt()
    }

    /// Returns the chord after Anderson acceleration with the stored steps and differences of y.
    fn corrected(&self, secants: &Secants, differences: &[Vec<f64>]) -> Vec<f64> {
        if !secants.correct() {
            return self.chord.step.clone();
        }
        let row = |k: usize| if k == 0 { &self.chord.reduced } else { &differences[k - 1] };
        let count = differences.len() + 1;
        let shares = secants.shares(&DMatrix::from_fn(count, count, |i, j| dot(row(i), row(j))));
        shares.map_or_else(|| self.chord.step.clone(), |shares| secants.corrected(&self.chord.step, &shares))
    }

    /// Whether the sum of squares exceeds a limit, apart from rounding errors and negligible chords, or is not finite.
    fn is_higher_than(&self, sum_of_squares: f64) -> bool {
        let highest = sum_of_squares * (1.0 + ROUNDING);
        !(self.sum_of_squares <= highest || self.change() <= NEGLIGIBLE && self.sum_of_squares.is_finite())
            || !self.change().is_finite()
    }
}

/// Whether the chord satisfies the stopping rule of full steps.
fn is_enough(stop: Stop, link: &Link) -> bool {
    stop.at_change(link.change()) || stop.at_decrease(link.chord.decrease, link.sum_of_squares)
}

/// Whether the chord lengths are still decreasing.
fn falls(lengths: &[f64]) -> bool {
    let before = lengths.len().checked_sub(LONG + 1).map(|first| lengths[first]);
    before.is_none_or(|before| lengths[lengths.len() - 1] < FALL * before)
}

/// Returns the elementwise difference.
fn minus(to: &[f64], from: &[f64]) -> Vec<f64> {
    to.iter().zip(from).map(|(to, from)| to - from).collect()
}
