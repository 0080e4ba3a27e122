//! Validation of the factor pattern, so that row lookups in fronts always succeed.

use super::layout::LayoutError;
use super::system::System;

impl System {
    /// Returns an error if a front lacks a block of its equations, contributions or children, or if a pair is missing.
    pub(super) fn check_pattern(&self) -> Result<(), LayoutError> {
        let (layout, symbolic, incidence) = (&self.layout, &*self.symbolic, &self.incidence);
        let mut in_front = vec![usize::MAX; symbolic.blocks()];
        for (front, s) in symbolic.supernodes().iter().enumerate() {
            s.blocks.clone().chain(s.rows.iter().copied()).for_each(|position| in_front[position] = front);
            let has = |position: usize| in_front[position] == front;
            let have = |blocks: &[u32]| blocks.iter().all(|&block| has(symbolic.position(block as usize)));
            let children =
                s.children.iter().all(|&child| symbolic.supernodes()[child].rows.iter().all(|&row| has(row)));
            let terms =
                self.terms.at(front).iter().all(|&term| have(&layout.terms()[term as usize].retained));
            let below = &self.contributions;
            let below = below.at(front).iter().all(|&part| have(&layout.contributions()[part as usize]));
            // Units of one batch have the same pattern.
            let units = incidence.batches_at(front).iter().all(|units| {
                let unit = units[0] as usize;
                let shared = |&shared: &u32| have(layout.shared_of(incidence.group_with(shared)));
                incidence.positions_of(layout, unit).iter().all(|&position| has(position as usize))
                    && incidence.members(incidence.set_of(unit)).iter().all(shared)
            });
            if !(children && terms && below && units) {
                return Err(LayoutError::Pattern { front });
            }
        }
        let has_pair = |&[one, other]: &[u32; 2]| {
            let [p, q] = [one, other].map(|block| symbolic.position(block as usize));
            let front = symbolic.supernode_of(p.min(q));
            symbolic.panel_row(front, p.max(q)).map(drop).ok_or(LayoutError::Pattern { front })
        };
        layout.pairs().iter().try_for_each(has_pair)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::normals::{Layout, Ordering, Symbolic, Term};

    /// Three local blocks with a single group each, for one of three retained blocks; a fourth retained block is unused.
    fn uncoupled() -> Layout {
        Layout::new(1, 1, &[1, 1, 1, 1], vec![0, 1, 2, 3], vec![0, 1, 2]).unwrap()
    }

    #[test]
    fn a_pattern_that_lacks_what_goes_to_a_front_is_refused() {
        let term = Term { rows: 1, local: None, retained: vec![0, 2] };
        let together = [
            Layout::new(1, 1, &[1, 1, 1, 1], vec![0, 2, 3], vec![0, 1, 2]).unwrap(),
            uncoupled().with_shared(vec![0, 0, 0, 1], vec![3]).unwrap(),
            uncoupled().with_terms(vec![term]).unwrap(),
            uncoupled().as_part(vec![], vec![vec![1, 2]]).unwrap(),
            uncoupled().with_pairs(vec![[0, 3]]).unwrap(),
        ];
        for layout in together {
            let its_own = Symbolic::new(&layout, Ordering::Input).unwrap();
            assert!(System::with_pattern(layout.clone(), its_own).is_ok());
            let found = System::with_pattern(layout, Symbolic::new(&uncoupled(), Ordering::Input).unwrap());
            assert!(matches!(found, Err(LayoutError::Pattern { .. })));
        }
    }
}
