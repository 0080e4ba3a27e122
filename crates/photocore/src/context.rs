//! Context of long work: its threads, progress callback and cancellation.

use std::fmt;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use crate::{Stopped, Threads};

/// Interval between calls of the progress callback.
const PERIOD: Duration = Duration::from_millis(40);

/// Record of one iteration.
#[derive(Debug, Clone, Copy)]
pub struct Iteration {
    /// Number, starting at 1.
    pub number: usize,
    /// Weighted sum of squares after its step; with a loss, the sum of losses.
    pub sum_of_squares: f64,
    /// Upper bound of the changes of all unknowns, in standard deviations (a priori unit weight).
    pub largest_change: f64,
    /// Damping of its step as a fraction of the diagonal of the normal matrix; 0 for a Gauss-Newton step.
    pub damping: f64,
}

/// Phase of an adjustment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// Formation and factorisation of the normal equations.
    Form,
    /// Solution.
    Solve,
    /// Inversion, with cofactors and redundancy numbers.
    Invert,
}

/// Progress event of long work.
#[derive(Debug, Clone, Copy)]
pub enum Event {
    /// Progress of a phase: `done` of `total` local blocks.
    Progress {
        /// The phase.
        phase: Phase,
        /// Number of finished local blocks.
        done: usize,
        /// Number of all local blocks.
        total: usize,
    },
    /// A finished iteration.
    Iteration(Iteration),
}

/// Threads of long work, and its progress callback, which can stop it.
///
/// The callback is called on the calling thread with every iteration, before each phase and every 40 ms during it. `Break` stops the work.
///
/// ```
/// use std::ops::ControlFlow;
///
/// use photocore::network::{Network, Options};
/// use photocore::{Context, Event, Threads};
///
/// let threads = Threads::new(1)?;
/// let mut report = |event| {
///     if let Event::Iteration(iteration) = event {
///         println!("iteration {}: {}", iteration.number, iteration.sum_of_squares);
///     }
///     ControlFlow::Continue(())
/// };
/// let mut context = Context::with_progress(&threads, &mut report);
/// let empty = Network::new().adjustment(&Options::default()).run_in(&mut context);
/// assert!(empty.is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Context<'a> {
    /// The threads.
    pub threads: &'a Threads,
    progress: Option<&'a mut dyn FnMut(Event) -> ControlFlow<()>>,
}

impl<'a> Context<'a> {
    /// Work on some threads without a progress callback.
    pub fn new(threads: &'a Threads) -> Self {
        Self { threads, progress: None }
    }

    /// Work on some threads with a progress callback.
    pub fn with_progress(
        threads: &'a Threads,
        progress: &'a mut dyn FnMut(Event) -> ControlFlow<()>,
    ) -> Self {
        Self { threads, progress: Some(progress) }
    }

    /// Returns the same context for a shorter time, as part of another struct.
    pub fn reborrow(&mut self) -> Context<'_> {
        let progress = self.progress.as_mut().map(|progress| &mut **progress as _);
        Context { threads: self.threads, progress }
    }

    /// Reports an event.
    ///
    /// # Errors
    /// [`Stopped::Interrupted`] if the callback stops the work.
    pub fn report(&mut self, event: Event) -> Result<(), Stopped> {
        match self.progress.as_mut().map(|progress| progress(event)) {
            Some(ControlFlow::Break(())) => Err(Stopped::Interrupted),
            _ => Ok(()),
        }
    }

    /// Runs a phase of `total` local blocks on the threads while the calling thread reports progress. Stopped work may return None.
    pub(crate) fn run<T: Send>(
        &mut self,
        phase: Phase,
        total: usize,
        work: impl FnOnce(&Control) -> Option<T> + Send,
    ) -> Result<T, Stopped> {
        self.report(Event::Progress { phase, done: 0, total })?;
        let control = Control::default();
        if self.threads.pool().current_thread_index().is_some() {
            // A pool thread must not wait for another one; the code that started it reports progress.
            return control.ended(work(&control));
        }
        let (mut work, mut result) = (Some(work), None);
        let mut work = || result = work.take().and_then(|work| work(&control));
        self.supervise(phase, total, &control, &mut work)?;
        // The result is missing only after a panic, which the scope has propagated.
        control.ended(result)
    }

    /// Runs a closure without result behind a reference, so that threads and channel are compiled once.
    fn supervise(
        &mut self,
        phase: Phase,
        total: usize,
        control: &Control,
        work: &mut (dyn FnMut() + Send),
    ) -> Result<(), Stopped> {
        let (sender, receiver) = channel();
        let mut going = Ok(());
        self.threads.pool().in_place_scope(|scope| {
            scope.spawn(move |_| {
                work();
                // A missing receiver is not an error.
                let _ = sender.send(());
            });
            while let Err(RecvTimeoutError::Timeout) = receiver.recv_timeout(PERIOD) {
                if going.is_ok() {
                    going = self.report(Event::Progress { phase, done: control.done.load(Relaxed), total });
                    control.stopped.fetch_or(going.is_err(), Relaxed);
                }
            }
        });
        going
    }
}

impl fmt::Debug for Context<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Context").field("threads", self.threads).finish_non_exhaustive()
    }
}

/// State shared by the worker threads and the calling thread.
#[derive(Debug, Default)]
pub(crate) struct Control {
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
