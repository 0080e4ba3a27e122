//! Execution without the GIL: threads, signals and progress.

use std::cell::Cell;
use std::ops::ControlFlow;
use std::sync::OnceLock;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use photocore::{Context, Event, Phase, Threads};
use pyo3::prelude::*;
use rayon::{ThreadBuilder, ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

use crate::adjustment::iteration_row;
use crate::memory;

/// Interval between two checks of signals and progress.
const PATIENCE: Duration = Duration::from_millis(50);
/// Maximum number of threads per processor: further threads only wait, and thousands of them need minutes to start.
const THREADS_EACH: usize = 4;
/// Number of observed points up to which work remains on the calling thread, if the number of threads is not specified. Such work needs
/// some milliseconds, as much as the start of threads.
const SMALL: usize = 5000;
/// Number of local blocks from which memory is returned to the system before the inversion and at the end.
const MANY: usize = 200_000;

/// Threads of a computation.
pub struct Workers {
    /// Number of threads (0 for all processors), watched by the calling thread. None for the calling thread itself, which checks signals
    /// and progress between phases, or for one other thread if it is not the main thread.
    threads: Option<usize>,
    /// Whether they multiply matrices, which needs buffers per thread.
    multiply: bool,
}

impl Workers {
    /// The calling thread, for work without large matrices.
    pub const CALLER: Self = Self { threads: None, multiply: false };

    /// Selects the requested number of threads; for 0, the calling thread if there are few observed points.
    pub fn of(threads: usize, points: usize) -> Self {
        Self { threads: (threads > 0 || points > SMALL).then_some(threads), multiply: true }
    }

    /// Selects threads without buffers for matrix products.
    pub fn reading(rows: usize) -> Self {
        Self { multiply: false, ..Self::of(0, rows) }
    }

    /// Number of threads, limited per processor.
    pub fn count(&self) -> usize {
        static PROCESSORS: OnceLock<usize> = OnceLock::new();
        let processors = *PROCESSORS.get_or_init(|| thread::available_parallelism().map_or(1, usize::from));
        match self.threads {
            None => 1,
            Some(0) => processors,
            Some(threads) => threads.min(THREADS_EACH * processors),
        }
    }
}

/// Runs work without the GIL. This thread checks signals and calls `progress` at intervals.
///
/// # Errors
/// An exception of a signal or of `progress`; insufficient memory or threads.
pub fn supervised<T: Send, E: Send>(
    py: Python<'_>,
    workers: Workers,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(&mut Context<'_>) -> Result<T, E> + Send,
) -> PyResult<Result<T, E>> {
    let (mut work, mut found) = (Some(work), None);
    let mut once = |context: &mut Context<'_>| {
        found = work.take().map(|work| work(context));
        matches!(found, Some(Ok(_)))
    };
    supervise(py, workers, progress, &mut once)?;
    found.ok_or_else(memory::no_buffers)
}

/// Runs work that stores its result and returns its success: compiled once for all types of work.
fn supervise(
    py: Python<'_>,
    workers: Workers,
    progress: Option<Py<PyAny>>,
    work: &mut (dyn FnMut(&mut Context<'_>) -> bool + Send),
) -> PyResult<()> {
    let failures = memory::arm()?;
    let mut raised = None;
    let (mut last, mut inverts, mut is_large) = (Instant::now(), false, false);
    let mut report = |event: Event| {
        if failures.more() {
            return ControlFlow::Break(());
        }
        is_large |= matches!(event, Event::Progress { total: MANY.., .. });
        let inverted = matches!(event, Event::Progress { phase: Phase::Invert, total: MANY.., .. });
        if inverted && !std::mem::replace(&mut inverts, inverted) {
            memory::give_back();
        }
        let due = matches!(event, Event::Iteration(_)) || last.elapsed() > PATIENCE;
        if !due {
            return ControlFlow::Continue(());
        }
        last = Instant::now();
        match Python::attach(|py| tell(py, progress.as_ref(), event)) {
            Ok(()) => ControlFlow::Continue(()),
            Err(error) => {
                raised = Some(error);
                ControlFlow::Break(())
            }
        }
    };
    // A thread remains in its pool for the life of the process: only the main thread becomes a pool. Other threads are temporary.
    let done = if workers.threads.is_none() && is_main_thread(py)? {
        let pool = pool_of_main_thread()?;
        py.detach(|| {
            (!workers.multiply || memory::take_buffers())
                .then(|| work(&mut Context::with_progress(pool, &mut report)))
        })
    } else {
        let (pool, handles) = start(workers.count())?;
        py.detach(|| {
            let room =
                !workers.multiply || pool.broadcast(|_| memory::take_buffers()).into_iter().all(|has| has);
            let pool = Threads::from(pool);
            let done = room.then(|| work(&mut Context::with_progress(&pool, &mut report)));
            drop(pool);
            // Threads retain their buffers until they end, and later threads may need the memory. A panic has reached the caller.
            handles.into_iter().for_each(|thread| drop(thread.join()));
            done
        })
    };
    if is_large {
        memory::give_back();
    }
    let succeeded = done.ok_or_else(memory::no_buffers)?;
    match raised {
        Some(error) => Err(error),
        None if !succeeded && failures.more() => Err(memory::failure()),
        // The conversion of the result needs a reserve again.
        None => memory::arm().map(drop),
    }
}

/// Returns whether the calling thread is Python's main thread.
fn is_main_thread(py: Python<'_>) -> PyResult<bool> {
    let threading = py.import("threading")?;
    let main = threading.call_method0("main_thread")?.getattr("ident")?;
    main.eq(threading.call_method0("get_ident")?)
}

/// Returns the main thread, which is the caller, as a pool of one. A thread can be in one pool only: the pool is created once, and again by
/// the main thread of a forked process.
fn pool_of_main_thread() -> PyResult<&'static Threads> {
    thread_local! {
        static POOL: Cell<Option<&'static Threads>> = const { Cell::new(None) };
    }
    if let Some(pool) = POOL.get() {
        return Ok(pool);
    }
    let pool = ThreadPoolBuilder::new().num_threads(1).use_current_thread().build();
    let pool = Box::leak(Box::new(Threads::from(pool.map_err(not_started)?)));
    POOL.set(Some(pool));
    Ok(pool)
}

/// Starts `count` new threads. Returns the pool and its join handles.
fn start(count: usize) -> PyResult<(ThreadPool, Vec<JoinHandle<()>>)> {
    let mut handles = vec![];
    let spawn = |own: ThreadBuilder| {
        handles.push(thread::Builder::new().spawn(|| own.run())?);
        Ok(())
    };
    let pool = ThreadPoolBuilder::new().num_threads(count).spawn_handler(spawn).build();
    Ok((pool.map_err(not_started)?, handles))
}

fn not_started(error: ThreadPoolBuildError) -> PyErr {
    memory::exhausted(&format!("threads cannot be started: {error}"))
}

fn tell(py: Python<'_>, progress: Option<&Py<PyAny>>, event: Event) -> PyResult<()> {
    py.check_signals()?;
    let Some(progress) = progress else { return Ok(()) };
    match event {
        Event::Progress { phase, done, total } => {
            progress.call1(py, (phase_name(phase), done, total, None::<()>))
        }
        Event::Iteration(iteration) => {
            progress.call1(py, ("iteration", iteration.number, 0, Some(iteration_row(&iteration))))
        }
    }
    .map(drop)
}

fn phase_name(phase: Phase) -> &'static str {
    match phase {
        Phase::Form => "form",
        Phase::Solve => "solve",
        Phase::Invert => "invert",
    }
}
