//! Adjusted networks in another datum, without adjusting again.

use super::datum::{Adjusted, Datum, DatumError, moved};
use super::equations::ObservationEquations;
use super::linearized::{Inverted, Linearized};
use super::loss::Reweighting;
use super::options::Options;
use super::problem::AnyProblem;
use super::result::Adjustment;
use crate::Threads;
use crate::normals::{Between, FactorOptions, InvertOptions};

impl Linearized {
    /// Moves an adjusted network to another datum, and factors its normal equations there.
    ///
    /// # Errors
    /// A network that is not free, carriers that do not carry all null vectors; what ends adjustments.
    pub fn in_datum(
        problem: &AnyProblem<'_>,
        adjusted: Adjusted<'_>,
        datum: &Datum,
        reference: &[f64],
        threads: &Threads,
        between: Between<'_>,
    ) -> Result<Self, DatumError> {
        let (unknowns, basis) = moved(problem, adjusted, datum, reference, threads)?;
        let Adjusted { held, loss, .. } = adjusted;
        let reweighting = loss.map(Reweighting::plain);
        let equations = ObservationEquations::new(problem, reweighting, &unknowns, held, threads);
        let options = FactorOptions::default();
        let formed = Self::of(&equations, unknowns, held.to_vec(), &options, threads, between)?;
        let mut linearized = formed.determined()?;
        linearized.basis = Some(basis);
        linearized.take_to_datum(&equations, threads, between)?;
        linearized.factor.forget();
        Ok(linearized)
    }

    /// All cofactors, in the datum that it was taken to.
    ///
    /// # Errors
    /// An interruption, no memory.
    pub fn inverted(
        self,
        problem: &AnyProblem<'_>,
        threads: &Threads,
        between: Between<'_>,
    ) -> Result<Inverted, DatumError> {
        let equations = self.equations(problem, threads);
        Ok(self.invert(&equations, &InvertOptions::default(), threads, between)?)
    }
}

impl Adjustment {
    /// Takes an adjusted network to another datum: unknowns and, where so asked, all cofactors and redundancy numbers. It need not have any
    /// before. Returns about how large a part of its variances may be rounding.
    ///
    /// * `options`: those of the adjustment;
    /// * `reference`: the values x_0 from which the carriers move least, usually the initial ones.
    ///
    /// # Errors
    /// A network that is not free, carriers that do not carry all null vectors, unknowns that are not determined; an interruption.
    pub fn take_to(
        &mut self,
        problem: &AnyProblem<'_>,
        options: &Options,
        datum: &Datum,
        reference: &[f64],
        threads: &Threads,
        between: Between<'_>,
    ) -> Result<f64, DatumError> {
        if self.undetermined.is_some() {
            return Err(DatumError::NoCofactors);
        }
        let adjusted = Adjusted { unknowns: &self.unknowns, held: &self.datum, loss: options.loss };
        if !options.covariance {
            (self.unknowns, _) = moved(problem, adjusted, datum, reference, threads)?;
            return Ok(0.0);
        }
        let linearized = Linearized::in_datum(problem, adjusted, datum, reference, threads, between)?;
        let mut inverted = linearized.inverted(problem, threads, between)?;
        self.unknowns = std::mem::take(&mut inverted.values);
        self.put(problem, inverted);
        self.redundancy_excess = options.loss.is_none().then(|| self.excess());
        Ok(self.lost.unwrap_or(0.0))
    }
}
