//! Twin of the mips pass: six directional preintegrations and one plain average, per 2×2×2 block.

use glam::{UVec3, Vec4};

use super::volume::{ISOTROPIC, Level, TARGETS, Volume, round_to_half, texel_index};
use twobounce::gi::cones::choices::Form;

/// The eight children of a voxel: index 4z + 2y + x (D3: the talk's `voxelIndex` macro, with its brackets balanced).
pub type Block = [Vec4; 8];

/// 4z + 2y + x for x, y, z in {0, 1}.
pub fn voxel_index(x: usize, y: usize, z: usize) -> usize {
    (z * 2 + y) * 2 + x
}

/// ¼ Σ over the four columns along the axis of travel: front + (1 − front.a) · back (design: directional mips).
/// `travel` is 0…5 for +x +y +z −x −y −z; the front voxel is the one that a traveller meets first.
///
/// D2 printed: the fourth column of −y takes v(1,0,1) as front, but weighs it with v(1,1,1).a.
pub fn mip_directional(block: &Block, travel: usize, d2: Form) -> Vec4 {
    let (axis, negative) = (travel % 3, travel >= 3);
    let mut sum = Vec4::ZERO;
    for column in 0..4 {
        let (u, v) = (column & 1, column >> 1);
        let at = |depth: usize| match axis {
            0 => block[voxel_index(depth, u, v)],
            1 => block[voxel_index(u, depth, v)],
            _ => block[voxel_index(u, v, depth)],
        };
        let (front, back) = if negative { (at(1), at(0)) } else { (at(0), at(1)) };
        let colour = if d2 == Form::Printed && travel == 4 && column == 3 { back } else { front };
        sum += colour + (1.0 - front.w) * back;
    }
    sum * 0.25
}

/// The plain ⅛ average.
pub fn mip_isotropic(block: &Block) -> Vec4 {
    block.iter().sum::<Vec4>() * 0.125
}

/// The next level of all seven targets, each texel rounded to RGBA16F.
///
/// D1 printed: the −x −y −z mips fetch the volumes of +x +y +z.
pub fn mip_level(fine: &Level, d1: Form, d2: Form) -> Level {
    let edge = (fine[0].len() as f64).cbrt().round() as u32 / 2;
    std::array::from_fn(|target| {
        let source = if d1 == Form::Printed && (3..ISOTROPIC).contains(&target) { target - 3 } else { target };
        let mut coarse = vec![Vec4::ZERO; (edge as usize).pow(3)];
        for z in 0..edge {
            for y in 0..edge {
                for x in 0..edge {
                    let block: Block = std::array::from_fn(|i| {
                        let i = i as u32;
                        let child = UVec3::new(x, y, z) * 2 + UVec3::new(i & 1, i >> 1 & 1, i >> 2);
                        fine[source][texel_index(child, edge * 2)]
                    });
                    coarse[texel_index(UVec3::new(x, y, z), edge)] = round_to_half(match target {
                        ISOTROPIC => mip_isotropic(&block),
                        travel => mip_directional(&block, travel, d2),
                    });
                }
            }
        }
        coarse
    })
}

/// The whole mip chain of level 0.
pub fn mip_chain(level0: Level, d1: Form, d2: Form) -> Volume {
    let mut levels = vec![level0];
    while levels[levels.len() - 1][0].len() > 1 {
        levels.push(mip_level(&levels[levels.len() - 1], d1, d2));
    }
    Volume::new(levels)
}

/// A level 0 with equal texels in all seven targets.
pub fn equal_faces(texels: Vec<Vec4>) -> Level {
    let mut level: Level = Default::default();
    for target in level.iter_mut().take(TARGETS) {
        target.clone_from(&texels);
    }
    level
}
