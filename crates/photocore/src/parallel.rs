//! Loops that several threads share.
//!
//! What rayon makes of a loop is large, and is compiled anew for every type of closure: a program of a hundred such loops is rayon for a
//! fifth. Here it is given closures behind references (`&dyn Fn`), which are of one type. What is left for each loop is called once for
//! every number or every part of them, so that a number that is a part must be worth some microseconds.
//!
//! Results are in the order of the numbers, and no bit of them depends on which thread has found what.

use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};

use rayon::prelude::*;

/// Parts for each thread: one that is done early takes over what others have left.
const PARTS: usize = 4;

/// Locks what is never held while anything can panic on purpose: a panic elsewhere is passed on by the threads.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Does the work for every number below `count`.
pub(crate) fn each(count: usize, work: &(dyn Fn(usize) + Sync)) {
    (0..count).into_par_iter().for_each(work);
}

/// Hands every item over to the work, with its number.
pub(crate) fn each_of<I: Send>(items: Vec<I>, work: &(dyn Fn(usize, I) + Sync)) {
    let items: Vec<Mutex<Option<I>>> = items.into_iter().map(|item| Mutex::new(Some(item))).collect();
    each(items.len(), &|number| {
        let item = lock(&items[number]).take();
        if let Some(item) = item {
            work(number, item);
        }
    });
}

/// Does the work on chunks of so many elements, with the number of each; the last may be shorter.
pub(crate) fn each_chunk<T: Send>(all: &mut [T], size: usize, work: &(dyn Fn(usize, &mut [T]) + Sync)) {
    each_of(all.chunks_mut(size.max(1)).collect(), &|number, chunk| work(number, chunk));
}

/// What is found for parts of the numbers below `count`, neighbours in each and at least so many, put together.
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

/// What is made of every number below `count`, at least so many by one thread: for work that is much the same for all of them.
pub(crate) fn map<T: Send>(count: usize, at_least: usize, of: impl Fn(usize) -> T + Sync) -> Vec<T> {
    by_parts(count, at_least, &|numbers| numbers.map(&of).collect())
}

/// The same where much is made: it is written where it stays, and so is never there twice. Rayon is compiled for each type of it.
pub(crate) fn map_in_place<T: Send>(
    count: usize,
    at_least: usize,
    of: &(dyn Fn(usize) -> T + Sync),
) -> Vec<T> {
    (0..count).into_par_iter().with_min_len(at_least).map(of).collect()
}

/// What is made of every item, one by one: for work that is large, and more for some than for others.
pub(crate) fn map_each<I: Send, T: Send>(items: Vec<I>, of: &(dyn Fn(I) -> T + Sync)) -> Vec<T> {
    let mut found: Vec<Option<T>> = items.iter().map(|_| None).collect();
    let pairs: Vec<(I, &mut Option<T>)> = items.into_iter().zip(&mut found).collect();
    each_of(pairs, &|_, (item, found)| *found = Some(of(item)));
    found.into_iter().flatten().collect()
}

/// The same with room for what is computed on the way: made when there is none to spare, used by one item after the other.
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

/// Does both.
pub(crate) fn join(first: &mut (dyn FnMut() + Send), second: &mut (dyn FnMut() + Send)) {
    rayon::join(first, second);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Threads;

    /// What is found for so many numbers, whatever the way.
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
