//! The settings `[rays]` of exact rays.

use crate::settings::{Key, Range, Tracer, names, table};

table! {
    /// The defaults are those of the preset `balanced`.
    Settings as "rays" {
        diffuse: u32 = 14, in "rays", Range::Whole(1, 128);
        "rays for diffuse light per gathered pixel, cosine-distributed";
        "a ray each: the image's time grows with them";
        bounce: u32 = 3, in "rays", Range::Whole(1, 128);
        "rays per voxel side for the second bounce";
        "a ray each";
        glossy: u32 = 16, in "rays", Range::Whole(1, 64);
        "rays for a rough specular or transmitted lobe, in proportion to its reflectance; a smooth lobe takes one ray";
        "a ray each, where something is glossy or transmits";
        passes: u32 = 24, in "passes" rare, Range::Whole(0, 4096);
        "with bounces = all, passes that are averaged once the light has converged. 0: one set of directions";
        "one shading of the second bounce each; noise falls with the root of their number";
        tracer: Tracer = Tracer::Auto, in "choice" rare, names!(Tracer);
        "how exact rays find triangles, shadow rays included: tree, through the program's own bounding volume hierarchy; query, by VK_KHR_ray_query; auto: by queries where the device has them";
        "query has not been timed on a GPU";
    }
}

/// The table's keys.
pub const KEYS: &[&[Key]] = &[Settings::KEYS];
