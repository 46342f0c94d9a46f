//! `twobounce stability`: the table of known weaknesses.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::rc::Rc;
use std::sync::Arc;

use clap::Args;
use twobounce::gi::Method;
use twobounce::lab::store::{ExperimentRow as _, Origin, Store, Stored, device_words, short_hash};
use twobounce::output::{file, read};
use twobounce::reference::cache::Cache;
use twobounce::settings::{PRESETS, Settings};
use twobounce::stability::case::Case;
use twobounce::stability::cell::{Cell, Effort, settings};
use twobounce::stability::export::{Changes, Outline, changes, read_csv, write};
use twobounce::stability::markdown::page;
use twobounce::stability::row::Row;
use twobounce::stability::{GRIDS, SIZE, VERSION, cases};
use twobounce::vk::Context;
use twobounce::{Error, Result};

use super::args::{DeviceArgs, named};
use super::lab::{Experiment, Pages, Runner};
use super::share::{self, RowArgs};
use super::{interrupt, out};
use crate::say;

/// Runs every case with every preset on every grid, at several places in the grid. Each row is kept as soon as it is
/// finished; after an interruption the same command continues. Numbers beyond their limits are marked.
#[derive(Args, Debug)]
pub struct StabilityArgs {
    /// The folder to write: a new one, an empty one, or one of an earlier table
    #[arg(short, long, value_name = "DIR", required_unless_present_any = ["list", "markdown"])]
    pub output: Option<PathBuf>,
    /// The cases to run, separated by commas; the beginning of a name selects all cases with it [default: all]
    #[arg(long = "case", value_name = "NAME,…", value_delimiter = ',')]
    pub cases: Vec<String>,
    /// The presets to run, separated by commas [default: all]
    #[arg(long = "preset", value_name = "NAME,…", value_delimiter = ',')]
    pub presets: Vec<String>,
    /// Only run presets of this method
    #[arg(long, value_name = "NAME", value_parser = named(Method::ALL, Method::name))]
    pub method: Option<Method>,
    /// Voxels along the grid's edge, separated by commas [default: 32,64,128]
    #[arg(long = "grid", value_name = "N,…", value_delimiter = ',')]
    pub grids: Vec<u32>,
    /// Run a subset of cases, presets, grids and places, in a minute or two
    #[arg(long)]
    pub quick: bool,
    /// Print the cases with their meanings; with a number, the N commands that share the work, one per line
    #[arg(long, value_name = "N", num_args = 0..=1, conflicts_with = "shard", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub list: Option<Option<u32>>,
    /// Print a Markdown page about an existing rows.csv
    #[arg(long, value_name = "ROWS.csv", conflicts_with_all = ["list", "output"])]
    pub markdown: Option<PathBuf>,
    /// Exit with 1 if a number is farther from its ideal than in this rows.csv of an earlier table, apart from rounding
    #[arg(long, value_name = "ROWS.csv", conflicts_with_all = ["list", "markdown"])]
    pub against: Option<PathBuf>,
    #[command(flatten)]
    pub rows: RowArgs,
    #[command(flatten)]
    pub device: DeviceArgs,
}

/// Presets and grids of `--quick`. Cones take too long on finer grids.
const QUICK: [(&str, &[u32]); 4] = [("balanced", &[32, 64]), ("cones", &[32]), ("lpv", &[32, 64]), ("photons", &[32])];

/// A table in progress.
struct Table<'a> {
    args: &'a StabilityArgs,
    store: Store<Row>,
    cache: Cache,
    /// The origin of new rows, without the time.
    origin: Origin,
    rows: Vec<PlannedRow>,
    /// The addresses of all rows, including those of other shards.
    all: Vec<String>,
}

/// A row of the table, measured or not.
struct PlannedRow {
    case: &'static Case,
    row: Row,
    stored: Option<Stored<Row>>,
}

pub fn run(args: &StabilityArgs) -> anyhow::Result<ExitCode> {
    if let Some(path) = &args.markdown {
        out::write(&read_table(path, page)?);
        return Ok(ExitCode::SUCCESS);
    }
    let cases = args.cases()?;
    if args.list == Some(None) {
        cases.iter().for_each(|case| say!("{:18} {}", case.name, case.meaning));
        return Ok(ExitCode::SUCCESS);
    }
    let (presets, grids) = (args.presets()?, args.grids()?);
    let needs_folder = || Error::Usage("-o is missing: name the folder to write into".into());
    let folder = args.output.as_deref().ok_or_else(needs_folder)?;
    if let Some(Some(count)) = args.list {
        share::list_shards(count, &["-o", "--output"], folder);
        return Ok(ExitCode::SUCCESS);
    }
    let before = args.against.as_deref().map(|path| Ok::<_, Error>((path, read_table(path, read_csv)?))).transpose()?;
    let store = Store::open(folder, args.rows.any_build)?;
    interrupt::install()?;
    let context = args.device.open((SIZE, SIZE))?;
    let origin = Origin::new(&context, args.rows.machine(), store.build(), None);
    let (rows, all) = (Vec::new(), Vec::new());
    let mut table = Table { args, store, cache: Cache::of_user(), origin, rows, all };
    let is_chosen = |preset: &str, grid| {
        let is_quick = || QUICK.iter().any(|(name, grids)| *name == preset && grids.contains(&grid));
        !args.quick || !args.presets.is_empty() || !args.grids.is_empty() || is_quick()
    };
    for case in cases {
        let cells = presets.iter().flat_map(|preset| grids.iter().map(move |grid| (preset, *grid)));
        for (preset, grid) in cells.filter(|(preset, grid)| is_chosen(preset, *grid)) {
            table.plan(&context, case, preset, grid)?;
        }
    }
    let planned = table.rows.len();
    let runner = Runner { device: &args.device, size: (SIZE, SIZE), budget: None };
    runner.run(&mut table, context, &mut Pages::default())?;
    let there = table.rows.iter().filter(|row| row.stored.is_some()).count();
    if there > 0 {
        table.write(false)?;
        say!("wrote {}", table.store.path("index.html").display());
    }
    args.rows.say_end(there, planned, false)?;
    let Some((path, before)) = before else { return Ok(ExitCode::SUCCESS) };
    held_against(path, &changes(&before, &read_table(&table.store.path("rows.csv"), read_csv)?))
}

/// Reads a rows.csv of an earlier table.
fn read_table<T>(path: &Path, parse: fn(&str) -> std::result::Result<T, String>) -> Result<T> {
    let text = read::text(path, "table of `twobounce stability`")?;
    parse(&text).map_err(|why| Error::file(path, format!("is no rows.csv of `twobounce stability`: {why}")))
}

/// Prints the changes since the table of `path`. Returns whether something is worse.
fn held_against(path: &Path, found: &Changes) -> anyhow::Result<ExitCode> {
    let shown = path.display();
    if found.compared == 0 {
        let remedy = "name the rows.csv of a table with the same cases, presets and grids";
        return Err(Error::Usage(format!("--against: {shown} has none of these rows; {remedy}")).into());
    }
    found.unknown.iter().for_each(|row| out::warn(&format!("{row} is not in {shown}")));
    found.better.iter().for_each(|line| say!("better: {line}"));
    found.worse.iter().for_each(|line| say!("worse: {line}"));
    say!("{} of {} rows are worse than in {shown}", found.worse.len(), found.compared);
    Ok(if found.worse.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

impl StabilityArgs {
    fn cases(&self) -> Result<Vec<&'static Case>> {
        if self.cases.is_empty() {
            return Ok(cases::all().filter(|case| case.quick || !self.quick).collect());
        }
        let mut named = Vec::new();
        for name in &self.cases {
            let begins = |case: &&Case| !name.is_empty() && case.name.starts_with(name.as_str());
            let found: Vec<_> = cases::named(name).map_or_else(|| cases::all().filter(begins).collect(), |c| vec![c]);
            if found.is_empty() {
                let names: Vec<&str> = cases::all().map(|case| case.name.as_str()).collect();
                return Err(Error::Usage(format!("--case: there is no {name:?}; there are {}", names.join(", "))));
            }
            named.extend(found);
        }
        // Grids in the order of the table, without repetition.
        Ok(cases::all().filter(|case| named.iter().any(|other| other.name == case.name)).collect())
    }

    fn presets(&self) -> Result<Vec<String>> {
        let is_quick = |name: &&str| QUICK.iter().any(|(quick, _)| quick == name);
        let all = PRESETS.iter().map(|preset| preset.name).filter(|name| !self.quick || is_quick(name));
        let named = if self.presets.is_empty() { all.map(str::to_owned).collect() } else { self.presets.clone() };
        let mut presets = Vec::new();
        for preset in named {
            let method = Settings::preset(&preset)?.method;
            presets.extend(self.method.is_none_or(|wanted| wanted == method).then_some(preset));
        }
        if presets.is_empty() {
            return Err(Error::Usage("--method: none of the presets is of this method; leave --preset out".into()));
        }
        Ok(presets)
    }

    fn grids(&self) -> Result<Vec<u32>> {
        let all = if self.quick { &[32, 64][..] } else { GRIDS };
        let grids = if self.grids.is_empty() { all.to_vec() } else { self.grids.clone() };
        let refused = |e| Error::Usage(format!("--grid: {e}"));
        grids.iter().try_for_each(|grid| settings(PRESETS[0].name, *grid).map(drop)).map_err(refused)?;
        Ok(grids)
    }

    fn effort(&self) -> Effort {
        if self.quick { Effort::QUICK } else { Effort::FULL }
    }
}

impl Table<'_> {
    /// Adds a row to the planned ones.
    fn plan(&mut self, context: &Context, case: &'static Case, preset: &str, grid: u32) -> Result<()> {
        let args = self.args;
        let settings = settings(preset, grid)?;
        let address = short_hash(&serde_json::json!([case.name, settings.to_toml(), args.effort()]));
        let key = short_hash(&serde_json::json!([device_words(context), args.device.validation, address]));
        let quick = if args.quick { " --quick" } else { "" };
        self.all.push(address.clone());
        if !args.rows.has(&address) {
            return Ok(());
        }
        let row = Row {
            case: case.name.clone(),
            preset: preset.to_owned(),
            method: settings.method.name().to_owned(),
            grid,
            command: format!("twobounce stability --case {} --preset {preset} --grid {grid}{quick} -o cell", case.name),
            origin: Some(self.origin.clone()),
            key,
            address,
            ..Row::default()
        };
        // A failed row is tried again, because memory may be free by now.
        let stored = self.store.load(&row.key).filter(|stored| stored.row.is_measured());
        self.rows.push(PlannedRow { case, row, stored });
        Ok(())
    }
}

impl Experiment for Table<'_> {
    fn len(&self) -> usize {
        self.rows.len()
    }

    fn is_measured(&self, row: usize) -> bool {
        self.rows[row].stored.is_some()
    }

    fn name(&self, row: usize) -> String {
        self.rows[row].row.title()
    }

    fn measure(&mut self, row: usize, context: &Arc<Context>, _: &dyn Fn() -> Result<()>) -> Result<()> {
        let PlannedRow { case, row: planned, .. } = &self.rows[row];
        let cell = Cell {
            context,
            cache: &self.cache,
            settings: settings(&planned.preset, planned.grid)?,
            effort: self.args.effort(),
            memory_limit: self.args.rows.memory_limit,
            cancel: &interrupt::PRESSED,
            frame_ms: Rc::default(),
        };
        let (kept, pictures) = cell.run(case, planned)?;
        let kept = Row { origin: Some(self.origin.now()), ..kept };
        self.rows[row].stored = Some(self.store.save(kept, Some(pictures))?);
        Ok(())
    }

    fn keep_failure(&mut self, row: usize, error: Error) -> Result<()> {
        let kept =
            Row { failure: Some(error.to_string()), origin: Some(self.origin.now()), ..self.rows[row].row.clone() };
        self.rows[row].stored = Some(self.store.save(kept, None)?);
        Ok(())
    }

    fn line(&self, row: usize) -> Option<String> {
        let PlannedRow { case, stored, .. } = &self.rows[row];
        let row = &stored.as_ref()?.row;
        let Some(m) = &row.measured else {
            return Some(format!("{}: {}", row.title(), row.failure.as_deref().unwrap_or_default()));
        };
        let [median, min, max] =
            [m.number.median, m.number.min, m.number.max].map(|value| case.unit.value_in_words(value));
        Some(format!("{}: {median} ({min} to {max}), {:.1} s", row.title(), m.seconds))
    }

    fn write(&mut self, running: bool) -> Result<()> {
        let _writing = file::writing();
        let stored: Vec<Stored<Row>> = self.rows.iter().filter_map(|row| row.stored.clone()).collect();
        write(&self.store, &stored, self.rows.len(), &self.args.rows.in_words(), running)?;
        self.store.save_outline(&Outline { version: VERSION, rows: self.all.clone() })
    }
}
