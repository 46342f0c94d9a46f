//! What the flags say about the sky.

use std::path::PathBuf;

use glam::Vec3;
use twobounce::scene::{Scene, sky};
use twobounce::{Error, Result};

use super::args::{Sky, SkyArgs};

impl SkyArgs {
    /// What can be found wrong without opening the file.
    pub fn check(&self) -> Result<()> {
        if self.sky_rotation != 0.0 && self.map().is_none() {
            return Err(Error::Usage(
                "--sky-rotation turns a map; name one with --sky FILE.hdr or leave it out".into(),
            ));
        }
        if self.sky_intensity != 1.0 && !self.given() {
            return Err(Error::Usage("--sky-intensity is for a sky; give one with --sky or leave it out".into()));
        }
        Ok(())
    }

    /// Whether there is a sky, black or not.
    pub fn given(&self) -> bool {
        self.sky != Sky::Even(Vec3::ZERO)
    }

    /// The file that is read.
    pub fn map(&self) -> Option<&PathBuf> {
        match &self.sky {
            Sky::Map(path) => Some(path),
            Sky::Even(_) => None,
        }
    }

    /// Gives `scene` the sky. Returns what is to be said about that.
    pub fn add_to(&self, scene: &mut Scene, max_texture: Option<u32>) -> Result<Vec<String>> {
        let intensity = self.sky_intensity as f32;
        let path = match &self.sky {
            Sky::Even(radiance) => {
                scene.sky = *radiance * intensity;
                return Ok(Vec::new());
            }
            Sky::Map(path) => path,
        };
        let (map, mut notes) = sky::read(path, max_texture)?;
        scene.set_sky_map(map, intensity, self.sky_rotation);
        if scene.sky == Vec3::ZERO {
            notes.push(format!("the sky's map {} is black", path.display()));
        }
        Ok(notes)
    }

    /// The sky of `scene` in words, for headers.
    pub fn words(&self, scene: &Scene) -> String {
        match (&scene.sky_map, self.map()) {
            (Some(map), Some(path)) => {
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                format!("{name} {} intensity {} rotation {}", map.hash.to_hex(), self.sky_intensity, self.sky_rotation)
            }
            _ => scene.sky.to_string(),
        }
    }
}
