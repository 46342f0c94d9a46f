//! The one settings tree: what every key means, its unit, range and cost. Presets are values of it.
//!
//! What every method shares stands here; each method has a table of its own (`src/gi/<method>/settings.rs`). Lengths inside
//! the grid are counted in voxels, so that a scene scaled or moved gives the same image.

mod choices;
mod docs;
mod edit;
mod keys;
mod presets;
mod renamed;

pub(crate) use choices::choices;
pub use choices::{Bounces, Conservative, DirectLight, GatherResolution, LampLight, Shadows};
pub use docs::markdown;
pub use keys::{Key, Range, keys};
pub(crate) use keys::{key, names, rare};
pub use presets::{PRESETS, Preset};

use serde::{Deserialize, Serialize};

use crate::gi::{Method, Tables};

/// Every setting. `twobounce settings` prints this tree; `--set key=value` writes into it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Settings {
    pub method: Method,
    /// Voxels along the grid's edge.
    pub voxels: u32,
    pub bounces: Bounces,
    pub grid: GridSettings,
    pub lights: LightSettings,
    pub image: ImageSettings,
    /// One table per method, under the method's name.
    #[serde(flatten)]
    pub of: Tables,
}

/// Where the grid stands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GridSettings {
    /// World metres; the scene's centre where absent.
    #[serde(with = "auto")]
    pub center: Option<[f64; 3]>,
    /// World metres; the scene's longest side plus the margin where absent.
    #[serde(with = "auto")]
    pub side: Option<f64>,
    /// Voxels on each side. Not a whole number, so that the walls of box-shaped scenes do not lie on voxel boundaries.
    pub margin: f64,
    /// How triangles are rasterised into it.
    pub conservative: Conservative,
}

/// Direct light and its shadows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LightSettings {
    pub shadows: Shadows,
    /// Rays to a light that has a radius, with `shadows = rays`; one ray goes to its middle.
    pub shadow_rays: u32,
    pub lamps: LampLight,
    /// Points on lamps per pixel with `lamps = sampled`,
    pub lamp_points: u32,
    /// and per voxel side.
    pub voxel_lamp_points: u32,
}

/// The final image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ImageSettings {
    /// Samples per pixel: 1 or 4. Edges are anti-aliased; the method is asked once per pixel.
    pub samples: u32,
    pub direct: DirectLight,
    pub gather_resolution: GatherResolution,
    /// Pixels along the side of the squares in which directions differ from pixel to pixel.
    pub interleave: u32,
}

impl Default for Settings {
    /// The preset `balanced`.
    fn default() -> Self {
        Self {
            method: Method::Rays,
            voxels: 128,
            bounces: Bounces::Two,
            grid: GridSettings::default(),
            lights: LightSettings::default(),
            image: ImageSettings::default(),
            of: Tables::default(),
        }
    }
}

impl Default for GridSettings {
    fn default() -> Self {
        Self { center: None, side: None, margin: 2.5, conservative: Conservative::GeometryShader }
    }
}

impl Default for LightSettings {
    fn default() -> Self {
        Self {
            shadows: Shadows::Rays,
            shadow_rays: 4,
            lamps: LampLight::Sampled,
            lamp_points: 16,
            voxel_lamp_points: 4,
        }
    }
}

impl Default for ImageSettings {
    fn default() -> Self {
        Self { samples: 4, direct: DirectLight::Pixels, gather_resolution: GatherResolution::Half, interleave: 4 }
    }
}

impl ImageSettings {
    /// Whether diffuse light is gathered apart from the image.
    pub fn gathers_apart(&self) -> bool {
        self.gather_resolution.scale() > 1 || self.interleave > 1
    }
}

/// `"auto"` stands for an absent value, so that files can say it and lists can show it.
pub(crate) mod auto {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    #[derive(Serialize, Deserialize)]
    #[serde(untagged)]
    enum Either<T> {
        Value(T),
        Word(String),
    }

    pub fn serialize<T: Serialize + Copy, S: Serializer>(value: &Option<T>, to: S) -> Result<S::Ok, S::Error> {
        value.map_or(Either::Word("auto".into()), Either::Value).serialize(to)
    }

    pub fn deserialize<'de, T: Deserialize<'de>, D: Deserializer<'de>>(from: D) -> Result<Option<T>, D::Error> {
        match Either::deserialize(from)? {
            Either::Value(value) => Ok(Some(value)),
            Either::Word(word) if word == "auto" => Ok(None),
            Either::Word(word) => Err(serde::de::Error::custom(format!("{word:?} is not \"auto\""))),
        }
    }
}
