//! Equal terms: the indirect light of every method is measured with the same exact direct light.
//!
//! The talk computes shadows and the light of lamps by cones. Its image then has no separate direct part, and errors of
//! its shadows would count as errors of its indirect light. Therefore indirect light is measured on an image with exact
//! shadow rays and sampled lamps, for all settings, and tables name the changed settings.

use glam::Vec3;

use crate::scene::Scene;
use crate::settings::{LampLight, Settings, Shadows};

/// The entry in an image's header that holds [`changes`] of its settings.
pub const HEADER: &str = "equalTerms";

/// The image whose direct light is subtracted from an image to leave its indirect light. The reference's own direct
/// light is always subtracted from the reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subtract {
    /// The image's own direct layer.
    Own,
    /// The reference's direct layer. Every method gathers the light of the sky together with the light of other
    /// surfaces, so that the direct layer of an image lacks it, while the reference's direct layer holds it.
    OfReference,
}

impl Subtract {
    /// The choice for images of a scene.
    pub fn in_scene(scene: &Scene) -> Self {
        if scene.sky == Vec3::ZERO { Self::Own } else { Self::OfReference }
    }
}

/// The settings with which the indirect light is measured: `settings` with shadows by exact rays and sampled lamps.
pub fn on_equal_terms(settings: &Settings) -> Settings {
    let mut equal = settings.clone();
    (equal.lights.shadows, equal.lights.lamps) = (Shadows::Rays, LampLight::Sampled);
    equal
}

/// Every change that [`on_equal_terms`] makes to `settings`, as `key=value`; empty if it makes none.
pub fn changes(settings: &Settings) -> Vec<String> {
    on_equal_terms(settings).changes_from(settings)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_talks_presets_are_changed_and_others_are_not() {
        let changes = |preset: &str| changes(&Settings::preset(preset).unwrap()).join(" ");
        assert_eq!(changes("corrected"), "lights.shadows=rays lights.lamps=sampled");
        assert_eq!(changes("lpv-printed"), "lights.lamps=sampled");
        assert_eq!(changes("balanced"), "");
        for preset in crate::settings::PRESETS {
            assert_eq!(super::changes(&on_equal_terms(&(preset.settings)())), Vec::<String>::new(), "{}", preset.name);
        }
    }
}
