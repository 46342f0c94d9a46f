//! Oracle of `glsl/gi/photons/octahedron.glsl`: the octahedral map of 4 × 4 texels in f64, its means by fine sampling.

use glam::{DVec2, DVec3};

/// The place of a direction on the map, in texels: the octahedron |x| + |y| + |z| = 1 unfolded about +z.
pub fn place(d: DVec3) -> DVec2 {
    let p = d / (d.x.abs() + d.y.abs() + d.z.abs());
    let sign = |v: f64| if v < 0.0 { -1.0 } else { 1.0 };
    let flat = if p.z < 0.0 {
        DVec2::new((1.0 - p.y.abs()) * sign(p.x), (1.0 - p.x.abs()) * sign(p.y))
    } else {
        DVec2::new(p.x, p.y)
    };
    flat * 2.0 + 2.0
}

/// Mean over a texel of the clamped cosine to unit `n`, and the texel's solid angle, sr.
pub fn texel(texel: usize, n: DVec3) -> (f64, f64) {
    const FINE: usize = 24;
    let (mut cosines, mut total) = (0.0, 0.0);
    for i in 0..FINE * FINE {
        let within = DVec2::new((i % FINE) as f64 + 0.5, (i / FINE) as f64 + 0.5) / FINE as f64;
        let at = (DVec2::new((texel % 4) as f64, (texel / 4) as f64) + within) / 2.0 - 1.0;
        let z = 1.0 - at.x.abs() - at.y.abs();
        let sign = |v: f64| if v < 0.0 { -1.0 } else { 1.0 };
        let p = if z < 0.0 {
            DVec3::new((1.0 - at.y.abs()) * sign(at.x), (1.0 - at.x.abs()) * sign(at.y), z)
        } else {
            DVec3::new(at.x, at.y, z)
        };
        // Of a face's area element dA at p the sphere gets dA · cos / |p|²; cos = 1/(√3 |p|), and dA = √3 times the
        // map's.
        let angle = p.length().powi(-3) * (0.5 / FINE as f64).powi(2);
        cosines += angle * p.normalize().dot(n).max(0.0);
        total += angle;
    }
    (cosines / total, total)
}
