//! glTF files made in code.

use std::path::PathBuf;

use glam::DVec3;
use serde_json::{Value, json};
use tempfile::TempDir;
use twobounce::scene::{LoadOptions, Scene};

/// A document with one binary buffer, which tests modify before they write it.
pub struct File {
    pub json: Value,
    pub binary: Vec<u8>,
}

pub const I8: u32 = 5120;
pub const U8: u32 = 5121;
pub const I16: u32 = 5122;
pub const U16: u32 = 5123;
pub const U32: u32 = 5125;
pub const F32: u32 = 5126;

impl File {
    /// One scene, no nodes.
    pub fn empty() -> Self {
        let json = json!({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}],
            "nodes": [], "meshes": [], "accessors": [], "bufferViews": [], "buffers": [{"byteLength": 0}]
        });
        Self { json, binary: Vec::new() }
    }

    /// One node with a mesh of one triangle in the plane z = 0: (0,0) (1,0) (0,1).
    pub fn triangle() -> Self {
        let mut file = Self::empty();
        let positions = file.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
        file.mesh(json!({"attributes": {"POSITION": positions}}));
        file
    }

    /// A quad (0,0)…(1,1) with indices, normals and uvs; v increases downwards.
    pub fn quad() -> Self {
        let mut file = Self::empty();
        let positions = file.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0]);
        let normals = file.floats("VEC3", &[0.0, 0.0, 1.0].repeat(4));
        let uvs = file.floats("VEC2", &[0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
        let indices = file.accessor(U8, "SCALAR", 6, &[0, 1, 2, 0, 2, 3]);
        let attributes = json!({"POSITION": positions, "NORMAL": normals, "TEXCOORD_0": uvs});
        file.mesh(json!({"attributes": attributes, "indices": indices}));
        file
    }

    /// Appends to the list at `key`, which is created if absent; returns the index.
    pub fn push(&mut self, key: &str, value: Value) -> usize {
        let list = self.json.as_object_mut().unwrap().entry(key).or_insert_with(|| json!([]));
        let list = list.as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    /// A mesh with one primitive on a new root node.
    pub fn mesh(&mut self, primitive: Value) -> usize {
        let mesh = self.push("meshes", json!({"primitives": [primitive]}));
        self.node(json!({"mesh": mesh}))
    }

    /// A root node of scene 0.
    pub fn node(&mut self, node: Value) -> usize {
        let node = self.push("nodes", node);
        self.json["scenes"][0]["nodes"].as_array_mut().unwrap().push(json!(node));
        node
    }

    pub fn view(&mut self, bytes: &[u8]) -> usize {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let offset = self.binary.len();
        self.binary.extend(bytes);
        self.json["buffers"][0]["byteLength"] = json!(self.binary.len());
        self.push("bufferViews", json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()}))
    }

    pub fn accessor(&mut self, component: u32, kind: &str, count: usize, bytes: &[u8]) -> usize {
        let view = self.view(bytes);
        self.push("accessors", json!({"bufferView": view, "componentType": component, "type": kind, "count": count}))
    }

    pub fn floats(&mut self, kind: &str, values: &[f32]) -> usize {
        let width = ["SCALAR", "VEC2", "VEC3", "VEC4"].iter().position(|k| *k == kind).map_or(16, |w| w + 1);
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(F32, kind, values.len() / width, &bytes)
    }

    /// A material for mesh 0.
    pub fn material(&mut self, material: Value) {
        let index = self.push("materials", material);
        self.json["meshes"][0]["primitives"][0]["material"] = json!(index);
    }

    /// An embedded PNG with a texture of its own.
    pub fn texture(&mut self, png: &[u8]) -> usize {
        let view = self.view(png);
        let image = self.push("images", json!({"bufferView": view, "mimeType": "image/png"}));
        self.push("textures", json!({"source": image}))
    }

    pub fn glb(&self) -> Vec<u8> {
        let mut text = serde_json::to_vec(&self.json).unwrap();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut binary = self.binary.clone();
        binary.resize(binary.len().next_multiple_of(4), 0);
        let mut out = b"glTF".to_vec();
        let total = 12 + 8 + text.len() + 8 + binary.len();
        for word in [2, total as u32, text.len() as u32, 0x4E4F534A] {
            out.extend(word.to_le_bytes());
        }
        out.extend(&text);
        for word in [binary.len() as u32, 0x004E4942] {
            out.extend(word.to_le_bytes());
        }
        out.extend(&binary);
        out
    }

    pub fn load(&self) -> Result<Scene, String> {
        load_bytes("scene.glb", &self.glb())
    }

    /// Loads a valid file.
    pub fn scene(&self) -> Scene {
        self.load().unwrap_or_else(|e| panic!("{e}"))
    }
}

/// A temporary folder with a file `name` of these bytes, and the file's path.
pub fn write(name: &str, bytes: &[u8]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    (folder, path)
}

/// Loads a file of these bytes; the error is the message for the user.
pub fn load_bytes(name: &str, bytes: &[u8]) -> Result<Scene, String> {
    let (_folder, path) = write(name, bytes);
    Scene::load(&path, &LoadOptions::default()).map_err(|e| e.to_string())
}

/// A PNG of 8-bit RGBA texels.
pub fn png(width: u32, height: u32, rgba: &[u8]) -> Vec<u8> {
    let image = image::RgbaImage::from_raw(width, height, rgba.to_vec()).unwrap();
    let mut out = std::io::Cursor::new(Vec::new());
    image.write_to(&mut out, image::ImageFormat::Png).unwrap();
    out.into_inner()
}

/// World positions of all vertices, in the order of meshes and indices.
pub fn corners(scene: &Scene) -> Vec<DVec3> {
    let pose = scene.pose(None, 0.0);
    let of_instance = |(instance, world): (&twobounce::scene::Instance, &glam::DAffine3)| {
        let mesh = &scene.meshes[instance.mesh];
        mesh.indices.iter().map(|&i| world.transform_point3(mesh.positions[i as usize].as_dvec3())).collect::<Vec<_>>()
    };
    scene.instances.iter().zip(&pose.world_from_instance).flat_map(of_instance).collect()
}

pub fn assert_near(a: DVec3, b: DVec3, tolerance: f64) {
    assert!((a - b).length() <= tolerance, "{a} is not {b}");
}
