//! Twin of `glsl/ground/voxelise.geom`: its output for the rasteriser. Positions are in voxels.

use glam::{DVec2, DVec3};

/// A triangle seen along its dominant axis and dilated.
pub struct DilatedTriangle {
    pub axis: usize,
    pub triangles: Vec<[DVec2; 3]>,
}

/// `dilation`: half the width of the square about every point, in pixels. `one`: a bounding box is drawn as one
/// triangle that encloses it.
pub fn outline(triangle: &[DVec3; 3], dilation: f64, one: bool) -> DilatedTriangle {
    let normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
    let size = normal.abs();
    let axis = if size.x >= size.y && size.x >= size.z { 0 } else { 1 + usize::from(size.y < size.z) };
    let mut p = triangle.map(|p| DVec2::new(p[(axis + 1) % 3], p[(axis + 2) % 3]));
    if normal[axis] < 0.0 {
        p.swap(1, 2);
    }
    let support = |d: DVec2| dilation * (d.x.abs() + d.y.abs());
    let edges = [p[1] - p[0], p[2] - p[1], p[0] - p[2]];
    let longest = edges.into_iter().reduce(|a, b| if b.length_squared() > a.length_squared() { b } else { a });
    let along = longest.unwrap_or_default().normalize_or(DVec2::X);
    let across = along.perp();
    let span = |d: DVec2| {
        let on = p.map(|p| d.dot(p));
        let least = on.into_iter().fold(f64::INFINITY, f64::min) - support(d);
        [least, on.into_iter().fold(f64::NEG_INFINITY, f64::max) + support(d)]
    };
    let ([a0, a1], [c0, c1]) = (span(along), span(across));

    let outward = edges.map(|e| DVec2::new(e.y, -e.x).normalize_or_zero());
    let offset: [f64; 3] = std::array::from_fn(|i| outward[i].dot(p[i]) + support(outward[i]));
    let det: [f64; 3] = std::array::from_fn(|i| outward[(i + 2) % 3].perp_dot(outward[i]));
    let corner: [DVec2; 3] = std::array::from_fn(|i| {
        let j = (i + 2) % 3;
        (offset[i] * outward[j].perp() - offset[j] * outward[i].perp()) / det[i].max(1e-20)
    });
    let good = edges.iter().all(|e| e.length() > 1e-3) && det.iter().all(|d| *d > 1e-2);
    let area = 0.5 * (corner[1] - corner[0]).perp_dot(corner[2] - corner[0]);
    let at = |a: f64, c: f64| along * a + across * c;
    let triangles = if good && area > 0.0 && area < (a1 - a0) * (c1 - c0) {
        vec![corner]
    } else if one {
        vec![[at(a0, c0), at(2.0 * a1 - a0, c0), at(a0, 2.0 * c1 - c0)]]
    } else {
        vec![[at(a0, c0), at(a1, c0), at(a0, c1)], [at(a0, c1), at(a1, c0), at(a1, c1)]]
    };
    DilatedTriangle { axis, triangles }
}
