//! The GGX microfacet distribution of glTF 2.0, appendix B, with separable Smith masking. Vectors are in the local frame with z
//! along the shading normal. All cosines must be > 0.

use glam::Vec3;
use std::f32::consts::{PI, TAU};

/// The normal distribution D(h), 1/sr. In terms of tan², so that small `alpha` keeps its precision.
#[inline]
pub fn d(alpha: f32, h: Vec3) -> f32 {
    let (sin2, cos2) = (h.x * h.x + h.y * h.y, h.z * h.z);
    let a2 = alpha * alpha;
    let e = cos2 + sin2 / a2;
    1.0 / (PI * a2 * e * e)
}

/// Smith's masking G1 for a direction at cosine `cos` to the normal.
#[inline]
pub fn g1(alpha: f32, cos: f32) -> f32 {
    let a2 = alpha * alpha;
    2.0 * cos / (cos + (a2 + (1.0 - a2) * cos * cos).sqrt())
}

/// Samples a normal visible from `v`, with density G1(v) · D(h) · (v·h) / v.z (Dupuy and Benyoub 2023).
pub fn sample_visible(alpha: f32, v: Vec3, u: [f32; 2]) -> Vec3 {
    let stretched = Vec3::new(alpha * v.x, alpha * v.y, v.z).normalize();
    let (sin_phi, cos_phi) = (TAU * u[0]).sin_cos();
    let z = (1.0 - u[1]) * (1.0 + stretched.z) - stretched.z;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let h = Vec3::new(r * cos_phi, r * sin_phi, z) + stretched;
    Vec3::new(alpha * h.x, alpha * h.y, h.z.max(0.0)).normalize_or(Vec3::Z)
}

/// (1 − c)⁵ of Schlick's Fresnel.
#[inline]
pub fn schlick(cos: f32) -> f32 {
    let m = (1.0 - cos).clamp(0.0, 1.0);
    let m2 = m * m;
    m2 * m2 * m
}
