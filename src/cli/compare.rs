//! `twobounce compare`: an image against its reference, as numbers, as a picture, and as an exit code.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Arg, ArgMatches, Args, Command, FromArgMatches, value_parser};
use serde::Serialize;
use twobounce::layers::Layers;
use twobounce::measure::metrics::{self, Comparison, Metrics};
use twobounce::measure::picture::side_by_side;
use twobounce::output::file;
use twobounce::{Error, Result};

use super::args::number;
use super::outputs;
use crate::say;

/// Version of the JSON report.
const VERSION: u32 = 1;

#[derive(Args, Debug)]
pub struct CompareArgs {
    /// The image to judge
    #[arg(value_name = "IMAGE.exr")]
    pub image: PathBuf,
    /// What it should look like. Where both files carry their direct layer, the rest of the light is compared by itself
    /// (indirect); where this one carries its diffuse layer too, also over the pixels in which it shows neither metal nor
    /// glass nor sky (indirect_diffuse)
    #[arg(value_name = "REFERENCE.exr")]
    pub reference: PathBuf,
    /// Write the numbers as JSON
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Write compare.png into this folder: image, reference, signed difference (red: too bright, blue: too dark), FLIP
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub limits: Limits,
}

/// Above any of these the exit code is 1.
#[derive(Debug)]
pub struct Limits {
    /// Metrics and their limits.
    metrics: Vec<(Metric, f64)>,
    nonfinite: Option<usize>,
}

/// A metric of a part of the light.
#[derive(Clone, Copy, Debug)]
struct Metric {
    part: &'static str,
    name: &'static str,
}

impl Metric {
    /// Every metric that can be limited.
    fn all() -> impl Iterator<Item = Self> {
        let of = |part| Metrics::NAMES.into_iter().map(move |name| Self { part, name });
        of("total").chain([Self { part: "total", name: "flip" }]).chain(of("indirect")).chain(of("indirect_diffuse"))
    }

    /// Such as `rel` or `indirect rel`.
    fn words(self) -> String {
        if self.part == "total" { self.name.to_owned() } else { format!("{} {}", self.part, self.name) }
    }

    fn flag(self) -> String {
        format!("max-{}", self.words().replace([' ', '_'], "-"))
    }

    /// The number that is limited.
    fn of(self, comparison: &Comparison) -> Result<f64> {
        let metrics = match self.part {
            "indirect" => comparison.indirect.ok_or(format!("{NO_DIRECT}; render them with --aov direct")),
            "indirect_diffuse" => comparison
                .indirect_diffuse
                .ok_or(format!("{NO_DIRECT}, and {NO_DIFFUSE}; render it with --aov direct,diffuse")),
            _ => Ok(comparison.total),
        };
        let metrics = metrics.map_err(|needs| Error::Usage(format!("a limit on {} {needs}", self.part)))?;
        let place = Metrics::NAMES.iter().position(|name| *name == self.name);
        let value = place.map_or(comparison.flip, |place| metrics.values()[place]);
        Ok(if self.name == "energy" { (value - 1.0).abs() } else { value })
    }
}

impl Args for Limits {
    fn augment_args(command: Command) -> Command {
        let limit = number(|x| x >= 0.0, "write a number, at least 0");
        let arg = |metric: Metric| {
            let above = if metric.name == "energy" { "is further than this from 1" } else { "is above this" };
            let help = format!("Exit with 1 if {} {above}", metric.words());
            Arg::new(metric.flag()).long(metric.flag()).value_name("X").value_parser(limit.clone()).help(help)
        };
        let help =
            "Exit with 1 if more values of the image than this are NaN or infinite [default: 0 with any other limit]";
        let nonfinite = Arg::new("max-nonfinite").long("max-nonfinite").value_name("N");
        command.args(Metric::all().map(arg)).arg(nonfinite.value_parser(value_parser!(usize)).help(help))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for Limits {
    fn from_arg_matches(matches: &ArgMatches) -> std::result::Result<Self, clap::Error> {
        let given = |metric: Metric| Some((metric, *matches.get_one(&metric.flag())?));
        let nonfinite = matches.get_one("max-nonfinite").copied();
        Ok(Self { metrics: Metric::all().filter_map(given).collect(), nonfinite })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> std::result::Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

/// The JSON report. Metrics have no unit; see the docs of each.
#[derive(Serialize)]
struct Report<'a> {
    version: u32,
    image: &'a Path,
    reference: &'a Path,
    width: u32,
    height: u32,
    #[serde(flatten)]
    comparison: &'a Comparison,
    /// One sentence per exceeded limit.
    exceeded: &'a [String],
}

/// Compares, prints, writes what is asked for.
pub fn run(args: &CompareArgs) -> anyhow::Result<ExitCode> {
    let picture = args.out.as_ref().map(|folder| folder.join(PICTURE));
    outputs::check(&[Some(&args.image), Some(&args.reference), picture.as_ref()], &[args.json.as_ref()])?;
    if let Some(folder) = args.out.as_ref().filter(|folder| folder.exists() && !folder.is_dir()) {
        return Err(Error::file(folder, "is a file; --out takes a folder").into());
    }
    let (image, _) = Layers::read_exr(&args.image)?;
    let (reference, _) = Layers::read_exr(&args.reference)?;
    let comparison = metrics::compare(&image, &reference).map_err(|error| match error {
        Error::Usage(problem) => Error::file(&args.image, format!("against {}: {problem}", args.reference.display())),
        other => other,
    })?;
    let exceeded = args.limits.exceeded(&comparison)?;
    print(&comparison);
    if let Some((folder, path)) = args.out.as_ref().zip(picture) {
        file::create_folder(folder)?;
        file::write(&path, &side_by_side(&image, &reference, &comparison)?)?;
    }
    if let Some(path) = &args.json {
        let CompareArgs { image: image_path, reference, .. } = args;
        let (width, height, exceeded) = (image.width, image.height, &exceeded[..]);
        let report =
            Report { version: VERSION, image: image_path, reference, width, height, comparison: &comparison, exceeded };
        file::write_json(path, &report)?;
    }
    exceeded.iter().for_each(|sentence| say!("{sentence}"));
    Ok(ExitCode::from(u8::from(!exceeded.is_empty())))
}

/// What the parts of the light need of the files.
const NO_DIRECT: &str = "needs the direct layer in both files";
const NO_DIFFUSE: &str = "needs the diffuse layer in the reference, and lit pixels that are wholly diffuse";

/// What --out holds.
const PICTURE: &str = "compare.png";

fn print(comparison: &Comparison) {
    say!("{:>16} {:>9} {:>9} {:>9} {:>9} {:>9}", "", "energy", "rel", "relmse", "p95", "flip");
    let row = |name: &str, m: &Metrics, flip: &str| {
        say!("{name:>16} {:>9.5} {:>9.5} {:>9.6} {:>9.5} {flip:>9}", m.energy, m.rel, m.relmse, m.p95);
    };
    row("total", &comparison.total, &format!("{:.5}", comparison.flip));
    match &comparison.indirect {
        Some(indirect) => row("indirect", indirect, ""),
        None => say!("{:>16}  ({NO_DIRECT}: --aov direct)", "indirect"),
    }
    match (&comparison.indirect, &comparison.indirect_diffuse) {
        (Some(_), Some(diffuse)) => row("indirect_diffuse", diffuse, ""),
        (Some(_), None) => say!("indirect_diffuse  ({NO_DIFFUSE}: --aov diffuse)"),
        (None, _) => {}
    }
    for (name, n) in [("image", comparison.image), ("reference", comparison.reference)] {
        if n.count() > 0 {
            say!("{name}: {} NaN and {} infinite values; their pixels are left out", n.nan, n.inf);
        }
    }
}

impl Limits {
    /// One sentence per limit that does not hold.
    fn exceeded(&self, comparison: &Comparison) -> Result<Vec<String>> {
        let mut sentences = Vec::new();
        for (metric, limit) in &self.metrics {
            let value = metric.of(comparison)?;
            if value > *limit {
                let distance = if metric.name == "energy" { "'s distance from 1" } else { "" };
                sentences.push(format!("{}{distance} is {value:.6}, above {limit}", metric.words()));
            }
        }
        let nonfinite = comparison.image.count();
        let most = self.nonfinite.or((!self.metrics.is_empty()).then_some(0));
        if let Some(most) = most.filter(|most| nonfinite > *most) {
            sentences.push(format!("{nonfinite} values of the image are not finite, more than {most}"));
        }
        Ok(sentences)
    }
}
