//! The order in which blended triangles are drawn.

use std::borrow::Cow;
use std::collections::HashMap;

use glam::{DVec3, Vec3};

use super::Seen;
use crate::ground::scene_on_gpu::BlendedTriangle;

/// Sources of the blended triangles, the farthest centroid first; equal depths in the scene's order.
pub(super) fn back_to_front(seen: &Seen, blended: &[BlendedTriangle]) -> Vec<u32> {
    let mut order: Vec<(f64, u32)> = Vec::new();
    let mut posed: HashMap<usize, Cow<[Vec3]>> = HashMap::new();
    for t in blended {
        let mesh = &seen.scene.meshes[t.mesh];
        let place = &seen.pose.world_from_instance[t.instance];
        let positions = posed.entry(t.mesh).or_insert_with(|| mesh.posed_positions(seen.pose));
        let corners = &mesh.indices[t.first_index..t.first_index + 3];
        let sum: DVec3 = corners.iter().map(|&i| place.transform_point3(positions[i as usize].as_dvec3())).sum();
        order.push(((sum / 3.0 - seen.view.eye).dot(seen.view.forward), t.source));
    }
    order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    order.into_iter().map(|(_, source)| source).collect()
}
