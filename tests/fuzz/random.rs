//! Random numbers that depend only on a seed, on every machine.

/// Knuth's generator of 64 bits, of which the upper half is used.
pub struct Random(pub u64);

impl Random {
    /// A number from 0 to `below` − 1; `below` is at least 1.
    pub fn below(&mut self, below: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % below
    }

    /// The number of changes to make: mostly one, so that most of the input stays valid, at most eight.
    #[allow(dead_code)] // of all tests
    pub fn few(&mut self) -> usize {
        [1, 1, 1, 1, 1, 2, 2, 3, 4, 8][self.below(10)]
    }
}
