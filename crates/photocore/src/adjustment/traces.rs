//! Sums of squares of elements of R = I - A Q A^T over groups of equations, for variance components and tests of sums.

use super::linearized::Linearized;
use super::problem::AnyProblem;
use super::result::AdjustError;
use crate::{Context, parallel};

/// Options of the sums over R.
#[derive(Debug, Clone, Copy)]
pub struct Probing {
    /// Maximum number of equations in a group that is summed exactly, column by column.
    pub exact: usize,
    /// Number of random sign vectors for larger groups (Hutchinson 1990): the relative standard deviation of a sum decreases with its root.
    pub vectors: usize,
    /// Seed of the random signs.
    pub seed: u64,
}

impl Default for Probing {
    fn default() -> Self {
        Self { exact: 64, vectors: 32, seed: 1 }
    }
}

/// Groups of the equations of a problem (see [`AnyProblem::equations`]).
#[derive(Debug, Clone)]
pub struct EquationGroups {
    /// Number of groups.
    pub count: usize,
    /// Group of each equation; `count` or more for an equation without group.
    pub of: Vec<usize>,
}

/// Sums over groups.
#[derive(Debug, Clone)]
pub struct GroupSquares {
    /// Number of equations in each group, and without group.
    pub equations: Vec<usize>,
    /// Sums of `R_ij^2` with i in group g (rows; last, without group) and j in group h (columns), row by row.
    pub squares: Vec<f64>,
    /// Flags of exact columns.
    pub exact: Vec<bool>,
}

/// Maximum number of values in one multiple solution,
const TOGETHER: usize = 1 << 23;
/// and maximum number of its columns.
const COLUMNS: usize = 64;

/// Column z: unit vectors or random signs on the groups of a class, which have equal remainders of their index.
#[derive(Clone, Copy)]
struct ProbeColumn {
    class: usize,
    what: Probe,
    weight: f64,
}

#[derive(Clone, Copy)]
enum Probe {
    /// One at the equation with this index in each group.
    Unit(usize),
    Signs(u64),
}

/// Equations with their indices in the groups.
struct Numbered<'a> {
    groups: &'a EquationGroups,
    number: Vec<usize>,
    equations: Vec<usize>,
}

impl<'a> Numbered<'a> {
    fn new(groups: &'a EquationGroups, is_equation: &[bool]) -> Self {
        let mut equations = vec![0; groups.count + 1];
        let number = |(&group, &is): (&usize, &bool)| {
            if !is {
                return usize::MAX;
            }
            let of = &mut equations[group.min(groups.count)];
            *of += 1;
            *of - 1
        };
        let number = groups.of.iter().zip(is_equation).map(number).collect();
        Self { groups, number, equations }
    }

    /// Returns the columns for a number of classes of groups.
    fn columns(&self, classes: usize, probing: &Probing) -> (Vec<ProbeColumn>, Vec<bool>) {
        let (mut columns, mut exact) = (vec![], vec![]);
        for class in 0..classes {
            let largest = self.equations[..self.groups.count].iter().skip(class).step_by(classes).max();
            let largest = largest.copied().unwrap_or(0);
            exact.push(largest <= probing.exact.max(probing.vectors));
            let column = |what, weight| ProbeColumn { class, what, weight };
            if exact[class] {
                columns.extend((0..largest).map(|k| column(Probe::Unit(k), 1.0)));
            } else {
                let signs = |k: usize| Probe::Signs(mixed(probing.seed ^ mixed(k as u64 + 1)));
                let weight = (probing.vectors.max(1) as f64).recip();
                columns.extend((0..probing.vectors.max(1)).map(|k| column(signs(k), weight)));
            }
        }
        (columns, exact)
    }

    fn write(&self, column: ProbeColumn, classes: usize, z: &mut [f64]) {
        for (row, z) in z.iter_mut().enumerate() {
            let (group, number) = (self.groups.of[row], self.number[row]);
            if group < self.groups.count && group % classes == column.class && number != usize::MAX {
                *z = match column.what {
                    Probe::Unit(k) => f64::from(u8::from(number == k)),
                    Probe::Signs(seed) => 1.0 - 2.0 * (mixed(seed ^ row as u64) >> 63) as f64,
                };
            }
        }
    }

    /// Returns the sum of squares of a projected column for each group.
    fn sums(&self, u: &[f64]) -> Vec<f64> {
        let mut sums = vec![0.0; self.groups.count + 1];
        for ((u, &group), &number) in u.iter().zip(&self.groups.of).zip(&self.number) {
            if number != usize::MAX {
                sums[group.min(self.groups.count)] += u * u;
            }
        }
        sums
    }
}

/// Mixing function of splitmix64 (Steele, Lea and Flood 2014).
fn mixed(seed: u64) -> u64 {
    let z = seed.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

impl Linearized {
    /// Computes sums of `R_ij^2` over all pairs of groups: the Helmert matrix of variance components, identical for any number of threads.
    ///
    /// # Errors
    /// Interruption or lack of memory.
    pub fn group_squares(
        &self,
        problem: &AnyProblem<'_>,
        groups: &EquationGroups,
        probing: &Probing,
        context: &mut Context<'_>,
    ) -> Result<GroupSquares, AdjustError> {
        let (numbered, count) = (Numbered::new(groups, &self.is_equation(problem)), groups.count);
        let (columns, exact) = numbered.columns(count, probing);
        let mut squares = vec![0.0; (count + 1) * count];
        self.probe(problem, &numbered, (&columns, count), context, |column, sums| {
            for (group, sum) in sums.iter().enumerate() {
                squares[group * count + column.class] += column.weight * sum;
            }
        })?;
        Ok(GroupSquares { equations: numbered.equations, squares, exact })
    }

    /// Computes the sum of `R_ij^2` within each of many groups: groups with equal index modulo `classes` share their columns. Terms between
    /// such groups are included, which are small for distant groups.
    ///
    /// # Errors
    /// Interruption or lack of memory.
    pub fn own_squares(
        &self,
        problem: &AnyProblem<'_>,
        groups: &EquationGroups,
        classes: usize,
        probing: &Probing,
        context: &mut Context<'_>,
    ) -> Result<Vec<f64>, AdjustError> {
        let (numbered, classes) = (Numbered::new(groups, &self.is_equation(problem)), classes.max(1));
        let (columns, _) = numbered.columns(classes.min(groups.count), probing);
        let classes = classes.min(groups.count).max(1);
        let mut squares = vec![0.0; groups.count];
        self.probe(problem, &numbered, (&columns, classes), context, |column, sums| {
            for (own, sum) in squares.iter_mut().zip(sums).skip(column.class).step_by(classes) {
                *own += column.weight * sum;
            }
        })?;
        Ok(squares)
    }

    /// Projects columns, and passes the sums of each to `tell`.
    fn probe(
        &self,
        problem: &AnyProblem<'_>,
        numbered: &Numbered<'_>,
        (columns, classes): (&[ProbeColumn], usize),
        context: &mut Context<'_>,
        mut tell: impl FnMut(ProbeColumn, &[f64]),
    ) -> Result<(), AdjustError> {
        let height = problem.equations().max(1);
        for together in columns.chunks((TOGETHER / height).clamp(1, COLUMNS)) {
            let mut z = vec![0.0; together.len() * height];
            context.threads.install(|| {
                parallel::each_chunk(&mut z, height, &|k, z| numbered.write(together[k], classes, z));
            });
            let u = self.project(problem, z, context)?;
            let sums: Vec<Vec<f64>> = context
                .threads
                .install(|| parallel::map_each(u.chunks(height).collect(), &|u| numbered.sums(u)));
            together.iter().zip(&sums).for_each(|(&column, sums)| tell(column, sums));
        }
        Ok(())
    }
}
