//! The local blocks of a stack, solved with everything else in place.

use pulp::Simd;

use super::{Segment, Slot, Stack};
use crate::normals::equations::Prior;
use crate::normals::system::System;
use crate::normals::triangle::Triangle;
use crate::normals::vectorised::{Kernel, dot, run, size};

impl Stack {
    /// Solves for the local blocks with the others in place: N x = A^T (l - A_other x_other). `others` are the unknowns that are
    /// not local, in the order of elimination; the solutions are added to `found`, one after the other.
    pub fn solve(&self, system: &System, prior: &Prior, damping: f64, others: &[f64], found: &mut Vec<f64>) {
        run(&system.layout, self.kept_dim(), Solve { stack: self, system, prior, damping, others, found });
    }

    #[inline(always)]
    fn solve_one<'a, const L: usize, const D: usize>(
        &self,
        t: usize,
        rows: usize,
        (mut normal, mut right): ([[f64; L]; L], [f64; L]),
        damping: f64,
        others: impl Fn(&Slot) -> &'a [f64],
        common: impl Fn(&Segment) -> &'a [f64],
    ) -> [f64; L] {
        for slot in &self.slots {
            let dim = size::<D>(slot.dim);
            let other = &others(slot)[..dim];
            for (k, p) in slot.groups.clone().enumerate() {
                let own = self.local_rows::<L>(t, p, rows);
                for row in 0..rows {
                    let at = (t * slot.groups.len() + k) * rows + row;
                    let mut left = self.constants[slot.constants + at]
                        - dot(&self.kept_rows[slot.kept + at * dim..][..dim], other);
                    for part in self.parts(p) {
                        let x = &common(&self.segments[part.segment])[part.shift..][..part.width()];
                        let equation = t * rows + row;
                        left -= dot(self.part_rows(p, part, equation..equation + 1).rows.values, x);
                    }
                    for a in 0..L {
                        right[a] += own[row][a] * left;
                        (0..=a).for_each(|b| normal[a][b] += own[row][a] * own[row][b]);
                    }
                }
            }
        }
        (0..L).for_each(|d| normal[d][d] *= 1.0 + damping);
        let mut triangle = Triangle::default();
        // Whether it is regular the elimination has found out.
        triangle.factor(&normal);
        triangle.forward::<L>(&mut right, 1);
        triangle.backward::<L>(&mut right, 1);
        right
    }
}

struct Solve<'a> {
    stack: &'a Stack,
    system: &'a System,
    prior: &'a Prior,
    damping: f64,
    others: &'a [f64],
    found: &'a mut Vec<f64>,
}

impl Kernel for Solve<'_> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const L: usize, const D: usize>(self, _: S) {
        let (layout, symbolic, others) = (&self.system.layout, &*self.system.symbolic, self.others);
        let kept = |slot: &Slot| &others[symbolic.range(slot.position)];
        let common = |segment: &Segment| &others[segment.range(symbolic)];
        for t in 0..self.stack.locals.len() {
            let start = self.prior.of_local::<L>(layout, self.stack.locals[t] as usize);
            let x =
                self.stack.solve_one::<L, D>(t, size::<R>(layout.rows()), start, self.damping, kept, common);
            self.found.extend_from_slice(&x);
        }
    }
}
