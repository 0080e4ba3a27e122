//! Chords one after the other with one factor, each corrected by those before: where full steps swing or creep, near the end.
//!
//! With the factor N = L L^T of the last normal equations a chord from any values is p = N^-1 A^T l, A and l formed there: it is found from
//! y = L^-1 A^T l, and y^T y' is p^T N p'. What chords have shown ([`super::secants`]) therefore costs no pass over the observations. They fall
//! slowly because of what all of them leave out, and not because the factor is that of other values: a new one would not help.

use std::time::Instant;

use nalgebra::DMatrix;

use super::damped::ROUNDING;
use super::equations::ObservationEquations;
use super::options::{Iteration, NEGLIGIBLE, Phase, Stop};
use super::result::AdjustError;
use super::run::{Run, State, between};
use super::secants::Secants;
use crate::normals::{Chord, dot};

/// Steps that change the unknowns by less than this multiple of their standard deviations leave the normal equations as they are; from farther
/// away chords lead higher.
const CLOSE: f64 = 3.0;
/// So many chords follow a step at the most, and are remembered;
const MOST: usize = 40;
/// so many leave this part of the first of them at the most: else normal equations of other values do better.
const LONG: usize = 10;
const FALL: f64 = 0.5;

/// A link of the chain: values with the chord from there.
struct Link {
    values: Vec<f64>,
    sum_of_squares: f64,
    chord: Chord,
}

impl<'a> Run<'a, '_> {
    /// Whether a full step is followed by chords until these have led to the solution.
    pub(super) fn is_followed(&self, state: &State<'a>, step: &Iteration) -> bool {
        step.damping == 0.0
            && step.largest_change < CLOSE
            && self.options.loss.is_none()
            && self.problem.model.steps_swing()
            && state.linearized.factor.has_cached()
    }

    /// The values that chords lead to from those after a step.
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

    /// The lowest values that chords lead to, the first of them from those given, and the length of the chord there; None where the first
    /// would begin higher than `best`.
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
            // What a chord learns may lead higher before it leads lower: by no more than the last was to lower.
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

    /// The chord from given values, with the sum of squares there.
    fn link(&mut self, state: &State<'a>, values: Vec<f64>) -> Result<Link, AdjustError> {
        let (equations, chord) = self.chord_at(state, &values)?;
        let sum_of_squares = self.objective_at(&values, equations.at());
        Ok(Link { values, sum_of_squares, chord })
    }

    /// The equations at given values, and the chord to them.
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
    /// The length of the chord in standard deviations.
    fn change(&self) -> f64 {
        self.chord.decrease.sqrt()
    }

    /// Corrected by what those before have shown: by how much y was another after each.
    fn corrected(&self, secants: &Secants, differences: &[Vec<f64>]) -> Vec<f64> {
        if !secants.correct() {
            return self.chord.step.clone();
        }
        let row = |k: usize| if k == 0 { &self.chord.reduced } else { &differences[k - 1] };
        let count = differences.len() + 1;
        let shares = secants.shares(&DMatrix::from_fn(count, count, |i, j| dot(row(i), row(j))));
        shares.map_or_else(|| self.chord.step.clone(), |shares| secants.corrected(&self.chord.step, &shares))
    }

    /// Whether it begins higher than a sum of squares, rounding apart, which is more than the square of a chord that is negligible; also
    /// where something is not a number.
    fn is_higher_than(&self, sum_of_squares: f64) -> bool {
        let highest = sum_of_squares * (1.0 + ROUNDING);
        !(self.sum_of_squares <= highest || self.change() <= NEGLIGIBLE && self.sum_of_squares.is_finite())
            || !self.change().is_finite()
    }
}

/// Whether full steps would end where a chord is as short.
fn is_enough(stop: Stop, link: &Link) -> bool {
    stop.at_change(link.change()) || stop.at_decrease(link.chord.decrease, link.sum_of_squares)
}

/// Whether chords of these lengths go on to fall.
fn falls(lengths: &[f64]) -> bool {
    let before = lengths.len().checked_sub(LONG + 1).map(|first| lengths[first]);
    before.is_none_or(|before| lengths[lengths.len() - 1] < FALL * before)
}

/// How far some numbers are from others.
fn minus(to: &[f64], from: &[f64]) -> Vec<f64> {
    to.iter().zip(from).map(|(to, from)| to - from).collect()
}
