//! Results that need no volume: form factors, furnaces.

use glam::DVec3;
use std::f64::consts::PI;

/// Share of a Lambertian receiver's hemisphere, cosine-weighted, that a polygon covers: E/(πL) for a polygon of
/// radiance L. Lambert's formula (Photometria, 1760): 1/(2π) Σ over edges of the angle that the edge subtends, times
/// the cosine between the normal and the edge's plane. The polygon must lie above the receiver's horizon; its winding
/// is immaterial.
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
