//! Oracle of the voxelise pass: the exact set of (voxel, triangle) pairs, by clipping polygons in f64.
//!
//! The pass tests separating axes; this oracle clips the triangle against the voxel's six planes (Sutherland and
//! Hodgman 1974) and checks whether anything is left. Triangles and boxes are closed: touching counts. Positions are in
//! voxels.

use glam::{DVec2, DVec3, IVec3, UVec3};
use rayon::prelude::*;

/// A voxel (its [`texel index`](super::volume::texel_index)) and a triangle (its place in the list).
pub type Pair = (u32, u32);

/// The distance from touching, in voxels, within which f32 may decide either way: 64 · 2⁻²³ is 8·10⁻⁶ for one rounded
/// coordinate, and the separating-axis tests add several of them up.
pub const TOUCHING_VOXELS: f64 = 1e-4;

/// The exact set, sorted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VoxelPairs {
    /// Pairs that still meet when the voxel is shrunk by [`TOUCHING_VOXELS`] on all sides.
    pub certain: Vec<Pair>,
    /// Pairs that meet only when it is grown by that much: either answer is right.
    pub touching: Vec<Pair>,
}

/// The comparison of a set of pairs with the exact one. Pairs near touching count neither way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairComparison {
    /// Share of the certain pairs that were found.
    pub recall: f64,
    /// Share of the found pairs that are certain.
    pub precision: f64,
    /// Share of the exact set that is near touching.
    pub touching: f64,
}

/// A convex polygon: a triangle cut by six planes has at most nine corners.
#[derive(Clone, Debug, Default)]
pub struct Polygon {
    pub corners: Vec<DVec3>,
}

impl Polygon {
    /// The part of a triangle inside the closed box; empty where they do not meet.
    pub fn clipped(triangle: &[DVec3; 3], min: DVec3, max: DVec3) -> Self {
        let (mut polygon, mut spare) = (Vec::with_capacity(9), Vec::with_capacity(9));
        polygon.extend_from_slice(triangle);
        for axis in 0..3 {
            clip(&polygon, &mut spare, |p| p[axis] - min[axis]);
            clip(&spare, &mut polygon, |p| max[axis] - p[axis]);
            if polygon.is_empty() {
                break;
            }
        }
        Self { corners: polygon }
    }

    /// The area vector of the polygon: half the sum of the corners' cross products; its length is the area.
    pub fn area_vector(&self) -> DVec3 {
        let Some((&first, rest)) = self.corners.split_first() else { return DVec3::ZERO };
        rest.windows(2).map(|w| (w[0] - first).cross(w[1] - first)).sum::<DVec3>() * 0.5
    }

    /// The centroid of the area; the mean of the corners where the area is 0.
    pub fn centroid(&self) -> DVec3 {
        let Some((&first, rest)) = self.corners.split_first() else { return DVec3::ZERO };
        let direction = self.area_vector().normalize_or_zero();
        let (mut sum, mut total) = (DVec3::ZERO, 0.0);
        for w in rest.windows(2) {
            let area = (w[0] - first).cross(w[1] - first).dot(direction);
            sum += area * (first + w[0] + w[1]) / 3.0;
            total += area;
        }
        if total > 0.0 { sum / total } else { self.corners.iter().sum::<DVec3>() / self.corners.len() as f64 }
    }
}

/// Keeps the part of `polygon` where `distance` ≥ 0.
fn clip(polygon: &[DVec3], kept: &mut Vec<DVec3>, distance: impl Fn(DVec3) -> f64) {
    kept.clear();
    for (i, &a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (da, db) = (distance(a), distance(b));
        if da >= 0.0 {
            kept.push(a);
        }
        // Neither end on the plane: such ends are corners already.
        if (da > 0.0 && db < 0.0) || (da < 0.0 && db > 0.0) {
            kept.push(a + (b - a) * (da / (da - db)));
        }
    }
}

/// Every voxel of an `edge`³ grid that a triangle meets. A triangle without area meets none: the recorder drops it.
pub fn voxelise(triangles: &[[DVec3; 3]], edge: u32) -> VoxelPairs {
    let parts: Vec<VoxelPairs> = triangles
        .par_iter()
        .enumerate()
        .map(|(index, triangle)| {
            let grown =
                |p: DVec3, by: f64| (p + by).floor().as_ivec3().clamp(IVec3::ZERO, IVec3::splat(edge as i32 - 1));
            let min = triangle[0].min(triangle[1]).min(triangle[2]);
            let max = triangle[0].max(triangle[1]).max(triangle[2]);
            let mut pairs = VoxelPairs::default();
            if (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]) == DVec3::ZERO {
                return pairs;
            }
            let cells = [grown(min, -TOUCHING_VOXELS), grown(max, TOUCHING_VOXELS) + 1];
            descend(triangle, index as u32, cells, edge, &mut pairs);
            pairs
        })
        .collect();
    let mut all = VoxelPairs {
        certain: parts.iter().flat_map(|p| p.certain.iter().copied()).collect(),
        touching: parts.iter().flat_map(|p| p.touching.iter().copied()).collect(),
    };
    all.certain.par_sort_unstable();
    all.touching.par_sort_unstable();
    all
}

/// Halves the range of cells [min, max) along its longest side while the triangle meets it.
fn descend(triangle: &[DVec3; 3], index: u32, [min, max]: [IVec3; 2], edge: u32, pairs: &mut VoxelPairs) {
    let meets = |by: f64| !Polygon::clipped(triangle, min.as_dvec3() - by, max.as_dvec3() + by).corners.is_empty();
    let size = max - min;
    if size == IVec3::ONE {
        let pair = (super::volume::texel_index(min.as_uvec3(), edge), index);
        let pair = (pair.0 as u32, pair.1);
        if meets(-TOUCHING_VOXELS) {
            pairs.certain.push(pair);
        } else if meets(TOUCHING_VOXELS) {
            pairs.touching.push(pair);
        }
        return;
    }
    if !meets(TOUCHING_VOXELS) {
        return;
    }
    let axis = (0..3).max_by_key(|&axis| size[axis]).unwrap_or(0);
    let (mut low_max, mut high_min) = (max, min);
    low_max[axis] = min[axis] + size[axis] / 2;
    high_min[axis] = low_max[axis];
    descend(triangle, index, [min, low_max], edge, pairs);
    descend(triangle, index, [high_min, max], edge, pairs);
}

/// Dilation of a triangle in voxels: half a pixel, and a hundredth for the rasteriser's snapping.
pub const DILATION: f64 = 0.51;

/// The triangle, seen along its dominant axis, with each edge moved outwards by `by` times the pixel's width across it;
/// its corners stay in its plane.
fn dilated(triangle: &[DVec3; 3], axis: usize, by: f64) -> [DVec3; 3] {
    let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
    let normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
    let line = |i: usize| {
        let edge = triangle[(i + 1) % 3] - triangle[i];
        let out = DVec2::new(edge[v], -edge[u]) * normal[axis].signum();
        (out, out.dot(DVec2::new(triangle[i][u], triangle[i][v])) + by * out.abs().element_sum())
    };
    std::array::from_fn(|i| {
        let ((a, c), (b, d)) = (line((i + 2) % 3), line(i));
        let corner = DVec2::new(c * b.y - d * a.y, d * a.x - c * b.x) / a.perp_dot(b);
        let mut p = triangle[0];
        p[axis] -= (normal[u] * (corner.x - p[u]) + normal[v] * (corner.y - p[v])) / normal[axis];
        (p[u], p[v]) = (corner.x, corner.y);
        p
    })
}

/// Every voxel that a dilated triangle meets and whose column's middle it covers: the pairs that a pixel shader finds
/// that runs for these columns and tests the dilated triangle. For triangles without sharp angles, because the pass
/// uses the bounding box of the others.
pub fn voxelise_dilated(triangles: &[[DVec3; 3]], edge: u32) -> VoxelPairs {
    let mut pairs = VoxelPairs::default();
    for (index, triangle) in triangles.iter().enumerate() {
        let normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]).abs();
        let axis = normal.max_position();
        let lists = |voxel: IVec3, slack: f64| {
            let t = dilated(triangle, axis, DILATION + slack);
            let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
            let side = |i: usize| {
                let (a, b) = (t[i], t[(i + 1) % 3]);
                let m = voxel.as_dvec3() + 0.5;
                (b[u] - a[u]) * (m[v] - a[v]) - (b[v] - a[v]) * (m[u] - a[u])
            };
            let sides = [side(0), side(1), side(2)];
            let covers = sides.iter().all(|s| *s >= 0.0) || sides.iter().all(|s| *s <= 0.0);
            covers && !Polygon::clipped(&t, voxel.as_dvec3() - slack, voxel.as_dvec3() + 1.0 + slack).corners.is_empty()
        };
        for voxel in 0..edge.pow(3) {
            let at = UVec3::new(voxel % edge, voxel / edge % edge, voxel / edge / edge).as_ivec3();
            // The rasteriser snaps corners to 1/256 pixel.
            if lists(at, -0.01) {
                pairs.certain.push((voxel, index as u32));
            } else if lists(at, 0.01) {
                pairs.touching.push((voxel, index as u32));
            }
        }
    }
    pairs.certain.sort_unstable();
    pairs.touching.sort_unstable();
    pairs
}

/// Compares found pairs (any order, no duplicates expected: a duplicate counts against precision) with the exact set.
pub fn compare_sets(found: &[Pair], exact: &VoxelPairs) -> PairComparison {
    let mut found = found.to_vec();
    found.sort_unstable();
    let holds = |set: &[Pair], pair: &Pair| set.binary_search(pair).is_ok();
    let recalled = exact.certain.iter().filter(|p| holds(&found, p)).count();
    let decided: Vec<_> = found.iter().enumerate().filter(|(_, p)| !holds(&exact.touching, p)).collect();
    let right = decided.iter().filter(|(i, p)| holds(&exact.certain, p) && (*i == 0 || found[i - 1] != **p)).count();
    let share = |part: usize, whole: usize| if whole == 0 { 1.0 } else { part as f64 / whole as f64 };
    let all = exact.certain.len() + exact.touching.len();
    PairComparison {
        recall: share(recalled, exact.certain.len()),
        precision: share(right, decided.len()),
        touching: if all == 0 { 0.0 } else { exact.touching.len() as f64 / all as f64 },
    }
}

/// Alpha that a triangle adds to a voxel's x, y and z faces: its clipped part, projected, in voxel faces.
pub fn coverage(triangle: &[DVec3; 3], voxel: IVec3) -> DVec3 {
    Polygon::clipped(triangle, voxel.as_dvec3(), voxel.as_dvec3() + 1.0).area_vector().abs()
}
