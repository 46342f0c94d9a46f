//! Tables of measured numbers in Markdown pages, filled from the rows of the study.
//!
//! A page holds a table between `<!-- table: NAME -->` and `<!-- end -->`. `cargo run --release --example strengths`
//! writes the text between the two marks, and `tests/values/docs.rs` compares it with the rows.

use std::fs;
use std::path::Path;

use twobounce::output::file;
use twobounce::settings::PRESETS;
use twobounce::{Error, Result};

/// The pages that hold tables, from the project's root.
pub const PAGES: &[&str] = &["README.md", "docs/accuracy.md"];

/// The rows that fill them, from the project's root.
pub const ROWS: &str = "docs/study/rows.csv";

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
];

/// The scene of the table of presets.
const SCENE: &str = "gallery";

/// A cell whose number was not measured by today's definition.
pub const MISSING: &str = "–";

const OPEN: &str = "<!-- table: ";
const CLOSE: &str = "<!-- end -->";

/// A row of a CSV file: pairs of a column's name and a value.
#[derive(Clone, Debug)]
pub struct Row(Vec<(String, String)>);

impl Row {
    /// The cell of a column; empty if the file has no such column.
    pub fn cell(&self, column: &str) -> &str {
        self.0.iter().find(|(name, _)| name == column).map_or("", |(_, value)| value)
    }

    /// The cell as a number; `None` if it is empty or no number.
    pub fn number(&self, column: &str) -> Option<f64> {
        self.cell(column).parse().ok()
    }

    /// Whether the row shows this preset on this scene, with no setting changed but those that the whole study changes.
    pub fn shows(&self, scene: &str, preset: &str) -> bool {
        self.cell("scene") == scene && self.cell("name") == preset
    }

    /// Whether the indirect light was measured with exact direct light. Files with the column `own_direct` are older than
    /// the definition: there, only methods that keep direct light apart were measured so.
    fn on_equal_terms(&self) -> bool {
        self.cell("own_direct") != "false"
    }
}

/// The rows of a CSV file as `chart` and `study` write it (RFC 4180): cells may be quoted, and hold no line breaks.
pub fn rows(text: &str) -> Vec<Row> {
    let split = |line: &str| {
        let (mut cells, mut quoted) = (vec![String::new()], false);
        for c in line.chars() {
            match c {
                '"' => quoted = !quoted,
                ',' if !quoted => cells.push(String::new()),
                c => cells.last_mut().expect("a cell").push(c),
            }
        }
        cells
    };
    let mut lines = text.lines().map(split);
    let header = lines.next().unwrap_or_default();
    lines.map(|cells| Row(header.iter().cloned().zip(cells).collect())).collect()
}

/// The rows of a file.
///
/// # Errors
/// [`Error::File`] if it cannot be read.
pub fn read(path: &Path) -> Result<Vec<Row>> {
    Ok(rows(&fs::read_to_string(path).map_err(|e| Error::file(path, e.to_string()))?))
}

/// The pages as they should be, each with its name and its text on disk.
///
/// # Errors
/// A page or the rows cannot be read, or a page has a mark that [`filled`] refuses.
pub fn pages(root: &Path) -> Result<Vec<(&'static str, String, String)>> {
    let rows = read(&root.join(ROWS))?;
    let page = |name: &&'static str| {
        let path = root.join(name);
        let text = fs::read_to_string(&path).map_err(|e| Error::file(&path, e.to_string()))?;
        let filled = filled(&text, &rows).map_err(|problem| Error::file(&path, problem))?;
        Ok((*name, text, filled))
    };
    PAGES.iter().map(page).collect()
}

/// Writes the tables of all pages.
///
/// # Errors
/// As [`pages`], and a page that cannot be written.
pub fn fill(root: &Path) -> Result<()> {
    for (name, text, filled) in pages(root)? {
        if text != filled {
            file::write(&root.join(name), filled.as_bytes())?;
            println!("filled the tables of {name}");
        }
    }
    Ok(())
}

/// A page with the text between its marks replaced by tables of these rows.
///
/// # Errors
/// A sentence about a mark that names no table, or has no end.
pub fn filled(page: &str, rows: &[Row]) -> std::result::Result<String, String> {
    let (mut text, mut rest) = (String::new(), page);
    while let Some((before, after)) = rest.split_once(OPEN) {
        let (name, after) = after.split_once(" -->\n").ok_or("a mark of a table does not end its line")?;
        let (_, after) = after.split_once(CLOSE).ok_or(format!("the table {name} has no {CLOSE}"))?;
        text += &format!("{before}{OPEN}{name} -->\n\n{}\n{CLOSE}", table(name, rows)?);
        rest = after;
    }
    Ok(text + rest)
}

fn table(name: &str, rows: &[Row]) -> std::result::Result<String, String> {
    match name.split_once(' ') {
        None if name == "presets" => Ok(presets(rows)),
        Some(("errors", scene)) => Ok(errors(rows, scene)),
        _ => Err(format!("there is no table {name}: presets and errors SCENE are known")),
    }
}

/// The presets' rows on a scene, in the order of the tables.
fn of_scene<'a>(rows: &'a [Row], scene: &'a str) -> Vec<(&'static str, &'a Row)> {
    let row = |preset: &&'static str| Some((*preset, rows.iter().find(|row| row.shows(scene, preset))?));
    ORDER.iter().filter_map(row).collect()
}

/// Time and errors of every preset on one scene.
fn presets(rows: &[Row]) -> String {
    let mut table = "| preset | method | ms a frame | error: whole image | error: indirect light on diffuse surfaces | description |\n\
                     |---|---|---:|---:|---:|---|\n"
        .to_owned();
    let of_scene = of_scene(rows, SCENE);
    let mut all_terms = Vec::new();
    for (preset, row) in &of_scene {
        let meaning = PRESETS.iter().find(|known| known.name == *preset).map_or("", |known| known.meaning);
        let [whole, indirect] = [number(row, "same_total_rel", 3), indirect(row, "rel", 3)];
        let terms = code(row.cell("equal_terms"));
        if !terms.is_empty() && !all_terms.contains(&terms) {
            all_terms.push(terms.clone());
        }
        let mark =
            all_terms.iter().position(|known| *known == terms).map_or(String::new(), |i| format!(" {}", mark(i)));
        table += &format!(
            "| `{preset}` | `{}` | {} | {whole} | {indirect}{mark} | {meaning} |\n",
            row.cell("method"),
            number(row, "frame_gpu_ms", 0)
        );
    }
    let mut notes = vec![of_scene.first().map_or(String::new(), |(_, row)| conditions(row))];
    notes.extend(all_terms.iter().enumerate().map(|(i, terms)| format!("{}: measured with {terms}", mark(i))));
    if table.contains(MISSING) {
        notes.push(format!("{MISSING}: not measured yet"));
    }
    format!("{table}\n*{}.*\n", notes.join("; "))
}

/// Errors and energies of every preset on a scene.
fn errors(rows: &[Row], scene: &str) -> String {
    let of_scene = of_scene(rows, scene);
    let conditions = of_scene.first().map_or(String::new(), |(_, row)| conditions(row));
    let mut table = format!(
        "*{conditions}.*\n\n| preset | (a) rel | (a) energy | (b) rel | (b) energy | settings for (b) |\n\
         |---|---:|---:|---:|---:|---|\n"
    );
    for (preset, row) in of_scene {
        let terms = match row.cell("equal_terms") {
            _ if !row.on_equal_terms() => MISSING.to_owned(),
            "" => "those of the preset".to_owned(),
            terms => code(terms),
        };
        table += &format!(
            "| `{preset}` | {} | {} | {} | {} | {terms} |\n",
            number(row, "same_total_rel", 3),
            number(row, "same_total_energy", 2),
            indirect(row, "rel", 3),
            indirect(row, "energy", 2)
        );
    }
    table
}

/// Scene, size, grid, bounces, driver and the reference's noise.
fn conditions(row: &Row) -> String {
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

fn number(row: &Row, column: &str, digits: usize) -> String {
    row.number(column).map_or(MISSING.to_owned(), |number| format!("{number:.digits$}"))
}

/// A number of the indirect light on diffuse surfaces.
fn indirect(row: &Row, metric: &str, digits: usize) -> String {
    if row.on_equal_terms() { number(row, &format!("same_diffuse_{metric}"), digits) } else { MISSING.to_owned() }
}
