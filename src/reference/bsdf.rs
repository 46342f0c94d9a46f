//! The BSDF of glTF 2.0 (appendix B, with KHR_materials_specular, _ior, _transmission, _volume, _anisotropy,
//! _iridescence and _diffuse_transmission): evaluation, sampling, density. [`super::layers`] adds coat and sheen.
//!
//! Four lobes: diffuse ρ/π, GGX reflection, GGX transmission (unrefracted through thin walls, refracted at volumes),
//! diffuse to the far side. Below [`SMOOTH`] the GGX lobes are mirrors. Smooth thin transmission is not a lobe: paths
//! and shadow rays pass it, see [`Bsdf::unscattered`].

use glam::{Mat3, Vec3};
use std::f32::consts::{FRAC_1_PI, TAU};

use super::layers::{Choice, Layers};
use super::microfacet::{Ggx, schlick};
use super::thin_film::ThinFilm;
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
        self.f0 + (Vec3::splat(self.f90) - self.f0) * schlick(cos)
    }
}

/// KHR_materials_iridescence: a film over a dielectric, and over a metal of colour `metal`.
#[derive(Clone, Copy, Debug)]
struct Film {
    share: f32,
    film: ThinFilm,
    metal: Vec3,
    metallic: f32,
}

/// The BSDF at one point, for one viewing direction.
#[derive(Clone, Debug)]
pub struct Bsdf {
    /// World from local: columns tangent, bitangent, normal.
    frame: Mat3,
    /// The triangle's normal on the viewer's side.
    pub geometric: Vec3,
    /// Towards the viewer, local; z > 0.
    wo: Vec3,
    /// α of the GGX lobes; its x axis is the first column of `frame`.
    alpha: Ggx,
    /// Whether the GGX lobes are mirrors.
    smooth: bool,
    reflected: Reflectance,
    /// Reflectance of the dielectric alone. The rest of the light reaches the diffuse and transmission lobes.
    dielectric: Reflectance,
    film: Option<Film>,
    /// Albedo of the diffuse, the transmission and the diffuse transmission lobe, before Fresnel.
    diffuse: Vec3,
    transmitted: Vec3,
    diffused: Vec3,
    volume: bool,
    /// Index of refraction on the far side over that on the viewer's side.
    eta: f32,
    /// Sampling probabilities of diffuse, reflection, transmission, diffuse transmission.
    choose: [f32; 4],
    /// Coat and sheen, boxed because most surfaces have none.
    layers: Option<Box<Layers>>,
}

/// The side from which a BSDF is seen. All vectors but `grain` are unit; all normals have a positive dot product with
/// `wo`.
#[derive(Clone, Copy, Debug)]
pub struct Viewing {
    pub normal: Vec3,
    /// The normal of the clearcoat.
    pub coat_normal: Vec3,
    pub geometric: Vec3,
    /// The direction of the larger roughness of an anisotropic surface.
    pub grain: Vec3,
    /// The direction to the viewer.
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

/// Whether a direction is on the same side of the triangle and of the plane of a shading normal; else light would leak.
#[inline]
pub fn is_consistent(geometric: Vec3, normal: Vec3, wi: Vec3) -> bool {
    (geometric.dot(wi) > 0.0) == (normal.dot(wi) > 0.0)
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
        let Viewing { normal, geometric, wo, inside, .. } = viewing;
        let finish = p.finish.as_ref();
        let stretched = finish.filter(|f| f.anisotropy > 0.0);
        let along = stretched.and_then(|_| (viewing.grain - normal * normal.dot(viewing.grain)).try_normalize());
        let frame = along.map_or_else(|| frame(normal), |x| Mat3::from_cols(x, normal.cross(x), normal));
        let across = p.roughness * p.roughness;
        let alpha = Ggx { x: stretched.map_or(across, |f| f.stretched(across)), y: across };
        let nonmetal = 1.0 - p.metallic;
        let dielectric = if nonmetal > 0.0 {
            let f0 = (p.f0 - p.base_color * p.metallic) / nonmetal;
            Reflectance { f0: f0.clamp(Vec3::ZERO, Vec3::ONE), f90: ((p.f90 - p.metallic) / nonmetal).clamp(0.0, 1.0) }
        } else {
            Reflectance { f0: Vec3::ZERO, f90: 0.0 }
        };
        let transmitted = p.base_color * p.transmission;
        let mut diffuse = p.diffuse - transmitted;
        let mut diffused = Vec3::ZERO;
        if let Some(f) = finish.filter(|f| f.diffuse_transmission > 0.0) {
            diffuse *= 1.0 - f.diffuse_transmission;
            diffused = f.diffuse_transmission_color * (f.diffuse_transmission * (1.0 - p.metallic - p.transmission));
        }
        let film = finish.filter(|f| f.iridescence > 0.0).map(|f| Film {
            share: f.iridescence,
            film: ThinFilm { ior: f.film_ior, thickness_nm: f.film_nm },
            metal: p.base_color,
            metallic: p.metallic,
        });
        let mut bsdf = Self {
            frame,
            geometric,
            wo: (frame.transpose() * wo).with_z(normal.dot(wo).max(1e-6)),
            alpha,
            smooth: alpha.x < SMOOTH,
            reflected: Reflectance { f0: p.f0, f90: p.f90 },
            dielectric,
            film,
            diffuse,
            transmitted,
            diffused,
            volume,
            eta: if inside { 1.0 / p.ior } else { p.ior },
            choose: [0.0; 4],
            layers: None,
        };
        let (reflected, rest) = bsdf.fresnel(bsdf.wo.z);
        let transmission = if bsdf.volume || !bsdf.smooth { bsdf.transmitted.max_element() * rest } else { 0.0 };
        let mut lobes = [
            bsdf.diffuse.max_element() * rest,
            reflected.max_element(),
            transmission,
            bsdf.diffused.max_element() * rest,
        ];
        let albedo: f32 = lobes.iter().sum();
        if !bsdf.smooth && (p.f90 > 0.0 || volume) {
            // Microfacets of a rough surface may reflect or transmit in directions in which a smooth surface would not.
            lobes[1] = lobes[1].max(0.05);
            lobes[2] = lobes[2].max(if volume { 0.1 * bsdf.transmitted.max_element() } else { 0.0 });
        }
        let total: f32 = lobes.iter().sum();
        if total > 0.0 {
            bsdf.choose = lobes.map(|l| l / total);
        }
        // Both layers lie on the outside of a volume.
        bsdf.layers =
            finish.filter(|_| !(volume && inside)).and_then(|f| Layers::new(f, &viewing, albedo).map(Box::new));
        bsdf
    }

    /// The shading normal, on the viewer's side.
    pub fn normal(&self) -> Vec3 {
        self.frame.z_axis
    }

    /// At the cosine to the half vector: the reflectance, and the share of light that remains for the other lobes.
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
        match &self.film {
            None => (self.reflected.at(cos_outside), 1.0 - self.dielectric.at(cos_outside).max_element()),
            Some(film) => self.film_fresnel(film, cos_outside),
        }
    }

    /// [`Self::fresnel`] under a film.
    #[cold]
    fn film_fresnel(&self, film: &Film, cos: f32) -> (Vec3, f32) {
        let under = |plain: Reflectance| plain.at(cos).lerp(film.film.reflectance(cos, plain.f0), film.share);
        let dielectric = under(self.dielectric);
        let metal = if film.metallic > 0.0 { under(Reflectance { f0: film.metal, f90: 1.0 }) } else { Vec3::ZERO };
        (dielectric.lerp(metal, film.metallic), 1.0 - dielectric.max_element())
    }

    /// Whether light from the far side is scattered to the viewer.
    pub fn transmits(&self) -> bool {
        self.choose[2] > 0.0 || self.choose[3] > 0.0
    }

    /// The share of light that passes a smooth thin wall unscattered.
    pub fn unscattered(&self) -> Vec3 {
        if self.volume || !self.smooth || self.transmitted == Vec3::ZERO {
            return Vec3::ZERO;
        }
        let through = self.transmitted * self.fresnel(self.wo.z).1;
        self.layers.as_ref().map_or(through, |layers| through * layers.leave_straight())
    }

    /// f · |cos| and the density of [`Self::sample`] without mirrors, for unit `wi` (world space, away from the
    /// surface).
    #[inline]
    pub fn eval(&self, wi: Vec3) -> (Vec3, f32) {
        let base = self.eval_base(wi);
        self.layers.as_ref().map_or(base, |layers| layers.eval(wi, base.0, base.1))
    }

    #[inline]
    fn eval_base(&self, wi: Vec3) -> (Vec3, f32) {
        if !is_consistent(self.geometric, self.normal(), wi) {
            return (Vec3::ZERO, 0.0);
        }
        let wi = self.frame.transpose() * wi;
        if wi.z > 0.0 {
            self.eval_reflection(wi)
        } else if wi.z < 0.0 && self.transmits() {
            self.eval_transmission(wi)
        } else {
            (Vec3::ZERO, 0.0)
        }
    }

    fn eval_transmission(&self, wi: Vec3) -> (Vec3, f32) {
        let (mut f, mut density) = if self.choose[2] == 0.0 || self.smooth {
            (Vec3::ZERO, 0.0)
        } else if self.volume {
            self.eval_refraction(wi)
        } else {
            self.eval_thin(wi)
        };
        if self.choose[3] > 0.0 {
            // The Fresnel share is that of the light's mirror image, because the specification does not define one.
            let wi = wi.with_z(-wi.z);
            let h = (self.wo + wi).normalize();
            let cosine = FRAC_1_PI * wi.z;
            f += self.diffused * (self.fresnel(self.wo.dot(h).min(1.0)).1 * cosine);
            density += self.choose[3] * cosine;
        }
        (f, density)
    }

    /// Whether only the diffuse lobe is present, which does not depend on the viewing direction.
    #[inline]
    pub fn is_lambertian(&self) -> bool {
        self.reflected.f90 == 0.0 && self.choose[0] == 1.0 && self.layers.is_none()
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
        if !self.smooth {
            let visible = self.alpha.visible(h, self.wo);
            f += reflected * (visible * self.alpha.g1(wi));
            density += self.choose[1] * visible;
        }
        (f, density)
    }

    /// A rough thin wall: the reflection lobe, mirrored to the far side.
    fn eval_thin(&self, wi: Vec3) -> (Vec3, f32) {
        let wi = wi.with_z(-wi.z);
        let h = (self.wo + wi).normalize();
        let rest = self.fresnel(self.wo.dot(h).min(1.0)).1;
        let visible = self.alpha.visible(h, self.wo);
        (self.transmitted * (rest * visible * self.alpha.g1(wi)), self.choose[2] * visible)
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
        let visible = self.alpha.d(h) * self.alpha.g1(self.wo) * cos_o / self.wo.z;
        let density = visible * -cos_i / (scale * scale);
        let f = self.transmitted * (rest * density * self.alpha.g1(-wi) / (self.eta * self.eta));
        (f, self.choose[2] * density)
    }

    /// Samples a lobe by `lobe` and a direction in it by `u`. `None` if nothing is scattered.
    pub fn sample(&self, lobe: f32, u: [f32; 2]) -> Option<Scatter> {
        let Some(layers) = &self.layers else { return self.sample_base(lobe, u) };
        match layers.sample(lobe, u) {
            Choice::Nothing => None,
            Choice::Mirror(scatter) => Some(scatter),
            Choice::Direction(direction) => self.weighted(direction, 1.0),
            Choice::Base(lobe) => {
                let scatter = self.sample_base(lobe, u)?;
                Some(if scatter.mirror { layers.over_mirror(scatter) } else { scatter })
            }
        }
    }

    fn sample_base(&self, lobe: f32, u: [f32; 2]) -> Option<Scatter> {
        let [diffuse, reflection, transmission, diffusion] = self.choose;
        if lobe < diffuse {
            return self.scattered(sample_cosine(u), 1.0);
        }
        if diffusion > 0.0 && lobe >= 1.0 - diffusion {
            return self.scattered(-sample_cosine(u), 1.0);
        }
        if reflection + transmission <= 0.0 {
            return None;
        }
        let reflect = lobe < diffuse + reflection || transmission <= 0.0;
        let h = if self.smooth { Vec3::Z } else { self.alpha.sample_visible(self.wo, u) };
        let cos = self.wo.dot(h).clamp(0.0, 1.0);
        let mirrored = h * (2.0 * cos) - self.wo;
        let wi = match (reflect, self.volume) {
            (true, _) => mirrored,
            (false, false) => mirrored.with_z(-mirrored.z),
            (false, true) => {
                let sin2 = (1.0 - cos * cos) / (self.eta * self.eta);
                (sin2 < 1.0).then(|| h * (cos / self.eta - (1.0 - sin2).sqrt()) - self.wo / self.eta)?
            }
        };
        if reflect != (wi.z > 0.0) || wi.z == 0.0 {
            return None;
        }
        let compression = if reflect || !self.volume { 1.0 } else { 1.0 / (self.eta * self.eta) };
        if !self.smooth {
            return self.scattered(wi, compression);
        }
        let (reflected, rest) = self.fresnel(cos);
        let weight =
            if reflect { reflected / reflection } else { self.transmitted * (rest * compression / transmission) };
        let direction = self.frame * wi;
        is_consistent(self.geometric, self.normal(), direction).then_some(Scatter {
            direction,
            weight,
            density: 0.0,
            mirror: true,
            compression,
        })
    }

    fn scattered(&self, wi: Vec3, compression: f32) -> Option<Scatter> {
        self.weighted((self.frame * wi).normalize(), compression)
    }

    /// A direction in world space that some lobe with a density has sampled.
    fn weighted(&self, direction: Vec3, compression: f32) -> Option<Scatter> {
        let (f, density) = self.eval(direction);
        (density > 0.0).then(|| Scatter { direction, weight: f / density, density, mirror: false, compression })
    }
}
