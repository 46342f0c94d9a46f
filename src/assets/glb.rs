//! A writer of glTF 2.0 binaries with the features that the scenes here need. It cannot fail: it creates all indices itself.

use std::collections::BTreeSet;

use glam::DVec3;
use serde_json::{Value, json};

use super::shapes::Shape;

const FLOAT: u32 = 5126;
const UNSIGNED_SHORT: u32 = 5123;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// A glTF asset under construction. Methods that add an object return its index.
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

/// The accessors of a shape, which meshes of different materials can share.
#[derive(Clone)]
pub struct Geometry {
    attributes: Value,
    indices: usize,
}

impl Glb {
    /// An embedded PNG and its texture, repeated, with mip levels.
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
        let positions = self.vectors(shape.positions.iter().map(|p| p.to_array()), Some(ARRAY_BUFFER));
        let (min, max) = bounds(&shape.positions);
        self.accessors[positions]["min"] = json!(snapped(min));
        self.accessors[positions]["max"] = json!(snapped(max));
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
        let indices = accessor(view, UNSIGNED_SHORT, shape.indices.len(), "SCALAR");
        let indices = push(&mut self.accessors, indices);
        Geometry { attributes, indices }
    }

    pub fn mesh(&mut self, name: &str, geometry: &Geometry, material: usize) -> usize {
        let primitive = json!({ "attributes": geometry.attributes, "indices": geometry.indices, "material": material });
        push(&mut self.meshes, json!({ "name": name, "primitives": [primitive] }))
    }

    pub fn node(&mut self, node: Value) -> usize {
        push(&mut self.nodes, node)
    }

    /// A new mesh at a new node with the transform `placement` (`translation`, `rotation`, …).
    pub fn object(&mut self, name: &str, shape: &Shape, material: usize, placement: Value) -> usize {
        let geometry = self.geometry(shape);
        let mesh = self.mesh(name, &geometry, material);
        self.place(name, mesh, placement)
    }

    /// A new node with `mesh` and the transform `placement`.
    pub fn place(&mut self, name: &str, mesh: usize, mut placement: Value) -> usize {
        placement["name"] = json!(name);
        placement["mesh"] = json!(mesh);
        self.node(placement)
    }

    /// A KHR_lights_punctual light at `eye` that shines towards `target`.
    pub fn light(&mut self, name: &str, mut light: Value, [eye, target]: [DVec3; 2]) -> usize {
        light["name"] = json!(name);
        let light = push(&mut self.lights, light);
        let mut node = looking(eye, target);
        node["name"] = json!(name);
        node["extensions"] = json!({ "KHR_lights_punctual": { "light": light } });
        self.node(node)
    }

    /// A perspective camera at `eye` that looks at `target`; `fov` is vertical, in degrees.
    pub fn camera(&mut self, name: &str, [eye, target]: [DVec3; 2], fov: f64) -> usize {
        let perspective = json!({ "yfov": snap(fov.to_radians()), "znear": 0.01, "zfar": 100.0 });
        let camera =
            push(&mut self.cameras, json!({ "name": name, "type": "perspective", "perspective": perspective }));
        let mut node = looking(eye, target);
        node["name"] = json!(name);
        node["camera"] = json!(camera);
        self.node(node)
    }

    /// A linear animation of the rotation of `node`: keys of (seconds, quaternion).
    pub fn rotate(&mut self, name: &str, node: usize, keys: &[(f64, [f64; 4])]) {
        let input = self.vectors(keys.iter().map(|(time, _)| [*time]), None);
        self.accessors[input]["min"] = json!([keys[0].0]);
        self.accessors[input]["max"] = json!([keys[keys.len() - 1].0]);
        let output = self.vectors(keys.iter().map(|(_, rotation)| *rotation), None);
        self.animations.push(json!({
            "name": name,
            "samplers": [{ "input": input, "output": output, "interpolation": "LINEAR" }],
            "channels": [{ "sampler": 0, "target": { "node": node, "path": "rotation" } }],
        }));
    }

    /// The bytes of the file. Nodes without a parent become the roots of the scene.
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

    /// An accessor of vectors of `N` floats in a buffer view of its own.
    fn vectors<const N: usize>(
        &mut self,
        values: impl ExactSizeIterator<Item = [f64; N]>,
        target: Option<u32>,
    ) -> usize {
        let count = values.len();
        let bytes: Vec<u8> = values.flatten().flat_map(|v| snap(v).to_le_bytes()).collect();
        let view = self.view(&bytes, target);
        let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"][N - 1];
        push(&mut self.accessors, accessor(view, FLOAT, count, kind))
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
}

fn accessor(view: usize, component: u32, count: usize, kind: &str) -> Value {
    json!({ "bufferView": view, "componentType": component, "count": count, "type": kind })
}

/// Rounds to 2⁻²⁰, so that rounding differences of sine and cosine between machines do not change the files.
pub fn snap(x: f64) -> f32 {
    ((x * f64::from(1 << 20)).round() / f64::from(1 << 20)) as f32
}

/// A quaternion in glTF's order: x, y, z, w.
pub fn rotation(quat: glam::DQuat) -> Value {
    json!(quat.to_array().map(snap))
}

fn snapped(v: DVec3) -> [f32; 3] {
    v.to_array().map(snap)
}

/// A node at `eye` with −Z towards `target` and +Y as close to up as possible.
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

fn bounds(points: &[DVec3]) -> (DVec3, DVec3) {
    let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    points.iter().fold(empty, |(min, max), &p| (min.min(p), max.max(p)))
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
