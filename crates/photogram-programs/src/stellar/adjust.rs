//! Adjustment of a stellar calibration.

use super::model::{Partials, Rows, StarImages};
use super::{COMMON, Calibration, INTERIOR, Options, Solution, Star, StellarError, Weights};
use photocore::adjustment::{self, AdjustError, Linearized, Problem};
use photocore::normals::{Layout, LayoutError, Ordering, System};
use photocore::{Context, Threads};

impl Calibration {
    /// Adjusts by least squares with exact partials, on a new thread pool.
    ///
    /// # Errors
    /// The errors of [`Calibration::adjust_on`], or threads that cannot be started.
    pub fn adjust(&self, options: &Options) -> Result<Solution, StellarError> {
        self.adjust_on(options, &mut Context::new(&Threads::new(options.adjustment.threads)?))
    }

    /// Adjusts on the caller's threads, with progress.
    ///
    /// # Errors
    /// An inconsistent calibration, undetermined unknowns, or an interruption.
    pub fn adjust_on(&self, options: &Options, context: &mut Context<'_>) -> Result<Solution, StellarError> {
        let problem = context.threads.install(|| self.problem(options.unit, Partials::Exact))?;
        let adjusted = adjustment::adjust(&problem, &options.adjustment, context)
            .map_err(|error| self.named(&problem, error, context.threads))?;
        let mut whole = None;
        if options.whole && adjusted.cofactors.is_some() {
            let values = adjusted.unknowns.clone();
            let normal = Linearized::form(&problem, None, values, vec![], context);
            let normal = normal.map_err(|error| self.named(&problem, error, context.threads))?;
            whole = self.of_parameters(&normal, &problem, context.threads)?;
        }
        Solution::new(self, options, &problem, adjusted, whole)
    }

    /// Returns the parameters without effect on observations, weights and axis at the initial values, except fixed ones. An example is the
    /// centre of a zero distortion.
    ///
    /// # Errors
    /// An inconsistent calibration, or stars without images at the initial values.
    pub fn without_effect(&self, threads: &Threads) -> Result<Vec<usize>, StellarError> {
        let problem = threads.install(|| self.problem(1.0, Partials::Exact))?;
        let normal = self.formed(&problem, vec![], threads)?;
        Ok(parameters_of(&problem, normal.factor.without_effect()))
    }

    /// Forms the normal equations at the initial values, with some unknowns fixed.
    pub(super) fn formed(
        &self,
        problem: &Problem<StarImages<'_>>,
        held: Vec<usize>,
        threads: &Threads,
    ) -> Result<Linearized, StellarError> {
        let failed = |error| self.named(problem, error, threads);
        let normal =
            Linearized::form(problem, None, problem.initial.clone(), held, &mut Context::new(threads))
                .map_err(failed)?;
        if normal.sum_of_squares.is_finite() { Ok(normal) } else { Err(failed(AdjustError::NotFinite)) }
    }

    /// Translates an error of the engine to the stars and parameters concerned.
    pub(super) fn named(
        &self,
        problem: &Problem<StarImages<'_>>,
        error: AdjustError,
        threads: &Threads,
    ) -> StellarError {
        match error {
            AdjustError::UndeterminedLocals(locals) => {
                let mut stars: Vec<usize> = locals.iter().map(|&local| problem.model.stars[local]).collect();
                stars.dedup();
                StellarError::UndeterminedStars(stars)
            }
            // The reported parameters are undetermined at the initial values.
            AdjustError::Undetermined(_) => {
                let initial = problem.initial.clone();
                let normal = Linearized::form(problem, None, initial, vec![], &mut Context::new(threads));
                let found = normal.map_or(vec![], |normal| normal.undetermined_unknowns());
                let named = found.into_iter().map(|unknowns| parameters_of(problem, unknowns));
                StellarError::Undetermined(named.collect())
            }
            AdjustError::NotFinite => {
                let sight = self.initial();
                let rows: Vec<Rows> =
                    (0..self.images.len()).map(|image| problem.model.image(&sight, image)).collect();
                StellarError::NotFinite(self.unseen(&rows))
            }
            AdjustError::Layout(error) => error.into(),
            AdjustError::Stopped(stopped) => StellarError::Stopped(stopped),
        }
    }

    /// Returns the stars without an image, given the equations of all images.
    pub(super) fn unseen(&self, rows: &[Rows]) -> Vec<usize> {
        let images = self.images.iter().zip(rows);
        let lost = images.filter(|(_, rows)| rows.constant.iter().any(|value| !value.is_finite()));
        let mut stars: Vec<usize> = lost.map(|(image, _)| image.star).collect();
        stars.sort_unstable();
        stars.dedup();
        stars
    }

    /// Returns the number of parameters: attitudes and shared ones.
    pub fn parameters(&self) -> usize {
        3 * self.pointings.len() + COMMON
    }

    pub(super) fn check(&self) -> Result<(), StellarError> {
        let counts = (self.stars.len(), self.pointings.len());
        if let Some(i) = self.images.iter().position(|i| i.star >= counts.0 || i.pointing >= counts.1) {
            return Err(StellarError::Index(format!("image {i}")));
        }
        if self.axis.is_some_and(|axis| axis.pointing >= counts.1) {
            return Err(StellarError::Index("the axis".into()));
        }
        if self.kind.lens.as_ref().is_some_and(|lens| lens.parameter_names().len() > INTERIOR) {
            return Err(StellarError::Lens);
        }
        let Weights { parameters, values, root } = &self.weights;
        let count = parameters.len();
        let known = parameters.iter().all(|&parameter| parameter < self.parameters());
        if !known
            || values.len() != count
            || root.len() != count * count
            || self.fixed.len() != self.parameters()
        {
            return Err(StellarError::Index("a weight".into()));
        }
        Ok(())
    }

    /// Builds the least-squares problem: one local block per free star and per image of a fixed star. The catalogue places are weights of
    /// decorrelated coordinates of the stars.
    pub(super) fn problem(
        &self,
        unit: f64,
        partials: Partials,
    ) -> Result<Problem<StarImages<'_>>, StellarError> {
        self.check()?;
        let model = StarImages::new(self, partials)?;
        let layout = self.layout(&model)?;
        let parameters = || self.pointings.iter().flatten().chain(&self.common).copied();
        let locals = |place: fn(&Star) -> [f64; 2]| {
            let unknowns = |&star: &usize| model.decorrelated(star, place(&self.stars[star]));
            model.stars.iter().flat_map(unknowns).chain(parameters()).collect::<Vec<f64>>()
        };
        let free = |fixed: bool| if fixed { 0.0 } else { f64::INFINITY };
        let of_star = |&star: &usize| match model.catalogue[star] {
            Some([[first, _], [_, second]]) => [unit / first, unit / second],
            None => [free(self.stars[star].fixed); 2],
        };
        let scale = self.kind.common_scale.then(|| 3 * self.pointings.len() + self.kind.scales()[1]);
        let held = self.fixed.iter().enumerate().map(|(k, &fixed)| free(fixed || Some(k) == scale));
        Ok(Problem {
            observation_sd: vec![unit; layout.equations()],
            sd: model.stars.iter().flat_map(of_star).chain(held).collect(),
            prior: locals(|star| star.catalogue),
            initial: locals(|star| star.place),
            system: System::new(layout, Ordering::Auto)?,
            model,
        })
    }

    /// Returns the natural logarithm of the determinant of the normal equations reduced to the parameters, and the full cofactor matrix of
    /// the parameters. None if some parameters are undetermined.
    pub(super) fn of_parameters(
        &self,
        normal: &Linearized,
        problem: &Problem<StarImages<'_>>,
        threads: &Threads,
    ) -> Result<Option<(f64, Vec<f64>)>, StellarError> {
        let Some(log_determinant) = normal.factor.log_determinant() else { return Ok(None) };
        let parameters: Vec<usize> =
            (problem.layout().all_locals().end..problem.layout().unknowns()).collect();
        let cofactors = normal.joint(problem, &parameters, None, &mut Context::new(threads));
        let cofactors = cofactors.map_err(|error| self.named(problem, error, threads))?;
        Ok(cofactors.map(|cofactors| (log_determinant, cofactors)))
    }

    fn layout(&self, model: &StarImages<'_>) -> Result<Layout, LayoutError> {
        let retained = model.images.iter().map(|&image| self.images[image].pointing as u32).collect();
        let (count, common) = (model.images.len(), self.pointings.len() as u32);
        let dims: Vec<usize> = self.pointings.iter().map(|_| 3).chain([COMMON]).collect();
        Layout::new(2, 2, &dims, model.start.clone(), retained)?
            .with_shared((0..=count).collect(), vec![common; count])?
            .with_terms(model.terms.iter().map(|(_, term)| term.clone()).collect())?
            .with_pairs((0..common).map(|pointing| [pointing, common]).collect())
    }
}

/// Returns the parameters among unknowns.
pub(super) fn parameters_of(problem: &Problem<StarImages<'_>>, unknowns: Vec<usize>) -> Vec<usize> {
    let first = problem.layout().all_locals().end;
    unknowns.into_iter().map(|unknown| unknown - first).collect()
}
