//! `twobounce compare`: an image against its reference, as numbers, as a picture, and as an exit code.

use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;
use twobounce::layers::Layers;
use twobounce::measure::metrics::{self, Comparison, Metrics, NonFinite};
use twobounce::measure::picture;
use twobounce::output::file;
use twobounce::{Error, Result};

use super::Outcome;
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
#[derive(Args, Debug)]
pub struct Limits {
    /// Exit with 1 if energy is further than this from 1
    #[arg(long, value_name = "X", value_parser = limit)]
    pub max_energy: Option<f64>,
    /// Exit with 1 if rel is above this
    #[arg(long, value_name = "X", value_parser = limit)]
    pub max_rel: Option<f64>,
    /// Exit with 1 if relmse is above this
    #[arg(long, value_name = "X", value_parser = limit)]
    pub max_relmse: Option<f64>,
    /// Exit with 1 if p95 is above this
    #[arg(long, value_name = "X", value_parser = limit)]
    pub max_p95: Option<f64>,
    /// Exit with 1 if flip is above this
    #[arg(long, value_name = "X", value_parser = limit)]
    pub max_flip: Option<f64>,
    /// Exit with 1 if the indirect part's energy is further than this from 1
    #[arg(long, value_name = "X", value_parser = limit)]
    pub max_indirect_energy: Option<f64>,
    /// Exit with 1 if the indirect part's rel is above this
    #[arg(long, value_name = "X", value_parser = limit)]
    pub max_indirect_rel: Option<f64>,
    /// Exit with 1 if the indirect part's relmse is above this
    #[arg(long, value_name = "X", value_parser = limit)]
    pub max_indirect_relmse: Option<f64>,
    /// Exit with 1 if the indirect part's p95 is above this
    #[arg(long, value_name = "X", value_parser = limit)]
    pub max_indirect_p95: Option<f64>,
    /// Exit with 1 if the energy of indirect_diffuse is further than this from 1
    #[arg(long, value_name = "X", value_parser = limit)]
    pub max_indirect_diffuse_energy: Option<f64>,
    /// Exit with 1 if the rel of indirect_diffuse is above this
    #[arg(long, value_name = "X", value_parser = limit)]
    pub max_indirect_diffuse_rel: Option<f64>,
    /// Exit with 1 if the relmse of indirect_diffuse is above this
    #[arg(long, value_name = "X", value_parser = limit)]
    pub max_indirect_diffuse_relmse: Option<f64>,
    /// Exit with 1 if the p95 of indirect_diffuse is above this
    #[arg(long, value_name = "X", value_parser = limit)]
    pub max_indirect_diffuse_p95: Option<f64>,
    /// Exit with 1 if more values of the image than this are NaN or infinite [default: 0 with any other limit]
    #[arg(long, value_name = "N")]
    pub max_nonfinite: Option<usize>,
}

fn limit(text: &str) -> std::result::Result<f64, String> {
    text.parse().ok().filter(|x: &f64| x.is_finite() && *x >= 0.0).ok_or_else(|| "write a number, at least 0".into())
}

/// The JSON report. Metrics have no unit; see the docs of each.
#[derive(Serialize)]
struct Report<'a> {
    version: u32,
    image: &'a Path,
    reference: &'a Path,
    width: u32,
    height: u32,
    /// energy rel relmse p95 of the whole image.
    total: Metrics,
    /// Mean LDR-FLIP of the whole image.
    flip: f64,
    /// energy rel relmse p95 of total − direct; null unless both files carry their direct layer.
    indirect: Option<Metrics>,
    /// The same over pixels in which the reference shows diffuse surfaces alone; null unless its file carries its diffuse
    /// layer too, with such pixels, and indirect light in them.
    indirect_diffuse: Option<Metrics>,
    /// Values that are NaN or infinite; their pixels count in no metric.
    image_nonfinite: NonFinite,
    reference_nonfinite: NonFinite,
    /// One sentence per exceeded limit.
    exceeded: &'a [String],
}

/// Compares, prints, writes what is asked for.
pub fn run(args: &CompareArgs) -> anyhow::Result<Outcome> {
    check_targets(args)?;
    let (image, _) = Layers::read_exr(&args.image)?;
    let (reference, _) = Layers::read_exr(&args.reference)?;
    let comparison = metrics::compare(&image, &reference).map_err(|error| match error {
        Error::Usage(problem) => Error::file(&args.image, format!("against {}: {problem}", args.reference.display())),
        other => other,
    })?;
    let exceeded = args.limits.exceeded(&comparison)?;
    print(&comparison);
    if let Some(folder) = &args.out {
        std::fs::create_dir_all(folder).map_err(|e| Error::file(folder, format!("cannot be created: {e}")))?;
        let path = folder.join(PICTURE);
        file::write(&path, &picture::side_by_side(&image, &reference, &comparison)?)?;
    }
    if let Some(path) = &args.json {
        let report = Report {
            version: VERSION,
            image: &args.image,
            reference: &args.reference,
            width: image.width,
            height: image.height,
            total: comparison.total,
            flip: comparison.flip,
            indirect: comparison.indirect,
            indirect_diffuse: comparison.indirect_diffuse,
            image_nonfinite: comparison.image,
            reference_nonfinite: comparison.reference,
            exceeded: &exceeded,
        };
        file::write(path, (serde_json::to_string_pretty(&report)? + "\n").as_bytes())?;
    }
    exceeded.iter().for_each(|sentence| say!("{sentence}"));
    Ok(if exceeded.is_empty() { Outcome::Done } else { Outcome::Exceeded })
}

/// What the parts of the light need of the files.
const NO_DIRECT: &str = "needs the direct layer in both files";
const NO_DIFFUSE: &str = "needs the diffuse layer in the reference, and lit pixels that are wholly diffuse";

/// What --out holds.
const PICTURE: &str = "compare.png";

fn check_targets(args: &CompareArgs) -> Result<()> {
    if let Some(folder) = args.out.as_ref().filter(|f| f.exists() && !f.is_dir()) {
        return Err(Error::file(folder, "is a file; --out takes a folder"));
    }
    match &args.json {
        Some(path) if [&args.image, &args.reference].iter().any(|input| file::is_same(path, input)) => {
            Err(Error::file(path, "is read and written by the same command; name another file for --json"))
        }
        Some(path) if args.out.as_ref().is_some_and(|out| file::is_same(path, &out.join(PICTURE))) => {
            Err(Error::file(path, "is the picture of --out; name another file for --json"))
        }
        Some(path) => file::check_writable(path),
        None => Ok(()),
    }
}

fn print(comparison: &Comparison) {
    say!("{:>16} {:>9} {:>9} {:>9} {:>9} {:>9}", "", "energy", "rel", "relmse", "p95", "flip");
    let row = |name: &str, m: &Metrics, flip: &str| {
        say!("{name:>16} {:>9.5} {:>9.5} {:>9.6} {:>9.5} {flip:>9}", m.energy, m.rel, m.relmse, m.p95);
    };
    row("total", &comparison.total, &format!("{:.5}", comparison.flip));
    match (&comparison.indirect, &comparison.indirect_diffuse) {
        (Some(indirect), Some(diffuse)) => {
            row("indirect", indirect, "");
            row("indirect_diffuse", diffuse, "");
        }
        (Some(indirect), None) => {
            row("indirect", indirect, "");
            say!("indirect_diffuse  ({NO_DIFFUSE}: --aov diffuse)");
        }
        (None, _) => say!("{:>16}  ({NO_DIRECT}: --aov direct)", "indirect"),
    }
    for (name, n) in [("image", comparison.image), ("reference", comparison.reference)] {
        if n.count() > 0 {
            say!("{name}: {} NaN and {} infinite values; their pixels are left out", n.nan, n.inf);
        }
    }
}

impl Limits {
    /// One sentence per limit that does not hold.
    fn exceeded(&self, c: &Comparison) -> Result<Vec<String>> {
        let mut limits = vec![
            ("energy's distance from 1".to_owned(), self.max_energy, (c.total.energy - 1.0).abs()),
            ("rel".to_owned(), self.max_rel, c.total.rel),
            ("relmse".to_owned(), self.max_relmse, c.total.relmse),
            ("p95".to_owned(), self.max_p95, c.total.p95),
            ("flip".to_owned(), self.max_flip, c.flip),
        ];
        let parts = [
            (
                "indirect",
                c.indirect,
                format!("{NO_DIRECT}; render them with --aov direct"),
                [self.max_indirect_energy, self.max_indirect_rel, self.max_indirect_relmse, self.max_indirect_p95],
            ),
            (
                "indirect_diffuse",
                c.indirect_diffuse,
                format!("{NO_DIRECT}, and {NO_DIFFUSE}; render it with --aov direct,diffuse"),
                [
                    self.max_indirect_diffuse_energy,
                    self.max_indirect_diffuse_rel,
                    self.max_indirect_diffuse_relmse,
                    self.max_indirect_diffuse_p95,
                ],
            ),
        ];
        for (part, metrics, needs, [energy, rel, relmse, p95]) in parts {
            match metrics {
                Some(m) => limits.extend([
                    (format!("{part} energy's distance from 1"), energy, (m.energy - 1.0).abs()),
                    (format!("{part} rel"), rel, m.rel),
                    (format!("{part} relmse"), relmse, m.relmse),
                    (format!("{part} p95"), p95, m.p95),
                ]),
                None if [energy, rel, relmse, p95].iter().any(Option::is_some) => {
                    return Err(Error::Usage(format!("a limit on {part} {needs}")));
                }
                None => {}
            }
        }
        let nonfinite = self.max_nonfinite.or(limits.iter().any(|l| l.1.is_some()).then_some(0));
        let above = limits.into_iter().filter_map(|(name, limit, value)| Some((name, limit?, value)));
        let mut sentences: Vec<_> = above
            .filter(|(_, limit, value)| value > limit)
            .map(|(name, limit, value)| format!("{name} is {value:.6}, above {limit}"))
            .collect();
        if let Some(most) = nonfinite.filter(|n| c.image.count() > *n) {
            sentences.push(format!("{} values of the image are not finite, more than {most}", c.image.count()));
        }
        Ok(sentences)
    }
}
