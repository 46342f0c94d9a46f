//! Textures looked up at points: the images alone, without mips, laid out so that neighbouring texels share a cache line.

use glam::{Vec2, Vec4};

use super::large;
use crate::scene::texture::{ColorSpace, Sampling, filtered};
use crate::scene::{Scene, TextureRef};

/// Texels along each side of a block.
const SIDE: usize = 4;

/// A cache line of texels.
#[derive(Clone, Copy, Default)]
#[repr(C, align(64))]
struct Block([[[u8; 4]; SIDE]; SIDE]);

/// Where an image's blocks lie.
struct Place {
    first: usize,
    per_row: usize,
    size: [u32; 2],
}

/// Every image of a scene.
pub struct Points {
    places: Vec<Place>,
    blocks: Vec<Block>,
}

impl Points {
    pub fn new(scene: &Scene) -> Self {
        let blocks = |size: u32| (size as usize).div_ceil(SIDE);
        let total = scene.images.iter().map(|image| blocks(image.width) * blocks(image.height)).sum();
        let mut points = Self { places: Vec::new(), blocks: large::vec(total) };
        for image in &scene.images {
            let (first, per_row) = (points.blocks.len(), blocks(image.width));
            points.blocks.resize(first + per_row * blocks(image.height), Block::default());
            for (y, row) in image.rgba.chunks_exact(4 * image.width.max(1) as usize).enumerate() {
                for (x, texel) in row.chunks_exact(4).enumerate() {
                    let block = &mut points.blocks[first + y / SIDE * per_row + x / SIDE];
                    block.0[y % SIDE][x % SIDE].copy_from_slice(texel);
                }
            }
            points.places.push(Place { first, per_row, size: [image.width, image.height] });
        }
        points
    }
}

impl Points {
    fn block(&self, place: &Place, x: usize, y: usize) -> &Block {
        &self.blocks[place.first + y / SIDE * place.per_row + x / SIDE]
    }

    /// Announces what [`Self::sample`] will read: waiting for one texture after the other takes longer.
    pub fn announce(&self, scene: &Scene, slot: &TextureRef, uvs: [Vec2; 2]) {
        let texture = &scene.textures[slot.texture];
        let place = &self.places[texture.image];
        filtered(texture, slot.transform.transform_point2(uvs[slot.uv_set]), place.size, false, |x, y| {
            large::announce(self.block(place, x, y));
            Vec4::ZERO
        });
    }
}

impl Sampling for Points {
    /// At a point: the footprint is not looked at.
    fn sample(&self, scene: &Scene, slot: Option<&TextureRef>, space: ColorSpace, uvs: [Vec2; 2], _: [f32; 2]) -> Vec4 {
        let Some(slot) = slot else { return Vec4::ONE };
        let texture = &scene.textures[slot.texture];
        let place = &self.places[texture.image];
        let (color, alpha) = (space.table(), ColorSpace::Linear.table());
        filtered(texture, slot.transform.transform_point2(uvs[slot.uv_set]), place.size, texture.mag_linear, |x, y| {
            let block = self.block(place, x, y);
            let [r, g, b, a] = block.0[y % SIDE][x % SIDE];
            Vec4::new(color[r as usize], color[g as usize], color[b as usize], alpha[a as usize])
        })
    }
}
