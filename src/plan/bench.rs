//! Measures settings: an image of a frame from scratch, times of further ones, memory, and errors against references.
//!
//! Images may be smaller than those that are asked for. Then the times of passes over the image count as many times as there are
//! pixels more, and those of the other passes once.

use std::collections::HashMap;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, OnceLock};
use std::time::Instant;

use base64::prelude::{BASE64_STANDARD, Engine};
use serde::{Deserialize, Serialize};

use super::search::Reading;
use crate::chart::row::Part;
use crate::ground::clearance::for_camera;
use crate::lab::store::Results;
use crate::layers::{Aov, Layers};
use crate::measure::metrics;
use crate::measure::terms::{self, Subtract};
use crate::reference::film::Film;
use crate::reference::{self, Control, Depth, Options, Stop, cache};
use crate::renderer::{FrameReport, RenderOptions, Renderer};
use crate::scene::{Pose, Scene, Still, View};
use crate::settings::{Bounces, Settings};
use crate::vk::{Context, process_cpu_ms};
use crate::{Error, Result, measure};

/// A scene at a moment, from somewhere.
#[derive(Clone, Debug)]
pub struct Seen {
    /// The flags that show it, such as `--camera 1`.
    pub words: String,
    pub pose: Pose,
    pub view: View,
}

/// What the search has of whoever runs it.
pub trait Host {
    /// Path-traces.
    ///
    /// # Errors
    /// [`Error::Interrupted`]
    fn trace(&self, of: &Seen, options: &Options) -> Result<Film>;

    /// Says what it is at.
    fn is_at(&self, text: String);

    /// # Errors
    /// [`Error::Interrupted`]
    fn check(&self) -> Result<()>;
}

/// What is kept of settings at a view.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Row {
    /// Milliseconds of device time of the fastest of the timed frames, pass by pass in the order of the frame.
    pub passes: Vec<(String, f64)>,
    /// Processor time of the cheapest of them, of all threads, where the system tells it.
    pub cpu_ms: Option<f64>,
    /// Milliseconds of processor time that measuring took, of all threads, compiling included; where the system tells it.
    pub spent_cpu_ms: Option<f64>,
    /// Device memory for images of the size that is asked for.
    pub bytes: u64,
    image: Vec<(Aov, String)>,
}

/// Further frames are timed until they took so long together, milliseconds, and so many at most.
const LONG_ENOUGH_MS: f64 = 300.0;
const MOST_FRAMES: usize = 3;

/// Passes over the image, by the start of their names.
pub const OF_PIXELS: [&str; 2] = ["gather", "image"];

/// Samples per pixel of the first references; those of the next level have four times as many.
const FIRST_SAMPLES: u32 = 16;

pub struct Bench<'a> {
    pub context: &'a Arc<Context>,
    pub scene: &'a Scene,
    /// Of the images that are asked for.
    pub options: RenderOptions,
    /// Pixels of the images that are measured.
    pub size: (u32, u32),
    pub part: Part,
    pub store: &'a Results,
    pub host: &'a dyn Host,
    renderer: Option<Renderer>,
    /// Under the keys that they are kept under.
    rows: HashMap<String, Row>,
    references: HashMap<(String, u64), Arc<Layers>>,
}

impl<'a> Bench<'a> {
    pub fn new(
        (context, host, store): (&'a Arc<Context>, &'a dyn Host, &'a Results),
        scene: &'a Scene,
        options: RenderOptions,
        (size, part): ((u32, u32), Part),
    ) -> Self {
        let (rows, references) = (HashMap::new(), HashMap::new());
        Self { context, scene, options, size, part, store, host, renderer: None, rows, references }
    }

    /// The row of settings at a view: from this call, from an earlier one, or measured now. What cannot run gives the reason.
    pub fn row(&mut self, settings: &Settings, seen: &Seen) -> Result<std::result::Result<Row, String>> {
        let about = [seen_key(self.scene, seen, self.size), settings.to_toml(), format!("{:?}", self.part)].join(" ");
        let key = self.store.key(&format!("row {about} {:?} {:?}", self.options.size, self.options.bounds));
        if let Some(row) = self.rows.get(&key) {
            return Ok(Ok(row.clone()));
        }
        let row = match self.store.load(&key) {
            Some(row) => row,
            None => {
                self.host.check()?;
                let row = match self.measure(settings, seen) {
                    Ok(row) => row,
                    Err(Error::Memory(why) | Error::Usage(why)) => return Ok(Err(why)),
                    Err(error) => return Err(error),
                };
                self.store.save(&key, &row);
                row
            }
        };
        self.rows.insert(key, row.clone());
        Ok(Ok(row))
    }

    /// Seconds of processor time that the rows took that this call needed.
    pub fn spent_cpu_s(&self) -> Option<f64> {
        self.rows.values().map(|row| row.spent_cpu_ms).sum::<Option<f64>>().map(|ms| ms / 1e3)
    }

    fn measure(&mut self, settings: &Settings, seen: &Seen) -> Result<Row> {
        let before = process_cpu_ms();
        let (pose, view) = (&seen.pose, &seen.view);
        let settings = &for_camera(settings, Still::new(self.scene, pose, view), self.options.bounds);
        let (size, full) = (self.size, self.options.size);
        let aovs = if self.part == Part::Total { vec![] } else { vec![Aov::Direct] };
        // Feedback would go on from the light of the settings before.
        let before_this = self.renderer.take().filter(|_| settings.bounces != Bounces::All);
        let changed = |mut renderer: Renderer| renderer.change(settings.clone(), size).is_ok().then_some(renderer);
        let mut renderer = match before_this.and_then(changed) {
            Some(renderer) => renderer,
            None => {
                let options = RenderOptions { aovs, size, ..self.options.clone() };
                Renderer::new(self.context, self.scene.clone(), pose, settings.clone(), options)?
            }
        };
        renderer.render(pose, view)?;
        let mut image = renderer.read();
        if self.part != Part::Total && !terms::changes(settings).is_empty() {
            renderer.change(terms::on_equal_terms(settings), size)?;
            renderer.render(pose, view)?;
            image = renderer.read();
            renderer.change(settings.clone(), size)?;
            renderer.render(pose, view)?; // compiles, before frames are timed
        }
        let (mut frames, mut cpu_ms): (Vec<FrameReport>, Vec<Option<f64>>) = Default::default();
        let spent = |frames: &[FrameReport]| frames.iter().map(|frame| frame.timings.gpu_ms).sum::<f64>();
        while frames.is_empty() || (frames.len() < MOST_FRAMES && spent(&frames) < LONG_ENOUGH_MS) {
            self.host.check()?;
            renderer.make_anew();
            let began = process_cpu_ms();
            frames.push(renderer.render(pose, view)?);
            cpu_ms.push(process_cpu_ms().zip(began).map(|(after, began)| after - began));
        }
        measure::refuse_invalid(self.context)?;
        let fastest = frames.iter().min_by(|a, b| a.timings.gpu_ms.total_cmp(&b.timings.gpu_ms)).expect("one at least");
        let bytes = renderer.plan_at(full).total();
        if settings.bounces != Bounces::All {
            self.renderer = Some(renderer);
        }
        let spent_cpu_ms = process_cpu_ms().zip(before).map(|(after, before)| after - before);
        let cpu_ms = cpu_ms.into_iter().flatten().min_by(f64::total_cmp);
        Ok(Row { passes: passes(fastest), cpu_ms, spent_cpu_ms, bytes, image: encode(&image) })
    }

    /// What a row says, against a reference.
    pub fn reading(&self, row: &Row, reference: &Layers) -> Result<Reading> {
        let pixels = |(width, height): (u32, u32)| f64::from(width) * f64::from(height);
        let more = pixels(self.options.size) / pixels(self.size);
        let spent: f64 = row.passes.iter().map(|pass| pass.1).sum();
        let idle = row.cpu_ms.and_then(|cpu| self.on_idle(cpu)).map_or(1.0, |ms| ms / spent);
        let scaled = |(name, ms): &(String, f64)| {
            let of_pixels = OF_PIXELS.iter().any(|start| name.starts_with(start));
            (name.clone(), ms * idle * if of_pixels { more } else { 1.0 })
        };
        let passes: Vec<_> = row.passes.iter().map(scaled).collect();
        let ms = passes.iter().map(|pass| pass.1).sum();
        Ok(Reading { ms, passes, bytes: row.bytes, error: self.error(&self.image(row), reference)? })
    }

    /// Milliseconds that a frame takes of a CPU device which has the machine for itself, by its processor time: what else runs
    /// disturbs that least, while device time then is wall-clock time. `None` on other devices.
    pub fn on_idle(&self, cpu_ms: f64) -> Option<f64> {
        self.context.is_cpu.then(|| cpu_ms / rayon::current_num_threads() as f64)
    }

    /// A row's image.
    pub fn image(&self, row: &Row) -> Layers {
        let decode = |text: &String| bytemuck::pod_collect_to_vec(&BASE64_STANDARD.decode(text).unwrap_or_default());
        let layers = row.image.iter().map(|(aov, text)| (*aov, decode(text))).collect();
        Layers { width: self.size.0, height: self.size.1, layers }
    }

    /// `rel` of the part of the light that counts.
    fn error(&self, image: &Layers, reference: &Layers) -> Result<f64> {
        if self.part == Part::Total {
            return Ok(metrics::metrics(image.beauty(), reference.beauty(), "reference")?.rel);
        }
        let comparison = metrics::compare(image, reference, Subtract::in_scene(self.scene))?;
        let (part, words) = match self.part {
            Part::Indirect => (comparison.indirect, "no indirect light"),
            _ => (comparison.indirect_diffuse, "no indirect light on diffuse surfaces"),
        };
        let none =
            || Error::Usage(format!("--error-of: the reference shows {words}; name another part, such as whole"));
        Ok(part.ok_or_else(none)?.rel)
    }

    /// A view's reference of all light. `copy` 0 and 1: two independent ones.
    pub fn reference(&mut self, seen: &Seen, level: u32, copy: u64) -> Result<Arc<Layers>> {
        let seed = 2 * u64::from(level) + copy;
        let key = (seen_key(self.scene, seen, self.size), seed);
        if let Some(reference) = self.references.get(&key) {
            return Ok(reference.clone());
        }
        let (width, height) = self.size;
        let stop = Stop::Samples(samples(level));
        let options = Options { width, height, depth: Depth::Full, stop, seed, occlusion: false };
        let aovs: &[Aov] = if self.part == Part::Total { &[] } else { &[Aov::Direct, Aov::Diffuse] };
        let layers = Arc::new(self.host.trace(seen, &options)?.layers(aovs));
        self.references.insert(key, layers.clone());
        Ok(layers)
    }

    /// Seconds that a sample of all pixels takes, by a few that nothing is kept of.
    pub fn pace(&self, seen: &Seen) -> Result<f64> {
        const SAMPLES: u32 = 4;
        let (width, height) = self.size;
        let stop = Stop::Samples(SAMPLES);
        let options = Options { width, height, depth: Depth::Full, stop, seed: 0, occlusion: false };
        let began = OnceLock::new();
        let progress = |_| {
            began.get_or_init(Instant::now); // first called when the paths begin
        };
        let control = Control { progress: &progress, save: &mut |_| Ok(()), cancel: &AtomicBool::new(false) };
        reference::render(
            Still::new(self.scene, &seen.pose, &seen.view),
            &options,
            &mut Film::new(width, height),
            control,
        )?;
        Ok(began.get().map_or(0.0, |began| began.elapsed().as_secs_f64()) / f64::from(SAMPLES))
    }

    /// How wrong a reference itself is: two of them differ by √2 of that.
    pub fn noise(&mut self, seen: &Seen, level: u32) -> Result<f64> {
        let [a, b] = [self.reference(seen, level, 0)?, self.reference(seen, level, 1)?];
        Ok(self.error(&b, &a)? * std::f64::consts::FRAC_1_SQRT_2)
    }

    /// Frames of the size that is asked for, of all views: times of up to `rounds`, in which the settings take turns, so that what
    /// else the machine does disturbs all alike; settings that take too much memory to wait beside the others are timed by
    /// themselves. After `until` no further round begins.
    pub fn times(&mut self, all: &[Settings], views: &[Seen], rounds: usize, until: Instant) -> Result<Vec<Timed>> {
        self.renderer = None;
        let mut timed: Vec<Timed> = all.iter().map(|_| Timed::default()).collect();
        let mut waiting: Vec<(usize, Renderer)> = Vec::new();
        let room = self.context.memory_budget() / (2 * all.len().max(1) as u64);
        for (i, settings) in all.iter().enumerate() {
            let mut renderer = Renderer::new(
                self.context,
                self.scene.clone(),
                &views[0].pose,
                for_camera(settings, Still::new(self.scene, &views[0].pose, &views[0].view), self.options.bounds),
                self.options.clone(),
            )?;
            // The first frame compiles.
            self.frames(&mut renderer, views, &format!("warming up {} of {}", i + 1, all.len()))?;
            timed[i].bytes = renderer.plan().total();
            if timed[i].bytes < room {
                waiting.push((i, renderer));
                continue;
            }
            for round in 0..rounds {
                if round == 0 || Instant::now() < until {
                    let words = format!("timing {} of {}, round {} of {rounds}", i + 1, all.len(), round + 1);
                    timed[i].add(self.frames(&mut renderer, views, &words)?);
                }
            }
        }
        for round in 0..rounds {
            for (i, renderer) in &mut waiting {
                if round == 0 || Instant::now() < until {
                    let words = format!("timing {} of {}, round {} of {rounds}", *i + 1, all.len(), round + 1);
                    timed[*i].add(self.frames(renderer, views, &words)?);
                }
            }
        }
        Ok(timed)
    }

    /// A frame from scratch of each view; the slowest, with its processor time.
    fn frames(&self, renderer: &mut Renderer, views: &[Seen], words: &str) -> Result<(FrameReport, Option<f64>)> {
        self.host.is_at(words.to_owned());
        let mut reports = Vec::new();
        for seen in views {
            self.host.check()?;
            renderer.make_anew();
            let began = process_cpu_ms();
            let report = renderer.render(&seen.pose, &seen.view)?;
            reports.push((report, process_cpu_ms().zip(began).map(|(after, began)| after - began)));
        }
        let slowest = reports.into_iter().max_by(|a, b| a.0.timings.gpu_ms.total_cmp(&b.0.timings.gpu_ms));
        Ok(slowest.expect("a view at least"))
    }
}

/// Times of one of several settings.
#[derive(Clone, Debug, Default)]
pub struct Timed {
    /// Milliseconds of device time, of the slowest view in each round.
    pub frames: Vec<f64>,
    /// Milliseconds of processor time of the same frames, where the system tells it.
    pub cpu_ms: Vec<f64>,
    pub passes: Vec<Vec<(String, f64)>>,
    /// Device memory.
    pub bytes: u64,
}

impl Timed {
    fn add(&mut self, (report, cpu_ms): (FrameReport, Option<f64>)) {
        self.frames.push(report.timings.gpu_ms);
        self.cpu_ms.extend(cpu_ms);
        self.passes.push(passes(&report));
    }
}

/// A scene as it is seen, as words to make a key of.
pub fn seen_key(scene: &Scene, seen: &Seen, (width, height): (u32, u32)) -> String {
    let options = Options { width, height, depth: Depth::Full, stop: Stop::Samples(1), seed: 0, occlusion: false };
    cache::key(Still::new(scene, &seen.pose, &seen.view), &options).to_string()
}

/// Samples per pixel of references of a level.
pub fn samples(level: u32) -> u32 {
    FIRST_SAMPLES << (2 * level)
}

/// Milliseconds per pass; those that run several times are added up.
fn passes(report: &FrameReport) -> Vec<(String, f64)> {
    let mut passes: Vec<(String, f64)> = Vec::new();
    for zone in &report.timings.zones {
        match passes.iter_mut().find(|pass| pass.0 == zone.name) {
            Some(pass) => pass.1 += zone.gpu_ms,
            None => passes.push((zone.name.to_owned(), zone.gpu_ms)),
        }
    }
    passes
}

fn encode(image: &Layers) -> Vec<(Aov, String)> {
    let wanted = image.layers.iter().filter(|(aov, _)| matches!(aov, Aov::Beauty | Aov::Direct));
    wanted.map(|(aov, pixels)| (*aov, BASE64_STANDARD.encode(bytemuck::cast_slice::<[f32; 3], u8>(pixels)))).collect()
}
