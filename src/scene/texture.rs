//! Mip chains and their sampling on the CPU. The GPU uses the same bytes.
//!
//! Levels are filtered in linear light: sRGB colours are decoded, box-filtered in f32 and encoded again; alpha is
//! always linear. Each level is computed from the values of the level above before their rounding to 8 bits.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::LazyLock;

use glam::{Vec2, Vec4};
use rayon::prelude::*;

pub use crate::color::{linear_from_srgb, srgb_from_linear};

use super::surface::SurfacePoint;
use super::{Material, Mip, Scene, Texture, TextureImage, TextureRef, Wrap};

/// The encoding of a slot's texels. One image may be used with both encodings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ColorSpace {
    /// Red, green and blue are sRGB-encoded; alpha is linear.
    Srgb,
    Linear,
}

static SRGB_BYTES: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|b| linear_from_srgb(b as f32 / 255.0)));
static LINEAR_BYTES: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|b| b as f32 / 255.0));

impl ColorSpace {
    /// The linear value of each byte of a colour channel.
    pub fn table(self) -> &'static [f32; 256] {
        match self {
            Self::Srgb => &SRGB_BYTES,
            Self::Linear => &LINEAR_BYTES,
        }
    }

    fn encode(self, texel: Vec4) -> [u8; 4] {
        if self == Self::Linear {
            return [byte(texel.x), byte(texel.y), byte(texel.z), byte(texel.w)];
        }
        let least = LazyLock::force(&SRGB_LEAST);
        [srgb_byte(least, texel.x), srgb_byte(least, texel.y), srgb_byte(least, texel.z), byte(texel.w)]
    }
}

/// The nearest byte to a value in [0, 1].
#[inline(always)]
fn byte(x: f32) -> u8 {
    (x.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

/// The smallest linear value that rounds to each byte of an sRGB-encoded colour.
static SRGB_LEAST: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|b| {
        // Positive numbers have the order of their bits.
        let (mut below, mut at) = (0, 1_f32.to_bits());
        while below < at {
            let middle = below.midpoint(at);
            if usize::from(byte(srgb_from_linear(f32::from_bits(middle)))) < b {
                below = middle + 1
            } else {
                at = middle
            }
        }
        f32::from_bits(at)
    })
});

/// `byte(srgb_from_linear(x))` without a power function, which would dominate the time of mip generation.
#[inline(always)]
fn srgb_byte(least: &[f32; 256], x: f32) -> u8 {
    (least[1..].partition_point(|&least| least <= x)) as u8
}

/// One level: 8-bit RGBA, rows from the top, in the encoding of the image.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    pub width: u32,
    pub height: u32,
    /// 4 · width · height bytes.
    pub rgba: Vec<u8>,
}

/// An image and all its levels down to 1×1. Each has half the size of the level above, rounded down (Vulkan's rule).
#[derive(Clone, Debug)]
pub struct MipChain {
    pub space: ColorSpace,
    pub levels: Vec<Level>,
}

impl MipChain {
    pub fn new(image: &TextureImage, space: ColorSpace) -> Self {
        let mut levels = vec![Level { width: image.width, height: image.height, rgba: image.rgba.clone() }];
        let mut size = [image.width as usize, image.height as usize];
        let mut texels: Vec<Vec4> = Vec::new();
        while size[0].max(size[1]) > 1 {
            let half = size.map(|n| (n / 2).max(1));
            texels = match levels.len() {
                1 => {
                    let table = space.table();
                    halved(size, half, |at| decode(table, &image.rgba[4 * at..4 * at + 4]))
                }
                _ => halved(size, half, |at| texels[at]),
            };
            size = half;
            let mut rgba = Vec::with_capacity(4 * texels.len());
            texels.iter().for_each(|&t| rgba.extend_from_slice(&space.encode(t)));
            levels.push(Level { width: size[0] as u32, height: size[1] as u32, rgba });
        }
        Self { space, levels }
    }

    /// Linear colour and alpha at `uv` with the filters of `texture`. `level` is log₂ of the footprint in texels of
    /// level 0; the magnification filter applies at 0 and below (Vulkan's rule).
    pub fn sample(&self, texture: &Texture, uv: Vec2, level: f32) -> Vec4 {
        let last = (self.levels.len() - 1) as f32;
        let sample = |level: usize, linear: bool| {
            let level = &self.levels[level];
            Lookup { texture, uv, linear }.filtered([level.width, level.height], |column, row| {
                let at = 4 * (row * level.width as usize + column);
                decode(self.space.table(), &level.rgba[at..at + 4])
            })
        };
        if level <= 0.0 {
            return sample(0, texture.mag_linear);
        }
        let level = level.min(last);
        match texture.mip {
            Mip::None => sample(0, texture.min_linear),
            Mip::Nearest => sample((level + 0.5).ceil() as usize - 1, texture.min_linear),
            Mip::Linear => {
                let fine = sample(level as usize, texture.min_linear);
                if level.fract() == 0.0 {
                    return fine;
                }
                fine.lerp(sample(level as usize + 1, texture.min_linear), level.fract())
            }
        }
    }
}

/// One lookup in one level of a texture.
#[derive(Clone, Copy)]
pub struct Lookup<'a> {
    pub texture: &'a Texture,
    pub uv: Vec2,
    /// Whether the lookup is bilinear between four texels; otherwise it takes the nearest texel.
    pub linear: bool,
}

impl Lookup<'_> {
    /// The filtered value in an image of `size` texels; `texel` returns a texel by column and row.
    #[inline]
    pub fn filtered(self, size: [u32; 2], texel: impl Fn(usize, usize) -> Vec4) -> Vec4 {
        let Self { texture, uv, linear } = self;
        // Whole periods do not change the result, but cost precision far from 0.
        let reduce = |wrap: Wrap, x: f32| match wrap {
            Wrap::Repeat => x - x.floor(),
            Wrap::Mirror => x - 2.0 * (0.5 * x).floor(),
            Wrap::Clamp => x.clamp(-1.0, 2.0),
        };
        let reduced = Vec2::new(reduce(texture.wrap[0], uv.x), reduce(texture.wrap[1], uv.y));
        let at = reduced * Vec2::new(size[0] as f32, size[1] as f32);
        let column = |x: f32| wrap(texture.wrap[0], x, size[0]);
        let row = |y: f32| wrap(texture.wrap[1], y, size[1]);
        if !linear {
            return texel(column(at.x.floor()), row(at.y.floor()));
        }
        let corner = (at - 0.5).floor();
        let part = at - 0.5 - corner;
        let (columns, rows) = ([corner.x, corner.x + 1.0].map(column), [corner.y, corner.y + 1.0].map(row));
        let mixed = |row: usize| texel(columns[0], row).lerp(texel(columns[1], row), part.x);
        mixed(rows[0]).lerp(mixed(rows[1]), part.y)
    }
}

/// `table` is from [`ColorSpace::table`]. The function is inlined, because it dominates the time of mip generation.
#[inline(always)]
fn decode(table: &[f32; 256], texel: &[u8]) -> Vec4 {
    Vec4::new(
        table[usize::from(texel[0])],
        table[usize::from(texel[1])],
        table[usize::from(texel[2])],
        f32::from(texel[3]) / 255.0,
    )
}

/// The texel at coordinate `x` in a row of `size` texels. `x` is a whole number at most one texel outside the reduced
/// range of [`Lookup::filtered`], so no division is needed.
#[inline]
fn wrap(wrap: Wrap, x: f32, size: u32) -> usize {
    let (x, size) = (x as i32, size as i32);
    let wrap_once = |x: i32, size: i32| {
        if x < 0 {
            x + size
        } else if x >= size {
            x - size
        } else {
            x
        }
    };
    let texel = match wrap {
        Wrap::Repeat => wrap_once(x, size),
        Wrap::Mirror => {
            let x = wrap_once(x, 2 * size);
            x.min(2 * size - 1 - x)
        }
        Wrap::Clamp => x.clamp(0, size - 1),
    };
    texel as usize
}

/// The next level in linear light. `texel` returns texels of this level by number, row by row, and the sizes are those
/// of this and the next level. Each new texel is the mean over the area that it covers. For odd sizes that includes
/// parts of texels, so that no row or column is lost and the image does not shift.
fn halved(size: [usize; 2], half: [usize; 2], texel: impl Fn(usize) -> Vec4) -> Vec<Vec4> {
    // Most sizes are even. This gives the same sums without lists of covered texels.
    if size == half.map(|n| 2 * n) {
        let pair = |at: usize| (texel(at) * 0.5 + texel(at + 1) * 0.5) * 0.5;
        let mean = |x: usize, y: usize| pair(2 * (y * size[0] + x)) + pair((2 * y + 1) * size[0] + 2 * x);
        let mut texels = Vec::with_capacity(half[0] * half[1]);
        for y in 0..half[1] {
            for x in 0..half[0] {
                texels.push(mean(x, y));
            }
        }
        return texels;
    }
    let [columns, rows] =
        [0, 1].map(|axis| (0..half[axis]).map(|i| coverage(i, size[axis], half[axis])).collect::<Vec<_>>());
    let row_sum = |taps: &[(usize, f32)], row: usize| -> Vec4 {
        taps.iter().map(|&(x, weight)| texel(row * size[0] + x) * weight).sum()
    };
    let mean = |x: usize, y: usize| rows[y].iter().map(|&(row, weight)| row_sum(&columns[x], row) * weight).sum();
    (0..half[0] * half[1]).map(|at| mean(at % half[0], at / half[0])).collect()
}

/// The old texels that new texel `i` covers, and their weights. In integers, an old texel is `to` wide and a new one
/// `from`.
fn coverage(i: usize, from: usize, to: usize) -> Vec<(usize, f32)> {
    let (start, end) = (i * from, (i + 1) * from);
    let covered = |x: usize| ((x + 1) * to).min(end) - (x * to).max(start);
    (start / to..end.div_ceil(to)).map(|x| (x, covered(x) as f32 / from as f32)).collect()
}

/// The mip chains of a scene: one for each image and colour space that materials use.
#[derive(Clone, Debug, Default)]
pub struct Textures {
    chains: BTreeMap<(usize, ColorSpace), MipChain>,
}

impl Textures {
    /// Computes the mip chains that `materials` use, in parallel.
    pub fn of_materials<'m>(scene: &Scene, materials: impl IntoIterator<Item = &'m Material>) -> Self {
        let slots = materials.into_iter().flat_map(Material::texture_slots);
        let used: BTreeSet<_> = slots.map(|(slot, space)| (scene.textures[slot.texture].image, space)).collect();
        let make = |key: (usize, ColorSpace)| (key, MipChain::new(&scene.images[key.0], key.1));
        Self { chains: used.into_par_iter().map(make).collect() }
    }
}

/// Texture sampling for the evaluation of materials.
pub trait Sampling {
    /// The texture of `slot` at the point's uv, filtered over its footprint; white without a texture, so that only the
    /// factor counts.
    fn sample(&self, scene: &Scene, slot: Option<&TextureRef>, space: ColorSpace, point: &SurfacePoint) -> Vec4;
}

impl Sampling for Textures {
    fn sample(&self, scene: &Scene, slot: Option<&TextureRef>, space: ColorSpace, point: &SurfacePoint) -> Vec4 {
        let Some(slot) = slot else { return Vec4::ONE };
        let texture = &scene.textures[slot.texture];
        let Some(chain) = self.chains.get(&(texture.image, space)) else { return Vec4::ONE };
        let uv = slot.transform.transform_point2(point.uvs[slot.uv_set]);
        chain.sample(texture, uv, slot.level(&scene.images[texture.image], point.footprint[slot.uv_set]))
    }
}

impl TextureRef {
    /// The mip level at which a square of `footprint` uv units (before the transform) is one texel wide in the
    /// geometric mean of both axes. Not clamped; −∞ for a footprint of 0.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn level(&self, image: &TextureImage, footprint: f32) -> f32 {
        let texels = image.width as f32 * image.height as f32 * self.transform.matrix2.determinant().abs();
        (footprint * texels.sqrt()).log2()
    }
}

impl Material {
    /// The texture slots that the device reads, in the renderer's fixed order, with the colour space of each.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn slots(&self) -> [(Option<TextureRef>, ColorSpace); 8] {
        use ColorSpace::{Linear, Srgb};
        [
            (self.base_color_texture, Srgb),
            (self.metallic_roughness_texture, Linear),
            (self.normal_texture, Linear),
            (self.emissive_texture, Srgb),
            (self.specular_texture, Linear),
            (self.specular_color_texture, Srgb),
            (self.transmission_texture, Linear),
            (self.thickness_texture, Linear),
        ]
    }

    /// Every drawn texture and the colour space of its slot.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn drawn_slots(&self) -> impl Iterator<Item = (TextureRef, ColorSpace)> {
        let finish = self.finish.iter().flat_map(|finish| finish.slots());
        self.slots().into_iter().chain(finish).filter_map(|(slot, space)| Some((slot?, space)))
    }

    /// Every used texture and the colour space of its slot, including occlusion, which is read and not drawn.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn texture_slots(&self) -> impl Iterator<Item = (TextureRef, ColorSpace)> {
        self.drawn_slots().chain(self.occlusion_texture.map(|slot| (slot, ColorSpace::Linear)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_bytes_by_search_are_those_of_the_formula() {
        let least = &*SRGB_LEAST;
        let even = (0..=1_000_000).map(|i| i as f32 / 1e6);
        let about_steps =
            least.iter().flat_map(|x| (-3..=3).map(|i: i32| f32::from_bits(x.to_bits().saturating_add_signed(i))));
        for x in even.chain(about_steps).chain([-1.0, 1.5]) {
            assert_eq!(srgb_byte(least, x), byte(srgb_from_linear(x.clamp(0.0, 1.0))), "{x}");
        }
    }
}
