//! Jobs of the thread that makes frames, the frames, and the state that the thread shares with the window.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use glam::DVec3;
use twobounce::layers::Layers;
use twobounce::renderer::{FrameReport, RenderOptions};
use twobounce::scene::{Scene, View};
use twobounce::settings::Settings;
use twobounce::vk::{Context, Step, ZoneTiming};
use twobounce::{Error, Result};
use winit::event_loop::EventLoopProxy;

use super::layer::Layer;
use super::question::{Found, Question};
use super::screen::Picture;
use crate::cli::interrupt;
use crate::cli::scene::Shot;

/// The picture that is to be shown.
#[derive(Clone)]
pub struct Job {
    /// Grows from job to job.
    pub revision: u64,
    pub view: View,
    /// Seconds after `--time`.
    pub later_s: f64,
    pub settings: Settings,
    /// Pixels at rest.
    pub size: (u32, u32),
    pub layer: Layer,
    /// Settings of which the same is shown beside.
    pub beside: Option<Settings>,
    /// Stops; automatic where absent.
    pub exposure: Option<f32>,
    /// A coarser image will do, if it comes soon.
    pub moving: bool,
    /// At rest, the image goes on to the mean of so many passes.
    pub refine: u32,
}

/// A frame that is done, or why there is none.
pub struct Answer {
    pub revision: u64,
    pub frame: std::result::Result<Frame, String>,
}

pub struct Frame {
    pub picture: Picture,
    pub image: Layers,
    pub exposure_ev: f32,
    /// The divisor of the width and height of the picture.
    pub divisor: u32,
    /// From taking the job to the picture.
    pub ms: f64,
    pub report: FrameReport,
    /// Times of lists and light, when they were made last.
    pub light: Vec<ZoneTiming>,
    pub allocated_bytes: u64,
    pub beside: Option<Beside>,
    pub refined: Refined,
    /// Of the grids, the base grid first: least and largest corner, metres in the world.
    pub boxes: Vec<[DVec3; 2]>,
    pub view: View,
}

/// How far a picture at rest has come.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Refined {
    /// It is what `render` makes with these settings, or better.
    pub whole: bool,
    /// Over the light, since it was made anew.
    pub light_passes: u32,
    /// Over the image.
    pub passes: u32,
}

/// The same with other settings.
pub struct Beside {
    pub picture: Picture,
    pub image: Layers,
    /// Of the frame's passes.
    pub gpu_ms: f64,
}

impl Refined {
    /// For the title, after the time.
    pub fn words(self, noise: Option<f64>) -> String {
        let Self { light_passes, passes, .. } = self;
        let light = if light_passes > 1 { format!(" · light of {light_passes} passes") } else { String::new() };
        let noise = noise.map_or(String::new(), |noise| format!(", noise {:.1} %", 100.0 * noise));
        let image = if passes > 1 { format!(" · mean of {passes}{noise}") } else { String::new() };
        light + &image
    }
}

#[derive(Default)]
pub struct Shared {
    pub state: Mutex<State>,
    pub changed: Condvar,
}

#[derive(Default)]
pub struct State {
    pub job: Option<Job>,
    pub answer: Option<Answer>,
    pub question: Option<Question>,
    pub found: Option<Found>,
    pub step: Option<Step>,
    /// The job under way, where it is one at rest.
    pub at_rest: Option<u64>,
    /// Renderers are to be made anew.
    pub renews: bool,
    /// A whole picture stays as it is.
    pub holds: bool,
    pub ends: bool,
}

impl Shared {
    pub fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The inputs of which the thread makes frames.
pub struct Stage {
    pub context: Arc<Context>,
    pub scene: Arc<Scene>,
    pub shot: Shot,
    pub options: RenderOptions,
}

/// Whether a job's picture is wanted yet.
pub struct Wanted<'a> {
    pub shared: &'a Shared,
    pub wake: &'a EventLoopProxy<()>,
    pub revision: u64,
}

impl Wanted<'_> {
    /// # Errors
    /// [`Error::Interrupted`] where there is a newer job, or it is the end.
    pub fn check(&self) -> Result<()> {
        let state = self.shared.lock();
        let newest = state.job.as_ref().is_none_or(|job| job.revision == self.revision);
        if newest && !state.ends { interrupt::check() } else { Err(Error::Interrupted) }
    }

    /// Whether something else is asked.
    pub fn asks(&self) -> bool {
        self.shared.lock().question.is_some()
    }

    /// The question that the thread was asked; it is returned once.
    pub fn question(&self) -> Option<Question> {
        self.shared.lock().question.take()
    }

    pub fn found(&self, found: Found) {
        self.shared.lock().found = Some(found);
        let _ = self.wake.send_event(()); // the window may be closed
    }

    /// Whether a whole picture is to get better yet.
    pub fn refines(&self) -> bool {
        !self.shared.lock().holds
    }
}
