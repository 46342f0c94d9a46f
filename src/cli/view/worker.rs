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

use super::layer::Layer;
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
    pub layer: Layer,
    /// Settings of which the same is shown beside.
    pub beside: Option<Settings>,
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
    pub beside: Option<Beside>,
}

/// The same with other settings.
pub struct Beside {
    pub picture: Picture,
    pub image: Layers,
    /// Of the frame's passes.
    pub gpu_ms: f64,
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
    /// Renderers are to be made anew.
    renews: bool,
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

    /// Makes passes anew for the next job: their shaders are others.
    #[cfg(feature = "hot-reload")]
    pub fn renew(&self) {
        self.shared.lock().renews = true;
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
    let mut makers = Makers { stage, watch: watch(shared), own: None, beside: None };
    let mut done = 0;
    loop {
        let job = {
            let newer = |state: &mut State| !state.ends && state.job.as_ref().is_none_or(|job| job.revision == done);
            let waited = shared.changed.wait_while(shared.lock(), newer);
            let mut state = waited.unwrap_or_else(PoisonError::into_inner);
            state.step = None;
            if std::mem::take(&mut state.renews) {
                (makers.own, makers.beside) = (None, None);
            }
            match &state.job {
                Some(job) if !state.ends => job.clone(),
                _ => return,
            }
        };
        let frame = match makers.frame(&job) {
            Err(Error::Interrupted) => continue, // for a newer job, or to end
            result => result.map_err(|error| error.to_string()),
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

struct Makers {
    stage: Stage,
    watch: Watch,
    own: Option<Maker>,
    beside: Option<Maker>,
}

impl Makers {
    fn frame(&mut self, job: &Job) -> Result<Frame> {
        let began = Instant::now();
        let Self { stage, watch, own, beside } = self;
        let own = Maker::of(own, (stage, watch), &job.settings, job)?;
        let beside = match &job.beside {
            Some(settings) => Some((Maker::of(beside, (stage, watch), settings, job)?, settings)),
            None => {
                *beside = None;
                None
            }
        };
        let ms_per_pixel = own.ms_per_pixel + beside.as_ref().map_or(0.0, |(maker, _)| maker.ms_per_pixel);
        let divisor = if job.moving { divisor(job.size, ms_per_pixel) } else { 1 };
        let (picture, image, exposure_ev, report) = own.frame((job, &job.settings), divisor, stage)?;
        let beside = beside.map(|(maker, settings)| {
            let job = Job { exposure: Some(exposure_ev), ..job.clone() };
            let (picture, image, _, report) = maker.frame((&job, settings), divisor, stage)?;
            Ok(Beside { picture, image, gpu_ms: report.timings.gpu_ms })
        });
        let beside = beside.transpose()?;
        let ms = 1e3 * began.elapsed().as_secs_f64();
        let allocated_bytes = stage.context.allocated_bytes();
        Ok(Frame { picture, image, exposure_ev, divisor, ms, report, allocated_bytes, beside })
    }
}

/// The least by which a side of the image is divided to be made soon.
fn divisor(size: (u32, u32), ms_per_pixel: f64) -> u32 {
    let pixels = f64::from(size.0) * f64::from(size.1);
    let soon = |d: &&u32| pixels / f64::from(**d * **d) * ms_per_pixel <= MOVING_MS;
    DIVISORS.iter().find(soon).or(DIVISORS.last()).copied().unwrap_or(1)
}

struct Maker {
    renderer: Renderer,
    made_for: (Settings, (u32, u32), Layer),
    /// Of the image alone, as it was last.
    ms_per_pixel: f64,
}

impl Maker {
    /// What is there, or a new one.
    fn of<'a>(
        there: &'a mut Option<Self>,
        (stage, watch): (&Stage, &Watch),
        settings: &Settings,
        job: &Job,
    ) -> Result<&'a mut Self> {
        if there.is_none() {
            let Stage { context, scene, shot, options } = stage;
            let options = RenderOptions {
                size: job.size,
                aovs: job.layer.needs(),
                watch: Some(watch.clone()),
                responsive: true,
                ..options.clone()
            };
            let pose = shot.pose(scene, job.later_s);
            let renderer = Renderer::new(context, scene.as_ref().clone(), &pose, settings.clone(), options)?;
            let ms_per_pixel = if context.is_cpu { 1.0 } else { 0.0 };
            *there = Some(Self { renderer, made_for: (settings.clone(), job.size, job.layer), ms_per_pixel });
        }
        Ok(there.as_mut().expect("just made"))
    }

    fn frame(
        &mut self,
        (job, wanted): (&Job, &Settings),
        divisor: u32,
        Stage { context, shot, .. }: &Stage,
    ) -> Result<(Picture, Layers, f32, FrameReport)> {
        let size = ((job.size.0 / divisor).max(1), (job.size.1 / divisor).max(1));
        let (settings, made_size, layer) = &self.made_for;
        if !settings.means_same(wanted) || *made_size != size || *layer != job.layer {
            self.renderer.change_layers(wanted.clone(), size, job.layer.needs())?;
            self.made_for = (wanted.clone(), size, job.layer);
        }
        let pose = shot.pose(self.renderer.scene(), job.later_s);
        let report = self.renderer.render(&pose, &job.view)?;
        let zones = report.timings.zones.iter().filter(|zone| IMAGE_PASSES.contains(&zone.name));
        let passes = f64::from(wanted.image.passes);
        self.ms_per_pixel =
            zones.map(|zone| zone.gpu_ms).sum::<f64>() * passes / (f64::from(size.0) * f64::from(size.1));
        let image = self.renderer.read();
        let scene = self.renderer.scene();
        let ev =
            job.exposure.unwrap_or_else(|| automatic_exposure(image.beauty(), sky_shown(&image, scene, &job.view)));
        let rgba = match job.layer {
            Layer::Image(layer) => encode(&image, layer, ev),
            Layer::Grid(layer) => layer.picture((context, &self.renderer), &image, &job.view)?,
        };
        Ok((Picture { size, rgba }, image, ev, report))
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
