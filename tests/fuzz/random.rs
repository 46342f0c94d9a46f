//! Random numbers that a seed gives again on every machine.

/// Knuth's generator of 64 bits, of which the upper half is used.
pub struct Random(pub u64);

impl Random {
    /// A number from 0 to before `below`, which is at least 1.
    pub fn below(&mut self, below: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % below
    }

    /// How many changes are made at once: mostly one, so that much stays whole, at times eight.
    #[allow(dead_code)] // of all tests
    pub fn few(&mut self) -> usize {
        [1, 1, 1, 1, 1, 2, 2, 3, 4, 8][self.below(10)]
    }
}
