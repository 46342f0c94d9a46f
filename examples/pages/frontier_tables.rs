//! The tables of `docs/notes/frontier.md`, every method at equal time. `frontier.rs` measures their rows.

use std::path::Path;

use twobounce::lab::table::{CsvRow, MISSING, markdown, read_csv};
use twobounce::stability::cases;
use twobounce::stability::export::{CsvLine, read_csv as read_cases};
use twobounce::{Error, Result};

/// The page, from the project's root.
pub const PAGE: &str = "docs/notes/frontier.md";
/// The file of its rows.
pub const ROWS: &str = "docs/notes/frontier-rows.csv";
/// Rows of stability: those that were measured for the page, then those of other presets.
const STABILITY_ROWS: [&str; 2] = ["docs/notes/frontier-stability.csv", "docs/stability-rows.csv"];

/// Settings of every row, before those of [`METHODS`]. Light settles, and no further passes over it are averaged.
pub const COMMON: [&str; 4] = ["voxels=64", "bounces=all", "rays.passes=0", "probes.passes=0"];

/// The number of settings that are tried for every method.
pub const TRIES: usize = 4;

const CONES_SHARED: &str = "cones cones.set=g8 image.interleave=4 image.gather_resolution=half";
const CONES_COARSE: &str = "cones voxels=32 cones.set=g8 image.interleave=4 image.gather_resolution=half";
const PHOTONS_SHARED: &str = "photons photons.diffuse=4 image.gather_resolution=half";
const PHOTONS_COARSE: &str = "photons voxels=32 photons.diffuse=4 image.gather_resolution=half";

/// The methods, each with the settings that are tried, about from the cheapest to the dearest: a preset with changes.
pub const METHODS: &[(&str, [&str; TRIES])] = &[
    ("rays", ["fast voxels=32", "fast", "balanced", "accurate"]),
    ("cones", [CONES_COARSE, CONES_SHARED, "cones voxels=32", "cones"]),
    ("lpv", ["lpv lpv.edge=16", "lpv", "lpv lpv.iterations=64", "lpv lpv.cascades=3"]),
    ("photons", [PHOTONS_COARSE, PHOTONS_SHARED, "photons voxels=32", "photons"]),
    (
        "paths",
        [
            "paths paths.paths=1",
            "paths paths.paths=3",
            "paths paths.paths=1 image.passes=6",
            "paths paths.paths=2 image.passes=19",
        ],
    ),
    (
        "probes",
        [
            "probes probes.edge=4 probes.rays=128",
            "probes probes.rays=64",
            "probes",
            "probes probes.edge=16 probes.rays=128",
        ],
    ),
];

/// Seconds of processor time of a frame.
pub const BUDGETS_S: [f64; 3] = [0.3, 1.0, 4.0];

/// The presets and the cases of the table of leaks and lag.
const PRESETS: [&str; 8] = ["fast", "balanced", "accurate", "cones", "lpv", "photons", "paths", "probes"];
const CASES: [&str; 5] = ["leak-1/2", "leak-2", "leak-door", "light-on", "light-off"];
const GRID: u32 = 64;

/// The measured rows.
pub struct Rows {
    rows: Vec<CsvRow>,
    cases: Vec<CsvLine>,
}

impl Rows {
    /// # Errors
    /// A file of rows that is missing or damaged.
    pub fn read(root: &Path) -> Result<Self> {
        let of_cases = |name: &str| {
            let path = root.join(name);
            let text = std::fs::read_to_string(&path).map_err(|e| Error::file(&path, e.to_string()))?;
            read_cases(&text).map_err(|why| Error::file(&path, why))
        };
        let cases = STABILITY_ROWS.iter().map(|name| of_cases(name)).collect::<Result<Vec<_>>>()?.concat();
        Ok(Self { rows: read_csv(&root.join(ROWS))?, cases })
    }

    /// The text of a table.
    ///
    /// # Errors
    /// A message about a name that no table has.
    pub fn table(&self, name: &str) -> Result<String> {
        match name.split_once(' ') {
            None if name == "tries" => Ok(tries()),
            None if name == "leaks" => Ok(self.leaks()),
            Some(("errors", scene)) => Ok(self.errors(scene)),
            _ => Err(Error::Usage(format!("there is no table {name}: tries, leaks and errors SCENE are"))),
        }
    }

    /// The settings of a method with the least error of the indirect light that keep a budget.
    fn best(&self, scene: &str, method: &str, budget_s: f64) -> Option<&CsvRow> {
        let keeps = |row: &&CsvRow| {
            let ms = row.number("frame_cpu_ms").filter(|_| row.number("diffuse_rel").is_some());
            row.cell("scene") == scene && row.cell("method") == method && ms.is_some_and(|ms| ms <= 1e3 * budget_s)
        };
        self.rows.iter().filter(keeps).min_by(|a, b| {
            let [a, b] = [a, b].map(|row| row.number("diffuse_rel").unwrap_or(f64::INFINITY));
            a.total_cmp(&b)
        })
    }

    /// The errors of every method in every budget on one scene.
    fn errors(&self, scene: &str) -> String {
        let number = |row: &CsvRow, column: &str| row.number(column).unwrap_or(f64::NAN);
        let mut lines: Vec<Vec<String>> = METHODS.iter().map(|(method, _)| vec![format!("`{method}`")]).collect();
        for budget in BUDGETS_S {
            let best: Vec<_> = METHODS.iter().map(|(method, _)| self.best(scene, method, budget)).collect();
            for column in ["diffuse_rel", "total_rel"] {
                let least = best.iter().flatten().map(|row| number(row, column)).fold(f64::INFINITY, f64::min);
                for (line, row) in lines.iter_mut().zip(&best) {
                    line.push(row.map_or(MISSING.to_owned(), |row| {
                        let error = number(row, column);
                        let bold = if error <= least { "**" } else { "" };
                        let number = if column == "diffuse_rel" { number_of(row) } else { String::new() };
                        format!("{bold}{error:.3}{bold}{number}")
                    }));
                }
            }
            for (line, row) in lines.iter_mut().zip(&best) {
                let mib = |row: &&CsvRow| format!("{:.0}", number(row, "memory_bytes") / 1048576.0);
                line.push(row.as_ref().map_or(MISSING.to_owned(), mib));
            }
        }
        let head = BUDGETS_S.iter().flat_map(|budget| {
            [format!("{budget} s: indirect"), format!("{budget} s: image"), format!("{budget} s: MiB")]
        });
        let rows = || self.rows.iter().filter(|row| row.cell("scene") == scene);
        let noise = |column: &str| rows().find_map(|row| row.number(column)).unwrap_or(f64::NAN);
        format!(
            "{}\n*{} settings measured; the reference's noise adds at most {:.3} to the error of indirect light and {:.3} to that of the image.*\n",
            markdown(std::iter::once("method".to_owned()).chain(head), "-:", lines),
            rows().count(),
            noise("noise_in_diffuse_rel"),
            noise("noise_in_total_rel"),
        )
    }

    /// Cases of stability, by preset.
    fn leaks(&self) -> String {
        let line = |preset: &&str| {
            let cell = |name: &&str| {
                let case = cases::named(name)?;
                let is_it = |line: &&CsvLine| line.case == *name && line.preset == *preset && line.grid == GRID;
                let line = self.cases.iter().find(is_it)?;
                Some(case.numbers_in_words(line.median?, line.min?, line.max?))
            };
            let cells = CASES.iter().map(|name| cell(name).unwrap_or(MISSING.to_owned()));
            std::iter::once(format!("`{preset}`")).chain(cells).collect::<Vec<_>>()
        };
        markdown(std::iter::once("preset").chain(CASES), "-:", PRESETS.iter().map(line))
    }
}

/// The number of a row's settings among those of its method, in brackets.
fn number_of(row: &CsvRow) -> String {
    let tried = METHODS.iter().find(|(method, _)| *method == row.cell("method"));
    let number = tried.and_then(|(_, tried)| tried.iter().position(|tried| *tried == row.cell("settings")));
    number.map_or(String::new(), |number| format!(" ({})", number + 1))
}

/// The settings that were tried.
fn tries() -> String {
    let line = |(method, tried): &(&str, [&str; TRIES])| {
        let cells = tried.iter().map(|tried| format!("`{}`", tried.replace(' ', "` `")));
        std::iter::once(format!("`{method}`")).chain(cells).collect::<Vec<_>>()
    };
    let head = std::iter::once("method".to_owned()).chain((1..=TRIES).map(|number| format!("({number})")));
    markdown(head, "-", METHODS.iter().map(line))
}
