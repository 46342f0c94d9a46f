//! Arithmetic on eight numbers at a time: in AVX registers if the processor has them, else in plain arrays. Both round every
//! operation in the same way, so both give the same bits.

/// Eight numbers in memory, aligned for [`Eight::load`].
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(32))]
pub struct Lanes(pub [f32; 8]);

/// Operations on eight numbers. Masks have one bit per lane; comparisons with NaN are false.
pub trait Eight: Copy {
    fn load(from: &Lanes) -> Self;
    fn splat(value: f32) -> Self;
    fn store(self) -> Lanes;
    fn add(self, other: Self) -> Self;
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    fn div(self, other: Self) -> Self;
    /// `other` where one of the two is NaN, as the processor's instruction does.
    fn min(self, other: Self) -> Self;
    fn max(self, other: Self) -> Self;
    fn less(self, other: Self) -> u32;
    fn less_or_equal(self, other: Self) -> u32;
}

impl Lanes {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|lane| f(self.0[lane], other.0[lane])))
    }

    #[inline(always)]
    fn mask(self, other: Self, f: impl Fn(f32, f32) -> bool) -> u32 {
        (0..8).map(|lane| u32::from(f(self.0[lane], other.0[lane])) << lane).sum()
    }
}

impl Eight for Lanes {
    #[inline(always)]
    fn load(from: &Lanes) -> Self {
        *from
    }

    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self([value; 8])
    }

    #[inline(always)]
    fn store(self) -> Lanes {
        self
    }

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.zip(other, |a, b| a / b)
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }

    #[inline(always)]
    fn less(self, other: Self) -> u32 {
        self.mask(other, |a, b| a < b)
    }

    #[inline(always)]
    fn less_or_equal(self, other: Self) -> u32 {
        self.mask(other, |a, b| a <= b)
    }
}

/// To be used only where [`avx`] is true.
#[cfg(target_arch = "x86_64")]
pub use std::arch::x86_64::__m256 as Avx;

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::{Avx, Eight, Lanes};
    use std::arch::x86_64::*;

    // SAFETY of all: the callers of generic code choose `Avx` only on processors that have it; loads are aligned.
    impl Eight for Avx {
        #[inline(always)]
        fn load(from: &Lanes) -> Self {
            unsafe { _mm256_load_ps(from.0.as_ptr()) }
        }

        #[inline(always)]
        fn splat(value: f32) -> Self {
            unsafe { _mm256_set1_ps(value) }
        }

        #[inline(always)]
        fn store(self) -> Lanes {
            let mut to = Lanes::default();
            unsafe { _mm256_store_ps(to.0.as_mut_ptr(), self) };
            to
        }

        #[inline(always)]
        fn add(self, other: Self) -> Self {
            unsafe { _mm256_add_ps(self, other) }
        }

        #[inline(always)]
        fn sub(self, other: Self) -> Self {
            unsafe { _mm256_sub_ps(self, other) }
        }

        #[inline(always)]
        fn mul(self, other: Self) -> Self {
            unsafe { _mm256_mul_ps(self, other) }
        }

        #[inline(always)]
        fn div(self, other: Self) -> Self {
            unsafe { _mm256_div_ps(self, other) }
        }

        #[inline(always)]
        fn min(self, other: Self) -> Self {
            unsafe { _mm256_min_ps(self, other) }
        }

        #[inline(always)]
        fn max(self, other: Self) -> Self {
            unsafe { _mm256_max_ps(self, other) }
        }

        #[inline(always)]
        fn less(self, other: Self) -> u32 {
            unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(self, other)) as u32 }
        }

        #[inline(always)]
        fn less_or_equal(self, other: Self) -> u32 {
            unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(self, other)) as u32 }
        }
    }
}

/// Whether this processor has AVX registers.
pub fn avx() -> bool {
    #[cfg(target_arch = "x86_64")]
    return is_x86_feature_detected!("avx");
    #[cfg(not(target_arch = "x86_64"))]
    false
}
