//! The table `[paths]`.

use crate::settings::{Key, Range, table};

table! {
    Settings as "paths" {
        paths: u32 = 4, in "paths" rare, Range::Whole(1, 16);
        "paths per pixel and pass, each with a light of every kind at every surface; image.passes adds further ones";
        "a path each: rays as many as it meets surfaces, and as many to lights";
    }
}

/// The table's keys.
pub const KEYS: &[&[Key]] = &[Settings::KEYS];
