//! Reusable buffers, with errors for failed allocations.

use std::collections::BTreeMap;
use std::sync::Mutex;

use super::batch::Batch;
use crate::parallel::lock;

/// Matrices V, v and L of every batch, one after the other, per supernode; last, local blocks without equations. Empty without a cache.
pub(super) type Eliminated = Vec<Vec<f64>>;

/// Reusable buffers. There are thousands of fronts, and allocating and releasing fresh pages for each would cost more than the arithmetic.
#[derive(Debug, Default)]
pub(super) struct Workspace {
    fronts: Mutex<Buffers>,
    panels: Mutex<Vec<f64>>,
    eliminated: Mutex<Eliminated>,
    /// Batch buffers, which differ little in size.
    batches: Mutex<Vec<Batch>>,
}

/// Buffers of fronts. Spare ones are released if all together would exceed the limit.
#[derive(Debug, Default)]
struct Buffers {
    spare: BTreeMap<usize, Vec<Vec<f64>>>,
    /// Number of elements in spare buffers, in buffers in use and in all at most.
    unused: usize,
    used: usize,
    limit: usize,
    #[cfg(test)]
    most: usize,
}

impl Buffers {
    /// Returns a spare buffer of a capacity, or makes room for a new one.
    fn take(&mut self, capacity: usize) -> Option<Vec<f64>> {
        let found = self.spare.get_mut(&capacity).and_then(Vec::pop);
        if found.is_some() {
            self.unused -= capacity;
        }
        while self.unused > 0 && self.unused + self.used + capacity > self.limit {
            let Some(mut largest) = self.spare.last_entry() else { break };
            self.unused -= largest.get_mut().pop().map_or(0, |buffer| buffer.capacity());
            if largest.get().is_empty() {
                largest.remove();
            }
        }
        self.used += capacity;
        #[cfg(test)]
        {
            self.most = self.most.max(self.used + self.unused);
        }
        found
    }
}

/// Returns the capacity of a buffer of `length` numbers: the next power of two, for large ones the next eighth of it.
pub(super) fn capacity(length: usize) -> usize {
    let power = length.next_power_of_two();
    if length < LARGE { power } else { length.next_multiple_of(power / 8) }
}

impl Workspace {
    /// Starts a traversal whose fronts have at most `limit` elements at the same time.
    pub fn start(&self, limit: usize) {
        let mut fronts = lock(&self.fronts);
        (fronts.used, fronts.limit) = (0, limit);
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
        let (capacity, mut fronts) = (buffer.capacity(), lock(&self.fronts));
        fronts.used = fronts.used.saturating_sub(capacity);
        fronts.unused += capacity;
        fronts.spare.entry(capacity).or_default().push(buffer);
    }

    /// Returns zeroed values of all panels. `Err`: size of the failed allocation in bytes.
    pub fn panels(&self, length: usize) -> Result<Vec<f64>, usize> {
        let mut values = std::mem::take(&mut *lock(&self.panels));
        if values.capacity() < length {
            values = reserved(length)?;
        }
        values.clear();
        values.resize(length, 0.0);
        Ok(values)
    }

    /// Stores the values of all panels for reuse.
    pub fn put_back_panels(&self, values: Vec<f64>) {
        *lock(&self.panels) = values;
    }

    /// Releases all spare buffers.
    pub fn clear(&self) {
        *lock(&self.fronts) = Buffers::default();
        *lock(&self.panels) = Vec::new();
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

    /// Maximum number of elements in all buffers of fronts since the last release.
    #[cfg(test)]
    pub fn most(&self) -> usize {
        lock(&self.fronts).most
    }

    fn take(&self, length: usize) -> Result<Vec<f64>, usize> {
        let capacity = capacity(length);
        let found = lock(&self.fronts).take(capacity);
        found.map_or_else(|| reserved(capacity), Ok)
    }
}

/// Minimum number of elements for capacities that are not powers of two.
const LARGE: usize = 1 << 20;

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
