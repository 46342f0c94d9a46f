//! Applies skins and morph targets once, with the file's own node transforms and default weights.

use glam::{DAffine3, DMat4, Vec3};
use gltf::json::mesh::Semantic;
use gltf::json::{Accessor, Index};

use super::accessor::{Data, Problem, missing};
use super::mesh::Source;
use super::nodes::Tree;
use crate::scene::Mesh;
use crate::scene::surface::cofactor;

/// The deformation that a node applies to its mesh.
pub struct Rest<'a> {
    /// Per joint: the transform from the bind pose to the node's space.
    pub joints: Option<&'a [DAffine3]>,
    /// One per morph target; missing ones are 0.
    pub weights: &'a [f32],
}

/// [`Rest::joints`] of node `index`. glTF ignores the transform of a skinned node; instances apply it, so it is divided out
/// here.
pub fn joint_matrices(
    data: &Data,
    tree: &Tree,
    world: &[DAffine3],
    index: usize,
) -> Result<Option<Vec<DAffine3>>, Problem> {
    let Some(skin_index) = data.document.nodes[index].skin else { return Ok(None) };
    let skin = data.document.skins.get(skin_index).ok_or_else(|| missing("skin", skin_index))?;
    let node_from_world = world[tree.slot[index]].inverse();
    if !node_from_world.is_finite() {
        data.document.warn(format!("node {index} has a skin and a scale of 0; the skin was ignored"));
        return Ok(None);
    }
    data.document.warn("skins are not animated; skinned meshes keep the pose of the file's nodes");
    let bind = match skin.inverse_bind_matrices {
        Some(accessor) => data.floats::<16>(accessor.value(), None)?,
        None => vec![glam::Mat4::IDENTITY.to_cols_array(); skin.joints.len()],
    };
    if bind.len() < skin.joints.len() {
        return Err(format!(
            "skin {skin_index} has {} joints and {} matrices; export the file again",
            skin.joints.len(),
            bind.len()
        ));
    }
    let matrix = |(joint, bind): (usize, &[f32; 16])| {
        let slot = *tree.slot.get(joint).ok_or_else(|| missing("node", joint))?;
        let bind = DAffine3::from_mat4(DMat4::from_cols_array(&bind.map(f64::from)));
        Ok(node_from_world * world[slot] * bind)
    };
    skin.joints.iter().map(|j| j.value()).zip(&bind).map(matrix).collect::<Result<_, _>>().map(Some)
}

/// Deforms positions, normals and tangents of `mesh`, morph targets first.
pub fn apply(source: &Source, rest: &Rest, mesh: &mut Mesh) -> Result<(), Problem> {
    let targets = source.primitive.targets.as_deref().unwrap_or_default();
    if !targets.is_empty() {
        source.data.document.warn("morph targets are not animated; they keep the file's default weights");
    }
    for (target, &weight) in targets.iter().zip(rest.weights).filter(|(_, w)| **w != 0.0) {
        let add = |name: &str, accessor: &Index<Accessor>, values: &mut [Vec3]| {
            let offsets = source.data.floats::<3>(accessor.value(), None)?;
            if values.len() != offsets.len() {
                let (what, have, want) = (&source.what, offsets.len(), values.len());
                return Err(format!(
                    "{what} has a morph target with {have} values of {name} for {want} vertices; export the file again"
                ));
            }
            values.iter_mut().zip(offsets).for_each(|(value, offset)| *value += weight * Vec3::from(offset));
            Ok(())
        };
        if let Some(accessor) = &target.positions {
            add("POSITION", accessor, &mut mesh.positions)?;
        }
        if let Some(accessor) = target.normals.as_ref().filter(|_| !mesh.normals.is_empty()) {
            add("NORMAL", accessor, &mut mesh.normals)?;
        }
        if let Some(accessor) = target.tangents.as_ref().filter(|_| !mesh.tangents.is_empty()) {
            let mut directions: Vec<Vec3> = mesh.tangents.iter().map(|t| t.truncate()).collect();
            add("TANGENT", accessor, &mut directions)?;
            mesh.tangents.iter_mut().zip(directions).for_each(|(t, d)| *t = d.extend(t.w));
        }
    }
    match rest.joints {
        Some(joints) => skin(source, joints, mesh),
        None => Ok(()),
    }
}

fn skin(source: &Source, joints: &[DAffine3], mesh: &mut Mesh) -> Result<(), Problem> {
    let (data, what) = (source.data, &source.what);
    let mut blended = vec![DAffine3::ZERO; mesh.positions.len()];
    let mut sums = vec![0.0f64; mesh.positions.len()];
    for set in 0.. {
        let accessors = (source.accessor(Semantic::Joints(set)), source.accessor(Semantic::Weights(set)));
        let (Some(keys), Some(weights)) = accessors else { break };
        let (keys, weights) = (data.integers::<4>(keys)?, data.floats::<4>(weights, None)?);
        if keys.len() != blended.len() || weights.len() != blended.len() {
            return Err(format!(
                "{what} has joints or weights in another number than its vertices; export the file again"
            ));
        }
        for (vertex, (keys, weights)) in keys.into_iter().zip(weights).enumerate() {
            for (key, weight) in keys.into_iter().zip(weights).filter(|(_, w)| *w != 0.0) {
                let joint = joints.get(key as usize);
                let joint = joint
                    .ok_or_else(|| format!("{what} uses joint {key} of {}; export the file again", joints.len()))?;
                let weight = f64::from(weight);
                blended[vertex].matrix3 += joint.matrix3 * weight;
                blended[vertex].translation += joint.translation * weight;
                sums[vertex] += weight;
            }
        }
    }
    for (vertex, (matrix, sum)) in blended.into_iter().zip(sums).enumerate().filter(|(_, (_, sum))| *sum != 0.0) {
        let linear = matrix.matrix3 * (1.0 / sum);
        let position = &mut mesh.positions[vertex];
        *position = (linear * position.as_dvec3() + matrix.translation / sum).as_vec3();
        if let Some(normal) = mesh.normals.get_mut(vertex) {
            *normal = (cofactor(linear) * normal.as_dvec3()).as_vec3();
        }
        if let Some(tangent) = mesh.tangents.get_mut(vertex) {
            *tangent = (linear * tangent.truncate().as_dvec3()).as_vec3().extend(tangent.w);
        }
    }
    Ok(())
}
