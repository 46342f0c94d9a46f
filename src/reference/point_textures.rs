//! Texture sampling at points: level 0 only, stored so that neighbouring texels share a cache line.

use glam::{Vec2, Vec4};

use super::memory;
use crate::scene::surface::SurfacePoint;
use crate::scene::texture::{ColorSpace, Lookup, Sampling};
use crate::scene::{Scene, TextureRef};

/// Texels along each side of a block.
const SIDE: usize = 4;

/// A square of texels that fills one cache line.
#[derive(Clone, Copy, Default)]
#[repr(C, align(64))]
struct Block([[[u8; 4]; SIDE]; SIDE]);

/// The blocks of an image.
struct ImageBlocks {
    first: usize,
    per_row: usize,
    size: [u32; 2],
}

/// All images of a scene.
pub struct PointTextures {
    places: Vec<ImageBlocks>,
    blocks: Vec<Block>,
}

impl PointTextures {
    pub fn new(scene: &Scene) -> Self {
        let blocks = |size: u32| (size as usize).div_ceil(SIDE);
        let total = scene.images.iter().map(|image| blocks(image.width) * blocks(image.height)).sum();
        let mut points = Self { places: Vec::new(), blocks: memory::huge_page_vec(total) };
        for image in &scene.images {
            let (first, per_row) = (points.blocks.len(), blocks(image.width));
            points.blocks.resize(first + per_row * blocks(image.height), Block::default());
            for (y, row) in image.rgba.chunks_exact(4 * image.width.max(1) as usize).enumerate() {
                for (x, texel) in row.chunks_exact(4).enumerate() {
                    let block = &mut points.blocks[first + y / SIDE * per_row + x / SIDE];
                    block.0[y % SIDE][x % SIDE].copy_from_slice(texel);
                }
            }
            points.places.push(ImageBlocks { first, per_row, size: [image.width, image.height] });
        }
        points
    }

    fn block(&self, place: &ImageBlocks, x: usize, y: usize) -> &Block {
        &self.blocks[place.first + y / SIDE * place.per_row + x / SIDE]
    }

    /// Prefetches the texels that [`Self::sample`] will read, so that the loads of several textures overlap.
    pub fn prefetch(&self, scene: &Scene, slot: &TextureRef, uvs: [Vec2; 2]) {
        let texture = &scene.textures[slot.texture];
        let place = &self.places[texture.image];
        let uv = slot.transform.transform_point2(uvs[slot.uv_set]);
        Lookup { texture, uv, linear: false }.filtered(place.size, |x, y| {
            memory::prefetch(self.block(place, x, y));
            Vec4::ZERO
        });
    }
}

impl Sampling for PointTextures {
    /// Ignores the footprint.
    fn sample(&self, scene: &Scene, slot: Option<&TextureRef>, space: ColorSpace, point: &SurfacePoint) -> Vec4 {
        let Some(slot) = slot else { return Vec4::ONE };
        let texture = &scene.textures[slot.texture];
        let place = &self.places[texture.image];
        let (color, alpha) = (space.table(), ColorSpace::Linear.table());
        let uv = slot.transform.transform_point2(point.uvs[slot.uv_set]);
        Lookup { texture, uv, linear: texture.mag_linear }.filtered(place.size, |x, y| {
            let block = self.block(place, x, y);
            let [r, g, b, a] = block.0[y % SIDE][x % SIDE];
            Vec4::new(color[r as usize], color[g as usize], color[b as usize], alpha[a as usize])
        })
    }
}
