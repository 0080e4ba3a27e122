//! Reusable buffers, with errors for failed allocations.

use std::collections::HashMap;
use std::sync::Mutex;

use super::batch::Batch;
use crate::parallel::lock;

/// Matrices V, v and L of every batch, one after the other, per supernode; last, local blocks without equations. Empty without a cache.
pub(super) type Eliminated = Vec<Vec<f64>>;

/// Spare buffers by capacity (see [`capacity`]). There are thousands of fronts, and allocating and releasing fresh pages for each would
/// cost more than the arithmetic.
#[derive(Debug, Default)]
pub(super) struct Workspace {
    /// Whether very large buffers are allocated exactly and released after use.
    frugal: bool,
    spare: Mutex<HashMap<usize, Vec<Vec<f64>>>>,
    eliminated: Mutex<Eliminated>,
    /// Batch buffers, which differ little in size.
    batches: Mutex<Vec<Batch>>,
}

impl Workspace {
    /// Creates the workspace of a partial system: its fronts are few, very large and of increasing size, so that they are not reusable.
    pub fn frugal() -> Self {
        Self { frugal: true, ..Self::default() }
    }

    /// Returns the capacity of a buffer of `length` numbers: the next power of two, for large ones the next eighth of it.
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

    /// Whether a buffer of this capacity is released after use.
    pub fn gives_back(&self, capacity: usize) -> bool {
        self.frugal && capacity >= HUGE
    }

    /// Returns a zeroed buffer. `Err`: size of the failed allocation in bytes.
    pub fn zeros(&self, length: usize) -> Result<Vec<f64>, usize> {
        let mut buffer = self.take(length)?;
        buffer.clear();
        buffer.resize(length, 0.0);
        Ok(buffer)
    }

    /// Returns a square matrix by columns: lower triangle zeroed, upper undefined. `Err`: size of the failed allocation in bytes.
    pub fn lower_zeros(&self, order: usize) -> Result<Vec<f64>, usize> {
        let mut buffer = self.any(order * order)?;
        buffer.chunks_exact_mut(order.max(1)).enumerate().for_each(|(j, column)| column[j..].fill(0.0));
        Ok(buffer)
    }

    /// Returns a buffer with undefined contents. `Err`: size of the failed allocation in bytes.
    pub fn any(&self, length: usize) -> Result<Vec<f64>, usize> {
        let mut buffer = self.take(length)?;
        buffer.resize(length, 0.0);
        Ok(buffer)
    }

    /// Stores a buffer for reuse.
    pub fn put_back(&self, buffer: Vec<f64>) {
        if buffer.capacity() > 0 && !self.gives_back(buffer.capacity()) {
            lock(&self.spare).entry(buffer.capacity()).or_default().push(buffer);
        }
    }

    /// Releases all spare buffers.
    pub fn clear(&self) {
        lock(&self.spare).clear();
        drop(self.take_eliminated());
        lock(&self.batches).clear();
    }

    /// Returns a batch with undefined contents.
    pub fn batch(&self) -> Batch {
        lock(&self.batches).pop().unwrap_or_default()
    }

    /// Stores a batch for reuse.
    pub fn put_back_batch(&self, batch: Batch) {
        lock(&self.batches).push(batch);
    }

    /// Returns the stored cache of local eliminations; empty if there is none.
    pub fn take_eliminated(&self) -> Eliminated {
        std::mem::take(&mut *lock(&self.eliminated))
    }

    /// Stores the cache of local eliminations for reuse.
    pub fn put_back_eliminated(&self, room: Eliminated) {
        *lock(&self.eliminated) = room;
    }

    fn take(&self, length: usize) -> Result<Vec<f64>, usize> {
        let capacity = self.capacity(length);
        let found = lock(&self.spare).get_mut(&capacity).and_then(Vec::pop);
        found.map_or_else(|| reserved(capacity), Ok)
    }
}

/// Minimum number of elements for capacities that are not powers of two.
const LARGE: usize = 1 << 20;

/// Minimum number of elements of a very large buffer: 64 MiB, which an allocator maps separately.
const HUGE: usize = 1 << 23;

/// Returns an empty vector with a reserved capacity. `Err`: size of the failed allocation in bytes.
pub(super) fn reserved(capacity: usize) -> Result<Vec<f64>, usize> {
    let mut buffer = Vec::new();
    match buffer.try_reserve_exact(capacity) {
        Ok(()) => Ok(buffer),
        Err(_) => Err(capacity.saturating_mul(size_of::<f64>())),
    }
}

/// Returns `length` zeros. `Err`: size of the failed allocation in bytes.
pub(super) fn zeros(length: usize) -> Result<Vec<f64>, usize> {
    let mut buffer = reserved(length)?;
    buffer.resize(length, 0.0);
    Ok(buffer)
}
