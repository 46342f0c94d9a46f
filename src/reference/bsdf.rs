//! The BSDF of glTF 2.0 (appendix B, with KHR_materials_specular, _ior, _transmission and _volume): evaluation, sampling,
//! density.
//!
//! Three lobes: diffuse ρ/π, GGX reflection, GGX transmission (unrefracted through thin walls, refracted at volumes). Below
//! [`SMOOTH`] the GGX lobes are mirrors. Smooth thin transmission is not a lobe: paths and shadow rays pass it without a
//! bounce, see [`Bsdf::unscattered`].

use glam::{Mat3, Vec3};
use std::f32::consts::{FRAC_1_PI, TAU};

use super::microfacet as ggx;
use crate::scene::surface::SurfaceParams;

/// The α = roughness² below which a lobe is a perfect mirror: ±0.06°.
pub const SMOOTH: f32 = 1e-3;

/// A direction chosen by [`Bsdf::sample`].
#[derive(Clone, Copy, Debug)]
pub struct Scatter {
    /// World space, unit.
    pub direction: Vec3,
    /// f · |cos| / density.
    pub weight: Vec3,
    /// Per steradian; undefined for mirrors.
    pub density: f32,
    pub mirror: bool,
    /// The factor on radiance by refraction, the squared ratio of refractive indices; 1 for reflection.
    pub compression: f32,
}

/// Schlick's reflectance: at normal incidence and at grazing angles.
#[derive(Clone, Copy, Debug)]
struct Reflectance {
    f0: Vec3,
    f90: f32,
}

impl Reflectance {
    fn at(&self, cos: f32) -> Vec3 {
        self.f0 + (Vec3::splat(self.f90) - self.f0) * ggx::schlick(cos)
    }
}

/// The BSDF at one point, for one viewing direction.
#[derive(Clone, Copy, Debug)]
pub struct Bsdf {
    /// World from local: columns tangent, bitangent, normal.
    frame: Mat3,
    /// The triangle's normal on the viewer's side.
    pub geometric: Vec3,
    /// Towards the viewer, local; z > 0.
    wo: Vec3,
    alpha: f32,
    reflected: Reflectance,
    /// Reflectance of the dielectric alone. The rest of the light reaches the diffuse and transmission lobes.
    coat: Reflectance,
    /// Albedo of the diffuse and of the transmission lobe, before Fresnel.
    diffuse: Vec3,
    transmitted: Vec3,
    volume: bool,
    /// Index of refraction on the far side over that on the viewer's side.
    eta: f32,
    /// Sampling probabilities of diffuse, reflection, transmission.
    choose: [f32; 3],
}

/// The side from which a BSDF is seen. All vectors are unit; both normals have a positive dot product with `wo`.
#[derive(Clone, Copy, Debug)]
pub struct Viewing {
    pub normal: Vec3,
    pub geometric: Vec3,
    /// Towards the viewer.
    pub wo: Vec3,
    /// Whether the viewer is inside the volume that the surface bounds.
    pub inside: bool,
}

/// A tangent frame around unit `n` (Duff et al. 2017); singular only at −z.
#[inline]
pub fn frame(n: Vec3) -> Mat3 {
    let sign = 1f32.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    Mat3::from_cols(
        Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
        Vec3::new(b, sign + n.y * n.y * a, -n.y),
        n,
    )
}

/// A direction around +z with density cos/π.
pub fn sample_cosine(u: [f32; 2]) -> Vec3 {
    let (sin, cos) = (TAU * u[0]).sin_cos();
    let r = u[1].sqrt();
    Vec3::new(r * cos, r * sin, (1.0 - u[1]).max(0.0).sqrt())
}

impl Bsdf {
    /// `volume` means that transmission refracts.
    #[inline]
    pub fn new(p: &SurfaceParams, volume: bool, viewing: Viewing) -> Self {
        let Viewing { normal, geometric, wo, inside } = viewing;
        let frame = frame(normal);
        let nonmetal = 1.0 - p.metallic;
        let coat = if nonmetal > 0.0 {
            let f0 = (p.f0 - p.base_color * p.metallic) / nonmetal;
            Reflectance { f0: f0.clamp(Vec3::ZERO, Vec3::ONE), f90: ((p.f90 - p.metallic) / nonmetal).clamp(0.0, 1.0) }
        } else {
            Reflectance { f0: Vec3::ZERO, f90: 0.0 }
        };
        let transmitted = p.base_color * p.transmission;
        let mut bsdf = Self {
            frame,
            geometric,
            wo: (frame.transpose() * wo).with_z(normal.dot(wo).max(1e-6)),
            alpha: p.roughness * p.roughness,
            reflected: Reflectance { f0: p.f0, f90: p.f90 },
            coat,
            diffuse: p.diffuse - transmitted,
            transmitted,
            volume,
            eta: if inside { 1.0 / p.ior } else { p.ior },
            choose: [0.0; 3],
        };
        let (reflected, rest) = bsdf.fresnel(bsdf.wo.z);
        let transmission =
            if bsdf.volume || bsdf.alpha >= SMOOTH { bsdf.transmitted.max_element() * rest } else { 0.0 };
        let mut lobes = [bsdf.diffuse.max_element() * rest, reflected.max_element(), transmission];
        if bsdf.alpha >= SMOOTH && (p.f90 > 0.0 || volume) {
            // Microfacets of a rough surface may reflect or transmit in directions in which a smooth surface would not.
            lobes[1] = lobes[1].max(0.05);
            lobes[2] = lobes[2].max(if volume { 0.1 * bsdf.transmitted.max_element() } else { 0.0 });
        }
        let total: f32 = lobes.iter().sum();
        if total > 0.0 {
            bsdf.choose = lobes.map(|l| l / total);
        }
        bsdf
    }

    /// The shading normal, on the viewer's side.
    pub fn normal(&self) -> Vec3 {
        self.frame.z_axis
    }

    /// At the cosine between a direction and the half vector: the reflectance, and the remaining share of light for the other
    /// lobes.
    #[inline]
    fn fresnel(&self, cos: f32) -> (Vec3, f32) {
        let mut cos_outside = cos;
        if self.volume && self.eta < 1.0 {
            // Schlick's formula takes the angle on the side with the lower index.
            let sin2 = (1.0 - cos * cos) / (self.eta * self.eta);
            if sin2.is_nan() || sin2 >= 1.0 {
                return (Vec3::ONE, 0.0);
            }
            cos_outside = (1.0 - sin2).sqrt();
        }
        (self.reflected.at(cos_outside), 1.0 - self.coat.at(cos_outside).max_element())
    }

    /// Whether light from the far side is scattered to the viewer.
    pub fn transmits(&self) -> bool {
        self.choose[2] > 0.0
    }

    /// The share of light that passes a smooth thin wall unscattered.
    pub fn unscattered(&self) -> Vec3 {
        if self.volume || self.alpha >= SMOOTH { Vec3::ZERO } else { self.transmitted * self.fresnel(self.wo.z).1 }
    }

    /// Whether a direction is on the same side of the triangle and of the plane of the shading normal; else light would leak.
    #[inline]
    fn is_consistent(&self, wi: Vec3) -> bool {
        (self.geometric.dot(wi) > 0.0) == (self.normal().dot(wi) > 0.0)
    }

    /// f · |cos| and the density of [`Self::sample`] without mirrors, for unit `wi` (world space, away from the surface).
    #[inline]
    pub fn eval(&self, wi: Vec3) -> (Vec3, f32) {
        if !self.is_consistent(wi) {
            return (Vec3::ZERO, 0.0);
        }
        let wi = self.frame.transpose() * wi;
        if wi.z > 0.0 {
            self.eval_reflection(wi)
        } else if wi.z < 0.0 && self.choose[2] > 0.0 && self.alpha >= SMOOTH {
            if self.volume { self.eval_refraction(wi) } else { self.eval_thin(wi) }
        } else {
            (Vec3::ZERO, 0.0)
        }
    }

    /// Whether only the diffuse lobe is present, which does not depend on the viewing direction.
    #[inline]
    pub fn is_lambertian(&self) -> bool {
        self.reflected.f90 == 0.0 && self.choose[0] == 1.0
    }

    #[inline]
    fn eval_reflection(&self, wi: Vec3) -> (Vec3, f32) {
        if self.is_lambertian() {
            return (self.diffuse * (FRAC_1_PI * wi.z), FRAC_1_PI * wi.z);
        }
        let h = (self.wo + wi).normalize();
        let (reflected, rest) = self.fresnel(self.wo.dot(h).min(1.0));
        let mut f = self.diffuse * (rest * FRAC_1_PI * wi.z);
        let mut density = self.choose[0] * FRAC_1_PI * wi.z;
        if self.alpha >= SMOOTH {
            let visible = ggx::d(self.alpha, h) * ggx::g1(self.alpha, self.wo.z) / (4.0 * self.wo.z);
            f += reflected * (visible * ggx::g1(self.alpha, wi.z));
            density += self.choose[1] * visible;
        }
        (f, density)
    }

    /// A rough thin wall: the reflection lobe, mirrored to the far side.
    fn eval_thin(&self, wi: Vec3) -> (Vec3, f32) {
        let wi = wi.with_z(-wi.z);
        let h = (self.wo + wi).normalize();
        let rest = self.fresnel(self.wo.dot(h).min(1.0)).1;
        let visible = ggx::d(self.alpha, h) * ggx::g1(self.alpha, self.wo.z) / (4.0 * self.wo.z);
        (self.transmitted * (rest * visible * ggx::g1(self.alpha, wi.z)), self.choose[2] * visible)
    }

    /// Refraction of radiance (Walter et al. 2007).
    fn eval_refraction(&self, wi: Vec3) -> (Vec3, f32) {
        let h = (self.wo + wi * self.eta).normalize_or_zero();
        let h = if h.z < 0.0 { -h } else { h };
        let (cos_o, cos_i) = (self.wo.dot(h), wi.dot(h));
        if cos_o <= 0.0 || cos_i >= 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let rest = self.fresnel(cos_o.min(1.0)).1;
        let scale = cos_i + cos_o / self.eta;
        let visible = ggx::d(self.alpha, h) * ggx::g1(self.alpha, self.wo.z) * cos_o / self.wo.z;
        let density = visible * -cos_i / (scale * scale);
        let f = self.transmitted * (rest * density * ggx::g1(self.alpha, -wi.z) / (self.eta * self.eta));
        (f, self.choose[2] * density)
    }

    /// Samples a lobe by `lobe` and a direction in it by `u`. `None` if nothing is scattered.
    pub fn sample(&self, lobe: f32, u: [f32; 2]) -> Option<Scatter> {
        let [diffuse, reflection, transmission] = self.choose;
        if lobe < diffuse {
            return self.scattered(sample_cosine(u));
        }
        if reflection + transmission <= 0.0 {
            return None;
        }
        let reflect = lobe < diffuse + reflection || transmission <= 0.0;
        let h = if self.alpha < SMOOTH { Vec3::Z } else { ggx::sample_visible(self.alpha, self.wo, u) };
        let cos = self.wo.dot(h).clamp(0.0, 1.0);
        let mirrored = h * (2.0 * cos) - self.wo;
        let wi = match (reflect, self.volume) {
            (true, _) => mirrored,
            (false, false) => mirrored.with_z(-mirrored.z),
            (false, true) => self.refract(h, cos)?,
        };
        if reflect != (wi.z > 0.0) || wi.z == 0.0 {
            return None;
        }
        if self.alpha >= SMOOTH {
            return self.scattered(wi);
        }
        let (reflected, rest) = self.fresnel(cos);
        let compression = if reflect { 1.0 } else { 1.0 / (self.eta * self.eta) };
        let weight =
            if reflect { reflected / reflection } else { self.transmitted * (rest * compression / transmission) };
        let direction = self.frame * wi;
        self.is_consistent(direction).then_some(Scatter { direction, weight, density: 0.0, mirror: true, compression })
    }

    fn refract(&self, h: Vec3, cos: f32) -> Option<Vec3> {
        let sin2 = (1.0 - cos * cos) / (self.eta * self.eta);
        (sin2 < 1.0).then(|| h * (cos / self.eta - (1.0 - sin2).sqrt()) - self.wo / self.eta)
    }

    fn scattered(&self, wi: Vec3) -> Option<Scatter> {
        let direction = (self.frame * wi).normalize();
        let (f, density) = self.eval(direction);
        let compression = if wi.z < 0.0 && self.volume { 1.0 / (self.eta * self.eta) } else { 1.0 };
        (density > 0.0).then(|| Scatter { direction, weight: f / density, density, mirror: false, compression })
    }
}
