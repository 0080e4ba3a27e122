//! Work without the GIL: the threads that share it, and the signals and the progress that are looked after meanwhile.

use std::cell::Cell;
use std::ops::ControlFlow;
use std::sync::OnceLock;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use photocore::Threads;
use photocore::adjustment::{Event, Phase, Watch};
use pyo3::prelude::*;
use rayon::{ThreadBuilder, ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

use crate::memory;
use crate::solution::iteration_row;

/// Between two looks at signals and progress.
const PATIENCE: Duration = Duration::from_millis(50);
/// Threads for each processor at the most: more only wait for each other, and thousands of them take minutes to start.
const THREADS_EACH: usize = 4;
/// Observed points up to which work stays on the calling thread, where the number of threads is not asked for: it takes some
/// milliseconds, and to start threads and to hand work over takes as long.
const SMALL: usize = 5000;
/// Local blocks from which on what solutions have needed of them is given back before the inversion, not left to the allocator.
const MANY: usize = 200_000;

/// Who does work.
pub struct Workers {
    /// So many threads, 0 for all processors, which the calling thread watches; None for the calling thread itself, which looks after
    /// signals and progress between the phases of the work, or one other where it is not the main thread.
    threads: Option<usize>,
    /// Whether they multiply matrices, for which each needs buffers.
    multiply: bool,
}

impl Workers {
    /// The calling thread, for work without larger matrices.
    pub const CALLER: Self = Self { threads: None, multiply: false };

    /// As many threads as asked for; where none are, the calling one when there are few observed points.
    pub fn of(threads: usize, points: usize) -> Self {
        Self { threads: (threads > 0 || points > SMALL).then_some(threads), multiply: true }
    }

    /// The same without buffers for products of matrices.
    pub fn reading(rows: usize) -> Self {
        Self { multiply: false, ..Self::of(0, rows) }
    }
}

/// Works without the GIL. Signals and the caller's `progress` are looked after now and then, on this thread.
///
/// # Errors
/// What a signal or `progress` raised; memory or threads that are not to be had.
pub fn watched<T: Send, E: Send>(
    py: Python<'_>,
    workers: Workers,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(&Threads, Watch<'_>) -> Result<T, E> + Send,
) -> PyResult<Result<T, E>> {
    let (mut work, mut found) = (Some(work), None);
    let mut once = |pool: &Threads, watch: Watch<'_>| {
        found = work.take().map(|work| work(pool, watch));
        matches!(found, Some(Ok(_)))
    };
    supervise(py, workers, progress, &mut once)?;
    found.ok_or_else(memory::no_buffers)
}

/// The same for work that keeps what it finds and says whether it succeeded: compiled once, not for each work.
fn supervise(
    py: Python<'_>,
    workers: Workers,
    progress: Option<Py<PyAny>>,
    work: &mut (dyn FnMut(&Threads, Watch<'_>) -> bool + Send),
) -> PyResult<()> {
    let failures = memory::arm()?;
    let mut raised = None;
    let (mut last, mut inverts) = (Instant::now(), false);
    let mut watch = |event: Event| {
        if failures.more() {
            return ControlFlow::Break(());
        }
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
    // A thread that has become a pool stays one as long as the process lives: the main thread alone does. Others come and go.
    let threads = match workers.threads {
        None if !is_main_thread(py)? => Some(1),
        asked => asked,
    };
    let done = match threads {
        None => {
            let pool = pool_of_main_thread()?;
            py.detach(|| (!workers.multiply || memory::take_buffers()).then(|| work(pool, &mut watch)))
        }
        Some(threads) => {
            let (pool, handles) = start(threads)?;
            py.detach(|| {
                let room = !workers.multiply
                    || pool.broadcast(|_| memory::take_buffers()).into_iter().all(|has| has);
                let pool = Threads::from(pool);
                let done = room.then(|| work(&pool, &mut watch));
                drop(pool);
                // Threads keep buffers until they have ended, and the next ones may need the room. A panic has reached the caller.
                handles.into_iter().for_each(|thread| drop(thread.join()));
                done
            })
        }
    };
    let succeeded = done.ok_or_else(memory::no_buffers)?;
    match raised {
        Some(error) => Err(error),
        None if !succeeded && failures.more() => Err(memory::failure()),
        // What is made of the result needs a reserve again.
        None => memory::arm().map(drop),
    }
}

/// Whether the calling thread is the one that Python started in.
fn is_main_thread(py: Python<'_>) -> PyResult<bool> {
    let threading = py.import("threading")?;
    let main = threading.call_method0("main_thread")?.getattr("ident")?;
    main.eq(threading.call_method0("get_ident")?)
}

/// The main thread, which calls, as a pool of one. A thread can be in one pool only and stays in it: it is made once, and once more by
/// the thread that is the main one of a process forked from this.
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

/// So many new threads, and no more than are of use; 0 for all processors. With them, how to wait for their end.
fn start(threads: usize) -> PyResult<(ThreadPool, Vec<JoinHandle<()>>)> {
    static PROCESSORS: OnceLock<usize> = OnceLock::new();
    let processors = *PROCESSORS.get_or_init(|| thread::available_parallelism().map_or(1, usize::from));
    let count = if threads == 0 { processors } else { threads.min(THREADS_EACH * processors) };
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
