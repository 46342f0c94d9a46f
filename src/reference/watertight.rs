//! The watertight intersection test of eight lines with eight triangles.

use super::bvh::WIDTH;
use super::geometry::Location;
use super::lanes::{Eight, Lanes};
use super::traversal::Hit;

/// The intersection of one line and one triangle per lane.
///
/// Two triangles with a common edge compute the edge test from the same products, so no ray passes between them.
#[derive(Clone, Copy)]
pub struct Test<L> {
    u: L,
    v: L,
    w: L,
    t: L,
    along: L,
}

impl<L: Eight> Test<L> {
    #[inline(always)]
    pub fn new(origin: [L; 3], direction: [L; 3], corners: [[L; 3]; 3]) -> Self {
        let (a, b, c) = (sub(corners[0], origin), sub(corners[1], origin), sub(corners[2], origin));
        let (ab, bc, ca) = (sub(a, b), sub(b, c), sub(c, a));
        let normal = cross(ab, ca);
        let along = dot(normal, direction);
        Self {
            w: dot(cross(bc, add(b, c)), direction),
            u: dot(cross(ca, add(c, a)), direction),
            v: dot(cross(ab, add(a, b)), direction),
            t: dot(normal, a).div(along),
            along,
        }
    }

    /// The lanes whose line hits its triangle between `near` and `far`.
    #[inline(always)]
    pub fn hits(&self, near: L, far: L) -> u32 {
        let zero = L::splat(0.0);
        let least = self.u.min(self.v.min(self.w));
        let greatest = self.u.max(self.v.max(self.w));
        let inside = zero.less_or_equal(least) | greatest.less_or_equal(zero);
        let sum = self.u.add(self.v).add(self.w);
        inside & near.less(self.t) & self.t.less(far) & (sum.less(zero) | zero.less(sum))
    }

    #[inline(always)]
    pub fn hit(&self, lane: usize, triangle: u32) -> Hit {
        let lane = lane % WIDTH;
        let (u, v, w) = (self.u.store().0[lane], self.v.store().0[lane], self.w.store().0[lane]);
        let (t, along, sum) = (self.t.store().0[lane], self.along.store().0[lane], u + v + w);
        Hit { t, at: Location { triangle, u: u / sum, v: v / sum }, back: along < 0.0 }
    }
}

// The functions below have no closures: those would be compiled separately, without AVX.

#[inline(always)]
pub fn splat<L: Eight>(v: [f32; 3]) -> [L; 3] {
    [L::splat(v[0]), L::splat(v[1]), L::splat(v[2])]
}

#[inline(always)]
pub fn load<L: Eight>(v: &[Lanes; 3]) -> [L; 3] {
    [L::load(&v[0]), L::load(&v[1]), L::load(&v[2])]
}

#[inline(always)]
fn add<L: Eight>(a: [L; 3], b: [L; 3]) -> [L; 3] {
    [a[0].add(b[0]), a[1].add(b[1]), a[2].add(b[2])]
}

#[inline(always)]
fn sub<L: Eight>(a: [L; 3], b: [L; 3]) -> [L; 3] {
    [a[0].sub(b[0]), a[1].sub(b[1]), a[2].sub(b[2])]
}

#[inline(always)]
fn cross<L: Eight>(a: [L; 3], b: [L; 3]) -> [L; 3] {
    [a[1].mul(b[2]).sub(a[2].mul(b[1])), a[2].mul(b[0]).sub(a[0].mul(b[2])), a[0].mul(b[1]).sub(a[1].mul(b[0]))]
}

#[inline(always)]
fn dot<L: Eight>(a: [L; 3], b: [L; 3]) -> L {
    a[0].mul(b[0]).add(a[1].mul(b[1])).add(a[2].mul(b[2]))
}
