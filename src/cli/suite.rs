//! `twobounce suite`: rows for the suite of scenes: images of other programs, presets, path tracing, and the references
//! themselves.

use std::path::PathBuf;
use std::process::ExitCode;
use std::slice;

use clap::Args;
use twobounce::chart::import::Named;
use twobounce::chart::measure::{ChartScene, MOST_PATHS, errors};
use twobounce::chart::row::{Row, Source};
use twobounce::chart::suite::{Entry, Judged, Rows, Suite};
use twobounce::layers::{Aov, Layers};
use twobounce::reference::{Depth, Options, Stop, VERSION};
use twobounce::scene::Still;
use twobounce::stage::Staged;
use twobounce::{Error, Result};

use super::args::{DeviceArgs, SceneArgs};
use super::bench::imports::ImportArgs;
use super::reference::{cache, traced};
use super::scene::options;
use super::{interrupt, out};
use crate::say;

/// Compares images of any program with the references of the suite, together with the rows of the suite, and writes a
/// page and rows.csv. Without images or measurements, the tables are written again.
#[derive(Args, Debug)]
pub struct SuiteArgs {
    /// The scenes, by name [default: all]
    #[arg(value_name = "SCENE")]
    pub scenes: Vec<String>,
    #[command(flatten)]
    pub imports: ImportArgs,
    /// Render and time these presets with all bounces on this device
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    pub presets: Vec<String>,
    /// In every preset, also set this key; may be given several times
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub sets: Vec<String>,
    /// Also path-trace with these numbers of paths per pixel
    #[arg(long, value_name = "N,…", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..=i64::from(MOST_PATHS)))]
    pub paths: Vec<u32>,
    /// Only measure images of this side [default: every side of the suite]
    #[arg(long, value_name = "PIXELS")]
    pub side: Option<u32>,
    /// First trace the references again from their seeds, and write them to the suite
    #[arg(long)]
    pub references: bool,
    /// The folder of the suite
    #[arg(long, value_name = "DIR", default_value = "suite")]
    pub suite: PathBuf,
    /// The folder for rows.csv and the page
    #[arg(short, long, value_name = "DIR", default_value = "out/suite")]
    pub output: PathBuf,
    /// Print only notes and errors
    #[arg(short, long)]
    pub quiet: bool,
    #[command(flatten)]
    pub device: DeviceArgs,
}

pub fn run(args: &SuiteArgs) -> anyhow::Result<ExitCode> {
    out::be_quiet(args.quiet);
    let suite = Suite::read(&args.suite)?;
    let entries = suite.named(&args.scenes)?;
    let mut rows = Rows::read(&args.suite)?;
    rows.unite(Rows::read(&args.output)?);
    let presets = args.presets.iter().map(|preset| suite.row(preset, &args.sets)).collect::<Result<Vec<_>>>()?;
    let trials: Vec<Row> = presets.into_iter().chain(args.paths.iter().map(|paths| Row::of_paths(*paths))).collect();
    let sides = match args.side {
        Some(side) => vec![side_of(&suite, (side, side)).map_err(|why| Error::Usage(format!("--side: {why}")))?],
        None => suite.sides.clone(),
    };
    interrupt::install()?;
    if args.references {
        entries.iter().try_for_each(|entry| trace(&suite, entry))?;
    }
    for named in args.imports.named()? {
        say!("{}", import(&suite, &entries, named, &mut rows)?);
    }
    if !trials.is_empty() {
        let context = args.device.open((sides[0], sides[0]))?;
        for (entry, &side) in entries.iter().flat_map(|entry| sides.iter().map(move |side| (entry, side))) {
            let scene = open(&suite, entry, side)?;
            for row in &trials {
                let (measured, ..) = scene.measure(&context, row, &interrupt::PRESSED, &interrupt::check)?;
                let device = match row.source {
                    Source::Settings => context.driver.clone(),
                    _ => format!("{} threads", rayon::current_num_threads()),
                };
                let errors = measured.full;
                let milliseconds = Row { measured: Some(measured), ..row.clone() }.ms().unwrap_or(f64::NAN);
                say!("{}", rows.add(&scene, row, Judged { errors, milliseconds, device }));
            }
            rows.write(&suite, &args.output)?;
        }
    }
    rows.write(&suite, &args.output)?;
    say!("wrote {}", args.output.join("README.md").display());
    Ok(ExitCode::SUCCESS)
}

/// The side of a square image of the suite, or the reason why it is not one.
fn side_of(suite: &Suite, (width, height): (u32, u32)) -> std::result::Result<u32, String> {
    let sides: Vec<String> = suite.sides.iter().map(|side| format!("{side}x{side}")).collect();
    let why = || format!("{width}x{height} is no size of the suite; render the image at {}", sides.join(" or "));
    suite.sides.iter().find(|side| (width, height) == (**side, **side)).copied().ok_or_else(why)
}

/// Compares an image of another program, and prints its row.
fn import(suite: &Suite, entries: &[&Entry], named: Named, rows: &mut Rows) -> Result<String> {
    let entry = match (&named.scene, entries) {
        (Some(name), _) => suite.named(slice::from_ref(name))?[0],
        (None, [entry]) => entry,
        (None, _) => {
            let name = &named.name;
            let text = format!("--import: {name} does not say which scene it shows; name one scene of the suite first");
            return Err(Error::Usage(text));
        }
    };
    let side = match Layers::read_exr(&named.image) {
        Ok((image, _)) => side_of(suite, (image.width, image.height)).map_err(|why| Error::file(&named.image, why))?,
        // It is refused below.
        Err(_) => suite.sides[0],
    };
    let row = named.open((side, side))?;
    let Source::Import(claim) = &row.source else { unreachable!("an import becomes no other row") };
    let scene = open(suite, entry, side)?;
    claim.check_view(&scene.header)?;
    let errors = errors(&claim.images()?, claim.subtract(&scene), &scene.references[0])?;
    let device = claim.device.clone().unwrap_or_default();
    Ok(rows.add(&scene, &row, Judged { errors, milliseconds: claim.milliseconds, device }))
}

/// A scene of the suite with its file's camera.
fn stage(suite: &Suite, entry: &Entry, side: u32) -> Result<Staged> {
    SceneArgs { time: entry.time_s, ..SceneArgs::plain(&suite.path(entry), (side, side)) }.open()
}

/// The scene with its reference.
fn open(suite: &Suite, entry: &Entry, side: u32) -> Result<ChartScene> {
    let references = vec![suite.reference(entry, side)?];
    let staged = stage(suite, entry, side)?;
    let (options, header, (pose, view)) = (options(&staged, None), staged.header([]), staged.still);
    let (camera, scene, command) = (staged.camera, staged.scene, String::new());
    Ok(ChartScene { name: entry.name.clone(), scene, pose, view, camera, options, references, command, header })
}

/// Traces the references of a scene, and writes them.
fn trace(suite: &Suite, entry: &Entry) -> Result<()> {
    let side = suite.sides[0];
    let staged = stage(suite, entry, side)?;
    let (pose, view) = &staged.still;
    let (cache, of) = (cache(), Still::new(&staged.scene, pose, view));
    let film = |seed: &u64| {
        let (depth, stop) = (Depth::Full, Stop::Samples(entry.samples));
        let options = Options { width: side, height: side, depth, stop, seed: *seed, occlusion: false };
        Ok(traced(&cache, of, &options)?.0.layers(&[Aov::Direct, Aov::Diffuse]))
    };
    let traces = suite.seeds.iter().map(film).collect::<Result<Vec<_>>>()?;
    let words = |of: &[u64]| of.iter().map(u64::to_string).collect::<Vec<_>>().join(" ");
    let header = staged.header([
        ("writer", format!("twobounce {} suite, tracer {VERSION}", env!("CARGO_PKG_VERSION"))),
        ("depth", "full".to_owned()),
        ("seeds", words(&suite.seeds)),
        ("samplesOfSeed", entry.samples.to_string()),
    ]);
    suite.write_references(entry, &traces, &header)?;
    say!("{}: {} traces of {} paths a pixel", entry.name, traces.len(), entry.samples);
    Ok(())
}
