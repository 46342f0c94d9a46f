//! Light of a scene, and the default light for a scene without any.

use glam::{DAffine3, DQuat, DVec3, Vec3};

use super::{LightKind, Scene, View};

/// Irradiance of the default light, a white surface that faces it reflects 1/√2 of radiance; and radiance of the default sky, its
/// mean and what it has more straight up, so that metals and shadow sides show their form.
const DEFAULT_IRRADIANCE: f32 = std::f32::consts::PI * std::f32::consts::FRAC_1_SQRT_2;
const DEFAULT_SKY: f32 = 0.4;
const DEFAULT_GRADIENT: f32 = 0.3;

impl Scene {
    /// Whether the scene has a light or a sky, or an instance with an emissive material.
    pub fn has_light(&self) -> bool {
        self.has_light_beside_emission() || self.emits()
    }

    /// Whether the scene has a light or a sky.
    pub fn has_light_beside_emission(&self) -> bool {
        self.lights.iter().any(|l| l.intensity != Vec3::ZERO) || self.sky != Vec3::ZERO
    }

    /// Whether any instance has an emissive material.
    pub fn emits(&self) -> bool {
        let emits = |mesh: usize| self.materials[self.meshes[mesh].material].emissive != Vec3::ZERO;
        self.instances.iter().any(|i| emits(i.mesh))
    }

    /// Radiance of the sky towards unit d.
    pub fn sky_towards(&self, d: DVec3) -> Vec3 {
        match &self.sky_map {
            Some(map) => map.towards((self.sky_rotation().transpose() * d).as_vec3()),
            None => self.sky + self.sky_gradient * d.y as f32,
        }
    }

    /// Adds a sky, brighter above than below, and a directional light from the upper left behind the viewer. Returns a sentence
    /// about them. Existing poses do not include the light.
    pub fn add_default_light(&mut self, view: &View) -> String {
        let direction = (view.forward + 0.5 * view.right() - view.up).normalize();
        let rotation = DQuat::from_rotation_arc(DVec3::NEG_Z, direction);
        let light =
            self.add_light(LightKind::Directional, Vec3::splat(DEFAULT_IRRADIANCE), DAffine3::from_quat(rotation));
        self.lights[light].name = "default light".into();
        self.sky_map = None;
        (self.sky, self.sky_gradient) = (Vec3::splat(DEFAULT_SKY), Vec3::splat(DEFAULT_GRADIENT));
        let DVec3 { x, y, z } = direction;
        format!(
            "added a sky of radiance {:.1} above to {:.1} below, and a directional light of irradiance {DEFAULT_IRRADIANCE:.3} \
             towards ({x:.3}, {y:.3}, {z:.3}), from the upper left behind the camera; --default-light off leaves both out",
            DEFAULT_SKY + DEFAULT_GRADIENT,
            DEFAULT_SKY - DEFAULT_GRADIENT,
        )
    }
}
