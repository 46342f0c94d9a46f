//! Specialisation constants of the method: `glsl/gi/probes/constants.glsl` is their twin.

use crate::settings::{Bounces, Settings};
use crate::vk::Constant;

/// Value of the constant `BOUNCES` for unlimited bounces: more than the surfaces that one ray meets.
const ALL_BOUNCES: u32 = 64;

/// All constants that the method declares.
pub fn constants(settings: &Settings) -> Vec<Constant> {
    let own = &settings.of.probes;
    let bounces = if settings.bounces == Bounces::All { ALL_BOUNCES } else { settings.bounces.stored() };
    vec![
        ("PROBE_EDGE", own.edge.into()),
        ("CASCADES", own.cascades.into()),
        ("PROBE_RAYS", own.rays.into()),
        ("LOBE_RAYS", own.glossy.into()),
        ("BIAS", own.bias.into()),
        ("COUNTS_BEHIND", own.behind.into()),
        ("VISIBILITY", own.visibility.into()),
        ("CLASSIFY", own.classify.into()),
        ("HYSTERESIS", own.hysteresis.into()),
        ("BOUNCES", bounces.into()),
    ]
}
