//! An adjustment told again from where it ended, in another datum.

use std::ops::ControlFlow;

use rayon::ThreadPool;

use super::datum::{Adjusted, Datum, DatumError, InDatum, moved};
use super::loss::Loss;
use super::options::{Options, Status};
use super::problem::{Model, Problem};
use super::result::{Adjustment, Seconds};

impl Adjustment {
    /// Takes an adjusted network to another datum: unknowns and, where so asked, all cofactors and redundancy numbers. It need not have any
    /// before. Returns about how large a part of its variances may be rounding.
    ///
    /// * `options`: those of the adjustment;
    /// * `reference`: the values x_0 from which the carriers move least, usually the initial ones.
    ///
    /// # Errors
    /// A network that is not free, carriers that do not carry all null vectors, unknowns that are not determined; an interruption.
    pub fn take_to<M: Model>(
        &mut self,
        problem: &Problem<M>,
        options: &Options,
        datum: &Datum,
        reference: &[f64],
        pool: &ThreadPool,
        between: &mut dyn FnMut(usize) -> ControlFlow<()>,
    ) -> Result<f64, DatumError> {
        if self.undetermined.is_some() {
            return Err(DatumError::NoCofactors);
        }
        let adjusted = Adjusted { unknowns: &self.unknowns, held: &self.datum, loss: options.loss };
        if !options.covariance {
            (self.unknowns, _) = moved(problem, adjusted, datum, reference, pool)?;
            return Ok(0.0);
        }
        let found = InDatum::new(problem, adjusted, datum, reference, pool, between)?;
        let redundancy = found.redundancy();
        let sum: f64 = redundancy.iter().chain(&found.prior_redundancy).sum();
        let excess = sum - self.counts.degrees_of_freedom() as f64;
        self.redundancy_excess = options.loss.is_none().then_some(excess);
        self.redundancy = Some(redundancy);
        self.prior_redundancy = Some(found.prior_redundancy);
        self.unknowns = found.unknowns;
        self.cofactors = Some(found.cofactors);
        self.formations += 1;
        self.seconds.add(&found.seconds);
        Ok(found.lost)
    }
}

impl InDatum {
    /// Redundancy numbers of all observations but those of the unknowns themselves.
    fn redundancy(&self) -> Vec<f64> {
        self.cofactors.equations.iter().map(|share| 1.0 - share).collect()
    }

    /// The adjustment as it would stand in its datum, without the iterations.
    ///
    /// * `held`: the unknowns that gave the adjustment its datum;
    /// * `loss`: what has weighted the observations.
    pub fn into_adjustment<M: Model>(
        self,
        problem: &Problem<M>,
        held: Vec<usize>,
        loss: Option<Loss>,
        pool: &ThreadPool,
    ) -> Adjustment {
        let redundancy = Some(self.redundancy());
        let reached = Adjustment::reached(problem, self.unknowns, pool);
        let weights = |loss: Loss| {
            problem.group_squares(&reached.residuals).map(|square| loss.weight(square)).collect()
        };
        Adjustment {
            weights: loss.map(weights),
            redundancy,
            prior_redundancy: Some(self.prior_redundancy),
            cofactors: Some(self.cofactors),
            counts: problem.counts(held.len()),
            datum: held,
            formations: 1,
            seconds: self.seconds,
            ..reached
        }
    }
}

impl Adjustment {
    /// An adjustment that is told where it has ended, without iterations and cofactors.
    pub(super) fn reached<M: Model>(problem: &Problem<M>, unknowns: Vec<f64>, pool: &ThreadPool) -> Self {
        let locals = problem.layout().all_locals();
        let symbolic = problem.system.symbolic();
        Self {
            status: Status::Converged,
            initial_sum_of_squares: f64::NAN,
            iterations: vec![],
            history: vec![unknowns[locals.end..].to_vec()],
            last_local_corrections: vec![0.0; locals.len()],
            weights: None,
            residuals: problem.residuals(pool, &unknowns),
            redundancy: None,
            prior_redundancy: None,
            redundancy_excess: None,
            unknowns,
            cofactors: None,
            lost: None,
            selected: None,
            undetermined: None,
            counts: problem.counts(0),
            datum: vec![],
            weak: vec![],
            collapsed: vec![],
            operations: symbolic.operations(problem.layout()),
            formations: 0,
            seconds: Seconds::default(),
            ordering: symbolic.ordering(),
            predictions: symbolic.predictions().to_vec(),
            order: symbolic.order().to_vec(),
        }
    }
}
