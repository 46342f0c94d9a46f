//! The closed list of methods, and the settings of each: a table under the method's name.

use super::{Key, choices};

/// Passes the list of methods to the macro `$with`: a variant, its name, which is also the name of its folders, and its
/// meaning.
macro_rules! methods {
    ($with:ident) => {
        $with! {
            /// Direct light only.
            None = "none" in none,
            /// Voxel cone tracing, as in the talk.
            Cones = "cones" in cones,
            /// Exact rays that read cached light of surfaces; neighbouring pixels share them.
            Rays = "rays" in rays,
            /// Light propagation volumes: light travels from cell to cell of a coarse grid.
            Lpv = "lpv" in lpv,
            /// Voxel cone tracing derived from photon mapping: a voxel stores the light of its photons in sixteen
            /// directions.
            Photons = "photons" in photons,
            /// Path tracing: no approximation but noise, which falls with the passes over the image.
            Paths = "paths" in paths,
            /// Irradiance probes: a grid of points that store the light and the distances around them.
            Probes = "probes" in probes,
        }
    };
}
pub(crate) use methods;

macro_rules! tables {
    ($($(#[$doc:meta])* $variant:ident = $name:literal in $module:ident),+ $(,)?) => {
        $(pub mod $module;)+

        choices! {
            /// The method of indirect light.
            Method { $($(#[$doc])* $variant = $name),+ }
        }

        /// The settings of every method, each a table under the method's name.
        #[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(default)]
        pub struct Tables { $(pub $module: $module::Settings),+ }

        /// The keys of all tables.
        pub(super) fn tables_keys() -> impl Iterator<Item = &'static Key> {
            [$($module::KEYS),+].into_iter().flatten().flat_map(|keys| keys.iter())
        }
    };
}
methods!(tables);
