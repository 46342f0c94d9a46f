//! The settings: meaning, unit, range and cost of every key, and the presets.
//!
//! Shared settings are in `src/settings/tables.rs`; each method has its own table (`src/settings/methods/`). Lengths
//! within the grid are in voxels, so that a scaled or moved scene gives the same image.

mod center;
mod choices;
mod docs;
mod edit;
mod keys;
#[cfg_attr(not(internals), doc(hidden))]
pub mod methods;
mod presets;
mod switches;
mod tables;

pub use center::Center;
pub(crate) use choices::choices;
pub use choices::{Bounces, Conservative, DirectLight, GatherResolution, LampLight, Shadows, Tracer};
#[cfg_attr(not(internals), doc(hidden))]
pub use docs::markdown;
#[cfg_attr(not(internals), doc(hidden))]
pub use keys::{Key, Range, keys};
pub(crate) use keys::{key, names, rare, table};
pub use methods::Method;
use methods::Tables;
pub(crate) use methods::methods;
pub use presets::{PRESETS, Preset};
#[cfg_attr(not(internals), doc(hidden))]
pub use switches::Form;
pub(crate) use switches::switches;
pub use tables::{GridSettings, ImageSettings, LightSettings};

use serde::{Deserialize, Serialize};

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
    #[cfg_attr(not(internals), doc(hidden))]
    pub of: Tables,
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

/// Serialises an absent value as `"auto"` in files and lists.
pub(crate) mod auto {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    #[derive(Serialize, Deserialize)]
    #[serde(untagged)]
    pub enum Either<T> {
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
