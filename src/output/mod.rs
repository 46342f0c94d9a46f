//! Output files. They are written whole or not at all, and the same content gives the same bytes.

pub mod exr;
pub mod file;
pub mod png;
pub mod read;
pub mod svg;
