//! EXT_mesh_gpu_instancing: a node shows its mesh several times, at child nodes that move with it.

use std::collections::BTreeMap;
use std::ops::Range;

use glam::{DQuat, DVec3, Vec3};
use serde_json::Value;

use super::accessor::{Data, Problem, missing};
use super::document::{Document, Node, size};
use super::nodes::{self, NodeOrder};
use crate::scene::{self, Scene};

pub const NAME: &str = "EXT_mesh_gpu_instancing";

/// The accessors of a node's instances by name, if it has the extension.
fn attributes(node: &Node) -> Option<BTreeMap<&str, Option<usize>>> {
    let attributes = node.extensions.others.get(NAME)?.get("attributes").and_then(Value::as_object);
    let index = |value: &Value| value.as_u64().and_then(|index| usize::try_from(index).ok());
    Some(attributes.into_iter().flatten().map(|(name, value)| (name.as_str(), index(value))).collect())
}

/// How often a node shows its mesh: the number of elements of its longest accessor, and once without any.
pub fn count(document: &Document, node: &Node) -> u64 {
    let Some(attributes) = attributes(node) else { return 1 };
    let elements =
        |index: &Option<usize>| document.accessors.get((*index)?).map(|accessor| size(accessor.count) as u64);
    attributes.values().filter_map(elements).max().unwrap_or(1)
}

/// The maximum number of instances of nodes whose accessors have no data in the file. A few bytes can state millions of
/// them, all at one place.
pub const UNBACKED_MAX: u64 = 1 << 14;

/// The number of instances of a node without data in the file.
pub fn unbacked(document: &Document, node: &Node) -> u64 {
    let accessors = attributes(node).into_iter().flat_map(BTreeMap::into_values).flatten();
    let mut accessors = accessors.filter_map(|index| document.accessors.get(index)).peekable();
    let none = accessors.peek().is_some() && accessors.all(|a| a.buffer_view.is_none());
    if none { count(document, node) } else { 0 }
}

/// Adds the nodes of all instances of the node with the document's index `node`: their indices in the scene, or those
/// of the node itself if it is not instanced. The error is a sentence that names the node, for accessors that are
/// missing, do not fit or differ in length, and for numbers that are not finite.
pub fn load(data: &Data, tree: &NodeOrder, node: usize, scene: &mut Scene) -> Result<Range<usize>, Problem> {
    let at = tree.slot[node];
    let Some(attributes) = attributes(&data.document.nodes[node]).filter(|attributes| !attributes.is_empty()) else {
        return Ok(at..at + 1);
    };
    let what = format!("node {node} has {NAME}");
    let mut lengths = Vec::new();
    for (name, index) in &attributes {
        let index =
            index.ok_or_else(|| format!("{what} with {name} that is no accessor's index; export the file again"))?;
        let accessor = data.document.accessors.get(index).ok_or_else(|| missing("accessor", index))?;
        lengths.push(size(accessor.count));
    }
    let instances = lengths[0];
    if lengths.iter().any(|length| *length != instances) {
        return Err(format!("{what} with attributes of different lengths; export the file again"));
    }
    let index = |name| attributes.get(name).copied().flatten();
    let vectors = |name| index(name).map(|index| data.floats::<3>(index, None)).transpose();
    let (translations, scales) = (vectors("TRANSLATION")?, vectors("SCALE")?);
    let rotations = index("ROTATION").map(|index| data.floats::<4>(index, None)).transpose()?;
    let first = scene.nodes.len();
    for i in 0..instances {
        let vector =
            |list: &Option<Vec<[f32; 3]>>, none| list.as_ref().map_or(none, |list| Vec3::from(list[i]).as_dvec3());
        let (translation, scale) = (vector(&translations, DVec3::ZERO), vector(&scales, DVec3::ONE));
        let rotation = rotations.as_ref().map_or(DQuat::IDENTITY, |list| DQuat::from_array(list[i].map(f64::from)));
        if !(translation.is_finite() && scale.is_finite() && rotation.is_finite()) {
            return Err(format!("{what} with a transform that is not finite (instance {i}); export the file again"));
        }
        let local = nodes::trs(translation, rotation, scale);
        scene.nodes.push(scene::Node { name: String::new(), parent: Some(at), local });
    }
    Ok(first..scene.nodes.len())
}
