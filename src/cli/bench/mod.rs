//! What `chart` and `study` share: they open scenes, measure and keep missing rows, refine references and errors in rounds, and
//! write a folder.

pub mod imports;
mod references;
mod rounds;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use twobounce::chart::VERSION;
use twobounce::chart::export::{Chart, Surroundings};
use twobounce::chart::measure::ChartScene;
use twobounce::chart::outline::{Outline, Planned, Sketch};
use twobounce::chart::paths::MOST_PATHS;
use twobounce::chart::row::{Keys, Row};
use twobounce::chart::subject::Subject;
use twobounce::lab::store::{Origin, Row as _, Store, Stored};
use twobounce::output::exr::Metadata;
use twobounce::output::file;
use twobounce::reference::Depth;
use twobounce::reference::cache::Cache;
use twobounce::vk::Context;
use twobounce::{Error, Result};

use super::args::{DeviceArgs, SceneArgs, minutes, percent};
use super::lab::{Pages, Runner};
use super::reference::{cache, check_memory};
use super::share::{self, RowArgs};
use super::{interrupt, out, words};
use crate::say;

/// How rows are measured.
#[derive(clap::Args, Debug)]
pub struct BenchArgs {
    /// Stop after this many minutes of measuring, references not counted; the same command continues later
    #[arg(long, value_name = "M", value_parser = minutes)]
    pub budget_minutes: Option<Duration>,
    /// Root mean square of the references' relative error, in the end: the first rows are compared with rough ones, whose noise
    /// bars show, then errors are refined in rounds. `reference --noise` makes the same ones
    #[arg(long, value_name = "PERCENT", default_value = "1", value_parser = percent)]
    pub reference_noise: f64,
    #[command(flatten)]
    pub rows: RowArgs,
    /// Print the N commands that share the work, a line each, and do nothing
    #[arg(long, value_name = "N", conflicts_with = "shard", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub list: Option<u32>,
    /// Path-trace along these numbers of paths a pixel too, for comparison; none: no path tracer
    #[arg(long, value_name = "N,…|none", default_value = "1,4,16,64", value_parser = paths)]
    pub paths: Paths,
    /// Join the times of several machines in one frontier, and say so; without this each machine has its own
    #[arg(long)]
    pub mix_machines: bool,
    /// Show earlier rows of the same settings, of other builds and of former states of the scene, beside today's
    #[arg(long)]
    pub history: bool,
    /// What is measured, in a word for the history, such as a commit
    #[arg(long, value_name = "TEXT")]
    pub label: Option<String>,
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
    pub subjects: Vec<Subject>,
    pub folder: &'a Path,
    pub args: &'a BenchArgs,
}

/// Numbers of paths a pixel.
#[derive(Clone, Debug)]
pub struct Paths(Vec<u32>);

impl Paths {
    /// As rows of a chart.
    pub fn subjects(&self) -> impl Iterator<Item = Subject> {
        self.0.iter().map(|paths| Subject::Paths(*paths))
    }
}

fn paths(text: &str) -> std::result::Result<Paths, String> {
    if text == "none" {
        return Ok(Paths(Vec::new()));
    }
    let one = |text: &str| text.trim().parse().ok().filter(|paths| (1..=MOST_PATHS).contains(paths));
    let numbers: Option<BTreeSet<u32>> = text.split(',').map(one).collect();
    let numbers = numbers.ok_or_else(|| format!("write numbers from 1 to {MOST_PATHS}, such as 1,4,16,64, or none"))?;
    Ok(Paths(numbers.into_iter().collect()))
}

/// A page of one's own that is written from the chart as often as the others; says where.
type Further<'a> = &'a dyn Fn(&Chart) -> Result<Option<PathBuf>>;

/// A chart under way.
struct Filling<'a> {
    bench: &'a Bench<'a>,
    further: Further<'a>,
    store: Store<Row>,
    cache: Cache,
    scenes: Vec<Seen>,
    rows: Vec<PlannedRow<'a>>,
    /// Every row of the chart, those of other shards too.
    all: Vec<Planned>,
    /// Of rows that are made now, but for the time.
    origin: Origin,
    /// Whether it was said what was compiled.
    told: bool,
}

/// A scene, the command that renders it, and what an image of it says of itself.
struct Seen {
    scene: ChartScene,
    command: String,
    header: Metadata,
}

/// A row of the chart, to be made or already there.
struct PlannedRow<'a> {
    /// Index of its scene.
    scene: usize,
    subject: &'a Subject,
    /// As it is called in this chart, without a result.
    row: Row,
    stored: Option<Stored<Row>>,
}

impl Bench<'_> {
    /// Measures the missing rows and writes the folder's files; says what is still missing. `further` writes a page of its own from
    /// the chart, as often as the others are written, and says where.
    pub fn run(&self, further: impl Fn(&Chart) -> Result<Option<PathBuf>>) -> anyhow::Result<ExitCode> {
        out::be_quiet(self.args.quiet);
        self.scene.check()?;
        interrupt::install()?;
        check_memory(self.scene.size)?;
        let store = Store::open(self.folder, self.args.rows.any_build)?;
        let scenes = self.open()?;
        imports::check(&self.subjects, &scenes)?;
        let context = self.args.device.open(self.scene.size)?;
        let mut filling = Filling::new(self, (store, scenes), &context, &further);
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
        if planned == 0 {
            say!("no row is in {}", self.args.rows.words());
        }
        if spent {
            say!("the budget is spent after {there} of {planned} rows; the same command continues from there");
        }
        interrupt::check().inspect_err(|_| {
            out::warn(&format!("{there} of {planned} rows are kept; the same command continues from there"));
        })?;
        Ok(ExitCode::SUCCESS)
    }

    /// Prints the commands that share the work. `outputs`: the flags that name the folder.
    pub fn list(&self, count: u32, outputs: &[&str]) -> Result<ExitCode> {
        let parts: Vec<String> = (1..=count).map(|i| format!("{i}/{count}")).collect();
        share::list(&parts, "--shard", outputs, Some((self.folder, "")))?;
        Ok(ExitCode::SUCCESS)
    }

    /// Opens the scenes, without references yet.
    fn open(&self) -> Result<Vec<Seen>> {
        let typed: Vec<String> = std::env::args().skip(2).collect();
        let mut scenes: Vec<Seen> = Vec::new();
        for (i, path) in self.paths.iter().enumerate() {
            if self.paths[..i].iter().any(|other| file::is_same(other, path)) {
                return Err(Error::file(path, "is named twice; name each scene once"));
            }
            let opened = SceneArgs { path: path.clone(), ..self.scene.clone() }.open()?;
            let name = &opened.scene.name;
            let mut names = (1..).map(|k| if k == 1 { name.clone() } else { format!("{name} {k}") });
            let is_free = |name: &String| scenes.iter().all(|other| other.scene.name != *name);
            let name = names.find(is_free).expect("numbers do not end");
            let ((pose, view), options) = (opened.at_time(), opened.options(self.args.rows.memory_limit));
            let header = opened.header([]);
            let (camera, scene) = (opened.camera, opened.scene);
            let command = words::render_command(&typed, path, self.scene.size);
            let scene = ChartScene { name, view, pose, options, camera, references: Vec::new(), scene };
            scenes.push(Seen { scene, command, header });
        }
        Ok(scenes)
    }
}

impl<'a> Filling<'a> {
    fn new(
        bench: &'a Bench<'a>,
        (store, scenes): (Store<Row>, Vec<Seen>),
        context: &Arc<Context>,
        further: Further<'a>,
    ) -> Self {
        let args = bench.args;
        let keys = Keys::new(context, args.device.validation, args.reference_noise);
        let (mut all, mut rows) = (Vec::new(), Vec::new());
        for subject in &bench.subjects {
            for (index, Seen { scene, .. }) in
                scenes.iter().enumerate().filter(|(_, seen)| subject.is_of(&seen.scene.name))
            {
                let address = keys.address(scene, subject);
                if args.rows.has(&address) {
                    let row = Row::new(keys.key(&address, subject), &scene.name, subject);
                    rows.push(PlannedRow::new(&store, (index, subject), Row { address: address.clone(), ..row }));
                }
                all.push(Planned { scene: scene.name.clone(), address });
            }
        }
        // The settings of one scene stand together.
        let of_scene = |planned: &Planned| scenes.iter().position(|seen| seen.scene.name == planned.scene);
        all.sort_by_key(of_scene);
        let origin = Origin::new(context, args.rows.machine(), store.build(), args.label.clone());
        Self { bench, further, store, cache: cache(), scenes, rows, all, origin, told: false }
    }

    /// The rows that there are.
    fn there(&self) -> impl Iterator<Item = &Stored<Row>> {
        self.rows.iter().filter_map(|row| row.stored.as_ref())
    }

    /// Writes the folder's files with the rows that there are.
    fn write_pages(&self, running: bool) -> Result<Option<PathBuf>> {
        let args = self.bench.args;
        let mut stored: Vec<Stored<Row>> = self.there().cloned().collect();
        stored.sort_by_key(|stored| self.scenes.iter().position(|seen| seen.scene.name == stored.row.scene));
        // The others have no reference to be seen with yet.
        let has_truth = |seen: &&Seen| seen.scene.references.iter().any(|reference| reference.depth == Depth::Full);
        let seen = self.scenes.iter().filter(has_truth);
        let mut outline = Outline {
            version: VERSION,
            width: self.bench.scene.size.0,
            height: self.bench.scene.size.1,
            reference_noise: args.reference_noise,
            scenes: seen.map(|seen| Sketch::of(&seen.scene, &seen.command)).collect::<Result<_>>()?,
            rows: self.all.clone(),
        };
        outline.take_truths(&self.store, self.scenes.iter().map(|seen| (seen.scene.line(), seen.command.as_str())));
        let chart = Chart::new(&outline, self.rows.len(), args.mix_machines, &stored);
        let history = if args.history { chart.history(&self.store) } else { Vec::new() };
        let around = Surroundings { running, part: args.rows.words(), history };
        chart.write(&self.store, &outline.scenes, &stored, &around)?;
        outline.save(&self.store)?;
        (self.further)(&chart)
    }
}

impl<'a> PlannedRow<'a> {
    fn new(store: &Store<Row>, (scene, subject): (usize, &'a Subject), row: Row) -> Self {
        // The same settings may have gone by another name.
        let renamed = |mut stored: Stored<Row>| {
            let Row { measured, failure, origin, .. } = stored.row;
            stored.row = Row { measured, failure, origin, ..row.clone() };
            stored
        };
        Self { scene, subject, stored: store.load(&row.key).map(renamed), row }
    }

    /// A failure is tried again: memory may be free by now.
    fn is_measured(&self) -> bool {
        self.stored.as_ref().is_some_and(|stored| stored.row.is_measured())
    }
}
