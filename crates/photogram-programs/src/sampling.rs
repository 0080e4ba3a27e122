//! Reproducible random samples for consensus methods.

/// Generator of indices below a count: xorshift (Marsaglia 2003) with a fixed seed.
#[derive(Debug)]
pub(super) struct Samples {
    count: usize,
    state: u64,
}

impl Samples {
    /// Creates a generator of indices below `count`.
    pub fn new(count: usize) -> Self {
        Self { count, state: 0x9E37_79B9_7F4A_7C15 }
    }

    /// Returns N different indices; `count` must be at least N.
    pub fn draw<const N: usize>(&mut self) -> [usize; N] {
        let mut drawn = [usize::MAX; N];
        for k in 0..N.min(self.count) {
            drawn[k] = loop {
                let next = self.next();
                if !drawn[..k].contains(&next) {
                    break next;
                }
            };
        }
        drawn
    }

    fn next(&mut self) -> usize {
        self.state ^= self.state << 13;
        self.state ^= self.state >> 7;
        self.state ^= self.state << 17;
        ((self.state >> 11) % self.count.max(1) as u64) as usize
    }
}
