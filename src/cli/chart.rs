//! `twobounce chart`: many settings on some scenes, and the page, the SVG and the rows that show what each is worth.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use clap::Args;
use twobounce::chart::export::{Chart, SceneLine};
use twobounce::chart::measure::Subject;
use twobounce::chart::page;
use twobounce::chart::plan::{Axis, Base, Trial, trials};
use twobounce::chart::row::{Metric, Part, Truth};
use twobounce::chart::store::{Store, Stored};
use twobounce::chart::svg::{self, Panel};
use twobounce::output::file;
use twobounce::settings::PRESETS;
use twobounce::vk::Context;
use twobounce::{Error, Result};

use super::args::{DeviceArgs, SceneArgs, SettingsArgs, memory_size};
use super::bench::{self, Bench, End};
use super::reference::check_memory;
use super::{Outcome, interrupt, out};
use crate::say;

/// Every preset runs by itself, then every value of every --sweep on top of every preset, one sweep at a time. Each row is
/// kept as soon as it is finished: after an interruption the same command goes on.
#[derive(Args, Debug)]
#[command(mut_arg("size", |arg| arg.default_value("256x256")))]
pub struct ChartArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Further scenes, looked at in the same way
    #[arg(value_name = "SCENE")]
    pub more: Vec<PathBuf>,
    /// The folder to write into: a new one, an empty one, or one of an earlier chart
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// The presets to run, separated by commas [default: all]
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    pub presets: Vec<String>,
    /// Run these values of a setting on top of every preset; may be given several times
    #[arg(long = "sweep", value_name = "KEY=VALUE,…")]
    pub sweeps: Vec<String>,
    /// In every preset, take the keys of this TOML file first
    #[arg(long, value_name = "FILE.toml")]
    pub config: Option<PathBuf>,
    /// In every preset, set this key first; may be given several times
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub sets: Vec<String>,
    /// Stop after so many minutes of measuring, references not counted; the same command goes on later
    #[arg(long, value_name = "M")]
    pub budget_minutes: Option<f64>,
    /// Root mean square of the references' relative error; `reference --noise` makes the same ones
    #[arg(long, value_name = "PERCENT", default_value_t = 1.0)]
    pub reference_noise: f64,
    /// Refuse to take more device memory than this: such a setting becomes a row that says so
    #[arg(long, value_name = "SIZE", value_parser = memory_size)]
    pub memory_limit: Option<u64>,
    #[command(flatten)]
    pub device: DeviceArgs,
}

/// Measures what is missing and writes the chart anew.
pub fn run(args: &ChartArgs) -> anyhow::Result<Outcome> {
    let trials = args.trials()?;
    let budget = args.budget()?;
    let noise = noise(args.reference_noise)?;
    args.scene.check()?;
    check_memory(args.scene.size)?;
    let store = Store::open(&args.output)?;
    let mut subjects = bench::open(&args.scene, &args.more, args.memory_limit)?;
    let context = args.device.open(args.scene.size.0, args.scene.size.1)?;
    interrupt::install()?;
    let bench = Bench { store: &store, trials: &trials, device: &args.device, noise, budget };
    bench.references(&mut subjects)?;
    let about = About::new(&context, args.scene.size, noise);
    let start = Instant::now();
    let (stored, end) = bench.rows(&subjects, context)?;
    if stored.is_empty() && end == End::OutOfTime {
        let spent = start.elapsed().as_secs_f64() / 60.0;
        let text = format!(
            "--budget-minutes {}: too small for one run; after {spent:.2} minutes the first row was not finished",
            args.budget_minutes.unwrap_or_default()
        );
        return Err(Error::Usage(text).into());
    }
    if !stored.is_empty() {
        write(&store, &about.chart(&subjects, &stored, trials.len() * subjects.len()), &subjects, &stored)?;
        say!("wrote {}", store.path("index.html").display());
    }
    tell(end, &stored, trials.len() * subjects.len())?;
    Ok(Outcome::Done)
}

/// A percentage as a share.
pub fn noise(percent: f64) -> Result<f64> {
    if percent > 0.0 && percent.is_finite() {
        return Ok(percent / 100.0);
    }
    Err(Error::Usage("--reference-noise takes a percentage above 0".to_owned()))
}

/// Says what is missing, and why.
pub fn tell(end: End, stored: &[Stored], planned: usize) -> Result<()> {
    let failed = stored.iter().filter(|s| s.row.measured.is_none()).count();
    if failed > 0 {
        say!("settings that could not run: {failed} of {planned}; their rows say why");
    }
    let there = stored.len();
    match end {
        End::Done => Ok(()),
        End::OutOfTime => {
            say!("the budget is spent after {there} of {planned} rows; the same command goes on from there");
            Ok(())
        }
        End::Interrupted => {
            out::complain(&format!("{there} of {planned} rows are kept; the same command goes on from there"));
            Err(Error::Interrupted)
        }
    }
}

impl ChartArgs {
    fn trials(&self) -> Result<Vec<Trial>> {
        let all = || PRESETS.iter().map(|preset| preset.name.to_owned()).collect();
        let presets: Vec<String> = if self.presets.is_empty() { all() } else { self.presets.clone() };
        let base = |preset: String| {
            let (config, sets) = (self.config.clone(), self.sets.clone());
            let settings = SettingsArgs { preset: preset.clone(), config, sets }.effective()?;
            Ok(Base { preset, settings })
        };
        let bases: Vec<Base> = presets.into_iter().map(base).collect::<Result<_>>()?;
        let swept = |e: Error| Error::Usage(format!("--sweep: {e}"));
        let axes: Vec<Axis> = self.sweeps.iter().map(|text| Axis::parse(text)).collect::<Result<_>>().map_err(swept)?;
        trials(&bases, &axes).map_err(swept)
    }

    fn budget(&self) -> Result<Option<Duration>> {
        let wrong = || Error::Usage("--budget-minutes takes a number of minutes above 0".to_owned());
        let seconds = self.budget_minutes.map(|minutes| 60.0 * minutes);
        seconds.map(|s| Duration::try_from_secs_f64(s).ok().filter(|d| !d.is_zero()).ok_or_else(wrong)).transpose()
    }
}

/// What all rows of a chart have in common.
pub struct About {
    /// The device's name and its driver's.
    pub context: (String, String),
    pub size: (u32, u32),
    pub noise: f64,
}

impl About {
    pub fn new(context: &Context, size: (u32, u32), noise: f64) -> Self {
        Self { context: (context.name.clone(), context.driver.clone()), size, noise }
    }

    /// The chart of `stored`; `planned`: rows that there should be.
    pub fn chart(&self, subjects: &[Subject], stored: &[Stored], planned: usize) -> Chart {
        let line = |subject: &Subject| SceneLine {
            name: subject.name.clone(),
            hash: subject.scene.hash.clone(),
            triangles: subject.scene.triangle_count(),
            camera: subject.camera.clone(),
        };
        let (version, program) = Chart::VERSIONS;
        let (device, driver) = self.context.clone();
        Chart {
            version,
            program,
            device,
            driver,
            width: self.size.0,
            height: self.size.1,
            reference_noise: self.noise,
            scenes: subjects.iter().map(line).collect(),
            planned,
            rows: stored.iter().map(|s| s.row.clone()).collect(),
        }
    }
}

/// Writes the page, the SVG and the rows.
pub fn write(store: &Store, chart: &Chart, subjects: &[Subject], stored: &[Stored]) -> anyhow::Result<()> {
    file::write(&store.path("rows.json"), chart.json()?.as_bytes())?;
    file::write(&store.path("rows.csv"), chart.csv().as_bytes())?;
    file::write(&store.path("chart.svg"), svg::chart(&panels(chart), 2).as_bytes())?;
    file::write(&store.path("index.html"), page::html(chart, subjects, stored)?.as_bytes())?;
    Ok(())
}

/// Two panels a scene: `rel` of the indirect light, against all of it and against that of as many bounces.
fn panels(chart: &Chart) -> Vec<Panel<'_>> {
    let truths = [(Truth::Full, "all light"), (Truth::Same, "as many bounces")];
    let panel = |name: &str, (truth, words): (Truth, &str)| Panel {
        title: format!("{name}, against {words}"),
        rows: chart.rows.iter().filter(|row| row.scene == name).collect(),
        truth,
        part: Part::Indirect,
        metric: Metric::Rel,
    };
    chart.scenes.iter().flat_map(|scene| truths.map(|truth| panel(&scene.name, truth))).collect()
}
