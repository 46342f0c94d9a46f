//! Common parts of `chart` and `study`: they open scenes, measure and store missing rows, refine references and errors
//! in rounds, and write a folder.

pub mod imports;
mod rounds;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use twobounce::chart::VERSION;
use twobounce::chart::export::Chart;
use twobounce::chart::measure::{ChartScene, MOST_PATHS};
use twobounce::chart::outline::{Outline, Planned};
use twobounce::chart::row::Row;
use twobounce::lab::store::{ExperimentRow as _, Origin, Store, Stored, device_words};
use twobounce::output::file;
use twobounce::reference::cache::Cache;
use twobounce::stage::check_film;
use twobounce::{Error, Result};

use super::args::{DeviceArgs, SceneArgs, minutes, percent};
use super::lab::{Pages, Runner};
use super::reference::cache;
use super::scene::options;
use super::share::{self, RowArgs};
use super::{interrupt, out, words};
use crate::say;

/// Options for measuring rows.
#[derive(clap::Args, Debug)]
pub struct BenchArgs {
    /// Stop after this many minutes of measuring, without the time for references; the same command continues later
    #[arg(long, value_name = "M", value_parser = minutes)]
    pub budget_minutes: Option<Duration>,
    /// Noise of the final references: root mean square of their relative error in percent. The first rows are compared
    /// with rougher references, whose noise is shown as bars, and errors are refined in rounds. `reference --noise`
    /// makes equal references
    #[arg(long, value_name = "PERCENT", default_value = "1", value_parser = percent)]
    pub reference_noise: f64,
    #[command(flatten)]
    pub rows: RowArgs,
    /// Print the N commands that share the work, one per line, and measure nothing
    #[arg(long, value_name = "N", conflicts_with = "shard", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub list: Option<u32>,
    /// Also path-trace the scene with these numbers of paths per pixel; none: without the path tracer
    #[arg(long, value_name = "N,…|none", default_value = "1,4,16,64", value_parser = paths)]
    pub paths: ::std::vec::Vec<u32>, // A plain `Vec` would mean one number a flag to clap.
    /// Join the times of several machines in one frontier, with a note; otherwise each machine has its own
    #[arg(long)]
    pub mix_machines: bool,
    /// Also show earlier rows of the same settings: of other builds, and of earlier states of the scene
    #[arg(long)]
    pub history: bool,
    /// A label for the history, such as the name of a commit
    #[arg(long, value_name = "TEXT")]
    pub label: Option<String>,
    /// Print only notes and errors
    #[arg(short, long)]
    pub quiet: bool,
    #[command(flatten)]
    pub device: DeviceArgs,
}

/// The settings and scenes to measure, and the folder that keeps them.
pub struct Bench<'a> {
    /// The view of the scenes.
    pub scene: &'a SceneArgs,
    pub paths: Vec<PathBuf>,
    /// Rows without results that are not placed in scenes yet.
    pub rows: Vec<Row>,
    pub folder: &'a Path,
    /// The flags that name the folder.
    pub outputs: &'a [&'a str],
    pub args: &'a BenchArgs,
}

fn paths(text: &str) -> std::result::Result<Vec<u32>, String> {
    if text == "none" {
        return Ok(Vec::new());
    }
    let one = |text: &str| text.trim().parse().ok().filter(|paths| (1..=MOST_PATHS).contains(paths));
    let numbers: Option<BTreeSet<u32>> = text.split(',').map(one).collect();
    let numbers = numbers.ok_or_else(|| format!("write numbers from 1 to {MOST_PATHS}, such as 1,4,16,64, or none"))?;
    Ok(numbers.into_iter().collect())
}

/// A function that writes a further page from the chart and returns its path.
type Further<'a> = &'a dyn Fn(&Chart) -> Result<Option<PathBuf>>;

/// A chart that is being filled.
struct Filling<'a> {
    bench: &'a Bench<'a>,
    further: Further<'a>,
    store: Store<Row>,
    cache: Cache,
    scenes: Vec<ChartScene>,
    rows: Vec<PlannedRow>,
    /// Every row of the chart, including those of other shards.
    all: Vec<Planned>,
    /// The origin of new rows, without the time.
    origin: Origin,
    /// Whether the note about compiled shaders was printed.
    told: bool,
}

/// A row of the chart, measured or not.
struct PlannedRow {
    /// Index of its scene.
    scene: usize,
    /// The row as named in this chart, without a result.
    row: Row,
    stored: Option<Stored<Row>>,
}

impl BenchArgs {
    /// The path tracer's rows.
    pub fn traced(&self) -> impl Iterator<Item = Row> {
        self.paths.iter().map(|paths| Row::of_paths(*paths))
    }
}

impl Bench<'_> {
    /// Measures the missing rows and writes the folder's files, or lists its parts. Prints how many rows are missing.
    /// `further` writes an additional page with the others, and returns its path.
    pub fn run(&self, further: impl Fn(&Chart) -> Result<Option<PathBuf>>) -> anyhow::Result<ExitCode> {
        if let Some(count) = self.args.list {
            share::list_shards(count, self.outputs, self.folder);
            return Ok(ExitCode::SUCCESS);
        }
        out::be_quiet(self.args.quiet);
        self.scene.check()?;
        interrupt::install()?;
        check_film(self.scene.size)?;
        let store = Store::open(self.folder, self.args.rows.any_build)?;
        let scenes = self.open()?;
        imports::check(&self.rows, &scenes)?;
        let context = self.args.device.open(self.scene.size)?;
        let origin = Origin::new(&context, self.args.rows.machine(), store.build(), self.args.label.clone());
        let (rows, all, cache) = (Vec::new(), Vec::new(), cache());
        let mut filling =
            Filling { bench: self, further: &further, store, cache, scenes, rows, all, origin, told: false };
        filling.plan(&[device_words(&context), self.args.device.validation.to_string()]);
        let planned = filling.rows.len();
        let (mut pages, device) = (Pages::default(), &self.args.device);
        let runner = Runner { device, size: self.scene.size, budget: self.args.budget_minutes };
        let spent = runner.run(&mut filling, context, &mut pages)? && filling.there().count() < planned;
        let there = filling.there().count();
        if there == 0 && spent {
            let text = "--budget-minutes: too small for one run; the time is over and the first row is not finished";
            return Err(Error::Usage(text.to_owned()).into());
        }
        match filling.refine(&mut pages).and_then(|()| filling.show_scenes()) {
            Err(Error::Interrupted) => {}
            result => result?,
        }
        if there > 0 {
            let _writing = file::writing();
            let further = filling.write_pages(false)?;
            for page in [Some(filling.store.path("index.html")), further].iter().flatten() {
                say!("wrote {}", page.display());
            }
        }
        let failed = filling.there().filter(|stored| stored.row.measured.is_none()).count();
        if failed > 0 {
            say!("settings that could not run: {failed} of {planned}; their rows say why");
        }
        self.args.rows.say_end(there, planned, spent)?;
        Ok(ExitCode::SUCCESS)
    }

    /// Opens the scenes without references.
    fn open(&self) -> Result<Vec<ChartScene>> {
        let typed: Vec<String> = std::env::args().skip(2).collect();
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
            let (pose, view) = opened.still.clone();
            scenes.push(ChartScene {
                name,
                view,
                pose,
                options: options(&opened, self.args.rows.memory_limit),
                references: Vec::new(),
                command: words::render_command::<BenchArgs>(&typed, path, self.scene.size),
                header: opened.header([]),
                camera: opened.camera,
                scene: opened.scene,
            });
        }
        Ok(scenes)
    }
}

impl Filling<'_> {
    /// Places the rows in their scenes, with existing results. `common`: see [`Row::in_scene`].
    fn plan(&mut self, common: &[String; 2]) {
        let args = self.bench.args;
        for row in &self.bench.rows {
            let is_of = |scene: &ChartScene| row.scene.is_empty() || row.scene == scene.name;
            for (index, scene) in self.scenes.iter().enumerate().filter(|(_, scene)| is_of(scene)) {
                let row = row.in_scene(scene, args.reference_noise, common);
                self.all.push(Planned { scene: scene.name.clone(), address: row.address.clone() });
                if args.rows.has(&row.address) {
                    // These settings may have had another name in an earlier call.
                    let renamed = |mut stored: Stored<Row>| {
                        let Row { measured, failure, origin, .. } = stored.row;
                        stored.row = Row { measured, failure, origin, ..row.clone() };
                        stored
                    };
                    self.rows.push(PlannedRow { scene: index, stored: self.store.load(&row.key).map(renamed), row });
                }
            }
        }
        // The settings of one scene are adjacent.
        self.all.sort_by_key(|planned| self.scenes.iter().position(|scene| scene.name == planned.scene));
    }

    /// The existing rows.
    fn there(&self) -> impl Iterator<Item = &Stored<Row>> {
        self.rows.iter().filter_map(|row| row.stored.as_ref())
    }

    /// Writes the folder's files with the existing rows.
    fn write_pages(&self, running: bool) -> Result<Option<PathBuf>> {
        let (args, (width, height)) = (self.bench.args, self.bench.scene.size);
        let mut outline = Outline {
            version: VERSION,
            width,
            height,
            reference_noise: args.reference_noise,
            scenes: self.scenes.iter().map(ChartScene::sketch).collect(),
            rows: self.all.clone(),
        };
        outline.take_truths(&self.store);
        let mut there: Vec<&PlannedRow> = self.rows.iter().filter(|row| row.stored.is_some()).collect();
        there.sort_by_key(|row| row.scene);
        let chart = Chart {
            outline,
            rows: there.into_iter().filter_map(|row| row.stored.clone()).collect(),
            planned: self.rows.len(),
            mix_machines: args.mix_machines,
            with_history: args.history,
            running,
            part: args.rows.in_words(),
        };
        chart.write(&self.store)?;
        (self.further)(&chart)
    }
}

impl PlannedRow {
    /// A failed row is tried again, because memory may be free by now.
    fn is_measured(&self) -> bool {
        self.stored.as_ref().is_some_and(|stored| stored.row.is_measured())
    }
}
