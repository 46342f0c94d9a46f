//! Twin of the record pass: every triangle of a posed scene, in the order of instances and indices.

use glam::DVec3;

use twobounce::scene::{Pose, Scene};

/// One recorded triangle in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Recorded {
    pub positions: [DVec3; 3],
    /// Index into [`Scene::materials`].
    pub material: usize,
}

/// All triangles of `scene` at `pose`. A mirrored instance (negative determinant) gets reversed winding, so that fronts
/// stay fronts.
pub fn record(scene: &Scene, pose: &Pose) -> Vec<Recorded> {
    let mut triangles = Vec::new();
    for (instance, world) in scene.instances.iter().zip(&pose.world_from_instance) {
        let mesh = &scene.meshes[instance.mesh];
        let mirrored = world.matrix3.determinant() < 0.0;
        for corners in mesh.indices.chunks_exact(3) {
            let mut positions: [DVec3; 3] =
                std::array::from_fn(|i| world.transform_point3(mesh.positions[corners[i] as usize].as_dvec3()));
            if mirrored {
                positions.swap(1, 2);
            }
            triangles.push(Recorded { positions, material: mesh.material });
        }
    }
    triangles
}

/// Positions in voxels of `voxel_m` metres from the volume's least corner (metres), rounded to f32 as in the record
/// pass.
pub fn in_voxels(triangles: &[Recorded], corner: DVec3, voxel_m: f64) -> Vec<[DVec3; 3]> {
    triangles.iter().map(|t| t.positions.map(|p| ((p - corner) / voxel_m).as_vec3().as_dvec3())).collect()
}
