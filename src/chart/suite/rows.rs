//! Rows of the suite, `rows.csv`, and its pages.

use std::cmp::Reverse;
use std::fmt::Write as _;
use std::path::Path;

use super::{Entry, Suite};
use crate::chart::export::short;
use crate::chart::measure::ChartScene;
use crate::chart::row::{Errors, Row, Source};
use crate::lab::table;
use crate::output::{file, read};
use crate::{Error, Result};

/// The columns of `rows.csv`: the row's identity, then its errors against all light. Documented in `suite/README.md`.
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
struct SuiteLine([String; COLUMNS.len()]);

impl SuiteLine {
    fn cell(&self, column: &str) -> &str {
        COLUMNS.iter().zip(&self.0).find(|(name, _)| **name == column).map_or("", |(_, cell)| cell)
    }

    fn number(&self, column: &str) -> f64 {
        self.cell(column).parse().unwrap_or(f64::NAN)
    }

    /// The cells that identify a row.
    fn identity(&self) -> [&str; 5] {
        ["scene", "side_pixels", "name", "device", "by"].map(|column| self.cell(column))
    }

    /// A cell for a Markdown page, with markup escaped in texts of others.
    fn shown(&self, column: &str) -> String {
        self.cell(column).replace('\\', "\\\\").replace('|', "\\|").replace('<', "&lt;")
    }

    /// The cells that identify a row of the overview, in the order of sorting: source, name and device.
    fn names(&self) -> [String; 3] {
        ["source", "name", "device"].map(|column| self.shown(column))
    }

    /// A number with `digits` decimals.
    fn rounded(&self, column: &str, digits: usize) -> String {
        let number = self.number(column);
        if number.is_finite() { format!("{number:.digits$}") } else { table::MISSING.to_owned() }
    }
}

/// The rows of `rows.csv`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rows(Vec<SuiteLine>);

/// A page for folders without their own.
const PAGE: &str = "# Rows of the suite\n\nErrors are `rel`, against all light; less is better. (a) is the whole image, (b) the indirect light on \
                    diffuse surfaces.\n\n<!-- table: overview -->\n<!-- end -->\n";

impl Rows {
    /// The rows of a folder; empty if it has no `rows.csv`.
    ///
    /// # Errors
    /// [`Error::File`] if the file has another format.
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
        let line = |row: &table::CsvRow| SuiteLine(COLUMNS.map(|column| row.cell(column).to_owned()));
        if head == COLUMNS { Ok(Self(lines.iter().map(line).collect())) } else { Err(other(&path)) }
    }

    /// Adds rows. Each replaces a row with the same scene, side, name, device and giver.
    pub fn unite(&mut self, others: Self) {
        self.0.retain(|line| others.0.iter().all(|other| other.identity() != line.identity()));
        self.0.extend(others.0);
    }

    /// Adds a row and prints it in a line. `device` is the device of the measurement.
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
        let line = SuiteLine(cells.try_into().expect("a cell for each column"));
        let mut said = format!("{} {}, {}: {milliseconds:.1} ms", of.name, of.options.size.0, row.name);
        let _ = write!(said, ", rel {:.4} of all light, at most {:.4} by", total.rel, errors.noise_in_rel.total);
        said += " the reference's noise";
        self.unite(Self(vec![line]));
        said
    }

    /// The rows as CSV, in the order of the suite.
    pub fn csv(&self, suite: &Suite) -> String {
        let mut lines: Vec<&SuiteLine> = self.0.iter().collect();
        let place = |line: &&SuiteLine| suite.scenes.iter().position(|scene| scene.name == line.cell("scene"));
        let text = |line: &SuiteLine| line.identity().map(str::to_owned);
        lines.sort_by_key(|line| (place(line), Reverse(line.number("side_pixels") as u64), text(line)));
        table::to_csv(std::iter::once(COLUMNS.map(str::to_owned)).chain(lines.into_iter().map(|line| line.0.clone())))
    }

    /// The page with its tables filled.
    ///
    /// # Errors
    /// The page has a mark of a table without an end, or a reference for a table is missing.
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
        let is_large = |line: &&SuiteLine| line.number("side_pixels") == f64::from(suite.sides[0]);
        let large: Vec<&SuiteLine> = self.0.iter().filter(is_large).collect();
        let mut names: Vec<[String; 3]> = large.iter().map(|line| line.names()).collect();
        names.sort();
        names.dedup();
        let cell = |names: &[String; 3], scene: &Entry| {
            let of = |line: &&&SuiteLine| line.cell("scene") == scene.name && line.names() == *names;
            large.iter().find(of).map_or(table::MISSING.to_owned(), |line| line.rounded("total_rel", 3))
        };
        let row = |names: &[String; 3]| {
            let cells: Vec<String> = suite.scenes.iter().map(|scene| cell(names, scene)).collect();
            [&[names[1].clone(), names[0].clone(), names[2].clone()][..], &cells].concat()
        };
        let scenes = suite.scenes.iter().map(|scene| scene.name.as_str());
        table::markdown(["row", "source", "device"].into_iter().chain(scenes), "---:", names.iter().map(row))
    }

    /// The rows of a scene, for each size by increasing error.
    fn of_scene(&self, scene: &str) -> String {
        const HEAD: [&str; 9] =
            ["row", "pixels", "ms", "(a) rel", "(a) energy", "(b) rel", "(b) energy", "device", "how"];
        let mut lines: Vec<&SuiteLine> = self.0.iter().filter(|line| line.cell("scene") == scene).collect();
        let order = |line: &SuiteLine| (-line.number("side_pixels"), line.number("total_rel"));
        lines.sort_by(|a, b| order(a).partial_cmp(&order(b)).unwrap_or(std::cmp::Ordering::Equal));
        let row = |line: &&SuiteLine| {
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

    /// Writes the rows and fills the pages of a folder, which is created if it is missing.
    ///
    /// # Errors
    /// [`Error::File`] if a file cannot be written; also as [`Self::fill`].
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
