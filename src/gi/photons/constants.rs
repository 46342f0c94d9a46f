//! Specialisation constants of the method. GLSL twin: `glsl/gi/photons/constants.glsl`.

use super::Settings;
use crate::vk::Constant;

/// All constants that the method declares.
pub fn constants(settings: &Settings) -> Vec<Constant> {
    vec![
        ("DIFFUSE_CONES", settings.diffuse.into()),
        ("GLOSSY_CONES", settings.glossy.into()),
        ("PRINTED", settings.ledger.printed_bits().into()),
        ("COMPOSITE", settings.composite.into()),
        ("OPACITY_KIND", settings.opacity.into()),
        ("AO_MULTIPLIES", settings.ao_multiplies.into()),
        ("KEEPS_BACKS", u32::from(settings.keep_backs).into()),
        ("TURNED", u32::from(settings.turn).into()),
        ("LEAST_STEP", settings.least_step.into()),
        ("MOST_RATIO", settings.most_ratio.into()),
        ("START_NORMAL", settings.start_normal.into()),
        ("START_ALONG", settings.start_along.into()),
        ("AO_RATE", settings.ao_rate.into()),
    ]
}
