//! The glTF document: JSON types of the `gltf` crate, never validated, and own ones for what they cannot hold.
//!
//! Its `Root` is not used: its node transforms are f32 (a node at 10 000 000.25 m would move), and it refuses files for
//! scenes without nodes and for animation channels without a target. Its validation refuses quantised meshes.

use std::sync::OnceLock;

use gltf::json::extensions::scene::khr_lights_punctual::Light;
use gltf::json::validation::USize64;
use gltf::json::{self, Index};
use serde::Deserialize;
use serde_json::Value;

use super::container::shorten;

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub struct Document {
    pub extensions_used: Vec<String>,
    pub extensions_required: Vec<String>,
    pub scene: Option<usize>,
    pub scenes: Vec<SceneRoots>,
    pub nodes: Vec<Node>,
    pub meshes: Vec<json::Mesh>,
    pub skins: Vec<json::Skin>,
    pub cameras: Vec<json::Camera>,
    pub animations: Vec<Animation>,
    pub materials: Vec<json::Material>,
    pub textures: Vec<json::Texture>,
    pub samplers: Vec<json::texture::Sampler>,
    pub images: Vec<json::Image>,
    pub accessors: Vec<json::Accessor>,
    pub buffer_views: Vec<json::buffer::View>,
    pub buffers: Vec<json::Buffer>,
    pub extensions: json::extensions::Root,
    /// The text that all of this was read from.
    #[serde(skip)]
    pub source: Vec<u8>,
    #[serde(skip)]
    tree: OnceLock<Value>,
}

impl Document {
    pub fn parse(source: Vec<u8>) -> Result<Self, serde_json::Error> {
        let document: Self = serde_json::from_slice(&source)?;
        Ok(Self { source, ..document })
    }

    pub fn lights(&self) -> &[Light] {
        self.extensions.khr_lights_punctual.as_ref().map_or(&[], |l| &l.lights)
    }

    /// The value at a JSON pointer, for messages: of an unknown value the crate's types keep only that it is invalid.
    pub fn stated(&self, pointer: &str) -> String {
        let tree = self.tree.get_or_init(|| serde_json::from_slice(&self.source).unwrap_or_default());
        match tree.pointer(pointer) {
            Some(Value::String(text)) => shorten(text),
            Some(value) => shorten(&value.to_string()),
            None => String::new(),
        }
    }
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub struct Asset {
    pub version: String,
    pub min_version: Option<String>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub struct SceneRoots {
    pub name: String,
    pub nodes: Vec<usize>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub struct Node {
    pub name: String,
    pub children: Vec<usize>,
    pub matrix: Option<[f64; 16]>,
    pub translation: Option<[f64; 3]>,
    pub rotation: Option<[f64; 4]>,
    pub scale: Option<[f64; 3]>,
    pub mesh: Option<usize>,
    pub skin: Option<usize>,
    pub camera: Option<usize>,
    pub weights: Option<Vec<f32>>,
    pub extensions: json::extensions::scene::Node,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub struct Animation {
    pub name: String,
    pub channels: Vec<Channel>,
    pub samplers: Vec<json::animation::Sampler>,
}

#[derive(Deserialize)]
pub struct Channel {
    pub sampler: usize,
    pub target: Target,
}

#[derive(Deserialize)]
pub struct Target {
    pub node: Option<usize>,
    pub path: String,
}

/// The image of a texture; the crate has an index that no file can hold where there is none.
pub fn image_of(texture: &json::Texture) -> Option<usize> {
    (texture.source != Index::new(u32::MAX)).then(|| texture.source.value())
}

/// A size or an offset. What does not fit into memory is larger than any file, and is found so.
pub fn size(size: USize64) -> usize {
    usize::try_from(size.0).unwrap_or(usize::MAX)
}
