//! Skins and morph targets, applied once: at the file's own node transforms and default weights.

use glam::{DAffine3, DMat3, DMat4, DVec3, Vec3, Vec4};
use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{Accessor, Index};

use super::accessor::{Data, Problem, missing};
use super::nodes::Tree;
use super::{Warnings, WorldFromNodes};
use crate::scene::Mesh;

/// What a node does to its mesh's vertices.
pub struct Rest<'a> {
    /// Skinned position in the node's space from bind pose, one per joint.
    pub joints: Option<&'a [DAffine3]>,
    /// One per morph target; missing ones are 0.
    pub weights: &'a [f32],
}

/// The joints of node `index`'s skin, relative to that node, so that the instance can hang on it like any other: glTF
/// leaves the node's own transform out, so it is divided out here.
pub fn joint_matrices(
    data: &Data,
    tree: &Tree,
    world: &WorldFromNodes,
    index: usize,
    warnings: &mut Warnings,
) -> Result<Option<Vec<DAffine3>>, Problem> {
    let Some(skin_index) = data.document.nodes[index].skin else { return Ok(None) };
    let skin = data.document.skins.get(skin_index).ok_or_else(|| missing("skin", skin_index))?;
    let node_from_world = world[tree.slot[index]].inverse();
    if !node_from_world.is_finite() {
        warnings.once(format!("node {index} has a skin and a scale of 0; the skin was ignored"));
        return Ok(None);
    }
    warnings.once("skins are not animated; skinned meshes keep the pose of the file's nodes");
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

/// Moves positions, normals and tangents of `mesh`, morph targets first.
pub fn apply(
    data: &Data,
    what: &str,
    primitive: &Primitive,
    rest: &Rest,
    mesh: &mut Mesh,
    warnings: &mut Warnings,
) -> Result<(), Problem> {
    let targets = primitive.targets.as_deref().unwrap_or_default();
    if !targets.is_empty() {
        warnings.once("morph targets are not animated; they keep the file's default weights");
    }
    for (target, &weight) in targets.iter().zip(rest.weights).filter(|(_, w)| **w != 0.0) {
        let offsets = |accessor: &Index<Accessor>| data.floats::<3>(accessor.value(), None);
        if let Some(accessor) = &target.positions {
            add(what, "POSITION", &mut mesh.positions, &offsets(accessor)?, weight)?;
        }
        if let Some(accessor) = target.normals.as_ref().filter(|_| !mesh.normals.is_empty()) {
            add(what, "NORMAL", &mut mesh.normals, &offsets(accessor)?, weight)?;
        }
        if let Some(accessor) = target.tangents.as_ref().filter(|_| !mesh.tangents.is_empty()) {
            let mut directions: Vec<Vec3> = mesh.tangents.iter().map(|t| t.truncate()).collect();
            add(what, "TANGENT", &mut directions, &offsets(accessor)?, weight)?;
            mesh.tangents.iter_mut().zip(directions).for_each(|(t, d)| *t = d.extend(t.w));
        }
    }
    match rest.joints {
        Some(joints) => skin(data, what, primitive, joints, mesh),
        None => Ok(()),
    }
}

fn add(what: &str, name: &str, values: &mut [Vec3], offsets: &[[f32; 3]], weight: f32) -> Result<(), Problem> {
    if values.len() != offsets.len() {
        let (have, want) = (offsets.len(), values.len());
        return Err(format!(
            "{what} has a morph target with {have} values of {name} for {want} vertices; export the file again"
        ));
    }
    values.iter_mut().zip(offsets).for_each(|(value, offset)| *value += weight * Vec3::from(*offset));
    Ok(())
}

fn skin(data: &Data, what: &str, primitive: &Primitive, joints: &[DAffine3], mesh: &mut Mesh) -> Result<(), Problem> {
    let mut blended = vec![DAffine3::ZERO; mesh.positions.len()];
    let mut sums = vec![0.0f64; mesh.positions.len()];
    for set in 0.. {
        let find = |semantic: Semantic| primitive.attributes.get(&Checked::Valid(semantic));
        let (Some(keys), Some(weights)) = (find(Semantic::Joints(set)), find(Semantic::Weights(set))) else { break };
        let (keys, weights) = (data.integers::<4>(keys.value())?, data.floats::<4>(weights.value(), None)?);
        if keys.len() != blended.len() || weights.len() != blended.len() {
            return Err(format!(
                "{what} has joints or weights for fewer or more than its vertices; export the file again"
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
            *tangent = Vec4::from(((linear * tangent.truncate().as_dvec3()).as_vec3(), tangent.w));
        }
    }
    Ok(())
}

/// Takes normals along: the inverse transpose times the determinant, which exists for flattened bodies too.
fn cofactor(m: DMat3) -> DMat3 {
    let cross = |a: DVec3, b: DVec3| a.cross(b);
    DMat3::from_cols(cross(m.y_axis, m.z_axis), cross(m.z_axis, m.x_axis), cross(m.x_axis, m.y_axis))
}
