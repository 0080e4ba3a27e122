//! What does not depend on the size of retained blocks: compiled once for all of them, not in each kernel.

use pulp::{NullaryFnOnce, Simd};
use smallvec::{SmallVec, smallvec};

use super::{AtNode, Group, Others, Tied};
use crate::normals::batch::Batch;

/// Q_ll of a local block of a batch, with H and H Q.
pub(super) struct OfLocal<'a, S, const L: usize> {
    pub simd: S,
    pub others: &'a mut Others,
    pub batch: &'a Batch,
    pub t: usize,
    pub found: &'a mut AtNode,
}

impl<S: Simd, const L: usize> NullaryFnOnce for OfLocal<'_, S, L> {
    type Output = [[f64; L]; L];

    #[inline(always)]
    fn call(self) -> Self::Output {
        let Self { simd, others, batch, t, found } = self;
        others.reduce::<L>(batch, t);
        others.multiply::<S, L>(simd);
        others.own::<S, L>(simd, batch, t, found)
    }
}

/// What the coefficients of shared blocks make of the leverages of two rows of a group.
pub(super) struct OfShared<'a, 'b, S: Simd, const L: usize> {
    pub simd: S,
    pub others: &'a Others,
    pub batch: &'b Batch,
    pub group: Group<'b>,
    pub picked: [usize; 2],
    pub local: [&'a [f64; L]; 2],
    pub retained: Tied<'b>,
    pub form: &'a mut [[S::f64s; 2]; 2],
}

impl<S: Simd, const L: usize> NullaryFnOnce for OfShared<'_, '_, S, L> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { simd, others, batch, group, picked, local, retained, form } = self;
        let mut before: SmallVec<[_; 4]> = smallvec![retained];
        for part in batch.parts(group.p) {
            let shared = others.shared(batch, group, picked, part);
            others.tied(simd, form, local, &before, shared);
            before.push(shared);
        }
    }
}
