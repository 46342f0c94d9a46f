//! `twobounce compare`: an image against its reference, as numbers, a picture, and an exit code.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use twobounce::layers::Layers;
use twobounce::measure::metrics::{self, Comparison, Metrics, Part};
use twobounce::measure::picture::side_by_side;
use twobounce::output::file;
use twobounce::{Error, Result};

use super::args::number;
use super::{outputs, threads};
use crate::say;

/// Version of the JSON report.
const VERSION: u32 = 1;

#[derive(Args, Debug)]
#[command(after_help = COLUMNS)]
pub struct CompareArgs {
    /// The image to compare
    #[arg(value_name = "IMAGE.exr")]
    pub image: PathBuf,
    /// The reference. The row indirect needs a direct layer in both files, and the row indirect_diffuse also a diffuse
    /// layer in this one (`twobounce reference --aov direct,diffuse`)
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

/// The printed columns and rows, for `--help`.
const COLUMNS: &str = "The columns of the output, over the pixels of a row (best value in brackets):
  energy  sum of the image over sum of the reference (1)
  rel     sum of |image - reference| over sum of the reference (0)
  relmse  mean of the squared relative error of a pixel (0)
  p95     relative error that 95 % of the pixels do not exceed (0)
  flip    mean visible difference by NVIDIA's LDR-FLIP, of the whole image (0)
The rows:
  total             the whole image
  indirect          image and reference without their direct layers
  indirect_diffuse  the same over pixels of diffuse surfaces: no metal, glass or sky
docs/accuracy.md has the formulas.";

/// Declares a flag per limit, each with its description and the limited number.
macro_rules! limits {
    ($($flag:ident: $words:literal is |$of:ident| $number:expr;)+) => {
        /// Limits; the exit code is 1 if one is exceeded.
        #[derive(Args, Debug)]
        pub struct Limits {
            $(
                #[arg(long, value_name = "X", help = concat!("Exit with 1 if ", $words, " is above this"), allow_negative_numbers = true)]
                #[arg(value_parser = number(|x| x >= 0.0, "write a number, at least 0"))]
                pub $flag: Option<f64>,
            )+
            /// Exit with 1 if more than this number of the image's values are NaN or infinite [default: 0 with any
            /// other limit]
            #[arg(long, value_name = "N")]
            pub max_nonfinite: Option<usize>,
        }

        impl Limits {
            /// The description of each given limit, the limit, and the limited number.
            fn given(&self, compared: &Compared) -> Result<Vec<(&'static str, f64, f64)>> {
                let mut given = Vec::new();
                $(if let Some(limit) = self.$flag {
                    let $of = compared;
                    given.push(($words, limit, $number));
                })+
                Ok(given)
            }
        }
    };
}

limits! {
    max_energy: "energy's distance from 1" is |of| (of.metrics(Part::Total)?.energy - 1.0).abs();
    max_rel: "rel" is |of| of.metrics(Part::Total)?.rel;
    max_relmse: "relmse" is |of| of.metrics(Part::Total)?.relmse;
    max_p95: "p95" is |of| of.metrics(Part::Total)?.p95;
    max_flip: "flip" is |of| of.comparison.flip;
    max_indirect_energy: "indirect energy's distance from 1" is |of| (of.metrics(Part::Indirect)?.energy - 1.0).abs();
    max_indirect_rel: "indirect rel" is |of| of.metrics(Part::Indirect)?.rel;
    max_indirect_relmse: "indirect relmse" is |of| of.metrics(Part::Indirect)?.relmse;
    max_indirect_p95: "indirect p95" is |of| of.metrics(Part::Indirect)?.p95;
    max_indirect_diffuse_energy: "indirect_diffuse energy's distance from 1" is |of| (of.metrics(Part::Diffuse)?.energy - 1.0).abs();
    max_indirect_diffuse_rel: "indirect_diffuse rel" is |of| of.metrics(Part::Diffuse)?.rel;
    max_indirect_diffuse_relmse: "indirect_diffuse relmse" is |of| of.metrics(Part::Diffuse)?.relmse;
    max_indirect_diffuse_p95: "indirect_diffuse p95" is |of| of.metrics(Part::Diffuse)?.p95;
}

/// Two compared images.
struct Compared {
    comparison: Comparison,
    /// The settings with which the image must be rendered again before its indirect light can be compared; empty if it
    /// can be.
    needs: String,
}

impl Compared {
    /// The reason why the indirect light is not compared.
    fn why_not(&self) -> String {
        if self.needs.is_empty() {
            return format!("{NO_DIRECT}; render them with --aov direct");
        }
        let flags: Vec<String> = self.needs.split(' ').map(|change| format!("--set {change}")).collect();
        format!("needs exact direct light in the image: render it again with {} --aov direct", flags.join(" "))
    }

    /// The metrics of a part of the light, for a limit on it.
    fn metrics(&self, part: Part) -> Result<Metrics> {
        let (name, found) = match part {
            Part::Total => return Ok(self.comparison.total),
            Part::Indirect => ("indirect", self.comparison.indirect),
            Part::Diffuse => ("indirect_diffuse", self.comparison.indirect_diffuse),
        };
        let why = match (part, self.needs.is_empty()) {
            (Part::Diffuse, true) => format!("{NO_DIRECT}, and {NO_DIFFUSE}; render it with --aov direct,diffuse"),
            _ => self.why_not(),
        };
        found.ok_or_else(|| Error::Usage(format!("a limit on {name} {why}")))
    }
}

/// Compares, prints and writes the requested results.
pub fn run(args: &CompareArgs) -> anyhow::Result<ExitCode> {
    let picture = args.out.as_ref().map(|folder| folder.join(PICTURE));
    outputs::check(&[Some(&args.image), Some(&args.reference), picture.as_ref()], &[args.json.as_ref()])?;
    threads::start_pool()?;
    if let Some(folder) = args.out.as_ref().filter(|folder| folder.exists() && !folder.is_dir()) {
        return Err(Error::file(folder, "is a file; --out takes a folder").into());
    }
    [&args.image, &args.reference].into_iter().try_for_each(|path| outputs::refuse_display_image(path))?;
    let (image, header) = Layers::read_exr(&args.image)?;
    let (reference, reference_header) = Layers::read_exr(&args.reference)?;
    let (comparison, needs) =
        metrics::compare_files(&image, &reference, [&header, &reference_header]).map_err(|error| match error {
            Error::Usage(problem) => {
                Error::file(&args.image, format!("against {}: {problem}", args.reference.display()))
            }
            other => other,
        })?;
    let compared = Compared { comparison, needs };
    let exceeded = args.limits.exceeded(&compared)?;
    print(&compared);
    let comparison = &compared.comparison;
    if let Some((folder, path)) = args.out.as_ref().zip(picture) {
        file::create_folder(folder)?;
        file::write(&path, &side_by_side(&image, &reference, comparison)?)?;
    }
    if let Some(path) = &args.json {
        let mut report = serde_json::to_value(comparison)?;
        report["version"] = VERSION.into();
        report["image"] = serde_json::to_value(&args.image)?;
        report["reference"] = serde_json::to_value(&args.reference)?;
        report["width"] = image.width.into();
        report["height"] = image.height.into();
        // One sentence per exceeded limit.
        report["exceeded"] = exceeded.clone().into();
        file::write_json(path, &report)?;
    }
    exceeded.iter().for_each(|sentence| say!("{sentence}"));
    Ok(ExitCode::from(u8::from(!exceeded.is_empty())))
}

/// The reason for missing layers of a part of the light.
const NO_DIRECT: &str = "needs the direct layer in both files";
const NO_DIFFUSE: &str = "needs the diffuse layer in the reference, and lit pixels that are wholly diffuse";

/// Name of the picture in the folder of --out.
const PICTURE: &str = "compare.png";

fn print(compared: &Compared) {
    let comparison = &compared.comparison;
    say!("{:>16} {:>9} {:>9} {:>9} {:>9} {:>9}", "", "energy", "rel", "relmse", "p95", "flip");
    let row = |name: &str, m: &Metrics, flip: &str| {
        say!("{name:>16} {:>9.5} {:>9.5} {:>9.6} {:>9.5} {flip:>9}", m.energy, m.rel, m.relmse, m.p95);
    };
    row("total", &comparison.total, &format!("{:.5}", comparison.flip));
    match &comparison.indirect {
        Some(indirect) => row("indirect", indirect, ""),
        None => say!("{:>16}  {}", "indirect", compared.why_not()),
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
    /// One sentence per exceeded limit.
    fn exceeded(&self, compared: &Compared) -> Result<Vec<String>> {
        let given = self.given(compared)?;
        let above = given.iter().filter(|(_, limit, number)| number > limit);
        let mut sentences: Vec<_> =
            above.map(|(words, limit, number)| format!("{words} is {number:.6}, above {limit}")).collect();
        let nonfinite = compared.comparison.image.count();
        let most = self.max_nonfinite.or((!given.is_empty()).then_some(0));
        if let Some(most) = most.filter(|most| nonfinite > *most) {
            sentences.push(format!("{nonfinite} values of the image are not finite, more than {most}"));
        }
        Ok(sentences)
    }
}
