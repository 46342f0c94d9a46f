//! Specialisation constants and uniform block of the method. GLSL twin: `glsl/gi/cones/constants.glsl`.

use super::Settings;
use super::choices::{ConeSet, Form};
use crate::ground::layout::shared;
use crate::vk::Constant;

shared! {
    /// The uniform block. Lengths in voxels.
    Cones {
        diffuse_start_normal: f32, diffuse_start_along: f32, diffuse_offset: f32,
        specular_start_normal: f32, specular_start_along: f32,
        refraction_start_normal: f32, refraction_start_along: f32,
        shadow_start_normal: f32, shadow_start_along: f32,
        shadow_end: f32, shadow_step: f32, shadow_aperture: f32,
        step: f32, aperture: f32, exit_margin: f32,
    }
}

/// The talk's grid: its offset of −0.01 of the cube is 1.28 of these voxels.
const TALK_EDGE: f32 = 128.0;

impl Cones {
    /// The block for a grid of `edge`³ voxels.
    pub fn new(settings: &Settings, edge: u32) -> Self {
        let start = &settings.start;
        // D19: in the printed form, the offset is a share of the cube.
        let share = if settings.ledger.d19 == Form::Printed { edge as f32 / TALK_EDGE } else { 1.0 };
        Self {
            diffuse_start_normal: start.diffuse_normal,
            diffuse_start_along: start.diffuse_along,
            diffuse_offset: start.diffuse_offset * share,
            specular_start_normal: start.specular_normal,
            specular_start_along: start.specular_along,
            refraction_start_normal: start.refraction_normal,
            refraction_start_along: start.refraction_along,
            shadow_start_normal: start.shadow_normal,
            shadow_start_along: start.shadow_along,
            shadow_end: start.shadow_end,
            shadow_step: settings.shadow_step,
            shadow_aperture: settings.shadow_half_angle.map_or(-1.0, |degrees| degrees.to_radians().tan()),
            step: settings.step,
            aperture: settings.aperture,
            exit_margin: settings.exit_margin,
        }
    }
}

/// All constants that the method declares.
pub fn constants(settings: &Settings) -> [Constant; 8] {
    let (set, count): (u32, u32) = match (settings.set.cosine_count(), settings.set) {
        (Some(count), _) => (5, count),
        (_, ConeSet::Five) => (1, 5),
        (_, ConeSet::SixA) => (2, 6),
        (_, ConeSet::SixB) => (3, 6),
        (_, ConeSet::Sixteen) => (4, 16),
        (_, _) => (0, 1),
    };
    [
        ("CONE_SET", set.into()),
        ("CONE_COUNT", count.into()),
        ("FILL", settings.fill.into()),
        ("WEIGHTS", settings.weights.into()),
        ("BLEND", settings.blend.into()),
        ("ROUGHNESS_FIT", settings.roughness_fit.into()),
        ("PRINTED", settings.ledger.printed_bits().into()),
        ("JITTER", (u32::from(settings.jitter) + 2 * u32::from(settings.shadow_jitter)).into()),
    ]
}
