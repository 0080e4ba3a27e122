//! A part of a problem that is adjusted in parts: a node of its elimination tree (Helmert 1880; Wolf 1978).
//!
//! A part has observations of its own, unknowns that nothing outside of it and the parts below touches, and outer ones, which parts above
//! eliminate. With what the parts below leave it forms its normal equations, eliminates its own unknowns and leaves the rest for the
//! part above ([`Contribution`]); from the step of the outer unknowns follow those of its own, and from the cofactors of the outer
//! unknowns its own. The part of a problem without outer unknowns is the last one.

use std::time::Instant;

use rayon::ThreadPool;
use thiserror::Error;

use super::options::Phase;
use super::problem::{Linearized, Model, Problem};
use super::result::{AdjustError, Adjustment, Seconds, unless_stopped};
use super::run::{Watch, between};
use crate::normals::{Contribution, Factor, Prior, packed};

/// Why a part is not formed, solved or inverted.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum PartError {
    /// What it was given is not over its outer unknowns, or those of the parts below; or its own equations are damped.
    #[error("what a part was given by others is over other unknowns, or its equations are damped")]
    Foreign,
    /// What ends adjustments.
    #[error(transparent)]
    Adjust(#[from] AdjustError),
}

/// A part at given values, its own unknowns eliminated.
#[derive(Debug)]
pub struct Part {
    values: Vec<f64>,
    prior: Prior,
    factor: Factor,
    damping: f64,
    sum_of_squares: f64,
    seconds: Seconds,
}

impl Part {
    /// Forms the normal equations at given values and eliminates what is at home here.
    ///
    /// * `contributions`: what the parts below leave, in the order of the layout: they are added in this order;
    /// * `damping`: a fraction of the diagonal of the normal equations that is added to it.
    ///
    /// # Errors
    /// Contributions of other unknowns, an interruption, no memory.
    pub fn form<M: Model>(
        problem: &Problem<M>,
        values: Vec<f64>,
        contributions: &[Contribution<'_>],
        damping: f64,
        pool: &ThreadPool,
        watch: Watch<'_>,
    ) -> Result<Self, PartError> {
        let (start, layout) = (Instant::now(), problem.layout());
        let blocks = layout.contributions();
        let fit = |(given, blocks): (&Contribution<'_>, &Vec<u32>)| {
            given.is_over(layout.unknowns_of(blocks).count())
        };
        if contributions.len() != blocks.len() || !contributions.iter().zip(blocks).all(fit) {
            return Err(PartError::Foreign);
        }
        let prior = problem.prior_equations(&values, &[]);
        let factor = {
            let equations = linearized(problem, &values, pool).with_contributions(contributions);
            let mut between = between(watch, Phase::Form, layout.locals());
            unless_stopped(problem.system.factor(pool, &equations, &prior, damping, &mut between))?
        };
        // The factor waits for the way down, perhaps beside those of many others.
        problem.system.release();
        let sum_of_squares = factor.sum_of_squares + problem.prior_sum_of_squares(&values, 0..values.len());
        let (took, share) = (start.elapsed().as_secs_f64(), factor.formation_share);
        let seconds = Seconds { form: took * share, factor: took * (1.0 - share), ..Seconds::default() };
        Ok(Self { values, prior, factor, damping, sum_of_squares, seconds })
    }

    /// What it leaves for the outer unknowns; empty the second time.
    pub fn take_contribution(&mut self) -> Contribution<'static> {
        self.factor.take_contribution()
    }

    /// Weighted sum of squares of what is observed here, weighted unknowns among it.
    pub fn sum_of_squares(&self) -> f64 {
        self.sum_of_squares
    }

    /// The share of what is eliminated here in the decrease of the sum of squares that a full step predicts.
    pub fn decrease(&self) -> f64 {
        self.factor.decrease
    }

    /// Why the unknowns that are eliminated here are not determined.
    pub fn undetermined(&self) -> Option<AdjustError> {
        if !self.factor.deficient_locals.is_empty() {
            return Some(AdjustError::UndeterminedLocals(self.factor.deficient_locals.clone()));
        }
        self.factor.deficiency().map(|found| AdjustError::Undetermined(found.blocks()))
    }

    /// The step of all unknowns, those of the outer ones being given.
    ///
    /// # Errors
    /// An interruption, no memory; another number of outer unknowns.
    pub fn solve<M: Model>(
        &self,
        problem: &Problem<M>,
        outer: &[f64],
        pool: &ThreadPool,
        watch: Watch<'_>,
    ) -> Result<Vec<f64>, PartError> {
        let system = &problem.system;
        if outer.len() != system.symbolic().outer_unknowns() {
            return Err(PartError::Foreign);
        }
        let equations = linearized(problem, &self.values, pool);
        let Self { factor, prior, damping, .. } = self;
        let mut between = between(watch, Phase::Solve, problem.layout().locals());
        let solved = system.solve_below(pool, factor, &equations, prior, *damping, outer, &mut between);
        Ok(unless_stopped(solved)?)
    }

    /// The adjustment of what is at home here, and the cofactors of the unknowns of each part below: lower triangles, column by column.
    ///
    /// * `outer`: the same of the outer unknowns;
    /// * `reached`: the values after the last step; cofactors are those of the values before it.
    ///
    /// # Errors
    /// Unknowns that are not determined, an interruption, no memory; another number of outer unknowns.
    pub fn invert<M: Model>(
        self,
        problem: &Problem<M>,
        outer: &[f64],
        reached: Vec<f64>,
        pool: &ThreadPool,
        watch: Watch<'_>,
    ) -> Result<(Adjustment, Vec<Vec<f64>>), PartError> {
        if let Some(undetermined) = self.undetermined() {
            return Err(undetermined.into());
        }
        let (layout, system) = (problem.layout(), &problem.system);
        if outer.len() != packed(system.symbolic().outer_unknowns()) || self.damping != 0.0 {
            return Err(PartError::Foreign);
        }
        let start = Instant::now();
        let Self { values, prior, factor, mut seconds, .. } = self;
        let mut found = {
            let equations = linearized(problem, &values, pool);
            let mut between = between(watch, Phase::Invert, layout.locals());
            unless_stopped(system.invert_below(pool, factor, &equations, &prior, outer, &mut between))?
        };
        system.release();
        let below =
            layout.contributions().iter().map(|blocks| found.selected.triangle(layout, blocks)).collect();
        let prior_redundancy = problem.finish_cofactors(&mut found.cofactors, &[], &values);
        let took = start.elapsed().as_secs_f64();
        seconds.invert = took * found.inversion_share;
        seconds.cofactors = took * (1.0 - found.inversion_share);
        let redundancy = found.cofactors.equations.iter().map(|share| 1.0 - share).collect();
        let adjustment = Adjustment {
            redundancy: Some(redundancy),
            prior_redundancy: Some(prior_redundancy),
            cofactors: Some(found.cofactors),
            formations: 1,
            seconds,
            ..Adjustment::between(problem, &values, reached, pool)
        };
        Ok((adjustment, below))
    }
}

impl Adjustment {
    /// An adjustment that is told after its last step, without cofactors.
    pub fn between<M: Model>(
        problem: &Problem<M>,
        before: &[f64],
        reached: Vec<f64>,
        pool: &ThreadPool,
    ) -> Self {
        let locals = problem.layout().all_locals();
        let corrections = before[locals.clone()].iter().zip(&reached).map(|(from, to)| to - from).collect();
        let after = Self::reached(problem, reached, pool);
        let history = [vec![before[locals.end..].to_vec()], after.history].concat();
        Self { history, last_local_corrections: corrections, ..after }
    }
}

fn linearized<'a, M: Model>(problem: &'a Problem<M>, values: &[f64], pool: &ThreadPool) -> Linearized<'a, M> {
    pool.install(|| Linearized::new(problem, values, &[], None))
}
