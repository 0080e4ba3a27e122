//! Long work watched from the calling thread, and stopped when it says so.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use crate::{Stopped, Threads};

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
    /// Bytes of an allocation that failed.
    failed: AtomicUsize,
}

impl Control {
    /// Whether the work is to stop: what has been computed will not be looked at.
    pub fn stopped(&self) -> bool {
        self.stopped.load(Relaxed)
    }

    /// A buffer; without memory for it the work is to stop.
    pub fn allocated(&self, buffer: Result<Vec<f64>, usize>) -> Option<Vec<f64>> {
        let note = |bytes: &usize| {
            self.failed.store(*bytes, Relaxed);
            self.stopped.store(true, Relaxed);
        };
        buffer.inspect_err(note).ok()
    }

    /// What the work ended with, or why it did not.
    fn ended<T>(&self, result: Option<T>) -> Result<T, Stopped> {
        match (self.failed.load(Relaxed), result) {
            (0, Some(result)) => Ok(result),
            (0, None) => Err(Stopped::Interrupted),
            (bytes, _) => Err(Stopped::OutOfMemory(bytes)),
        }
    }

    /// Counts local blocks done.
    pub fn count(&self, locals: usize) {
        self.done.fetch_add(locals, Relaxed);
    }
}

/// Does work on some threads while the calling thread watches it. The work may end with nothing when it was stopped.
pub(super) fn watched<T: Send>(
    threads: &Threads,
    between: Between<'_>,
    work: impl FnOnce(&Control) -> Option<T> + Send,
) -> Result<T, Stopped> {
    if between(0).is_break() {
        return Err(Stopped::Interrupted);
    }
    let control = Control::default();
    if threads.pool().current_thread_index().is_some() {
        // One of the threads must not wait for another; whoever put it to work watches.
        return control.ended(work(&control));
    }
    let (mut work, mut result) = (Some(work), None);
    let mut work = || result = work.take().and_then(|work| work(&control));
    if watch(threads, between, &control, &mut work).is_break() {
        return Err(Stopped::Interrupted);
    }
    // The work leaves its result unless it panics, and then the scope has passed the panic on.
    control.ended(result)
}

/// The same for all work, whatever it is and leaves: what threads and channel are made of is compiled once.
fn watch(
    threads: &Threads,
    between: Between<'_>,
    control: &Control,
    work: &mut (dyn FnMut() + Send),
) -> ControlFlow<()> {
    let (sender, receiver) = channel();
    let mut flow = ControlFlow::Continue(());
    threads.pool().in_place_scope(|scope| {
        scope.spawn(move |_| {
            work();
            // A receiver that is gone has nothing to hear.
            let _ = sender.send(());
        });
        while let Err(RecvTimeoutError::Timeout) = receiver.recv_timeout(PERIOD) {
            if flow.is_continue() {
                flow = between(control.done.load(Relaxed));
                control.stopped.fetch_or(flow.is_break(), Relaxed);
            }
        }
    });
    flow
}
