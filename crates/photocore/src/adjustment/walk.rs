//! Parallel loop over the observations of all local blocks.

use std::ops::Range;

use super::problem::AnyProblem;
use crate::normals::RowBuffer;
use crate::{Threads, parallel};

/// Memory for the rows of one group or term, and for the unknowns of these rows.
#[derive(Debug, Default)]
#[doc(hidden)]
pub struct Buffers {
    pub(super) rows: RowBuffer,
    pub(super) columns: Vec<usize>,
}

/// Number of local blocks or terms in a range, and the mean number of groups per block above which it is reduced.
const AT_LEAST: usize = 64;
const GROUPS: usize = 32;

impl AnyProblem<'_> {
    /// Maps ranges of local blocks, in order.
    pub(super) fn for_locals<T: Send>(
        &self,
        threads: &Threads,
        each: impl Fn(&mut Buffers, Range<usize>) -> T + Sync,
    ) -> Vec<T> {
        by_stretches(threads, self.layout().locals(), self.at_least(), each)
    }

    /// Maps ranges of terms, in order.
    pub(super) fn for_terms<T: Send>(
        &self,
        threads: &Threads,
        each: impl Fn(&mut Buffers, Range<usize>) -> T + Sync,
    ) -> Vec<T> {
        by_stretches(threads, self.layout().terms().len(), AT_LEAST, each)
    }

    /// Returns the number of local blocks in a range.
    fn at_least(&self) -> usize {
        let (locals, groups) = (self.layout().locals(), self.layout().groups());
        (AT_LEAST * GROUPS * locals / groups.max(1)).clamp(1, AT_LEAST)
    }
}

fn by_stretches<T: Send>(
    threads: &Threads,
    count: usize,
    length: usize,
    each: impl Fn(&mut Buffers, Range<usize>) -> T + Sync,
) -> Vec<T> {
    let part = |stretches: Range<usize>| {
        let mut buffers = Buffers::default();
        let stretch = |k: usize| k * length..count.min((k + 1) * length);
        stretches.map(|k| each(&mut buffers, stretch(k))).collect()
    };
    threads.install(|| parallel::by_parts(count.div_ceil(length), 1, &part))
}
