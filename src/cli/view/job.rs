//! Jobs of the thread that makes frames, the frames, and what threads tell the window.

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

/// The picture that is to be shown.
#[derive(Clone)]
pub struct Job {
    /// Grows from job to job.
    pub revision: u64,
    /// How often shaders were compiled anew.
    pub shaders: u32,
    /// Of the scene, `later_s` seconds after `--time`.
    pub pose: Arc<Pose>,
    pub later_s: f64,
    pub view: View,
    /// Pixels at rest.
    pub size: (u32, u32),
    /// A coarser image will do, if it comes soon.
    pub moving: bool,
    pub choice: PanelChoice,
}

/// The choices of the panel.
#[derive(Clone, Default, PartialEq)]
pub struct PanelChoice {
    pub settings: Settings,
    pub layer: Layer,
    /// The settings of the picture beside.
    pub beside: Other,
    pub tone: ToneMap,
    /// Stops; automatic where absent.
    pub exposure: Option<f32>,
    /// At rest, the image goes on to the mean of so many passes.
    pub refine: u32,
}

impl PanelChoice {
    /// How an image is shown.
    pub fn display(&self, image: &Layers) -> Display {
        let automatic = || self.tone.automatic_exposure(image.beauty());
        Display { tone: self.tone, exposure_ev: self.exposure.unwrap_or_else(automatic) }
    }
}

/// News of other threads for the window.
pub enum News {
    /// A frame is done: [`super::worker::State::frame`].
    Frame,
    /// Of a job by its revision: what came of a question.
    Found(u64, Result<Reply, String>),
    /// How far a frame is from the truth, unless that is no longer wanted.
    Compared(Arc<AtomicBool>, Compared),
    /// GLSL that was saved: how many shaders are new, or what is wrong.
    #[cfg(feature = "hot-reload")]
    Shaders(Result<usize, String>),
}

pub struct ShownFrame {
    /// The job that it was made of.
    pub job: Job,
    pub picture: Picture,
    pub image: Layers,
    pub display: Display,
    /// The divisor of the width and height of the picture.
    pub divisor: u32,
    /// From taking the job to its first picture.
    pub ms: f64,
    pub report: FrameReport,
    /// Times of lists and light, when they were made last.
    pub light: Vec<ZoneTiming>,
    pub allocated_bytes: u64,
    pub beside: Option<Beside>,
    /// It is what `render` makes with these settings, or better.
    pub whole: bool,
    /// Over the light, since it was made anew.
    pub light_passes: u32,
    /// Over the image.
    pub passes: u32,
    /// Of the grids, the base grid first: least and largest corner, metres in the world.
    pub boxes: Vec<[DVec3; 2]>,
}

/// The second picture, with other settings.
pub struct Beside {
    pub picture: Picture,
    pub image: Layers,
    /// Of the frame's passes.
    pub gpu_ms: f64,
}

impl ShownFrame {
    /// How far a picture at rest has come: for the title, after the time.
    pub fn refined(&self) -> String {
        let Self { light_passes, passes, .. } = self;
        let light = if *light_passes > 1 { format!(" · light of {light_passes} passes") } else { String::new() };
        let noise = self.report.noise.map_or(String::new(), |noise| format!(", noise {:.1} %", 100.0 * noise));
        let image = if *passes > 1 { format!(" · mean of {passes}{noise}") } else { String::new() };
        light + &image
    }
}
