//! Measures settings: an image of a frame from scratch, times of further frames, memory, and errors against references.
//!
//! Measured images may be smaller than requested. Then the times of image passes are multiplied by the ratio of pixels,
//! and those of other passes are unchanged.

use std::collections::{BTreeMap, HashMap};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use base64::prelude::{BASE64_STANDARD, Engine};
use serde::{Deserialize, Serialize};

use super::search::Reading;
use crate::ground::grid_choice::for_camera;
use crate::lab::store::Results;
use crate::layers::{Aov, Layers};
use crate::measure::metrics::{self, Part};
use crate::measure::terms::{self, Subtract};
use crate::measure::timing::{Count, Timings};
use crate::reference::film::Film;
use crate::reference::{self, Control, Depth, Options, Stop, cache};
use crate::renderer::{FrameReport, RenderOptions, Renderer};
use crate::scene::{Pose, Scene, Still, View};
use crate::settings::{Bounces, Settings};
use crate::vk::{Context, process_cpu_ms};
use crate::{Error, Result, measure};

/// A scene at one time from one camera.
#[derive(Clone, Debug)]
pub struct PlanView {
    /// The flags of the view, such as `--camera 1`.
    pub flags: Vec<String>,
    pub words: String,
    pub pose: Pose,
    pub view: View,
}

impl PlanView {
    pub fn still<'a>(&'a self, scene: &'a Scene) -> Still<'a> {
        Still::new(scene, &self.pose, &self.view)
    }

    /// A text that identifies the scene and the view, for keys.
    pub fn key(&self, scene: &Scene, size: (u32, u32)) -> String {
        cache::key(self.still(scene), &options(size, Stop::Samples(1), 0)).to_string()
    }
}

/// A stored measurement of settings at a view.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Measurement {
    /// Milliseconds of device time of each pass in the fastest timed frame.
    pub passes: BTreeMap<String, f64>,
    /// Processor time of the cheapest timed frame over all threads, if the system reports it.
    pub cpu_ms: Option<f64>,
    /// Milliseconds of processor time of the whole measurement over all threads including compilation, if the system
    /// reports it.
    pub spent_cpu_ms: Option<f64>,
    /// Device memory for images of the requested size.
    pub bytes: u64,
    image: Vec<(Aov, String)>,
}

/// Frames that are timed after the image.
const TIMED: Count = Count { warm_up: 0, least: 1, most: 3, enough_ms: 300.0 };

/// Image passes, by the beginnings of their names.
pub const OF_PIXELS: [&str; 4] = ["visibility", "gather", "image", "resolve"];

/// Samples per pixel of the first references; those of each further level have four times as many.
const FIRST_SAMPLES: u32 = 16;

/// Levels of references: 16 to 262144 samples per pixel.
const MOST_LEVEL: u32 = 7;

/// The inputs of a [`Bench`].
pub struct Setup<'a> {
    pub context: &'a Arc<Context>,
    pub scene: &'a Scene,
    /// Options of the requested images.
    pub options: RenderOptions,
    /// Size in pixels of the measured images.
    pub size: (u32, u32),
    pub part: Part,
    pub store: &'a Results,
    /// Path-traces a view.
    pub trace: &'a dyn Fn(&PlanView, &Options) -> Result<Film>,
    /// Reports the current step.
    pub is_at: &'a dyn Fn(String),
}

pub struct Bench<'a> {
    pub setup: Setup<'a>,
    /// The level of the references: see [`Self::samples`].
    pub level: u32,
    /// Seconds per sample of all pixels, once known.
    pub pace: Option<f64>,
    renderer: Option<Renderer>,
    /// Measurements by their keys.
    rows: HashMap<String, Measurement>,
    references: HashMap<(String, u64), Arc<Layers>>,
}

impl<'a> Bench<'a> {
    pub fn new(setup: Setup<'a>) -> Self {
        let (rows, references) = (HashMap::new(), HashMap::new());
        Self { setup, level: 0, pace: None, renderer: None, rows, references }
    }

    /// The error and time of settings at a view, against one of the two references. Settings that cannot run have
    /// infinite error and time.
    pub fn reading(&mut self, settings: &Settings, seen: &PlanView, copy: u64) -> Result<Reading> {
        let reference = self.reference(seen, copy)?;
        match self.row(settings, seen) {
            Ok(row) => self.judge(&row, &reference),
            Err(Error::Memory(_) | Error::Usage(_)) => {
                Ok(Reading { ms: f64::INFINITY, passes: BTreeMap::new(), bytes: u64::MAX, error: f64::INFINITY })
            }
            Err(error) => Err(error),
        }
    }

    /// The measurement of settings at a view: from this call, from an earlier one, or new.
    pub fn row(&mut self, settings: &Settings, seen: &PlanView) -> Result<Measurement> {
        let Setup { scene, options, size, part, store, .. } = &self.setup;
        let about = format!("row {} {} {part:?}", seen.key(scene, *size), settings.to_toml());
        let key = store.key(&format!("{about} {:?} {:?}", options.size, options.bounds));
        if let Some(row) = self.rows.get(&key) {
            return Ok(row.clone());
        }
        let row = match store.load(&key) {
            Some(row) => row,
            None => {
                let row = self.measure(settings, seen)?;
                self.setup.store.save(&key, &row);
                row
            }
        };
        self.rows.insert(key, row.clone());
        Ok(row)
    }

    /// Seconds of processor time of all measurements that this call used.
    pub fn spent_cpu_s(&self) -> Option<f64> {
        self.rows.values().map(|row| row.spent_cpu_ms).sum::<Option<f64>>().map(|ms| ms / 1e3)
    }

    fn measure(&mut self, settings: &Settings, seen: &PlanView) -> Result<Measurement> {
        let before = process_cpu_ms();
        let Setup { context, scene, options, size, part, .. } = &self.setup;
        let PlanView { pose, view, .. } = seen;
        let settings = &for_camera(settings, seen.still(scene), options.bounds);
        // Feedback would continue from the light of the previous settings.
        let before_this = self.renderer.take().filter(|_| settings.bounces != Bounces::All);
        let changed = |mut renderer: Renderer| renderer.change(settings.clone(), *size).is_ok().then_some(renderer);
        let mut renderer = match before_this.and_then(changed) {
            Some(renderer) => renderer,
            None => {
                let aovs = if *part == Part::Total { vec![] } else { vec![Aov::Direct] };
                let options = RenderOptions { aovs, size: *size, ..options.clone() };
                Renderer::new(context, (*scene).clone(), pose, settings.clone(), options)?
            }
        };
        renderer.render(pose, view)?;
        let mut image = renderer.read();
        if *part != Part::Total && !terms::changes(settings).is_empty() {
            renderer.change(terms::on_equal_terms(settings), *size)?;
            renderer.render(pose, view)?;
            image = renderer.read();
            renderer.change(settings.clone(), *size)?;
            renderer.render(pose, view)?; // compiles shaders before frames are timed
        }
        let timings = TIMED.frames(&mut renderer, pose, view, &|| Ok(()))?;
        measure::refuse_invalid(context)?;
        let fastest = timings.all().iter().min_by(|a, b| a.timings.gpu_ms.total_cmp(&b.timings.gpu_ms));
        let passes = passes(&Timings::of_reports(fastest.cloned()));
        let bytes = renderer.plan_at(options.size).total();
        if settings.bounces != Bounces::All {
            self.renderer = Some(renderer);
        }
        let spent_cpu_ms = process_cpu_ms().zip(before).map(|(after, before)| after - before);
        let cpu_ms = timings.frame_cpu_ms().map(|spread| spread.min);
        Ok(Measurement { passes, cpu_ms, spent_cpu_ms, bytes, image: encode(&image) })
    }

    /// Compares a measurement with a reference.
    pub fn judge(&self, row: &Measurement, reference: &Layers) -> Result<Reading> {
        let pixels = |(width, height): (u32, u32)| f64::from(width) * f64::from(height);
        let more = pixels(self.setup.options.size) / pixels(self.setup.size);
        let spent: f64 = row.passes.values().sum();
        let idle = row.cpu_ms.and_then(|cpu| self.on_idle(cpu)).map_or(1.0, |ms| ms / spent);
        let mut passes = row.passes.clone();
        for (name, ms) in &mut passes {
            let of_pixels = OF_PIXELS.iter().any(|start| name.starts_with(start));
            *ms *= idle * if of_pixels { more } else { 1.0 };
        }
        let error = self.error(&self.image(row), reference)?;
        Ok(Reading { ms: passes.values().sum(), passes, bytes: row.bytes, error })
    }

    /// Milliseconds of a frame on an otherwise idle CPU device, from its processor time, which other programs disturb
    /// least; device time is wall-clock time there. `None` on other devices.
    pub fn on_idle(&self, cpu_ms: f64) -> Option<f64> {
        self.setup.context.is_cpu.then(|| cpu_ms / rayon::current_num_threads() as f64)
    }

    /// The image of a measurement.
    pub fn image(&self, row: &Measurement) -> Layers {
        let decode = |text: &String| bytemuck::pod_collect_to_vec(&BASE64_STANDARD.decode(text).unwrap_or_default());
        let layers = row.image.iter().map(|(aov, text)| (*aov, decode(text))).collect();
        Layers { width: self.setup.size.0, height: self.setup.size.1, layers }
    }

    /// `rel` of the selected part of the light.
    fn error(&self, image: &Layers, reference: &Layers) -> Result<f64> {
        let subtract = Subtract::in_scene(self.setup.scene);
        let (part, words) = match self.setup.part {
            Part::Total => return Ok(metrics::metrics(image.beauty(), reference.beauty(), "reference")?.rel),
            Part::Indirect => (metrics::compare(image, reference, subtract)?.indirect, "no indirect light"),
            Part::Diffuse => {
                let comparison = metrics::compare(image, reference, subtract)?;
                (comparison.indirect_diffuse, "no indirect light on diffuse surfaces")
            }
        };
        let none =
            || Error::Usage(format!("--error-of: the reference shows {words}; name another part, such as whole"));
        Ok(part.ok_or_else(none)?.rel)
    }

    /// A view's reference of all light. There are two independent ones, `copy` 0 and 1.
    pub fn reference(&mut self, seen: &PlanView, copy: u64) -> Result<Arc<Layers>> {
        let Setup { scene, size, part, trace, .. } = &self.setup;
        let seed = 2 * u64::from(self.level) + copy;
        let key = (seen.key(scene, *size), seed);
        if let Some(reference) = self.references.get(&key) {
            return Ok(reference.clone());
        }
        let aovs: &[Aov] = if *part == Part::Total { &[] } else { &[Aov::Direct, Aov::Diffuse] };
        let layers = Arc::new(trace(seen, &options(*size, Stop::Samples(self.samples()), seed))?.layers(aovs));
        self.references.insert(key, layers.clone());
        Ok(layers)
    }

    /// Samples per pixel of references.
    pub fn samples(&self) -> u32 {
        FIRST_SAMPLES << (2 * self.level)
    }

    /// Seconds for the two references of a view, as far as known.
    pub fn reference_s(&self) -> f64 {
        2.0 * self.pace.unwrap_or(0.0) * f64::from(self.samples())
    }

    /// Makes finer references of a view until their noise is at most `wanted`, or the next ones would not be finished
    /// by `until`.
    pub fn refine(&mut self, seen: &PlanView, wanted: f64, until: Instant) -> Result<()> {
        loop {
            let began = Instant::now();
            let noise = self.noise(seen)?;
            let took = began.elapsed().as_secs_f64();
            self.pace = Some(match self.pace {
                // References from the cache have no times.
                _ if took > 0.05 => took / (2.0 * f64::from(self.samples())),
                Some(pace) => pace,
                None => self.trial_pace(seen)?,
            });
            let next_s = 4.0 * self.reference_s();
            let in_time = Instant::now() + Duration::from_secs_f64(next_s.min(1e6)) < until;
            if noise <= wanted || !in_time || self.level == MOST_LEVEL {
                return Ok(());
            }
            self.level += 1;
        }
    }

    /// Seconds per sample of all pixels, from a short trial.
    fn trial_pace(&self, seen: &PlanView) -> Result<f64> {
        const SAMPLES: u32 = 4;
        let Setup { scene, size, .. } = self.setup;
        let began = OnceLock::new();
        let progress = |_| {
            began.get_or_init(Instant::now); // first called when the paths begin
        };
        let control = Control { progress: &progress, save: &mut |_| Ok(()), cancel: &AtomicBool::new(false) };
        let options = options(size, Stop::Samples(SAMPLES), 0);
        reference::render(seen.still(scene), &options, &mut Film::new(size.0, size.1), control)?;
        Ok(began.get().map_or(0.0, |began| began.elapsed().as_secs_f64()) / f64::from(SAMPLES))
    }

    /// The error of a reference: two of them differ by √2 times it.
    pub fn noise(&mut self, seen: &PlanView) -> Result<f64> {
        let [a, b] = [self.reference(seen, 0)?, self.reference(seen, 1)?];
        Ok(self.error(&b, &a)? * std::f64::consts::FRAC_1_SQRT_2)
    }

    /// Frames of the requested size for all views: times of up to `rounds` rounds in which the settings take turns, so
    /// that other load affects all equally. Settings with too much memory to be loaded together are timed separately.
    /// After `until` no further round begins. Returns for each setting the slowest view in each round, and the device
    /// memory.
    pub fn times(
        &mut self,
        all: &[Settings],
        views: &[PlanView],
        rounds: usize,
        until: Instant,
    ) -> Result<Vec<(Timings, u64)>> {
        self.renderer = None;
        let Setup { context, scene, options, is_at, .. } = &self.setup;
        let mut timed: Vec<(Timings, u64)> = all.iter().map(|_| (Timings::new(0), 0)).collect();
        let in_turns = |waiting: &mut [(usize, Renderer)], timed: &mut [(Timings, u64)]| {
            for round in (0..rounds).take_while(|round| *round == 0 || Instant::now() < until) {
                for (i, renderer) in waiting.iter_mut() {
                    is_at(format!("timing {} of {}, round {} of {rounds}", *i + 1, all.len(), round + 1));
                    timed[*i].0.push(slowest(renderer, views)?);
                }
            }
            Ok::<_, Error>(())
        };
        let mut waiting: Vec<(usize, Renderer)> = Vec::new();
        let room = context.memory_budget() / (2 * all.len().max(1) as u64);
        for (i, settings) in all.iter().enumerate() {
            let settings = for_camera(settings, views[0].still(scene), options.bounds);
            let mut renderer = Renderer::new(context, (*scene).clone(), &views[0].pose, settings, options.clone())?;
            is_at(format!("warming up {} of {}", i + 1, all.len()));
            slowest(&mut renderer, views)?;
            timed[i].1 = renderer.plan().total();
            if timed[i].1 < room {
                waiting.push((i, renderer));
            } else {
                in_turns(&mut [(i, renderer)], &mut timed)?;
            }
        }
        in_turns(&mut waiting, &mut timed)?;
        Ok(timed)
    }
}

/// The slowest frame from scratch over all views.
fn slowest(renderer: &mut Renderer, views: &[PlanView]) -> Result<FrameReport> {
    let frame = |seen: &PlanView| {
        renderer.make_anew();
        renderer.render(&seen.pose, &seen.view)
    };
    let frames = views.iter().map(frame).collect::<Result<Vec<_>>>()?;
    let slowest = frames.into_iter().max_by(|a, b| a.timings.gpu_ms.total_cmp(&b.timings.gpu_ms));
    Ok(slowest.expect("a view at least"))
}

/// Options for tracing references.
fn options((width, height): (u32, u32), stop: Stop, seed: u64) -> Options {
    Options { width, height, depth: Depth::Full, stop, seed, occlusion: false }
}

/// Median milliseconds per pass.
pub fn passes(timings: &Timings) -> BTreeMap<String, f64> {
    let mut passes = BTreeMap::new();
    for pass in timings.passes() {
        *passes.entry(pass.name.to_owned()).or_default() += pass.gpu_ms.median;
    }
    passes
}

fn encode(image: &Layers) -> Vec<(Aov, String)> {
    let wanted = image.layers.iter().filter(|(aov, _)| matches!(aov, Aov::Beauty | Aov::Direct));
    wanted.map(|(aov, pixels)| (*aov, BASE64_STANDARD.encode(bytemuck::cast_slice::<[f32; 3], u8>(pixels)))).collect()
}
