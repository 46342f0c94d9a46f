//! Tests for light in a scene, and the default light for a scene without any.

use glam::{DAffine3, DQuat, DVec3, Vec3};

use super::{LightKind, Scene, View};

/// Irradiance of the default light: a white surface that faces it reflects a radiance of 1.
const DEFAULT_IRRADIANCE: f32 = std::f32::consts::PI;

impl Scene {
    /// Whether the scene has a light, an instance with an emissive material, or a sky.
    pub fn has_light(&self) -> bool {
        self.lights.iter().any(|l| l.intensity != Vec3::ZERO) || self.emits() || self.sky != Vec3::ZERO
    }

    /// Whether any instance has an emissive material.
    pub fn emits(&self) -> bool {
        let emits = |mesh: usize| self.materials[self.meshes[mesh].material].emissive != Vec3::ZERO;
        self.instances.iter().any(|i| emits(i.mesh))
    }

    /// Adds one directional light from the upper left behind the viewer. Returns a sentence about it. Existing poses do not
    /// include the light.
    pub fn add_default_light(&mut self, view: &View) -> String {
        let direction = (view.forward + 0.5 * view.right() - view.up).normalize();
        let rotation = DQuat::from_rotation_arc(DVec3::NEG_Z, direction);
        let light =
            self.add_light(LightKind::Directional, Vec3::splat(DEFAULT_IRRADIANCE), DAffine3::from_quat(rotation));
        self.lights[light].name = "default light".into();
        let DVec3 { x, y, z } = direction;
        format!(
            "the scene has no light, emission or sky: added a directional light of irradiance {DEFAULT_IRRADIANCE:.3} \
             towards ({x:.3}, {y:.3}, {z:.3}), from the upper left behind the camera"
        )
    }
}
