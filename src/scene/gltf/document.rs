//! The glTF document: JSON types of the `gltf` crate, without its validation, and own types where those do not fit.
//!
//! The crate's `Root` is not used: its node transforms are f32 (a node at 10 000 000.25 m would move), and it refuses
//! scenes without nodes and animation channels without a target. Its validation refuses quantised meshes.

use std::fmt;
use std::marker::PhantomData;
use std::sync::{Mutex, OnceLock, PoisonError};

use gltf::json::extensions::scene::khr_lights_punctual::Light;
use gltf::json::validation::USize64;
use gltf::json::{self, Index};
use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use serde_json::Value;

use super::container::shorten;

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub struct Document {
    pub asset: Option<Asset>,
    pub extensions_used: Vec<String>,
    pub extensions_required: Vec<String>,
    pub scene: Option<usize>,
    #[serde(deserialize_with = "few")]
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
    pub warnings: Mutex<Vec<String>>,
}

/// The number of distinct warnings that are kept, because a file with more has one cause for most of them.
const WARNINGS_MAX: usize = 50;

impl Document {
    /// Parses a text in which whole numbers may be written as `1.0`.
    pub fn parse_plain(source: Vec<u8>) -> Result<Self, serde_json::Error> {
        let document: Self = serde_json::from_slice(&plain_integers(&source))?;
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

    /// The text of the value at a JSON pointer, for messages: for an unknown value the crate's types only say that it
    /// is invalid.
    pub fn stated(&self, pointer: &str) -> String {
        let tree = self.tree.get_or_init(|| serde_json::from_slice(&self.source).unwrap_or_default());
        match tree.pointer(pointer) {
            Some(Value::String(text)) => shorten(text),
            Some(value) => shorten(&value.to_string()),
            None => String::new(),
        }
    }
}

/// Rewrites JSON so that whole numbers have no fraction or exponent: `1.0` and `1e2` become `1` and `100`. These
/// numbers are equal in JSON and some exporters write indices this way, but the types of indices accept only integers.
fn plain_integers(json: &[u8]) -> Vec<u8> {
    let mut out = Vec::with_capacity(json.len());
    let mut rest = json;
    let mut in_string = false;
    while let Some((&byte, after)) = rest.split_first() {
        let of_number = |b: &u8| b.is_ascii_digit() || b"+-.eE".contains(b);
        if !in_string && (byte.is_ascii_digit() || byte == b'-') {
            let length = rest.iter().take_while(|b| of_number(b)).count();
            let (token, tail) = rest.split_at(length);
            let number = std::str::from_utf8(token).ok().and_then(|t| t.parse::<f64>().ok());
            // Beyond 2⁵³ the nearest f64 may be another number.
            match number.filter(|n| n.fract() == 0.0 && n.abs() < f64::exp2(53.0)) {
                // Spaces keep the columns that messages name.
                Some(whole) => out.extend(format!("{:<length$}", whole as i64).bytes()),
                None => out.extend(token),
            }
            rest = tail;
            continue;
        }
        in_string ^= byte == b'"';
        // An escaped quotation mark ends no string.
        let taken = if in_string && byte == b'\\' { rest.len().min(2) } else { 1 };
        out.extend(&rest[..taken]);
        rest = if taken == 2 { &rest[2..] } else { after };
    }
    out
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub struct Asset {
    pub version: String,
    pub min_version: Option<String>,
}

/// The maximum number of scenes in a file: one takes two bytes of text and twenty times that in memory.
const SCENES_MAX: usize = 1 << 16;

/// A list that is refused as soon as it is longer than [`SCENES_MAX`].
fn few<'de, D: Deserializer<'de>, T: Deserialize<'de>>(list: D) -> Result<Vec<T>, D::Error> {
    struct Few<T>(PhantomData<T>);
    impl<'de, T: Deserialize<'de>> Visitor<'de> for Few<T> {
        type Value = Vec<T>;

        fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
            write!(f, "a list of at most {SCENES_MAX}")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut entries: A) -> Result<Self::Value, A::Error> {
            let mut list = Vec::new();
            while let Some(entry) = entries.next_element()? {
                list.push(entry);
                if list.len() > SCENES_MAX {
                    return Err(A::Error::invalid_length(list.len(), &self));
                }
            }
            Ok(list)
        }
    }
    list.deserialize_seq(Few(PhantomData))
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

/// Extensions that name an image in another format, which takes precedence over the texture's plain image.
const IMAGE_EXTENSIONS: [&str; 2] = ["KHR_texture_basisu", "EXT_texture_webp"];

/// The image of a texture. The crate marks a missing image by the index `u32::MAX`.
pub fn image_of(texture: &json::Texture) -> Option<usize> {
    let extension = |name| texture.extensions.as_ref()?.others.get(name)?.get("source")?.as_u64();
    let other =
        IMAGE_EXTENSIONS.into_iter().find_map(extension).map(|index| usize::try_from(index).unwrap_or(usize::MAX));
    other.or_else(|| (texture.source != Index::new(u32::MAX)).then(|| texture.source.value()))
}

/// A size or an offset. A value that does not fit becomes the maximum, which fails every later bounds check.
pub fn size(size: USize64) -> usize {
    usize::try_from(size.0).unwrap_or(usize::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_numbers_become_integers_and_strings_stay() {
        let plain = |text: &str| String::from_utf8(plain_integers(text.as_bytes())).unwrap();
        assert_eq!(plain("[1.0, -2.50, 1e2,3.000E+1,-0.0, 0.1e1]"), "[1  , -2.50, 100,30      ,0   , 1    ]");
        let strings = r#"{"a\"1.0":"\\","b":"2.0\\\"3.0"}"#;
        assert_eq!(plain(strings), strings);
        assert_eq!(plain("[1e300,9007199254740993.0,1.0.0,\"x"), "[1e300,9007199254740993.0,1.0.0,\"x");
    }
}
