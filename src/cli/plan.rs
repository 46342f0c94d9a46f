//! `twobounce plan`: finds the cheapest settings within limits by measuring.

use std::cell::RefCell;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use clap::{Args, Command};
use glam::DQuat;
use twobounce::gi::Method;
use twobounce::lab::store::{Results, device_words};
use twobounce::measure::metrics::Part;
use twobounce::output::file;
use twobounce::plan::VERSION;
use twobounce::plan::answer::Answer;
use twobounce::plan::ask::{self, Question};
use twobounce::plan::bench::{Bench, PlanView, Setup};
use twobounce::plan::limits::Limits;
use twobounce::reference::Options;
use twobounce::scene::Projection;
use twobounce::stage::{Staged, check_film};
use twobounce::{Error, Result};

use super::args::{DeviceArgs, RunArgs, SceneArgs, budget, memory_size, named, number};
use super::progress::Work;
use super::reference::{cache, traced};
use super::scene::options;
use super::{interrupt, out, outputs, words};
use crate::say;

/// Measures presets, single steps of their settings and promising combinations, times the best in turns, and checks the
/// winner at other views. Measurements are kept with the references: a repeated command answers at once, and an
/// interrupted one continues. If no settings hold the limits, prints the nearest ones and exits with 1.
#[derive(Args, Debug)]
#[command(mut_arg("time", |arg| arg.long("first-time").hide(true)))]
#[command(mut_arg("camera", |arg| arg.value_name("NAME|INDEX,…").help("The file's cameras to look through, separated by commas; by default its first, or one that frames the scene")))]
pub struct PlanArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// The times within the animation, in seconds, separated by commas
    #[arg(
        long = "time",
        value_name = "SECONDS,…",
        value_delimiter = ',',
        allow_negative_numbers = true,
        default_value = "0"
    )]
    #[arg(value_parser = number(|n| n >= 0.0, "write seconds, finite and at least 0"))]
    pub times: Vec<f64>,
    /// The maximum error: mean |image − reference| over the reference's mean, against all light (0.1 is a tenth)
    #[arg(long, value_name = "X", value_parser = number(|x| x > 0.0, "write an error above 0, such as 0.1"))]
    pub max_error: Option<f64>,
    /// The maximum device time of a frame from scratch in milliseconds
    #[arg(long, value_name = "MS", value_parser = number(|x| x > 0.0, "write milliseconds above 0"))]
    pub max_ms: Option<f64>,
    /// The maximum device memory in MiB
    #[arg(long, value_name = "MIB", value_parser = number(|x| x > 0.0 && x < 1e12, "write MiB above 0"))]
    pub max_mib: Option<f64>,
    /// The light whose error counts: the whole image, the indirect light, or that on diffuse surfaces
    #[arg(long, value_name = "PART", default_value = "whole", value_parser = named(Part::ALL, Part::name))]
    pub error_of: Part,
    /// The time for the search including references and checks: 90s, 5min, 1h. It ends earlier if no further
    /// measurement is promising
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = budget)]
    pub budget: Duration,
    /// Only try these methods, separated by commas [default: all]
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    #[arg(value_parser = named(Method::ALL, Method::name))]
    pub methods: Vec<Method>,
    /// Fix this setting; may be given several times
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub sets: Vec<String>,
    /// Write the settings to a file for --config; - is standard output
    #[arg(short, long, value_name = "FILE.toml")]
    pub output: Option<PathBuf>,
    /// Write the answer as JSON; - is standard output
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Repeat the measurements of earlier calls
    #[arg(long)]
    pub anew: bool,
    /// The maximum device memory while measuring
    #[arg(long, value_name = "SIZE", value_parser = memory_size)]
    pub memory_limit: Option<u64>,
    /// Print only notes and errors
    #[arg(short, long)]
    pub quiet: bool,
    #[command(flatten)]
    pub device: DeviceArgs,
}

/// Answers from stored measurements or by measuring. `typed` holds the words after `twobounce plan`.
pub fn run(args: &PlanArgs, typed: Vec<String>) -> anyhow::Result<ExitCode> {
    out::be_quiet(args.quiet);
    let limits = args.limits()?;
    args.scene.check()?;
    outputs::check(&[Some(&args.scene.path), args.scene.sky_map()], &[args.output.as_ref(), args.json.as_ref()])?;
    interrupt::install()?;
    check_film(ask::error_size(args.scene.size))?;
    let (cameras, first) = (args.scene.camera.clone(), SceneArgs { camera: None, ..args.scene.clone() });
    let opened = first.open()?;
    let views = args.views(&opened, cameras.as_deref())?;
    let held_out = args.held_out(&opened, &views)?;
    let context = args.device.open(args.scene.size)?;
    let cache = cache();
    let about = format!("{VERSION} {} {}", device_words(&context), args.device.validation);
    let store = Results::new(cache.folder().map(|folder| folder.join("plan")), &about, args.anew)?;
    // The path tracer shows its own progress.
    let work: RefCell<Option<Work>> = RefCell::default();
    let trace = |seen: &PlanView, options: &Options| {
        work.take();
        let film = traced(&cache, seen.still(&opened.scene), options)?.0;
        work.replace(Some(Work::begin("plan")));
        Ok(film)
    };
    let is_at = |text: String| {
        if let Some(work) = &*work.borrow() {
            work.is_at(format!("plan: {text}"), None);
        }
    };
    let bench = Bench::new(Setup {
        context: &context,
        scene: &opened.scene,
        options: options(&opened, args.memory_limit),
        size: ask::error_size(args.scene.size),
        part: args.error_of,
        store: &store,
        trace: &trace,
        is_at: &is_at,
    });
    let is_tried = |method: &&Method| args.methods.is_empty() || args.methods.contains(method);
    let question = Question {
        views,
        held_out,
        limits,
        methods: Method::ALL.iter().filter(is_tried).copied().collect(),
        fixed: args.sets.clone(),
        budget: args.budget,
    };
    let key = ask::key(&question, &bench);
    let kept: Option<Answer> = store.load(&key);
    if kept.is_some() {
        out::warn("note: this was asked before: the answer of then (--anew measures again)");
    }
    let ask = || ask::ask(&question, bench).inspect(|answer| store.save(&key, answer));
    let asked = kept.map_or_else(ask, Ok).inspect_err(|error| {
        if matches!(error, Error::Interrupted) && store.keeps() {
            out::warn("what was measured is kept; the same command goes on from there");
        }
    });
    work.take();
    let mut answer = asked?;
    answer.commands = question.views.iter().map(|seen| args.command(&typed, &seen.flags, &answer)).collect();
    out::write(&answer.text());
    if let Some(path) = &args.output {
        let Answer { scene, width, height, device, choice, error_of, .. } = &answer;
        let (ms, error) = (choice.ms.median, choice.error);
        let about = format!("{scene}, {width}x{height}, {device}: {ms:.1} ms a frame, error {error:.4} of {error_of}");
        file::write(path, format!("# twobounce plan: {about}\n{}", choice.settings.to_toml()).as_bytes())?;
        say!("\nwrote {}", out::name(path));
    }
    if let Some(path) = &args.json {
        file::write_json(path, &answer)?;
    }
    Ok(ExitCode::from(u8::from(!answer.holds)))
}

impl PlanArgs {
    fn limits(&self) -> Result<Limits> {
        let (error, ms) = (self.max_error, self.max_ms);
        let bytes = self.max_mib.map(|mib| (mib * f64::from(1 << 20)) as u64);
        if error.is_none() && ms.is_none() && bytes.is_none() {
            let text = "plan needs a limit: --max-error X, --max-ms MS or --max-mib MIB, or several of them";
            return Err(Error::Usage(text.into()));
        }
        Ok(Limits { error, ms, bytes })
    }

    /// Every camera at every time.
    fn views(&self, opened: &Staged, cameras: Option<&str>) -> Result<Vec<PlanView>> {
        let cameras: Vec<Option<&str>> = match cameras {
            None => vec![None],
            // A name may contain a comma.
            Some(name) if opened.scene.camera_named(name).is_ok() => vec![Some(name)],
            Some(names) => names.split(',').map(|name| Some(name.trim())).collect(),
        };
        let moments = cameras.iter().flat_map(|camera| self.times.iter().map(move |time| (*camera, *time)));
        moments.map(|(camera, time)| self.view(opened, camera, time)).collect()
    }

    fn view(&self, opened: &Staged, camera: Option<&str>, time: f64) -> Result<PlanView> {
        let args = SceneArgs { camera: camera.map(str::to_owned), time, ..self.scene.clone() };
        let (pose, view, _) = opened.seen(&args.stage())?;
        let camera = camera.map(|name| format!("--camera={name}"));
        let moment = (time != 0.0).then(|| format!("--time={time}"));
        let flags: Vec<String> = camera.into_iter().chain(moment).collect();
        let words = if flags.is_empty() { "the view".to_owned() } else { flags.join(" ") };
        Ok(PlanView { words, flags, pose, view })
    }

    /// Two further views: another camera of the file and another time, or the first view rotated.
    fn held_out(&self, opened: &Staged, asked: &[PlanView]) -> Result<Vec<PlanView>> {
        let first = &asked[0];
        let mut views = Vec::new();
        let seen = |seen: &PlanView| format!("{:?}", (seen.view.eye, seen.view.forward));
        let known: Vec<String> = asked.iter().map(seen).collect();
        for index in (0..opened.scene.cameras.len()).filter(|_| self.scene.eye.is_none()) {
            let other = self.view(opened, Some(&index.to_string()), self.times[0])?;
            if !known.contains(&seen(&other)) && views.is_empty() {
                views.push(other);
            }
        }
        if opened.duration_s() > 0.0 {
            let last = self.times.iter().copied().fold(0.0, f64::max);
            let time = if last > 0.0 { 0.5 * (self.times[0] + last) } else { 0.5 * opened.duration_s() };
            if !self.times.contains(&time) {
                views.push(PlanView {
                    view: first.view,
                    words: format!("--time={time}"),
                    ..self.view(opened, None, time)?
                });
            }
        }
        for degrees in [15.0f64, -15.0] {
            if views.len() < 2 && matches!(first.view.projection, Projection::Perspective { .. }) {
                let mut aside = first.clone();
                aside.view.forward = DQuat::from_axis_angle(first.view.up, degrees.to_radians()) * first.view.forward;
                aside.words = format!("the first view turned by {degrees}°");
                views.push(aside);
            }
        }
        Ok(views)
    }

    /// The `twobounce render` command of a view for a shell.
    fn command(&self, typed: &[String], flags: &[String], answer: &Answer) -> String {
        let own = Self::augment_args(Command::new(""));
        let of_both = RunArgs::augment_args(SceneArgs::augment_args(Command::new("")));
        let mut command = ["twobounce", "render", &self.scene.path.display().to_string()].map(str::to_owned).to_vec();
        // Other flags belong to the search, or are part of the answer.
        command.extend(words::kept(typed, &own, &of_both, &["--camera", "--time", "--size"]));
        command.push(format!("--size={}x{}", answer.width, answer.height));
        command.extend(flags.iter().cloned());
        command.extend(answer.choice.flags());
        command.extend(["--noise=off", "-o", "image.png"].map(str::to_owned));
        words::line(&command)
    }
}
