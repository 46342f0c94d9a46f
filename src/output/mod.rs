//! Output files. They are written completely or not at all, and equal content gives equal bytes.

pub mod display;
pub mod exr;
pub mod file;
pub mod picture;
pub mod read;
pub mod svg;
