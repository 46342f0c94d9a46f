//! Estimates the number of list items of a scene's triangles before voxelisation.
//!
//! The expected number of cells that a convex body touches, over random positions of an infinite grid, is the volume of
//! its Minkowski sum with a cell, in cells (Santaló, "Integral Geometry and Geometric Probability"). For a triangle and
//! a cube of edge 1 that is 1 + Σ extents + Σ areas projected along the axes.

use glam::{DAffine3, DVec3, Vec3Swizzles};
use rayon::prelude::*;

use super::grid::Grid;
use crate::scene::{Instance, Scene};

/// Instances per thread.
const PART: usize = 1 << 12;

/// Numbers of list items, and of their sides that send light: two for a double-sided triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Expected {
    pub items: f64,
    pub sides: f64,
}

/// The sum over all instances in the world. Triangles that extend beyond the grid count by the share of their box
/// within it.
pub fn expected_items(scene: &Scene, world_from_instance: &[DAffine3], grid: &Grid) -> Expected {
    let edge = f64::from(grid.edge);
    let of_instance = |(instance, world): (&Instance, &DAffine3)| {
        let voxel_from_object = grid.voxel_from_world() * *world;
        let mesh = &scene.meshes[instance.mesh];
        let mut items = 0.0;
        for corners in mesh.indices.chunks_exact(3) {
            let corner = |k: usize| voxel_from_object.transform_point3(mesh.positions[corners[k] as usize].as_dvec3());
            let [a, b, c] = [corner(0), corner(1), corner(2)];
            let (low, high) = (a.min(b).min(c), a.max(b).max(c));
            let extent = high.min(DVec3::splat(edge)) - low.max(DVec3::ZERO);
            if extent.min_element() >= 0.0 {
                let area = 0.5 * (b - a).cross(c - a).abs();
                let most = extent.zxy() * extent.yzx();
                items += 1.0 + extent.element_sum() + area.min(most).element_sum();
            }
        }
        let double_sided = scene.materials[mesh.material].double_sided;
        Expected { items, sides: if double_sided { 2.0 * items } else { items } }
    };
    let sum = |a: Expected, b: Expected| Expected { items: a.items + b.items, sides: a.sides + b.sides };
    let of_part = |(instances, worlds): (&[Instance], &[DAffine3])| {
        instances.iter().zip(worlds).map(of_instance).fold(Expected::default(), sum)
    };
    // The order is fixed, so that the sum is always the same.
    let parts = scene.instances.par_chunks(PART).zip(world_from_instance.par_chunks(PART));
    parts.map(of_part).collect::<Vec<_>>().into_iter().fold(Expected::default(), sum)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::scene::{Material, Mesh};

    #[test]
    fn a_square_touches_the_squares_that_it_reaches() {
        let mut scene = Scene::empty("square");
        let material = scene.add_material(Material::default());
        let corner = Vec3::splat(1.0);
        scene.add_mesh(Mesh::quad("square", material, corner, Vec3::X * 3.0, Vec3::Y * 3.0), DAffine3::IDENTITY);
        let items = |scale: f64, voxel_m: f64, edge: u32| {
            let grid = Grid { corner: DVec3::ZERO, voxel_m, edge, boxes: 0, about: None };
            expected_items(&scene, &[DAffine3::from_scale(DVec3::splat(scale))], &grid).items
        };
        // Two halves of a square of 6 m: each touches 1 + 6 + 6 + 18 voxels of 1 m.
        assert_eq!(items(2.0, 1.0, 16), 62.0);
        assert_eq!(items(2.0, 2.0, 16), 2.0 * (1.0 + 6.0 + 4.5));
        // The grid of 200 m contains a third of the square's 300 m along each axis.
        assert_eq!(items(100.0, 2.0, 100), 2.0 * (1.0 + 100.0 + 2500.0));
        assert_eq!(items(100.0, 1.0, 64), 0.0);
    }
}
