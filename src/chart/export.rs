//! A chart as files: the page and the SVG for readers, `rows.json` and `rows.csv` for programs.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use super::import::Claim;
use super::outline::{Outline, Sketch};
use super::page;
use super::row::{Part, Reference, Row};
use super::subject::Source;
use super::svg::{self, Panel};
use crate::Result;
use crate::lab::store::{Origin, Store, Stored};
use crate::lab::table::to_csv;
use crate::measure::metrics::Metrics;
use crate::output::file;
use crate::settings::Settings;

/// The file `rows.json`; `docs/json.md` lists the keys.
#[derive(Default, Serialize)]
pub struct Chart {
    /// [`super::JSON_VERSION`]
    pub version: u32,
    /// The program's version.
    pub program: &'static str,
    /// Pixels.
    pub width: u32,
    pub height: u32,
    /// What `--reference-noise` asked for, as a share.
    pub reference_noise: f64,
    /// Whether a frontier may join the times of several machines.
    pub mix_machines: bool,
    pub scenes: Vec<SceneLine>,
    /// Settings that were to be run, over all scenes.
    pub planned: usize,
    pub rows: Vec<Row>,
}

/// What stands around a chart's rows on its page.
#[derive(Clone, Debug, Default)]
pub struct Surroundings {
    /// Whether the program still fills the chart: then the page looks for a newer one of itself.
    pub running: bool,
    /// Such as "shard 1 of 4"; empty for a whole chart.
    pub part: String,
    /// Earlier rows of the same settings, the oldest first; none unless asked for.
    pub history: Vec<Row>,
}

/// What was rendered.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SceneLine {
    pub name: String,
    pub hash: String,
    pub triangles: usize,
    pub camera: String,
    /// Whether no mesh is metallic or transmits.
    pub all_diffuse: bool,
    /// The start of the command that renders it so, before `--preset`; empty where that is not known.
    pub command: String,
}

impl Chart {
    /// What there is of an outline's rows, in its order; `planned` may be fewer than its own, of a shard.
    pub fn new(outline: &Outline, planned: usize, mix_machines: bool, stored: &[Stored<Row>]) -> Self {
        Self {
            version: super::JSON_VERSION,
            program: env!("CARGO_PKG_VERSION"),
            width: outline.width,
            height: outline.height,
            reference_noise: outline.reference_noise,
            mix_machines,
            scenes: outline.scenes.iter().map(|sketch| sketch.line.clone()).collect(),
            planned,
            rows: stored.iter().map(|stored| stored.row.clone()).collect(),
        }
    }

    /// Writes all four files. `stored`: the chart's rows with their pictures, in the chart's order.
    pub fn write(
        &self,
        store: &Store<Row>,
        sketches: &[Sketch],
        stored: &[Stored<Row>],
        around: &Surroundings,
    ) -> Result<()> {
        file::write_json(&store.path("rows.json"), self)?;
        file::write(&store.path("rows.csv"), self.csv().as_bytes())?;
        let panels: Vec<Panel> = self.scenes.iter().flat_map(|scene| self.panels(&scene.name)).collect();
        file::write(&store.path("chart.svg"), svg::chart(&panels, 2).as_bytes())?;
        file::write(&store.path("index.html"), page::html(self, sketches, stored, around).as_bytes())
    }

    /// Earlier rows of this chart's settings that a folder keeps, the oldest first: of other builds, and of former states of the
    /// scene or of the noise.
    pub fn history(&self, store: &Store<Row>) -> Vec<Row> {
        let stored: [Vec<Stored<Row>>; 2] = store.all();
        let is_earlier = |row: &Row| {
            let now = self.rows.iter().find(|now| now.is_same_as(row));
            row.measured.is_some() && now.is_some_and(|now| now.key != row.key || now.origin != row.origin)
        };
        let mut rows: Vec<Row> = stored.into_iter().flatten().map(|stored| stored.row).filter(is_earlier).collect();
        rows.sort_by_key(|row| row.origin.as_ref().map_or(0, |origin| origin.unix_s));
        rows
    }

    /// The devices and drivers that rows are of, in words.
    pub fn devices(&self) -> String {
        Origin::devices(self.rows.iter().filter_map(|row| row.origin.as_ref()))
    }

    /// Where rows were measured: machine, device, driver; in the order of names.
    pub fn places(&self) -> Vec<[&str; 3]> {
        self.rows.iter().filter_map(Row::place).collect::<BTreeSet<_>>().into_iter().collect()
    }

    /// The rows of a scene.
    pub fn rows_of(&self, scene: &str) -> Vec<&Row> {
        self.rows.iter().filter(|row| row.scene == scene).collect()
    }

    /// Two panels of a scene: `rel` of [`Self::part`] against all light and against that of as many bounces. Where that
    /// part of an image of another program is not judged, two further ones show the whole image.
    pub fn panels(&self, scene: &str) -> Vec<Panel<'_>> {
        let part = self.part(scene);
        let lacks = |row: &&Row| row.measured.is_some() && row.rel(Reference::Full, part).is_none();
        let has_other = self.rows_of(scene).iter().any(|row| matches!(row.source, Source::Import(_)) && lacks(row));
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

    /// The part of the light that is shown where there is room for one: the indirect light on diffuse surfaces, or the whole
    /// image where the scene shows no such surface.
    pub fn part(&self, scene: &str) -> Part {
        let has_diffuse = |row: &&Row| row.rel(Reference::Same, Part::Diffuse).is_some();
        if self.rows_of(scene).iter().any(has_diffuse) { Part::Diffuse } else { Part::Total }
    }

    /// `rows.csv` (RFC 4180, lines end in a newline): a header with units, then a line per row. A number that was not
    /// measured is an empty cell.
    pub fn csv(&self) -> String {
        let passes = pass_names(&self.rows);
        let rows: Vec<_> = self.rows.iter().map(|row| self.cells(row, &passes)).collect();
        let header = rows.first().map(|cells| cells.iter().map(|(name, _)| name).collect::<Vec<_>>());
        let lines = rows.iter().map(|cells| cells.iter().map(|(_, value)| value).collect());
        to_csv(header.into_iter().chain(lines))
    }

    /// A row's cells, each with the name of its column.
    fn cells(&self, row: &Row, passes: &[String]) -> Vec<(String, String)> {
        let m = row.measured.as_ref();
        let number = |value: Option<f64>| value.map_or(String::new(), short);
        let mut cells: Vec<(String, String)> = Vec::new();
        let mut add = |name: &str, value: String| cells.push((name.to_owned(), value));
        add("scene", row.scene.clone());
        add("name", row.name.clone());
        add("source", row.source.word().to_owned());
        add("preset", row.preset.clone());
        add("changes", row.changes.join(" "));
        add("failure", row.failure.clone().unwrap_or_default());
        let origin = |of: &dyn Fn(&Origin) -> String| row.origin.as_ref().map(of).unwrap_or_default();
        add("machine", origin(&|o| o.machine.clone()));
        add("device", origin(&|o| o.device.clone()));
        add("driver", origin(&|o| o.driver.clone()));
        add("program", origin(&|o| o.program.clone()));
        add("build", origin(&|o| o.build.clone()));
        add("label", origin(&|o| o.label.clone().unwrap_or_default()));
        add("measured_unix_s", origin(&|o| o.unix_s.to_string()));
        add("width_pixels", self.width.to_string());
        add("height_pixels", self.height.to_string());
        add("frames", number(m.map(|m| m.frames as f64)));
        let gpu_ms = m.and_then(|m| m.frame_gpu_ms);
        add("frame_gpu_ms", number(gpu_ms.map(|spread| spread.median)));
        add("frame_gpu_ms_min", number(gpu_ms.map(|spread| spread.min)));
        add("frame_gpu_ms_max", number(gpu_ms.map(|spread| spread.max)));
        add("frame_cpu_ms", number(m.and_then(|m| Some(m.frame_cpu_ms?.median))));
        add("frame_wall_ms", number(m.and_then(|m| Some(m.frame_wall_ms?.median))));
        add("memory_bytes", number(m.and_then(|m| Some(m.memory_bytes? as f64))));
        add("nonfinite", number(m.map(|m| m.nonfinite as f64)));
        add("equal_terms", m.map_or(String::new(), |m| m.equal_terms.join(" ")));
        for (reference, errors) in [("full", m.map(|m| m.full)), ("same", m.map(|m| m.same))] {
            let bounces = errors.map(|e| e.bounces.map_or("all".to_owned(), |n| n.to_string()));
            add(&format!("{reference}_bounces"), bounces.unwrap_or_default());
            add(&format!("{reference}_noise"), number(errors.map(|e| e.noise)));
            let total = errors.map(|e| e.total);
            let (indirect, diffuse) = (errors.and_then(|e| e.indirect), errors.and_then(|e| e.diffuse));
            for (part, metrics) in [("total", total), ("indirect", indirect), ("diffuse", diffuse)] {
                for (i, name) in Metrics::NAMES.iter().enumerate() {
                    add(&format!("{reference}_{part}_{name}"), number(metrics.map(|m| m.values()[i])));
                }
                if part == "total" {
                    add(&format!("{reference}_flip"), number(errors.map(|e| e.flip)));
                }
            }
            let noise = errors.map(|e| e.noise_in_rel);
            add(&format!("{reference}_total_noise_in_rel"), number(noise.map(|n| n.total)));
            add(&format!("{reference}_indirect_noise_in_rel"), number(noise.and_then(|n| n.indirect)));
            add(&format!("{reference}_diffuse_noise_in_rel"), number(noise.and_then(|n| n.diffuse)));
        }
        for name in passes {
            let pass = m.and_then(|m| m.passes.iter().find(|pass| pass.name == *name));
            add(&format!("pass {name} gpu_ms"), number(pass.map(|pass| pass.gpu_ms)));
        }
        add("paths", number(row.paths().map(f64::from)));
        let given = |of: &dyn Fn(&Claim) -> Option<String>| match &row.source {
            Source::Import(claim) => of(claim).unwrap_or_default(),
            _ => String::new(),
        };
        add("given_ms", given(&|claim| Some(short(claim.milliseconds))));
        add("given_by", given(&|claim| claim.by.clone()));
        add("given_device", given(&|claim| claim.device.clone()));
        add("given_note", given(&|claim| claim.note.clone()));
        add("given_image", given(&|claim| Some(claim.image.clone())));
        add("given_equal_terms_image", given(&|claim| claim.equal_terms_image.clone()));
        add("given_indirect", given(&|claim| Some(claim.indirect.clone())));
        let (settings, keys) = (row.settings.as_ref().map(Settings::entries), Settings::default().entries());
        for (i, (key, _)) in keys.into_iter().enumerate() {
            add(key.name, settings.as_ref().map_or(String::new(), |entries| entries[i].1.clone()));
        }
        cells
    }
}

/// Every pass of any row, in the order of their first frame.
fn pass_names(rows: &[Row]) -> Vec<String> {
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
