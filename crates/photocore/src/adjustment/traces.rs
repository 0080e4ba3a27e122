//! Sums of squares of the elements of R = I - A Q A^T over groups of equations: what tests of sums and variance components need of it.

use super::linearized::Linearized;
use super::problem::AnyProblem;
use super::result::AdjustError;
use crate::normals::Between;
use crate::{Threads, parallel};

/// How sums over R are found.
#[derive(Debug, Clone, Copy)]
pub struct Probing {
    /// Groups of so many equations at the most are taken column by column, which is exact.
    pub exact: usize,
    /// Vectors of random signs for larger ones (Hutchinson 1990): the relative standard deviation of a sum falls with the root of it.
    pub vectors: usize,
    /// Where the signs come from.
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
    /// How many there are.
    pub count: usize,
    /// The group of each equation; that many or more for none.
    pub of: Vec<usize>,
}

/// Sums over groups.
#[derive(Debug, Clone)]
pub struct GroupSquares {
    /// Equations of each group, then of none.
    pub equations: Vec<usize>,
    /// Row by row for each group g and then for what is in none, the sums of `R_ij^2`, i being in g and j in each group h.
    pub squares: Vec<f64>,
    /// Which columns are exact.
    pub exact: Vec<bool>,
}

/// Numbers that go through the factor together.
const TOGETHER: usize = 1 << 23;
/// Columns that do at the most.
const COLUMNS: usize = 64;

/// A column z: unit vectors or random signs on the groups of a class, which are those whose number leaves this rest.
#[derive(Clone, Copy)]
struct Column {
    class: usize,
    what: Kind,
    weight: f64,
}

#[derive(Clone, Copy)]
enum Kind {
    /// One on the equation of this number in each group.
    Unit(usize),
    Signs(u64),
}

/// Equations by groups, with their numbers in these.
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

    /// The columns for so many classes of groups.
    fn columns(&self, classes: usize, probing: &Probing) -> (Vec<Column>, Vec<bool>) {
        let (mut columns, mut exact) = (vec![], vec![]);
        for class in 0..classes {
            let largest = self.equations[..self.groups.count].iter().skip(class).step_by(classes).max();
            let largest = largest.copied().unwrap_or(0);
            exact.push(largest <= probing.exact.max(probing.vectors));
            let column = |what, weight| Column { class, what, weight };
            if exact[class] {
                columns.extend((0..largest).map(|k| column(Kind::Unit(k), 1.0)));
            } else {
                let signs = |k: usize| Kind::Signs(mixed(probing.seed ^ mixed(k as u64 + 1)));
                let weight = (probing.vectors.max(1) as f64).recip();
                columns.extend((0..probing.vectors.max(1)).map(|k| column(signs(k), weight)));
            }
        }
        (columns, exact)
    }

    /// Writes a column.
    fn write(&self, column: Column, classes: usize, z: &mut [f64]) {
        for (row, z) in z.iter_mut().enumerate() {
            let (group, number) = (self.groups.of[row], self.number[row]);
            if group < self.groups.count && group % classes == column.class && number != usize::MAX {
                *z = match column.what {
                    Kind::Unit(k) => f64::from(u8::from(number == k)),
                    Kind::Signs(seed) => 1.0 - 2.0 * (mixed(seed ^ row as u64) >> 63) as f64,
                };
            }
        }
    }

    /// The sums of squares of a projected column, group by group.
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

/// The mixing function of splitmix64 (Steele, Lea and Flood 2014).
fn mixed(seed: u64) -> u64 {
    let z = seed.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

impl Linearized {
    /// Sums of `R_ij^2` over every two groups: the Helmert matrix of variance components. The same bits for any number of threads.
    ///
    /// # Errors
    /// An interruption, no memory.
    pub fn group_squares(
        &self,
        problem: &AnyProblem<'_>,
        groups: &EquationGroups,
        probing: &Probing,
        threads: &Threads,
        between: Between<'_>,
    ) -> Result<GroupSquares, AdjustError> {
        let (numbered, count) = (Numbered::new(groups, &self.is_equation(problem)), groups.count);
        let (columns, exact) = numbered.columns(count, probing);
        let mut squares = vec![0.0; (count + 1) * count];
        self.probe(problem, &numbered, (&columns, count), threads, between, |column, sums| {
            for (group, sum) in sums.iter().enumerate() {
                squares[group * count + column.class] += column.weight * sum;
            }
        })?;
        Ok(GroupSquares { equations: numbered.equations, squares, exact })
    }

    /// The sum of `R_ij^2` within each group, where there are many: the groups whose numbers leave the same rest by `classes` share
    /// their columns. What is between such groups is added, which is little where they are far apart.
    ///
    /// # Errors
    /// An interruption, no memory.
    pub fn own_squares(
        &self,
        problem: &AnyProblem<'_>,
        groups: &EquationGroups,
        classes: usize,
        probing: &Probing,
        threads: &Threads,
        between: Between<'_>,
    ) -> Result<Vec<f64>, AdjustError> {
        let (numbered, classes) = (Numbered::new(groups, &self.is_equation(problem)), classes.max(1));
        let (columns, _) = numbered.columns(classes.min(groups.count), probing);
        let classes = classes.min(groups.count).max(1);
        let mut squares = vec![0.0; groups.count];
        self.probe(problem, &numbered, (&columns, classes), threads, between, |column, sums| {
            for (own, sum) in squares.iter_mut().zip(sums).skip(column.class).step_by(classes) {
                *own += column.weight * sum;
            }
        })?;
        Ok(squares)
    }

    /// Projects columns, and tells of the sums of each.
    fn probe(
        &self,
        problem: &AnyProblem<'_>,
        numbered: &Numbered<'_>,
        (columns, classes): (&[Column], usize),
        threads: &Threads,
        between: Between<'_>,
        mut tell: impl FnMut(Column, &[f64]),
    ) -> Result<(), AdjustError> {
        let height = problem.equations().max(1);
        for together in columns.chunks((TOGETHER / height).clamp(1, COLUMNS)) {
            let mut z = vec![0.0; together.len() * height];
            threads.install(|| {
                parallel::each_chunk(&mut z, height, &|k, z| numbered.write(together[k], classes, z));
            });
            let u = self.project(problem, z, threads, between)?;
            let sums: Vec<Vec<f64>> =
                threads.install(|| parallel::map_each(u.chunks(height).collect(), &|u| numbered.sums(u)));
            together.iter().zip(&sums).for_each(|(&column, sums)| tell(column, sums));
        }
        Ok(())
    }
}
