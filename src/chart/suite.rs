//! The suite: scenes with cameras, references that know their own error, and rows of anybody's images.
//!
//! `suite/suite.toml` lists the scenes. A reference is the mean of traces with other seeds, and their spread is its
//! standard error. Every row is held against all light by the definition that all charts share.

use std::cmp::Reverse;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use glam::DVec3;
use serde::Deserialize;

use super::export::short;
use super::measure::{ChartScene, Images, ReferenceImage, errors};
use super::row::{Errors, Row, Source};
use crate::error::said;
use crate::lab::table;
use crate::layers::{Layers, relative_noise};
use crate::measure::metrics::noise_in_rel;
use crate::output::exr::Metadata;
use crate::output::{file, read};
use crate::reference::Depth;
use crate::settings::{Bounces, Settings};
use crate::{Error, Result};

/// The content of `suite.toml`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Suite {
    /// Sides of the square images in pixels. The first one is traced, the others are its means.
    pub sides: Vec<u32>,
    /// A trace for each seed.
    pub seeds: Vec<u64>,
    /// Set in every preset that is rendered.
    pub settings: Vec<String>,
    #[serde(rename = "scene")]
    pub scenes: Vec<Entry>,
    #[serde(skip)]
    folder: PathBuf,
}

/// A scene of the suite. The camera is that of its file, in numbers that every program can use.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    pub name: String,
    /// From the suite's folder.
    pub file: PathBuf,
    /// The moment within the file's animation.
    pub time_s: f64,
    pub eye: [f64; 3],
    pub target: [f64; 3],
    pub up: [f64; 3],
    /// Vertical.
    pub fov_degrees: f64,
    /// Of each trace, a pixel.
    pub samples: u32,
}

impl Suite {
    /// Reads `suite.toml` of a folder.
    ///
    /// # Errors
    /// [`Error::File`]: it cannot be read, or is no such file.
    pub fn read(folder: &Path) -> Result<Self> {
        let path = folder.join("suite.toml");
        let wrong =
            |why: &str| Error::file(&path, format!("{why}; write it as this project's suite/suite.toml is written"));
        let suite: Self =
            toml::from_str(&read::text(&path, "list of scenes")?).map_err(|e| wrong(&said(&e.message())))?;
        let divides = |side: &u32| *side > 0 && suite.sides[0].is_multiple_of(*side);
        match suite.seeds.len() > 1 && !suite.sides.is_empty() && suite.sides.iter().all(divides) {
            true => Ok(Self { folder: folder.to_owned(), ..suite }),
            false => Err(wrong("has fewer than two seeds, no sides, or a side that does not divide the first one")),
        }
    }

    /// The scenes of these names; all where none is given.
    ///
    /// # Errors
    /// [`Error::Usage`] for a name that no scene has.
    pub fn named(&self, names: &[String]) -> Result<Vec<&Entry>> {
        let all: Vec<&str> = self.scenes.iter().map(|scene| scene.name.as_str()).collect();
        let find = |name: &String| {
            let wrong = || Error::Usage(format!("the suite has no scene {name:?}; name one of {}", all.join(", ")));
            self.scenes.iter().find(|scene| scene.name == *name).ok_or_else(wrong)
        };
        if names.is_empty() { Ok(self.scenes.iter().collect()) } else { names.iter().map(find).collect() }
    }

    /// The file of a scene.
    pub fn path(&self, scene: &Entry) -> PathBuf {
        self.folder.join(&scene.file)
    }

    /// The files of a reference: the image, and the standard error of its values.
    pub fn files(&self, scene: &Entry, side: u32) -> [PathBuf; 2] {
        ["", "-error"].map(|end| self.folder.join(format!("references/{}-{side}{end}.exr", scene.name)))
    }

    /// A reference of all light, as it was written.
    ///
    /// # Errors
    /// [`Error::File`]: it is missing, or is not of this size.
    pub fn reference(&self, scene: &Entry, side: u32) -> Result<ReferenceImage> {
        let read = |path: PathBuf| match Layers::read_exr(&path) {
            Ok((layers, _)) if (layers.width, layers.height) == (side, side) => Ok(layers),
            _ => {
                let text = format!("is missing or damaged; make it with `twobounce suite {} --references`", scene.name);
                Err(Error::file(path, text))
            }
        };
        let [image, error] = self.files(scene, side).map(read);
        let (layers, error) = (image?, error?);
        let (noise, noise_in_rel) = (noise(&layers, &error), noise_in_rel(&layers, error.beauty()));
        Ok(ReferenceImage { depth: Depth::Full, noise, layers, noise_in_rel })
    }

    /// Writes the references of all sides from traces of the first one. `header`: of the image.
    ///
    /// # Errors
    /// [`Error::File`]: a file cannot be written.
    pub fn write_references(&self, scene: &Entry, traces: &[Layers], header: &Metadata) -> Result<()> {
        file::create_folder(&self.folder.join("references"))?;
        for &side in &self.sides {
            let [image, error] = &mean(traces, side);
            let mut header = header.clone();
            header.insert("noise".into(), format!("{:.6}", noise(image, error)));
            let [image_file, error_file] = self.files(scene, side);
            error.write_exr(&error_file, &header)?;
            image.write_exr(&image_file, &header)?;
        }
        Ok(())
    }

    /// The settings of a row: a preset, those of the suite, then `sets`.
    ///
    /// # Errors
    /// [`Error::Usage`]: there is no such preset or setting, or the light is not all light.
    pub fn row(&self, preset: &str, sets: &[String]) -> Result<Row> {
        let mut settings = Settings::preset(preset)?;
        self.settings.iter().chain(sets).try_for_each(|set| settings.set(set))?;
        match settings.bounces {
            Bounces::All => Ok(Row::of_settings(preset, sets, settings)),
            _ => Err(Error::Usage("--set bounces: the references hold all light; leave it out".into())),
        }
    }
}

/// Root mean square of the pixels' relative error.
fn noise(image: &Layers, error: &Layers) -> f64 {
    let wide = |pixel: &[f32; 3]| DVec3::from(pixel.map(f64::from));
    relative_noise(image.beauty().iter().zip(error.beauty()).map(|(value, error)| (wide(value), wide(error))))
}

/// The mean of traces of a square image and the standard error of that mean, with this side.
fn mean(traces: &[Layers], side: u32) -> [Layers; 2] {
    // Bits of a mantissa, so that files are small: a half has as many, and an error of few traces is not known better.
    const VALUE_BITS: u32 = 10;
    const ERROR_BITS: u32 = 3;
    let (n, first) = (traces.len() as f64, &traces[0]);
    let (mut image, mut error) = (Layers::new(side, side, vec![]), Layers::new(side, side, vec![]));
    image.layers.clear();
    for (at, (aov, _)) in first.layers.iter().enumerate() {
        let small: Vec<Vec<DVec3>> =
            traces.iter().map(|trace| shrunk(&trace.layers[at].1, trace.width, side)).collect();
        let of_all = |pixel: usize| small.iter().map(move |trace| trace[pixel]);
        let means: Vec<DVec3> = (0..small[0].len()).map(|pixel| of_all(pixel).sum::<DVec3>() / n).collect();
        if at == 0 {
            let square = |pixel: usize| of_all(pixel).map(|value| (value - means[pixel]).powf(2.0)).sum::<DVec3>();
            let errors = (0..means.len()).map(|pixel| (square(pixel) / (n * (n - 1.0))).powf(0.5));
            error.layers[0].1 = errors.map(|value| rounded(value, ERROR_BITS)).collect();
        }
        image.layers.push((*aov, means.iter().map(|value| rounded(*value, VALUE_BITS)).collect()));
    }
    [image, error]
}

/// A square image whose pixels are means over blocks of another one's.
fn shrunk(pixels: &[[f32; 3]], from: u32, side: u32) -> Vec<DVec3> {
    let (step, mut sums) = (from / side, vec![DVec3::ZERO; (side * side) as usize]);
    for (at, pixel) in pixels.iter().enumerate() {
        let (x, y) = (at as u32 % from / step, at as u32 / from / step);
        sums[(y * side + x) as usize] += DVec3::from(pixel.map(f64::from)) / f64::from(step * step);
    }
    sums
}

/// The nearest values with so many bits after the first of the mantissa.
fn rounded(value: DVec3, bits: u32) -> [f32; 3] {
    let unit = 1 << (f32::MANTISSA_DIGITS - 1 - bits);
    value.as_vec3().to_array().map(|value| f32::from_bits((value.to_bits() + unit / 2) & !(unit - 1)))
}

/// The columns of `rows.csv`: what a row is, then its errors against all light. Docs: `suite/README.md`.
pub const COLUMNS: [&str; 17] = [
    "scene",
    "side_pixels",
    "name",
    "source",
    "by",
    "device",
    "note",
    "milliseconds",
    "total_rel",
    "total_energy",
    "total_relmse",
    "total_p95",
    "flip",
    "diffuse_rel",
    "diffuse_energy",
    "noise_in_total_rel",
    "noise_in_diffuse_rel",
];

/// Cells in the order of [`COLUMNS`].
#[derive(Clone, Debug, PartialEq)]
struct Line([String; COLUMNS.len()]);

impl Line {
    fn cell(&self, column: &str) -> &str {
        COLUMNS.iter().zip(&self.0).find(|(name, _)| **name == column).map_or("", |(_, cell)| cell)
    }

    fn number(&self, column: &str) -> f64 {
        self.cell(column).parse().unwrap_or(f64::NAN)
    }

    /// What no two rows share.
    fn identity(&self) -> [&str; 5] {
        ["scene", "side_pixels", "name", "device", "by"].map(|column| self.cell(column))
    }

    /// A cell for a Markdown page, in which a given text is no markup.
    fn shown(&self, column: &str) -> String {
        self.cell(column).replace('\\', "\\\\").replace('|', "\\|").replace('<', "&lt;")
    }

    /// A number with so many digits after the point.
    fn rounded(&self, column: &str, digits: usize) -> String {
        let number = self.number(column);
        if number.is_finite() { format!("{number:.digits$}") } else { table::MISSING.to_owned() }
    }
}

/// The rows of `rows.csv`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rows(Vec<Line>);

/// A page for those who have none around the tables.
const PAGE: &str = "# Rows of the suite\n\nErrors are `rel`, against all light; less is better. (a) is the whole image, (b) the indirect light on \
                    diffuse surfaces.\n\n<!-- table: overview -->\n<!-- end -->\n";

impl Rows {
    /// The rows of a folder; none where it has no `rows.csv`.
    ///
    /// # Errors
    /// [`Error::File`]: the folder holds something else.
    pub fn read(folder: &Path) -> Result<Self> {
        let (path, page) = (folder.join("rows.csv"), folder.join("README.md"));
        let other = |path: &Path| Error::file(path, "is no file of the suite; name another folder with -o");
        if folder.is_file() || page.exists() && !read::text(&page, "page")?.contains("<!-- table: overview -->") {
            return Err(other(if folder.is_file() { folder } else { &page }));
        }
        if !path.exists() {
            return Ok(Self::default());
        }
        let (head, lines) = table::from_csv(&read::text(&path, "table of rows")?).map_err(|_| other(&path))?;
        let line = |row: &table::CsvRow| Line(COLUMNS.map(|column| row.cell(column).to_owned()));
        if head == COLUMNS { Ok(Self(lines.iter().map(line).collect())) } else { Err(other(&path)) }
    }

    /// Adds rows, each in the place of that of the same scene, side, name, device and giver.
    pub fn unite(&mut self, others: Self) {
        self.0.retain(|line| others.0.iter().all(|other| other.identity() != line.identity()));
        self.0.extend(others.0);
    }

    /// Adds a row and says it in a line. `device`: on which it was measured.
    pub fn add(&mut self, of: &ChartScene, row: &Row, Judged { errors, milliseconds, device }: Judged) -> String {
        let (source, by, note) = match &row.source {
            Source::Settings => ("preset", None, Some(row.changes.join(" "))),
            Source::PathTracer { .. } => ("path tracer", None, None),
            Source::Import(claim) => ("other program", claim.by.clone(), claim.note.clone()),
        };
        let (total, diffuse) = (errors.metrics.total, errors.metrics.diffuse);
        let number = |value: Option<f64>| value.map_or(String::new(), short);
        let mut cells =
            [of.name.as_str(), &of.options.size.0.to_string(), &row.name, source].map(str::to_owned).to_vec();
        cells.extend([by.unwrap_or_default(), device, note.unwrap_or_default()]);
        cells.extend([milliseconds, total.rel, total.energy, total.relmse, total.p95, errors.flip].map(short));
        cells.extend([diffuse.map(|d| d.rel), diffuse.map(|d| d.energy)].map(number));
        cells.extend([Some(errors.noise_in_rel.total), errors.noise_in_rel.diffuse].map(number));
        let line = Line(cells.try_into().expect("a cell for each column"));
        let mut said = format!("{} {}, {}: {milliseconds:.1} ms", of.name, of.options.size.0, row.name);
        let _ = write!(said, ", rel {:.4} of all light, at most {:.4} by", total.rel, errors.noise_in_rel.total);
        said += " the reference's noise";
        self.unite(Self(vec![line]));
        said
    }

    /// The rows as CSV, in the order of the suite.
    pub fn csv(&self, suite: &Suite) -> String {
        let mut lines: Vec<&Line> = self.0.iter().collect();
        let place = |line: &&Line| suite.scenes.iter().position(|scene| scene.name == line.cell("scene"));
        let text = |line: &Line| line.identity().map(str::to_owned);
        lines.sort_by_key(|line| (place(line), Reverse(line.number("side_pixels") as u64), text(line)));
        table::to_csv(std::iter::once(COLUMNS.map(str::to_owned)).chain(lines.into_iter().map(|line| line.0.clone())))
    }

    /// The page with its tables filled.
    ///
    /// # Errors
    /// A mark of a table without an end, and a reference that a table needs and that is missing.
    pub fn fill(&self, suite: &Suite, page: &str) -> Result<String> {
        table::fill(page, |name, old| match (name, name.strip_prefix("rows ")) {
            ("cameras", _) => Ok(cameras(suite)),
            ("references", _) => references(suite),
            ("overview", _) => Ok(self.overview(suite)),
            (_, Some(scene)) => Ok(self.of_scene(scene)),
            _ => Ok(old.to_owned()),
        })
    }

    /// Every row's error of the whole image, scene by scene, at the first side.
    fn overview(&self, suite: &Suite) -> String {
        let is_large = |line: &&Line| line.number("side_pixels") == f64::from(suite.sides[0]);
        let large: Vec<&Line> = self.0.iter().filter(is_large).collect();
        let mut names: Vec<[String; 3]> =
            large.iter().map(|line| ["source", "name", "device"].map(|column| line.shown(column))).collect();
        names.sort();
        names.dedup();
        let cell = |names: &[String; 3], scene: &Entry| {
            let of = |line: &&&Line| {
                line.cell("scene") == scene.name
                    && ["source", "name", "device"].map(|column| line.shown(column)) == *names
            };
            large.iter().find(of).map_or(table::MISSING.to_owned(), |line| line.rounded("total_rel", 3))
        };
        let row = |names: &[String; 3]| {
            let cells: Vec<String> = suite.scenes.iter().map(|scene| cell(names, scene)).collect();
            [&[names[1].clone(), names[0].clone(), names[2].clone()][..], &cells].concat()
        };
        let scenes = suite.scenes.iter().map(|scene| scene.name.as_str());
        table::markdown(["row", "source", "device"].into_iter().chain(scenes), "---:", names.iter().map(row))
    }

    /// The rows of a scene, of each size the one with the least error first.
    fn of_scene(&self, scene: &str) -> String {
        const HEAD: [&str; 9] =
            ["row", "pixels", "ms", "(a) rel", "(a) energy", "(b) rel", "(b) energy", "device", "how"];
        let mut lines: Vec<&Line> = self.0.iter().filter(|line| line.cell("scene") == scene).collect();
        let order = |line: &Line| (-line.number("side_pixels"), line.number("total_rel"));
        lines.sort_by(|a, b| order(a).partial_cmp(&order(b)).unwrap_or(std::cmp::Ordering::Equal));
        let row = |line: &&Line| {
            let digits = usize::from(line.number("milliseconds") < 10.0);
            let how = match line.cell("note") {
                "" => line.shown("source"),
                _ if line.cell("source") == "preset" => "preset".to_owned(),
                _ => line.shown("note"),
            };
            let side = line.cell("side_pixels");
            let numbers = [
                ("milliseconds", digits),
                ("total_rel", 4),
                ("total_energy", 3),
                ("diffuse_rel", 4),
                ("diffuse_energy", 3),
            ];
            let numbers = numbers.map(|(column, digits)| line.rounded(column, digits));
            [&[line.shown("name"), format!("{side}×{side}")][..], &numbers, &[line.shown("device"), how]].concat()
        };
        table::markdown(HEAD, "-::::::-", lines.iter().map(row))
    }

    /// Writes the rows and fills the pages of a folder; where it has no page, one is made.
    ///
    /// # Errors
    /// [`Error::File`]: a file cannot be written. As [`Self::fill`].
    pub fn write(&self, suite: &Suite, folder: &Path) -> Result<()> {
        file::create_folder(folder)?;
        file::write(&folder.join("rows.csv"), self.csv(suite).as_bytes())?;
        let page = folder.join("README.md");
        if !page.exists() {
            let mut text = PAGE.to_owned();
            for scene in suite.scenes.iter().filter(|scene| self.0.iter().any(|line| line.cell("scene") == scene.name))
            {
                let _ = write!(text, "\n## {0}\n\n<!-- table: rows {0} -->\n<!-- end -->\n", scene.name);
            }
            file::write(&page, text.as_bytes())?;
        }
        let pages = suite.scenes.iter().map(|scene| folder.join(format!("{}.md", scene.name)));
        for page in std::iter::once(page).chain(pages).filter(|page| page.exists()) {
            let text = read::text(&page, "page")?;
            file::write(&page, self.fill(suite, &text)?.as_bytes())?;
        }
        Ok(())
    }
}

/// A row's errors, time and device.
pub struct Judged {
    pub errors: Errors,
    pub milliseconds: f64,
    pub device: String,
}

/// The errors of a row's images against all light.
///
/// # Errors
/// [`Error::Usage`] for an image without a finite pixel.
pub fn judge(scene: &ChartScene, row: &Row, images: &Images) -> Result<Errors> {
    errors(images, row.subtract(scene), &scene.references[0])
}

fn cameras(suite: &Suite) -> String {
    let point = |point: &[f64; 3]| point.map(|value| value.to_string()).join(", ");
    let row = |scene: &Entry| {
        let Entry { name, eye, target, up, fov_degrees, time_s, .. } = scene;
        let page = format!("[{name}]({name}.md)");
        [page, point(eye), point(target), point(up), fov_degrees.to_string(), time_s.to_string()]
    };
    table::markdown(["scene", "eye", "target", "up", "field of view", "time"], "----::", suite.scenes.iter().map(row))
}

fn references(suite: &Suite) -> Result<String> {
    let mut rows = Vec::new();
    for scene in &suite.scenes {
        let samples = u64::from(scene.samples) * suite.seeds.len() as u64;
        for &side in &suite.sides {
            let reference = suite.reference(scene, side)?;
            let traced = samples * u64::from(suite.sides[0] / side).pow(2);
            let diffuse = reference.noise_in_rel.diffuse.unwrap_or(f64::NAN);
            let floors = [reference.noise_in_rel.total, diffuse].map(|floor| format!("{floor:.4}"));
            let [total, diffuse] = floors;
            let noise = format!("{:.2} %", 100.0 * reference.noise);
            rows.push([scene.name.clone(), format!("{side}×{side}"), traced.to_string(), noise, total, diffuse]);
        }
    }
    let head = ["scene", "pixels", "paths a pixel", "noise", "most noise in (a)", "most noise in (b)"];
    Ok(table::markdown(head, "--:", rows))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layers::Aov;

    #[test]
    fn a_reference_is_a_mean_and_its_standard_error() {
        let trace = |values: [f32; 4]| {
            let pixels = values.map(|value| [value; 3]).to_vec();
            Layers { width: 2, height: 2, layers: vec![(Aov::Beauty, pixels.clone()), (Aov::Direct, pixels)] }
        };
        let traces = [trace([1.0, 1.0, 1.0, 1.0]), trace([3.0, 1.0, 1.0, 3.0])];
        let [image, error] = mean(&traces, 2);
        assert_eq!(image.beauty().iter().map(|p| p[0]).collect::<Vec<_>>(), [2.0, 1.0, 1.0, 2.0]);
        assert_eq!(image.get(Aov::Direct), Some(image.beauty()));
        // Two values that are 2 apart: their variance is 2, that of their mean 1.
        assert_eq!(error.beauty().iter().map(|p| p[0]).collect::<Vec<_>>(), [1.0, 0.0, 0.0, 1.0]);
        let [image, error] = mean(&traces, 1);
        // The pixel's two values are 1 and 2.
        assert_eq!((image.beauty()[0][0], error.beauty()[0][0]), (1.5, 0.5));
        let step = 1.0 / 1024.0; // between 1 and 2, of 10 bits
        let values = DVec3::new(1.0 + 0.4 * step, 1.0 + 0.6 * step, -1.01);
        assert_eq!(rounded(values, 10), [1.0, 1.0 + step as f32, -1.0097656]);
    }
}
