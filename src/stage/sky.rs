//! The sky that options add to a scene.

use std::path::PathBuf;

use glam::Vec3;

use super::Stage;
use crate::scene::{Scene, sky};
use crate::{Error, Result};

/// The sky, which is visible and lights the scene.
#[derive(Clone, Debug, PartialEq)]
pub enum Sky {
    /// Uniform radiance from all directions; no sky if it is 0.
    Even(Vec3),
    /// An equirectangular map, an .hdr or an .exr.
    Map(PathBuf),
}

impl Default for Sky {
    fn default() -> Self {
        Self::Even(Vec3::ZERO)
    }
}

impl Sky {
    /// Whether a sky is given, even a black one.
    pub fn is_given(&self) -> bool {
        *self != Self::default()
    }

    /// The file of a map.
    pub fn map(&self) -> Option<&PathBuf> {
        match self {
            Self::Map(path) => Some(path),
            Self::Even(_) => None,
        }
    }

    /// Refuses mistakes that can be found without opening the file.
    pub(super) fn check(&self, intensity: f64, rotation_degrees: f64) -> Result<()> {
        let usage = |sentence: &str| Err(Error::Usage(sentence.to_owned()));
        if matches!(self, Self::Even(radiance) if !(radiance.is_finite() && radiance.min_element() >= 0.0)) {
            return usage("--sky: write red,green,blue, each finite and at least 0");
        }
        if !(0.0..=1e30).contains(&intensity) {
            return usage("--sky-intensity: write a factor, finite and at least 0");
        }
        if !rotation_degrees.is_finite() {
            return usage("--sky-rotation: write degrees, a finite number");
        }
        if rotation_degrees != 0.0 && self.map().is_none() {
            return usage("--sky-rotation turns a map; name one with --sky FILE.hdr or leave it out");
        }
        if intensity != 1.0 && !self.is_given() {
            return usage("--sky-intensity is for a sky; give one with --sky or leave it out");
        }
        Ok(())
    }
}

impl Stage {
    /// Adds the sky to `scene`, if one is given. Returns notes about it.
    pub(super) fn add_sky(&self, scene: &mut Scene) -> Result<Vec<String>> {
        let intensity = self.sky_intensity as f32;
        let path = match &self.sky {
            Sky::Even(radiance) => {
                if self.sky.is_given() {
                    scene.sky = *radiance * intensity;
                }
                return Ok(Vec::new());
            }
            Sky::Map(path) => path,
        };
        let (map, mut notes) = sky::read(path, self.max_texture)?;
        scene.set_sky_map(map, intensity, self.sky_rotation_degrees);
        if scene.sky == Vec3::ZERO {
            notes.push(format!("the sky's map {} is black", path.display()));
        }
        Ok(notes)
    }

    /// The sky of `scene` in words, for headers.
    pub(super) fn sky_words(&self, scene: &Scene) -> String {
        match (&scene.sky_map, self.sky.map()) {
            (Some(map), Some(path)) => {
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                let (intensity, rotation) = (self.sky_intensity, self.sky_rotation_degrees);
                format!("{name} {} intensity {intensity} rotation {rotation}", map.hash.to_hex())
            }
            _ => scene.sky.to_string(),
        }
    }
}
