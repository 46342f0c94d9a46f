//! Output files. They are written whole or not at all, and the same content gives the same bytes.

pub mod display;
pub mod exr;
pub mod file;
pub mod picture;
pub mod read;
pub mod svg;
