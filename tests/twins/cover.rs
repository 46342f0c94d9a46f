//! Oracle of the pass cover: which samples of a multisampled raster fall on a triangle, and in which voxels, by edge
//! functions in f64. Positions are in voxels.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};

/// The distance to an edge, in pixels, within which the rasteriser may decide either way: it snaps corners to 1/256.
const SNAP: f64 = 1.0 / 128.0;
/// The distance to the next voxel within which f32 may put a sample in either.
const ROUNDING: f64 = 1e-3;

/// Vulkan's standard sample locations, in sixteenths of a pixel ("Standard sample locations" of its specification).
pub fn places(samples: u32) -> Vec<DVec2> {
    let sixteenths: &[[u32; 2]] = match samples {
        1 => &[[8, 8]],
        4 => &[[6, 2], [14, 6], [2, 10], [10, 14]],
        8 => &[[9, 5], [7, 11], [13, 9], [5, 3], [3, 13], [1, 7], [11, 15], [15, 1]],
        _ => panic!("no places of {samples} samples"),
    };
    sixteenths.iter().map(|p| DVec2::new(f64::from(p[0]), f64::from(p[1])) / 16.0).collect()
}

/// The axis along which a triangle has its largest projection.
pub fn dominant_axis(normal: DVec3) -> usize {
    let n = normal.abs();
    if n.x >= n.y && n.x >= n.z {
        0
    } else if n.y >= n.z {
        1
    } else {
        2
    }
}

/// For every voxel the least and the largest number of its samples.
pub fn counts(corners: [DVec3; 3], samples: u32, edge: u32) -> BTreeMap<u32, [u32; 2]> {
    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    let axis = dominant_axis(normal);
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let flat = corners.map(|c| DVec2::new(c[u], c[v]));
    let (low, high) = (flat[0].min(flat[1]).min(flat[2]), flat[0].max(flat[1]).max(flat[2]));
    let turn = (flat[1] - flat[0]).perp_dot(flat[2] - flat[0]).signum();
    let depths = corners.map(|c| c[axis]);
    let (least, most) =
        (depths.iter().copied().fold(f64::MAX, f64::min), depths.iter().copied().fold(f64::MIN, f64::max));
    let mut found: BTreeMap<u32, [u32; 2]> = BTreeMap::new();
    let pixels = |from: f64, to: f64| (from.floor().max(0.0) as u32)..(to.ceil().min(f64::from(edge)) as u32);
    for (x, y) in pixels(low.y, high.y).flat_map(|y| pixels(low.x, high.x).map(move |x| (x, y))) {
        for place in places(samples) {
            let p = DVec2::new(f64::from(x), f64::from(y)) + place;
            // Distance to the nearest edge, positive inside.
            let inside = (0..3)
                .map(|i| {
                    let (a, b) = (flat[i], flat[(i + 1) % 3]);
                    turn * (b - a).perp_dot(p - a) / (b - a).length().max(1e-12)
                })
                .fold(f64::MAX, f64::min);
            if inside < -SNAP {
                continue;
            }
            let depth =
                corners[0][axis] - (normal[u] * (p.x - flat[0].x) + normal[v] * (p.y - flat[0].y)) / normal[axis];
            let depth = depth.clamp(least, most);
            let sure = inside > SNAP && (depth - ROUNDING).floor() == (depth + ROUNDING).floor();
            let mut slices = [(depth - ROUNDING).floor(), (depth + ROUNDING).floor()].to_vec();
            slices.dedup();
            for slice in slices.into_iter().filter(|k| (0.0..f64::from(edge)).contains(k)) {
                let mut at = [0; 3];
                (at[u], at[v], at[axis]) = (x, y, slice as u32);
                let count = found.entry((at[2] * edge + at[1]) * edge + at[0]).or_default();
                count[0] += u32::from(sure);
                count[1] += 1;
            }
        }
    }
    found
}
