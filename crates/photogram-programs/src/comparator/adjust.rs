//! Adjustment of a comparator calibration.
//!
//! Observation equations of a calibration.

use std::ops::Range;

use super::measure::{Basis, Comparator, Placement};
use super::{Calibration, CalibrationError, Measurement, Solution};
use photocore::adjustment::{self, AdjustError, Adjustment, Evaluated, Model, Problem, leading_matrix};
use photocore::normals::{GroupRows, Layout, Ordering, System};
use photocore::{Context, Threads};

impl Calibration {
    /// Adjusts all unknowns together by least squares, on a new thread pool.
    ///
    /// # Errors
    /// The errors of [`Calibration::adjust_on`], or threads that cannot be started.
    pub fn adjust(&self, options: &adjustment::Options) -> Result<Solution, CalibrationError> {
        self.adjust_on(options, &mut Context::new(&Threads::new(options.threads)?))
    }

    /// Adjusts on the caller's threads, with progress.
    ///
    /// # Errors
    /// An inconsistent calibration, undetermined unknowns, or an interruption.
    pub fn adjust_on(
        &self,
        options: &adjustment::Options,
        context: &mut Context<'_>,
    ) -> Result<Solution, CalibrationError> {
        self.check()?;
        let problem = context.threads.install(|| self.problem())?;
        let cases = self.cases.len();
        let adjusted = adjustment::adjust(&problem, options, context).map_err(|error| match error {
            AdjustError::UndeterminedLocals(points) => CalibrationError::UndeterminedPoints(points),
            AdjustError::Undetermined(combinations) => CalibrationError::Undetermined(
                combinations
                    .into_iter()
                    .map(|blocks| {
                        let (cases, comparator): (Vec<_>, Vec<_>) =
                            blocks.into_iter().partition(|&block| block < cases);
                        (cases, !comparator.is_empty())
                    })
                    .collect(),
            ),
            AdjustError::NotFinite => CalibrationError::NotFinite,
            AdjustError::Layout(error) => error.into(),
            AdjustError::Stopped(stopped) => CalibrationError::Stopped(stopped),
        })?;
        Ok(Solution::new(&problem, adjusted))
    }

    fn check(&self) -> Result<(), CalibrationError> {
        let expected = self.comparator.basis.functions();
        let lengths = self.comparator.coefficients.iter().chain(&self.coefficient_sd).map(Vec::len);
        if let Some(found) = lengths.into_iter().find(|&found| found != expected) {
            return Err(CalibrationError::Coefficients { expected, found });
        }
        let outside = |m: &Measurement| m.case >= self.cases.len() || m.point >= self.points.len();
        match self.measurements.iter().position(outside) {
            Some(measurement) => Err(CalibrationError::Index(measurement)),
            None => Ok(()),
        }
    }

    /// Builds the problem: grid points are local blocks of two, cases retained blocks of three, the comparator one shared block.
    fn problem(&self) -> Result<Problem<Comparison>, CalibrationError> {
        let mut order: Vec<usize> = (0..self.measurements.len()).collect();
        order.sort_by_key(|&i| self.measurements[i].point);
        let measurements: Vec<Measurement> = order.iter().map(|&i| self.measurements[i]).collect();
        let start =
            (0..=self.points.len()).map(|point| measurements.partition_point(|m| m.point < point)).collect();
        let comparator = self.comparator.unknowns();
        let dims: Vec<usize> = self.cases.iter().map(|_| 3).chain([comparator.len()]).collect();
        let case_of = measurements.iter().map(|m| m.case as u32).collect();
        let shared = vec![self.cases.len() as u32; measurements.len()];
        let layout = Layout::new(2, 2, &dims, start, case_of)?
            .with_shared((0..=measurements.len()).collect(), shared)?;
        let points = self.points.iter().flat_map(|point| point.xy);
        let cases = self.cases.iter().flat_map(|case| {
            let Placement { rotation, translation: [x, y] } = case.placement;
            [rotation, x, y]
        });
        let initial: Vec<f64> = points.chain(cases).chain(comparator).collect();
        let free = vec![f64::INFINITY; 3 * self.cases.len() + 3];
        let sd = self.points.iter().flat_map(|point| point.sd).chain(free);
        Ok(Problem {
            observation_sd: measurements.iter().flat_map(|m| m.sd).collect(),
            system: System::new(layout, Ordering::Auto)?,
            prior: initial.clone(),
            initial,
            sd: sd.chain(self.coefficient_sd.iter().flatten().copied()).collect(),
            model: Comparison {
                basis: self.comparator.basis,
                left_handed: self.cases.iter().map(|case| case.left_handed).collect(),
                measurements,
                order,
            },
        })
    }
}

impl Solution {
    fn new(problem: &Problem<Comparison>, mut adjustment: Adjustment) -> Self {
        let unknowns = std::mem::take(&mut adjustment.unknowns);
        let layout = problem.layout();
        let cofactors = adjustment.cofactors.take();
        let prior_redundancy = adjustment.prior_redundancy.take();
        let residuals = std::mem::take(&mut adjustment.residuals);
        let redundancy = adjustment.redundancy.take();
        let sum_of_squares = problem.sum_of_squares(&residuals)
            + problem.any().prior_terms(&unknowns).sum_of_squares(0..unknowns.len());
        let cases = problem.model.left_handed.len();
        let (placements, comparator) =
            (layout.all_retained().start..layout.retained_range(cases).start, layout.retained_range(cases));
        let missing = || vec![f64::NAN; comparator.len().pow(2)];
        let (case_cofactors, comparator_cofactors) = match &cofactors {
            Some(all) => (Some(&all.retained[..9 * cases]), all.retained[9 * cases..].to_vec()),
            None => (None, missing()),
        };
        Self {
            comparator: unknowns[comparator].to_vec(),
            comparator_cofactors,
            cases: unknowns[placements].as_chunks().0.iter().map(|&v| Placement::from(v)).collect(),
            case_cofactors: squares(case_cofactors, cases),
            points: unknowns[layout.all_locals()].as_chunks().0.to_vec(),
            point_cofactors: squares(cofactors.as_ref().map(|all| &all.local[..]), layout.locals()),
            point_redundancy: pairs(prior_redundancy.as_deref(), 0..layout.locals()),
            residuals: problem.model.in_given_order(pairs(Some(&residuals), 0..layout.groups())),
            redundancy: problem.model.in_given_order(pairs(redundancy.as_deref(), 0..layout.groups())),
            sum_of_squares,
            degrees_of_freedom: adjustment.counts.degrees_of_freedom(),
            adjustment,
        }
    }
}

fn pairs(values: Option<&[f64]>, range: Range<usize>) -> Vec<[f64; 2]> {
    range.map(|i| values.map_or([f64::NAN; 2], |values| [values[2 * i], values[2 * i + 1]])).collect()
}

fn squares<const N: usize>(values: Option<&[f64]>, count: usize) -> Vec<[[f64; N]; N]> {
    (0..count).map(|k| leading_matrix(values.map(|all| &all[N * N * k..]))).collect()
}

/// Model of plates measured on a comparator.
#[derive(Debug)]
pub struct Comparison {
    pub basis: Basis,
    /// Whether the comparator is left-handed against the plate, per case.
    pub left_handed: Vec<bool>,
    /// Measurements sorted by point: the observations.
    pub measurements: Vec<Measurement>,
    /// Index of each measurement in the calibration.
    pub order: Vec<usize>,
}

/// Points, cases and comparator at given values of the unknowns.
struct ReadingsAt<'a> {
    comparison: &'a Comparison,
    points: Vec<[f64; 2]>,
    cases: Vec<Placement>,
    comparator: Comparator,
}

impl Comparison {
    /// Restores the order of the calibration for values per observation.
    pub fn in_given_order(&self, of_groups: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
        let mut values = vec![[f64::NAN; 2]; of_groups.len()];
        for (value, &measurement) in of_groups.into_iter().zip(&self.order) {
            values[measurement] = value;
        }
        values
    }
}

impl Model for Comparison {
    fn at<'a>(&'a self, unknowns: &[f64]) -> Box<dyn Evaluated + 'a> {
        let cases = unknowns.len() - 3 - 2 * self.basis.functions();
        let points = cases - 3 * self.left_handed.len();
        Box::new(ReadingsAt {
            comparison: self,
            points: unknowns[..points].as_chunks().0.to_vec(),
            cases: unknowns[points..cases].as_chunks().0.iter().map(|&case| Placement::from(case)).collect(),
            comparator: Comparator::from_unknowns(self.basis, &unknowns[cases..]),
        })
    }
}

impl Evaluated for ReadingsAt<'_> {
    fn observe(&self, local: usize, group: usize, rows: &mut GroupRows<'_>) {
        let Measurement { case, xy, .. } = self.comparison.measurements[group];
        let swap = self.comparison.left_handed[case];
        let [first, second] = self.points[local];
        let point = if swap { [second, first] } else { [first, second] };
        let measured = self.comparator.measure(point, &self.cases[case]);
        let width = measured.comparator[0].len();
        for row in 0..2 {
            rows.constant[row] = xy[row] - measured.xy[row];
            let [by_first, by_second] = measured.point[row];
            let by_point = if swap { [by_second, by_first] } else { [by_first, by_second] };
            rows.local[2 * row..][..2].copy_from_slice(&by_point);
            rows.retained[3 * row..][..3].copy_from_slice(&measured.case[row]);
            rows.shared[width * row..][..width].copy_from_slice(&measured.comparator[row]);
        }
    }
}
