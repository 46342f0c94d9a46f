//! Materials at points of the posed scene.

use glam::Vec3;

use super::geometry::{Geometry, Location, Point};
use super::layers::coat_leaves;
use super::point_textures::PointTextures;
use crate::scene::surface::{SurfaceParams, SurfacePoint, shading_normal};
use crate::scene::texture::{ColorSpace, Sampling};
use crate::scene::{Pose, Scene};

/// The material at a path vertex.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    pub params: SurfaceParams,
    /// The shading normal on the front, unit: with the normal map.
    pub normal: Vec3,
    /// The clearcoat's normal, which equals the shading normal without its own normal map.
    pub coat_normal: Vec3,
    /// The direction of the larger roughness of an anisotropic surface, in the triangle's tangent plane.
    pub grain: Vec3,
    /// Radiance towards the side of the ray, before the clearcoat reduces it.
    pub emission: Vec3,
}

impl Surface {
    /// The share of emission towards a viewer that passes the clearcoat.
    pub fn coat_leaves(&self, to_viewer: Vec3) -> f32 {
        self.params.finish.as_ref().map_or(1.0, |finish| coat_leaves(finish, self.coat_normal, to_viewer))
    }
}

/// The posed scene and its textures, without minification filters: a path samples a point.
pub struct Materials<'a> {
    pub geometry: Geometry<'a>,
    textures: PointTextures,
}

impl<'a> Materials<'a> {
    pub fn new(scene: &'a Scene, pose: &Pose) -> Self {
        Self { geometry: Geometry::new(scene, pose), textures: PointTextures::new(scene) }
    }

    fn scene(&self) -> &'a Scene {
        self.geometry.scene
    }

    /// Prefetches the texels that [`Self::surface`] will read.
    #[inline]
    pub fn prefetch(&self, texturing: &SurfacePoint, material: usize) {
        for (slot, _) in self.geometry.materials[material].texture_slots() {
            self.textures.prefetch(self.scene(), &slot, texturing.uvs);
        }
    }

    /// The material at a point, seen from the triangle's back if `back`.
    #[inline]
    pub fn surface(&self, point: &Point, back: bool) -> Surface {
        let m = &self.geometry.materials[point.material];
        let params = m.evaluate(self.scene(), &self.textures, &point.texturing);
        let emission = if m.shows(!back) && !params.unlit { params.emissive } else { Vec3::ZERO };
        let normal = shading_normal(point.normal, point.tangent, params.normal_tangent);
        let (mut coat_normal, mut grain) = (normal, Vec3::ZERO);
        if let Some(finish) = &params.finish {
            coat_normal = shading_normal(point.normal, point.tangent, finish.clearcoat_normal_tangent);
            grain = shading_normal(point.normal, point.tangent, finish.anisotropy_direction.extend(0.0));
        }
        Surface { params, normal, coat_normal, grain, emission }
    }

    /// [`Self::emission`] through the clearcoat, in a direction away from the surface.
    pub fn emission_towards(&self, at: Location, back: bool, direction: Vec3) -> Vec3 {
        let emission = self.emission(at, back);
        let (texturing, material) = self.geometry.texturing(at);
        if emission == Vec3::ZERO || self.geometry.materials[material].finish.is_none() {
            return emission;
        }
        emission * self.surface(&self.geometry.point(at, texturing), back).coat_leaves(direction)
    }

    /// Radiance emitted towards one side, times the opacity.
    pub fn emission(&self, at: Location, back: bool) -> Vec3 {
        let (texturing, material) = self.geometry.texturing(at);
        let m = &self.geometry.materials[material];
        if !m.shows(!back) {
            return Vec3::ZERO;
        }
        let texel = self.textures.sample(self.scene(), m.emissive_texture.as_ref(), ColorSpace::Srgb, &texturing);
        m.emissive * texel.truncate() * m.opacity(self.scene(), &self.textures, &texturing)
    }

    /// The estimated mean over a triangle of the largest channel of its emission, for both sides, which weights light
    /// sampling.
    pub fn mean_emission(&self, triangle: u32) -> f32 {
        const GRID: u32 = 4;
        let sides = if self.geometry.flags[self.geometry.material(triangle)].double_sided { 2.0 } else { 1.0 };
        let mut sum = 0.0;
        for i in 0..GRID * GRID {
            let (u, v) = (((i % GRID) as f32 + 0.5) / GRID as f32, ((i / GRID) as f32 + 0.5) / GRID as f32);
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            sum += self.emission(Location { triangle, u, v }, false).max_element();
        }
        sides * sum / (GRID * GRID) as f32
    }

    /// The share of light from behind that the surface blocks.
    pub fn opacity(&self, at: Location) -> f32 {
        let (texturing, material) = self.geometry.texturing(at);
        self.geometry.materials[material].opacity(self.scene(), &self.textures, &texturing)
    }
}
