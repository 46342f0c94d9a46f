//! Attributes of recorded triangles at their corners, besides positions: `glsl/ground/attributes.glsl` is the twin.
//!
//! Words one after another, corner by corner: normal (3 × f32), then tangent (4), first and second set of uv (2 each)
//! and colour (4 × f16), each only if the scene's materials read it. Rays and voxels read positions alone, which lie
//! close together for them. The scene's own vertices are the same words, behind a position in object space.

use glam::Vec4;

use super::constants::Features;
use crate::scene::Mesh;
use crate::vk::Format;

/// Slot of normal textures in `layout::Material::slots`.
const NORMAL_SLOT: usize = 2;

/// Words of a corner, and where among them tangent, uv and colour begin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CornerWords {
    pub tangent: Option<usize>,
    /// Four words where both sets are there.
    pub uv: Option<usize>,
    pub color: Option<usize>,
    pub count: usize,
}

/// Of a vertex of the scene.
const POSITION_WORDS: usize = 3;

impl CornerWords {
    pub fn of_features(features: Features) -> Self {
        let mut count = 3;
        let mut place = |words: usize| {
            count += words;
            (words > 0).then(|| count - words)
        };
        let words = |words: usize, feature: Features| if features.has(feature) { words } else { 0 };
        let tangent = place(words(4, Features(Features::texture_slot(NORMAL_SLOT).0 | Features::TANGENTS.0)));
        let textures = Features(Features::TEXTURES.0 | Features::FINISH_TEXTURES.0);
        let uv = place(words(2, textures) + words(2, Features::SECOND_UV));
        let color = place(words(2, Features::COLORS));
        Self { tangent, uv, color, count }
    }

    /// The words of a recorded triangle's corner, out of those of all.
    fn of_corner<'a>(&self, words: &'a [u32], triangle: usize, corner: usize) -> &'a [u32] {
        &words[(3 * triangle + corner) * self.count..][..self.count]
    }

    /// In voxels, unit.
    pub fn normal(&self, words: &[u32], triangle: usize, corner: usize) -> [f32; 3] {
        let words = self.of_corner(words, triangle, corner);
        [0, 1, 2].map(|k| f32::from_bits(words[k]))
    }

    /// Both sets; 0 where the scene needs none.
    pub fn uv(&self, words: &[u32], triangle: usize, corner: usize) -> [f32; 4] {
        let Some(first) = self.uv else { return [0.0; 4] };
        let words = &self.of_corner(words, triangle, corner)[first..self.color.unwrap_or(self.count)];
        [0, 1, 2, 3].map(|k| words.get(k).map_or(0.0, |&word| f32::from_bits(word)))
    }

    /// White where the scene needs none.
    pub fn color(&self, words: &[u32], triangle: usize, corner: usize) -> [f32; 4] {
        let Some(first) = self.color else { return [1.0; 4] };
        let words = &self.of_corner(words, triangle, corner)[first..];
        [0, 1, 2, 3].map(|k| half::f16::from_bits((words[k / 2] >> (16 * (k % 2))) as u16).to_f32())
    }

    /// Bytes of a vertex of the scene.
    pub fn vertex_bytes(&self) -> usize {
        4 * (POSITION_WORDS + self.count)
    }

    /// How the recording pass reads vertices: location, format, offset in bytes. What is not there is read from where
    /// something else is, and not used.
    pub fn vertex_input(&self) -> [(u32, Format, u32); 5] {
        let at = |place: Option<usize>| place.map_or(0, |place| 4 * (POSITION_WORDS + place) as u32);
        let both_sets = self.uv.is_some_and(|uv| self.color.unwrap_or(self.count) - uv > 2);
        let uv = if both_sets { Format::R32G32B32A32_SFLOAT } else { Format::R32G32_SFLOAT };
        [
            (0, Format::R32G32B32_SFLOAT, 0),
            (1, Format::R32G32B32_SFLOAT, at(Some(0))),
            (2, Format::R32G32B32A32_SFLOAT, at(self.tangent)),
            (3, uv, at(self.uv)),
            (4, Format::R16G16B16A16_SFLOAT, at(self.color)),
        ]
    }

    /// The vertices of a mesh, one after another.
    pub fn vertices_of(&self, mesh: &Mesh) -> Vec<u32> {
        let mut words = Vec::with_capacity(mesh.positions.len() * (POSITION_WORDS + self.count));
        let both_sets = self.vertex_input()[3].1 == Format::R32G32B32A32_SFLOAT;
        for i in 0..mesh.positions.len() {
            let mut put = |values: &[f32]| words.extend(values.iter().map(|value| value.to_bits()));
            put(&mesh.positions[i].to_array());
            put(&mesh.normals[i].to_array());
            if self.tangent.is_some() {
                put(&mesh.tangents[i].to_array());
            }
            let sets = [self.uv.is_some(), both_sets];
            for (set, _) in mesh.uvs.iter().zip(sets).filter(|(_, there)| *there) {
                put(&set[i].to_array());
            }
            if self.color.is_some() {
                words.extend(half4(mesh.colors[i]));
            }
        }
        words
    }
}

fn half4(v: Vec4) -> [u32; 2] {
    let pair = |a: f32, b: f32| {
        u32::from(half::f16::from_f32(a).to_bits()) | u32::from(half::f16::from_f32(b).to_bits()) << 16
    };
    [pair(v.x, v.y), pair(v.z, v.w)]
}
