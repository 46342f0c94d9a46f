//! The scene's materials at points on its triangles.

use glam::Vec3;

use super::bsdf;
use super::geometry::{Geometry, Point};
use crate::scene::{Alpha, Scene};

/// A surface as paths meet it.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    pub material: bsdf::Material,
    /// On the front's side, unit; normal map applied.
    pub normal: Vec3,
    /// Radiance, if seen from a side that emits.
    pub emission: Vec3,
    /// Opacity: what alpha blending leaves.
    pub alpha: f32,
    pub unlit: bool,
    /// Beer's coefficient of the volume behind the surface, per unit.
    pub absorption: Vec3,
}

/// Evaluates materials.
pub struct Materials<'a> {
    scene: &'a Scene,
}

impl<'a> Materials<'a> {
    pub fn new(scene: &'a Scene) -> Self {
        Self { scene }
    }

    pub fn is_emissive(&self, material: usize) -> bool {
        let m = &self.scene.materials[material];
        m.emissive != Vec3::ZERO && !m.unlit
    }

    /// Whether light from a side leaves: both sides only if doubleSided.
    pub fn emission(&self, geometry: &Geometry, triangle: u32, u: f32, v: f32, back: bool) -> Vec3 {
        let (uvs, color, material) = geometry.texturing(triangle, u, v);
        let m = &self.scene.materials[material];
        if back && !m.double_sided {
            return Vec3::ZERO;
        }
        let _ = (uvs, color);
        m.emissive
    }

    /// Mean over a triangle of the emitted radiance's largest channel, both sides together.
    pub fn mean_emission(&self, geometry: &Geometry, triangle: u32) -> f32 {
        const GRID: u32 = 4;
        let sides = if geometry.traits[geometry.material(triangle)].double_sided { 2.0 } else { 1.0 };
        let mut sum = 0.0;
        for i in 0..GRID * GRID {
            let (u, v) = ((i % GRID) as f32 + 0.5, (i / GRID) as f32 + 0.5);
            let (u, v) = (u / GRID as f32, v / GRID as f32);
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            sum += self.emission(geometry, triangle, u, v, false).max_element();
        }
        sides * sum / (GRID * GRID) as f32
    }

    /// Opacity at a point: below a mask's cutoff 0, else 1; alpha where blended.
    pub fn alpha(&self, geometry: &Geometry, triangle: u32, u: f32, v: f32) -> f32 {
        let (_, color, material) = geometry.texturing(triangle, u, v);
        let m = &self.scene.materials[material];
        let a = m.base_color.w * color.w;
        match m.alpha {
            Alpha::Opaque => 1.0,
            Alpha::Mask(c) => (a >= c) as u32 as f32,
            Alpha::Blend => a,
        }
    }

    pub fn surface(&self, geometry: &Geometry, point: &Point, triangle: u32, u: f32, v: f32, back: bool) -> Surface {
        let m = &self.scene.materials[point.material];
        Surface {
            material: bsdf::Material {
                base: (m.base_color * point.color).truncate(),
                metallic: m.metallic,
                roughness: m.roughness,
                ior: m.ior,
                specular: m.specular,
                specular_color: m.specular_color,
                transmission: m.transmission,
                volume: geometry.traits[point.material].volume,
            },
            normal: point.normal,
            emission: self.emission(geometry, triangle, u, v, back),
            alpha: self.alpha(geometry, triangle, u, v),
            unlit: m.unlit,
            absorption: Vec3::ZERO,
        }
    }
}
