//! Arithmetic on eight numbers at a time, as two of glam's vectors, which fit registers.

use std::ops::{Add, Div, Mul, Sub};

use glam::Vec4;

/// Eight numbers. Comparisons give one bit per lane and are false with NaN.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(32))]
pub struct Lanes([Vec4; 2]);

impl Lanes {
    #[inline(always)]
    pub const fn splat(value: f32) -> Self {
        Self([Vec4::splat(value); 2])
    }

    #[inline(always)]
    pub fn from_fn(mut value: impl FnMut(usize) -> f32) -> Self {
        // Not `std::array::from_fn`, which is not inlined.
        let mut numbers = [0.0; 8];
        numbers.iter_mut().enumerate().for_each(|(lane, number)| *number = value(lane));
        Self(bytemuck::cast(numbers))
    }

    #[inline(always)]
    pub fn lane(&self, lane: usize) -> f32 {
        bytemuck::cast_ref::<_, [f32; 8]>(&self.0)[lane]
    }

    /// The lane of `other` if one of the two is NaN, like x86's instruction.
    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if cfg!(target_arch = "x86_64") { a.min(b) } else { Vec4::select(a.cmplt(b), a, b) })
    }

    /// The lane of `other` if one of the two is NaN, like x86's instruction.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if cfg!(target_arch = "x86_64") { a.max(b) } else { Vec4::select(a.cmpgt(b), a, b) })
    }

    #[inline(always)]
    pub fn less(self, other: Self) -> u32 {
        self.0[0].cmplt(other.0[0]).bitmask() | self.0[1].cmplt(other.0[1]).bitmask() << 4
    }

    #[inline(always)]
    pub fn less_or_equal(self, other: Self) -> u32 {
        self.0[0].cmple(other.0[0]).bitmask() | self.0[1].cmple(other.0[1]).bitmask() << 4
    }

    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(Vec4, Vec4) -> Vec4) -> Self {
        Self([f(self.0[0], other.0[0]), f(self.0[1], other.0[1])])
    }
}

macro_rules! operators {
    ($($trait:ident $method:ident),*) => {$(
        impl $trait for Lanes {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                self.zip(other, |a, b| $trait::$method(a, b))
            }
        }
    )*};
}

operators!(Add add, Sub sub, Mul mul, Div div);
