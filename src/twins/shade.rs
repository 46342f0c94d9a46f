//! Twin of the fills: what a voxel's listed triangles leave in its seven level-0 targets.

use glam::{Vec3, Vec4};

use super::volume::{TARGETS, TRAVEL};
use crate::gi::cones::choices::Fill;

/// One listed triangle, already shaded.
#[derive(Clone, Copy, Debug)]
pub struct Shaded {
    /// Unit; the front side is the one that it points out of.
    pub normal: Vec3,
    /// Radiance that the front side sends.
    pub front: Vec3,
    /// Radiance that the back side sends; `None` for single-sided triangles, whose back sends nothing and still blocks.
    pub back: Option<Vec3>,
    /// 1 is opaque.
    pub opacity: f32,
    /// The part of the triangle inside the voxel, in voxel faces.
    pub area: f32,
}

impl Shaded {
    /// Radiance of the side that a traveller along `e` meets.
    fn seen(&self, e: Vec3) -> Vec3 {
        if self.normal.dot(e) < 0.0 { self.front } else { self.back.unwrap_or(Vec3::ZERO) }
    }

    /// The mean over the sides that exist.
    fn mean(&self) -> Vec3 {
        self.back.map_or(self.front, |back| 0.5 * (self.front + back))
    }
}

/// Premultiplied radiance and alpha of the seven targets (+x +y +z −x −y −z travel, isotropic) of one voxel.
pub fn fill(triangles: &[Shaded], how: Fill) -> [Vec4; TARGETS] {
    let target = |e: Option<Vec3>| match how {
        Fill::Uniform => uniform(triangles, e),
        Fill::Facing => blend(triangles.iter().map(|t| weighted(t, e, t.opacity))),
        Fill::Sided => blend(triangles.iter().map(|t| sided(t, e))),
        Fill::Coverage => blend(triangles.iter().map(|t| weighted(t, e, t.opacity * t.area))),
    };
    std::array::from_fn(|k| target(TRAVEL.get(k).copied()))
}

/// The plain average over triangles of the side that looks at the traveller; single-sided triangles show their front all
/// round. The isotropic target averages each triangle's sides first.
fn uniform(triangles: &[Shaded], travel: Option<Vec3>) -> Vec4 {
    let radiance = |t: &Shaded| match (travel, t.back) {
        (Some(e), Some(_)) => t.seen(e),
        _ => t.mean(),
    };
    let sum: Vec4 = triangles.iter().map(|t| (t.opacity * radiance(t)).extend(t.opacity)).sum();
    sum / triangles.len().max(1) as f32
}

/// A triangle's weight and radiance for a traveller along `travel`; every direction at once for `None`.
fn weighted(t: &Shaded, travel: Option<Vec3>, weight: f32) -> (f32, Vec3) {
    match travel {
        Some(e) => (weight * t.normal.dot(e).abs(), t.seen(e)),
        None => (weight, t.mean()),
    }
}

/// A back that sends no more than this share of the front's light counts as dark.
const DARK_BACK: f32 = 1e-3;

/// As coverage, but a back that sends next to nothing does not block either.
fn sided(t: &Shaded, travel: Option<Vec3>) -> (f32, Vec3) {
    let (weight, radiance) = weighted(t, travel, t.opacity * t.area);
    let back = travel.is_some_and(|e| t.normal.dot(e) >= 0.0);
    let dark = radiance.max_element() <= DARK_BACK * t.front.max_element();
    (if back && dark { 0.0 } else { weight }, radiance)
}

/// rgb = Σwl/Σw · alpha, alpha = min(1, Σw).
fn blend(parts: impl Iterator<Item = (f32, Vec3)>) -> Vec4 {
    let (weight, sum) = parts.fold((0.0, Vec3::ZERO), |(w, s), (wi, l)| (w + wi, s + wi * l));
    if weight <= 0.0 {
        return Vec4::ZERO;
    }
    let alpha = f32::min(1.0, weight);
    (sum * (alpha / weight)).extend(alpha)
}

#[cfg(test)]
mod tests {
    use super::*;

    const RED: Vec3 = Vec3::new(2.0, 0.0, 0.0);
    const BLUE: Vec3 = Vec3::new(0.0, 0.0, 1.0);
    const WALL: Shaded = Shaded { normal: Vec3::X, front: RED, back: None, opacity: 1.0, area: 0.5 };

    #[test]
    fn a_surface_that_faces_x_shows_to_travellers_along_minus_x() {
        let facing = fill(&[WALL], Fill::Facing);
        assert_eq!(facing[3], RED.extend(1.0));
        // From behind it is black and blocks; along its plane it is neither seen nor in the way.
        assert_eq!((facing[0], facing[1]), (Vec4::W, Vec4::ZERO));
        assert_eq!(fill(&[WALL], Fill::Coverage)[3], (0.5 * RED).extend(0.5));
        assert_eq!(fill(&[WALL], Fill::Uniform), [RED.extend(1.0); 7]);
    }

    #[test]
    fn two_sides_keep_their_own_light() {
        let leaf = Shaded { back: Some(BLUE), opacity: 0.5, ..WALL };
        let uniform = fill(&[leaf], Fill::Uniform);
        assert_eq!((uniform[3], uniform[0]), ((0.5 * RED).extend(0.5), (0.5 * BLUE).extend(0.5)));
        assert_eq!(uniform[6], (0.25 * (RED + BLUE)).extend(0.5));
        assert_eq!(fill(&[leaf], Fill::Coverage)[0], (0.25 * BLUE).extend(0.25));
    }

    #[test]
    fn no_order_and_no_number_of_triangles_makes_more_than_opaque() {
        let tilted = Shaded { normal: Vec3::ONE.normalize(), front: BLUE, back: Some(RED), opacity: 0.7, area: 1.3 };
        for how in Fill::ALL {
            let (a, b) = (fill(&[WALL, tilted, WALL], *how), fill(&[WALL, WALL, tilted], *how));
            for (a, b) in a.iter().zip(&b) {
                // f32 sums in two orders.
                assert!((*a - *b).abs().max_element() < 1e-6);
                assert!(a.w <= 1.0 && a.truncate().max_element() <= 2.0 * a.w + 1e-6);
            }
        }
    }
}
