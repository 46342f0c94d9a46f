//! Twin of the fills: the seven level-0 targets of a voxel from its listed triangles.

use glam::{Vec3, Vec4};

use super::volume::{TARGETS, TRAVEL};
use twobounce::gi::cones::choices::Fill;

/// One listed triangle, already shaded.
#[derive(Clone, Copy, Debug)]
pub struct Shaded {
    /// Unit normal; it points out of the front side.
    pub normal: Vec3,
    /// Radiance that the front side sends.
    pub front: Vec3,
    /// Radiance that the back side sends; `None` for single-sided triangles, whose back sends nothing and still blocks.
    pub back: Option<Vec3>,
    /// Opacity; 1 is opaque.
    pub opacity: f32,
    /// The area of the triangle's part inside the voxel, in voxel faces.
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
        Fill::Uniform => mean_of_fronts(triangles, None),
        Fill::Front => mean_of_fronts(triangles, e),
        Fill::Facing => blend(triangles.iter().map(|t| weighted(t, e, t.opacity))),
        Fill::Sided => blend(triangles.iter().map(|t| sided(t, e))),
        Fill::Coverage => blend(triangles.iter().map(|t| weighted(t, e, t.opacity * t.area))),
    };
    std::array::from_fn(|k| target(TRAVEL.get(k).copied()))
}

/// The mean of the triangles' front radiance, whatever their area: of those whose front a traveller along `e` meets,
/// weighted by the cosine; of all with equal weights for `None`.
fn mean_of_fronts(triangles: &[Shaded], e: Option<Vec3>) -> Vec4 {
    let weight = |t: &Shaded| t.opacity * e.map_or(1.0, |e| f32::max(0.0, -t.normal.dot(e)));
    let sum: Vec4 = triangles.iter().map(|t| (weight(t) * t.front).extend(weight(t))).sum();
    sum / triangles.len().max(1) as f32
}

/// A triangle's weight and radiance for a traveller along `travel`; every direction at once for `None`.
fn weighted(t: &Shaded, travel: Option<Vec3>, weight: f32) -> (f32, Vec3) {
    match travel {
        Some(e) => (weight * t.normal.dot(e).abs(), t.seen(e)),
        None => (weight, t.mean()),
    }
}

/// A back whose light is at most this share of the front's counts as dark.
const DARK_BACK: f32 = 1e-3;

/// As coverage, but a back with next to no light does not block either.
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
