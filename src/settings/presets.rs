//! Presets: settings with a name, each written as what it changes of another. `corrected` is [`Settings::default`].

use super::{
    Blend, ConeSet, DirectLight, Emitters, Fill, Form, Gather, GatherResolution, ImageSettings, Ledger, Lists,
    RoughnessFit, Settings, Shade, ShadeDirect, ShadeItems, Shadow, Shadows, Start, Weights, Work,
};

/// Settings with a name.
#[derive(Clone, Copy, Debug)]
pub struct Preset {
    pub name: &'static str,
    /// What it is for.
    pub meaning: &'static str,
    pub settings: fn() -> Settings,
}

/// Every preset. The first is what the command line takes where none is named.
pub const PRESETS: &[Preset] = &[
    Preset {
        name: "balanced",
        meaning: "8 shared rays for every 4 pixels, lamps sampled",
        settings: Settings::balanced,
    },
    Preset {
        name: "fast",
        meaning: "6 shared rays for every 16 pixels, lamps sampled, one sample per pixel",
        settings: Settings::fast,
    },
    Preset { name: "accurate", meaning: "32 shared rays a pixel, lamps sampled", settings: Settings::accurate },
    Preset { name: "cones", meaning: "16 saturating cones a pixel, lamps sampled", settings: Settings::cones },
    Preset { name: "corrected", meaning: "the talk, every row of the ledger right", settings: Settings::default },
    Preset {
        name: "printed",
        meaning: "the talk's listings as printed, where they can run",
        settings: Settings::printed,
    },
];

impl Settings {
    /// Fill, weights and compositing changed together, so that a wall's alpha adds up to 1 from every angle.
    pub fn saturating(cones: ConeSet, step: f32) -> Self {
        Self {
            cones,
            step,
            fill: Fill::Sided,
            weights: Weights::Abs,
            blend: Blend::Sum,
            lists: Lists::Reuse,
            shading: Work::Cells,
            mips: Work::Cells,
            start: Start { diffuse_normal: 1.0, diffuse_along: 0.5, ..Start::default() },
            ..Self::default()
        }
    }

    /// Cones alone, as right as they get.
    pub fn cones() -> Self {
        Self { emitters: Emitters::Sampled, ..Self::saturating(ConeSet::G16, 1.0) }
    }

    /// Exact rays that read saturating volumes, few per place and shared among neighbours; lamps sampled.
    /// Voxels look along `of_voxels` and at `lamp_points` alone: whoever reads them reads the mean of many.
    fn rays(cones: ConeSet, of_voxels: ConeSet, lamp_points: u32) -> Self {
        Self {
            gather: Gather::Rays,
            shade: Shade {
                gather: None,
                cones: Some(of_voxels),
                emitter_samples: Some(lamp_points),
                direct: ShadeDirect::Kept,
                items: ShadeItems::Alike,
            },
            interleave: 4,
            emitters: Emitters::Sampled,
            specular: Gather::Rays,
            refraction: Gather::Rays,
            specular_rays: 4,
            roughness_fit: RoughnessFit::Ggx,
            ..Self::saturating(cones, 1.5)
        }
    }

    /// Six rays at every fourth pixel along each side, edges as they fall.
    pub fn fast() -> Self {
        Self {
            gather_resolution: GatherResolution::Quarter,
            emitter_samples: 4,
            specular_rays: 2,
            image: ImageSettings { samples: 1, direct: DirectLight::Pixels },
            ..Self::rays(ConeSet::G6, ConeSet::G1, 4)
        }
    }

    /// Eight rays at every second pixel along each side: the frontier's best within a second and a half per frame for
    /// `cornell-area` at 512×512 and 64³ on two cores without a GPU.
    pub fn balanced() -> Self {
        Self {
            gather_resolution: GatherResolution::Half,
            shadow: Shadow { rays: 4, ..Shadow::default() },
            image: ImageSettings { direct: DirectLight::Pixels, ..ImageSettings::default() },
            ..Self::rays(ConeSet::G8, ConeSet::G2, 4)
        }
    }

    /// Thirty-two rays at every pixel.
    pub fn accurate() -> Self {
        Self {
            emitter_samples: 32,
            specular_rays: 16,
            shadow: Shadow { rays: 8, ..Shadow::default() },
            ..Self::rays(ConeSet::G32, ConeSet::G4, 8)
        }
    }

    /// The talk as printed, where it can run.
    pub fn printed() -> Self {
        Self {
            shadows: Shadows::Cones,
            first_bounce_shadows: false,
            start: Start {
                // 1 + 4·0.7071 along the normal, less coneOffset 0.01·128 along the cone (D19, D20).
                diffuse_normal: 1.0 + 4.0 * std::f32::consts::FRAC_1_SQRT_2,
                diffuse_along: 4.0 - 1.28,
                specular_normal: 2.0,
                specular_along: 2.0,
                refraction_normal: 1.0,
                refraction_along: 1.0,
                shadow_normal: 2.0,
                shadow_along: 2.5,
                shadow_end: 0.0,
            },
            shadow: Shadow { step: 0.333333, half_angle: Some(5.0), ..Shadow::default() },
            ledger: Ledger::all(Form::Printed),
            ..Self::default()
        }
    }
}
