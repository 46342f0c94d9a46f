//! Twin of the splitting of list items by other surfaces that cut their part of the triangle
//! (`glsl/ground/split.comp`).

use glam::DVec3;

use super::cover::dominant_axis;
use super::voxelise::Polygon;

/// Distance in voxels along the normal from a surface to its test points: `RAY_START`.
const ABOVE: f64 = 1e-3;
/// Test points in a row.
const ROW: u32 = 4;
/// Distance of the other test points from the part's middle, as a share of the distance to its corners.
const TO_CORNER: f64 = 0.98;

/// Whether the segment from `from` to `to` meets a triangle (with a small tolerance at its edges, as in the shader).
pub fn meets(from: DVec3, to: DVec3, &[a, b, c]: &[DVec3; 3]) -> bool {
    let (d, e1, e2) = (to - from, b - a, c - a);
    let p = d.cross(e2);
    let det = e1.dot(p);
    if det == 0.0 {
        return false;
    }
    let s = from - a;
    let q = s.cross(e1);
    let (u, v, t) = (s.dot(p) / det, d.dot(q) / det, e2.dot(q) / det);
    u >= -1e-5 && v >= -1e-5 && u + v <= 1.00001 && t > 0.0 && t < 1.0
}

/// A triangle's part in the voxel about `center`, and the other listed triangles there.
pub struct TrianglePart<'a> {
    pub corners: [DVec3; 3],
    pub center: DVec3,
    pub two_sided: bool,
    pub others: &'a [[DVec3; 3]],
}

impl TrianglePart<'_> {
    fn normal(&self) -> DVec3 {
        let [a, b, c] = self.corners;
        (b - a).cross(c - a).normalize()
    }

    /// The point of the plane with the offset `at` from the voxel's middle along the two axes after the dominant one.
    pub fn on_plane(&self, at: [f64; 2]) -> DVec3 {
        let n = self.normal();
        let axis = dominant_axis(n);
        let mut p = self.center;
        p[(axis + 1) % 3] += at[0];
        p[(axis + 2) % 3] += at[1];
        p[axis] += n.dot(self.corners[0] - p) / n[axis];
        p
    }

    /// Whether no surface lies between two points of the part, on a lit side.
    pub fn sees(&self, p: DVec3, q: DVec3) -> bool {
        let sides: &[f64] = if self.two_sided { &[1.0, -1.0] } else { &[1.0] };
        sides
            .iter()
            .map(|side| side * ABOVE * self.normal())
            .all(|above| !self.others.iter().any(|other| meets(p + above, q + above, other)))
    }

    /// Whether some test points are not visible from the part's middle.
    pub fn is_cut(&self) -> bool {
        let [a, b, c] = self.corners;
        let part = Polygon::clipped(&self.corners, self.center - 0.5, self.center + 0.5);
        let middle = part.centroid();
        let n = self.normal();
        let inside = |p: DVec3| {
            let edges = [(a, b), (b, c), (c, a)];
            let within = (p - self.center).abs().max_element() <= 0.5;
            within && edges.iter().all(|(from, to)| (*to - *from).cross(p - *from).dot(n) >= 0.0)
        };
        let along = |k: u32| 0.3 * (f64::from(k) - 1.5);
        let tried = (0..ROW * ROW).map(|k| self.on_plane([along(k % ROW), along(k / ROW)]));
        let near_corners = part.corners.iter().map(|corner| middle.lerp(*corner, TO_CORNER));
        tried.filter(|p| inside(*p)).chain(near_corners).any(|p| !self.sees(middle, p))
    }
}
