//! Rank defect of the normal equations.

use super::factor::Factor;
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
    /// Returns the retained blocks in each null vector, ascending: shares of at least 1 % of the largest. Unknowns are scaled by the
    /// precision from their own equations alone.
    pub fn blocks(&self) -> Vec<Vec<usize>> {
        self.each(|vector| {
            self.factor.scale(vector);
            blocks_moved(&self.factor.panels.symbolic, vector)
        })
    }

    /// Returns the unknowns in each null vector, ascending: shares of at least one tenth of the largest.
    pub fn unknowns(&self) -> Vec<Vec<usize>> {
        self.each(|vector| self.factor.taking_part(vector))
    }

    /// Returns all unknowns of each null vector, as (unknown, component x, diagonal element n of the normal equations). The product x^2 n
    /// is the sum of squares that the unknown's own equations assign to this change.
    pub fn combinations(&self) -> Vec<Vec<(usize, f64, f64)>> {
        self.each(|vector| {
            let moved = vector.iter().zip(&self.factor.diagonal);
            self.factor.unknowns().zip(moved).map(|(unknown, (&x, &n))| (unknown, x, n)).collect()
        })
    }

    /// Returns the results for all null vectors.
    fn each<T>(&self, of: impl Fn(&mut [f64]) -> T) -> Vec<T> {
        let mut found = vec![];
        self.factor.each_combination(&self.factor.lost, |_, vector| found.push(of(vector)));
        found
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
