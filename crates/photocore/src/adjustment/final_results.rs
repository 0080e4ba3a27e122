//! Construction of adjustment results.
//!
//! Transformation of adjusted networks to another datum, without a new adjustment.

use super::datum::{Adjusted, Datum, DatumError, moved};
use super::equations::ObservationEquations;
use super::linearized::{Inverted, Linearized};
use super::loss::{Loss, Reweighting};
use super::options::{Options, Status};
use super::problem::AnyProblem;
use super::result::{AdjustError, Adjustment, PhaseTimes, SolverStats};
use crate::normals::{FactorOptions, InvertOptions};
use crate::{Context, Threads};

impl Adjustment {
    /// Creates the result at final values, without iterations and cofactors.
    pub(super) fn at(
        problem: &AnyProblem<'_>,
        loss: Option<Loss>,
        unknowns: Vec<f64>,
        threads: &Threads,
    ) -> Self {
        let symbolic = problem.system.symbolic();
        let residuals = problem.residuals(threads, &unknowns);
        let weights =
            |loss: Loss| problem.group_squares(&residuals).map(|square| loss.weight(square)).collect();
        Self {
            status: Status::Converged,
            initial_sum_of_squares: f64::NAN,
            iterations: vec![],
            history: vec![],
            last_corrections: vec![0.0; unknowns.len()],
            weights: loss.map(weights),
            residuals,
            redundancy: None,
            prior_redundancy: None,
            redundancy_excess: None,
            unknowns,
            cofactors: None,
            lost: None,
            selected: None,
            factor: None,
            joint: None,
            undetermined: None,
            counts: problem.counts(&[]),
            datum: vec![],
            weak: vec![],
            collapsed: vec![],
            effort: SolverStats {
                operations: symbolic.operations(problem.layout()),
                formations: 0,
                seconds: PhaseTimes::default(),
                ordering: symbolic.ordering(),
                predictions: symbolic.predictions().to_vec(),
                order: symbolic.order().to_vec(),
            },
        }
    }

    /// Creates the result after the last step, without cofactors.
    ///
    /// * `loss`: robust loss of the observations.
    pub fn between(
        problem: &AnyProblem<'_>,
        loss: Option<Loss>,
        held: &[usize],
        before: &[f64],
        reached: Vec<f64>,
        threads: &Threads,
    ) -> Self {
        let last_corrections = before.iter().zip(&reached).map(|(from, to)| to - from).collect();
        let after = Self::at(problem, loss, reached, threads);
        Self { last_corrections, counts: problem.counts(held), datum: held.to_vec(), ..after }
    }

    /// Creates the result from inverted normal equations, without iterations.
    ///
    /// * `loss`: robust loss of the observations.
    pub fn inverted(
        problem: &AnyProblem<'_>,
        loss: Option<Loss>,
        mut inverted: Inverted,
        threads: &Threads,
    ) -> Self {
        let mut adjustment = Self::at(problem, loss, std::mem::take(&mut inverted.values), threads);
        adjustment.put(problem, inverted);
        adjustment
    }

    /// Sets cofactors and redundancy numbers, and adds the effort of their formation.
    #[doc(hidden)]
    pub fn put(&mut self, problem: &AnyProblem<'_>, inverted: Inverted) {
        self.redundancy = Some(inverted.cofactors.equations.iter().map(|share| 1.0 - share).collect());
        self.counts = problem.counts(&inverted.held);
        self.datum = inverted.held;
        self.selected = inverted.cofactors.groups.is_some().then_some(inverted.selected);
        self.cofactors = Some(inverted.cofactors);
        self.prior_redundancy = Some(inverted.prior_redundancy);
        self.lost = inverted.lost;
        self.effort.formations += 1;
        self.effort.seconds.add(&inverted.seconds);
    }

    /// Sum of all redundancy numbers minus the degrees of freedom.
    pub(super) fn excess(&self) -> f64 {
        let all = self.redundancy.iter().chain(&self.prior_redundancy).flatten();
        all.sum::<f64>() - self.counts.degrees_of_freedom() as f64
    }
}

impl Linearized {
    /// Transforms an adjusted network to another datum and factors its normal equations there.
    ///
    /// # Errors
    /// The network is not free, the carriers do not separate all null vectors, or the adjustment fails.
    pub fn in_datum(
        problem: &AnyProblem<'_>,
        adjusted: Adjusted<'_>,
        datum: &Datum,
        reference: &[f64],
        context: &mut Context<'_>,
    ) -> Result<Self, DatumError> {
        problem.check_lengths(adjusted.unknowns).map_err(AdjustError::from)?;
        let (unknowns, basis) = moved(problem, adjusted, datum, reference, context.threads)?;
        let Adjusted { held, loss, .. } = adjusted;
        let reweighting = loss.map(Reweighting::plain);
        let equations = ObservationEquations::new(problem, reweighting, &unknowns, held, context.threads);
        let options = FactorOptions::default();
        let formed = Self::of(&equations, unknowns, held.to_vec(), &options, context)?;
        let mut linearized = formed.determined()?;
        linearized.basis = Some(basis);
        linearized.take_to_datum(&equations, context)?;
        linearized.factor.forget();
        Ok(linearized)
    }

    /// Computes all cofactors, in the datum of the linearization.
    ///
    /// # Errors
    /// Interruption or lack of memory.
    pub fn inverted(
        self,
        problem: &AnyProblem<'_>,
        context: &mut Context<'_>,
    ) -> Result<Inverted, DatumError> {
        let equations = self.equations(problem, context.threads);
        Ok(self.invert(&equations, &InvertOptions::default(), context)?)
    }
}

impl Adjustment {
    /// Transforms an adjusted network to another datum: the unknowns and, if requested in the options, all cofactors and redundancy
    /// numbers. Earlier cofactors are not required. Returns the approximate relative rounding error of the variances.
    ///
    /// * `options`: options of the adjustment;
    /// * `reference`: values x_0 from which the carriers move least, usually the initial ones.
    ///
    /// # Errors
    /// The network is not free, carriers do not separate all null vectors, unknowns are undetermined, or an interruption.
    pub fn take_to(
        &mut self,
        problem: &AnyProblem<'_>,
        options: &Options,
        datum: &Datum,
        reference: &[f64],
        context: &mut Context<'_>,
    ) -> Result<f64, DatumError> {
        if self.undetermined.is_some() {
            return Err(DatumError::NoCofactors);
        }
        let adjusted = Adjusted { unknowns: &self.unknowns, held: &self.datum, loss: options.loss };
        if !options.covariance {
            (self.unknowns, _) = moved(problem, adjusted, datum, reference, context.threads)?;
            return Ok(0.0);
        }
        let linearized = Linearized::in_datum(problem, adjusted, datum, reference, context)?;
        let mut inverted = linearized.inverted(problem, context)?;
        self.unknowns = std::mem::take(&mut inverted.values);
        self.put(problem, inverted);
        self.redundancy_excess = options.loss.is_none().then(|| self.excess());
        Ok(self.lost.unwrap_or(0.0))
    }
}
