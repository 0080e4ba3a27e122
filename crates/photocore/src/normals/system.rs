//! A system ready to be formed and solved again and again, and the walk over its local blocks.

use std::ops::ControlFlow;
use std::sync::Arc;

use pulp::Arch;
use rayon::ThreadPool;
use rayon::prelude::*;

use super::elimination::{Elimination, Equations, Incidence, LocalPrior};
use super::layout::Layout;
use super::ordering::Ordering;
use super::symbolic::Symbolic;

/// Weights of the unknowns themselves: equations `x_i = constant_i` of the given weight. Both have the length of the
/// vector of unknowns.
#[derive(Debug, Clone)]
pub struct Prior {
    /// Weight w of each unknown; 0 leaves it free.
    pub weight: Vec<f64>,
    /// Weight times constant, w l.
    pub right: Vec<f64>,
}

/// Called before each batch with the number of local blocks done; breaking stops the work.
pub type Between<'a> = &'a mut dyn FnMut(usize) -> ControlFlow<()>;

/// Local blocks worked on at a time: enough to keep all processors busy, few enough to stay in the cache.
const BATCH: usize = 1024;
/// Local blocks that a thread takes at a time.
const CHUNK: usize = 32;

/// A system ready to be formed again and again: the pattern and the order are found once.
#[derive(Debug)]
pub struct System {
    pub(crate) layout: Layout,
    pub(crate) symbolic: Arc<Symbolic>,
    incidence: Incidence,
}

impl System {
    /// Orders a layout.
    pub fn new(layout: Layout, ordering: Ordering) -> Self {
        let symbolic = Arc::new(Symbolic::new(&layout, ordering));
        let incidence = Incidence::new(&layout, &symbolic);
        Self { layout, symbolic, incidence }
    }

    /// The unknowns and groups.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// The order and the pattern.
    pub fn symbolic(&self) -> &Symbolic {
        &self.symbolic
    }

    /// Gathers every local block, batch by batch, has `each` worked on, on several threads, and hands the batches on in order.
    ///
    /// Stops early when `between`, called before each batch with the number of local blocks done, breaks.
    pub(crate) fn for_locals<E: Equations>(
        &self,
        pool: &ThreadPool,
        equations: &E,
        prior: &Prior,
        between: Between<'_>,
        each: impl Fn(&mut Elimination, LocalPrior<'_>) + Sync,
        mut batch_done: impl FnMut(usize, &[Elimination]),
    ) -> ControlFlow<()> {
        let layout = &self.layout;
        let arch = Arch::new();
        let mut batch: Vec<Elimination> = vec![Elimination::default(); BATCH.min(layout.locals())];
        for first in (0..layout.locals()).step_by(BATCH) {
            between(first)?;
            let count = BATCH.min(layout.locals() - first);
            let work = |(chunk, eliminations): (usize, &mut [Elimination])| {
                // Compiled for the vector instructions of the machine that it runs on.
                arch.dispatch(|| {
                    for (i, elimination) in eliminations.iter_mut().enumerate() {
                        let local = first + chunk * CHUNK + i;
                        let range = layout.local_range(local);
                        elimination.gather(layout, &self.incidence, equations, local);
                        each(elimination, (&prior.weight[range.clone()], &prior.right[range]));
                    }
                });
            };
            let eliminations = &mut batch[..count];
            pool.install(|| eliminations.par_chunks_mut(CHUNK).enumerate().for_each(work));
            batch_done(first, eliminations);
        }
        ControlFlow::Continue(())
    }
}
