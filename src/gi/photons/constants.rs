//! Specialisation constants of the method: `glsl/gi/photons/constants.glsl` is their twin.

use super::settings::{AoMultiplies, Composite, Opacity, Settings};

pub const DIFFUSE_CONES: u32 = 32;

/// (constant, value), beside the ground's.
pub fn constants(settings: &Settings) -> Vec<(u32, u32)> {
    let composite = match settings.composite {
        Composite::Over => 0,
        Composite::Sum => 1,
    };
    let opacity = match settings.opacity {
        Opacity::Samples => 0,
        Opacity::Sided => 1,
    };
    let ao_multiplies = match settings.ao_multiplies {
        AoMultiplies::Nothing => 0,
        AoMultiplies::Light => 1,
    };
    vec![
        (DIFFUSE_CONES, settings.diffuse),
        (33, settings.glossy),
        (34, settings.ledger.printed_bits()),
        (35, composite),
        (36, opacity),
        (37, ao_multiplies),
        (39, u32::from(settings.keep_backs)),
        (40, u32::from(settings.turn)),
        (41, settings.least_step.to_bits()),
        (42, settings.most_ratio.to_bits()),
        (43, settings.start_normal.to_bits()),
        (44, settings.start_along.to_bits()),
        (45, settings.ao_rate.to_bits()),
    ]
}
