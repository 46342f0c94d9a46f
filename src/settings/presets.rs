//! Presets: settings with a name, each written as what it changes of another.

use super::{DirectLight, GatherResolution, ImageSettings, LampLight, LightSettings, Settings, Shadows};
use crate::gi::{Method, Tables, cones, rays};

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
        settings: Settings::default,
    },
    Preset {
        name: "fast",
        meaning: "6 shared rays for every 16 pixels, lamps sampled, one sample per pixel",
        settings: Settings::fast,
    },
    Preset { name: "accurate", meaning: "32 shared rays a pixel, lamps sampled", settings: Settings::accurate },
    Preset { name: "cones", meaning: "16 saturating cones a pixel, lamps sampled", settings: Settings::cones },
    Preset { name: "corrected", meaning: "the talk, every row of the ledger right", settings: Settings::corrected },
    Preset {
        name: "printed",
        meaning: "the talk's listings as printed, where they can run",
        settings: Settings::printed,
    },
];

impl Settings {
    /// Six rays at every fourth pixel along each side, edges as they fall.
    pub fn fast() -> Self {
        Self {
            lights: LightSettings { shadow_rays: 1, lamp_points: 4, ..LightSettings::default() },
            image: ImageSettings {
                samples: 1,
                gather_resolution: GatherResolution::Quarter,
                ..ImageSettings::default()
            },
            of: Tables { rays: rays::Settings { diffuse: 6, bounce: 1, glossy: 2 }, ..Tables::default() },
            ..Self::default()
        }
    }

    /// Thirty-two rays at every pixel.
    pub fn accurate() -> Self {
        Self {
            lights: LightSettings { shadow_rays: 8, lamp_points: 32, voxel_lamp_points: 8, ..LightSettings::default() },
            image: ImageSettings {
                direct: DirectLight::Samples,
                gather_resolution: GatherResolution::Full,
                ..ImageSettings::default()
            },
            of: Tables { rays: rays::Settings { diffuse: 32, bounce: 4, glossy: 16 }, ..Tables::default() },
            ..Self::default()
        }
    }

    /// Cones alone, as right as they get.
    pub fn cones() -> Self {
        Self {
            method: Method::Cones,
            lights: LightSettings { shadow_rays: 1, voxel_lamp_points: 16, ..LightSettings::default() },
            image: ImageSettings {
                direct: DirectLight::Samples,
                gather_resolution: GatherResolution::Full,
                interleave: 1,
                ..ImageSettings::default()
            },
            ..Self::default()
        }
    }

    /// The talk as printed, where it can run.
    pub fn printed() -> Self {
        let cones = Self::cones();
        Self {
            lights: LightSettings { shadows: Shadows::Method, lamps: LampLight::Gathered, ..cones.lights },
            of: Tables { cones: cones::Settings::printed(), ..Tables::default() },
            ..cones
        }
    }

    /// The talk, every row of the ledger right.
    pub fn corrected() -> Self {
        Self { of: Tables { cones: cones::Settings::corrected(), ..Tables::default() }, ..Self::printed() }
    }
}
