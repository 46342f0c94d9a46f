//! Nested boxes of voxels: light is stored in small voxels where that matters, and in larger ones around it. Box 0 is
//! the base grid. Each further box has as many voxels, a quarter as wide, and its content is not listed in the box
//! around it. Exact rays do not need boxes. GLSL twin: `glsl/ground/boxes.glsl`.

use glam::Vec3;

/// `MOST_BOXES` of `glsl/ground/layout.glsl`: the smallest voxels are 4⁵ times smaller than those of the base grid.
pub const MOST_BOXES: usize = 5;

/// The edge of a voxel over that in the next smaller box.
pub const FACTOR: f64 = 4.0;

/// The least corner of each of `count` boxes around the point `about`, in voxels of a base grid of `edge` voxels. A box
/// moves in steps of two voxels of the box around it, so that small motion of the camera does not move it, and never
/// leaves that box.
pub fn corners(edge: u32, count: u32, about: Vec3) -> [[f32; 3]; MOST_BOXES] {
    let mut corners = [[0.0; 3]; MOST_BOXES];
    let (mut least, mut side) = (Vec3::ZERO, edge as f32);
    let mut step = 2.0;
    for corner in corners.iter_mut().take(count as usize) {
        let inner = side / FACTOR as f32;
        let wanted = ((about - 0.5 * inner) / step).round() * step;
        least = wanted.clamp(least, least + (side - inner));
        *corner = least.into();
        side = inner;
        step /= FACTOR as f32;
    }
    corners
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_lie_within_each_other_on_whole_voxels_about_the_point() {
        for about in [Vec3::new(31.3, 8.77, 63.9), Vec3::new(-5.0, 12.34, 20.0), Vec3::splat(32.0)] {
            let corners = corners(64, 4, about);
            let (mut least, mut side) = (Vec3::ZERO, 64.0);
            for (number, corner) in corners[..4].iter().enumerate() {
                let (corner, inner) = (Vec3::from(*corner), 16.0 / 4f32.powi(number as i32));
                assert!(
                    corner.cmpge(least).all() && (corner + inner).cmple(least + side).all(),
                    "{corner} of {number}"
                );
                let in_voxels = corner * 4f32.powi(number as i32); // in voxels of the box around it
                assert_eq!(in_voxels, in_voxels.round());
                let held = about.clamp(least, least + side);
                assert!(held.cmpge(corner).all() && held.cmple(corner + inner).all(), "{about} is not in {number}");
                (least, side) = (corner, inner);
            }
            assert_eq!(corners[4], [0.0; 3]);
        }
    }

    #[test]
    fn a_small_step_moves_no_box() {
        let at = |x: f32| corners(64, 2, Vec3::new(x, 32.0, 32.0));
        assert_eq!(at(32.0), at(32.2));
        assert_ne!(at(32.0), at(34.0));
    }
}
