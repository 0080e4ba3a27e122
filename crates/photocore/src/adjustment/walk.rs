//! Parallel loop over the observations of all local blocks.

use std::ops::Range;

use super::problem::AnyProblem;
use crate::normals::{GroupRows, Layout, TieBuffer, TieRows};
use crate::{Threads, parallel};

/// Buffers for the rows of one group, and of one tie.
#[derive(Default)]
pub(super) struct Buffers {
    constant: Vec<f64>,
    local: Vec<f64>,
    retained: Vec<f64>,
    shared: Vec<f64>,
    pub tie: TieBuffer,
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

/// Minimum number of local blocks per thread, and the mean number of groups per block above which it is reduced.
const AT_LEAST: usize = 64;
const GROUPS: usize = 32;

impl AnyProblem<'_> {
    /// Maps every local block, in order.
    pub(super) fn for_locals<T: Send>(
        &self,
        threads: &Threads,
        each: impl Fn(&mut Buffers, usize) -> T + Sync,
    ) -> Vec<T> {
        by_parts(threads, self.layout().locals(), self.at_least(), each)
    }

    /// Maps ranges of local blocks, in order.
    pub(super) fn for_stretches<T: Send>(
        &self,
        threads: &Threads,
        each: impl Fn(&mut Buffers, Range<usize>) -> T + Sync,
    ) -> Vec<T> {
        let (count, length) = (self.layout().locals(), self.at_least());
        let stretch = |index: usize| index * length..count.min((index + 1) * length);
        let each = |buffers: &mut Buffers, index: usize| each(buffers, stretch(index));
        by_parts(threads, count.div_ceil(length), 1, each)
    }

    /// Returns the minimum number of local blocks per thread.
    fn at_least(&self) -> usize {
        let (locals, groups) = (self.layout().locals(), self.layout().groups());
        (AT_LEAST * GROUPS * locals / groups.max(1)).clamp(1, AT_LEAST)
    }

    /// Calls `take` with a buffer for the rows of each tie, in order.
    pub(super) fn each_tie(&self, mut take: impl FnMut(usize, &mut TieRows<'_>)) {
        let mut buffer = TieBuffer::default();
        (0..self.layout().ties().len()).for_each(|tie| take(tie, &mut buffer.rows(self.layout(), tie)));
    }

    /// Maps every tie, in order.
    pub(super) fn for_ties<T: Send>(
        &self,
        threads: &Threads,
        each: impl Fn(usize, &mut TieRows<'_>) -> T + Sync,
    ) -> Vec<T> {
        let layout = self.layout();
        let each = |buffers: &mut Buffers, tie: usize| each(tie, &mut buffers.tie.rows(layout, tie));
        by_parts(threads, layout.ties().len(), AT_LEAST, each)
    }
}

fn by_parts<T: Send>(
    threads: &Threads,
    count: usize,
    at_least: usize,
    each: impl Fn(&mut Buffers, usize) -> T + Sync,
) -> Vec<T> {
    let part = |numbers: Range<usize>| {
        let mut buffers = Buffers::default();
        numbers.map(|number| each(&mut buffers, number)).collect()
    };
    threads.install(|| parallel::by_parts(count, at_least, &part))
}
