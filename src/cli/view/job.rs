//! Jobs of the thread that makes frames, the frames, and messages of threads to the window.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use glam::DVec3;
use twobounce::layers::Layers;
use twobounce::output::display::{Display, ToneMap};
use twobounce::renderer::FrameReport;
use twobounce::scene::{Pose, View};
use twobounce::settings::Settings;
use twobounce::vk::ZoneTiming;

use super::beside::Other;
use super::layer::Layer;
use super::question::Reply;
use super::screen::Picture;
use super::truth::Compared;

/// The picture to show.
#[derive(Clone)]
pub struct Job {
    /// A number that increases from job to job.
    pub revision: u64,
    /// How often shaders were recompiled.
    pub shaders: u32,
    /// The pose of the scene `later_s` seconds after `--time`.
    pub pose: Arc<Pose>,
    pub later_s: f64,
    pub view: View,
    /// Size of the picture at rest in pixels.
    pub size: (u32, u32),
    /// Whether a coarser image suffices if it comes soon.
    pub moving: bool,
    pub choice: PanelChoice,
}

/// The choices of the panel.
#[derive(Clone, Default, PartialEq)]
pub struct PanelChoice {
    pub settings: Settings,
    pub layer: Layer,
    /// The settings of the second picture.
    pub beside: Other,
    pub tone: ToneMap,
    /// Exposure in stops; `None` is automatic.
    pub exposure: Option<f32>,
    /// The number of passes over the image that are averaged at rest.
    pub refine: u32,
}

impl PanelChoice {
    /// The display of an image.
    pub fn display(&self, image: &Layers) -> Display {
        let automatic = || self.tone.automatic_exposure(image.beauty());
        Display { tone: self.tone, exposure_ev: self.exposure.unwrap_or_else(automatic) }
    }
}

/// Messages of other threads to the window.
pub enum News {
    /// A frame is finished: [`super::worker::State::frame`].
    Frame,
    /// The answer to a question of a job, given by its revision.
    Found(u64, Result<Reply, String>),
    /// The error of a frame against the path tracer, unless it is no longer wanted.
    Compared(Arc<AtomicBool>, Compared),
    /// The result of saved GLSL: the number of new shaders, or an error.
    #[cfg(feature = "hot-reload")]
    Shaders(Result<usize, String>),
}

pub struct ShownFrame {
    /// The job of the frame.
    pub job: Job,
    pub picture: Picture,
    pub image: Layers,
    pub display: Display,
    /// The divisor of the width and height of the picture.
    pub divisor: u32,
    /// Time from the start of the job to its first picture.
    pub ms: f64,
    pub report: FrameReport,
    /// Times of lists and light when they were last made.
    pub light: Vec<ZoneTiming>,
    pub allocated_bytes: u64,
    pub beside: Option<Beside>,
    /// Whether it equals the result of `render` with these settings, or is better.
    pub whole: bool,
    /// Passes over the light since it was rebuilt.
    pub light_passes: u32,
    /// Passes over the image.
    pub passes: u32,
    /// Boxes of the grids, the base grid first: least and largest corner in metres in the world.
    pub boxes: Vec<[DVec3; 2]>,
}

/// The second picture, with other settings.
pub struct Beside {
    pub picture: Picture,
    pub image: Layers,
    /// Device time of the frame's passes.
    pub gpu_ms: f64,
}

impl ShownFrame {
    /// The progress of a picture at rest, for the title.
    pub fn refined(&self) -> String {
        let Self { light_passes, passes, .. } = self;
        let light = if *light_passes > 1 { format!(" · light of {light_passes} passes") } else { String::new() };
        let noise = self.report.noise.map_or(String::new(), |noise| format!(", noise {:.1} %", 100.0 * noise));
        let image = if *passes > 1 { format!(" · mean of {passes}{noise}") } else { String::new() };
        light + &image
    }
}
