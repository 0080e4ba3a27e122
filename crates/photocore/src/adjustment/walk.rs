//! Parallel loop over the observations of all local blocks.

use std::ops::Range;

use super::problem::AnyProblem;
use crate::normals::{GroupRows, Layout, TieBuffer};
use crate::{Threads, parallel};

/// Buffers for the rows of one group, and of one tie.
#[derive(Default)]
#[doc(hidden)]
pub struct Buffers {
    constant: Vec<f64>,
    local: Vec<f64>,
    retained: Vec<f64>,
    shared: Vec<f64>,
    pub(super) tie: TieBuffer,
    /// Buffer for the unknowns of these rows.
    pub columns: Vec<usize>,
}

impl Buffers {
    /// Returns the rows of a group, with undefined contents.
    pub fn rows(&mut self, layout: &Layout, group: usize) -> GroupRows<'_> {
        let rows = layout.rows();
        self.constant.resize(rows, 0.0);
        self.local.resize(rows * layout.local_dim(), 0.0);
        self.retained.resize(rows * layout.retained_dim(layout.retained_of(group)), 0.0);
        self.shared.resize(rows * layout.shared_width(group), 0.0);
        GroupRows {
            constant: &mut self.constant,
            local: &mut self.local,
            retained: &mut self.retained,
            shared: &mut self.shared,
        }
    }
}

/// Number of local blocks or ties in a range, and the mean number of groups per block above which it is reduced.
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

    /// Maps ranges of ties, in order.
    pub(super) fn for_ties<T: Send>(
        &self,
        threads: &Threads,
        each: impl Fn(&mut Buffers, Range<usize>) -> T + Sync,
    ) -> Vec<T> {
        by_stretches(threads, self.layout().ties().len(), AT_LEAST, each)
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
