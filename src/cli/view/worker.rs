//! The thread that makes frames: the newest job wins, and a frame at rest ends early for it. [`super::maker`] says how they are made.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use glam::DVec3;
use twobounce::layers::Layers;
use twobounce::renderer::{FrameReport, RenderOptions};
use twobounce::scene::{Scene, View};
use twobounce::settings::Settings;
use twobounce::vk::{Context, Step, Watch, ZoneTiming};
use twobounce::{Error, Result};
use winit::event_loop::EventLoopProxy;

use super::layer::Layer;
use super::maker::Makers;
use super::question::{Found, Question};
use super::screen::Picture;
use crate::cli::interrupt;
use crate::cli::progress::course::IMAGE_PASSES;
use crate::cli::scene::Shot;

/// What is to be shown.
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
    /// What one side was divided by.
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

/// A thread that makes frames; it ends when this is dropped.
pub struct Worker {
    shared: Arc<Shared>,
    thread: Option<std::thread::JoinHandle<()>>,
}

#[derive(Default)]
struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Default)]
struct State {
    job: Option<Job>,
    answer: Option<Answer>,
    question: Option<Question>,
    found: Option<Found>,
    step: Option<Step>,
    /// The job under way, where it is one at rest.
    at_rest: Option<u64>,
    /// Renderers are to be made anew.
    renews: bool,
    /// What is whole stays as it is.
    holds: bool,
    ends: bool,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// What the thread makes frames of.
pub struct Stage {
    pub context: Arc<Context>,
    pub scene: Arc<Scene>,
    pub shot: Shot,
    pub options: RenderOptions,
}

impl Worker {
    /// Starts the thread; `wake` is told of each answer.
    pub fn start(stage: Stage, wake: EventLoopProxy<()>) -> Self {
        let shared = Arc::<Shared>::default();
        let own = shared.clone();
        let thread = std::thread::spawn(move || work(&own, stage, &wake));
        Self { shared, thread: Some(thread) }
    }

    /// Asks for a frame instead of any asked for before.
    pub fn ask(&self, job: Job) {
        self.shared.lock().job = Some(job);
        self.shared.changed.notify_all();
    }

    /// Whether a picture that is whole stays as it is, for the path tracer to be compared with.
    pub fn hold(&self, whether: bool) {
        self.shared.lock().holds = whether;
    }

    /// Makes passes anew for the next job: their shaders are others.
    #[cfg(feature = "hot-reload")]
    pub fn renew(&self) {
        self.shared.lock().renews = true;
    }

    /// The newest answer, once.
    pub fn answer(&self) -> Option<Answer> {
        self.shared.lock().answer.take()
    }

    /// Asks something else, between frames.
    pub fn put(&self, question: Question) {
        self.shared.lock().question = Some(question);
        self.shared.changed.notify_all();
    }

    /// What came of the last question, once.
    pub fn found(&self) -> Option<Found> {
        self.shared.lock().found.take()
    }

    /// What it is at.
    pub fn step(&self) -> Option<Step> {
        self.shared.lock().step
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.shared.lock().ends = true;
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn work(shared: &Arc<Shared>, stage: Stage, wake: &EventLoopProxy<()>) {
    let mut makers = Makers::new(stage, watch(shared));
    let mut done = 0;
    loop {
        let job = {
            let idle = |state: &mut State| {
                let asked = state.question.is_some() && done > 0;
                !state.ends && !asked && state.job.as_ref().is_none_or(|job| job.revision == done)
            };
            let waited = shared.changed.wait_while(shared.lock(), idle);
            let mut state = waited.unwrap_or_else(PoisonError::into_inner);
            state.step = None;
            if std::mem::take(&mut state.renews) {
                makers.renew();
            }
            let Some(job) = state.job.clone().filter(|_| !state.ends) else { return };
            state.at_rest = Some(job.revision).filter(|_| !job.moving);
            job
        };
        let answer = |frame| {
            let mut state = shared.lock();
            state.step = None;
            state.answer = Some(Answer { revision: job.revision, frame });
            drop(state);
            let _ = wake.send_event(()); // the window may be closed
        };
        let wanted = Wanted { shared, wake, revision: job.revision };
        if job.revision == done {
            makers.answer(&job, &wanted); // only a question is new
            shared.lock().step = None;
            continue;
        }
        match makers.make(&job, &wanted, &|frame| answer(Ok(frame))) {
            Err(Error::Interrupted) => continue, // for a newer job, or to end
            Err(error) => answer(Err(error.to_string())),
            Ok(()) => {}
        }
        (shared.lock().step, done) = (None, job.revision);
    }
}

/// Whether a job's picture is wanted yet.
pub struct Wanted<'a> {
    shared: &'a Shared,
    wake: &'a EventLoopProxy<()>,
    revision: u64,
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

    /// What it is, once.
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

/// Ends a frame at rest for a newer job once its light is made, and any frame for the end.
fn watch(shared: &Arc<Shared>) -> Watch {
    let shared = shared.clone();
    Arc::new(move |step| {
        let mut state = shared.lock();
        state.step = Some(step);
        let newer = state.job.as_ref().is_some_and(|job| Some(job.revision) != state.at_rest);
        let late = state.at_rest.is_some() && newer && IMAGE_PASSES.contains(&step.pass);
        if state.ends || late { Err(Error::Interrupted) } else { interrupt::check() }
    })
}
