//! A writer of glTF 2.0 binaries from descriptions in TOML.
//!
//! A description has the materials and nodes of a glTF document, with these differences. A node has a shape and the
//! name of a material instead of a mesh, and holds its light or camera itself. A material lists the images to embed
//! before its first use. Motion is described at the thing that moves, by keys, and becomes one animation.

use std::collections::{BTreeMap, BTreeSet};

use glam::{DMat3, DMat4, DQuat, DVec3};
use gltf::binary::{self, Header};
use serde::Deserialize;
use serde_json::{Map, Value, json};

use super::shapes::{Form, Shape};
use super::texels;
use super::tracks::{self, Angle, Keys, Sway};
use crate::{Error, Result};

const FLOAT: u32 = 5126;
const UNSIGNED_BYTE: u32 = 5121;
const UNSIGNED_SHORT: u32 = 5123;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

#[derive(Deserialize)]
struct Description {
    /// The name of the animation, if something moves.
    animation: Option<String>,
    materials: Vec<Value>,
    nodes: Vec<FileNode>,
}

#[derive(Deserialize)]
struct FileNode {
    name: String,
    shape: Option<Form>,
    /// The name of the shape's material.
    material: Option<String>,
    /// A light of KHR_lights_punctual.
    light: Option<Value>,
    /// Makes the node a perspective camera; vertical, in degrees.
    fov: Option<f64>,
    /// The node's position, and a point on its −Z axis.
    looks: Option<[[f64; 3]; 2]>,
    /// Makes the node rotate around Y: seconds per rotation.
    turn_s: Option<f64>,
    /// The node's path: seconds, then metres.
    path: Option<Keys<4>>,
    /// The node's position over time, and a point on its −Z axis.
    flight: Option<Keys<7>>,
    angle: Option<Angle>,
    /// The weight of the shape's other form: seconds, then 0 to 1.
    morph: Option<Keys<2>>,
    /// Makes the shape a chain of joints.
    sway: Option<Sway>,
    /// Properties of a glTF node.
    #[serde(flatten)]
    others: Map<String, Value>,
}

/// A glTF asset under construction.
#[derive(Default)]
struct Glb {
    bin: Vec<u8>,
    /// The lists of the document, by their keys.
    lists: BTreeMap<&'static str, Vec<Value>>,
    samplers: Vec<Value>,
    channels: Vec<Value>,
    /// Each shape so far as a primitive without a material: equal shapes are stored once.
    shapes: Vec<(Form, Value)>,
}

/// The bytes of the file that `description` describes.
pub fn make(name: &str, description: &str) -> Result<Vec<u8>> {
    let invalid = |e| Error::Usage(format!("the description of the scene {name} is not valid: {e}"));
    let Description { animation, materials, nodes } = toml::from_str(description).map_err(invalid)?;
    let mut glb = Glb { lists: BTreeMap::from([("materials", materials)]), ..Glb::default() };
    for node in nodes {
        glb.node(node)?;
    }
    if let Some(name) = animation {
        let (samplers, channels) = (std::mem::take(&mut glb.samplers), std::mem::take(&mut glb.channels));
        glb.push("animations", json!({ "name": name, "samplers": samplers, "channels": channels }));
    }
    glb.finish(name)
}

impl Glb {
    fn node(&mut self, node: FileNode) -> Result<()> {
        let name = json!(node.name);
        let mut made = Value::Object(node.others);
        made["name"] = name.clone();
        if let Some([eye, target]) = node.looks {
            made["translation"] = json!(eye.map(snap));
            made["rotation"] = json!(looking(eye.into(), target.into()).to_array().map(snap));
        }
        if let Some(form) = node.shape {
            let material = self.material(node.material.as_deref())?;
            let mut primitive = self.primitive(&form);
            primitive["material"] = json!(material);
            if let Some(sway) = &node.sway {
                // The joints determine the place of a skinned mesh, so its node has no transform.
                let at = made.as_object_mut().and_then(|node| node.remove("translation"));
                made["skin"] = json!(self.sway(sway, &form, &mut primitive, at.unwrap_or_default()));
            }
            let mut mesh = json!({ "name": name, "primitives": [primitive] });
            if node.morph.is_some() {
                mesh["weights"] = json!([0.0]);
            }
            made["mesh"] = json!(self.push("meshes", mesh));
        }
        if let Some(mut light) = node.light {
            light["name"] = name.clone();
            made["extensions"] = json!({ "KHR_lights_punctual": { "light": self.push("lights", light) } });
        }
        if let Some(fov) = node.fov {
            let perspective = json!({ "yfov": snap(fov.to_radians()), "znear": 0.01, "zfar": 100.0 });
            let camera = json!({ "name": name, "type": "perspective", "perspective": perspective });
            made["camera"] = json!(self.push("cameras", camera));
        }
        let index = self.push("nodes", made);
        if let Some(seconds) = node.turn_s {
            self.track(index, "rotation", tracks::turn(seconds));
        }
        if let Some(keys) = &node.path {
            self.track::<3>(index, "translation", tracks::smooth(keys));
        }
        if let Some(keys) = &node.flight {
            let seen = tracks::smooth(keys);
            let at = |p: &[f64; 6]| DVec3::from_slice(&p[..3]);
            let turned = |p: &[f64; 6]| looking(at(p), DVec3::from_slice(&p[3..])).to_array();
            self.track(index, "translation", seen.iter().map(|(t, p)| (*t, at(p).to_array())).collect());
            self.track(index, "rotation", seen.iter().map(|(t, p)| (*t, turned(p))).collect());
        }
        if let Some(angle) = &node.angle {
            self.track(index, "rotation", angle.rotations());
        }
        if let Some(keys) = &node.morph {
            self.track::<1>(index, "weights", tracks::smooth(keys));
        }
        Ok(())
    }

    /// Animates a property of a node: seconds and values, linear between them.
    fn track<const N: usize>(&mut self, node: usize, path: &str, keys: Vec<(f64, [f64; N])>) {
        let last = keys.last().map_or(0.0, |(t, _)| *t);
        let input = self.vectors(keys.iter().map(|(t, _)| [*t]), None);
        self.limits(input, [0.0], [last as f32]);
        let output = self.vectors(keys.iter().map(|(_, value)| *value), None);
        let sampler = self.samplers.len();
        self.samplers.push(json!({ "input": input, "output": output, "interpolation": "LINEAR" }));
        self.channels.push(json!({ "sampler": sampler, "target": { "node": node, "path": path } }));
    }

    /// A skin for the shape: a chain of joints from `at` upwards, each rotated against the one below. Vertices follow
    /// the two joints that are nearest in height.
    fn sway(&mut self, sway: &Sway, form: &Form, primitive: &mut Value, at: Value) -> usize {
        let heights: Vec<f64> = Shape::of_form(form).positions.iter().map(|p| p.y).collect();
        let height = heights.iter().copied().fold(0.0, f64::max);
        let step = height / f64::from(sway.joints);
        let joints: Vec<usize> = (0..sway.joints)
            .map(|joint| {
                let place = if joint == 0 { at.clone() } else { json!([0.0, snap(step), 0.0]) };
                let index = self.push("nodes", json!({ "name": "joint", "translation": place }));
                self.track(index, "rotation", sway.rotations(joint));
                index
            })
            .collect();
        for pair in joints.windows(2) {
            self.lists.get_mut("nodes").expect("just pushed")[pair[0]]["children"] = json!([pair[1]]);
        }
        let inverse = (0..sway.joints)
            .map(|joint| DMat4::from_translation(DVec3::NEG_Y * step * f64::from(joint)).to_cols_array());
        let inverse = self.vectors(inverse.collect::<Vec<_>>().into_iter(), None);
        let (mut of, mut weights) = (vec![], vec![]);
        for y in heights {
            // A joint rotates the part above it; between two, both do.
            let along = (y / step - 0.5).clamp(0.0, f64::from(sway.joints - 1));
            let lower = (along as u8).min((sway.joints - 2) as u8);
            let upper = along - f64::from(lower);
            of.extend([lower, lower + 1, 0, 0]);
            weights.push([1.0 - upper, upper, 0.0, 0.0]);
        }
        let view = self.view(&of, Some(ARRAY_BUFFER));
        primitive["attributes"]["JOINTS_0"] = json!(self.accessor(view, UNSIGNED_BYTE, weights.len(), "VEC4"));
        primitive["attributes"]["WEIGHTS_0"] = json!(self.vectors(weights.into_iter(), Some(ARRAY_BUFFER)));
        self.push("skins", json!({ "joints": joints, "inverseBindMatrices": inverse }))
    }

    /// The index of the material with this name. Its images are added to the file.
    fn material(&mut self, name: Option<&str>) -> Result<usize> {
        let materials = self.lists.entry("materials").or_default();
        let index = materials.iter().position(|m| m["name"].as_str() == name);
        let index = index.ok_or_else(|| Error::Usage(format!("a scene's description has no material {name:?}")))?;
        let images = materials[index].as_object_mut().and_then(|m| m.remove("images")).unwrap_or_default();
        for image in images.as_array().into_iter().flatten() {
            let view = self.view(&texels::png(image.as_str().unwrap_or_default())?, None);
            self.push("images", json!({ "name": image, "mimeType": "image/png", "bufferView": view }));
        }
        Ok(index)
    }

    /// The attributes and indices of a shape.
    fn primitive(&mut self, form: &Form) -> Value {
        if let Some((_, primitive)) = self.shapes.iter().find(|(f, _)| f == form) {
            return primitive.clone();
        }
        let shape = Shape::of_form(form);
        assert!(shape.positions.len() <= usize::from(u16::MAX), "indices are 16 bits wide");
        let positions = self.positions(&shape.positions, Some(ARRAY_BUFFER));
        let normals = self.vectors(shape.normals.iter().map(|n| n.to_array()), Some(ARRAY_BUFFER));
        let mut attributes = json!({ "POSITION": positions, "NORMAL": normals });
        if !shape.uvs.is_empty() {
            let uvs = self.vectors(shape.uvs.iter().map(|uv| uv.to_array()), Some(ARRAY_BUFFER));
            attributes["TEXCOORD_0"] = json!(uvs);
        }
        if !shape.colors.is_empty() {
            let colors = self.vectors(shape.colors.iter().map(|c| c.to_array()), Some(ARRAY_BUFFER));
            attributes["COLOR_0"] = json!(colors);
        }
        let bytes: Vec<u8> = shape.indices.iter().flat_map(|&i| (i as u16).to_le_bytes()).collect();
        let view = self.view(&bytes, Some(ELEMENT_ARRAY_BUFFER));
        let indices = self.accessor(view, UNSIGNED_SHORT, shape.indices.len(), "SCALAR");
        let mut primitive = json!({ "attributes": attributes, "indices": indices });
        if let Some((positions, normals)) = &shape.morph {
            let moved = self.positions(positions, None);
            let turned = self.vectors(normals.iter().map(|n| n.to_array()), None);
            primitive["targets"] = json!([{ "POSITION": moved, "NORMAL": turned }]);
        }
        self.shapes.push((form.clone(), primitive.clone()));
        primitive
    }

    /// The bytes of the file. Nodes without a parent become the roots of the scene.
    fn finish(mut self, name: &str) -> Result<Vec<u8>> {
        self.align();
        let nodes = &self.lists["nodes"];
        let children: Vec<&Value> = nodes.iter().filter_map(|node| node["children"].as_array()).flatten().collect();
        let roots: Vec<usize> = (0..nodes.len()).filter(|&node| !children.contains(&&json!(node))).collect();
        let lights = self.lists.remove("lights");
        let mut root = json!(self.lists);
        root["asset"] = json!({
            "version": "2.0",
            "generator": "twobounce make-assets",
            "copyright": "CC0 1.0: dedicated to the public domain",
        });
        root["scene"] = json!(0);
        root["scenes"] = json!([{ "name": name, "nodes": roots }]);
        root["buffers"] = json!([{ "byteLength": self.bin.len() }]);
        if let Some(images) = self.lists.get("images") {
            let texture = |image: usize| json!({ "source": image, "sampler": 0 });
            root["samplers"] = json!([{ "magFilter": 9729, "minFilter": 9987, "wrapS": 10497, "wrapT": 10497 }]);
            root["textures"] = (0..images.len()).map(texture).collect();
        }
        if let Some(lights) = lights {
            root["extensions"] = json!({ "KHR_lights_punctual": { "lights": lights } });
        }
        let mut used = BTreeSet::new();
        extensions(&root, &mut used);
        root["extensionsUsed"] = json!(used);
        // The crate writes the lengths.
        let header = Header { magic: *b"glTF", version: 2, length: 0 };
        let file = binary::Glb { header, json: root.to_string().into_bytes().into(), bin: Some(self.bin.into()) };
        file.to_vec().map_err(|e| Error::Usage(format!("the scene {name} cannot be written: {e}")))
    }

    /// An accessor of vectors of `N` floats in a buffer view of its own.
    fn vectors<const N: usize>(
        &mut self,
        values: impl ExactSizeIterator<Item = [f64; N]>,
        target: Option<u32>,
    ) -> usize {
        let count = values.len();
        let bytes: Vec<u8> = values.flatten().flat_map(|v| snap(v).to_le_bytes()).collect();
        let view = self.view(&bytes, target);
        let kind = match N {
            16 => "MAT4",
            _ => ["SCALAR", "VEC2", "VEC3", "VEC4"][N - 1],
        };
        self.accessor(view, FLOAT, count, kind)
    }

    fn accessor(&mut self, view: usize, component: u32, count: usize, kind: &str) -> usize {
        let accessor = json!({ "bufferView": view, "componentType": component, "count": count, "type": kind });
        self.push("accessors", accessor)
    }

    /// Vectors with their bounds, which glTF requires for positions.
    fn positions(&mut self, positions: &[DVec3], target: Option<u32>) -> usize {
        let accessor = self.vectors(positions.iter().map(|p| p.to_array()), target);
        let bound = |start: DVec3, of: fn(DVec3, DVec3) -> DVec3| {
            positions.iter().copied().fold(start, of).to_array().map(snap)
        };
        let (least, greatest) = (bound(DVec3::INFINITY, DVec3::min), bound(DVec3::NEG_INFINITY, DVec3::max));
        self.limits(accessor, least, greatest);
        accessor
    }

    fn limits<const N: usize>(&mut self, accessor: usize, min: [f32; N], max: [f32; N]) {
        if let Some(accessor) = self.lists.get_mut("accessors").and_then(|list| list.get_mut(accessor)) {
            (accessor["min"], accessor["max"]) = (min.as_slice().into(), max.as_slice().into());
        }
    }

    fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        self.align();
        let mut view = json!({ "buffer": 0, "byteOffset": self.bin.len(), "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.bin.extend_from_slice(bytes);
        self.push("bufferViews", view)
    }

    /// Buffer views begin at multiples of four bytes.
    fn align(&mut self) {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
    }

    /// Adds `value` to a list of the document. Returns its index.
    fn push(&mut self, list: &'static str, value: Value) -> usize {
        let list = self.lists.entry(list).or_default();
        list.push(value);
        list.len() - 1
    }
}

/// Rounds to 2⁻²⁰, so that rounding differences of sine and cosine between machines do not change the files.
fn snap(x: f64) -> f32 {
    ((x * f64::from(1 << 20)).round() / f64::from(1 << 20)) as f32
}

/// The rotation of a node at `eye` with −Z towards `target` and +Y as close to up as possible.
fn looking(eye: DVec3, target: DVec3) -> DQuat {
    let back = (eye - target).normalize();
    let up = if back.y.abs() > 0.999 { DVec3::Z } else { DVec3::Y };
    let right = up.cross(back).normalize();
    DQuat::from_mat3(&DMat3::from_cols(right, back.cross(right), back))
}

/// Adds the names of all extensions in `value` and its descendants to `used`.
fn extensions(value: &Value, used: &mut BTreeSet<String>) {
    match value {
        Value::Object(map) => {
            if let Some(Value::Object(found)) = map.get("extensions") {
                used.extend(found.keys().cloned());
            }
            map.values().for_each(|inner| extensions(inner, used));
        }
        Value::Array(list) => list.iter().for_each(|inner| extensions(inner, used)),
        _ => {}
    }
}
