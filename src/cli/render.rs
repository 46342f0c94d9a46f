//! `twobounce render`: from a checked command line to images and reports.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

use clap::Args;
use twobounce::layers::{Aov, Layers};
use twobounce::measure::refuse_invalid;
use twobounce::measure::timing::Timings;
use twobounce::measure::trace::chrome_trace;
use twobounce::memory::mib;
use twobounce::output::display::Display;
use twobounce::output::exr::Metadata;
use twobounce::output::file;
use twobounce::output::picture::ImageKind;
use twobounce::profile::{Run, WARM_UP};
use twobounce::renderer::{FrameReport, RenderOptions, Renderer};
use twobounce::scene::{Pose, Still, View};
use twobounce::settings::{Bounces, Settings};
use twobounce::stage::{Event, Refinement, Shot, image_header, is_scarce, known_limits, why_blank, with_alpha};
use twobounce::vk::Context;
use twobounce::{Error, Result};

use super::args::{Frames, RunArgs, SceneArgs, SettingsArgs, aov, frames, number};
use super::display::DisplayArgs;
use super::outputs::{self, ImageFiles};
use super::progress::{FrameProgress, Work};
use super::refine::RefineArgs;
use super::report::{self, RenderReport};
use super::scene::{fitted, run_options, warn};
use super::share::{self, Parts};
use super::{interrupt, out};
use crate::say;

#[derive(Args, Debug)]
pub struct RenderArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// The image to write: .png (exposed, tone-mapped) or .exr (linear radiance); - is standard output, a .png or, with
    /// --aov, an .exr
    #[arg(short, long, value_name = "OUT.png|OUT.exr")]
    pub output: PathBuf,
    #[command(flatten)]
    pub settings: SettingsArgs,
    /// Further layers of an .exr, separated by commas
    #[arg(long, value_name = "LAYER,…", value_delimiter = ',', value_parser = aov())]
    pub aov: Vec<Aov>,
    /// Make pixels without a surface transparent; the sky still lights the scene
    #[arg(long)]
    pub transparent: bool,
    #[command(flatten)]
    pub display: DisplayArgs,
    /// After a warm-up, render the same image N times from scratch, time each, and write the last one
    #[arg(long, value_name = "N", default_value_t = 1, conflicts_with = "frames", value_parser = clap::value_parser!(u32).range(1..))]
    pub repeat: u32,
    /// With --repeat, reuse unchanged work of the last frame, as an animation does
    #[arg(long)]
    pub still: bool,
    /// Render N frames of the animation, or the frames with these numbers, from 0 on, every STEP-th; the output is a
    /// pattern such as out_%04d.png
    #[arg(long, value_name = "N|A-B[:STEP]", value_parser = frames)]
    pub frames: Option<Frames>,
    /// Print the N commands that share the frames, one per line, and render nothing
    #[arg(long, value_name = "N", requires = "frames", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub list: Option<u32>,
    /// Frames per second for --frames
    #[arg(long, value_name = "F", requires = "frames", default_value_t = 30.0, allow_negative_numbers = true)]
    #[arg(value_parser = number(|n| n > 0.0, "write frames per second, finite and above 0"))]
    pub fps: f64,
    /// The speed of the animation with --frames; negative values play it backward
    #[arg(long, value_name = "FACTOR", requires = "frames", default_value_t = 1.0, allow_negative_numbers = true)]
    #[arg(value_parser = number(|n| n != 0.0, "write a factor, finite and not 0"))]
    pub speed: f64,
    #[command(flatten)]
    pub refine: RefineArgs,
    /// Print the time of each pass, the memory and the counters
    #[arg(long)]
    pub timings: bool,
    /// Print the memory and the counters, and name passes in the progress
    #[arg(short, long)]
    pub verbose: bool,
    /// Print only notes and errors
    #[arg(short, long, conflicts_with_all = ["verbose", "timings"])]
    pub quiet: bool,
    /// Write timings, counters and memory as JSON; - is standard output
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Write a Chrome trace, for Perfetto
    #[arg(long, value_name = "FILE")]
    pub trace: Option<PathBuf>,
    #[command(flatten)]
    pub run: RunArgs,
}

/// Renders as the arguments request.
pub fn run(args: &RenderArgs) -> anyhow::Result<ExitCode> {
    let began = Instant::now();
    out::be_quiet(args.quiet);
    out::be_verbose(args.verbose || args.timings);
    let settings = args.settings.effective()?;
    args.scene.check()?;
    let files = image_files(args)?;
    refuse_dependent_frames(args, &settings)?;
    if let (Some(frames), Some(count)) = (args.frames, args.list) {
        return list(frames, count);
    }
    let image = files.path(args.frames.map_or(0, |frames| frames.first));
    let inputs = [Some(&args.scene.path), args.settings.config.as_ref(), args.scene.sky_map()];
    outputs::check(&inputs, &[Some(&image), args.json.as_ref(), args.trace.as_ref()])?;
    interrupt::install()?;
    let (mut opened, context) = args.scene.open_on(&args.run)?;
    let timed = args.timings || args.json.is_some() || args.trace.is_some() || args.repeat > 1;
    let still = !timed && args.frames.is_none();
    let scarce = is_scarce(opened.size, args.run.memory_limit);
    let refine = args.refine.refine();
    let chosen = args.settings.choose_resolution(&settings)?;
    let settings = fitted(&opened, refine.fitted(settings, chosen, still, scarce));
    opened.scene.sky_unseen = args.transparent;
    let header = image_header(&opened, &settings, &context);
    let budget_bytes = context.memory_budget();
    let mut report = RenderReport::new(&opened, &settings, &context);
    report.exposure_ev = args.display.exposure_ev();
    report.tonemap = (files.kind != ImageKind::Exr).then(|| args.display.tone());
    let options = RenderOptions { aovs: with_alpha(&args.aov), ..run_options(&opened, &args.run) };
    let (pose, _) = &opened.still;
    known_limits(&opened, &settings).iter().for_each(|note| warn(&opened, note));
    let doing = context.compiled_anew().map_or("preparing", |_| "compiling shaders, once");
    let work = Work::begin(&format!("{}: {doing}", opened.scene.name));
    let renderer = Renderer::new(&context, opened.scene, pose, settings.clone(), options)?;
    report::say_compiled(&context);
    let warm_up = if timed { WARM_UP } else { 0 };
    let timings = Timings::new(warm_up as usize);
    let shot = opened.shot;
    let frames = FrameProgress::new(work, warm_up + args.frames.map_or(args.repeat, Frames::count));
    let context = &context;
    let mut session =
        Session { args, files, context, renderer, settings, shot, header, report, timings, frames, refinement: None };
    if args.timings || args.verbose {
        say!("memory plan:\n{}", session.renderer.plan());
        say!("  {:<24} {:>10.2} MiB", "allocated by the driver", mib(context.allocated_bytes()));
        say!("  {:<24} {:>10.2} MiB", "the device's budget", mib(budget_bytes));
    }
    (0..warm_up).try_for_each(|_| session.frame(0.0))?;
    // Warm-up frames are not refined.
    session.refinement = Refinement::new(&refine, still, &session.settings, began)
        .map(|refinement| refinement.of_file(args.scene.path.display().to_string()));
    session.frames.refined = session.refinement.is_some();
    let limit = args.refine.time_limit.filter(|_| session.frames.refined);
    session.frames.until = limit.and_then(|limit| began.checked_add(limit));
    match args.frames {
        Some(frames) => {
            session.choose_exposure(frames)?;
            frames.numbers().try_for_each(|frame| {
                let later_s = f64::from(frame) * (1.0 / args.fps) * args.speed;
                session.frame(later_s)?;
                session.write(frame, later_s)
            })?;
        }
        None => {
            (0..args.repeat).try_for_each(|_| session.frame(0.0))?;
            session.write(0, 0.0)?;
        }
    }
    session.finish()?;
    Ok(ExitCode::SUCCESS)
}

/// The image files; checks flags that depend on the kind of image.
fn image_files(args: &RenderArgs) -> Result<ImageFiles> {
    let standard = file::is_standard(&args.output) && args.frames.is_none();
    let files = if standard {
        ImageFiles::standard(if args.aov.is_empty() { ImageKind::Png } else { ImageKind::Exr })
    } else {
        ImageFiles::named(&args.output, args.frames.is_some())?
    };
    if files.kind != ImageKind::Exr && !args.aov.is_empty() {
        return Err(Error::Usage("--aov adds layers to an .exr; name one with -o".into()));
    }
    args.display.check(files.kind, args.transparent)?;
    Ok(files)
}

/// Refuses a part of a sequence whose frames depend on earlier ones, because its bits would differ.
fn refuse_dependent_frames(args: &RenderArgs, settings: &Settings) -> Result<()> {
    let is_part = args.list.is_some() || args.frames.is_some_and(|frames| frames.first > 0 || frames.step > 1);
    if is_part && settings.bounces == Bounces::All {
        return Err(Error::Usage(
            "--frames: with bounces = all each frame goes on from the one before it, so that a part would have other images; render all \
             from frame 0 on, or set another value"
                .into(),
        ));
    }
    Ok(())
}

/// Prints the commands that share the frames. Each has successive frames, which reuse unchanged work.
fn list(frames: Frames, count: u32) -> anyhow::Result<ExitCode> {
    let numbers: Vec<u32> = frames.numbers().collect();
    let part = |part: std::ops::Range<u32>| {
        let (first, last) = (numbers[part.start as usize], numbers[part.end as usize - 1]);
        Frames { first, last, ..frames }.to_string()
    };
    let parts: Vec<String> = share::chunks(frames.count(), count).map(part).collect();
    Parts { flag: "--frames", outputs: &[], ending: "" }.list(&parts, None);
    Ok(ExitCode::SUCCESS)
}

/// A render in progress.
struct Session<'a> {
    args: &'a RenderArgs,
    files: ImageFiles,
    context: &'a Arc<Context>,
    renderer: Renderer,
    settings: Settings,
    shot: Shot,
    header: Metadata,
    /// The report. Its exposure is the requested one, or the one that the first image chooses for all.
    report: RenderReport,
    timings: Timings,
    frames: FrameProgress,
    refinement: Option<Refinement>,
}

impl Session<'_> {
    fn frame(&mut self, later_s: f64) -> Result<()> {
        interrupt::check()?;
        self.frames.begin(&self.renderer.scene().name, self.renderer.bands());
        // An animation reuses unchanged work; otherwise each frame is rendered from scratch to be timed.
        if !self.args.still && self.args.frames.is_none() {
            self.renderer.make_anew();
        }
        let (pose, view) = self.shot.at(self.renderer.scene(), later_s);
        let report = self.made(&pose, &view)?;
        self.timings.push(report);
        self.frames.finish();
        interrupt::check()
    }

    /// Renders the image and refines it if requested, and prints its noise.
    fn made(&mut self, pose: &Pose, view: &View) -> Result<FrameReport> {
        let Some(refinement) = &mut self.refinement else { return self.renderer.render(pose, view) };
        let frames = &self.frames;
        let mut tell = |renderer: &Renderer, event: Event| {
            let name = &renderer.scene().name;
            match event {
                Event::Note(words) => out::warn(&format!("note: {name}: {words}")),
                Event::Pass { has, needed } => frames.adds_a_pass(name, renderer.bands().0, has, needed),
            }
            interrupt::check()
        };
        let report = refinement.run(&mut self.renderer, pose, view, &mut tell)?;
        self.settings.image.passes = self.renderer.passes();
        let (words, is_short) = refinement.result();
        if is_short {
            out::warn(&format!("note: {}: {words}", self.renderer.scene().name));
        } else {
            say!("{words}");
        }
        Ok(report)
    }

    /// Frame 0 chooses the exposure of every frame, also if only others are rendered.
    fn choose_exposure(&mut self, frames: Frames) -> Result<()> {
        if frames.first == 0 || self.files.kind == ImageKind::Exr || self.report.exposure_ev.is_some() {
            return Ok(());
        }
        let (pose, view) = self.shot.at(self.renderer.scene(), 0.0);
        self.renderer.render(&pose, &view)?;
        let image = self.renderer.read();
        self.display(&image);
        interrupt::check()
    }

    /// The display of images: with the requested exposure, or with the one that the first image chooses for all.
    fn display(&mut self, image: &Layers) -> Display {
        let args = &self.args.display;
        let ev = self.report.exposure_ev.get_or_insert_with(|| args.display(image).exposure_ev);
        Display { tone: args.tone(), exposure_ev: *ev }
    }

    /// Writes the last frame as number `frame`, `later_s` seconds after --time.
    fn write(&mut self, frame: u32, later_s: f64) -> Result<()> {
        refuse_invalid(self.context)?;
        let path = self.files.path(frame);
        let mut image = self.renderer.read();
        // Non-finite values are a fault of the program, and hard to see.
        let broken = image.beauty().iter().filter(|p| !p.iter().all(|c| c.is_finite())).count();
        if broken > 0 {
            out::warn(&format!("warning: {broken} pixels are not finite"));
        }
        let (pose, view) = self.shot.at(self.renderer.scene(), later_s);
        let display = (self.files.kind != ImageKind::Exr).then(|| self.display(&image));
        let scene = self.renderer.scene();
        if frame == self.args.frames.map_or(0, |frames| frames.first) {
            let exposed = display.map(|display| (display, self.args.display.exposure.is_none()));
            let why = why_blank(&image, Still::new(scene, &pose, &view), exposed);
            why.iter().for_each(|why| out::warn(&format!("note: {}: {why}", scene.name)));
        }
        if !self.args.transparent {
            image.layers.retain(|(layer, _)| *layer != Aov::Alpha);
        }
        if let Some(display) = display {
            image.write_shown(&path, display)?;
        } else {
            self.header.insert("time".into(), self.shot.time_s(later_s).to_string());
            self.header.insert("settings".into(), self.settings.to_toml());
            image.write_exr(&path, &self.header)?;
        }
        say!("wrote {}", out::name(&path));
        Ok(())
    }

    /// Writes the counters, the table, the JSON and the trace as requested.
    fn finish(mut self) -> Result<()> {
        if self.args.timings || self.args.verbose {
            out::write(&report::counters_text(&self.timings));
        }
        let noise = self.timings.all().last().and_then(|frame| frame.noise);
        if let (None, Some(noise)) = (&self.refinement, noise) {
            say!("noise of the image, by its passes: {:.2} %", 100.0 * noise);
        }
        if self.args.timings {
            out::write(&self.timings.table());
        }
        if let Some(path) = &self.args.trace {
            let trace = chrome_trace(&self.context.name, self.timings.frames()).to_string();
            file::write(path, trace.as_bytes())?;
        }
        if let Some(path) = &self.args.json {
            let (plan, allocated_bytes) = (self.renderer.plan(), self.context.allocated_bytes());
            self.report.settings = self.settings;
            self.report.add(&Run { timings: self.timings, plan, allocated_bytes });
            file::write_json(path, &self.report)?;
        }
        Ok(())
    }
}
