//! `twobounce study`: measures the default study and writes `docs/notes/study/`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use twobounce::chart::export::Chart;
use twobounce::chart::plan::distinct;
use twobounce::chart::study::{EMPTY, PRESETS_AXIS, SCENES, document, is_page, lines};
use twobounce::chart::svg;
use twobounce::output::file;
use twobounce::{Error, Result};

use super::args::{SceneArgs, size};
use super::bench::{Bench, BenchArgs};

/// Measures every preset and every axis, keeps rows as `chart` does, and fills the tables of the page.
#[derive(Args, Debug)]
pub struct StudyArgs {
    /// The scenes [default: those of the project]
    #[arg(value_name = "SCENE")]
    pub scenes: Vec<PathBuf>,
    /// The folder for README.md, rows.csv and an SVG per scene
    #[arg(short, long, value_name = "DIR", default_value = "docs/notes/study")]
    pub output: PathBuf,
    /// The folder that keeps rows, as for `chart -o`; its index.html shows all of them
    #[arg(long, value_name = "DIR", default_value = "out/study")]
    pub rows: PathBuf,
    /// Size of the images in pixels
    #[arg(long, value_name = "WxH", default_value = "256x256", value_parser = size)]
    pub size: (u32, u32),
    /// Only measure the presets, without the axes
    #[arg(long)]
    pub presets_only: bool,
    /// In every preset, set this key first; may be given several times
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub sets: Vec<String>,
    #[command(flatten)]
    pub bench: BenchArgs,
}

pub fn run(args: &StudyArgs) -> anyhow::Result<ExitCode> {
    let mut lines = lines(&args.sets)?;
    lines.retain(|(axis, _)| !args.presets_only || *axis == PRESETS_AXIS);
    page(&args.output)?; // before any measurement
    let paths = if args.scenes.is_empty() { SCENES.iter().map(PathBuf::from).collect() } else { args.scenes.clone() };
    let scene = &SceneArgs::plain(&paths[0], args.size);
    let rows = distinct(lines.iter().map(|line| line.1.clone())).into_iter().chain(args.bench.traced()).collect();
    let bench = Bench { scene, paths, rows, folder: &args.rows, outputs: &["--rows"], args: &args.bench };
    bench.run(|chart| {
        // A part has no page: after merging the parts, the same command without --shard writes it.
        if args.bench.rows.shard.is_some() {
            return Ok(None);
        }
        write(&args.output, chart, &document(chart, &lines, &args.sets, &page(&args.output)?)?)?;
        Ok(Some(args.output.join("README.md")))
    })
}

/// The existing page, or a new one; a folder with other content is refused.
fn page(folder: &Path) -> Result<String> {
    let page = folder.join("README.md");
    match fs::read_to_string(&page) {
        Ok(text) if is_page(&text) => Ok(text),
        Ok(_) => {
            let why = "was not written by `twobounce study`, or lost its marks; name another folder with -o";
            Err(Error::file(&page, why))
        }
        Err(_) if fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_some()) || folder.is_file() => {
            Err(Error::file(folder, "holds something else than a study; name an empty or a new folder with -o"))
        }
        Err(_) => Ok(EMPTY.to_owned()),
    }
}

fn write(folder: &Path, chart: &Chart, page: &str) -> Result<()> {
    file::create_folder(folder)?;
    for scene in chart.scenes() {
        let picture = svg::chart(&chart.panels(&scene.name), 2);
        file::write(&folder.join(format!("{}.svg", scene.name)), picture.as_bytes())?;
    }
    file::write(&folder.join("rows.csv"), chart.csv().as_bytes())?;
    // It comes last: a folder without it was not written by this command.
    file::write(&folder.join("README.md"), page.as_bytes())
}
