//! A chart as files: the page and the SVG for people, `rows.json` and `rows.csv` for other programs.

use std::collections::BTreeSet;

use serde::Serialize;

use super::measure::Subject;
use super::row::{Errors, Measured, Metric, Part, Row, Truth};
use super::store::{Store, Stored};
use super::svg::{self, Panel};
use super::{VERSION, page};
use crate::output::file;
use crate::{Error, Result};

/// The file `rows.json`; `docs/json.md` lists the keys.
#[derive(Serialize)]
pub struct Chart {
    /// [`VERSION`]
    pub version: u32,
    /// The program's version.
    pub program: &'static str,
    pub device: String,
    pub driver: String,
    /// Pixels.
    pub width: u32,
    pub height: u32,
    /// What `--reference-noise` asked for, as a share.
    pub reference_noise: f64,
    pub scenes: Vec<SceneLine>,
    /// Settings that were to be run, over all scenes.
    pub planned: usize,
    pub rows: Vec<Row>,
}

/// What was rendered.
#[derive(Clone, Serialize)]
pub struct SceneLine {
    pub name: String,
    pub hash: String,
    pub triangles: usize,
    pub camera: String,
    /// Whether no mesh is of metal or transmits.
    pub all_diffuse: bool,
}

impl Default for Chart {
    /// Of nothing, by this program.
    fn default() -> Self {
        Self {
            version: VERSION,
            program: env!("CARGO_PKG_VERSION"),
            device: String::new(),
            driver: String::new(),
            width: 0,
            height: 0,
            reference_noise: 0.0,
            scenes: Vec::new(),
            planned: 0,
            rows: Vec::new(),
        }
    }
}

impl Chart {
    /// Writes all four files. `stored`: the chart's rows with their pictures, in the chart's order.
    pub fn write(&self, store: &Store, subjects: &[Subject], stored: &[Stored]) -> Result<()> {
        let json_path = store.path("rows.json");
        let json = serde_json::to_string_pretty(self).map_err(|e| Error::file(&json_path, e.to_string()))?;
        file::write(&json_path, (json + "\n").as_bytes())?;
        file::write(&store.path("rows.csv"), self.csv().as_bytes())?;
        let panels: Vec<Panel> = self.scenes.iter().flat_map(|scene| self.panels(&scene.name)).collect();
        file::write(&store.path("chart.svg"), svg::chart(&panels, 2).as_bytes())?;
        file::write(&store.path("index.html"), page::html(self, subjects, stored)?.as_bytes())
    }

    /// Two panels of a scene: `rel` of [`Self::part`] against all light and against that of as many bounces.
    pub fn panels(&self, scene: &str) -> [Panel<'_>; 2] {
        [(Truth::Full, "all light"), (Truth::Same, "as many bounces")].map(|(truth, words)| Panel {
            title: format!("{scene}, against {words}"),
            rows: self.rows.iter().filter(|row| row.scene == scene).collect(),
            truth,
            part: self.part(scene),
            metric: Metric::Rel,
        })
    }

    /// What to judge a scene's rows by where only one number is shown: the indirect light, unless no row has direct light
    /// of its own to tell it from.
    pub fn part(&self, scene: &str) -> Part {
        let measured = self.rows.iter().filter(|row| row.scene == scene).filter_map(|row| row.measured.as_ref());
        if measured.into_iter().any(|m| m.own_direct) { Part::Indirect } else { Part::Total }
    }

    /// `rows.csv` (RFC 4180, lines end in a newline): a header with units, then a line per row. A number that was not
    /// measured is an empty cell.
    pub fn csv(&self) -> String {
        let passes = pass_names(&self.rows);
        let mut lines = vec![header(&self.rows, &passes)];
        lines.extend(self.rows.iter().map(|row| self.line(row, &passes)));
        lines.iter().map(|cells| cells.iter().map(|c| escape(c)).collect::<Vec<_>>().join(",") + "\n").collect()
    }

    fn line(&self, row: &Row, passes: &[String]) -> Vec<String> {
        let measured = row.measured.as_ref();
        let number = |value: &dyn Fn(&Measured) -> Option<f64>| measured.and_then(value).map_or(String::new(), short);
        let mut cells = vec![
            row.scene.clone(),
            row.name.clone(),
            row.preset.clone(),
            row.changes.join(" "),
            row.failure.clone().unwrap_or_default(),
            self.device.clone(),
            self.driver.clone(),
            self.width.to_string(),
            self.height.to_string(),
            number(&|m| Some(m.frames as f64)),
            number(&|m| Some(m.frame_gpu_ms.median)),
            number(&|m| Some(m.frame_gpu_ms.min)),
            number(&|m| Some(m.frame_gpu_ms.max)),
            number(&|m| m.frame_cpu_ms.map(|s| s.median)),
            number(&|m| Some(m.frame_wall_ms.median)),
            number(&|m| Some(m.memory_bytes as f64)),
            number(&|m| Some(m.nonfinite as f64)),
            measured.map_or(String::new(), |m| m.own_direct.to_string()),
        ];
        for errors in [measured.map(|m| &m.full), measured.map(|m| &m.same)] {
            cells.push(errors.map_or(String::new(), |e| e.bounces.map_or("all".into(), |n| n.to_string())));
            cells.extend(numbers(errors).map(|n| n.map_or(String::new(), short)));
        }
        let pass = |name: &String| {
            let found = measured.and_then(|m| m.passes.iter().find(|pass| pass.name == *name));
            found.map_or(String::new(), |pass| short(pass.gpu_ms))
        };
        cells.extend(passes.iter().map(pass));
        cells.extend(row.settings.entries().into_iter().map(|(_, value)| value));
        cells
    }
}

/// Noise of the reference, then the metrics.
fn numbers(errors: Option<&Errors>) -> [Option<f64>; 14] {
    let Some(e) = errors else { return [None; 14] };
    let (t, i, d) = (e.total, e.indirect, e.diffuse);
    [
        Some(e.noise),
        Some(t.energy),
        Some(t.rel),
        Some(t.relmse),
        Some(t.p95),
        Some(e.flip),
        i.map(|i| i.energy),
        i.map(|i| i.rel),
        i.map(|i| i.relmse),
        i.map(|i| i.p95),
        d.map(|d| d.energy),
        d.map(|d| d.rel),
        d.map(|d| d.relmse),
        d.map(|d| d.p95),
    ]
}

fn header(rows: &[Row], passes: &[String]) -> Vec<String> {
    const FIXED: &[&str] = &[
        "scene",
        "name",
        "preset",
        "changes",
        "failure",
        "device",
        "driver",
        "width_pixels",
        "height_pixels",
        "frames",
        "frame_gpu_ms",
        "frame_gpu_ms_min",
        "frame_gpu_ms_max",
        "frame_cpu_ms",
        "frame_wall_ms",
        "memory_bytes",
        "nonfinite",
        "own_direct",
    ];
    const METRICS: &[&str] = &[
        "bounces",
        "noise",
        "total_energy",
        "total_rel",
        "total_relmse",
        "total_p95",
        "flip",
        "indirect_energy",
        "indirect_rel",
        "indirect_relmse",
        "indirect_p95",
        "diffuse_energy",
        "diffuse_rel",
        "diffuse_relmse",
        "diffuse_p95",
    ];
    let mut cells: Vec<String> = FIXED.iter().map(|&name| name.to_owned()).collect();
    for truth in ["full", "same"] {
        cells.extend(METRICS.iter().map(|metric| format!("{truth}_{metric}")));
    }
    cells.extend(passes.iter().map(|name| format!("pass {name} gpu_ms")));
    cells.extend(rows.first().into_iter().flat_map(|r| r.settings.entries()).map(|(key, _)| key.name.to_owned()));
    cells
}

/// Every pass of any row, in the order of their first frame.
pub fn pass_names(rows: &[Row]) -> Vec<String> {
    let mut seen = BTreeSet::new();
    let all = rows.iter().filter_map(|row| row.measured.as_ref()).flat_map(|m| &m.passes);
    all.filter(|pass| seen.insert(&pass.name)).map(|pass| pass.name.clone()).collect()
}

/// Six digits are more than a time repeats to and an error means.
fn short(value: f64) -> String {
    let digits = if value == 0.0 || !value.is_finite() { 0 } else { 5 - value.abs().log10().floor() as i32 };
    let rounded = format!("{value:.*}", digits.max(0) as usize);
    if rounded.contains('.') { rounded.trim_end_matches('0').trim_end_matches('.').to_owned() } else { rounded }
}

fn escape(cell: &str) -> String {
    if cell.contains(['"', ',', '\n', '\r']) { format!("\"{}\"", cell.replace('"', "\"\"")) } else { cell.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_quoted_where_they_must_be() {
        assert_eq!(escape("a b"), "a b");
        assert_eq!(escape("a,b"), "\"a,b\"");
        assert_eq!(escape("say \"a\"\n"), "\"say \"\"a\"\"\n\"");
    }

    #[test]
    fn numbers_keep_six_digits() {
        let cases = [(0.0, "0"), (1234567.8, "1234568"), (0.001234567, "0.00123457"), (12.5, "12.5"), (-3.0, "-3")];
        for (value, text) in cases {
            assert_eq!(short(value), text);
        }
    }
}
