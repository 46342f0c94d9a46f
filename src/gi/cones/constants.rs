//! Specialisation constants of the cones' shaders: `glsl/common/constants.glsl` is their twin.

use crate::scene::{Alpha, Scene};
use crate::settings::{
    Blend, ConeSet, DirectLight, Emitters, Fill, Form, Gather, Ledger, RoughnessFit, Settings, Shadows, Weights,
};

const EDGE: u32 = 0;
const CONE_SET: u32 = 1;
const FILL: u32 = 2;
const WEIGHTS: u32 = 3;
const SHADOWS: u32 = 4;
const ROUGHNESS_FIT: u32 = 5;
const PRINTED: u32 = 6;
const BOUNCE: u32 = 7;
const FEATURES: u32 = 8;
const CONE_COUNT: u32 = 10;
const BLEND: u32 = 11;
const GATHER: u32 = 12;
const EMITTERS: u32 = 13;
const EMITTER_SAMPLES: u32 = 14;
const GATHER_SCALE: u32 = 15;
const INTERLEAVE: u32 = 16;
const SPECULAR: u32 = 17;
const REFRACTION: u32 = 18;
const SPECULAR_RAYS: u32 = 19;
const SHADOW_RAYS: u32 = 21;
const LIT: u32 = 23;
/// Of the shading passes alone.
pub const DIRECT: u32 = 22;
/// Values of [`DIRECT`]: direct light is found; and kept; or what was kept is taken.
pub const DIRECT_AGAIN: u32 = 0;
pub const DIRECT_KEEP: u32 = 1;
pub const DIRECT_READ: u32 = 2;
/// Of `render.vert` alone.
pub const BLENDED: u32 = 9;

/// What a scene and its settings ask for; bits of the constant `FEATURES`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Features(pub u32);

impl Features {
    pub const ALPHA: Self = Self(2);
    pub const SPECULAR: Self = Self(4);
    pub const TRANSMISSION: Self = Self(8);
    pub const JITTER: Self = Self(16);
    pub const MASK: Self = Self(32);
    pub const FIRST_BOUNCE_SHADOWS: Self = Self(64);
    pub const BLEND: Self = Self(128);

    pub const DIRECT_PER_PIXEL: Self = Self(1 << 16);

    /// Some material has a texture in slot `slot` of `layout::Material::slots`.
    fn texture_slot(slot: usize) -> Self {
        Self(256 << slot)
    }

    pub fn has(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    /// What the materials that are in use and the settings ask for: nothing else costs anything.
    pub fn of(scene: &Scene, settings: &Settings) -> Self {
        let mut bits = 0;
        let mut ask = |feature: Self, when: bool| bits |= if when { feature.0 } else { 0 };
        for m in scene.meshes.iter().map(|mesh| &scene.materials[mesh.material]) {
            let textures = [
                m.base_color_texture,
                m.metallic_roughness_texture,
                m.normal_texture,
                m.emissive_texture,
                m.specular_texture,
                m.specular_color_texture,
                m.transmission_texture,
                m.thickness_texture,
            ];
            let transmits = m.transmission > 0.0;
            for (slot, texture) in textures.iter().enumerate() {
                ask(Self::texture_slot(slot), texture.is_some());
            }
            ask(Self::ALPHA, m.alpha != Alpha::Opaque || transmits);
            ask(Self::MASK, matches!(m.alpha, Alpha::Mask(_)));
            ask(Self::BLEND, m.alpha == Alpha::Blend);
            ask(Self::TRANSMISSION, transmits);
            ask(Self::SPECULAR, !m.unlit && (m.metallic > 0.0 || (m.specular > 0.0 && m.ior != 1.0)));
        }
        ask(Self::JITTER, settings.jitter);
        ask(Self::DIRECT_PER_PIXEL, settings.image.direct == DirectLight::Pixels);
        ask(Self::FIRST_BOUNCE_SHADOWS, settings.first_bounce_shadows);
        Self(bits)
    }
}

/// The rows that are as printed, one bit per number.
fn printed_bits(ledger: &Ledger) -> u32 {
    let rows = [
        (1, ledger.d1),
        (2, ledger.d2),
        (6, ledger.d6),
        (7, ledger.d7),
        (8, ledger.d8),
        (10, ledger.d10),
        (11, ledger.d11),
        (12, ledger.d12),
        (13, ledger.d13),
        (15, ledger.d15),
        (17, ledger.d17),
        (18, ledger.d18),
        (21, ledger.d21),
        (22, ledger.d22),
        (23, ledger.d23),
        (24, ledger.d24),
        (26, ledger.d26),
    ];
    rows.iter().filter(|(_, form)| *form == Form::Printed).map(|(row, _)| 1 << row).sum()
}

/// The constants of a pass; `bounce` is 1 where a volume is there to gather from.
pub fn constants(settings: &Settings, features: Features, bounce: u32) -> Vec<(u32, u32)> {
    let (cone_set, cone_count) = match (settings.cones.cosine_count(), settings.cones) {
        (Some(count), _) => (5, count),
        (_, ConeSet::Five) => (1, 5),
        (_, ConeSet::SixA) => (2, 6),
        (_, ConeSet::SixB) => (3, 6),
        (_, ConeSet::Sixteen) => (4, 16),
        (_, _) => (0, 1),
    };
    let fill = match settings.fill {
        Fill::Uniform => 0,
        Fill::Facing => 1,
        Fill::Coverage => 2,
        Fill::Sided => 3,
    };
    let weights = match settings.weights {
        Weights::D2 => 0,
        Weights::Norm1 => 1,
        Weights::Abs => 2,
        Weights::Extinction => 3,
    };
    let shadows = match settings.shadows {
        Shadows::None => 0,
        Shadows::Cones => 1,
        Shadows::Rays => 2,
    };
    let fit = match settings.roughness_fit {
        RoughnessFit::Polynomial => 0,
        RoughnessFit::Power => 1,
        RoughnessFit::Linear => 2,
        RoughnessFit::Ggx => 3,
    };
    vec![
        (EDGE, settings.voxels),
        (CONE_SET, cone_set),
        (CONE_COUNT, cone_count),
        (FILL, fill),
        (BLEND, u32::from(settings.blend == Blend::Sum)),
        (GATHER, u32::from(settings.gather == Gather::Rays)),
        (EMITTERS, u32::from(settings.emitters == Emitters::Sampled)),
        (EMITTER_SAMPLES, settings.emitter_samples),
        (GATHER_SCALE, settings.gather_resolution.scale()),
        (INTERLEAVE, settings.interleave),
        (SPECULAR, u32::from(settings.specular == Gather::Rays)),
        (REFRACTION, u32::from(settings.refraction == Gather::Rays)),
        (SPECULAR_RAYS, settings.specular_rays),
        (SHADOW_RAYS, settings.shadow.rays),
        (LIT, u32::from(settings.lights_alike())),
        (WEIGHTS, weights),
        (SHADOWS, shadows),
        (ROUGHNESS_FIT, fit),
        (PRINTED, printed_bits(&settings.ledger)),
        (BOUNCE, bounce),
        (FEATURES, features.0),
    ]
}
