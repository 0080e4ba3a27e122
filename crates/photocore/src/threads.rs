//! Threads of the engine, and reasons for an early stop.

use rayon::{ThreadPool, ThreadPoolBuilder};
use thiserror::Error;

/// Thread pool owned by the engine. The global pool of the process is never started; the threads live until this value is dropped.
#[derive(Debug)]
pub struct Threads(ThreadPool);

/// Reason why a computation stopped before its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum Stopped {
    /// The progress callback requested the stop.
    #[error("interrupted")]
    Interrupted,
    /// An allocation of this number of bytes failed.
    #[error("there is no memory for an array of {0} bytes")]
    OutOfMemory(usize),
    /// The operating system could not start the threads.
    #[error("threads cannot be started")]
    NoThreads,
}

impl Threads {
    /// Starts `count` threads; 0 starts one thread per processor.
    ///
    /// # Errors
    /// [`Stopped::NoThreads`].
    pub fn new(count: usize) -> Result<Self, Stopped> {
        ThreadPoolBuilder::new().num_threads(count).build().map(Self).map_err(|_| Stopped::NoThreads)
    }

    /// Runs a closure on the pool and waits for its result.
    pub fn install<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        let (mut work, mut found) = (Some(work), None);
        self.run(&mut || found = work.take().map(|work| work()));
        match found {
            Some(found) => found,
            None => unreachable!("work that has come back is done"),
        }
    }

    /// Runs a closure behind a reference: rayon is compiled for one type only.
    fn run(&self, work: &mut (dyn FnMut() + Send)) {
        self.0.install(work);
    }

    pub(crate) fn pool(&self) -> &ThreadPool {
        &self.0
    }
}

impl From<ThreadPool> for Threads {
    /// Wraps a thread pool that the caller has built.
    fn from(pool: ThreadPool) -> Self {
        Self(pool)
    }
}
