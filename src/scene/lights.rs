//! Light of a scene.

use glam::{DVec3, Vec3};

use super::Scene;

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
}
