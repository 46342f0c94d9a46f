//! Surface evaluation for the renderer and the reference: visible sides, material parameters, normals, and falloff of
//! lights.
//!
//! Formulas: glTF 2.0 appendix B and the KHR_materials extensions.

use glam::{DAffine3, DMat3, Vec2, Vec3, Vec4};

use super::finish::FinishParams;
use super::texture::{ColorSpace, Sampling};
use super::{Alpha, Material, Scene};

/// The minimum roughness, practically a mirror: α = 10⁻⁴ keeps the peak of GGX within f32.
pub(super) const ROUGHNESS_MIN: f32 = 0.01;

/// Interpolated attributes at a point of a surface, and the filter footprint there.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    pub uvs: [Vec2; 2],
    /// The vertex colour.
    pub color: Vec4,
    /// Side of the square over which textures are filtered, in the units of each uv set; 0 for a point.
    pub footprint: [f32; 2],
}

/// A material at a point. Colours are linear Rec. 709.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceParams {
    /// Factor × texture × vertex colour.
    pub base_color: Vec3,
    /// 0 to 1: see [`Alpha::opacity`].
    pub opacity: f32,
    pub metallic: f32,
    /// Perceptual; GGX's α is its square. At least `ROUGHNESS_MIN`.
    pub roughness: f32,
    /// Radiance on the front, and on the back of double-sided materials.
    pub emissive: Vec3,
    /// Albedo of the diffuse part before Fresnel: base colour × (1 − metallic). Includes the share that is transmitted
    /// instead.
    pub diffuse: Vec3,
    /// Reflectance at normal incidence: min(((ior−1)/(ior+1))² · specular colour, 1) · specular, mixed with the base
    /// colour by metallic.
    pub f0: Vec3,
    /// Reflectance at grazing angles: specular, mixed with 1 by metallic.
    pub f90: f32,
    /// Share of the diffuse part that is transmitted instead: transmission × (1 − metallic).
    pub transmission: f32,
    /// For refraction, at least 1. The material's special value 0, "reflects everything", becomes 1.
    pub ior: f32,
    /// Absorption coefficient per metre: see [`SurfaceParams::transmittance`].
    pub absorption: Vec3,
    /// The normal map's normal, unit, in the tangent frame; (0, 0, 1) without a map.
    pub normal_tangent: Vec3,
    pub unlit: bool,
    /// `None` for most materials.
    pub finish: Option<FinishParams>,
}

#[cfg_attr(not(internals), doc(hidden))]
impl Material {
    /// Whether rays may pass through triangles of the material.
    pub fn lets_rays_pass(&self) -> bool {
        self.alpha != Alpha::Opaque || self.transmission > 0.0
    }

    /// The material at `point`.
    #[inline]
    pub fn evaluate(&self, scene: &Scene, textures: &impl Sampling, point: &SurfacePoint) -> SurfaceParams {
        let sample = |slot: &Option<_>, space| textures.sample(scene, slot.as_ref(), space, point);
        let base = self.base_color * sample(&self.base_color_texture, ColorSpace::Srgb) * point.color;
        let metallic_roughness = sample(&self.metallic_roughness_texture, ColorSpace::Linear);
        let metallic = self.metallic * metallic_roughness.z;
        let specular = self.specular * sample(&self.specular_texture, ColorSpace::Linear).w;
        let specular_color = self.specular_color * sample(&self.specular_color_texture, ColorSpace::Srgb).truncate();
        let transmission = self.transmission * sample(&self.transmission_texture, ColorSpace::Linear).x;
        // KHR_materials_ior: reflectance at normal incidence from air. Index 0 gives 1, which reflects everything.
        let from_air = ((self.ior - 1.0) / (self.ior + 1.0)).powi(2);
        let dielectric_f0 = (from_air * specular_color).min(Vec3::ONE) * specular;
        // KHR_materials_volume. A black channel gets a large finite value.
        let absorption = match self.attenuation_distance {
            f32::INFINITY => Vec3::ZERO,
            distance => -self.attenuation_color.max(Vec3::splat(1e-10)).map(f32::ln) / distance,
        };
        SurfaceParams {
            base_color: base.truncate(),
            opacity: self.alpha.opacity(base.w),
            metallic,
            roughness: (self.roughness * metallic_roughness.y).max(ROUGHNESS_MIN),
            emissive: self.emissive * sample(&self.emissive_texture, ColorSpace::Srgb).truncate(),
            diffuse: base.truncate() * (1.0 - metallic),
            f0: dielectric_f0.lerp(base.truncate(), metallic),
            f90: specular + (1.0 - specular) * metallic,
            transmission: transmission * (1.0 - metallic),
            ior: self.ior.max(1.0),
            absorption,
            normal_tangent: match self.normal_texture {
                None => Vec3::Z,
                Some(_) => normal_map(sample(&self.normal_texture, ColorSpace::Linear), self.normal_scale),
            },
            unlit: self.unlit,
            finish: self.finish.as_ref().map(|finish| finish.evaluate(sample)),
        }
    }

    /// The [`SurfaceParams::opacity`] alone, for rays that may pass the surface.
    pub fn opacity(&self, scene: &Scene, textures: &impl Sampling, point: &SurfacePoint) -> f32 {
        if self.alpha == Alpha::Opaque {
            return 1.0;
        }
        let slot = self.base_color_texture.as_ref();
        let texel = textures.sample(scene, slot, ColorSpace::Srgb, point);
        self.alpha.opacity(self.base_color.w * texel.w * point.color.w)
    }

    /// Whether this side of a triangle is visible, is lit and emits. The other side still blocks light.
    pub fn shows(&self, front: bool) -> bool {
        front || self.double_sided
    }
}

/// glTF 2.0, 3.9.3: maps the texel to [−1, 1], scales x and y, normalises.
pub(super) fn normal_map(texel: Vec4, scale: f32) -> Vec3 {
    let normal = (2.0 * texel.truncate() - 1.0) * Vec3::new(scale, scale, 1.0);
    normal.try_normalize().unwrap_or(Vec3::Z)
}

impl Alpha {
    /// The share of light from behind that is blocked, for the product `alpha` of factor, texture and vertex colour.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn opacity(self, alpha: f32) -> f32 {
        match self {
            Self::Opaque => 1.0,
            Self::Mask(cutoff) if alpha >= cutoff => 1.0,
            Self::Mask(_) => 0.0,
            Self::Blend => alpha,
        }
    }
}

impl SurfaceParams {
    /// Share of the surface that is neither metallic nor transmitting, 0 to 1; 0 if unlit.
    pub fn diffuse_share(&self) -> f32 {
        if self.unlit { 0.0 } else { 1.0 - self.metallic - self.transmission }
    }

    /// Transmittance of `distance` metres inside the volume (Beer's law).
    pub fn transmittance(&self, distance: f32) -> Vec3 {
        (-self.absorption * distance).exp()
    }
}

/// The matrix that transforms normals: the inverse transpose times the determinant, which exists for singular matrices
/// too.
pub fn cofactor(linear: DMat3) -> DMat3 {
    let [x, y, z] = [linear.x_axis, linear.y_axis, linear.z_axis];
    DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y))
}

/// Transforms an instance's normals and tangents to world space. Normals of mirrored instances (negative determinant)
/// still point outward; the winding and the sign of the tangents are reversed.
#[derive(Clone, Copy, Debug)]
pub struct WorldFrame {
    linear: DMat3,
    /// [`cofactor`], so that normals of mirrored instances point outward too.
    normal: DMat3,
    /// −1 for a mirrored instance, else 1.
    pub winding: f32,
}

impl WorldFrame {
    pub fn new(world_from_object: &DAffine3) -> Self {
        let linear = world_from_object.matrix3;
        let winding = if linear.determinant() < 0.0 { -1.0 } else { 1.0 };
        Self { linear, normal: cofactor(linear) * winding, winding: winding as f32 }
    }

    /// A unit normal in world space.
    #[inline]
    pub fn normal(&self, normal: Vec3) -> Vec3 {
        (self.normal * normal.as_dvec3()).try_normalize().map_or(normal, |n| n.as_vec3())
    }

    /// A unit tangent in world space; the bitangent is cross(normal, tangent) · w.
    #[inline]
    pub fn tangent(&self, tangent: Vec4) -> Vec4 {
        let direction = (self.linear * tangent.truncate().as_dvec3()).try_normalize();
        direction.map_or(tangent.truncate(), |t| t.as_vec3()).extend(tangent.w * self.winding)
    }
}

/// The front side's normal with the normal map's `normal_tangent`, in the space of the interpolated unit `normal` and
/// `tangent`. For the back it must be negated.
#[inline]
pub fn shading_normal(normal: Vec3, tangent: Vec4, normal_tangent: Vec3) -> Vec3 {
    let bitangent = normal.cross(tangent.truncate()) * tangent.w;
    let mapped = tangent.truncate() * normal_tangent.x + bitangent * normal_tangent.y + normal * normal_tangent.z;
    mapped.try_normalize().unwrap_or(normal)
}

/// KHR_lights_punctual: the window that limits a light to its `range`; 1 for an infinite range.
pub fn range_window(distance: f32, range: f32) -> f32 {
    if range.is_infinite() { 1.0 } else { (1.0 - (distance / range).powi(4)).clamp(0.0, 1.0) }
}

/// KHR_lights_punctual: the spot's falloff at the cosine between its axis and the direction to the point.
pub fn spot_falloff(cos: f32, inner: f32, outer: f32) -> f32 {
    let (cos_inner, cos_outer) = (inner.cos(), outer.cos());
    let scale = 1.0 / (cos_inner - cos_outer).max(1e-3);
    let falloff = ((cos - cos_outer) * scale).clamp(0.0, 1.0);
    falloff * falloff
}
