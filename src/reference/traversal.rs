//! Traversal of the tree of `src/reference/bvh.rs`: one ray against eight boxes or triangles at a time, or eight rays.

use glam::Vec3;
use std::cell::Cell;

use super::bvh::{Bvh, LEAF, NONE, WIDTH};
use super::geometry::Location;
use super::lanes::Lanes;
use super::memory;
use super::watertight::{Test, splat};

/// A ray segment, in units.
#[derive(Clone, Copy, Debug, Default)]
pub struct Ray {
    pub origin: Vec3,
    /// Unit.
    pub direction: Vec3,
    pub near: f32,
    pub far: f32,
}

impl Ray {
    /// `direction` is unit.
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, direction, near: 0.0, far: f32::INFINITY }
    }

    pub fn between(origin: Vec3, end: Vec3) -> Self {
        let to = end - origin;
        let far = to.length();
        Self { origin, direction: to / far.max(f32::MIN_POSITIVE), near: 0.0, far }
    }
}

/// The intersection of a ray and a triangle.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// Distance along the ray.
    pub t: f32,
    pub at: Location,
    /// The ray hits the back.
    pub back: bool,
}

/// Bounds the rounding errors of the distances at which a ray enters and leaves a box: three roundings each.
const SLACK: f32 = 1.0 + 4.0 * f32::EPSILON;

/// A child to visit, and the distance at which the ray enters its box.
#[derive(Clone, Copy)]
struct Entry {
    child: u32,
    near: f32,
}

thread_local! {
    /// Stacks that are reused for every ray, and taken out while in use.
    static STACK: Cell<Vec<Entry>> = const { Cell::new(Vec::new()) };
    static PACKETS: Cell<Vec<(u32, u32)>> = const { Cell::new(Vec::new()) };
}

// The searches are not inlined, because the registers of their loops are scarce.
impl Bvh {
    /// The nearest hit for which `accept` is true.
    #[inline(never)]
    pub fn nearest(&self, ray: &Ray, accept: impl Fn(&Hit) -> bool) -> Option<Hit> {
        let mut nearest = None;
        self.walk::<true>(ray, |hit, far| {
            if !accept(hit) {
                return far;
            }
            nearest = Some(*hit);
            hit.t
        });
        nearest
    }

    /// Calls `stop` with hits in no particular order until it returns true. The result is whether it did.
    #[inline(never)]
    pub fn any(&self, ray: &Ray, mut stop: impl FnMut(&Hit) -> bool) -> bool {
        let mut stopped = false;
        self.walk::<false>(ray, |hit, far| {
            stopped = stop(hit);
            if stopped { f32::NEG_INFINITY } else { far }
        });
        stopped
    }

    /// [`Self::any`] for up to eight neighbouring rays, one bit per ray, much faster.
    #[inline(never)]
    pub fn any_of(&self, rays: &[Ray], mut stop: impl FnMut(&Hit) -> bool) -> u32 {
        if rays.windows(2).any(|pair| planes(&pair[0]) != planes(&pair[1])) {
            return (0..).zip(rays).map(|(bit, ray)| u32::from(self.any(ray, &mut stop)) << bit).sum();
        }
        if self.nodes.is_empty() || rays.is_empty() {
            return 0;
        }
        let (first, last) = planes(&rays[0]);
        // Each lane is a ray.
        let (origin, direction) = (vectors(rays, |r| r.origin), vectors(rays, |r| r.direction));
        let inverse = vectors(rays, |r| r.direction.recip());
        let (near, far) = (numbers(rays, |r| r.near), numbers(rays, |r| r.far));
        let slack = Lanes::splat(SLACK);
        let all = (1 << rays.len()) - 1;
        let mut stopped = 0;
        let mut stack = PACKETS.take();
        stack.clear();
        stack.push((0, all));
        while let Some((child, met)) = stack.pop() {
            let met = met & !stopped;
            if met == 0 {
                continue;
            }
            if child & LEAF != 0 {
                let packet = &self.packets[(child & !LEAF) as usize];
                for (lane, &triangle) in packet.triangles.iter().enumerate().take_while(|(_, t)| **t != NONE) {
                    let corner = |i: usize| {
                        let [x, y, z] = &packet.corners[i];
                        splat([x.lane(lane), y.lane(lane), z.lane(lane)])
                    };
                    let test = Test::new(origin, direction, &[corner(0), corner(1), corner(2)]);
                    for bit in bits(test.hits(near, far) & met & !stopped) {
                        stopped |= u32::from(stop(&test.hit(bit, triangle))) << bit;
                    }
                }
                if stopped == all {
                    break;
                }
                continue;
            }
            let node = &self.nodes[child as usize];
            for (lane, &child) in node.children.iter().enumerate().take_while(|(_, child)| **child != NONE) {
                let (mut enter, mut leave) = (near, far);
                for axis in 0..3 {
                    let (t0, t1) = (node.planes[first[axis]].lane(lane), node.planes[last[axis]].lane(lane));
                    // A ray inside the plane gives NaN, which `max` and `min` ignore.
                    enter = ((Lanes::splat(t0) - origin[axis]) * inverse[axis]).max(enter);
                    leave = ((Lanes::splat(t1) - origin[axis]) * inverse[axis]).min(leave);
                }
                let through = enter.less_or_equal(leave * slack) & met;
                if through != 0 {
                    stack.push((child, through));
                    self.prefetch(child);
                }
            }
        }
        PACKETS.set(stack);
        stopped
    }

    /// Prefetches a child.
    #[inline(always)]
    fn prefetch(&self, child: u32) {
        if child & LEAF != 0 {
            memory::prefetch(&self.packets[(child & !LEAF) as usize]);
        } else {
            memory::prefetch(&self.nodes[child as usize]);
        }
    }

    /// Calls `found` with each hit and the ray's end, and continues up to the end that it returns. `ORDERED` visits
    /// near boxes first. Each lane is a box or a triangle.
    fn walk<const ORDERED: bool>(&self, ray: &Ray, mut found: impl FnMut(&Hit, f32) -> f32) {
        // Comparisons with NaN are false, so that a non-finite ray would enter boxes that do not exist.
        if self.nodes.is_empty() || !(ray.origin + ray.direction).is_finite() {
            return;
        }
        let (origin, direction) = (splat(ray.origin.into()), splat(ray.direction.into()));
        let (first, last) = planes(ray);
        let inverse = splat(ray.direction.recip().into());
        let (near, slack) = (Lanes::splat(ray.near), Lanes::splat(SLACK));
        let mut far = ray.far;
        let mut stack = STACK.take();
        stack.clear();
        stack.push(Entry { child: 0, near: ray.near });
        while let Some(entry) = stack.pop() {
            if entry.near > far {
                continue;
            }
            if entry.child & LEAF != 0 {
                let packet = &self.packets[(entry.child & !LEAF) as usize];
                let test = Test::new(origin, direction, &packet.corners);
                for lane in bits(test.hits(near, Lanes::splat(far))) {
                    let hit = test.hit(lane, packet.triangles[lane % WIDTH]);
                    if hit.t < far {
                        far = found(&hit, far);
                    }
                }
                if far < ray.near {
                    break;
                }
                continue;
            }
            let node = &self.nodes[entry.child as usize];
            let (mut enter, mut leave) = (near, Lanes::splat(far));
            for axis in 0..3 {
                let (t0, t1) = (node.planes[first[axis]], node.planes[last[axis]]);
                // A ray inside the plane gives NaN, which `max` and `min` ignore.
                enter = ((t0 - origin[axis]) * inverse[axis]).max(enter);
                leave = ((t1 - origin[axis]) * inverse[axis]).min(leave);
            }
            let start = stack.len();
            for lane in bits(enter.less_or_equal(leave * slack)) {
                let entry = Entry { child: node.children[lane % WIDTH], near: enter.lane(lane % WIDTH) };
                stack.push(entry);
                self.prefetch(entry.child);
                if ORDERED {
                    // Keep the nearest on top.
                    let mut at = stack.len() - 1;
                    while at > start && stack[at - 1].near < entry.near {
                        stack[at] = stack[at - 1];
                        at -= 1;
                    }
                    stack[at] = entry;
                }
            }
        }
        STACK.set(stack);
    }
}

/// The numbers of the bits that are set.
#[inline(always)]
fn bits(mut mask: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let bit = (mask != 0).then(|| mask.trailing_zeros() as usize)?;
        mask &= mask - 1;
        Some(bit)
    })
}

/// A number of each ray; the last ray fills the remaining lanes.
#[inline(always)]
fn numbers(rays: &[Ray], of: impl Fn(&Ray) -> f32) -> Lanes {
    Lanes::from_fn(|lane| of(&rays[lane.min(rays.len() - 1)]))
}

#[inline(always)]
fn vectors(rays: &[Ray], of: impl Fn(&Ray) -> Vec3) -> [Lanes; 3] {
    [numbers(rays, |r| of(r).x), numbers(rays, |r| of(r).y), numbers(rays, |r| of(r).z)]
}

/// Per axis, the indices of the box planes that the ray meets first and last.
#[inline(always)]
fn planes(ray: &Ray) -> ([usize; 3], [usize; 3]) {
    // The inverse distinguishes −0 from 0, as the distances to the planes do.
    let first = std::array::from_fn(|axis| if 1.0 / ray.direction[axis] < 0.0 { axis + 3 } else { axis });
    (first, first.map(|plane| (plane + 3) % 6))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::sampler::Sampler;

    /// Vectors with components in [−1, 1).
    fn vectors(count: u32) -> Vec<Vec3> {
        let vector = |i| {
            let [x, y, z, _] = Sampler::new(1, i, 0, 2).set(0);
            2.0 * Vec3::new(x, y, z) - 1.0
        };
        (0..count).map(vector).collect()
    }

    /// Triangles of all sizes in a cube of 100 units, and rays through it, every eighth along an axis.
    fn scene() -> (Vec<[Vec3; 3]>, Vec<Ray>) {
        let v = vectors(5000);
        let triangles = v[..4000].chunks_exact(4).map(|v| {
            let size = 0.5 + 20.0 * v[3].x.powi(4);
            [0, 1, 2].map(|i| v[3] * 50.0 + v[i] * size)
        });
        let rays = v[4000..].chunks_exact(2).enumerate().map(|(i, v)| {
            let direction = if i % 8 == 0 { Vec3::AXES[i / 8 % 3] } else { v[1].normalize() };
            Ray { origin: v[0] * 60.0, direction, near: 0.0, far: if i % 3 == 0 { 40.0 } else { f32::INFINITY } }
        });
        (triangles.collect(), rays.collect())
    }

    /// The distances of all triangles that the ray hits, without a tree.
    fn all_hits(triangles: &[[Vec3; 3]], ray: &Ray) -> Vec<f32> {
        let mut hits = Vec::new();
        for t in triangles {
            let [a, b, c] = t.map(|p| splat(p.into()));
            let test = Test::new(splat(ray.origin.into()), splat(ray.direction.into()), &[a, b, c]);
            if test.hits(Lanes::splat(ray.near), Lanes::splat(ray.far)) & 1 == 1 {
                hits.push(test.hit(0, 0).t);
            }
        }
        hits
    }

    #[test]
    fn the_tree_gives_the_hits_of_a_linear_search() {
        let (triangles, rays) = scene();
        let bvh = Bvh::new(&triangles);
        let mut found = 0;
        for ray in &rays {
            let hits = all_hits(&triangles, ray);
            let expected = hits.iter().copied().min_by(f32::total_cmp).map(f32::to_bits);
            assert_eq!(bvh.nearest(ray, |_| true).map(|hit| hit.t.to_bits()), expected, "{ray:?}");
            assert_eq!(bvh.any(ray, |_| true), !hits.is_empty(), "{ray:?}");
            let mut all = 0;
            assert!(!bvh.any(ray, |_| {
                all += 1;
                false
            }));
            assert_eq!(all, hits.len(), "every triangle is hit once: {ray:?}");
            found += usize::from(expected.is_some());
        }
        assert!((100..rays.len() - 20).contains(&found), "{found} of {} rays hit", rays.len());
    }

    #[test]
    fn eight_rays_at_a_time_give_the_hits_of_single_rays() {
        let (triangles, rays) = scene();
        let bvh = Bvh::new(&triangles);
        let (mut blocked, mut mixed) = (0, 0);
        for (i, ray) in rays.iter().enumerate() {
            // Rays between the neighbourhoods of two points: mostly in one octant, sometimes in several.
            let near = |k: usize| {
                let origin = ray.origin + vectors(8)[k] * [0.1, 10.0][i % 2];
                let way = ray.origin + ray.direction * 50.0 - origin;
                Ray { origin, direction: way.normalize(), near: 0.0, far: way.length() }
            };
            let bundle: Vec<Ray> = (0..1 + i % 8).map(near).collect();
            let single = (0..).zip(&bundle).map(|(bit, ray)| u32::from(bvh.any(ray, |_| true)) << bit).sum::<u32>();
            assert_eq!(bvh.any_of(&bundle, |_| true), single, "{bundle:?}");
            blocked += single.count_ones();
            mixed += u32::from(bundle.iter().any(|ray| planes(ray) != planes(&bundle[0])));
        }
        assert!(blocked > 200 && mixed > 20, "{blocked} {mixed}");
    }

    #[test]
    fn an_empty_tree_has_no_hits() {
        let bvh = Bvh::new(&[]);
        let ray = Ray { direction: Vec3::X, far: f32::INFINITY, ..Ray::default() };
        assert!(bvh.nearest(&ray, |_| true).is_none() && !bvh.any(&ray, |_| true) && bvh.any_of(&[ray], |_| true) == 0);
    }
}
