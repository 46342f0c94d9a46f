//! Attributes of recorded triangles at their corners, except positions: `glsl/ground/attributes.glsl` is the twin.
//!
//! The words of each corner follow one another: normal (3 × f32), tangent (4), first and second set of uv (2 each) and
//! colour (4 × f16), each only if the scene's materials read it. Rays and voxels read positions alone, which are stored
//! contiguously for them. Vertices of the scene have the same words after a position in object space.

use glam::Vec4;

use super::constants::Features;
use crate::scene::Mesh;
use crate::vk::Format;

/// Slot of normal textures in `layout::Material::slots`.
const NORMAL_SLOT: usize = 2;

/// The number of words of a corner, and the offsets of tangent, uv and colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CornerWords {
    pub tangent: Option<usize>,
    /// The offset of the uv sets: four words if both are present.
    pub uv: Option<usize>,
    pub color: Option<usize>,
    pub count: usize,
}

/// Words of the position of a scene vertex.
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

    /// The words of one corner of a recorded triangle, from the words of all triangles.
    fn of_corner<'a>(&self, words: &'a [u32], triangle: usize, corner: usize) -> &'a [u32] {
        &words[(3 * triangle + corner) * self.count..][..self.count]
    }

    /// The unit normal in voxels.
    pub fn normal(&self, words: &[u32], triangle: usize, corner: usize) -> [f32; 3] {
        let words = self.of_corner(words, triangle, corner);
        [0, 1, 2].map(|k| f32::from_bits(words[k]))
    }

    /// Both sets of uv; 0 if the scene does not need them.
    pub fn uv(&self, words: &[u32], triangle: usize, corner: usize) -> [f32; 4] {
        let Some(first) = self.uv else { return [0.0; 4] };
        let words = &self.of_corner(words, triangle, corner)[first..self.color.unwrap_or(self.count)];
        [0, 1, 2, 3].map(|k| words.get(k).map_or(0.0, |&word| f32::from_bits(word)))
    }

    /// The vertex colour; white if the scene does not need it.
    pub fn color(&self, words: &[u32], triangle: usize, corner: usize) -> [f32; 4] {
        let Some(first) = self.color else { return [1.0; 4] };
        let words = &self.of_corner(words, triangle, corner)[first..];
        [0, 1, 2, 3].map(|k| half::f16::from_bits((words[k / 2] >> (16 * (k % 2))) as u16).to_f32())
    }

    /// Bytes of a scene vertex.
    pub fn vertex_bytes(&self) -> usize {
        4 * (POSITION_WORDS + self.count)
    }

    /// Vertex input of the recording pass: location, format, and offset in bytes. A missing attribute reads another
    /// one, and is not used.
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

    /// The vertices of a mesh, in order.
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
