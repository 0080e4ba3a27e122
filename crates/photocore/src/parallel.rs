//! Threads of the engine, reasons for an early end of their work, and loops over threads.
//!
//! Rayon generates much code for every type of closure. These functions pass closures to it by reference (`&dyn Fn`), which is a single
//! type, so it is compiled only once. Each iteration costs one dynamic call and should do some microseconds of work.
//!
//! Results are in the order of the indices and are bitwise identical for any number of threads.

use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};

use rayon::prelude::*;
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

    /// Number of threads.
    pub fn count(&self) -> usize {
        self.0.current_num_threads()
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

/// Parts per thread; a thread that finishes early continues with the remaining parts of others.
const PARTS: usize = 4;

/// Locks a mutex, poisoned or not: rayon propagates the panic of another thread.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Calls `work` with every index below `count`.
pub(crate) fn each(count: usize, work: &(dyn Fn(usize) + Sync)) {
    (0..count).into_par_iter().for_each(work);
}

/// Passes every item to `work`, with its index.
pub(crate) fn each_of<I: Send>(items: Vec<I>, work: &(dyn Fn(usize, I) + Sync)) {
    let items: Vec<Mutex<Option<I>>> = items.into_iter().map(|item| Mutex::new(Some(item))).collect();
    each(items.len(), &|number| {
        let item = lock(&items[number]).take();
        if let Some(item) = item {
            work(number, item);
        }
    });
}

/// Passes chunks of `size` elements to `work`, with their indices; the last chunk may be shorter.
pub(crate) fn each_chunk<T: Send>(all: &mut [T], size: usize, work: &(dyn Fn(usize, &mut [T]) + Sync)) {
    each_of(all.chunks_mut(size.max(1)).collect(), &|number, chunk| work(number, chunk));
}

/// Concatenates the results of `part` for consecutive ranges of the indices below `count`, each of at least `at_least` indices.
pub(crate) fn by_parts<T: Send>(
    count: usize,
    at_least: usize,
    part: &(dyn Fn(Range<usize>) -> Vec<T> + Sync),
) -> Vec<T> {
    let length = match rayon::current_num_threads() {
        1 => count,
        threads => count.div_ceil(PARTS * threads).max(at_least),
    };
    let numbers = |first: usize| first..count.min(first + length);
    let parts = (0..count).step_by(length.max(1)).map(numbers).collect();
    let mut found = map_each(parts, part).into_iter();
    let mut all = found.next().unwrap_or_default();
    all.reserve_exact(found.as_slice().iter().map(Vec::len).sum());
    found.for_each(|part| all.extend(part));
    all
}

/// Maps every index below `count`, at least `at_least` per thread: for work of nearly equal cost.
pub fn map<T: Send>(count: usize, at_least: usize, of: impl Fn(usize) -> T + Sync) -> Vec<T> {
    by_parts(count, at_least, &|numbers| numbers.map(&of).collect())
}

/// Maps indices like [`map`], but writes large results directly to the final vector. Rayon is compiled for each result type.
pub(crate) fn map_in_place<T: Send>(
    count: usize,
    at_least: usize,
    of: &(dyn Fn(usize) -> T + Sync),
) -> Vec<T> {
    (0..count).into_par_iter().with_min_len(at_least).map(of).collect()
}

/// Maps every item separately: for large work of unequal cost.
pub(crate) fn map_each<I: Send, T: Send>(items: Vec<I>, of: &(dyn Fn(I) -> T + Sync)) -> Vec<T> {
    let mut found: Vec<Option<T>> = items.iter().map(|_| None).collect();
    let pairs: Vec<(I, &mut Option<T>)> = items.into_iter().zip(&mut found).collect();
    each_of(pairs, &|_, (item, found)| *found = Some(of(item)));
    found.into_iter().flatten().collect()
}

/// Maps items like [`map_each`] with a scratch value, which is created on demand and reused for later items.
pub(crate) fn map_each_with<R: Send, I: Send, T: Send>(
    items: Vec<I>,
    room: impl Fn() -> R + Sync,
    of: impl Fn(&mut R, I) -> T + Sync,
) -> Vec<T> {
    let spare = Mutex::new(Vec::new());
    map_each(items, &|item| {
        let own = lock(&spare).pop();
        let mut own = own.unwrap_or_else(&room);
        let found = of(&mut own, item);
        lock(&spare).push(own);
        found
    })
}

/// Runs both closures, possibly in parallel.
pub(crate) fn join(first: &mut (dyn FnMut() + Send), second: &mut (dyn FnMut() + Send)) {
    rayon::join(first, second);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Threads;

    /// Results of all loops for `count` indices.
    fn found(count: usize) -> Vec<Vec<usize>> {
        let mut chunks = vec![0; count];
        each_chunk(&mut chunks, 7, &|number, chunk| {
            chunk.iter_mut().enumerate().for_each(|(k, own)| *own = 3 * (7 * number + k));
        });
        let mut taken = vec![0; count];
        each_of(taken.iter_mut().collect(), &|number, own| *own = 3 * number);
        let room = |room: &mut Vec<usize>, number: usize| {
            room.push(number);
            3 * number
        };
        vec![
            chunks,
            taken,
            map(count, 5, |number| 3 * number),
            map_in_place(count, 5, &|number| 3 * number),
            map_each((0..count).collect(), &|number| 3 * number),
            map_each_with((0..count).collect(), Vec::new, room),
            by_parts(3 * count, 5, &|numbers| numbers.filter(|number| number % 3 == 0).collect()),
        ]
    }

    #[test]
    fn results_are_in_order_for_any_number_of_threads() {
        for threads in [1, 2, 3] {
            let threads = Threads::new(threads).unwrap();
            for count in [0, 1, 6, 7, 8, 100, 1001] {
                let expected: Vec<usize> = (0..count).map(|number| 3 * number).collect();
                threads.install(|| found(count)).iter().for_each(|found| assert_eq!(*found, expected));
            }
        }
    }

    #[test]
    fn a_panic_of_one_part_ends_all() {
        let threads = Threads::new(2).unwrap();
        let work = || threads.install(|| map(100, 1, |number| assert_ne!(number, 50)));
        assert!(std::panic::catch_unwind(std::panic::AssertUnwindSafe(work)).is_err());
        assert_eq!(threads.install(|| map(2, 1, |number| number)), [0, 1]);
    }
}
