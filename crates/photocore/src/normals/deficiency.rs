//! Rank defect of the normal equations.

use super::factor::Factor;
use super::layout::Layout;
use super::symbolic::Symbolic;

impl Factor {
    /// Returns the undetermined combinations of unknowns, if any.
    pub fn deficiency(&self) -> Option<Deficiency<'_>> {
        (!self.lost.is_empty()).then_some(Deficiency { factor: self })
    }
}

/// Undetermined combinations of unknowns: the null space of the normal equations.
#[derive(Debug)]
pub struct Deficiency<'a> {
    factor: &'a Factor,
}

impl Deficiency<'_> {
    /// Number of undetermined combinations.
    pub fn defect(&self) -> usize {
        self.factor.lost.len()
    }

    /// Returns the retained blocks in each null vector, ascending: shares of at least 1 % of the largest. Unknowns are scaled by the
    /// precision from their own equations alone.
    pub fn blocks(&self) -> Vec<Vec<usize>> {
        let symbolic = &*self.factor.panels.symbolic;
        let vectors = self.factor.lost.iter().map(|&pivot| {
            let mut vector = self.factor.combination(pivot);
            self.factor.scale(&mut vector);
            blocks_moved(symbolic, &vector)
        });
        vectors.collect()
    }

    /// Returns the unknowns in each null vector, ascending: shares of at least one tenth of the largest.
    pub fn unknowns(&self, layout: &Layout) -> Vec<Vec<usize>> {
        let Factor { lost, .. } = self.factor;
        lost.iter().map(|&pivot| self.factor.taking_part(layout, self.factor.combination(pivot))).collect()
    }

    /// Returns all unknowns of each null vector, as (unknown, component x, diagonal element n of the normal equations). The product x^2 n
    /// is the sum of squares that the unknown's own equations assign to this change.
    pub fn combinations(&self, layout: &Layout) -> Vec<Vec<(usize, f64, f64)>> {
        let Factor { lost, diagonal, .. } = self.factor;
        let combination = |&pivot: &usize| {
            let moved = self.factor.combination(pivot).into_iter().zip(diagonal);
            self.factor.unknowns(layout).zip(moved).map(|(unknown, (x, &n))| (unknown, x, n)).collect()
        };
        lost.iter().map(combination).collect()
    }
}

fn blocks_moved(symbolic: &Symbolic, vector: &[f64]) -> Vec<usize> {
    let share = |position: usize| {
        vector[symbolic.range(position)].iter().fold(0.0, |most: f64, value| most.max(value.abs()))
    };
    let largest = (0..symbolic.blocks()).map(share).fold(0.0, f64::max);
    let moved = (0..symbolic.blocks()).filter(|&position| share(position) >= 0.01 * largest);
    let mut blocks: Vec<usize> = moved.map(|position| symbolic.block(position)).collect();
    blocks.sort_unstable();
    blocks
}
