//! What recorded triangles have at their corners beside positions: `glsl/ground/attributes.glsl` is the twin.
//!
//! Words one after another, corner by corner: normal (3 × f32), then tangent (4), first and second set of uv (2 each) and colour
//! (4 × f16), each only if the scene's materials read it. Rays and voxels read positions alone, which lie close together for them.

use super::constants::Features;

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

impl CornerWords {
    pub fn of(features: Features) -> Self {
        let mut count = 3;
        let mut place = |words: usize| {
            count += words;
            (words > 0).then(|| count - words)
        };
        let words = |words: usize, feature: Features| if features.has(feature) { words } else { 0 };
        let tangent = place(words(4, Features::texture_slot(NORMAL_SLOT)));
        let uv = place(words(2, Features::TEXTURES) + words(2, Features::SECOND_UV));
        let color = place(words(2, Features::COLORS));
        Self { tangent, uv, color, count }
    }
}
