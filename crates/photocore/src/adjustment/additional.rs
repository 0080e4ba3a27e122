//! Additional parameters of the computed observations, l = A x + C d + v: how well the residuals test them, what they would be, and what
//! they would change, from one factor and without adjusting again.
//!
//! With weights P and cofactors Q of the unknowns: score u = C^T P v, right-hand sides N = A^T P C, redundancy R = C^T P C - N^T Q N
//! (Baarda 1968; Förstner 1983). If the observations have the error C d, the unknowns change by Q N d.

use std::collections::HashMap;

use nalgebra::{DMatrix, DVector};

use super::equations::ObservationEquations;
use super::linearized::Linearized;
use super::problem::AnyProblem;
use super::result::AdjustError;
use super::walk::Buffers;
use crate::Threads;
use crate::normals::Between;

/// An observation equation of unit weight.
#[derive(Debug, Clone, Copy)]
pub struct Equation<'a> {
    /// Its observation.
    pub of: EquationOf,
    /// Standard deviation of the observation; 1 if its components are weighted together.
    pub sd: f64,
    /// Unknowns, fixed ones among them, with their coefficients.
    pub coefficients: &'a [(usize, f64)],
}

/// The observation of an equation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum EquationOf {
    /// A row of a group, which belongs to a local block.
    Group {
        /// The group.
        group: usize,
        /// Its local block.
        local: usize,
        /// The row in the group.
        row: usize,
    },
    /// A row of a tie.
    Tie {
        /// The tie.
        tie: usize,
        /// The row in the tie.
        row: usize,
    },
    /// An unknown as an observation of itself.
    Unknown(usize),
}

/// Additional parameters: which computed observations depend on them, and how.
pub trait AdditionalParameters: Sync {
    /// Number of parameters.
    fn count(&self) -> usize;

    /// Whether observations of groups depend on any of them.
    fn concern_groups(&self) -> bool;

    /// Appends the parameters that an equation depends on, with its partials in unit weight.
    fn partials(&self, equation: &Equation<'_>, partials: &mut Vec<(usize, f64)>);
}

/// Sums over all observations that test additional parameters.
#[derive(Debug)]
pub struct Additional {
    /// u = C^T P v.
    pub score: DVector<f64>,
    /// C^T P C.
    pub squares: DMatrix<f64>,
    /// R = C^T P Q_vv P C.
    pub redundancy: DMatrix<f64>,
    /// Q N: by how much each unknown changes with an error of each parameter, a column per parameter.
    pub effects: DMatrix<f64>,
    /// Number of observations that depend on each.
    pub observations: Vec<usize>,
}

/// The sums over some observations.
struct Sums {
    score: DVector<f64>,
    squares: DMatrix<f64>,
    observations: Vec<usize>,
    /// The elements of N of unknowns: where those of each unknown start.
    starts: HashMap<usize, usize>,
    rights: Vec<f64>,
    partials: Vec<(usize, f64)>,
    coefficients: Vec<(usize, f64)>,
}

impl Sums {
    fn new(count: usize) -> Self {
        Self {
            score: DVector::zeros(count),
            squares: DMatrix::zeros(count, count),
            observations: vec![0; count],
            starts: HashMap::new(),
            rights: vec![],
            partials: vec![],
            coefficients: vec![],
        }
    }

    /// Adds the equation whose coefficients are in the buffer.
    fn add(
        &mut self,
        parameters: &dyn AdditionalParameters,
        (of, sd, constant): (EquationOf, f64, f64),
        fixed: &[bool],
    ) {
        let Self { score, squares, observations, starts, rights, partials, coefficients } = self;
        partials.clear();
        parameters.partials(&Equation { of, sd, coefficients }, partials);
        partials.retain(|&(_, partial)| partial != 0.0);
        if partials.is_empty() {
            return;
        }
        let count = observations.len();
        for &(i, first) in &*partials {
            observations[i] += 1;
            score[i] += first * constant;
            partials.iter().for_each(|&(j, second)| squares[(i, j)] += first * second);
        }
        for &(unknown, coefficient) in coefficients.iter().filter(|&&(unknown, _)| !fixed[unknown]) {
            let start = *starts.entry(unknown).or_insert(rights.len());
            if start == rights.len() {
                rights.resize(start + count, 0.0);
            }
            partials.iter().for_each(|&(i, partial)| rights[start + i] += partial * coefficient);
        }
    }
}

impl Linearized {
    /// Tests additional parameters against the residuals at these values.
    ///
    /// # Errors
    /// An interruption, no memory.
    pub fn additional(
        &self,
        problem: &AnyProblem<'_>,
        parameters: &dyn AdditionalParameters,
        threads: &Threads,
        between: Between<'_>,
    ) -> Result<Additional, AdjustError> {
        let (count, layout) = (parameters.count(), problem.layout());
        let equations = self.equations(problem, threads).with_fixed_columns();
        let fixed = problem.fixed(&self.held);
        let mut parts = vec![];
        if parameters.concern_groups() {
            parts = problem.for_stretches(threads, |buffers, locals| {
                let mut sums = Sums::new(count);
                for local in locals {
                    of_local(&equations, buffers, local, &mut sums, parameters, &fixed);
                }
                sums
            });
        }
        let mut others = Sums::new(count);
        let groups = layout.groups() * layout.rows();
        equations.each_row_of_ties(|tie, row| {
            others.coefficients.clear();
            others.coefficients.extend(row.taken());
            let of = EquationOf::Tie { tie, row: row.number - groups - layout.tie_rows(tie).start };
            others.add(parameters, (of, equations.deviation(row.number), row.constant), &fixed);
        });
        problem.terms(&self.values).each_row(|unknown, row, constant| {
            others.coefficients.clear();
            others.coefficients.extend(row);
            let of = EquationOf::Unknown(unknown);
            others.add(parameters, (of, problem.sd[unknown], constant), &fixed);
        });
        parts.push(others);

        let mut sums = Sums::new(count);
        let mut rights = DMatrix::zeros(layout.unknowns(), count);
        for part in parts {
            sums.score += part.score;
            sums.squares += part.squares;
            sums.observations.iter_mut().zip(part.observations).for_each(|(sum, own)| *sum += own);
            for (unknown, start) in part.starts {
                let own = &part.rights[start..start + count];
                (0..count).for_each(|k| rights[(unknown, k)] += own[k]);
            }
        }
        let effects = self.solve_for(problem, rights.as_slice(), threads, between)?;
        let effects = DMatrix::from_vec(layout.unknowns(), count, effects);
        let taken = rights.tr_mul(&effects);
        let redundancy = &sums.squares - (&taken + taken.transpose()) / 2.0;
        let Sums { score, squares, observations, .. } = sums;
        Ok(Additional { score, squares, redundancy, effects, observations })
    }
}

fn of_local(
    equations: &ObservationEquations<'_>,
    buffers: &mut Buffers,
    local: usize,
    sums: &mut Sums,
    parameters: &dyn AdditionalParameters,
    fixed: &[bool],
) {
    let rows = equations.problem().layout().rows();
    equations.each_row(buffers, local, |row| {
        sums.coefficients.clear();
        sums.coefficients.extend(row.taken());
        let of = EquationOf::Group { group: row.number / rows, local, row: row.number % rows };
        sums.add(parameters, (of, equations.deviation(row.number), row.constant), fixed);
    });
}
