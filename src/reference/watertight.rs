//! The watertight intersection test of eight lines with eight triangles.

use super::bvh::WIDTH;
use super::geometry::Location;
use super::lanes::Lanes;
use super::traversal::Hit;

/// The intersection of one line and one triangle per lane.
///
/// Two triangles with a common edge compute the edge test from the same products, so no ray passes between them.
#[derive(Clone, Copy)]
pub struct Test {
    u: Lanes,
    v: Lanes,
    w: Lanes,
    t: Lanes,
    along: Lanes,
}

impl Test {
    #[inline(always)]
    pub fn new(origin: [Lanes; 3], direction: [Lanes; 3], corners: &[[Lanes; 3]; 3]) -> Self {
        let (a, b, c) = (sub(corners[0], origin), sub(corners[1], origin), sub(corners[2], origin));
        let (ab, bc, ca) = (sub(a, b), sub(b, c), sub(c, a));
        let normal = cross(ab, ca);
        let along = dot(normal, direction);
        Self {
            w: dot(cross(bc, add(b, c)), direction),
            u: dot(cross(ca, add(c, a)), direction),
            v: dot(cross(ab, add(a, b)), direction),
            t: dot(normal, a) / along,
            along,
        }
    }

    /// The lanes whose line hits its triangle between `near` and `far`.
    #[inline(always)]
    pub fn hits(&self, near: Lanes, far: Lanes) -> u32 {
        let zero = Lanes::splat(0.0);
        let least = self.u.min(self.v.min(self.w));
        let greatest = self.u.max(self.v.max(self.w));
        let inside = zero.less_or_equal(least) | greatest.less_or_equal(zero);
        let sum = self.u + self.v + self.w;
        inside & near.less(self.t) & self.t.less(far) & (sum.less(zero) | zero.less(sum))
    }

    #[inline(always)]
    pub fn hit(&self, lane: usize, triangle: u32) -> Hit {
        let lane = lane % WIDTH;
        let (u, v, w) = (self.u.lane(lane), self.v.lane(lane), self.w.lane(lane));
        let sum = u + v + w;
        let at = Location { triangle, u: u / sum, v: v / sum };
        Hit { t: self.t.lane(lane), at, back: self.along.lane(lane) < 0.0 }
    }
}

#[inline(always)]
pub fn splat(v: [f32; 3]) -> [Lanes; 3] {
    [Lanes::splat(v[0]), Lanes::splat(v[1]), Lanes::splat(v[2])]
}

#[inline(always)]
fn add(a: [Lanes; 3], b: [Lanes; 3]) -> [Lanes; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
fn sub(a: [Lanes; 3], b: [Lanes; 3]) -> [Lanes; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn cross(a: [Lanes; 3], b: [Lanes; 3]) -> [Lanes; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
fn dot(a: [Lanes; 3], b: [Lanes; 3]) -> Lanes {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
