//! Files that twobounce writes: whole or not at all, and the same bytes for the same content.

pub mod exr;
pub mod file;
pub mod png;
pub mod svg;
