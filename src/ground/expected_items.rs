//! How many voxels a scene's triangles touch, all in all, before anything is voxelised.
//!
//! A convex body touches as many cells of an infinite grid, in the mean over where the grid stands, as cells go into the volume of
//! its Minkowski sum with one of them (Santaló, "Integral Geometry and Geometric Probability"). Of a triangle and a cube that is
//! v³ + v² Σ extents + v Σ areas projected along the axes, over v³.

use glam::DAffine3;

use crate::scene::Scene;

/// Sums over all triangles of a posed scene.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sizes {
    triangles: f64,
    /// Metres.
    extents: f64,
    /// Square metres.
    areas: f64,
}

impl Sizes {
    pub fn of(scene: &Scene, world_from_instance: &[DAffine3]) -> Self {
        let mut sizes = Self::default();
        for (instance, world) in scene.instances.iter().zip(world_from_instance) {
            let mesh = &scene.meshes[instance.mesh];
            for corners in mesh.indices.chunks_exact(3) {
                let [a, b, c] =
                    [0, 1, 2].map(|k| world.transform_point3(mesh.positions[corners[k] as usize].as_dvec3()));
                sizes.triangles += 1.0;
                sizes.extents += (a.max(b).max(c) - a.min(b).min(c)).element_sum();
                sizes.areas += 0.5 * (b - a).cross(c - a).abs().element_sum();
            }
        }
        sizes
    }

    /// List items of a grid of such voxels, metres.
    pub fn items(&self, voxel_m: f64) -> f64 {
        self.triangles + self.extents / voxel_m + self.areas / (voxel_m * voxel_m)
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};

    use super::*;
    use crate::scene::{Material, Mesh};

    #[test]
    fn a_square_touches_as_many_voxels_as_squares_that_it_reaches() {
        let mut scene = Scene::empty("square");
        let material = scene.add_material(Material::default());
        scene.add_mesh(Mesh::quad("square", material, Vec3::ZERO, Vec3::X * 3.0, Vec3::Y * 3.0), DAffine3::IDENTITY);
        let sizes = Sizes::of(&scene, &[DAffine3::from_scale(DVec3::splat(2.0))]);
        // Two halves of a square of 6 m: each reaches 1 + 6 + 6 + 18 voxels of 1 m.
        assert_eq!(sizes.items(1.0), 62.0);
        assert_eq!(sizes.items(2.0), 2.0 * (1.0 + 6.0 + 4.5));
    }
}
