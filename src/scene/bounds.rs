//! Axis-aligned boxes, a scene's extent over a whole animation, and counts of triangles.

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use super::{Bounds, Pose, Scene};

/// Uniform times at which [`Scene::bounds`] looks at an animation, beside every key.
const UNIFORM_TIMES: usize = 64;

impl Bounds {
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    pub fn is_empty(&self) -> bool {
        self.min.cmpgt(self.max).any()
    }

    /// The smallest box that holds both.
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// The smallest box that also holds `point`.
    pub fn include(self, point: DVec3) -> Self {
        self.union(Self { min: point, max: point })
    }

    /// The origin for an empty box.
    pub fn center(&self) -> DVec3 {
        if self.is_empty() { DVec3::ZERO } else { 0.5 * (self.min + self.max) }
    }

    /// Zero for an empty box.
    pub fn size(&self) -> DVec3 {
        if self.is_empty() { DVec3::ZERO } else { self.max - self.min }
    }
}

impl Scene {
    /// The box around all vertices over the whole of `animation`, in metres: at its keys and at least 64 uniform times.
    /// Motion between these (the arc of a fast rotation) can stick out by a little. Empty for a scene without meshes.
    pub fn bounds(&self, animation: Option<usize>) -> Bounds {
        let times = self.sample_times(animation);
        let poses: Vec<Vec<DAffine3>> = times.iter().map(|&t| self.pose(animation, t).world_from_instance).collect();
        let of_instance = |index: usize| {
            let vertices = &self.meshes[self.instances[index].mesh].positions;
            let mut bounds = Bounds::EMPTY;
            for (n, pose) in poses.iter().enumerate() {
                // Most instances do not move; for them the first pose says everything.
                if n == 0 || pose[index] != poses[n - 1][index] {
                    bounds = vertices.iter().fold(bounds, |b, p| b.include(pose[index].transform_point3(p.as_dvec3())));
                }
            }
            bounds
        };
        (0..self.instances.len()).into_par_iter().map(of_instance).reduce(|| Bounds::EMPTY, Bounds::union)
    }

    fn sample_times(&self, animation: Option<usize>) -> Vec<f32> {
        let Some(animation) = animation.and_then(|a| self.animations.get(a)) else { return vec![0.0] };
        let uniform = (0..=UNIFORM_TIMES).map(|i| animation.duration * i as f32 / UNIFORM_TIMES as f32);
        let mut times: Vec<f32> =
            animation.channels.iter().flat_map(|c| c.times.iter().copied()).chain(uniform).collect();
        times.sort_by(f32::total_cmp);
        times.dedup();
        times
    }

    /// Triangles over all instances.
    pub fn triangle_count(&self) -> usize {
        self.instances.iter().map(|i| self.meshes[i.mesh].indices.len() / 3).sum()
    }

    /// Triangles over all instances that have no area in the world at `pose`. They stay in the meshes.
    pub fn degenerate_triangles(&self, pose: &Pose) -> usize {
        let count = |(instance, world): (&super::Instance, &DAffine3)| {
            let mesh = &self.meshes[instance.mesh];
            let corner = |i: u32| world.transform_vector3(mesh.positions[i as usize].as_dvec3());
            let flat = |t: &&[u32]| {
                let [a, b, c] = [corner(t[0]), corner(t[1]), corner(t[2])];
                (b - a).cross(c - a) == DVec3::ZERO
            };
            mesh.indices.chunks_exact(3).filter(flat).count()
        };
        self.instances.iter().zip(&pose.world_from_instance).map(count).sum()
    }
}
