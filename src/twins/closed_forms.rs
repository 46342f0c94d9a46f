//! Results known without any volume: form factors, furnaces.

use glam::DVec3;
use std::f64::consts::PI;

/// Share of a Lambertian receiver's hemisphere, cosine-weighted, that a polygon covers: E/(πL) for a polygon of radiance
/// L. Lambert's formula (Photometria, 1760): 1/(2π) Σ over edges of the angle that the edge subtends, times the cosine
/// between the normal and the edge's plane. The polygon must lie above the receiver's horizon; its winding is immaterial.
pub fn form_factor(point: DVec3, normal: DVec3, polygon: &[DVec3]) -> f64 {
    let sum: f64 = (0..polygon.len())
        .map(|i| {
            let (a, b) = (polygon[i] - point, polygon[(i + 1) % polygon.len()] - point);
            a.angle_between(b) * normal.dot(a.cross(b).normalize_or_zero())
        })
        .sum();
    (sum / (2.0 * PI)).abs()
}

/// Ambient occlusion (1 is open) at a point under one opaque polygon.
pub fn ambient_occlusion(point: DVec3, normal: DVec3, polygon: &[DVec3]) -> f64 {
    1.0 - form_factor(point, normal, polygon)
}

/// Radiance in a closed room of albedo ρ whose walls emit 1, after `bounces` bounces: Σ ρᵏ, k = 0…bounces.
pub fn furnace(albedo: f64, bounces: u32) -> f64 {
    (0..=bounces).map(|k| albedo.powi(k as i32)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lambert_agrees_with_integration_over_the_polygon() {
        // A 2×1 wall standing beside the point, and a ceiling above it off centre.
        let wall = [DVec3::new(0.3, 0.0, -1.0), DVec3::X * 0.6, DVec3::Y * 2.0];
        let ceiling = [DVec3::new(-0.2, 0.7, -0.4), DVec3::X * 1.5, DVec3::Z * 0.9];
        for [corner, u, v] in [wall, ceiling] {
            let polygon = [corner, corner + u, corner + u + v, corner + v];
            let n = 400;
            let area_normal = u.cross(v) / (n * n) as f64;
            let mut sum = 0.0;
            for i in 0..n * n {
                let (a, b) = ((i % n) as f64 + 0.5, (i / n) as f64 + 0.5);
                let r = corner + u * (a / n as f64) + v * (b / n as f64);
                sum += r.y * r.dot(area_normal).abs() / (PI * r.length_squared().powi(2));
            }
            // The midpoint rule's error at 400².
            assert!((sum - form_factor(DVec3::ZERO, DVec3::Y, &polygon)).abs() < 1e-5);
        }
    }

    #[test]
    fn a_large_ceiling_covers_everything_and_a_tall_long_wall_half() {
        let far = 1e6;
        let ceiling =
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, z)| DVec3::new(x * far, 1.0, z * far));
        assert!(ambient_occlusion(DVec3::ZERO, DVec3::Y, &ceiling) < 1e-5);
        let wall = [(0.0, -far), (far, -far), (far, far), (0.0, far)].map(|(y, z)| DVec3::new(1e-3, y, z));
        assert!((ambient_occlusion(DVec3::ZERO, DVec3::Y, &wall) - 0.5).abs() < 1e-5);
    }

    #[test]
    fn the_furnace_is_a_geometric_series() {
        assert_eq!([furnace(0.5, 0), furnace(0.5, 1), furnace(0.5, 2)], [1.0, 1.5, 1.75]);
        assert!((furnace(0.8, 200) - 5.0).abs() < 1e-12);
    }
}
