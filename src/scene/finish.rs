//! Optional parts of a material, one for each of six extensions; few materials have any. Names are those of the
//! specifications.

use glam::{Affine2, Vec2, Vec3, Vec4};

use super::surface::{ROUGHNESS_MIN, normal_map};
use super::texture::ColorSpace;
use super::{Material, TextureRef};

/// The least roughness of sheen: below it all of the lobe lies within 5° of grazing.
#[cfg_attr(not(internals), doc(hidden))]
pub const SHEEN_ROUGHNESS_MIN: f32 = 0.07;

/// The optional parts of a material, one per extension; the default of each has no effect.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Finish {
    pub clearcoat: Clearcoat,
    pub sheen: Sheen,
    pub anisotropy: Anisotropy,
    pub iridescence: Iridescence,
    pub diffuse_transmission: DiffuseTransmission,
    /// KHR_materials_dispersion: 20 over the Abbe number; 0 refracts all colours equally.
    pub dispersion: f32,
}

/// KHR_materials_clearcoat: a thin transparent layer of index 1.5 over everything else.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Clearcoat {
    /// The covered share, 0 to 1.
    pub factor: f32,
    /// Linear: R.
    pub texture: Option<TextureRef>,
    /// Perceptual, 0 to 1.
    pub roughness: f32,
    /// Linear: G.
    pub roughness_texture: Option<TextureRef>,
    pub normal_texture: Option<TextureRef>,
    pub normal_scale: f32,
}

/// KHR_materials_sheen: fibres that stand up from the surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sheen {
    /// Linear, 0 to 1; black is no sheen.
    pub color: Vec3,
    /// sRGB.
    pub color_texture: Option<TextureRef>,
    /// Perceptual, 0 to 1.
    pub roughness: f32,
    /// Linear: A.
    pub roughness_texture: Option<TextureRef>,
}

/// KHR_materials_anisotropy: highlights are longer along one direction.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Anisotropy {
    /// 0 to 1.
    pub strength: f32,
    /// Radians, counter-clockwise from the tangent.
    pub rotation: f32,
    /// Linear: RG direction in tangent space, B strength.
    pub texture: Option<TextureRef>,
}

/// KHR_materials_iridescence: a film whose two reflections interfere.
#[derive(Clone, Debug, PartialEq)]
pub struct Iridescence {
    /// 0 to 1.
    pub factor: f32,
    /// Linear: R.
    pub texture: Option<TextureRef>,
    /// Index of refraction of the film, at least 1.
    pub ior: f32,
    /// Nanometres where the texture is 0, and where it is 1; without a texture the second.
    pub thickness_nm: [f32; 2],
    /// Linear: G.
    pub thickness_texture: Option<TextureRef>,
}

impl Default for Iridescence {
    fn default() -> Self {
        Self { factor: 0.0, texture: None, ior: 1.3, thickness_nm: [100.0, 400.0], thickness_texture: None }
    }
}

/// KHR_materials_diffuse_transmission: light is scattered to the far side.
#[derive(Clone, Debug, PartialEq)]
pub struct DiffuseTransmission {
    /// Share of the diffuse part that goes to the far side, 0 to 1.
    pub factor: f32,
    /// Linear: A.
    pub texture: Option<TextureRef>,
    /// Linear.
    pub color: Vec3,
    /// sRGB.
    pub color_texture: Option<TextureRef>,
}

impl Default for DiffuseTransmission {
    fn default() -> Self {
        Self { factor: 0.0, texture: None, color: Vec3::ONE, color_texture: None }
    }
}

#[cfg_attr(not(internals), doc(hidden))]
impl Finish {
    /// All texture slots in the renderer's fixed order, with the colour space of each. The path tracer reads them at
    /// every hit.
    pub fn slots(&self) -> [(Option<TextureRef>, ColorSpace); 10] {
        use ColorSpace::{Linear, Srgb};
        [
            (self.clearcoat.texture, Linear),
            (self.clearcoat.roughness_texture, Linear),
            (self.clearcoat.normal_texture, Linear),
            (self.sheen.color_texture, Srgb),
            (self.sheen.roughness_texture, Linear),
            (self.anisotropy.texture, Linear),
            (self.iridescence.texture, Linear),
            (self.iridescence.thickness_texture, Linear),
            (self.diffuse_transmission.texture, Linear),
            (self.diffuse_transmission.color_texture, Srgb),
        ]
    }

    /// The slots of [`Self::slots`] in the same order, as mutable references.
    pub fn slots_mut(&mut self) -> [&mut Option<TextureRef>; 10] {
        [
            &mut self.clearcoat.texture,
            &mut self.clearcoat.roughness_texture,
            &mut self.clearcoat.normal_texture,
            &mut self.sheen.color_texture,
            &mut self.sheen.roughness_texture,
            &mut self.anisotropy.texture,
            &mut self.iridescence.texture,
            &mut self.iridescence.thickness_texture,
            &mut self.diffuse_transmission.texture,
            &mut self.diffuse_transmission.color_texture,
        ]
    }

    /// The parameters at a point; `sample` reads a texture there, and returns white without one.
    #[cold]
    pub fn evaluate(&self, sample: impl Fn(&Option<TextureRef>, ColorSpace) -> Vec4) -> FinishParams {
        use ColorSpace::{Linear, Srgb};
        let Self { clearcoat, sheen, anisotropy, iridescence, diffuse_transmission: diffuse, dispersion } = self;
        let clearcoat_roughness = clearcoat.roughness * sample(&clearcoat.roughness_texture, Linear).y;
        let bump = clearcoat.normal_texture.map(|_| sample(&clearcoat.normal_texture, Linear));
        let grain = sample(&anisotropy.texture, Linear);
        let [thin, thick] = iridescence.thickness_nm;
        let film_nm = thin + (thick - thin) * sample(&iridescence.thickness_texture, Linear).y;
        let film = if film_nm > 0.0 { iridescence.factor * sample(&iridescence.texture, Linear).x } else { 0.0 };
        FinishParams {
            clearcoat: clearcoat.factor * sample(&clearcoat.texture, Linear).x,
            clearcoat_roughness: clearcoat_roughness.max(ROUGHNESS_MIN),
            clearcoat_normal_tangent: bump.map_or(Vec3::Z, |texel| normal_map(texel, clearcoat.normal_scale)),
            sheen_color: sheen.color * sample(&sheen.color_texture, Srgb).truncate(),
            sheen_roughness: (sheen.roughness * sample(&sheen.roughness_texture, Linear).w).max(SHEEN_ROUGHNESS_MIN),
            anisotropy: anisotropy.strength * grain.z,
            anisotropy_direction: anisotropy.direction(Vec2::new(grain.x, grain.y)),
            iridescence: film,
            film_ior: iridescence.ior,
            film_nm,
            diffuse_transmission: diffuse.factor * sample(&diffuse.texture, Linear).w,
            diffuse_transmission_color: diffuse.color * sample(&diffuse.color_texture, Srgb).truncate(),
            dispersion: *dispersion,
        }
    }
}

/// A [`Finish`] at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(not(internals), doc(hidden))]
pub struct FinishParams {
    pub clearcoat: f32,
    /// Perceptual; GGX's α is its square. At least `ROUGHNESS_MIN`.
    pub clearcoat_roughness: f32,
    /// The coat's own normal map, unit, in the tangent frame; (0, 0, 1) without one.
    pub clearcoat_normal_tangent: Vec3,
    pub sheen_color: Vec3,
    /// Perceptual; the distribution's α is its square. At least [`SHEEN_ROUGHNESS_MIN`].
    pub sheen_roughness: f32,
    /// Strength, 0 to 1: see [`FinishParams::stretched`].
    pub anisotropy: f32,
    /// Unit, in the tangent frame: the direction of the larger roughness.
    pub anisotropy_direction: Vec2,
    /// 0 without a film.
    pub iridescence: f32,
    pub film_ior: f32,
    pub film_nm: f32,
    /// Share of the diffuse part that goes to the far side.
    pub diffuse_transmission: f32,
    pub diffuse_transmission_color: Vec3,
    pub dispersion: f32,
}

impl FinishParams {
    /// GGX's α along [`FinishParams::anisotropy_direction`], of a material with `alpha` across it.
    pub fn stretched(&self, alpha: f32) -> f32 {
        alpha + (1.0 - alpha) * self.anisotropy * self.anisotropy
    }
}

/// KHR_materials_dispersion: the index of refraction of red (0), green or blue (2) light, at least 1. `ior` is green's.
#[cfg_attr(not(internals), doc(hidden))]
pub fn dispersed(ior: f32, dispersion: f32, channel: usize) -> f32 {
    // Half the difference between the indices of red and blue, (ior − 1) / V / 2, with Abbe's number V = 20 /
    // dispersion.
    let half_spread = (ior - 1.0) * 0.025 * dispersion;
    (ior + half_spread * (channel as f32 - 1.0)).max(1.0)
}

impl Anisotropy {
    /// Unit, in tangent space: where highlights are longest, at a texel's red and green.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn direction(&self, texel: Vec2) -> Vec2 {
        let own = if self.texture.is_some() { 2.0 * texel - 1.0 } else { Vec2::X };
        Vec2::from_angle(self.rotation).rotate(own.normalize_or(Vec2::X))
    }
}

impl Material {
    /// The uv set, with its transform, that determines the generated tangents of a mesh; `None` if no texture needs
    /// tangents.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn tangent_uvs(&self) -> Option<(usize, Affine2)> {
        let finish = self.finish.as_deref();
        let of_anisotropy = finish.and_then(|f| f.anisotropy.texture);
        let of_clearcoat = finish.and_then(|f| f.clearcoat.normal_texture);
        if let Some(slot) = self.normal_texture.or(of_anisotropy).or(of_clearcoat) {
            return Some((slot.uv_set, slot.transform));
        }
        // KHR_materials_anisotropy does not say which uv set counts if no texture has one.
        finish.filter(|f| f.anisotropy.strength > 0.0).map(|_| (0, Affine2::IDENTITY))
    }
}
