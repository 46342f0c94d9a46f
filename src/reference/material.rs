//! The scene's materials at points on its triangles.

use glam::Vec3;

use super::geometry::{Geometry, Point};
use super::points::Points;
use crate::scene::Scene;
use crate::scene::surface::{SurfaceParams, SurfacePoint, shading_normal};
use crate::scene::texture::{ColorSpace, Sampling};

/// A surface as paths meet it.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    pub params: SurfaceParams,
    /// Of the front, unit; normal map applied.
    pub normal: Vec3,
    /// Radiance towards the side from which it is seen.
    pub emission: Vec3,
}

/// Evaluates materials, textures unfiltered: a path's sample is a point.
pub struct Materials<'a> {
    scene: &'a Scene,
    textures: Points,
}

impl<'a> Materials<'a> {
    pub fn new(scene: &'a Scene) -> Self {
        Self { scene, textures: Points::new(scene) }
    }

    pub fn is_emissive(&self, material: usize) -> bool {
        let m = &self.scene.materials[material];
        m.emissive != Vec3::ZERO && !m.unlit
    }

    /// Announces what [`Self::surface`] will read.
    #[inline]
    pub fn announce(&self, texturing: &SurfacePoint, material: usize) {
        for (slot, _) in self.scene.materials[material].texture_slots() {
            self.textures.announce(self.scene, &slot, texturing.uvs);
        }
    }

    /// Everything about the material at barycentric (1−u−v, u, v), seen from behind if `back`.
    #[inline]
    pub fn surface(&self, point: &Point, back: bool) -> Surface {
        let m = &self.scene.materials[point.material];
        let params = m.evaluate(self.scene, &self.textures, &point.texturing);
        let emission = if m.shows(!back) && !params.unlit { params.emissive } else { Vec3::ZERO };
        Surface { params, normal: shading_normal(point.normal, point.tangent, params.normal_tangent), emission }
    }

    /// Radiance that leaves towards one side, blended surfaces as far as they are there.
    pub fn emission(&self, geometry: &Geometry, triangle: u32, u: f32, v: f32, back: bool) -> Vec3 {
        let (texturing, material) = geometry.texturing(triangle, u, v);
        let m = &self.scene.materials[material];
        if !m.shows(!back) {
            return Vec3::ZERO;
        }
        let texel =
            self.textures.sample(self.scene, m.emissive_texture.as_ref(), ColorSpace::Srgb, texturing.uvs, [0.0; 2]);
        m.emissive * texel.truncate() * m.opacity(self.scene, &self.textures, &texturing)
    }

    /// Estimated mean over a triangle of its emission's largest channel, both sides together: what light sampling goes by.
    pub fn mean_emission(&self, geometry: &Geometry, triangle: u32) -> f32 {
        const GRID: u32 = 4;
        let sides = if geometry.traits[geometry.material(triangle)].double_sided { 2.0 } else { 1.0 };
        let mut sum = 0.0;
        for i in 0..GRID * GRID {
            let (u, v) = (((i % GRID) as f32 + 0.5) / GRID as f32, ((i / GRID) as f32 + 0.5) / GRID as f32);
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            sum += self.emission(geometry, triangle, u, v, false).max_element();
        }
        sides * sum / (GRID * GRID) as f32
    }

    /// How much of what lies behind is hidden.
    pub fn opacity(&self, geometry: &Geometry, triangle: u32, u: f32, v: f32) -> f32 {
        let (texturing, material) = geometry.texturing(triangle, u, v);
        self.scene.materials[material].opacity(self.scene, &self.textures, &texturing)
    }
}
