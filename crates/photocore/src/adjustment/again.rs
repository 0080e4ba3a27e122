//! An adjustment told again from where it ended, in another datum.

use rayon::ThreadPool;

use super::datum::InDatum;
use super::loss::Loss;
use super::options::Status;
use super::problem::{Model, Problem};
use super::result::{Adjustment, Seconds};

impl InDatum {
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
        let residuals = problem.residuals(pool, &self.unknowns);
        let weights =
            |loss: Loss| problem.group_squares(&residuals).map(|square| loss.weight(square)).collect();
        let locals = problem.layout().all_locals();
        let symbolic = problem.system.symbolic();
        Adjustment {
            status: Status::Converged,
            initial_sum_of_squares: f64::NAN,
            iterations: vec![],
            history: vec![self.unknowns[locals.end..].to_vec()],
            last_local_corrections: vec![0.0; locals.len()],
            weights: loss.map(weights),
            residuals,
            redundancy: Some(self.cofactors.equations.iter().map(|share| 1.0 - share).collect()),
            prior_redundancy: Some(self.prior_redundancy),
            redundancy_excess: None,
            unknowns: self.unknowns,
            cofactors: Some(self.cofactors),
            selected: None,
            undetermined: None,
            counts: problem.counts(held.len()),
            datum: held,
            weak: vec![],
            collapsed: vec![],
            operations: symbolic.operations(problem.layout()),
            formations: 1,
            seconds: Seconds::default(),
            ordering: symbolic.ordering(),
            predictions: symbolic.predictions().to_vec(),
            order: symbolic.order().to_vec(),
        }
    }
}
