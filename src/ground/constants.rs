//! Specialisation constants of the ground, which `glsl/ground/constants.glsl` declares.

use glam::{Vec3, Vec4};

use super::cells::LIT_COUNTS;
use crate::scene::{Alpha, Scene};
use crate::settings::{DirectLight, Method, Settings};
use crate::vk::Constant;

/// Values of `DIRECT`: direct light is computed; computed and kept; or the kept light is read.
pub const DIRECT_FOUND: u32 = 0;
pub const DIRECT_KEPT: u32 = 1;
pub const DIRECT_READ: u32 = 2;
/// Values of `LIT`: each list item is lit, or one item for each group of a voxel's similar triangles.
pub const LIT_EACH: u32 = 0;
pub const LIT_GROUPED: u32 = 1;

/// The least roughness at which a metal reflects light as a lobe instead of as a mirror: the square root of
/// `LEAST_ITEM_ALPHA` in `glsl/gi/rays/item_lobes.glsl`.
const MIRROR_ROUGHNESS: f32 = 0.388;

/// Shader features that a scene and its settings need, as bits of the constant `FEATURES`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Features(pub u32);

impl Features {
    pub const ALPHA: Self = Self(2);
    pub const SPECULAR: Self = Self(4);
    pub const TRANSMISSION: Self = Self(8);
    pub const MASK: Self = Self(32);
    pub const BLEND: Self = Self(128);
    pub const DIRECT_PER_PIXEL: Self = Self(1 << 16);
    pub const SKY_GRADIENT: Self = Self(1 << 17);
    pub const SKY_MAP: Self = Self(1 << 18);

    /// Whether a texture uses the second set of uv.
    pub const SECOND_UV: Self = Self(1 << 19);
    /// Whether some vertex is not white.
    pub const COLORS: Self = Self(1 << 20);
    /// Whether any slot has a texture.
    pub const TEXTURES: Self = Self(0xff00);
    pub const CLEARCOAT: Self = Self(1 << 21);
    pub const SHEEN: Self = Self(1 << 22);
    pub const ANISOTROPY: Self = Self(1 << 23);
    pub const IRIDESCENCE: Self = Self(1 << 24);
    pub const DIFFUSE_TRANSMISSION: Self = Self(1 << 25);
    /// Whether one of these five has a texture.
    pub const FINISH_TEXTURES: Self = Self(1 << 26);
    /// Whether one of these reads tangents.
    pub const TANGENTS: Self = Self(1 << 27);
    /// Whether some material may be a smooth metal.
    pub const MIRRORS: Self = Self(1 << 28);
    /// Whether rays are traced by the device's ray queries.
    pub const QUERY: Self = Self(1 << 29);
    /// Pixels show transparency in place of the sky.
    pub const SKY_UNSEEN: Self = Self(64);
    /// Textures are sampled at points, and volumes attenuate light by its exact path length, as paths need it.
    pub const POINTS: Self = Self(1 << 30);
    /// Some material has dispersion: its refractive index depends on the colour.
    pub const DISPERSION: Self = Self(1 << 31);

    /// Whether some material has a texture in slot `slot` of `layout::Material::slots`.
    pub const fn texture_slot(slot: usize) -> Self {
        Self(256 << slot)
    }

    pub fn has(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    /// Features needed by the settings and by the materials in use. Other features cost nothing.
    pub fn of_settings(scene: &Scene, settings: &Settings) -> Self {
        Self::of_scene(scene)
            .and(Self::DIRECT_PER_PIXEL, settings.image.direct == DirectLight::Pixels)
            .and(Self::POINTS, settings.method == Method::Paths)
    }

    #[must_use]
    pub fn and(self, other: Self, when: bool) -> Self {
        if when { Self(self.0 | other.0) } else { self }
    }

    /// Features that the scene needs with any settings.
    pub fn of_scene(scene: &Scene) -> Self {
        let mut bits = 0;
        let mut ask = |feature: Self, when: bool| bits |= if when { feature.0 } else { 0 };
        for m in scene.meshes.iter().map(|mesh| &scene.materials[mesh.material]) {
            let transmits = m.transmission > 0.0;
            for (slot, (texture, _)) in m.slots().iter().enumerate() {
                ask(Self::texture_slot(slot), texture.is_some());
                ask(Self::SECOND_UV, texture.is_some_and(|t| t.uv_set == 1));
            }
            ask(Self::ALPHA, m.alpha != Alpha::Opaque || transmits);
            ask(Self::MASK, matches!(m.alpha, Alpha::Mask(_)));
            ask(Self::BLEND, m.alpha == Alpha::Blend);
            ask(Self::TRANSMISSION, transmits);
            ask(Self::SPECULAR, !m.unlit && (m.metallic > 0.0 || (m.specular > 0.0 && m.ior != 1.0)));
            let smooth = m.roughness < MIRROR_ROUGHNESS || m.metallic_roughness_texture.is_some();
            ask(Self::MIRRORS, !m.unlit && m.metallic > 0.0 && smooth);
            let Some(finish) = m.finish.as_deref().filter(|_| !m.unlit) else { continue };
            for (texture, _) in finish.slots() {
                ask(Self::FINISH_TEXTURES, texture.is_some());
                ask(Self::SECOND_UV, texture.is_some_and(|t| t.uv_set == 1));
            }
            ask(Self::CLEARCOAT, finish.clearcoat.factor > 0.0);
            ask(Self::SHEEN, finish.sheen.color != Vec3::ZERO);
            ask(Self::ANISOTROPY, finish.anisotropy.strength > 0.0);
            ask(Self::IRIDESCENCE, finish.iridescence.factor > 0.0);
            ask(Self::DIFFUSE_TRANSMISSION, finish.diffuse_transmission.factor > 0.0);
            ask(Self::DISPERSION, finish.dispersion > 0.0);
            ask(Self::TANGENTS, finish.anisotropy.strength > 0.0 || finish.clearcoat.normal_texture.is_some());
            // Coat and sheen reflect too.
            ask(Self::SPECULAR, finish.clearcoat.factor > 0.0 || finish.sheen.color != Vec3::ZERO);
        }
        ask(Self::COLORS, scene.meshes.iter().any(|mesh| mesh.colors.iter().any(|&color| color != Vec4::ONE)));
        ask(Self::SKY_GRADIENT, scene.sky_gradient != Vec3::ZERO);
        ask(Self::SKY_MAP, scene.sky_map.is_some());
        ask(Self::SKY_UNSEEN, scene.sky_unseen);
        Self(bits)
    }
}

/// All constants that the ground declares. A pass that needs other values, such as one that lights list items, replaces
/// them by [`with`].
pub fn constants(settings: &Settings, features: Features) -> Vec<Constant> {
    vec![
        ("EDGE", settings.voxels.into()),
        ("SHADOWS", settings.lights.shadows.into()),
        ("FEATURES", features.0.into()),
        ("LAMPS", settings.lights.lamps.into()),
        ("LAMP_POINTS", settings.lights.lamp_points.into()),
        ("GATHER_SCALE", settings.image.gather_resolution.scale().into()),
        ("INTERLEAVE", settings.image.interleave.into()),
        ("LINKED", false.into()),
        ("SHADOW_RAYS", settings.lights.shadow_rays.into()),
        ("DIRECT", DIRECT_FOUND.into()),
        ("LIT", LIT_EACH.into()),
        ("DEMAND", 0u32.into()),
        ("LISTED", LIT_COUNTS.into()),
        ("BOXES", 0u32.into()),
        ("BLENDED", 0u32.into()),
        ("SAMPLES", 4u32.into()),
    ]
}

/// `constants`, with some values replaced by `others`.
pub fn with(mut constants: Vec<Constant>, others: &[Constant]) -> Vec<Constant> {
    constants.retain(|(name, _)| others.iter().all(|(other, _)| other != name));
    constants.extend(others);
    constants
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, Mesh};

    #[test]
    fn mirrors_are_smooth_metals() {
        let asks = |metallic: f32, roughness: f32, unlit: bool| {
            let mut scene = Scene::empty("one surface");
            let m = scene.add_material(Material { metallic, roughness, unlit, ..Material::default() });
            scene.add_mesh(Mesh::quad("quad", m, Vec3::ZERO, Vec3::X, Vec3::Y), glam::DAffine3::IDENTITY);
            Features::of_scene(&scene).has(Features::MIRRORS)
        };
        assert!(asks(1.0, 0.0, false) && asks(1.0, 0.38, false));
        assert!(!asks(1.0, 0.4, false) && !asks(0.0, 0.0, false) && !asks(1.0, 0.0, true));
    }
}
