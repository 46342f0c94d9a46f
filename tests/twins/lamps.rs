//! Oracle of `glsl/ground/lamps.glsl`: the irradiance of a triangle, point by point.

use glam::DVec3;

/// Least size, as a share of the distance, below which a part of a triangle is treated as a point.
const FINE: f64 = 0.02;

/// Irradiance over radiance at the origin, on a surface with unit `normal`, from a triangle of uniform radiance: ∫ cos
/// θ cos θ′ / d² over its part above the horizon. Positive where its front is visible, else negative.
///
/// By subdivision, until each part is small beside its distance; the horizon is as jagged as these parts.
pub fn triangle_irradiance(&[a, b, c]: &[DVec3; 3], normal: DVec3) -> f64 {
    let middle = (a + b + c) / 3.0;
    let size = [a, b, c].iter().map(|p| p.distance(middle)).fold(0.0, f64::max);
    let crosses = [a, b, c].iter().any(|p| p.dot(normal) > 0.0) && [a, b, c].iter().any(|p| p.dot(normal) < 0.0);
    let fine = if crosses { FINE / 8.0 } else { FINE };
    let distance = middle.length();
    if size < fine * distance || size < 1e-5 {
        let area = (b - a).cross(c - a) / 2.0;
        let d = middle / distance;
        return -area.dot(d) * d.dot(normal).max(0.0) / (distance * distance);
    }
    if [a, b, c].iter().all(|p| p.dot(normal) <= 0.0) {
        return 0.0;
    }
    let (ab, bc, ca) = ((a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0);
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]].iter().map(|part| triangle_irradiance(part, normal)).sum()
}
