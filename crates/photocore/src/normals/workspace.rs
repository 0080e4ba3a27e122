//! Memory that is used again, and that may not be there.

use std::collections::HashMap;
use std::sync::Mutex;

use super::batch::Batch;
use crate::parallel::lock;

/// For each supernode, and last for the local blocks without equations: V, v and L of every batch assembled there, one after
/// the other; nothing where it is not cached.
pub(super) type Eliminated = Vec<Vec<f64>>;

/// Spare buffers, by their capacity (see [`capacity`]). Fronts come and go by the thousand; fresh pages for each of them, and
/// giving them back, would cost more than the arithmetic.
#[derive(Debug, Default)]
pub(super) struct Workspace {
    /// Whether what is huge goes back to the system, and is taken as large as it need be.
    frugal: bool,
    spare: Mutex<HashMap<usize, Vec<Vec<f64>>>>,
    eliminated: Mutex<Eliminated>,
    /// Room for batches, which differ little in size.
    batches: Mutex<Vec<Batch>>,
}

impl Workspace {
    /// Of a part of a larger system: beside what the parts around it have left, its fronts are few and huge, and each larger than the
    /// one before. None would ever be used again.
    pub fn frugal() -> Self {
        Self { frugal: true, ..Self::default() }
    }

    /// The capacity of a buffer for so many numbers: the next power of two, for large ones the next eighth of it.
    pub fn capacity(&self, length: usize) -> usize {
        let power = length.next_power_of_two();
        if length < LARGE {
            power
        } else if self.gives_back(length) {
            length
        } else {
            length.next_multiple_of(power / 8)
        }
    }

    /// Whether a buffer of a capacity goes back to the system.
    pub fn gives_back(&self, capacity: usize) -> bool {
        self.frugal && capacity >= HUGE
    }

    /// A buffer of zeros; the bytes that there are not.
    pub fn zeros(&self, length: usize) -> Result<Vec<f64>, usize> {
        let mut buffer = self.take(length)?;
        buffer.clear();
        buffer.resize(length, 0.0);
        Ok(buffer)
    }

    /// A square matrix, column by column, of zeros on and below the diagonal and anything above it; the bytes that there are not.
    pub fn lower_zeros(&self, order: usize) -> Result<Vec<f64>, usize> {
        let mut buffer = self.any(order * order)?;
        buffer.chunks_exact_mut(order.max(1)).enumerate().for_each(|(j, column)| column[j..].fill(0.0));
        Ok(buffer)
    }

    /// A buffer of anything; the bytes that there are not.
    pub fn any(&self, length: usize) -> Result<Vec<f64>, usize> {
        let mut buffer = self.take(length)?;
        buffer.resize(length, 0.0);
        Ok(buffer)
    }

    /// Takes a buffer back.
    pub fn put_back(&self, buffer: Vec<f64>) {
        if buffer.capacity() > 0 && !self.gives_back(buffer.capacity()) {
            lock(&self.spare).entry(buffer.capacity()).or_default().push(buffer);
        }
    }

    /// Gives all spare buffers back to the system.
    pub fn clear(&self) {
        lock(&self.spare).clear();
        drop(self.take_eliminated());
        lock(&self.batches).clear();
    }

    /// Room for a batch, of anything.
    pub fn batch(&self) -> Batch {
        lock(&self.batches).pop().unwrap_or_default()
    }

    /// Takes it back.
    pub fn put_back_batch(&self, batch: Batch) {
        lock(&self.batches).push(batch);
    }

    /// Room for what is cached of local blocks, as it was given back; nothing where it was not.
    pub fn take_eliminated(&self) -> Eliminated {
        std::mem::take(&mut *lock(&self.eliminated))
    }

    /// Takes it back.
    pub fn put_back_eliminated(&self, room: Eliminated) {
        *lock(&self.eliminated) = room;
    }

    fn take(&self, length: usize) -> Result<Vec<f64>, usize> {
        let capacity = self.capacity(length);
        let found = lock(&self.spare).get_mut(&capacity).and_then(Vec::pop);
        found.map_or_else(|| reserved(capacity), Ok)
    }
}

/// Numbers from which on a buffer is not twice as large as it need be.
const LARGE: usize = 1 << 20;

/// Numbers from which on a part gives a buffer back: 64 MiB, which an allocator takes from the system by itself.
const HUGE: usize = 1 << 23;

/// An empty vector with room for so many numbers; the bytes that there are not.
pub(super) fn reserved(capacity: usize) -> Result<Vec<f64>, usize> {
    let mut buffer = Vec::new();
    match buffer.try_reserve_exact(capacity) {
        Ok(()) => Ok(buffer),
        Err(_) => Err(capacity.saturating_mul(size_of::<f64>())),
    }
}

/// So many zeros; the bytes that there are not.
pub(super) fn zeros(length: usize) -> Result<Vec<f64>, usize> {
    let mut buffer = reserved(length)?;
    buffer.resize(length, 0.0);
    Ok(buffer)
}
