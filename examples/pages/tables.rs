//! Tables of measured numbers in Markdown pages, filled from the rows of the study. `cargo run --release --example
//! pages -- strengths` writes them, and tests compare them with the rows.

use std::path::Path;

use twobounce::lab::table::{CsvRow, MISSING, markdown, read_csv};
use twobounce::settings::PRESETS;
use twobounce::{Error, Result};

/// The pages that hold tables, from the project's root.
pub const PAGES: &[&str] = &["README.md", "docs/accuracy.md", "docs/notes/strengths.md"];

/// The rows for the tables, from the project's root, and the scenes of each that `docs/notes/strengths.md` quotes.
pub const ROWS: &[(&str, &[&str])] = &[
    ("docs/notes/study/rows.csv", &["cornell-area", "cornell-point", "gallery"]),
    ("docs/notes/study/rooms/rows.csv", &["thick-walls", "atrium"]),
];

/// The presets in the order of every table. Presets without a row are left out.
pub const ORDER: &[&str] = &[
    "fast",
    "balanced",
    "accurate",
    "cones",
    "corrected-16",
    "corrected",
    "printed",
    "photons",
    "photons-printed",
    "lpv",
    "lpv-printed",
    "paths",
    "probes",
];

/// The presets of `docs/notes/strengths.md`, one for each way to use a method.
pub const CHOSEN: &[&str] = &["fast", "balanced", "accurate", "cones", "lpv", "photons", "paths", "probes"];

/// The scene of the table of presets.
const SCENE: &str = "gallery";

/// The rows of the files that fill tables.
pub fn rows(root: &Path) -> Result<Vec<CsvRow>> {
    Ok(ROWS.iter().map(|(name, _)| read_csv(&root.join(name))).collect::<Result<Vec<_>>>()?.concat())
}

/// The text of a table. `old`: the present text, for a table that is not made from rows.
///
/// # Errors
/// A message about a name that no table has.
pub fn table(name: &str, rows: &[CsvRow], old: &str) -> Result<String> {
    match name.split_once(' ') {
        None if name == "presets" => Ok(presets(rows)),
        None if name == "measured" => Ok(old.to_owned()),
        Some(("errors", scene)) => Ok(errors(rows, scene)),
        Some(("scenes", what)) => Ok(scenes(rows, what)),
        _ => {
            Err(Error::Usage(format!("there is no table {name}: presets, measured, errors SCENE and scenes WHAT are")))
        }
    }
}

/// Whether the row shows this preset on this scene, changed only by settings that the whole study changes.
fn find<'a>(rows: &'a [CsvRow], scene: &str, preset: &str) -> Option<&'a CsvRow> {
    rows.iter().find(|row| row.cell("scene") == scene && row.cell("name") == preset)
}

/// The presets' rows on a scene, in the order of the tables.
fn of_scene<'a>(rows: &'a [CsvRow], scene: &str) -> Vec<(&'static str, &'a CsvRow)> {
    ORDER.iter().filter_map(|preset| Some((*preset, find(rows, scene, preset)?))).collect()
}

/// Time and errors of every preset on one scene.
fn presets(rows: &[CsvRow]) -> String {
    let of_scene = of_scene(rows, SCENE);
    let mut notes = Footnotes::default();
    let mut line = |(preset, row): &(&str, &CsvRow)| {
        let meaning = PRESETS.iter().find(|known| known.name == *preset).map_or("", |known| known.meaning);
        let [method, ms] = [format!("`{}`", row.cell("method")), number(row, "frame_gpu_ms", 0)];
        let [whole, indirect] = [number(row, "same_total_rel", 3), number(row, "same_diffuse_rel", 3)];
        [format!("`{preset}`"), method, ms, whole, indirect + &notes.mark(row), meaning.to_owned()]
    };
    let lines: Vec<_> = of_scene.iter().map(&mut line).collect();
    let head =
        "preset|method|ms a frame|error: whole image|error: indirect light on diffuse surfaces|description".split('|');
    let table = markdown(head, "--:::-", lines);
    let missing = if table.contains(MISSING) { format!("; {MISSING}: not measured yet") } else { String::new() };
    format!("{table}\n*{}{}{missing}.*\n", first_conditions(&of_scene), notes.text())
}

/// Errors and energies of every preset on a scene.
fn errors(rows: &[CsvRow], scene: &str) -> String {
    let of_scene = of_scene(rows, scene);
    let mut notes = Footnotes::default();
    let mut line = |(preset, row): &(&str, &CsvRow)| {
        let [whole, energy] = [number(row, "same_total_rel", 3), number(row, "same_total_energy", 2)];
        let [diffuse, own_energy] = [number(row, "same_diffuse_rel", 3), number(row, "same_diffuse_energy", 2)];
        [format!("`{preset}`"), whole, energy, diffuse + &notes.mark(row), own_energy]
    };
    let lines: Vec<_> = of_scene.iter().map(&mut line).collect();
    let table = markdown(["preset", "(a) rel", "(a) energy", "(b) rel", "(b) energy"], "-::::", lines);
    format!("*{}{}.*\n\n{table}", first_conditions(&of_scene), notes.text())
}

/// Footnotes of a table: the settings with which the errors of the indirect light were measured, where these are not
/// the settings of the preset.
#[derive(Default)]
struct Footnotes(Vec<String>);

impl Footnotes {
    /// The mark of a row's footnote after a space; empty for a row that needs none.
    fn mark(&mut self, row: &CsvRow) -> String {
        let settings = code(row.cell("equal_terms"));
        if settings.is_empty() {
            return String::new();
        }
        let known = self.0.iter().position(|known| *known == settings);
        let index = known.unwrap_or_else(|| {
            self.0.push(settings);
            self.0.len() - 1
        });
        format!(" {}", mark(index))
    }

    /// All footnotes, each after a semicolon.
    fn text(&self) -> String {
        self.0.iter().enumerate().map(|(i, settings)| format!("; {}: measured with {settings}", mark(i))).collect()
    }
}

/// The conditions of the first row; empty without rows.
fn first_conditions(of_scene: &[(&str, &CsvRow)]) -> String {
    of_scene.first().map_or(String::new(), |(_, row)| conditions(row))
}

/// A number of the chosen presets on every scene. `what`: `total` and `diffuse` are error and energy, others time and
/// memory.
fn scenes(rows: &[CsvRow], what: &str) -> String {
    let scenes = || ROWS.iter().flat_map(|(_, scenes)| scenes.iter().copied());
    let cell = |row: &CsvRow| match what {
        "total" | "diffuse" => {
            let number = |metric: &str| row.number(&format!("same_{what}_{metric}"));
            Some(format!("{:.3}, {:.2}", number("rel")?, number("energy")?))
        }
        _ => {
            let mib = row.number("memory_bytes")? / 1048576.0;
            Some(format!("{:.0} ms, {mib:.0} MiB", row.number("frame_gpu_ms")?))
        }
    };
    let line = |preset: &&str| {
        let cells =
            scenes().map(|scene| find(rows, scene, preset).and_then(cell).unwrap_or_else(|| MISSING.to_owned()));
        std::iter::once(format!("`{preset}`")).chain(cells).collect::<Vec<_>>()
    };
    markdown(std::iter::once("preset").chain(scenes()), "-:", CHOSEN.iter().map(line))
}

/// Scene, size, grid, bounces, driver and the reference's noise.
fn conditions(row: &CsvRow) -> String {
    format!(
        "Scene `{}`, {}×{} pixels, {voxels}³ voxels, {} bounces;\n{}; the reference has {:.1} % of noise",
        row.cell("scene"),
        row.cell("width_pixels"),
        row.cell("height_pixels"),
        row.cell("bounces"),
        row.cell("driver"),
        100.0 * row.number("same_noise").unwrap_or_default(),
        voxels = row.cell("voxels")
    )
}

/// The mark of a footnote, counted from 0.
fn mark(number: usize) -> String {
    ["†", "‡"][number % 2].repeat(number / 2 + 1)
}

/// Settings in words, each as code.
fn code(settings: &str) -> String {
    let settings = settings.split([' ', ',']).filter(|setting| !setting.is_empty());
    settings.map(|setting| format!("`{setting}`")).collect::<Vec<_>>().join(" and ")
}

fn number(row: &CsvRow, column: &str, digits: usize) -> String {
    row.number(column).map_or(MISSING.to_owned(), |number| format!("{number:.digits$}"))
}
