//! Features of a scene that settings must support, and settings that it does not need.

use crate::scene::{Alpha, LightKind, Material, Scene};

/// Features of a scene that settings depend on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Needs {
    /// Whether surfaces emit light.
    pub lamps: bool,
    /// Whether lights have a radius, so that their shadows are soft.
    pub wide_lights: bool,
    /// Whether surfaces reflect in a specular lobe or transmit light.
    pub lobes: bool,
    pub transmits: bool,
    pub sky: bool,
    pub blended: bool,
}

impl Needs {
    pub fn of_scene(scene: &Scene) -> Self {
        let used: Vec<&Material> =
            scene.instances.iter().map(|i| &scene.materials[scene.meshes[i.mesh].material]).collect();
        let wide = scene.lights.iter().any(|light| light.radius > 0.0);
        // The specular reflection of rough dielectrics reuses the rays for diffuse light: `rays.glossy`.
        let mirrors =
            |m: &&Material| !m.unlit && (m.metallic > 0.0 || (m.specular > 0.0 && m.ior != 1.0 && m.roughness < 0.7));
        let transmits = used.iter().any(|m| m.transmission > 0.0);
        let finished = used.iter().any(|m| m.finish.is_some());
        Self {
            lamps: scene.emits(),
            wide_lights: wide || scene.sky_lights().next().is_some(),
            lobes: transmits || finished || used.iter().any(|m| mirrors(&&**m)),
            transmits,
            sky: scene.sky != glam::Vec3::ZERO,
            blended: used.iter().any(|m| m.alpha == Alpha::Blend),
        }
    }

    /// A sentence with the reason for each feature that this scene does not need.
    pub fn not_needed(&self, scene: &Scene) -> Vec<String> {
        let mut said = Vec::new();
        let mut say = |when: bool, text: &str| said.extend(when.then(|| text.to_owned()));
        say(!self.lamps, "points on lamps (lights.lamp_points, lights.voxel_lamp_points): nothing emits light");
        let points = scene.lights.iter().filter(|light| light.kind != LightKind::Directional).count();
        let lights = match scene.lights.len() {
            0 => "there are no lights".to_owned(),
            n => format!("none of {n} lights has a radius ({points} at a place, {} from afar)", n - points),
        };
        say(!self.wide_lights, &format!("several shadow rays to a light (lights.shadow_rays): {lights}"));
        say(
            !self.lobes,
            "rays for mirrored light (rays.glossy, photons.glossy): nothing is metallic, glossy or transmits",
        );
        say(self.lobes && !self.transmits, "rays through surfaces: nothing transmits");
        say(!self.blended, "a draw of blended triangles: no material blends");
        say(!self.sky, "light of a sky: there is none");
        said
    }
}
