//! The places of a method's nested grids: the coarsest fills the cube of the base grid; each finer one has half of its
//! side and follows the camera (Kaplanyan and Dachsbacher, "Cascaded Light Propagation Volumes", 2010).

use glam::Vec3;

use crate::ground::Ground;
use crate::ground::grid::GridPlace;
use crate::ground::lists::Lists;

/// Nested grids.
#[derive(Clone, Copy, Debug)]
pub struct Cascades {
    /// Cells per edge of each.
    pub edge: u32,
    /// The number of grids.
    pub count: u32,
    /// The edge of the base grid in voxels.
    pub base_edge: u32,
}

/// The grids, the finest first. `eye` is in voxels of the base grid. Grids move by whole cells and stay inside its
/// cube.
pub fn places(of: Cascades, eye: Vec3) -> Vec<GridPlace> {
    let Cascades { edge, count, base_edge } = of;
    let place = |halvings: u32| {
        let side = base_edge as f32 / (1 << halvings) as f32;
        let voxel = side / edge as f32;
        let most = base_edge as f32 - side;
        let eye = if eye.is_finite() { eye } else { Vec3::splat(0.5 * base_edge as f32) };
        let corner = ((eye - 0.5 * side) / voxel).round() * voxel;
        GridPlace { edge, corner: corner.clamp(Vec3::ZERO, Vec3::splat(most)).into(), voxel }
    };
    (0..count).rev().map(place).collect()
}

/// The lists of the method's own grids, the finest first.
pub fn further(ground: &Ground) -> impl Iterator<Item = &Lists> {
    ground.lists[1..].iter()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grids_are_nested_and_move_by_whole_cells() {
        let three = Cascades { edge: 32, count: 3, base_edge: 64 };
        let here = places(three, Vec3::new(20.3, 32.0, 63.0));
        assert_eq!(here.iter().map(|place| place.voxel).collect::<Vec<_>>(), [0.5, 1.0, 2.0]);
        assert_eq!(here[2].corner, [0.0; 3]);
        assert_eq!(here[1].corner, [4.0, 16.0, 32.0]);
        assert_eq!(here[0].corner, [12.5, 24.0, 48.0]);
        assert_eq!(here, places(three, Vec3::new(20.4, 32.1, 63.0)), "within a cell nothing moves");
        let moved = places(three, Vec3::new(20.8, 32.0, 63.0));
        assert_eq!(moved[0].corner, [13.0, 24.0, 48.0]);
    }
}
