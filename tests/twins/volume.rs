//! One bounce's volume on the CPU: seven RGBA targets with their mip chains, sampled as the GPU samples them.

use glam::{IVec3, UVec3, Vec3, Vec4};
use half::f16;

use twobounce::vk::SamplerAddressMode;

/// Targets of a volume: radiance and opacity for a cone that travels along +x +y +z −x −y −z, and the isotropic one.
pub const TARGETS: usize = 7;
/// The isotropic target.
pub const ISOTROPIC: usize = 6;
/// The six directions of travel, in the order of the targets.
pub const TRAVEL: [Vec3; 6] = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z];

/// One level: seven grids of edge³ premultiplied texels, x fastest, z slowest.
pub type Level = [Vec<Vec4>; TARGETS];

/// Seven targets with their mip chains; level 0 has `edge`³ texels, the last one.
#[derive(Clone, Debug)]
pub struct Volume {
    edge: u32,
    levels: Vec<Level>,
}

/// The texel `v` in RGBA16F: each channel rounded to the nearest half.
pub fn round_to_half(v: Vec4) -> Vec4 {
    Vec4::from_array(v.to_array().map(|x| f16::from_f32(x).to_f32()))
}

impl Volume {
    /// A volume from its levels, level 0 first.
    ///
    /// # Panics
    /// If the levels are not a whole mip chain of a power-of-two edge.
    pub fn new(levels: Vec<Level>) -> Self {
        let edge = 1u32 << (levels.len() - 1);
        for (i, level) in levels.iter().enumerate() {
            let texels = ((edge >> i) as usize).pow(3);
            assert!(level.iter().all(|target| target.len() == texels), "level {i} is not {} wide", edge >> i);
        }
        Self { edge, levels }
    }

    /// Level 0's edge in voxels.
    pub fn edge(&self) -> u32 {
        self.edge
    }

    /// The levels, level 0 first.
    pub fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// One texel; beyond the grid `border` decides: nothing, the nearest edge texel, or the grid repeated (D11).
    pub fn fetch(&self, level: usize, target: usize, texel: IVec3, border: SamplerAddressMode) -> Vec4 {
        let edge = (self.edge >> level) as i32;
        let inside = match border {
            SamplerAddressMode::REPEAT => texel.rem_euclid(IVec3::splat(edge)),
            _ => texel.clamp(IVec3::ZERO, IVec3::splat(edge - 1)),
        };
        if border == SamplerAddressMode::CLAMP_TO_BORDER && inside != texel {
            return Vec4::ZERO;
        }
        self.levels[level][target][texel_index(inside.as_uvec3(), edge as u32)]
    }

    /// Linear interpolation in space and in level, as `textureLod` with a linear sampler. `position` in `[0, 1]³`;
    /// `level` is clamped to the chain.
    pub fn sample(&self, target: usize, position: Vec3, level: f32, border: SamplerAddressMode) -> Vec4 {
        let level = level.clamp(0.0, (self.levels.len() - 1) as f32);
        let (lower, fraction) = (level.floor(), level.fract());
        let near = self.sample_level(lower as usize, target, position, border);
        if fraction == 0.0 {
            return near;
        }
        near.lerp(self.sample_level(lower as usize + 1, target, position, border), fraction)
    }

    fn sample_level(&self, level: usize, target: usize, position: Vec3, border: SamplerAddressMode) -> Vec4 {
        let p = position * (self.edge >> level) as f32 - 0.5;
        let (base, f) = (p.floor().as_ivec3(), p - p.floor());
        let mut sum = Vec4::ZERO;
        for corner in 0..8 {
            let offset = IVec3::new(corner & 1, corner >> 1 & 1, corner >> 2);
            let w = Vec3::select(offset.cmpeq(IVec3::ONE), f, 1.0 - f);
            sum += self.fetch(level, target, base + offset, border) * (w.x * w.y * w.z);
        }
        sum
    }
}

/// The index of texel (x, y, z) in a grid of `edge`³.
pub fn texel_index(texel: UVec3, edge: u32) -> usize {
    ((texel.z * edge + texel.y) * edge + texel.x) as usize
}
