//! From a scene to a picture in one call, as `twobounce render` does: [`Stage`] describes the view and the light,
//! [`Staged`] is a scene that was prepared with it, [`render`](fn@render) makes the picture, and [`Refine`] sets its
//! quality. The command line uses this module for all scenes.

mod blank;
mod image;
mod refine;
mod render;
mod sky;
mod staged;
mod truth;

pub use blank::why_blank;
pub use image::Image;
pub use refine::{Event, Noise, Refine, Refinement, duration, is_scarce};
pub use render::{MAX_SIDE, Options, Progress, check_size, image_header, known_limits, render, with_alpha};
pub use sky::Sky;
pub use staged::{Shot, Staged};
pub use truth::{PathTracing, check_film, path_trace, truth_header};

use glam::DVec3;

use crate::settings::choices;
use crate::{Error, Result};

choices! {
    /// Conditions under which something is added to a scene that its file does not have.
    When {
        On = "on",
        Off = "off",
        /// If the scene needs it.
        Auto = "auto",
    }
}

/// The position from which a scene is seen.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Viewpoint {
    /// The file's first camera, or a camera that frames the scene if the file has none.
    #[default]
    Auto,
    /// The file's camera with this name or index.
    OfFile(String),
    /// A camera at `eye` that looks at `target`, both in metres.
    LookAt { eye: DVec3, target: DVec3, up: DVec3 },
}

/// The part of a scene that is seen, and the light that is added to it.
#[derive(Clone, Debug)]
pub struct Stage {
    pub viewpoint: Viewpoint,
    /// Vertical field of view in degrees, between 0 and 180; by default that of the camera, or 45.
    pub fov_degrees: Option<f64>,
    /// The name or index of the animation that plays, or `all`; by default the first one.
    pub animation: Option<String>,
    /// Seconds within the animation, from 0 on.
    pub time_s: f64,
    /// Whether an animation repeats; otherwise its last state stays.
    pub repeats: bool,
    pub sky: Sky,
    /// A factor of the sky's radiance, at least 0.
    pub sky_intensity: f64,
    /// Rotation of a sky map in degrees, counter-clockwise seen from above.
    pub sky_rotation_degrees: f64,
    /// The maximum side of a sky map in texels; larger maps are halved until they fit.
    pub max_texture: Option<u32>,
    /// Whether to add a studio's light. [`When::Auto`] adds it to a scene that has neither a light nor a sky, and does
    /// not emit enough light.
    pub default_light: When,
    /// Whether to add a grey ground below the scene. [`When::Auto`] adds it with the default light if the camera is
    /// above it.
    pub ground: When,
}

impl Default for Stage {
    fn default() -> Self {
        Self {
            viewpoint: Viewpoint::Auto,
            fov_degrees: None,
            animation: None,
            time_s: 0.0,
            repeats: false,
            sky: Sky::default(),
            sky_intensity: 1.0,
            sky_rotation_degrees: 0.0,
            max_texture: None,
            default_light: When::Auto,
            ground: When::Auto,
        }
    }
}

impl Stage {
    /// Refuses mistakes that can be found without a scene.
    ///
    /// # Errors
    /// [`Error::Usage`] with one sentence that names the command line's flag.
    pub fn check(&self) -> Result<()> {
        let usage = |sentence: &str| Err(Error::Usage(sentence.to_owned()));
        if self.default_light == When::On && self.sky.is_given() {
            return usage("--default-light on and --sky both give a sky; leave one of them out");
        }
        if self.fov_degrees.is_some_and(|fov| !(fov > 0.0 && fov < 180.0)) {
            return usage("--fov: write degrees between 0 and 180");
        }
        if !(self.time_s >= 0.0 && self.time_s.is_finite()) {
            return usage("--time: write seconds, finite and at least 0");
        }
        if self.max_texture == Some(0) {
            return usage("--max-texture: write 1 texel or more");
        }
        self.sky.check(self.sky_intensity, self.sky_rotation_degrees)?;
        let Viewpoint::LookAt { eye, target, up } = self.viewpoint else { return Ok(()) };
        if !(eye.is_finite() && target.is_finite() && up.is_finite()) {
            return usage("--eye, --target and --up: write three finite numbers each");
        }
        let Some(forward) = (target - eye).try_normalize() else {
            return usage("--eye and --target are the same point; move one of them");
        };
        // Within 1e-6 radians the roll of the image would be rounding noise.
        if up.try_normalize().is_none_or(|up| up.cross(forward).length() < 1e-6) {
            return usage("--up is zero or points along the view; choose another direction");
        }
        Ok(())
    }
}
