//! Specialisation constants of the method: `glsl/gi/probes/constants.glsl` is their twin.

use crate::settings::Settings;
use crate::vk::Constant;

/// All constants that the method declares.
pub fn constants(settings: &Settings) -> Vec<Constant> {
    let own = &settings.of.probes;
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
        ("BOUNCES", settings.bounces.limit().into()),
    ]
}
