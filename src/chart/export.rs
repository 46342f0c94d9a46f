//! Files of a chart: the page and the SVG for readers, `rows.json` and `rows.csv` for programs.

use std::collections::BTreeSet;

use serde::Serialize;
use serde_json::{Value, json};

use super::outline::{Outline, SceneLine};
use super::page;
use super::row::{Reference, Row};
use super::svg::{self, Panel};
use crate::Result;
use crate::lab::store::{Origin, Store, Stored};
use crate::lab::table::to_csv;
use crate::measure::metrics::{Metrics, Part};
use crate::output::file;
use crate::settings::Settings;

/// A chart's rows with their description. `docs/json.md` lists the keys of its `rows.json`.
#[derive(Clone, Debug, Default)]
pub struct Chart {
    pub outline: Outline,
    /// The existing rows with their pictures, in the outline's order.
    pub rows: Vec<Stored<Row>>,
    /// The number of rows to run over all scenes; for a shard it is smaller than that of the outline.
    pub planned: usize,
    /// Whether a frontier may join the times of several machines.
    pub mix_machines: bool,
    /// Whether earlier rows of the same settings are shown.
    pub with_history: bool,
    /// Whether the program still fills the chart, so that the page reloads itself.
    pub running: bool,
    /// The part, such as "shard 1 of 4"; empty for a whole chart.
    pub part: String,
}

impl Chart {
    /// Writes all files of the folder.
    pub fn write(&self, store: &Store<Row>) -> Result<()> {
        #[derive(Serialize)]
        struct Json<'a> {
            #[serde(flatten)]
            head: Value,
            rows: Vec<&'a Row>,
        }
        let head = json!({
            "version": super::JSON_VERSION,
            "program": env!("CARGO_PKG_VERSION"),
            "width": self.outline.width,
            "height": self.outline.height,
            "reference_noise": self.outline.reference_noise,
            "mix_machines": self.mix_machines,
            "scenes": self.scenes().collect::<Vec<_>>(),
            "planned": self.planned,
        });
        file::write_json(&store.path("rows.json"), &Json { head, rows: self.rows().collect() })?;
        file::write(&store.path("rows.csv"), self.csv().as_bytes())?;
        let panels: Vec<Panel> = self.scenes().flat_map(|scene| self.panels(&scene.name)).collect();
        file::write(&store.path("chart.svg"), svg::chart(&panels, 2).as_bytes())?;
        let history = if self.with_history { self.history(store) } else { Vec::new() };
        file::write(&store.path("index.html"), page::html(self, &history).as_bytes())?;
        store.save_outline(&self.outline)
    }

    pub fn rows(&self) -> impl Iterator<Item = &Row> {
        self.rows.iter().map(|stored| &stored.row)
    }

    pub fn scenes(&self) -> impl Iterator<Item = &SceneLine> {
        self.outline.scenes.iter().map(|sketch| &sketch.line)
    }

    /// Earlier rows of this chart's settings in a folder, the oldest first: of other builds, and of earlier states of
    /// the scene or of the noise.
    fn history(&self, store: &Store<Row>) -> Vec<Row> {
        let is_earlier = |row: &Row| {
            let now = self.rows().find(|now| now.is_same_as(row));
            row.measured.is_some() && now.is_some_and(|now| now.key != row.key || now.origin != row.origin)
        };
        let kept = Store::<Row>::read_all(&store.path("")).into_iter().flatten().map(|stored| stored.row);
        let mut rows: Vec<Row> = kept.filter(is_earlier).collect();
        rows.sort_by_key(|row| row.origin.as_ref().map_or(0, |origin| origin.unix_s));
        rows
    }

    /// The devices and drivers of the rows, in words.
    pub fn devices(&self) -> String {
        Origin::devices(self.rows().filter_map(|row| row.origin.as_ref()))
    }

    /// The rows of a scene.
    pub fn rows_of(&self, scene: &str) -> Vec<&Row> {
        self.rows().filter(|row| row.scene == scene).collect()
    }

    /// Two panels for a scene: `rel` of [`Self::part`] against all light and against that of as many bounces. If that
    /// part of another program's image is not judged, two further panels show the whole image.
    pub fn panels(&self, scene: &str) -> Vec<Panel<'_>> {
        let part = self.part(scene);
        let lacks = |row: &&Row| row.measured.is_some() && row.rel(Reference::Full, part).is_none();
        let has_other = self.rows_of(scene).iter().any(|row| row.is_import() && lacks(row));
        let further = (has_other && part != Part::Total).then_some(Part::Total);
        let references = [(Reference::Full, "all light"), (Reference::Same, "as many bounces")];
        let panels_of = |part: Part| {
            references.map(|(reference, words)| Panel {
                title: format!("{scene}, against {words}"),
                rows: self.rows_of(scene),
                mix_machines: self.mix_machines,
                reference,
                part,
            })
        };
        std::iter::once(part).chain(further).flat_map(panels_of).collect()
    }

    /// The part of the light that is shown if there is room for one: the indirect light on diffuse surfaces, or the
    /// whole image if the scene shows no such surface.
    pub fn part(&self, scene: &str) -> Part {
        let has_diffuse = |row: &&Row| row.rel(Reference::Same, Part::Diffuse).is_some();
        if self.rows_of(scene).iter().any(has_diffuse) { Part::Diffuse } else { Part::Total }
    }

    /// `rows.csv` (RFC 4180, lines end in a newline): a header with units, then a line per row. A number that was not
    /// measured is an empty cell.
    pub fn csv(&self) -> String {
        let mut seen = BTreeSet::new();
        let passes = self.rows().filter_map(|row| row.measured.as_ref()).flat_map(|m| &m.passes);
        let passes: Vec<&str> = passes.map(|pass| pass.name.as_str()).filter(|name| seen.insert(*name)).collect();
        let rows: Vec<_> = self.rows().map(|row| self.cells(row, &passes)).collect();
        let header = rows.first().map(|cells| cells.iter().map(|(name, _)| name).collect::<Vec<_>>());
        let lines = rows.iter().map(|cells| cells.iter().map(|(_, value)| value).collect());
        to_csv(header.into_iter().chain(lines))
    }

    /// A row's cells, each with the name of its column.
    fn cells(&self, row: &Row, passes: &[&str]) -> Vec<(String, String)> {
        let mut value = json!(row);
        value["size"] = json!([self.outline.width, self.outline.height]);
        let at = |path: &str| text(value.pointer(path).unwrap_or(&Value::Null));
        let of = |(name, path): &(&str, &str)| ((*name).to_owned(), at(path));
        let mut cells: Vec<(String, String)> = COLUMNS.iter().map(of).collect();
        for reference in ["full", "same"] {
            let bounces = at(&format!("/measured/{reference}/bounces"));
            let is_all = bounces.is_empty() && row.measured.is_some();
            cells.push((format!("{reference}_bounces"), if is_all { "all".to_owned() } else { bounces }));
            let mut add = |name: &str, path: &str| {
                cells.push((format!("{reference}_{name}"), at(&format!("/measured/{reference}/{path}"))));
            };
            add("noise", "noise");
            for part in ["total", "indirect", "diffuse"] {
                Metrics::NAMES.iter().for_each(|name| add(&format!("{part}_{name}"), &format!("{part}/{name}")));
                if part == "total" {
                    add("flip", "flip");
                }
            }
            for part in ["total", "indirect", "diffuse"] {
                add(&format!("{part}_noise_in_rel"), &format!("noise_in_rel/{part}"));
            }
        }
        for name in passes {
            let pass = row.measured.as_ref().and_then(|m| m.passes.iter().find(|pass| pass.name == *name));
            cells.push((format!("pass {name} gpu_ms"), pass.map_or(String::new(), |pass| short(pass.gpu_ms))));
        }
        cells.extend(GIVEN.iter().map(of));
        let (settings, keys) = (row.settings.as_ref().map(Settings::entries), Settings::default().entries());
        for (i, (key, _)) in keys.into_iter().enumerate() {
            let value = settings.as_ref().map_or(String::new(), |entries| entries[i].1.clone());
            cells.push((key.name.to_owned(), value));
        }
        cells
    }
}

/// Columns of `rows.csv` before those of errors and passes, each with its place in a row's JSON, to which the size is
/// added.
const COLUMNS: &[(&str, &str)] = &[
    ("scene", "/scene"),
    ("name", "/name"),
    ("source", "/source/kind"),
    ("preset", "/preset"),
    ("changes", "/changes"),
    ("failure", "/failure"),
    ("machine", "/origin/machine"),
    ("device", "/origin/device"),
    ("driver", "/origin/driver"),
    ("program", "/origin/program"),
    ("build", "/origin/build"),
    ("label", "/origin/label"),
    ("measured_unix_s", "/origin/unix_s"),
    ("width_pixels", "/size/0"),
    ("height_pixels", "/size/1"),
    ("frames", "/measured/frames"),
    ("frame_gpu_ms", "/measured/frame_gpu_ms/median"),
    ("frame_gpu_ms_min", "/measured/frame_gpu_ms/min"),
    ("frame_gpu_ms_max", "/measured/frame_gpu_ms/max"),
    ("frame_cpu_ms", "/measured/frame_cpu_ms/median"),
    ("frame_wall_ms", "/measured/frame_wall_ms/median"),
    ("memory_bytes", "/measured/memory_bytes"),
    ("nonfinite", "/measured/nonfinite"),
    ("equal_terms", "/measured/equal_terms"),
];

/// Columns of `rows.csv` after those of errors and passes. They are filled in rows without settings.
const GIVEN: &[(&str, &str)] = &[
    ("paths", "/source/paths"),
    ("given_ms", "/source/milliseconds"),
    ("given_by", "/source/by"),
    ("given_device", "/source/device"),
    ("given_note", "/source/note"),
    ("given_image", "/source/image"),
    ("given_equal_terms_image", "/source/equal_terms_image"),
    ("given_indirect", "/source/indirect"),
];

/// The text of a cell.
fn text(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Number(number) => number.as_f64().map_or(String::new(), short),
        Value::Array(values) => values.iter().map(text).collect::<Vec<_>>().join(" "),
        _ => String::new(),
    }
}

/// A number with six digits, which exceeds the precision of times and errors.
pub(super) fn short(value: f64) -> String {
    let digits = if value == 0.0 || !value.is_finite() { 0 } else { 5 - value.abs().log10().floor() as i32 };
    let rounded = format!("{value:.*}", digits.max(0) as usize);
    if rounded.contains('.') { rounded.trim_end_matches('0').trim_end_matches('.').to_owned() } else { rounded }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_six_digits() {
        let cases = [(0.0, "0"), (1234567.8, "1234568"), (0.001234567, "0.00123457"), (12.5, "12.5"), (-3.0, "-3")];
        for (value, text) in cases {
            assert_eq!(short(value), text);
        }
    }
}
