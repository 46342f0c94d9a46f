//! `twobounce render`: from a checked job to images and reports.

use std::sync::Arc;

use twobounce::ground::memory_plan::mib;
use twobounce::layers::Layers;
use twobounce::measure::timing::Timings;
use twobounce::measure::trace::chrome_trace;
use twobounce::output::exr::Metadata;
use twobounce::output::file;
use twobounce::output::png::automatic_exposure;
use twobounce::renderer::{FrameReport, RenderOptions, Renderer};
use twobounce::vk::{Context, ContextOptions};
use twobounce::{Error, Result};

use super::args::{DeviceArgs, RenderArgs};
use super::job::{Format, Frames, RenderJob};
use super::report::{self, RenderReport, SceneReport};
use super::scene::{Opened, Shot};
use super::{Outcome, interrupt, out};
use crate::say;

/// Renders what the arguments ask for.
pub fn run(args: &RenderArgs) -> anyhow::Result<Outcome> {
    let job = RenderJob::new(args)?;
    interrupt::install()?;
    let opened = args.scene.open()?;
    opened.notes.iter().for_each(|note| out::complain(&format!("note: {note}")));
    let context = args.device.open(opened.width, opened.height)?;
    let header = header(args, &job, &opened, &context);
    let mut studio = Studio::new(args, &job, opened, &context)?;
    studio.tell_memory();
    studio.warm_up(job.warm_up)?;
    match job.frames {
        Frames::Repeat(count) => {
            for _ in 0..count {
                studio.frame(0.0)?;
            }
            studio.write(0, &header)?;
        }
        Frames::Sequence { count, step_s } => {
            for frame in 0..count {
                let later_s = f64::from(frame) * step_s;
                studio.frame(later_s)?;
                let mut header = header.clone();
                header.insert("time".into(), (args.scene.time + later_s).to_string());
                studio.write(frame, &header)?;
            }
        }
    }
    studio.tell_counters();
    studio.report(args)?;
    Ok(Outcome::Done)
}

impl DeviceArgs {
    /// Opens the device for images of this size.
    pub fn open(&self, width: u32, height: u32) -> Result<Arc<Context>> {
        self.fitting(Context::new(&self.options())?, width, height)
    }

    /// The same, with shaders that count what they read.
    pub fn open_counting(&self, width: u32, height: u32) -> Result<Arc<Context>> {
        self.fitting(Context::counting(&self.options())?, width, height)
    }

    fn options(&self) -> ContextOptions {
        ContextOptions { device: self.device.clone(), validation: self.validation }
    }

    fn fitting(&self, context: Arc<Context>, width: u32, height: u32) -> Result<Arc<Context>> {
        let limits = &context.limits;
        let most = limits.max_image_dimension2_d.min(limits.max_framebuffer_width).min(limits.max_framebuffer_height);
        if width.max(height) > most {
            let sentence =
                format!("--size {width}x{height}: {} makes images of up to {most} pixels a side", context.name);
            return Err(Error::Usage(sentence));
        }
        Ok(context)
    }
}

/// Everything that stands ready while frames are made.
struct Studio<'a> {
    job: &'a RenderJob,
    context: &'a Arc<Context>,
    renderer: Renderer,
    shot: Shot,
    /// As asked for, or as chosen by the first image of a sequence for all of them.
    exposure_ev: Option<f32>,
    scene: SceneReport,
    size: (u32, u32),
    /// Bytes that the device had left before anything was taken.
    budget_bytes: u64,
    /// Of every frame, those to warm up first.
    reports: Vec<FrameReport>,
}

impl<'a> Studio<'a> {
    fn new(args: &RenderArgs, job: &'a RenderJob, opened: Opened, context: &'a Arc<Context>) -> Result<Self> {
        let Opened { scene, shot, width, height, camera, .. } = opened;
        say!("{}: triangles {}, camera {camera}, {width}x{height}", scene.name, scene.triangle_count());
        say!("{}: {}", context.name, context.driver);
        let options = RenderOptions {
            size: (width, height),
            aovs: job.aovs[1..].to_vec(),
            submit: args.submit.into(),
            memory_limit: args.memory_limit,
            bounds: shot.bounds(&scene),
        };
        let pose = shot.pose(&scene, 0.0);
        let about = SceneReport {
            name: scene.name.clone(),
            hash: scene.hash.clone(),
            triangles: scene.triangle_count(),
            camera,
            time_s: args.scene.time,
        };
        let budget_bytes = context.memory_budget();
        let renderer = Renderer::new(context, scene, &pose, job.settings.clone(), options)?;
        Ok(Self {
            job,
            context,
            renderer,
            shot,
            exposure_ev: args.exposure,
            scene: about,
            size: (width, height),
            budget_bytes,
            reports: Vec::new(),
        })
    }

    /// Frames whose times do not count.
    fn warm_up(&mut self, frames: u32) -> Result<()> {
        (0..frames).try_for_each(|_| self.frame(0.0))
    }

    fn frame(&mut self, later_s: f64) -> Result<()> {
        interrupt::check()?;
        if !self.job.still {
            self.renderer.make_anew();
        }
        let pose = self.shot.pose(self.renderer.scene(), later_s);
        let view = self.shot.view(self.renderer.scene(), &pose);
        self.reports.push(self.renderer.render(&pose, &view)?);
        interrupt::check()
    }

    /// Writes the last frame as number `frame`.
    fn write(&mut self, frame: u32, header: &Metadata) -> Result<()> {
        if let Some(first) = self.context.validation_messages().first() {
            return Err(Error::Device(format!("the validation layer objects, so no image is written: {first}")));
        }
        let path = self.job.output.path(frame);
        let image = self.renderer.read();
        warn_of_non_finite(&image);
        match self.job.output.format {
            Format::Exr => image.write_exr(&path, header)?,
            Format::Png => {
                let ev = *self.exposure_ev.get_or_insert_with(|| {
                    let ev = automatic_exposure(image.beauty(), self.renderer.scene().sky.into());
                    say!("exposure: {ev} EV, automatic (--exposure {ev} gives the same image)");
                    ev
                });
                image.write_png(&path, ev)?;
            }
        }
        say!("wrote {}", path.display());
        Ok(())
    }

    fn tell_memory(&self) {
        let (plan, taken) = (self.renderer.plan(), self.context.allocated_bytes());
        say!("memory plan:\n{plan}");
        say!("  {:<24} {:>10.2} MiB", "taken from the driver", mib(taken));
        say!("  {:<24} {:>10.2} MiB", "the device's budget", mib(self.budget_bytes));
    }

    fn tell_counters(&self) {
        let Some(last) = self.reports.last() else { return };
        let counters = &last.counters;
        say!(
            "recorded triangles {} (dropped without area {}), list items {}, occupied voxels {}",
            counters.triangles,
            counters.degenerate,
            counters.list_items,
            counters.occupied_voxels
        );
        let repeats: u32 = self.reports.iter().map(|r| r.repeats).sum();
        if repeats > 0 {
            say!("buffers were too small and grew; frames repeated for it {repeats}");
        }
    }

    /// The table, the JSON and the trace, as far as they were asked for.
    fn report(&self, args: &RenderArgs) -> anyhow::Result<()> {
        let mut timings = Timings::new(self.job.warm_up as usize);
        self.reports.iter().for_each(|frame| timings.push(frame.timings.clone()));
        if args.timings {
            out::write(&timings.table());
        }
        if let Some(path) = &args.trace {
            let trace = chrome_trace(&self.context.name, timings.frames()).to_string();
            file::write(path, trace.as_bytes())?;
        }
        if let Some(path) = &args.json {
            let memory = report::memory(&self.renderer.plan(), self.context.allocated_bytes(), self.budget_bytes);
            let counters = report::counters(&self.reports);
            let report = RenderReport {
                scene: self.scene.clone(),
                method: self.job.settings.method.name(),
                settings: &self.job.settings,
                exposure_ev: self.exposure_ev,
                timings: timings.report(self.context, self.size, counters, Some(memory)),
            };
            report.write(path)?;
        }
        Ok(())
    }
}

/// Pixels that are no numbers are a fault of the program, and hard to see.
fn warn_of_non_finite(image: &Layers) {
    let broken = image.beauty().iter().filter(|p| !p.iter().all(|c| c.is_finite())).count();
    if broken > 0 {
        out::complain(&format!("warning: {broken} pixels are not finite"));
    }
}

/// What an .exr says about how it came about. No dates: the same command gives the same bytes.
fn header(args: &RenderArgs, job: &RenderJob, opened: &Opened, context: &Context) -> Metadata {
    let entries = [
        ("writer", format!("twobounce {} render", env!("CARGO_PKG_VERSION"))),
        ("scene", opened.scene.name.clone()),
        ("sceneHash", opened.scene.hash.clone()),
        ("camera", opened.camera.clone()),
        ("time", args.scene.time.to_string()),
        ("sky", opened.scene.sky.to_string()),
        ("method", job.settings.method.name().to_owned()),
        ("settings", job.settings.to_toml()),
        ("device", context.name.clone()),
        ("driver", context.driver.clone()),
    ];
    entries.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
}
