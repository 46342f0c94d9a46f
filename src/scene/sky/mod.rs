//! A sky from an equirectangular map: its texels, the radiance along a direction, and the parts that renderers use: the
//! bright part as lights (`bright`) and the rest as averages over cones (`levels`). `file` and `hdr` read maps.
//!
//! The middle of a map is towards +X, the direction to its right is +Z, and its top is +Y, as in three.js, Blender's
//! exporter and the Khronos sample viewer.

mod bright;
mod file;
mod hdr;
mod levels;

use std::f64::consts::{PI, TAU};
use std::fmt;
use std::sync::Arc;

use glam::{DMat3, DVec3, Vec3};

use super::Scene;
#[cfg_attr(not(internals), doc(hidden))]
pub use bright::SkyLight;
pub use file::read;

/// The maximum number of texels of a map: 4096 × 2048, 32 MiB on a device. Larger ones are halved.
#[cfg_attr(not(internals), doc(hidden))]
pub const MOST_TEXELS: usize = 1 << 23;

/// An equirectangular image before it is a sky: rows from the top, linear radiance.
#[derive(Clone, Debug, PartialEq)]
pub struct Panorama {
    pub width: usize,
    pub height: usize,
    /// `width · height`, finite and at least 0.
    pub radiance: Vec<Vec3>,
}

/// An immutable map that is a scene's sky. [`Scene::sky_turn`] is its rotation.
pub struct SkyMap {
    pub width: usize,
    pub height: usize,
    /// RGB9E5 (Vulkan's `E5B9G9R9_UFLOAT_PACK32`), rows from the top: 9 bits a channel with the exponent of the
    /// largest. The texels are followed by the levels of the map without its bright part.
    pub words: Vec<u32>,
    /// The number of levels.
    pub levels: usize,
    /// The radiance that an unpacked 1 represents.
    pub scale: f32,
    /// The largest unpacked channel of the map without its bright part, which [`Self::lights`] represent. Infinite
    /// without a bright part.
    pub most: f32,
    /// Lights that represent the bright part of the map without rotation.
    pub lights: Vec<SkyLight>,
    /// Mean radiance over all directions.
    pub mean: Vec3,
    /// Mean radiance over all directions without the bright part.
    pub mean_of_rest: Vec3,
    /// Hash of the texels and the scale.
    pub hash: blake3::Hash,
}

/// Maps are equal if they have the same texels and scale.
impl PartialEq for SkyMap {
    fn eq(&self, other: &Self) -> bool {
        self.hash == other.hash
    }
}

impl fmt::Debug for SkyMap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "SkyMap({}x{}, {} lights, {})", self.width, self.height, self.lights.len(), self.hash)
    }
}

impl SkyMap {
    /// A sky from a map; `None` for a black map.
    pub fn new(panorama: Panorama, intensity: f32) -> Option<Self> {
        let Panorama { width, height, radiance } = panorama;
        let brightest = radiance.iter().map(|c| c.max_element()).fold(0.0, f32::max);
        if brightest * intensity <= 0.0 {
            return None;
        }
        // A power of two moves the brightest texel to the top of the format's range.
        let unit = (f64::from(brightest) / f64::from(LARGEST)).log2().ceil().exp2();
        let mut words: Vec<u32> = radiance.iter().map(|c| pack((c.as_dvec3() / unit).as_vec3())).collect();
        drop(radiance);
        let scale = (unit * f64::from(intensity)) as f32;
        let texels = Texels { width, height, words: &words };
        let (most, mut lights) = bright::part(&texels);
        lights.iter_mut().for_each(|light| light.irradiance *= scale);
        let (levels, packed) = levels::make(&texels, most);
        let mean = |most: f32| texels.mean(most).as_vec3() * scale;
        let (mean, mean_of_rest) = (mean(f32::INFINITY), mean(most));
        let mut hasher = blake3::Hasher::new();
        hasher.update(&(width as u64).to_le_bytes()).update(&scale.to_le_bytes());
        hasher.update(bytemuck::cast_slice(&words));
        words.extend(packed);
        Some(Self { width, height, words, levels, scale, most, lights, mean, mean_of_rest, hash: hasher.finalize() })
    }

    /// The texels of the map, which are unpacked with its scale.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn texels(&self) -> Texels<'_> {
        Texels { width: self.width, height: self.height, words: &self.words[..self.width * self.height] }
    }

    /// The largest channel of radiance without the bright part.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn brightest_of_rest(&self) -> f32 {
        self.scale * self.most.min(LARGEST)
    }

    /// Radiance towards the unit vector d of the map without rotation, bilinearly filtered.
    pub fn towards(&self, d: Vec3) -> Vec3 {
        self.scale * self.texels().at(place(d), f32::INFINITY)
    }
}

/// Largest channel that is packed: 2¹⁶ − 2⁷.
const LARGEST: f32 = 65408.0;

/// RGB9E5 of channels from 0 to [`LARGEST`], each rounded to nearest.
fn pack(rgb: Vec3) -> u32 {
    let rgb = rgb.clamp(Vec3::ZERO, Vec3::splat(LARGEST));
    let largest = rgb.max_element();
    // The exponent of the largest channel: 2^exponent exceeds the channel and is at most twice as large.
    let exponent = |c: f32| (16 + c.max(1e-30).log2().floor() as i32).max(0);
    let rounded = |exponent: i32| (rgb / f32::exp2((exponent - 24) as f32)).round();
    let mut e = exponent(largest);
    if rounded(e).max_element() >= 512.0 {
        e += 1;
    }
    let c = rounded(e).as_uvec3();
    c.x | c.y << 9 | c.z << 18 | (e as u32) << 27
}

fn unpack(word: u32) -> Vec3 {
    let channel = |shift: u32| (word >> shift & 511) as f32;
    Vec3::new(channel(0), channel(9), channel(18)) * f32::from_bits(((word >> 27) + 103) << 23)
}

/// The position of the unit vector d in a map: across from 0 to 1, and down from 0 to 1.
#[cfg_attr(not(internals), doc(hidden))]
pub fn place(d: Vec3) -> [f32; 2] {
    let down = d.x.hypot(d.z).atan2(d.y) / std::f32::consts::PI;
    [0.5 + d.z.atan2(d.x) / std::f32::consts::TAU, down]
}

/// The unit direction of such a position.
#[cfg_attr(not(internals), doc(hidden))]
pub fn direction(across: f64, down: f64) -> DVec3 {
    let ((sin, cos), (out, up)) = ((TAU * (across - 0.5)).sin_cos(), (PI * down).sin_cos());
    DVec3::new(out * cos, up, out * sin)
}

/// The direction of the middle of texel (x, y) in a map of `size` columns and rows.
pub(super) fn middle(x: usize, y: usize, size: [usize; 2]) -> DVec3 {
    direction((x as f64 + 0.5) / size[0] as f64, (y as f64 + 0.5) / size[1] as f64)
}

/// The texels of a map, or of one of its levels.
#[derive(Clone, Copy)]
#[cfg_attr(not(internals), doc(hidden))]
pub struct Texels<'a> {
    pub width: usize,
    pub height: usize,
    words: &'a [u32],
}

impl Texels<'_> {
    pub fn get(&self, x: usize, y: usize) -> Vec3 {
        unpack(self.words[y * self.width + x])
    }

    /// The texel, dimmed where a channel is brighter than `most` until none is.
    pub fn dimmed(&self, x: usize, y: usize, most: f32) -> Vec3 {
        let texel = self.get(x, y);
        let largest = texel.max_element();
        if largest > most { texel * (most / largest) } else { texel }
    }

    /// Solid angle of a texel in row y, sr.
    pub fn solid_angle(&self, y: usize) -> f64 {
        solid_angle(self.width, self.height, y)
    }

    /// Bilinear interpolation of the four texels around a position, dimmed to `most`; the map wraps around
    /// horizontally.
    pub fn at(&self, [across, down]: [f32; 2], most: f32) -> Vec3 {
        let (x, y) = (across * self.width as f32 - 0.5, down * self.height as f32 - 0.5);
        let (left, above) = (x.floor(), y.floor());
        let column = |x: f32| (x as isize).rem_euclid(self.width as isize) as usize;
        let row = |y: f32| (y.max(0.0) as usize).min(self.height - 1);
        let between = |a: Vec3, b: Vec3, t: f32| a + (b - a) * t;
        let texel = |x: f32, y: usize| self.dimmed(column(x), y, most);
        let in_row = |y: usize| between(texel(left, y), texel(left + 1.0, y), x - left);
        between(in_row(row(above)), in_row(row(above + 1.0)), y - above)
    }

    /// Mean over all directions, dimmed to `most`.
    fn mean(&self, most: f32) -> DVec3 {
        let row = |y: usize| (0..self.width).map(|x| self.dimmed(x, y, most).as_dvec3()).sum::<DVec3>();
        (0..self.height).map(|y| row(y) * self.solid_angle(y)).sum::<DVec3>() / (2.0 * TAU)
    }

    /// Mean of the texels in block `place` (x, y) of `blocks` blocks across and down, dimmed to `most`.
    fn block_mean(&self, place: [usize; 2], blocks: [usize; 2], most: f32) -> Vec3 {
        let part =
            |axis: usize, size: usize| place[axis] * size / blocks[axis]..(place[axis] + 1) * size / blocks[axis];
        let (across, down) = (part(0, self.width), part(1, self.height));
        let count = across.len() * down.len();
        let texels = down.flat_map(|y| across.clone().map(move |x| self.dimmed(x, y, most)));
        texels.sum::<Vec3>() / count as f32
    }
}

/// Solid angle of a texel in row y of a map of that size, sr.
pub(super) fn solid_angle(width: usize, height: usize, y: usize) -> f64 {
    let above = |row: usize| (PI * row as f64 / height as f64).cos();
    TAU / width as f64 * (above(y) - above(y + 1))
}

impl Scene {
    /// Sets a map as the sky, multiplied by `intensity` and rotated counter-clockwise, seen from above, by `turned`
    /// degrees. A constant map becomes an even sky.
    pub fn set_sky_map(&mut self, panorama: Panorama, intensity: f32, turned: f64) {
        let first = panorama.radiance.first().copied().unwrap_or_default();
        let even = panorama.radiance.iter().all(|c| *c == first);
        let map = if even { None } else { SkyMap::new(panorama, intensity) };
        (self.sky, self.sky_gradient) = (first * intensity, Vec3::ZERO);
        if !even {
            self.sky = map.as_ref().map_or(Vec3::ZERO, |map| map.mean);
        }
        self.sky_map = map.map(Arc::new);
        self.sky_turn = (turned / 360.0).rem_euclid(1.0) as f32;
    }

    /// The rotation from the sky's map to the world.
    pub fn sky_rotation(&self) -> DMat3 {
        DMat3::from_rotation_y(TAU * f64::from(self.sky_turn))
    }

    /// Lights that represent the bright part of the rotated map.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn sky_lights(&self) -> impl Iterator<Item = SkyLight> {
        let rotation = self.sky_rotation();
        let lights = self.sky_map.iter().flat_map(|map| &map.lights);
        lights.map(move |light| SkyLight { towards: rotation * light.towards, ..*light })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The sky of a map with the radiance `radiance(d)` towards the unit vector d.
    pub fn sky_of(width: usize, height: usize, radiance: impl Fn(DVec3) -> Vec3) -> SkyMap {
        let texel = |i: usize| radiance(middle(i % width, i / width, [width, height]));
        let radiance = (0..width * height).map(texel).collect();
        SkyMap::new(Panorama { width, height, radiance }, 1.0).expect("not black")
    }

    #[test]
    fn packing_keeps_nine_bits_of_the_largest_channel() {
        for rgb in
            [Vec3::new(1.0, 0.5, 0.25), Vec3::new(65408.0, 1.0, 0.0), Vec3::new(3e-4, 2.9e-4, 1e-5), Vec3::ONE * 511.9]
        {
            let off = (unpack(pack(rgb)) - rgb).abs().max_element();
            assert!(off <= rgb.max_element() / 512.0, "{rgb}: {}", unpack(pack(rgb)));
        }
        assert_eq!(unpack(pack(Vec3::new(1.0, 0.5, 0.25))), Vec3::new(1.0, 0.5, 0.25), "eight bits and fewer stay");
    }

    #[test]
    fn places_and_directions_are_inverse() {
        for (d, across, down) in
            [(DVec3::X, 0.5, 0.5), (DVec3::Z, 0.75, 0.5), (DVec3::NEG_Z, 0.25, 0.5), (DVec3::Y, 0.5, 0.0)]
        {
            let there = place(d.as_vec3());
            assert!((f64::from(there[1]) - down).abs() < 1e-6, "{d}");
            assert!(d.y == 1.0 || (f64::from(there[0]) - across).abs() < 1e-6, "{d}");
            assert!(direction(across, down).distance(d) < 1e-12);
        }
    }

    #[test]
    fn turned_by_90_degrees_what_was_towards_x_is_towards_minus_z() {
        let scene = Scene { sky_turn: 0.25, ..Scene::default() };
        assert!((scene.sky_rotation() * DVec3::X).distance(DVec3::NEG_Z) < 1e-12);
    }
}
