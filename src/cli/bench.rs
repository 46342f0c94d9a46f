//! What `chart` and `study` share: they open scenes, make references, measure and keep missing rows, and write a folder.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use twobounce::chart::VERSION;
use twobounce::chart::export::Chart;
use twobounce::chart::measure::{ChartScene, ReferenceImage, same_depth};
use twobounce::chart::plan::Trial;
use twobounce::chart::row::Row;
use twobounce::chart::store::{CHART, Keys, Store, Stored};
use twobounce::layers::Aov;
use twobounce::output::file;
use twobounce::reference::cache::Cache;
use twobounce::reference::{Depth, Stop};
use twobounce::vk::Context;
use twobounce::{Error, Result};

use super::args::{DeviceArgs, SceneArgs, memory_size, minutes, percent};
use super::progress::RowProgress;
use super::reference::{cache, check_memory, traced};
use super::report::say_compiled;
use super::{interrupt, out};
use crate::say;

/// How often pages are written while rows are measured, at most.
const PAGES_EVERY: Duration = Duration::from_secs(10);

/// How rows are measured.
#[derive(clap::Args, Debug)]
pub struct BenchArgs {
    /// Stop after this many minutes of measuring, references not counted; the same command continues later
    #[arg(long, value_name = "M", value_parser = minutes)]
    pub budget_minutes: Option<Duration>,
    /// Root mean square of the references' relative error; `reference --noise` makes the same ones
    #[arg(long, value_name = "PERCENT", default_value = "1", value_parser = percent)]
    pub reference_noise: f64,
    /// Use no more device memory than this; a setting that needs more becomes a row that says so
    #[arg(long, value_name = "SIZE", value_parser = memory_size)]
    pub memory_limit: Option<u64>,
    /// Keep rows that another build of the program measured; without this they are measured again
    #[arg(long)]
    pub any_build: bool,
    /// Print nothing but notes and errors
    #[arg(short, long)]
    pub quiet: bool,
    #[command(flatten)]
    pub device: DeviceArgs,
}

/// Which settings on which scenes, and the folder that keeps them.
pub struct Bench<'a> {
    /// How the scenes are looked at.
    pub scene: &'a SceneArgs,
    pub paths: Vec<PathBuf>,
    pub trials: Vec<Trial>,
    pub folder: &'a Path,
    pub args: &'a BenchArgs,
}

/// A row of the chart, to be made or already there.
struct PlannedRow<'a> {
    scene: &'a ChartScene,
    trial: &'a Trial,
    /// As it is called in this chart, without a result.
    row: Row,
    stored: Option<Stored>,
}

impl Bench<'_> {
    /// Measures the missing rows and writes the folder's files; says what is still missing. `further` writes a page of its own from
    /// the chart, as often as the others are written, and says where.
    pub fn run(&self, further: impl Fn(&Chart) -> Result<Option<PathBuf>>) -> anyhow::Result<ExitCode> {
        out::be_quiet(self.args.quiet);
        self.scene.check()?;
        interrupt::install()?;
        check_memory(self.scene.size)?;
        let store = Store::open(CHART, self.folder, self.args.any_build)?;
        let mut scenes = self.open()?;
        let context = self.args.device.open(self.scene.size)?;
        let device = [context.name.clone(), context.driver.clone()];
        self.references(&mut scenes)?;
        let keys = Keys::new(&context, self.args.device.validation, self.args.reference_noise);
        let pairs = self.trials.iter().flat_map(|trial| scenes.iter().map(move |scene| (scene, trial)));
        let mut rows: Vec<_> = pairs.map(|(scene, trial)| PlannedRow::new(&store, &keys, scene, trial)).collect();
        let planned = rows.len();
        let pages = |rows: &[PlannedRow]| further(&self.write(&store, &scenes, &device, rows)?);
        let spent = self.measure(&store, &mut rows, context, &pages)?;
        let there = rows.iter().filter(|row| row.stored.is_some()).count();
        if there == 0 && spent {
            let text = "--budget-minutes: too small for one run; the time is over and the first row is not finished";
            return Err(Error::Usage(text.to_owned()).into());
        }
        if there > 0 {
            let _writing = file::writing();
            let further = pages(&rows)?;
            for page in [Some(store.path("index.html")), further].iter().flatten() {
                say!("wrote {}", page.display());
            }
        }
        let failed = rows.iter().filter(|row| row.stored.is_some() && !row.is_measured()).count();
        if failed > 0 {
            say!("settings that could not run: {failed} of {planned}; their rows say why");
        }
        if spent {
            say!("the budget is spent after {there} of {planned} rows; the same command continues from there");
        }
        interrupt::check().inspect_err(|_| {
            out::warn(&format!("{there} of {planned} rows are kept; the same command continues from there"));
        })?;
        Ok(ExitCode::SUCCESS)
    }

    /// Writes the folder's files with the rows that there are.
    fn write(&self, store: &Store, scenes: &[ChartScene], device: &[String; 2], rows: &[PlannedRow]) -> Result<Chart> {
        let mut stored: Vec<Stored> = rows.iter().filter_map(|row| row.stored.clone()).collect();
        // The settings of one scene stand together.
        stored.sort_by_key(|stored| scenes.iter().position(|scene| scene.name == stored.row.scene));
        let [device, driver] = device.clone();
        let chart = Chart {
            version: VERSION,
            program: env!("CARGO_PKG_VERSION"),
            device,
            driver,
            width: self.scene.size.0,
            height: self.scene.size.1,
            reference_noise: self.args.reference_noise,
            scenes: scenes.iter().map(ChartScene::line).collect(),
            planned: rows.len(),
            rows: stored.iter().map(|stored| stored.row.clone()).collect(),
        };
        chart.write(store, scenes, &stored)?;
        Ok(chart)
    }

    /// Opens the scenes, without references yet.
    fn open(&self) -> Result<Vec<ChartScene>> {
        let mut scenes: Vec<ChartScene> = Vec::new();
        for (i, path) in self.paths.iter().enumerate() {
            if self.paths[..i].iter().any(|other| file::is_same(other, path)) {
                return Err(Error::file(path, "is named twice; name each scene once"));
            }
            let opened = SceneArgs { path: path.clone(), ..self.scene.clone() }.open()?;
            let name = &opened.scene.name;
            let mut names = (1..).map(|k| if k == 1 { name.clone() } else { format!("{name} {k}") });
            let is_free = |name: &String| scenes.iter().all(|other| other.name != *name);
            let name = names.find(is_free).expect("numbers do not end");
            let ((pose, view), options) = (opened.at_time(), opened.options(self.args.memory_limit));
            let (camera, scene) = (opened.camera, opened.scene);
            scenes.push(ChartScene { name, view, pose, options, camera, references: Vec::new(), scene });
        }
        Ok(scenes)
    }

    /// Makes every reference that the rows will be compared with, or takes it from the cache.
    fn references(&self, scenes: &mut [ChartScene]) -> Result<()> {
        let cache = cache();
        for scene in scenes {
            let mut depths = vec![Depth::Full];
            for trial in &self.trials {
                let depth = same_depth(&scene.scene, &trial.settings);
                if !depths.contains(&depth) {
                    depths.push(depth);
                }
            }
            scene.references =
                depths.into_iter().map(|depth| self.reference(&cache, scene, depth)).collect::<Result<_>>()?;
        }
        Ok(())
    }

    fn reference(&self, cache: &Cache, scene: &ChartScene, depth: Depth) -> Result<ReferenceImage> {
        let light = match depth {
            Depth::Full => "all light".to_owned(),
            Depth::Bounces(n) => format!("light of {n} indirect bounces"),
        };
        let options = scene.reference_options(depth, Stop::Noise(self.args.reference_noise));
        let (film, traced) = traced(cache, (&scene.scene, &scene.pose, &scene.view), &options)?;
        let noise = film.noise();
        let how = if traced.paths == 0 { "from the cache".into() } else { format!("{:.1} s", traced.seconds) };
        say!("{}: reference of {light}, noise {:.2} %, {how}", scene.name, 100.0 * noise);
        ReferenceImage::new(depth, noise, film.layers(&[Aov::Direct, Aov::Diffuse]))
            .map_err(|error| Error::Usage(format!("{}: {error}; light the scene", scene.name)))
    }

    /// Makes the rows that are not measured yet, the first settings of every scene first, and writes pages of what there is now
    /// and then: a program that is killed leaves them. Whether the budget ended it.
    fn measure(
        &self,
        store: &Store,
        rows: &mut [PlannedRow],
        context: Arc<Context>,
        pages: &dyn Fn(&[PlannedRow]) -> Result<Option<PathBuf>>,
    ) -> Result<bool> {
        let mut written: Option<(Instant, Duration)> = None;
        let missing = rows.iter().filter(|row| !row.is_measured()).count();
        let mut progress = RowProgress::new(missing, rows.len());
        let start = Instant::now();
        let in_time = || self.args.budget_minutes.is_none_or(|budget| start.elapsed() < budget);
        let go_on = || in_time() && interrupt::check().is_ok();
        let (mut device, mut told) = (Some(context), false);
        for index in 0..rows.len() {
            let planned = &mut rows[index];
            if planned.is_measured() {
                continue;
            }
            if !go_on() {
                break;
            }
            progress.begin(&format!("{} {}", planned.row.scene, planned.row.name));
            let context = match device.take() {
                Some(context) => context,
                None => self.args.device.open(self.scene.size)?,
            };
            let stored = match planned.scene.measure(&context, &planned.trial.settings, &go_on) {
                Ok(None) | Err(Error::Interrupted) => break,
                Ok(Some((measured, pictures))) => {
                    device = Some(context);
                    store.save(Row { measured: Some(measured), ..planned.row.clone() }, Some(pictures))?
                }
                Err(error) => {
                    // A device that failed may be lost; the next row opens it again.
                    device = (!matches!(error, Error::Device(_))).then_some(context);
                    store.save(Row { failure: Some(error.to_string()), ..planned.row.clone() }, None)?
                }
            };
            if let Some(context) = device.as_ref().filter(|_| !std::mem::replace(&mut told, true)) {
                say_compiled(context);
            }
            progress.finish(&result(&stored.row));
            planned.stored = Some(stored);
            // Of many rows pages take a while: at most a twentieth of the time goes into them.
            if written.is_none_or(|(at, took)| at.elapsed() > PAGES_EVERY.max(20 * took)) {
                let begin = Instant::now();
                let _writing = file::writing();
                pages(rows)?;
                written = Some((Instant::now(), begin.elapsed()));
            }
        }
        drop(progress);
        Ok(interrupt::check().is_ok() && !in_time() && rows.iter().any(|row| row.stored.is_none()))
    }
}

/// A finished row in a line.
fn result(row: &Row) -> String {
    let result = match &row.measured {
        Some(measured) => {
            let (full, same) = (measured.full.total.rel, measured.same.total.rel);
            let ms = measured.frame_gpu_ms.median;
            format!("{ms:.0} ms, rel {full:.3} of all light, {same:.3} of as many bounces")
        }
        None => row.failure.clone().unwrap_or_default(),
    };
    format!("{} {}: {result}", row.scene, row.name)
}

impl<'a> PlannedRow<'a> {
    fn new(store: &Store, keys: &Keys, scene: &'a ChartScene, trial: &'a Trial) -> Self {
        let row = Row::new(keys.key(scene, &trial.settings), &scene.name, trial);
        // The same settings may have gone by another name.
        let renamed = |mut stored: Stored| {
            let Row { measured, failure, .. } = stored.row;
            stored.row = Row { measured, failure, ..row.clone() };
            stored
        };
        Self { scene, trial, stored: store.load(&row.key).map(renamed), row }
    }

    /// A failure is tried again: memory may be free by now.
    fn is_measured(&self) -> bool {
        self.stored.as_ref().is_some_and(|stored| stored.row.measured.is_some())
    }
}
