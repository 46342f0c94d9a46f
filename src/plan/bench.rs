//! Measures settings: an image of a frame from scratch, times of further ones, memory, and errors against references.
//!
//! Images may be smaller than those that are asked for. Then the times of passes over the image count as many times as
//! there are pixels more, and those of the other passes once.

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

/// A scene at a moment, from somewhere.
#[derive(Clone, Debug)]
pub struct PlanView {
    /// The flags that show it, such as `--camera 1`.
    pub flags: Vec<String>,
    pub words: String,
    pub pose: Pose,
    pub view: View,
}

impl PlanView {
    pub fn still<'a>(&'a self, scene: &'a Scene) -> Still<'a> {
        Still::new(scene, &self.pose, &self.view)
    }

    /// A scene as it is seen, as words to make a key of.
    pub fn key(&self, scene: &Scene, size: (u32, u32)) -> String {
        cache::key(self.still(scene), &options(size, Stop::Samples(1), 0)).to_string()
    }
}

/// Measurement of settings at a view, as it is kept.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Measurement {
    /// Milliseconds of device time of the fastest of the timed frames, pass by pass.
    pub passes: BTreeMap<String, f64>,
    /// Processor time of the cheapest of them, of all threads, where the system tells it.
    pub cpu_ms: Option<f64>,
    /// Milliseconds of processor time that measuring took, of all threads, compiling included; where the system tells
    /// it.
    pub spent_cpu_ms: Option<f64>,
    /// Device memory for images of the size that is asked for.
    pub bytes: u64,
    image: Vec<(Aov, String)>,
}

/// Frames that are timed after the image.
const TIMED: Count = Count { warm_up: 0, least: 1, most: 3, enough_ms: 300.0 };

/// Passes over the image, by the start of their names.
pub const OF_PIXELS: [&str; 4] = ["visibility", "gather", "image", "resolve"];

/// Samples per pixel of the first references; those of the next level have four times as many.
const FIRST_SAMPLES: u32 = 16;

/// Levels of references: 16 to 262144 samples a pixel.
const MOST_LEVEL: u32 = 7;

/// The parts that a [`Bench`] is made of.
pub struct Setup<'a> {
    pub context: &'a Arc<Context>,
    pub scene: &'a Scene,
    /// Of the images that are asked for.
    pub options: RenderOptions,
    /// Pixels of the images that are measured.
    pub size: (u32, u32),
    pub part: Part,
    pub store: &'a Results,
    /// Path-traces.
    pub trace: &'a dyn Fn(&PlanView, &Options) -> Result<Film>,
    /// Says what is being done.
    pub is_at: &'a dyn Fn(String),
}

pub struct Bench<'a> {
    pub setup: Setup<'a>,
    /// The level of the references: see [`Self::samples`].
    pub level: u32,
    /// Seconds that a sample of all pixels takes, once known.
    pub pace: Option<f64>,
    renderer: Option<Renderer>,
    /// Under the keys that they are kept under.
    rows: HashMap<String, Measurement>,
    references: HashMap<(String, u64), Arc<Layers>>,
}

impl<'a> Bench<'a> {
    pub fn new(setup: Setup<'a>) -> Self {
        let (rows, references) = (HashMap::new(), HashMap::new());
        Self { setup, level: 0, pace: None, renderer: None, rows, references }
    }

    /// The error and time of settings at a view, against one of the two references. Settings that cannot run are
    /// infinitely bad.
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

    /// The row of settings at a view: from this call, from an earlier one, or measured now.
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

    /// Seconds of processor time that the rows took that this call needed.
    pub fn spent_cpu_s(&self) -> Option<f64> {
        self.rows.values().map(|row| row.spent_cpu_ms).sum::<Option<f64>>().map(|ms| ms / 1e3)
    }

    fn measure(&mut self, settings: &Settings, seen: &PlanView) -> Result<Measurement> {
        let before = process_cpu_ms();
        let Setup { context, scene, options, size, part, .. } = &self.setup;
        let PlanView { pose, view, .. } = seen;
        let settings = &for_camera(settings, seen.still(scene), options.bounds);
        // Feedback would go on from the light of the settings before.
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
            renderer.render(pose, view)?; // compiles, before frames are timed
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

    /// Evaluates a row against a reference.
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

    /// Milliseconds that a frame takes of a CPU device which has the machine for itself, by its processor time: what
    /// else runs disturbs that least, while device time then is wall-clock time. `None` on other devices.
    pub fn on_idle(&self, cpu_ms: f64) -> Option<f64> {
        self.setup.context.is_cpu.then(|| cpu_ms / rayon::current_num_threads() as f64)
    }

    /// A row's image.
    pub fn image(&self, row: &Measurement) -> Layers {
        let decode = |text: &String| bytemuck::pod_collect_to_vec(&BASE64_STANDARD.decode(text).unwrap_or_default());
        let layers = row.image.iter().map(|(aov, text)| (*aov, decode(text))).collect();
        Layers { width: self.setup.size.0, height: self.setup.size.1, layers }
    }

    /// `rel` of the part of the light that counts.
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

    /// A view's reference of all light. `copy` 0 and 1: two independent ones.
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

    /// Seconds that the two references of a view take, as far as that is known.
    pub fn reference_s(&self) -> f64 {
        2.0 * self.pace.unwrap_or(0.0) * f64::from(self.samples())
    }

    /// Makes finer references of a view until their noise is at most `wanted`, or the next ones would not be there
    /// `until` then.
    pub fn refine(&mut self, seen: &PlanView, wanted: f64, until: Instant) -> Result<()> {
        loop {
            let began = Instant::now();
            let noise = self.noise(seen)?;
            let took = began.elapsed().as_secs_f64();
            self.pace = Some(match self.pace {
                // References from the cache tell none.
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

    /// Seconds that a sample of all pixels takes, by a few that nothing is kept of.
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

    /// How wrong a reference itself is: two of them differ by √2 of that.
    pub fn noise(&mut self, seen: &PlanView) -> Result<f64> {
        let [a, b] = [self.reference(seen, 0)?, self.reference(seen, 1)?];
        Ok(self.error(&b, &a)? * std::f64::consts::FRAC_1_SQRT_2)
    }

    /// Frames of the size that is asked for, of all views: times of up to `rounds`, in which the settings take turns,
    /// so that what else the machine does disturbs all alike; settings that take too much memory to wait beside the
    /// others are timed by themselves. After `until` no further round begins. Of each settings the slowest view in each
    /// round, and the device memory.
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

/// The slowest of frames from scratch, one of each view.
fn slowest(renderer: &mut Renderer, views: &[PlanView]) -> Result<FrameReport> {
    let frame = |seen: &PlanView| {
        renderer.make_anew();
        renderer.render(&seen.pose, &seen.view)
    };
    let frames = views.iter().map(frame).collect::<Result<Vec<_>>>()?;
    let slowest = frames.into_iter().max_by(|a, b| a.timings.gpu_ms.total_cmp(&b.timings.gpu_ms));
    Ok(slowest.expect("a view at least"))
}

/// How references are traced.
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
