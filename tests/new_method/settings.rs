//! The settings of the method.

use serde::{Deserialize, Serialize};

use crate::settings::{Key, Range, key};

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    pub radiance: f32,
}

impl Default for Settings {
    fn default() -> Self {
        Self { radiance: 0.5 }
    }
}

pub const KEYS: &[&[Key]] =
    &[&[key("constant.radiance", "radiance", Range::Number(0.0, 10.0), "what comes from everywhere", "nothing")]];
