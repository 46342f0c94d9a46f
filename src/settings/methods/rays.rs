//! The table `[rays]`.

use crate::settings::{Key, Range, Tracer, names, table};

table! {
    /// The defaults are the preset `balanced`.
    Settings as "rays" {
        diffuse: u32 = 14, in "rays", Range::Whole(1, 128);
        "rays for diffuse light per gathered pixel, cosine-distributed";
        "a ray each: the image's time grows with them";
        bounce: u32 = 3, in "rays", Range::Whole(1, 128);
        "the same per voxel side, of the second bounce";
        "a ray each";
        glossy: u32 = 16, in "rays", Range::Whole(1, 64);
        "rays for a rough lobe, mirrored or transmitted; a lobe that sends on a tenth of its light takes a tenth of them, a \
         smooth one takes one, a rough one of a dielectric none: the rays for diffuse light stand for it";
        "a ray each, where something is glossy or transmits";
        passes: u32 = 24, in "passes" rare, Range::Whole(0, 4096);
        "with bounces = all, passes over the voxels whose mean is the light once it has settled; then it stays until something \
         changes. 0: the settled light of one set of directions";
        "a second bounce's shading each, once; noise falls with the root of their number";
        tracer: Tracer = Tracer::Auto, in "choice" rare, names!(Tracer);
        "how exact rays find triangles, those to lights with every method too: through a tree of boxes, or by VK_KHR_ray_query, where \
         a device has it; auto: by that where it is there. Both find the same but within rounding of edges (docs/gpu.md)";
        "query has not been timed on a GPU";
    }
}

/// The table's keys.
pub const KEYS: &[&[Key]] = &[Settings::KEYS];
