//! The GGX microfacet distribution of glTF 2.0, appendix B, and KHR_materials_anisotropy, with separable Smith masking.
//! Vectors are in the local frame with z along the shading normal. All cosines must be > 0.

use glam::Vec3;
use std::f32::consts::{PI, TAU};

/// GGX with α along the local x and y axes.
#[derive(Clone, Copy, Debug)]
pub struct Ggx {
    pub x: f32,
    pub y: f32,
}

impl Ggx {
    pub fn isotropic(alpha: f32) -> Self {
        Self { x: alpha, y: alpha }
    }

    /// The normal distribution D(h), 1/sr. In terms of tan², so that small α keeps its precision.
    #[inline]
    pub fn d(self, h: Vec3) -> f32 {
        let cos2 = h.z * h.z;
        let a2 = self.x * self.y;
        let e = if self.x == self.y {
            cos2 + (h.x * h.x + h.y * h.y) / a2
        } else {
            cos2 + (h.x / self.x).powi(2) + (h.y / self.y).powi(2)
        };
        1.0 / (PI * a2 * e * e)
    }

    /// Smith's masking G1 of a direction.
    #[inline]
    pub fn g1(self, v: Vec3) -> f32 {
        if self.x == self.y {
            let a2 = self.x * self.x;
            return 2.0 * v.z / (v.z + (a2 + (1.0 - a2) * v.z * v.z).sqrt());
        }
        2.0 * v.z / (v.z + ((self.x * v.x).powi(2) + (self.y * v.y).powi(2) + v.z * v.z).sqrt())
    }

    /// D(h) · G1(v) / (4 v.z): the density of directions mirrored about normals that are visible from `v`.
    #[inline]
    pub fn visible(self, h: Vec3, v: Vec3) -> f32 {
        self.d(h) * self.g1(v) / (4.0 * v.z)
    }

    /// Samples a normal visible from `v`, with density G1(v) · D(h) · (v·h) / v.z (Dupuy and Benyoub 2023).
    pub fn sample_visible(self, v: Vec3, u: [f32; 2]) -> Vec3 {
        let stretched = Vec3::new(self.x * v.x, self.y * v.y, v.z).normalize();
        let (sin_phi, cos_phi) = (TAU * u[0]).sin_cos();
        let z = (1.0 - u[1]) * (1.0 + stretched.z) - stretched.z;
        let r = (1.0 - z * z).max(0.0).sqrt();
        let h = Vec3::new(r * cos_phi, r * sin_phi, z) + stretched;
        Vec3::new(self.x * h.x, self.y * h.y, h.z.max(0.0)).normalize_or(Vec3::Z)
    }
}

/// (1 − c)⁵ of Schlick's Fresnel.
#[inline]
pub fn schlick(cos: f32) -> f32 {
    let m = (1.0 - cos).clamp(0.0, 1.0);
    let m2 = m * m;
    m2 * m2 * m
}
