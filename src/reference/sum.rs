//! Exact sums in fixed point that do not depend on the order of terms, so that films of parts of the samples add up to
//! the bits of the whole film.

use bytemuck::{Pod, Zeroable};

/// A sum of radiances or distances in steps of 2⁻⁶⁴, to which values are truncated; up to 2⁶³ over all samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct Sum([u64; 2]);

/// A sum of values from −1 to 1, in steps of 2⁻³², of at most 2³⁰ values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct SmallSum(i64);

const STEP: f64 = 1.0 / (1u128 << 64) as f64;
/// Larger values count as this.
const MOST: f64 = (1u64 << 62) as f64;
const SMALL_STEP: f64 = 1.0 / (1u64 << 32) as f64;

impl Sum {
    fn fixed(self) -> i128 {
        (u128::from(self.0[0]) | (u128::from(self.0[1]) << 64)) as i128
    }

    /// Wrapping addition: an intermediate overflow does not matter if the result is in range.
    fn plus(self, fixed: i128) -> Self {
        let sum = self.fixed().wrapping_add(fixed) as u128;
        Self([sum as u64, (sum >> 64) as u64])
    }

    #[inline]
    pub fn add(&mut self, value: f64) {
        *self = self.plus((value.clamp(-MOST, MOST) / STEP) as i128);
    }

    pub fn unite(&mut self, other: Self) {
        *self = self.plus(other.fixed());
    }

    #[inline]
    pub fn get(self) -> f64 {
        self.fixed() as f64 * STEP
    }
}

impl SmallSum {
    pub fn add(&mut self, value: f64) {
        self.0 = self.0.wrapping_add((value / SMALL_STEP) as i64);
    }

    pub fn unite(&mut self, other: Self) {
        self.0 = self.0.wrapping_add(other.0);
    }

    pub fn get(self) -> f64 {
        self.0 as f64 * SMALL_STEP
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_of_any_size_are_kept() {
        for value in [0.0, 1.0, -3.5, 1e-12, 1e15, f64::from(f32::MIN_POSITIVE)] {
            let mut sum = Sum::default();
            sum.add(value);
            assert!((sum.get() - value).abs() <= STEP, "{value}: {}", sum.get());
        }
        let mut sum = Sum::default();
        sum.add(f64::INFINITY);
        assert_eq!(sum.get(), MOST);
        sum.add(f64::NAN);
        assert_eq!(sum.get(), MOST, "what is no number adds nothing");
        let mut small = SmallSum::default();
        [0.25, -0.125].into_iter().for_each(|value| small.add(value));
        assert_eq!(small.get(), 0.125);
    }
}
