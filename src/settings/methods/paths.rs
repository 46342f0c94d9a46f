//! The table `[paths]`.

use crate::settings::{Key, Range, table};

table! {
    Settings as "paths" {
        paths: u32 = 4, in "paths" rare, Range::Whole(1, 16);
        "paths per pixel and pass";
        "a path each";
    }
}

/// The table's keys.
pub const KEYS: &[&[Key]] = &[Settings::KEYS];
