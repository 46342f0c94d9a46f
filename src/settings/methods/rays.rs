//! The table `[rays]`.

use serde::{Deserialize, Serialize};

use crate::settings::{Key, Range, key, rare};

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// Rays for diffuse light per gathered pixel,
    pub diffuse: u32,
    /// and per voxel side in the second bounce.
    pub bounce: u32,
    /// Rays for a rough lobe that sends on all that it meets; a fainter one gets its share of them.
    pub glossy: u32,
    /// Passes whose mean is the light, with all bounces, of what stands still.
    pub passes: u32,
}

impl Default for Settings {
    /// The preset `balanced`.
    fn default() -> Self {
        Self { diffuse: 14, bounce: 2, glossy: 16, passes: 24 }
    }
}

/// The table's keys.
pub const KEYS: &[&[Key]] = &[&[
    key(
        "rays.diffuse",
        "rays",
        Range::Whole(1, 128),
        "rays for diffuse light per gathered pixel, cosine-distributed",
        "a ray each: the image's time grows with them",
    ),
    key("rays.bounce", "rays", Range::Whole(1, 128), "the same per voxel side, of the second bounce", "a ray each"),
    key(
        "rays.glossy",
        "rays",
        Range::Whole(1, 64),
        "rays for a rough lobe, mirrored or transmitted; a lobe that sends on a tenth of its light takes a tenth of them, a \
         smooth one takes one, a rough one of a dielectric none: the rays for diffuse light stand for it",
        "a ray each, where something is glossy or transmits",
    ),
    rare(key(
        "rays.passes",
        "passes",
        Range::Whole(0, 4096),
        "with bounces = all, passes over the voxels whose mean is the light once it has settled; then it stays until something \
         changes. 0: the settled light of one set of directions",
        "a second bounce's shading each, once; noise falls with the root of their number",
    )),
]];
