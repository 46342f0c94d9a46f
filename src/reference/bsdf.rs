//! The glTF 2.0 material model (appendix B, with KHR_materials_specular, _ior, _transmission and _volume) as a path tracer
//! needs it: evaluate, sample, density.
//!
//! Three lobes: diffuse ρ/π, GGX reflection, GGX transmission (straight through thin walls, refracted where there is a
//! volume). Below [`SMOOTH`] the GGX lobes are mirrors; smooth thin transmission is not a lobe at all but
//! [`Bsdf::straight`], which paths and shadow rays pass without a bounce.

use glam::{Mat3, Vec3};
use std::f32::consts::{FRAC_1_PI, TAU};

use super::microfacet as ggx;
use crate::scene::surface::SurfaceParams;

/// α = roughness² below which a lobe is taken for a perfect mirror: ±0.06°.
pub const SMOOTH: f32 = 1e-3;

/// A direction chosen by [`Bsdf::sample`].
#[derive(Clone, Copy, Debug)]
pub struct Scatter {
    /// World space, unit.
    pub direction: Vec3,
    /// f · |cos| / density.
    pub weight: Vec3,
    /// Per steradian; for mirrors meaningless.
    pub density: f32,
    pub mirror: bool,
    /// Square of the ratio of refractive indices by which radiance was scaled; 1 for reflection.
    pub compression: f32,
}

/// Schlick's reflectance, from head on to grazing.
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

/// The scattering function at one point, for one viewing direction.
#[derive(Clone, Copy, Debug)]
pub struct Bsdf {
    /// Columns tangent, bitangent, normal: world from local.
    frame: Mat3,
    /// Towards the viewer, local; z > 0.
    wo: Vec3,
    alpha: f32,
    reflected: Reflectance,
    /// Reflectance of the dielectric alone: what it leaves reaches the diffuse and transmitted parts.
    coat: Reflectance,
    /// Colours before Fresnel.
    diffuse: Vec3,
    through: Vec3,
    volume: bool,
    /// Index of refraction beyond the surface over that on the viewer's side.
    eta: f32,
    /// Probabilities of choosing diffuse, reflection, transmission.
    choose: [f32; 3],
}

/// A tangent frame about unit `n` (Duff et al. 2017); its one singular direction is −z.
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

/// A direction about +z with density cos/π.
pub fn sample_cosine(u: [f32; 2]) -> Vec3 {
    let (sin, cos) = (TAU * u[0]).sin_cos();
    let r = u[1].sqrt();
    Vec3::new(r * cos, r * sin, (1.0 - u[1]).max(0.0).sqrt())
}

impl Bsdf {
    /// `normal` and `wo` (towards the viewer) are unit, with a positive dot product; `volume` says that transmission refracts,
    /// `inside` that the viewer is in the volume that the surface bounds.
    #[inline]
    pub fn new(p: &SurfaceParams, volume: bool, normal: Vec3, wo: Vec3, inside: bool) -> Self {
        let frame = frame(normal);
        let nonmetal = 1.0 - p.metallic;
        let coat = if nonmetal > 0.0 {
            let f0 = (p.f0 - p.base_color * p.metallic) / nonmetal;
            Reflectance { f0: f0.clamp(Vec3::ZERO, Vec3::ONE), f90: ((p.f90 - p.metallic) / nonmetal).clamp(0.0, 1.0) }
        } else {
            Reflectance { f0: Vec3::ZERO, f90: 0.0 }
        };
        let through = p.base_color * p.transmission;
        let mut bsdf = Self {
            frame,
            wo: (frame.transpose() * wo).with_z(normal.dot(wo).max(1e-6)),
            alpha: p.roughness * p.roughness,
            reflected: Reflectance { f0: p.f0, f90: p.f90 },
            coat,
            diffuse: p.diffuse - through,
            through,
            volume,
            eta: if inside { 1.0 / p.ior } else { p.ior },
            choose: [0.0; 3],
        };
        let (reflected, rest) = bsdf.fresnel(bsdf.wo.z);
        let through = if bsdf.volume || bsdf.alpha >= SMOOTH { bsdf.through.max_element() * rest } else { 0.0 };
        let mut lobes = [bsdf.diffuse.max_element() * rest, reflected.max_element(), through];
        if bsdf.alpha >= SMOOTH && (p.f90 > 0.0 || volume) {
            // A rough surface's microfacets may reflect or transmit where the plane itself would not.
            lobes[1] = lobes[1].max(0.05);
            lobes[2] = lobes[2].max(if volume { 0.1 * bsdf.through.max_element() } else { 0.0 });
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

    /// At the cosine between a direction and the half vector: the reflected share of light, and the share (one number) that
    /// is left for what lies below.
    #[inline]
    fn fresnel(&self, cos: f32) -> (Vec3, f32) {
        let mut cos_outside = cos;
        if self.volume && self.eta < 1.0 {
            // From the dense side Schlick's formula wants the angle on the other one.
            let sin2 = (1.0 - cos * cos) / (self.eta * self.eta);
            if sin2.is_nan() || sin2 >= 1.0 {
                return (Vec3::ONE, 0.0);
            }
            cos_outside = (1.0 - sin2).sqrt();
        }
        (self.reflected.at(cos_outside), 1.0 - self.coat.at(cos_outside).max_element())
    }

    /// Whether light from beyond the surface is scattered to the viewer.
    pub fn transmits(&self) -> bool {
        self.choose[2] > 0.0
    }

    /// The share of light that goes straight through a smooth thin wall.
    pub fn straight(&self) -> Vec3 {
        if self.volume || self.alpha >= SMOOTH { Vec3::ZERO } else { self.through * self.fresnel(self.wo.z).1 }
    }

    /// f · |cos| and the density of [`Self::sample`], mirrors left out, for unit `wi` (world, away from the surface).
    #[inline]
    pub fn eval(&self, wi: Vec3) -> (Vec3, f32) {
        let wi = self.frame.transpose() * wi;
        if wi.z > 0.0 {
            self.eval_reflection(wi)
        } else if wi.z < 0.0 && self.choose[2] > 0.0 && self.alpha >= SMOOTH {
            if self.volume { self.eval_refraction(wi) } else { self.eval_thin(wi) }
        } else {
            (Vec3::ZERO, 0.0)
        }
    }

    /// Whether this is Lambert's law alone, which looks the same from everywhere.
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

    /// A rough thin wall: the reflected lobe mirrored to the other side.
    fn eval_thin(&self, wi: Vec3) -> (Vec3, f32) {
        let wi = wi.with_z(-wi.z);
        let h = (self.wo + wi).normalize();
        let rest = self.fresnel(self.wo.dot(h).min(1.0)).1;
        let visible = ggx::d(self.alpha, h) * ggx::g1(self.alpha, self.wo.z) / (4.0 * self.wo.z);
        (self.through * (rest * visible * ggx::g1(self.alpha, wi.z)), self.choose[2] * visible)
    }

    /// Walter et al. 2007, for radiance.
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
        let f = self.through * (rest * density * ggx::g1(self.alpha, -wi.z) / (self.eta * self.eta));
        (f, self.choose[2] * density)
    }

    /// Chooses a direction: the lobe by `lobe`, the direction in it by `u`. `None` where nothing is scattered.
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
        let weight = if reflect { reflected / reflection } else { self.through * (rest * compression / transmission) };
        Some(Scatter { direction: self.frame * wi, weight, density: 0.0, mirror: true, compression })
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
