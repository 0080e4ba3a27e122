//! What the equations of a factor leave undetermined.

use super::factor::Factor;
use super::layout::Layout;
use super::symbolic::Symbolic;

impl Factor {
    /// The combinations of unknowns that the equations do not determine, if any.
    pub fn deficiency(&self) -> Option<Deficiency<'_>> {
        (!self.lost.is_empty()).then_some(Deficiency { factor: self })
    }
}

/// Unknowns that the equations do not determine.
#[derive(Debug)]
pub struct Deficiency<'a> {
    factor: &'a Factor,
}

impl Deficiency<'_> {
    /// How many combinations of unknowns are not determined.
    pub fn defect(&self) -> usize {
        self.factor.lost.len()
    }

    /// For each of them the retained blocks it moves, ascending: the blocks that take
    /// at least a hundredth of the largest share in a null vector, each unknown in units of what its equations alone determine.
    pub fn blocks(&self) -> Vec<Vec<usize>> {
        let symbolic = &*self.factor.panels.symbolic;
        let vectors = self.factor.lost.iter().map(|&pivot| {
            let mut vector = self.factor.combination(pivot);
            self.factor.scale(&mut vector);
            blocks_moved(symbolic, &vector)
        });
        vectors.collect()
    }

    /// For each of them the unknowns that it moves, ascending: those that take at least a tenth of the largest share.
    pub fn unknowns(&self, layout: &Layout) -> Vec<Vec<usize>> {
        let Factor { lost, .. } = self.factor;
        lost.iter().map(|&pivot| self.factor.taking_part(layout, self.factor.combination(pivot))).collect()
    }

    /// For each of them all unknowns with how it moves them and their diagonal element of the equations: what these alone would make of
    /// such a move is its square times the element.
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
