//! Reflectance of a thin film on a base: KHR_materials_iridescence, after Belcour and Barla 2017.
//!
//! Airy's sum over the reflections inside the film, weighted by the eye's three sensitivities. Each is a Gaussian over
//! wavenumbers, so that each order of interference has a closed form. Two orders are kept.

use glam::{Mat3, Vec3};
use std::f32::consts::{PI, TAU};

use super::microfacet::schlick;

/// Orders of interference, as in the extension's implementation notes.
const ORDERS: i32 = 2;

/// A film in air.
#[derive(Clone, Copy, Debug)]
pub struct ThinFilm {
    pub ior: f32,
    pub thickness_nm: f32,
}

impl ThinFilm {
    /// Reflectance over a base of reflectance `f0` at normal incidence in air, for light that meets it under `cos`.
    pub fn reflectance(self, cos: f32, f0: Vec3) -> Vec3 {
        // The thinnest films fade out.
        let t = (self.thickness_nm / 0.03).clamp(0.0, 1.0);
        let ior = 1.0 + (self.ior - 1.0) * (t * t * (3.0 - 2.0 * t));
        let sin2 = (1.0 - cos * cos) / (ior * ior);
        if sin2 >= 1.0 {
            return Vec3::ONE;
        }
        let cos_film = (1.0 - sin2).sqrt();
        let r12 = fresnel(1.0, ior, cos);
        let t121 = 1.0 - r12;
        // The index with this reflectance in air.
        let root = f0.clamp(Vec3::ZERO, Vec3::splat(0.9999)).map(f32::sqrt);
        let base = (1.0 + root) / (1.0 - root);
        let r23 = base.map(|base| fresnel(ior, base, cos_film));
        // Reflection by a denser medium shifts the phase by half a wave; the film is never less dense than air.
        let shift = base.map(|base| PI + if base < ior { PI } else { 0.0 });
        let path_nm = 2.0 * ior * self.thickness_nm * cos_film;
        let r123 = (r12 * r23).clamp(Vec3::splat(1e-5), Vec3::splat(0.9999));
        let amplitude = r123.map(f32::sqrt);
        let repeated = t121 * t121 * r23 / (Vec3::ONE - r123);
        let mut sum = Vec3::splat(r12) + repeated;
        let mut share = repeated - Vec3::splat(t121);
        for order in 1..=ORDERS {
            share *= amplitude;
            sum += share * sensitivity(order as f32 * path_nm, order as f32 * shift) * 2.0;
        }
        // The result is clamped, because saturated colours are outside of Rec. 709, and two orders are not the whole
        // sum.
        sum.clamp(Vec3::ZERO, Vec3::ONE)
    }
}

/// Schlick's reflectance between two media.
fn fresnel(outer: f32, inner: f32, cos: f32) -> f32 {
    let r = (inner - outer) / (inner + outer);
    r * r + (1.0 - r * r) * schlick(cos)
}

/// The part of the cosine of the phase for each channel, for an optical path difference and a phase shift per channel.
fn sensitivity(path_nm: f32, shift: Vec3) -> Vec3 {
    // Gaussians fitted to the eye's X, Y, Z over wavenumbers: height, middle and variance in 1/m and 1/m².
    const HEIGHT: Vec3 = Vec3::new(5.4856e-13, 4.4201e-13, 5.2481e-13);
    const MIDDLE: Vec3 = Vec3::new(1.6810e6, 1.7953e6, 2.2084e6);
    const VARIANCE: Vec3 = Vec3::new(4.3278e9, 9.3046e9, 6.6121e9);
    /// The second Gaussian of X.
    const SECOND: [f32; 3] = [9.7470e-14, 2.2399e6, 4.5282e9];
    const NORM: f32 = 1.0685e-7;
    let phase = TAU * path_nm * 1e-9;
    let gaussian = |height: f32, middle: f32, variance: f32, shift: f32| {
        height * (TAU * variance).sqrt() * (middle * phase + shift).cos() * (-variance * phase * phase).exp()
    };
    let mut xyz = Vec3::ZERO;
    for i in 0..3 {
        xyz[i] = gaussian(HEIGHT[i], MIDDLE[i], VARIANCE[i], shift[i]);
    }
    xyz.x += gaussian(SECOND[0], SECOND[1], SECOND[2], shift.x);
    REC709_FROM_XYZ * (xyz / NORM)
}

/// Columns.
const REC709_FROM_XYZ: Mat3 = Mat3::from_cols(
    Vec3::new(3.240_454_2, -0.969_266, 0.055_643_4),
    Vec3::new(-1.537_138_5, 1.876_010_8, -0.204_025_9),
    Vec3::new(-0.498_531_4, 0.041_556, 1.057_225_2),
);
