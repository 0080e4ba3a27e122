//! Long work watched from the calling thread, and stopped when it says so.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use rayon::ThreadPool;

/// Called on the calling thread before the work and every few hundredths of a second during it, with the number of local
/// blocks done; breaking stops the work.
pub type Between<'a> = &'a mut dyn FnMut(usize) -> ControlFlow<()>;

/// Time from one look to the next.
const PERIOD: Duration = Duration::from_millis(40);

/// What the threads at work and the calling thread tell each other.
#[derive(Debug, Default)]
pub(super) struct Control {
    stopped: AtomicBool,
    done: AtomicUsize,
}

impl Control {
    /// Whether the work is to stop: what has been computed will not be looked at.
    pub fn stopped(&self) -> bool {
        self.stopped.load(Relaxed)
    }

    /// Counts local blocks done.
    pub fn count(&self, locals: usize) {
        self.done.fetch_add(locals, Relaxed);
    }
}

/// Does work on the threads of a pool while the calling thread watches it.
pub(super) fn watched<T: Send>(
    pool: &ThreadPool,
    between: Between<'_>,
    work: impl FnOnce(&Control) -> T + Send,
) -> ControlFlow<(), T> {
    between(0)?;
    let control = Control::default();
    let (sender, receiver) = channel();
    let mut flow = ControlFlow::Continue(());
    let result = pool.in_place_scope(|scope| {
        let control = &control;
        // A receiver that is gone has nothing to hear.
        scope.spawn(move |_| drop(sender.send(work(control))));
        loop {
            match receiver.recv_timeout(PERIOD) {
                Ok(result) => return Some(result),
                Err(RecvTimeoutError::Disconnected) => return None,
                Err(RecvTimeoutError::Timeout) if flow.is_continue() => {
                    flow = between(control.done.load(Relaxed));
                    control.stopped.store(flow.is_break(), Relaxed);
                }
                Err(RecvTimeoutError::Timeout) => {}
            }
        }
    });
    flow?;
    // The work sends its result unless it panics, and then the scope has passed the panic on.
    result.map_or(ControlFlow::Break(()), ControlFlow::Continue)
}
