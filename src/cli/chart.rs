//! `twobounce chart`: error and time of many settings on scenes, as a page, an SVG and rows.

use std::path::PathBuf;
use std::process::ExitCode;
use std::slice;

use clap::Args;
use twobounce::chart::plan::{sweep, trials};
use twobounce::chart::row::Row;
use twobounce::settings::PRESETS;
use twobounce::{Error, Result};

use super::args::{SceneArgs, SettingsArgs};
use super::bench::imports::ImportArgs;
use super::bench::{Bench, BenchArgs};

/// Measures every preset, then every value of every --sweep on top of every preset, one sweep at a time. Each row is
/// kept as soon as it is finished; after an interruption the same command continues.
#[derive(Args, Debug)]
#[command(mut_arg("size", |arg| arg.default_value("256x256")))]
pub struct ChartArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Further scenes with the same view
    #[arg(value_name = "SCENE")]
    pub more: Vec<PathBuf>,
    /// The folder to write: a new one, an empty one, or one of an earlier chart
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// The presets to run, separated by commas [default: all]
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    pub presets: Vec<String>,
    /// Also measure these values of a setting on top of every preset; may be given several times
    #[arg(long = "sweep", value_name = "KEY=VALUE,…")]
    pub sweeps: Vec<String>,
    /// In every preset, apply the keys of this TOML file first
    #[arg(long, value_name = "FILE.toml")]
    pub config: Option<PathBuf>,
    /// In every preset, set this key first; may be given several times
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub sets: Vec<String>,
    #[command(flatten)]
    pub imports: ImportArgs,
    #[command(flatten)]
    pub bench: BenchArgs,
}

/// Measures missing rows and writes the chart.
pub fn run(args: &ChartArgs) -> anyhow::Result<ExitCode> {
    let paths = [slice::from_ref(&args.scene.path), &args.more].concat();
    let mut rows: Vec<Row> = args.trials()?.into_iter().chain(args.bench.traced()).collect();
    rows.extend(args.imports.open(args.scene.size, &rows)?);
    let (scene, folder, outputs) = (&args.scene, &args.output, &["-o", "--output"]);
    Bench { scene, paths, rows, folder, outputs, args: &args.bench }.run(|_| Ok(None))
}

impl ChartArgs {
    fn trials(&self) -> Result<Vec<Row>> {
        let mut presets = self.presets.clone();
        if presets.is_empty() {
            presets.extend(PRESETS.iter().map(|preset| preset.name.to_owned()));
        }
        let base = |preset: String| {
            let (config, sets) = (self.config.clone(), self.sets.clone());
            let args = SettingsArgs { preset, config, method: None, sets };
            Ok(Row::of_settings(&args.preset, &[], args.effective_with("--presets")?))
        };
        let bases: Vec<Row> = presets.into_iter().map(base).collect::<Result<_>>()?;
        let values = self.sweeps.iter().map(|text| sweep(text)).collect::<Result<Vec<_>>>();
        let trials = values.and_then(|values| trials(&bases, &values.concat()));
        trials.map_err(|e| Error::Usage(format!("--sweep: {e}")))
    }
}
