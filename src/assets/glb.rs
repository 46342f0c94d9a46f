//! A writer of glTF 2.0 binaries: just what the scenes here need. Errors cannot happen; every index is handed out here.

use std::collections::BTreeSet;

use glam::{DVec2, DVec3};
use serde_json::{Value, json};

use super::shapes::Shape;

const FLOAT: u32 = 5126;
const UNSIGNED_SHORT: u32 = 5123;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// A glTF asset under construction. What is added gets its index back.
#[derive(Default)]
pub struct Glb {
    bin: Vec<u8>,
    buffer_views: Vec<Value>,
    accessors: Vec<Value>,
    images: Vec<Value>,
    materials: Vec<Value>,
    meshes: Vec<Value>,
    nodes: Vec<Value>,
    lights: Vec<Value>,
    cameras: Vec<Value>,
    animations: Vec<Value>,
}

/// A shape's accessors, to be shared by meshes of different materials.
#[derive(Clone)]
pub struct Geometry {
    attributes: Value,
    indices: usize,
}

impl Glb {
    /// An embedded PNG and the texture that shows it, repeated, with mip levels.
    pub fn texture(&mut self, name: &str, png: &[u8]) -> usize {
        let view = self.view(png, None);
        self.images.push(json!({ "name": name, "mimeType": "image/png", "bufferView": view }));
        self.images.len() - 1
    }

    pub fn material(&mut self, material: Value) -> usize {
        push(&mut self.materials, material)
    }

    pub fn geometry(&mut self, shape: &Shape) -> Geometry {
        assert!(shape.positions.len() <= usize::from(u16::MAX), "indices are 16 bits wide");
        let positions = self.vec3s(&shape.positions);
        let (min, max) = bounds(&shape.positions);
        self.accessors[positions]["min"] = json!(snapped(min));
        self.accessors[positions]["max"] = json!(snapped(max));
        let mut attributes = json!({ "POSITION": positions, "NORMAL": self.vec3s(&shape.normals) });
        if !shape.uvs.is_empty() {
            attributes["TEXCOORD_0"] = json!(self.vec2s(&shape.uvs));
        }
        if !shape.colors.is_empty() {
            attributes["COLOR_0"] = json!(self.vec3s(&shape.colors));
        }
        let bytes: Vec<u8> = shape.indices.iter().flat_map(|&i| (i as u16).to_le_bytes()).collect();
        let view = self.view(&bytes, Some(ELEMENT_ARRAY_BUFFER));
        let indices = self.accessor(view, UNSIGNED_SHORT, shape.indices.len(), "SCALAR");
        Geometry { attributes, indices }
    }

    pub fn mesh(&mut self, name: &str, geometry: &Geometry, material: usize) -> usize {
        let primitive = json!({ "attributes": geometry.attributes, "indices": geometry.indices, "material": material });
        push(&mut self.meshes, json!({ "name": name, "primitives": [primitive] }))
    }

    pub fn node(&mut self, node: Value) -> usize {
        push(&mut self.nodes, node)
    }

    /// A mesh of its own on a node of its own, placed by `placement` (`translation`, `rotation`, …).
    pub fn object(&mut self, name: &str, shape: &Shape, material: usize, placement: Value) -> usize {
        let geometry = self.geometry(shape);
        let mesh = self.mesh(name, &geometry, material);
        self.place(name, mesh, placement)
    }

    /// Hangs `mesh` on a node of its own.
    pub fn place(&mut self, name: &str, mesh: usize, mut placement: Value) -> usize {
        placement["name"] = json!(name);
        placement["mesh"] = json!(mesh);
        self.node(placement)
    }

    /// A KHR_lights_punctual light at `eye`, shining towards `target`.
    pub fn light(&mut self, name: &str, mut light: Value, eye: DVec3, target: DVec3) -> usize {
        light["name"] = json!(name);
        let light = push(&mut self.lights, light);
        let mut node = looking(eye, target);
        node["name"] = json!(name);
        node["extensions"] = json!({ "KHR_lights_punctual": { "light": light } });
        self.node(node)
    }

    /// A perspective camera at `eye` looking at `target`; `fov` is vertical, in degrees.
    pub fn camera(&mut self, name: &str, eye: DVec3, target: DVec3, fov: f64) -> usize {
        let perspective = json!({ "yfov": snap(fov.to_radians()), "znear": 0.01, "zfar": 100.0 });
        let camera =
            push(&mut self.cameras, json!({ "name": name, "type": "perspective", "perspective": perspective }));
        let mut node = looking(eye, target);
        node["name"] = json!(name);
        node["camera"] = json!(camera);
        self.node(node)
    }

    /// A looped, linear animation of one node's `path`: keys of (seconds, components).
    pub fn animate(&mut self, name: &str, node: usize, path: &str, keys: &[(f64, Vec<f64>)]) {
        let times: Vec<f64> = keys.iter().map(|(time, _)| *time).collect();
        let (first, last) = (times[0], times[times.len() - 1]);
        let view = self.view(&floats(times), None);
        let input = self.accessor(view, FLOAT, keys.len(), "SCALAR");
        self.accessors[input]["min"] = json!([first]);
        self.accessors[input]["max"] = json!([last]);
        let kind = if path == "rotation" { "VEC4" } else { "VEC3" };
        let view = self.view(&floats(keys.iter().flat_map(|(_, value)| value.clone())), None);
        let output = self.accessor(view, FLOAT, keys.len(), kind);
        self.animations.push(json!({
            "name": name,
            "samplers": [{ "input": input, "output": output, "interpolation": "LINEAR" }],
            "channels": [{ "sampler": 0, "target": { "node": node, "path": path } }],
        }));
    }

    /// The whole file. Nodes that no other node holds become the scene's roots.
    pub fn finish(mut self, name: &str, copyright: &str) -> Vec<u8> {
        pad(&mut self.bin, 0);
        let children: BTreeSet<u64> = self
            .nodes
            .iter()
            .filter_map(|node| node["children"].as_array())
            .flatten()
            .filter_map(Value::as_u64)
            .collect();
        let roots: Vec<usize> = (0..self.nodes.len()).filter(|&node| !children.contains(&(node as u64))).collect();
        let textures: Vec<Value> = (0..self.images.len()).map(|i| json!({ "source": i, "sampler": 0 })).collect();
        let mut root = json!({
            "asset": { "version": "2.0", "generator": "twobounce make-assets", "copyright": copyright },
            "scene": 0,
            "scenes": [{ "name": name, "nodes": roots }],
            "nodes": self.nodes,
            "meshes": self.meshes,
            "materials": self.materials,
            "accessors": self.accessors,
            "bufferViews": self.buffer_views,
            "buffers": [{ "byteLength": self.bin.len() }],
        });
        if !textures.is_empty() {
            root["samplers"] = json!([{ "magFilter": 9729, "minFilter": 9987, "wrapS": 10497, "wrapT": 10497 }]);
            root["textures"] = json!(textures);
            root["images"] = json!(self.images);
        }
        for (key, list) in [("cameras", self.cameras), ("animations", self.animations)] {
            if !list.is_empty() {
                root[key] = json!(list);
            }
        }
        if !self.lights.is_empty() {
            root["extensions"] = json!({ "KHR_lights_punctual": { "lights": self.lights } });
        }
        let mut used = BTreeSet::new();
        extensions(&root, &mut used);
        if !used.is_empty() {
            root["extensionsUsed"] = json!(used);
        }
        container(&root, &self.bin)
    }

    fn vec3s(&mut self, values: &[DVec3]) -> usize {
        let view = self.view(&floats(values.iter().flat_map(|v| v.to_array())), Some(ARRAY_BUFFER));
        self.accessor(view, FLOAT, values.len(), "VEC3")
    }

    fn vec2s(&mut self, values: &[DVec2]) -> usize {
        let view = self.view(&floats(values.iter().flat_map(|v| v.to_array())), Some(ARRAY_BUFFER));
        self.accessor(view, FLOAT, values.len(), "VEC2")
    }

    fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        pad(&mut self.bin, 0);
        let mut view = json!({ "buffer": 0, "byteOffset": self.bin.len(), "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.bin.extend_from_slice(bytes);
        push(&mut self.buffer_views, view)
    }

    fn accessor(&mut self, view: usize, component: u32, count: usize, kind: &str) -> usize {
        let accessor = json!({ "bufferView": view, "componentType": component, "count": count, "type": kind });
        push(&mut self.accessors, accessor)
    }
}

/// Rounds to 2⁻²⁰, so that the last bits of a machine's sine and cosine do not show in the files.
pub fn snap(x: f64) -> f32 {
    ((x * f64::from(1 << 20)).round() / f64::from(1 << 20)) as f32
}

/// A quaternion as glTF writes it: x, y, z, w.
pub fn rotation(quat: glam::DQuat) -> Value {
    json!(quat.to_array().map(snap))
}

fn snapped(v: DVec3) -> [f32; 3] {
    v.to_array().map(snap)
}

/// A node at `eye` whose −Z looks at `target`, +Y up as far as that goes.
fn looking(eye: DVec3, target: DVec3) -> Value {
    let back = (eye - target).normalize();
    let up = if back.y.abs() > 0.999 { DVec3::Z } else { DVec3::Y };
    let right = up.cross(back).normalize();
    let quat = glam::DQuat::from_mat3(&glam::DMat3::from_cols(right, back.cross(right), back));
    json!({ "translation": snapped(eye), "rotation": rotation(quat) })
}

fn push(list: &mut Vec<Value>, value: Value) -> usize {
    list.push(value);
    list.len() - 1
}

fn floats(values: impl IntoIterator<Item = f64>) -> Vec<u8> {
    values.into_iter().flat_map(|v| snap(v).to_le_bytes()).collect()
}

fn bounds(points: &[DVec3]) -> (DVec3, DVec3) {
    let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    points.iter().fold(empty, |(min, max), &p| (min.min(p), max.max(p)))
}

/// The names of every extension in use, wherever it stands.
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

fn pad(bytes: &mut Vec<u8>, with: u8) {
    bytes.resize(bytes.len().next_multiple_of(4), with);
}

/// GLB: a header of 12 bytes, then the JSON and the BIN chunk.
fn container(root: &Value, bin: &[u8]) -> Vec<u8> {
    let mut text = root.to_string().into_bytes();
    pad(&mut text, b' ');
    let mut file = Vec::with_capacity(28 + text.len() + bin.len());
    for word in [0x4654_6C67, 2, (28 + text.len() + bin.len()) as u32, text.len() as u32, 0x4E4F_534A] {
        file.extend_from_slice(&u32::to_le_bytes(word));
    }
    file.extend_from_slice(&text);
    for word in [bin.len() as u32, 0x004E_4942] {
        file.extend_from_slice(&u32::to_le_bytes(word));
    }
    file.extend_from_slice(bin);
    file
}
