//! Kinds of counts of counting shaders, and their bytes: a model in which every read counts fully, as if there were no
//! caches. Attachments, uniforms and fixed-function reads are not included. Twin of `glsl/common/count.glsl`.

use serde::Serialize;

use crate::ground::layout;

/// Declares every kind with its number, its name in GLSL and its bytes.
macro_rules! kinds {
    ($($(#[$doc:meta])* $field:ident $glsl:literal $bytes:expr),+ $(,)?) => {
        /// The number of reads of each kind.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
        pub struct Counts { $($(#[$doc])* pub $field: u64),+ }

        impl Counts {
            /// (name in GLSL, bytes per thing) of every kind, in the order of the counters.
            pub const KINDS: &'static [(&'static str, usize)] = &[$(($glsl, $bytes)),+];

            /// From the counters of a zone.
            pub fn of_counters(counters: &[u64]) -> Self {
                let mut counters = counters.iter().copied();
                Self { $($field: counters.next().unwrap_or(0)),+ }
            }

            fn values(&self) -> impl Iterator<Item = u64> {
                [$(self.$field),+].into_iter()
            }
        }
    };
}

kinds! {
    /// Steps of diffuse, specular and refraction cones.
    cone_steps "CONE_STEPS" 0,
    /// Steps of shadow cones.
    shadow_steps "SHADOW_STEPS" 0,
    /// Steps of rays from node to node: three words of a box and one of its links.
    ray_steps "RAY_STEPS" 16,
    /// RGBA16F texels: 8 or 16 for a trilinear look-up.
    volume_texels "VOLUME_TEXELS" 8,
    /// RGBA8 texels.
    atlas_texels "ATLAS_TEXELS" 4,
    texture_records "TEXTURE_RECORDS" size_of::<layout::TextureLevel>(),
    /// Heads of voxels' lists.
    heads "HEADS" 4,
    list_items "LIST_ITEMS" size_of::<layout::ListItem>(),
    /// Whole triangle records with three normals, without optional attributes of corners.
    triangles "TRIANGLES" size_of::<layout::Triangle>() + 3 * 12,
    /// Positions of single vertices.
    corners "CORNERS" 12,
    materials "MATERIALS" size_of::<layout::Material>(),
    lights "LIGHTS" size_of::<layout::Light>(),
    /// Position and normal.
    scene_vertices "SCENE_VERTICES" 24,
    /// Pieces of sampled lamps.
    lamps "LAMP_RECORDS" size_of::<layout::Lamp>(),
    /// All other reads.
    words "WORDS" 4,
    /// Rays that the driver ended early, only on CPU devices: see `glsl/ground/tree.glsl`.
    rays_cut "RAYS_CUT" 0,
    /// Rays started in a tree of triangles.
    rays "RAYS_BEGUN" 0,
    /// Threads, vertices or fragments.
    invocations "INVOCATIONS" 0,
}

impl Counts {
    /// Bytes read according to the model.
    pub fn fetched_bytes(&self) -> u64 {
        self.values().zip(Self::KINDS).map(|(count, (_, bytes))| count * *bytes as u64).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_kinds_are_those_of_the_shaders() {
        let glsl = include_str!("../../glsl/common/count.glsl");
        let constants = glsl.lines().filter_map(|line| {
            let (name, rest) = line.strip_prefix("const uint ")?.split_once(" = ")?;
            Some((name, rest.split('u').next()?.parse::<usize>().ok()?))
        });
        let kinds = Counts::KINDS.iter().map(|kind| kind.0).chain(["KINDS"]);
        assert_eq!(constants.collect::<Vec<_>>(), kinds.zip(0..).collect::<Vec<_>>());
    }

    #[test]
    fn bytes_add_up() {
        let counters: Vec<u64> = (0..Counts::KINDS.len() as u64).collect();
        let counts = Counts::of_counters(&counters);
        assert_eq!((counts.volume_texels, counts.corners), (3, 9));
        let alone = Counts { triangles: 2, words: 1, cone_steps: 9, ..Default::default() };
        assert_eq!(alone.fetched_bytes(), 2 * 84 + 4);
    }
}
