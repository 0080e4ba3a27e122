//! The threads that work is done on, and why it may stop before its end.

use rayon::{ThreadPool, ThreadPoolBuilder};
use thiserror::Error;

/// Threads of the engine's own; none of those that a process has in common is ever started. They wait for work until this is dropped.
#[derive(Debug)]
pub struct Threads(ThreadPool);

/// Why work has ended before its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum Stopped {
    /// Whoever watched it said so.
    #[error("interrupted")]
    Interrupted,
    /// An allocation of so many bytes failed.
    #[error("there is no memory for an array of {0} bytes")]
    OutOfMemory(usize),
    /// The system starts no more threads.
    #[error("threads cannot be started")]
    NoThreads,
}

impl Threads {
    /// So many threads; 0 for one on each processor.
    ///
    /// # Errors
    /// [`Stopped::NoThreads`].
    pub fn new(count: usize) -> Result<Self, Stopped> {
        ThreadPoolBuilder::new().num_threads(count).build().map(Self).map_err(|_| Stopped::NoThreads)
    }

    /// Does work on them, and waits for it.
    pub fn install<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        let (mut work, mut found) = (Some(work), None);
        self.run(&mut || found = work.take().map(|work| work()));
        match found {
            Some(found) => found,
            None => unreachable!("work that has come back is done"),
        }
    }

    /// What rayon gets is of one type, whatever the work is: all that it makes of it is compiled once.
    fn run(&self, work: &mut (dyn FnMut() + Send)) {
        self.0.install(work);
    }

    pub(crate) fn pool(&self) -> &ThreadPool {
        &self.0
    }
}

impl From<ThreadPool> for Threads {
    /// Threads that the caller has started in a way of its own.
    fn from(pool: ThreadPool) -> Self {
        Self(pool)
    }
}
