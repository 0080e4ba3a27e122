//! Cofactors of local blocks and their groups if all other unknowns are fixed. Snooping bounds the correlations of tests by them.

use std::ops::Range;

use smallvec::SmallVec;

use super::additional::{AdditionalParameters, Equation, Extended, LocalRows, Shared};
use super::leverages::Leverages;
use super::problem::AnyProblem;
use super::walk::Buffers;
use crate::normals::dot;
use crate::{Threads, parallel};

/// Cofactors if only the unknowns of each local block are free. All blocks are square, row by row, one after the other.
#[derive(Debug, Clone, Default)]
pub struct Alone {
    /// Leverages of all pairs of equations in each group.
    pub groups: Vec<f64>,
    /// Cofactors of the unknowns of each local block.
    pub locals: Vec<f64>,
}

/// No additional parameters.
struct Nothing;

impl AdditionalParameters for Nothing {
    fn count(&self) -> usize {
        0
    }

    fn locals(&self) -> Option<Vec<usize>> {
        Some(vec![])
    }

    fn partials(&self, _: &Equation<'_>, _: &mut Shared, _: &mut Vec<(usize, f64)>) {}
}

/// Minimum number of local blocks per thread.
const AT_LEAST: usize = 64;

impl Leverages {
    /// Returns the cofactors if only the unknowns of each local block are free.
    pub fn alone(&self, problem: &AnyProblem<'_>, threads: &Threads) -> Alone {
        let (layout, extended) =
            (problem.layout(), Extended::new(self.equations(problem, threads), &self.held, &Nothing));
        let size = layout.rows();
        let part = |locals: Range<usize>| {
            let (mut rows, mut buffers, mut found) =
                (LocalRows::default(), Buffers::default(), Alone::default());
            for local in locals {
                extended.write(&mut buffers, local, &mut rows);
                let inverse = extended.inverse(local, &rows);
                // The first equations are those of the groups.
                let own = rows.own();
                let of_groups = &own[..layout.groups_of(local).len() * size * rows.width()];
                for group in of_groups.chunks_exact((size * rows.width()).max(1)) {
                    for first in group.chunks_exact(rows.width()) {
                        let along = inverse.chunks_exact(rows.width()).map(|row| dot(row, first));
                        let along: SmallVec<[f64; 4]> = along.collect();
                        found
                            .groups
                            .extend(group.chunks_exact(rows.width()).map(|second| dot(&along, second)));
                    }
                }
                found.locals.extend_from_slice(&inverse);
            }
            vec![found]
        };
        let mut all = Alone::default();
        for part in threads.install(|| parallel::by_parts(layout.locals(), AT_LEAST, &part)) {
            all.groups.extend(part.groups);
            all.locals.extend(part.locals);
        }
        all
    }
}
