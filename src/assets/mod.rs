//! Generates the scenes in `assets/` from the descriptions beside this file, with the same bytes every time.
//!
//! Metres, +Y up. As everywhere in the project, glTF's photometric numbers are taken as radiometric ones.

mod glb;
mod shapes;
mod texels;
mod tracks;

pub use glb::make;

use std::path::Path;

use crate::output::file;
use crate::{Error, Result};

const DEMO: &str = include_str!("demo.toml");

/// Every scene as (file name, bytes of the .glb).
pub fn all() -> Result<Vec<(&'static str, Vec<u8>)>> {
    let described = [
        ("cornell-area.glb", concat!(include_str!("cornell.toml"), include_str!("cornell_area.toml"))),
        ("cornell-point.glb", concat!(include_str!("cornell.toml"), include_str!("cornell_point.toml"))),
        ("corridor.glb", include_str!("corridor.toml")),
        ("demo.glb", DEMO),
        ("gallery.glb", include_str!("gallery.toml")),
        ("stairs.glb", include_str!("stairs.toml")),
        ("thick-walls.glb", include_str!("thick_walls.toml")),
        ("two-rooms.glb", include_str!("two_rooms.toml")),
    ];
    described.into_iter().map(|(name, text)| Ok((name, glb::make(name.trim_end_matches(".glb"), text)?))).collect()
}

/// The sequence of `twobounce demo`: the bytes of a .glb with one animation and a camera that flies.
pub fn demo() -> Result<Vec<u8>> {
    glb::make("demo", DEMO)
}

/// The duration of [`demo`] in seconds.
pub const DEMO_S: f64 = 12.0;

/// Writes every scene into the folder `dir`, which is created if missing. Returns the names of the files.
pub fn write(dir: &Path) -> Result<Vec<&'static str>> {
    std::fs::create_dir_all(dir).map_err(|e| Error::file(dir, format!("cannot be created: {e}")))?;
    let scenes = all()?;
    for (name, bytes) in &scenes {
        file::write(&dir.join(name), bytes)?;
    }
    Ok(scenes.into_iter().map(|(name, _)| name).collect())
}
