//! What the flags say about the sky.

use std::path::{Path, PathBuf};

use clap::Args;
use glam::Vec3;
use twobounce::scene::{Scene, sky};
use twobounce::{Error, Result};

use super::args::{number, point};

/// The sky, which is visible and lights the scene.
#[derive(Args, Clone, Debug)]
pub struct SkyArgs {
    /// The sky: its radiance, the same all around, or an equirectangular map, an .hdr or an .exr
    #[arg(long, value_name = "R,G,B|FILE", default_value = "0,0,0", value_parser = sky_of, allow_hyphen_values = true)]
    pub sky: Sky,
    /// Multiply the sky's radiance with this
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, allow_negative_numbers = true)]
    #[arg(value_parser = number(|n| (0.0..=1e30).contains(&n), "write a factor, finite and at least 0"))]
    pub sky_intensity: f64,
    /// Turn the sky's map by this, in degrees: counter-clockwise, seen from above. Its middle is towards +X before
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, allow_negative_numbers = true)]
    #[arg(value_parser = number(|_| true, "write degrees, a finite number"))]
    pub sky_rotation: f64,
}

#[derive(Clone, Debug, PartialEq)]
pub enum Sky {
    /// Radiance.
    Even(Vec3),
    Map(PathBuf),
}

fn sky_of(text: &str) -> std::result::Result<Sky, &'static str> {
    let path = Path::new(text);
    if path.extension().is_some_and(|ending| ["hdr", "exr"].iter().any(|known| ending.eq_ignore_ascii_case(known))) {
        return Ok(Sky::Map(path.to_owned()));
    }
    let color = point(text).ok().map(|color| color.as_vec3()).filter(|c| c.is_finite() && c.min_element() >= 0.0);
    color.map(Sky::Even).ok_or(
        "write red,green,blue, each finite and at least 0, such as 0.2,0.3,0.5, or the name of a map that ends in .hdr or .exr",
    )
}

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
