//! Skins and morph targets of primitives. Weights of morph targets that no animation sets are applied once; everything
//! else becomes a [`Deform`] of the mesh.

use std::collections::HashSet;
use std::sync::Arc;

use glam::{DAffine3, DMat4, Vec3};
use gltf::json::mesh::{MorphTarget, Semantic};
use gltf::json::{Accessor, Index};

use super::accessor::{Data, Problem, missing};
use super::document::Document;
use super::mesh::SourcePrimitive;
use super::nodes::NodeOrder;
use crate::scene::Mesh;
use crate::scene::deform::{Deform, DeformPose, Joint, TargetDeltas};

/// The deformation that a node applies to its mesh.
#[derive(Default)]
pub struct Applied<'a> {
    /// Weights of the morph targets; missing ones are 0.
    pub weights: &'a [f32],
    /// The scene's deformer that poses the mesh from frame to frame, if any.
    pub deformer: Option<Applying>,
}

pub struct Applying {
    /// Index into the scene's deformers.
    pub index: usize,
    /// Joints of the skin, without the one that stands for the node itself; `None` without a skin.
    pub joints: Option<u32>,
    /// Whether an animation sets the weights.
    pub morphs: bool,
    pub rest: DeformPose,
}

/// The nodes for which an animation sets weights of morph targets.
pub fn morphed(document: &Document) -> HashSet<usize> {
    let channels = document.animations.iter().flat_map(|animation| &animation.channels);
    channels.filter(|channel| channel.target.path == "weights").filter_map(|channel| channel.target.node).collect()
}

/// The number of morph targets of a node's mesh.
pub fn targets(data: &Data, node: usize) -> usize {
    let mesh = data.document.nodes.get(node).and_then(|node| data.document.meshes.get(node.mesh?));
    let primitives = mesh.into_iter().flat_map(|mesh| &mesh.primitives);
    primitives.map(|primitive| primitive.targets.as_ref().map_or(0, Vec::len)).max().unwrap_or(0)
}

/// The weights of a node's morph targets without an animation.
pub fn weights<'a>(data: &Data<'a>, node: usize) -> Result<&'a [f32], Problem> {
    let of = &data.document.nodes[node];
    let mesh = of.mesh.and_then(|mesh| data.document.meshes.get(mesh));
    let weights = of.weights.as_ref().or_else(|| mesh.and_then(|mesh| mesh.weights.as_ref()));
    let weights = weights.map_or(&[][..], Vec::as_slice);
    match weights.iter().all(|weight| weight.is_finite()) {
        true => Ok(weights),
        false => Err(format!("node {node} has a morph target whose weight is infinite; export the file again")),
    }
}

/// The joints of the skin of node `index`, followed by the node itself; empty without a skin.
pub fn joints(data: &Data, tree: &NodeOrder, index: usize) -> Result<Vec<Joint>, Problem> {
    let Some(skin_index) = data.document.nodes[index].skin else { return Ok(Vec::new()) };
    let skin = data.document.skins.get(skin_index).ok_or_else(|| missing("skin", skin_index))?;
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
    if !bind.iter().flatten().all(|x| x.is_finite()) {
        return Err(format!("skin {skin_index} has a matrix that is NaN or infinite; export the file again"));
    }
    let joint = |(joint, bind): (usize, &[f32; 16])| {
        let node = *tree.slot.get(joint).ok_or_else(|| missing("node", joint))?;
        Ok(Joint { node, joint_from_mesh: DAffine3::from_mat4(DMat4::from_cols_array(&bind.map(f64::from))) })
    };
    let mut joints: Vec<Joint> =
        skin.joints.iter().map(|j| j.value()).zip(&bind).map(joint).collect::<Result<_, Problem>>()?;
    joints.push(Joint { node: tree.slot[index], joint_from_mesh: DAffine3::IDENTITY });
    Ok(joints)
}

/// Morphs `mesh`, or records the deformation of its vertices.
pub fn apply(source: &SourcePrimitive, applied: &Applied, mesh: &mut Mesh) -> Result<(), Problem> {
    let targets = source.primitive.targets.as_deref().unwrap_or_default();
    let morphs = applied.deformer.as_ref().is_some_and(|deformer| deformer.morphs);
    let mut deform = Deform { flat: mesh.normals.is_empty(), ..Deform::default() };
    if morphs {
        deform.targets = targets.iter().map(|target| read(source, target, mesh)).collect::<Result<_, Problem>>()?;
    } else {
        for (target, &weight) in targets.iter().zip(applied.weights).filter(|(_, w)| **w != 0.0) {
            let target = read(source, target, mesh)?;
            mesh.positions.iter_mut().zip(target.positions).for_each(|(value, offset)| *value += weight * offset);
            mesh.normals.iter_mut().zip(target.normals).for_each(|(value, offset)| *value += weight * offset);
            let tangents = mesh.tangents.iter_mut().zip(target.tangents);
            tangents.for_each(|(t, offset)| *t = (t.truncate() + weight * offset).extend(t.w));
        }
    }
    let Some(Applying { index, joints, .. }) = applied.deformer else { return Ok(()) };
    deform.deformer = index;
    if let Some(joints) = joints {
        skin(source, joints, &mut deform)?;
    }
    mesh.deform = Some(Arc::new(deform));
    Ok(())
}

/// The differences of a morph target for the attributes that the mesh has.
fn read(source: &SourcePrimitive, target: &MorphTarget, mesh: &Mesh) -> Result<TargetDeltas, Problem> {
    let read = |name, accessor: &Option<Index<Accessor>>, is_used: bool| match accessor {
        Some(accessor) if is_used => offsets(source, name, accessor),
        _ => Ok(Vec::new()),
    };
    Ok(TargetDeltas {
        positions: read("POSITION", &target.positions, true)?,
        normals: read("NORMAL", &target.normals, !mesh.normals.is_empty())?,
        tangents: read("TANGENT", &target.tangents, !mesh.tangents.is_empty())?,
    })
}

fn offsets(source: &SourcePrimitive, name: &str, accessor: &Index<Accessor>) -> Result<Vec<Vec3>, Problem> {
    let (what, offsets) = (&source.what, source.data.floats::<3>(accessor.value(), None)?);
    if source.count != offsets.len() {
        let (want, have) = (source.count, offsets.len());
        return Err(format!(
            "{what} has a morph target with {have} values of {name} for {want} vertices; export the file again"
        ));
    }
    let offsets: Vec<Vec3> = offsets.into_iter().map(Vec3::from).collect();
    match offsets.iter().position(|offset| !offset.is_finite()) {
        Some(bad) => Err(format!(
            "{what} has a morph target with a {name} that is NaN or infinite (vertex {bad}); export the file again"
        )),
        None => Ok(offsets),
    }
}

/// Influences of all sets. Each vertex gets as many as the vertex with the most. `own` is the joint that represents the
/// node itself.
fn skin(source: &SourcePrimitive, own: u32, deform: &mut Deform) -> Result<(), Problem> {
    let (data, what) = (source.data, &source.what);
    let mut of_vertices: Vec<Vec<(u32, f32)>> = vec![Vec::new(); source.count];
    for set in 0.. {
        let accessors = (source.accessor(Semantic::Joints(set)), source.accessor(Semantic::Weights(set)));
        let (Some(keys), Some(weights)) = accessors else { break };
        let (keys, weights) = (data.integers::<4>(keys)?, data.floats::<4>(weights, None)?);
        if keys.len() != source.count || weights.len() != source.count {
            return Err(format!(
                "{what} has joints or weights in another number than its vertices; export the file again"
            ));
        }
        for (vertex, (keys, weights)) in keys.into_iter().zip(weights).enumerate() {
            for (key, weight) in keys.into_iter().zip(weights).filter(|(_, w)| *w != 0.0) {
                if !weight.is_finite() || weight < 0.0 {
                    return Err(format!(
                        "{what} has a weight of a joint that is {weight} (vertex {vertex}); export the file again"
                    ));
                }
                if key >= own {
                    return Err(format!("{what} uses joint {key} of {own}; export the file again"));
                }
                of_vertices[vertex].push((key, weight));
            }
        }
    }
    deform.influences = of_vertices.iter().map(Vec::len).max().unwrap_or(0).max(1);
    for mut of in of_vertices {
        let sum: f64 = of.iter().map(|(_, weight)| f64::from(*weight)).sum();
        of.iter_mut().for_each(|(_, weight)| *weight = (f64::from(*weight) / sum) as f32);
        if of.is_empty() {
            of.push((own, 1.0));
        }
        of.resize(deform.influences, (0, 0.0));
        deform.skin.extend(of);
    }
    Ok(())
}
