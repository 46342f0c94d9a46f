//! The node tree with parents before children, the roots of the chosen scene, and the cameras and lights of nodes.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

use glam::{DAffine3, DMat4, DQuat, DVec3, Vec3};
use gltf::json;
use gltf::json::extensions::scene::khr_lights_punctual::{self, Type};
use gltf::json::validation::Checked::{Invalid, Valid};

use super::accessor::{Problem, missing};
use super::check_near;
use super::container::list;
use super::document::Document;
use crate::scene::animation::World;
use crate::scene::{Camera, Light, LightKind, Node, Projection, Scene, Transform};

pub const VISIBILITY: &str = "KHR_node_visibility";

/// The order of the document's nodes in the scene.
pub struct NodeOrder {
    /// Document indices, parents before children.
    order: Vec<usize>,
    parent: Vec<Option<usize>>,
    /// Document index → index into [`Scene::nodes`].
    pub slot: Vec<usize>,
}

impl NodeOrder {
    pub fn new(document: &Document) -> Result<Self, Problem> {
        let count = document.nodes.len();
        let mut parent = vec![None; count];
        for (index, node) in document.nodes.iter().enumerate() {
            for &child in &node.children {
                let slot = parent.get_mut(child).ok_or_else(|| missing("node", child))?;
                if slot.replace(index).is_some() {
                    return Err(format!("node {child} has two parents; export the file again"));
                }
            }
        }
        let mut order: Vec<usize> = (0..count).filter(|&n| parent[n].is_none()).collect();
        let mut next = 0;
        while let Some(&index) = order.get(next) {
            order.extend(&document.nodes[index].children);
            next += 1;
        }
        if order.len() < count {
            return Err("has nodes that are their own ancestors; export the file again".into());
        }
        let mut slot = vec![0; count];
        order.iter().enumerate().for_each(|(at, &index)| slot[index] = at);
        Ok(Self { order, parent, slot })
    }

    /// Document indices of `roots` and all their descendants, in the document's order.
    pub fn reachable(&self, document: &Document, roots: &[usize]) -> Result<Vec<usize>, Problem> {
        let mut shown = vec![false; document.nodes.len()];
        for &root in roots {
            *shown.get_mut(root).ok_or_else(|| missing("node", root))? = true;
        }
        for &index in &self.order {
            shown[index] |= self.parent[index].is_some_and(|p| shown[p]);
        }
        Ok((0..shown.len()).filter(|&n| shown[n]).collect())
    }

    /// The nodes of `shown` that no KHR_node_visibility hides, at the node or at an ancestor. The extension hides
    /// meshes and lights, but not cameras.
    pub fn visible(&self, document: &Document, shown: &[usize]) -> Vec<usize> {
        let mut hidden = vec![false; document.nodes.len()];
        for &index in &self.order {
            let extension = document.nodes[index].extensions.others.get(VISIBILITY);
            let states = extension.and_then(|extension| extension.get("visible")?.as_bool());
            hidden[index] = states == Some(false) || self.parent[index].is_some_and(|parent| hidden[parent]);
        }
        shown.iter().copied().filter(|&index| !hidden[index]).collect()
    }

    pub fn nodes(&self, document: &Document) -> Result<Vec<Node>, Problem> {
        let make = |&index: &usize| {
            let node = &document.nodes[index];
            let parent = self.parent[index].map(|p| self.slot[p]);
            Ok(Node { name: node.name.clone(), parent, local: local_transform(document, index)? })
        };
        self.order.iter().map(make).collect()
    }
}

fn local_transform(document: &Document, index: usize) -> Result<Transform, Problem> {
    let node = &document.nodes[index];
    let finite = |ok: bool| {
        if ok { Ok(()) } else { Err(format!("node {index} has a transform that is not finite; export the file again")) }
    };
    if let Some(m) = &node.matrix {
        let matrix = DMat4::from_cols_array(m);
        finite(matrix.is_finite())?;
        if matrix.row(3) != glam::DVec4::W {
            document.warn(format!("node {index} has a projective matrix; the last row was ignored"));
        }
        return Ok(Transform::Matrix(DAffine3::from_mat4(matrix)));
    }
    let translation = DVec3::from(node.translation.unwrap_or_default());
    let scale = DVec3::from(node.scale.unwrap_or([1.0; 3]));
    let rotation = DQuat::from_array(node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]));
    finite(translation.is_finite() && scale.is_finite() && rotation.is_finite())?;
    Ok(trs(translation, rotation, scale))
}

/// A transform from its parts. A rotation without a direction is ignored.
pub fn trs(translation: DVec3, rotation: DQuat, scale: DVec3) -> Transform {
    let rotation = if rotation.length_squared() > 0.0 { rotation.normalize() } else { DQuat::IDENTITY };
    Transform::Trs { translation, rotation, scale }
}

/// The root nodes of the scene with the name or index `wanted`. By default they are those of the default scene, else of
/// the first scene, else all nodes.
pub fn choose_roots(document: &Document, wanted: Option<&str>) -> Result<Vec<usize>, Problem> {
    let scenes = &document.scenes;
    let index = match wanted {
        Some(wanted) => {
            let named = scenes.iter().position(|s| s.name == wanted);
            let index = named.or_else(|| wanted.parse().ok().filter(|i| *i < scenes.len()));
            Some(index.ok_or_else(|| {
                let names = list(scenes.iter().map(|s| s.name.as_str()));
                format!("has no scene \"{wanted}\"; --scene takes one of: {names}")
            })?)
        }
        None => document.scene.or((!scenes.is_empty()).then_some(0)),
    };
    match index {
        Some(index) => Ok(scenes.get(index).ok_or_else(|| missing("scene", index))?.nodes.clone()),
        None => {
            document.warn("the file has no scene; all of its nodes are shown");
            Ok((0..document.nodes.len()).collect())
        }
    }
}

pub fn load_cameras(document: &Document, tree: &NodeOrder, shown: &[usize], scene: &mut Scene) -> Result<(), Problem> {
    for &index in shown {
        let node = &document.nodes[index];
        let Some(camera) = node.camera else { continue };
        let source = document.cameras.get(camera).ok_or_else(|| missing("camera", camera))?;
        let projection = projection(source)
            .ok_or_else(|| format!("camera {camera} has no valid projection; correct it or remove the camera"))?;
        let name = source.name.as_ref().filter(|name| !name.is_empty()).unwrap_or(&node.name);
        scene.cameras.push(Camera { name: name.clone(), node: tree.slot[index], projection });
    }
    Ok(())
}

fn projection(camera: &json::Camera) -> Option<Projection> {
    let in_order = |near: f32, far: f32| near >= 0.0 && far > near;
    if let Some(p) = &camera.perspective {
        let far = p.zfar.unwrap_or(f32::INFINITY);
        let valid = p.yfov > 0.0 && p.yfov < std::f32::consts::PI && p.znear > 0.0 && in_order(p.znear, far);
        return valid.then_some(Projection::Perspective { fov: p.yfov, near: p.znear, far });
    }
    let o = camera.orthographic.as_ref()?;
    // Some exporters write a negative ymag; the sign has no meaning.
    let half_height = o.ymag.abs();
    let valid = half_height > 0.0 && half_height.is_finite() && in_order(o.znear, o.zfar);
    valid.then_some(Projection::Orthographic { half_height, near: o.znear, far: o.zfar })
}

pub fn load_lights(document: &Document, tree: &NodeOrder, shown: &[usize], scene: &mut Scene) -> Result<(), Problem> {
    let world = World::new(&scene.nodes, &[], scene.nodes.len());
    for &index in shown {
        let node = &document.nodes[index];
        let Some(number) = node.extensions.khr_lights_punctual.as_ref().map(|l| l.light.value()) else { continue };
        let source = document.lights().get(number).ok_or_else(|| missing("light", number))?;
        let mut light = light(document, number, source)?;
        light.node = tree.slot[index];
        check_near(index, &world.of_node(light.node))?;
        if light.name.is_empty() {
            light.name = node.name.clone();
        }
        scene.lights.push(light);
    }
    Ok(())
}

fn light(document: &Document, number: usize, source: &khr_lights_punctual::Light) -> Result<Light, Problem> {
    let kind = match source.type_ {
        Valid(Type::Point) => LightKind::Point,
        Valid(Type::Directional) => LightKind::Directional,
        Valid(Type::Spot) => {
            let (inner, outer) =
                source.spot.as_ref().map_or((0.0, FRAC_PI_4), |s| (s.inner_cone_angle, s.outer_cone_angle));
            let outer = outer.clamp(0.0, FRAC_PI_2);
            LightKind::Spot { inner: inner.clamp(0.0, outer), outer }
        }
        Invalid => {
            let kind = document.stated(&format!("/extensions/KHR_lights_punctual/lights/{number}/type"));
            return Err(format!("light {number} has the unknown type \"{kind}\"; use point, spot or directional"));
        }
    };
    let intensity = Vec3::from(source.color) * source.intensity;
    if !intensity.is_finite() {
        return Err(format!("light {number} has an intensity that is not finite; correct it"));
    }
    if intensity.min_element() < 0.0 {
        document.warn(format!("light {number} has a negative intensity; it was raised to 0"));
    }
    if source.range.is_some_and(|r| r <= 0.0) {
        document.warn(format!("light {number} has a range of 0 or less; it reaches everywhere"));
    }
    let extras: Option<serde_json::Value> = source.extras.as_ref().and_then(|e| serde_json::from_str(e.get()).ok());
    let radius = extras.and_then(|e| e.get("radius")?.as_f64()).unwrap_or(0.0);
    Ok(Light {
        name: source.name.clone().unwrap_or_default(),
        node: 0,
        kind,
        intensity: intensity.max(Vec3::ZERO),
        range: source.range.filter(|r| *r > 0.0).map_or(f32::INFINITY, |r| r.max(f32::MIN_POSITIVE)),
        radius: if radius.is_finite() { radius.max(0.0) as f32 } else { 0.0 },
    })
}
