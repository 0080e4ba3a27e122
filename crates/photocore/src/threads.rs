//! Worker threads of the engine, and reasons for an early end of their work.

use rayon::{ThreadPool, ThreadPoolBuilder};
use thiserror::Error;

/// Private thread pool of the engine; the global pool of a process is never started. The threads wait for work until this is dropped.
#[derive(Debug)]
pub struct Threads(ThreadPool);

/// Reason for an early end of work.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum Stopped {
    /// The progress callback requested the stop.
    #[error("interrupted")]
    Interrupted,
    /// An allocation of this number of bytes failed.
    #[error("there is no memory for an array of {0} bytes")]
    OutOfMemory(usize),
    /// The operating system starts no more threads.
    #[error("threads cannot be started")]
    NoThreads,
}

impl Threads {
    /// Starts `count` threads; 0 means one per processor.
    ///
    /// # Errors
    /// [`Stopped::NoThreads`].
    pub fn new(count: usize) -> Result<Self, Stopped> {
        ThreadPoolBuilder::new().num_threads(count).build().map(Self).map_err(|_| Stopped::NoThreads)
    }

    /// Runs work on the threads and returns its result.
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
    /// Uses threads that the caller has started.
    fn from(pool: ThreadPool) -> Self {
        Self(pool)
    }
}
