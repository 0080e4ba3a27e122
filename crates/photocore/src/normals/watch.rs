//! Progress callback and cancellation of long work.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use crate::{Stopped, Threads};

/// Progress callback: called on the calling thread before the work and every 40 ms during it, with the number of finished local blocks.
/// `Break` stops the work.
pub type Between<'a> = &'a mut dyn FnMut(usize) -> ControlFlow<()>;

/// Interval between calls of the progress callback.
const PERIOD: Duration = Duration::from_millis(40);

/// State shared by the worker threads and the calling thread.
#[derive(Debug, Default)]
pub(super) struct Control {
    stopped: AtomicBool,
    done: AtomicUsize,
    /// Bytes of an allocation that failed.
    failed: AtomicUsize,
}

impl Control {
    /// Whether the work must stop; its results will be discarded.
    pub fn stopped(&self) -> bool {
        self.stopped.load(Relaxed)
    }

    /// Returns a buffer, or stops the work if its allocation failed.
    pub fn allocated(&self, buffer: Result<Vec<f64>, usize>) -> Option<Vec<f64>> {
        let note = |bytes: &usize| {
            self.failed.store(*bytes, Relaxed);
            self.stopped.store(true, Relaxed);
        };
        buffer.inspect_err(note).ok()
    }

    /// Returns the result of the work, or the reason for its stop.
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

/// Runs work on some threads while the calling thread calls `between`. Stopped work may return None.
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
        // A pool thread must not wait for another one; the code that started it calls the progress callback.
        return control.ended(work(&control));
    }
    let (mut work, mut result) = (Some(work), None);
    let mut work = || result = work.take().and_then(|work| work(&control));
    if watch(threads, between, &control, &mut work).is_break() {
        return Err(Stopped::Interrupted);
    }
    // The result is missing only after a panic, which the scope has propagated.
    control.ended(result)
}

/// Runs a closure without result behind a reference, so that threads and channel are compiled once.
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
            // A missing receiver is not an error.
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
