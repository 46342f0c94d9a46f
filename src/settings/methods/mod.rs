//! The closed list of methods, and the settings of each: a table under the method's name.

use super::{Key, choices};

/// Gives the list of methods to the macro `$with`: a variant, its name, which is the name of its folders too, and what
/// it is.
macro_rules! methods {
    ($with:ident) => {
        $with! {
            /// Direct light alone.
            None = "none" in none,
            /// Voxel cone tracing, as in the talk.
            Cones = "cones" in cones,
            /// Exact rays that find what the voxels shade; neighbouring pixels share them.
            Rays = "rays" in rays,
            /// Light propagation volumes: light that travels from cell to cell of a coarse grid.
            Lpv = "lpv" in lpv,
            /// Voxel cone tracing derived from photon mapping: a voxel sends its photons' light in sixteen directions.
            Photons = "photons" in photons,
            /// Irradiance probes: a grid of points that look around themselves, and know how far they see.
            Probes = "probes" in probes,
        }
    };
}
pub(crate) use methods;

macro_rules! tables {
    ($($(#[$doc:meta])* $variant:ident = $name:literal in $module:ident),+ $(,)?) => {
        $(pub mod $module;)+

        choices! {
            /// How light from elsewhere is found.
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
