//! The table `[none]`: empty.

use serde::{Deserialize, Serialize};

use crate::settings::Key;

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {}

pub const KEYS: &[&[Key]] = &[];
