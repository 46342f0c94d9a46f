//! The thread that makes frames: the newest job wins, and a frame at rest ends early for it.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use rayon::prelude::*;
use twobounce::layers::{Aov, Layers};
use twobounce::output::png::{automatic_exposure, srgb_code, tone_curve};
use twobounce::renderer::{FrameReport, RenderOptions, Renderer};
use twobounce::scene::{Scene, View};
use twobounce::settings::Settings;
use twobounce::vk::{Context, Step, Watch};
use twobounce::{Error, Result};
use winit::event_loop::EventLoopProxy;

use super::screen::Picture;
use crate::cli::blank::sky_shown;
use crate::cli::interrupt;
use crate::cli::scene::Shot;

/// The passes that come after the light: a frame that ends early in one of them has lost nothing but its image.
const IMAGE_PASSES: [&str; 2] = ["image", "gather"];
/// Milliseconds of the image while something moves: with encoding and showing it, an answer within 100.
const MOVING_MS: f64 = 50.0;
/// By how much a side of the image is divided while something moves.
const DIVISORS: [u32; 4] = [1, 2, 4, 8];

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
    pub layer: Aov,
    /// Stops; automatic where absent.
    pub exposure: Option<f32>,
    /// A coarser image will do, if it comes soon.
    pub moving: bool,
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
    pub allocated_bytes: u64,
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
    step: Option<Step>,
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
    pub scene: Scene,
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

    /// The newest answer, once.
    pub fn answer(&self) -> Option<Answer> {
        self.shared.lock().answer.take()
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
    let Stage { context, scene, shot, options } = stage;
    let mut scene = Some(scene);
    let mut maker: Option<Maker> = None;
    let mut done = 0;
    loop {
        let job = {
            let newer = |state: &mut State| !state.ends && state.job.as_ref().is_none_or(|job| job.revision == done);
            let waited = shared.changed.wait_while(shared.lock(), newer);
            let mut state = waited.unwrap_or_else(PoisonError::into_inner);
            state.step = None;
            match &state.job {
                Some(job) if !state.ends => job.clone(),
                _ => return,
            }
        };
        let began = Instant::now();
        let result = match &mut maker {
            Some(maker) => maker.frame(&job, &shot),
            None => {
                scene.take().ok_or_else(|| Error::Device("the scene could not be prepared".into())).and_then(|scene| {
                    let options = RenderOptions {
                        size: job.size,
                        aovs: layers(job.layer),
                        watch: Some(watch(shared)),
                        responsive: true,
                        ..options.clone()
                    };
                    let pose = shot.pose(&scene, job.later_s);
                    let renderer = Renderer::new(&context, scene, &pose, job.settings.clone(), options)?;
                    let ms_per_pixel = if context.is_cpu { 1.0 } else { 0.0 };
                    let made = Maker { renderer, made_for: (job.settings.clone(), job.size, job.layer), ms_per_pixel };
                    maker.insert(made).frame(&job, &shot)
                })
            }
        };
        let frame = match result {
            Err(Error::Interrupted) => continue, // for a newer job, or to end
            Err(error) => Err(error.to_string()),
            Ok((picture, image, exposure_ev, divisor, report)) => {
                let ms = 1e3 * began.elapsed().as_secs_f64();
                let allocated_bytes = context.allocated_bytes();
                Ok(Frame { picture, image, exposure_ev, divisor, ms, report, allocated_bytes })
            }
        };
        done = job.revision;
        let mut state = shared.lock();
        state.step = None;
        state.answer = Some(Answer { revision: job.revision, frame });
        drop(state);
        let _ = wake.send_event(()); // the window may be closed
    }
}

/// Ends a frame at rest for a newer job once its light is made, and any frame for the end.
fn watch(shared: &Arc<Shared>) -> Watch {
    let shared = shared.clone();
    // The job that this frame is for: the newest one when its first step is done.
    let began = Mutex::new((0, ""));
    Arc::new(move |step| {
        let mut state = shared.lock();
        let mut began = began.lock().unwrap_or_else(PoisonError::into_inner);
        let (revision, moving) = state.job.as_ref().map_or((0, true), |job| (job.revision, job.moving));
        if state.step.is_none() {
            *began = (revision, if moving { "moving" } else { "at rest" });
        }
        state.step = Some(step);
        let late = began.1 == "at rest" && revision != began.0 && IMAGE_PASSES.contains(&step.pass);
        if state.ends || late { Err(Error::Interrupted) } else { interrupt::check() }
    })
}

/// Alpha tells what is sky, which exposure leaves out.
fn layers(layer: Aov) -> Vec<Aov> {
    Aov::ALL.iter().copied().filter(|aov| *aov == Aov::Alpha || *aov == layer && layer != Aov::Beauty).collect()
}

struct Maker {
    renderer: Renderer,
    made_for: (Settings, (u32, u32), Aov),
    /// Of the image alone, as it was last.
    ms_per_pixel: f64,
}

impl Maker {
    fn frame(&mut self, job: &Job, shot: &Shot) -> Result<(Picture, Layers, f32, u32, FrameReport)> {
        let pixels = f64::from(job.size.0) * f64::from(job.size.1);
        let soon = |d: &&u32| pixels / f64::from(**d * **d) * self.ms_per_pixel <= MOVING_MS;
        let coarse = || DIVISORS.iter().find(soon).or(DIVISORS.last()).copied().unwrap_or(1);
        let divisor = if job.moving { coarse() } else { 1 };
        let size = ((job.size.0 / divisor).max(1), (job.size.1 / divisor).max(1));
        let (settings, made_size, layer) = &self.made_for;
        if !settings.means_same(&job.settings) || *made_size != size || *layer != job.layer {
            self.renderer.change_layers(job.settings.clone(), size, layers(job.layer))?;
            self.made_for = (job.settings.clone(), size, job.layer);
        }
        let pose = shot.pose(self.renderer.scene(), job.later_s);
        let report = self.renderer.render(&pose, &job.view)?;
        let zones = report.timings.zones.iter().filter(|zone| IMAGE_PASSES.contains(&zone.name));
        let passes = f64::from(job.settings.image.passes);
        self.ms_per_pixel =
            zones.map(|zone| zone.gpu_ms).sum::<f64>() * passes / (f64::from(size.0) * f64::from(size.1));
        let image = self.renderer.read();
        let scene = self.renderer.scene();
        let ev =
            job.exposure.unwrap_or_else(|| automatic_exposure(image.beauty(), sky_shown(&image, scene, &job.view)));
        Ok((Picture { size, rgba: encode(&image, job.layer, ev) }, image, ev, divisor, report))
    }
}

/// A layer as a display takes it; the image as a PNG has it.
pub fn encode(image: &Layers, layer: Aov, exposure_ev: f32) -> Vec<u8> {
    let gain = exposure_ev.exp2();
    let code = |p: &[f32; 3]| match layer {
        Aov::Beauty | Aov::Direct | Aov::Indirect => tone_curve(p.map(|c| c * gain)).map(srgb_code),
        Aov::Normal => p.map(|c| (255.0 * (0.5 * c + 0.5)).round() as u8),
        // Half as bright a metre away.
        Aov::Depth => p.map(|c| srgb_code(1.0 / (1.0 + c))),
        Aov::Alpha | Aov::Ao | Aov::Albedo | Aov::Diffuse => p.map(srgb_code),
    };
    let pixels = image.get(layer).unwrap_or(image.beauty());
    pixels.par_iter().flat_map_iter(|p| code(p).into_iter().chain([255])).collect()
}
