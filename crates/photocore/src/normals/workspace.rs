//! Memory that is used again.

use std::sync::Mutex;

use super::panels::lock;

/// Spare buffers, by the power of two of their capacity. Fronts come and go by the thousand; fresh pages for each of them, and
/// giving them back, would cost more than the arithmetic.
#[derive(Debug, Default)]
pub(super) struct Workspace {
    spare: Mutex<Vec<Vec<Vec<f64>>>>,
}

impl Workspace {
    /// A buffer of zeros.
    pub fn zeros(&self, length: usize) -> Vec<f64> {
        let mut buffer = self.take(length);
        buffer.clear();
        buffer.resize(length, 0.0);
        buffer
    }

    /// A buffer of anything.
    pub fn any(&self, length: usize) -> Vec<f64> {
        let mut buffer = self.take(length);
        buffer.resize(length, 0.0);
        buffer
    }

    /// Takes a buffer back.
    pub fn put_back(&self, buffer: Vec<f64>) {
        if buffer.capacity() > 0 {
            let mut spare = lock(&self.spare);
            let class = buffer.capacity().ilog2() as usize;
            if spare.len() <= class {
                spare.resize_with(class + 1, Vec::new);
            }
            spare[class].push(buffer);
        }
    }

    fn take(&self, length: usize) -> Vec<f64> {
        let capacity = length.next_power_of_two();
        let found = lock(&self.spare).get_mut(capacity.ilog2() as usize).and_then(Vec::pop);
        found.unwrap_or_else(|| Vec::with_capacity(capacity))
    }
}
