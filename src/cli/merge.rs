//! `twobounce merge`: joins the results of several machines.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use twobounce::chart::export::Chart;
use twobounce::chart::outline::Outline;
use twobounce::chart::row::Row as ChartRow;
use twobounce::lab::merge::merge;
use twobounce::lab::store::{ExperimentRow, Store, Stored};
use twobounce::output::file;
use twobounce::reference::part::Part;
use twobounce::stability::row::Row as StabilityRow;
use twobounce::stability::{self, export};
use twobounce::{Error, Result};

use super::{outputs, threads};
use crate::say;

/// Folders of `chart`, `study --rows` and `stability` become one folder with every row and one page; rows that occur in
/// two folders must be equal except for their times. Films of `reference --samples` become one film or image.
#[derive(Args, Debug)]
pub struct MergeArgs {
    /// The folders, or the films, to join
    #[arg(value_name = "PART", required = true)]
    pub parts: Vec<PathBuf>,
    /// The folder, the .film or the .exr to write; a folder may already have rows
    #[arg(short, long, value_name = "OUT")]
    pub output: PathBuf,
    /// For charts: join the times of several machines in one frontier, with a note; otherwise each machine has its own
    #[arg(long)]
    pub mix_machines: bool,
    /// For charts: also show earlier rows of the same settings
    #[arg(long)]
    pub history: bool,
}

pub fn run(args: &MergeArgs) -> anyhow::Result<ExitCode> {
    threads::start_pool()?;
    let charts = |part: &PathBuf| ChartRow::KIND.marks(part);
    let stability = |part: &PathBuf| StabilityRow::KIND.marks(part);
    if args.parts.iter().all(|part| part.is_file()) {
        merge_films(args)?;
    } else if args.parts.iter().all(charts) {
        merge_charts(args)?;
    } else if args.parts.iter().all(stability) {
        merge_stability(args)?;
    } else {
        let is_known = |part: &&PathBuf| part.is_file() || charts(part) || stability(part);
        return Err(match args.parts.iter().find(|part| !is_known(part)) {
            Some(other) if !other.exists() => Error::file(other, "does not exist; name folders or films that do"),
            Some(other) => Error::file(other, "holds no chart and no rows of stability; name folders that do"),
            None => {
                Error::Usage("charts, rows of stability and films do not go together; merge each kind by itself".into())
            }
        }
        .into());
    }
    Ok(ExitCode::SUCCESS)
}

fn merge_films(args: &MergeArgs) -> Result<()> {
    let inputs: Vec<Option<&PathBuf>> = args.parts.iter().map(Some).collect();
    outputs::check(&inputs, &[Some(&args.output)])?;
    let ending = args.output.extension().map(|ending| ending.to_ascii_lowercase());
    let is_image = match ending.as_ref().and_then(|ending| ending.to_str()) {
        Some("exr") => true,
        Some("film") => false,
        _ => return Err(Error::file(&args.output, "is no .film and no .exr; name one of these with -o")),
    };
    let read = |path: &PathBuf| Ok((path.display().to_string(), Part::read(path)?));
    let whole = Part::merge(args.parts.iter().map(read).collect::<Result<_>>()?)?;
    if is_image {
        if whole.film.first > 0 {
            let missing = format!("0-{}", whole.film.first - 1);
            let text = format!(
                "samples {missing} are in none of the films; make them with --samples {missing}, or write a .film"
            );
            return Err(Error::Usage(text));
        }
        let (image, header) = whole.image();
        image.write_exr(&args.output, &header)?;
    } else {
        whole.write(&args.output)?;
    }
    let noise = 100.0 * whole.film.noise();
    say!("{}: samples {}, noise {noise:.2} % RMS", args.output.display(), whole.samples());
    Ok(())
}

/// The output as one of the parts if it already has rows, then the others.
fn folders<R: ExperimentRow>(args: &MergeArgs) -> Vec<&Path> {
    let own = Some(args.output.as_path()).filter(|output| R::KIND.marks(output));
    let others = args.parts.iter().map(PathBuf::as_path).filter(|part| !file::is_same(part, &args.output));
    own.into_iter().chain(others).collect()
}

/// Joins rows in one folder, lets `write` make its pages (with the number of planned rows), and prints a summary.
/// `order` holds the addresses of all rows.
fn merge_rows<R: ExperimentRow>(
    args: &MergeArgs,
    folders: &[&Path],
    order: &[String],
    write: impl FnOnce(&Store<R>, Vec<Stored<R>>, usize) -> Result<()>,
) -> Result<()> {
    let merged = merge::<R>(folders, order)?;
    let store = Store::open(&args.output, true)?;
    merged.save(&store)?;
    let _writing = file::writing();
    let count = merged.rows.len();
    write(&store, merged.rows, count + merged.missing)?;
    say!("rows: {count}, of {} folders", folders.len());
    if merged.twice > 0 {
        say!(
            "measured on several machines or at several times: {}; the times of the first stay, the others are in history/",
            merged.twice
        );
    }
    if merged.missing > 0 {
        say!("rows that are in none of the folders: {}", merged.missing);
    }
    say!("wrote {}", store.path("index.html").display());
    Ok(())
}

fn merge_charts(args: &MergeArgs) -> Result<()> {
    let folders = folders::<ChartRow>(args);
    let mut outline: Option<Outline> = None;
    for folder in &folders {
        let other = Store::<ChartRow>::outline(folder)?;
        match &mut outline {
            None => outline = Some(other),
            Some(outline) => outline.unite(other).map_err(|why| Error::file(*folder, why))?,
        }
    }
    let outline = outline.ok_or_else(|| Error::Usage("there is no folder to merge".into()))?;
    let order: Vec<String> = outline.rows.iter().map(|row| row.address.clone()).collect();
    merge_rows::<ChartRow>(args, &folders, &order, |store, rows, planned| {
        let mix_machines = args.mix_machines;
        Chart { outline, rows, planned, mix_machines, with_history: args.history, ..Chart::default() }.write(store)
    })
}

fn merge_stability(args: &MergeArgs) -> Result<()> {
    let folders = folders::<StabilityRow>(args);
    let mut outline = export::Outline { version: stability::VERSION, rows: Vec::new() };
    for folder in &folders {
        let other: export::Outline = Store::<StabilityRow>::outline(folder)?;
        let new: Vec<String> = other.rows.into_iter().filter(|address| !outline.rows.contains(address)).collect();
        outline.rows.extend(new);
    }
    merge_rows::<StabilityRow>(args, &folders, &outline.rows, |store, rows, planned| {
        export::write(store, &rows, planned, "", false)?;
        store.save_outline(&outline)
    })
}
