//! The glTF document: JSON types of the `gltf` crate, without its validation, and own types where those do not fit.
//!
//! The crate's `Root` is not used: its node transforms are f32 (a node at 10 000 000.25 m would move), and it refuses scenes
//! without nodes and animation channels without a target. Its validation refuses quantised meshes.

use std::sync::{Mutex, OnceLock, PoisonError};

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
    /// The text that this document was parsed from.
    #[serde(skip)]
    pub source: Vec<u8>,
    #[serde(skip)]
    tree: OnceLock<Value>,
    #[serde(skip)]
    warnings: Mutex<Vec<String>>,
}

/// Distinct warnings that are kept: a file with more has one cause for most of them.
const WARNINGS_MAX: usize = 50;

impl Document {
    pub fn parse(source: Vec<u8>) -> Result<Self, serde_json::Error> {
        let document: Self = serde_json::from_slice(&source)?;
        Ok(Self { source, ..document })
    }

    pub fn lights(&self) -> &[Light] {
        self.extensions.khr_lights_punctual.as_ref().map_or(&[], |l| &l.lights)
    }

    /// Adds one sentence about something that is ignored or simplified. A repeated sentence is kept once.
    pub fn warn(&self, sentence: impl Into<String>) {
        let sentence = sentence.into();
        let mut warnings = self.warnings.lock().unwrap_or_else(PoisonError::into_inner);
        if warnings.len() > WARNINGS_MAX || warnings.contains(&sentence) {
            return;
        }
        let full = warnings.len() == WARNINGS_MAX;
        warnings.push(if full { "further warnings were left out".into() } else { sentence });
    }

    pub fn into_warnings(self) -> Vec<String> {
        self.warnings.into_inner().unwrap_or_else(PoisonError::into_inner)
    }

    /// The value at a JSON pointer, for messages: for an unknown value the crate's types only say that it is invalid.
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

/// The image of a texture. The crate marks a missing image by the index `u32::MAX`.
pub fn image_of(texture: &json::Texture) -> Option<usize> {
    (texture.source != Index::new(u32::MAX)).then(|| texture.source.value())
}

/// A size or an offset. A value that does not fit becomes the maximum, which fails every later bounds check.
pub fn size(size: USize64) -> usize {
    usize::try_from(size.0).unwrap_or(usize::MAX)
}
