//! The default study: every preset, and every axis by itself on top of a preset. It fills the tables of `docs/study/README.md`.

use std::collections::BTreeSet;

use super::export::{Chart, SceneLine};
use super::frontier::frontiers;
use super::plan::{Trial, distinct, sweep, trials};
use super::row::{Part, Reference, Row};
use super::subject::{Source, Subject};
use crate::Result;
use crate::lab::table;
use crate::measure::terms;
use crate::settings::{PRESETS, Settings};

/// The scenes, from the project's root.
pub const SCENES: &[&str] = &["assets/cornell-area.glb", "assets/cornell-point.glb", "assets/gallery.glb"];

/// Set in every preset first, so that the study can run on a CPU; 128³ has its own axis.
pub const BASE: &[&str] = &["voxels=64"];

/// An axis's name, the preset to start from, and what is tried on top of it: a sweep, `key=value,value,…`, or `key=value` of
/// several keys at once, separated by spaces. To add an axis, add a line.
pub const AXES: &[(&str, &str, &[&str])] = &[
    ("grid", "balanced", &["voxels=32,128"]),
    ("grid, fast", "fast", &["voxels=32,128"]),
    ("all bounces, fast", "fast", &["bounces=all"]),
    ("all bounces", "balanced", &["bounces=all,1"]),
    ("all bounces, accurate", "accurate", &["bounces=all"]),
    ("rays of the image", "balanced", &["rays.diffuse=4,16,64"]),
    ("rays of the voxels", "balanced", &["rays.bounce=1,8"]),
    ("lamps of the voxels", "balanced", &["lights.voxel_lamp_points=1,16"]),
    ("shared directions", "balanced", &["image.interleave=1"]),
    ("gathered pixels", "balanced", &["image.gather_resolution=full,quarter"]),
    ("lamps", "balanced", &["lights.lamps=gathered", "lights.lamp_points=64"]),
    ("samples", "balanced", &["image.samples=1", "image.direct=pixels"]),
    ("method", "balanced", &["method=none,cones"]),
    ("cone set", "cones", &["cones.set=1,5,6a,6b,16,g8,g32"]),
    ("passes", "cones", &["cones.passes=layered"]),
    ("shared cones", "cones", &["image.interleave=4 cones.set=g8 image.gather_resolution=half"]),
    ("cone step", "cones", &["cones.step=0.5,2"]),
    ("aperture", "cones", &["cones.aperture=0.7,1.4"]),
    ("fill", "cones", &["cones.fill=uniform,facing,coverage"]),
    ("face weights", "cones", &["cones.weights=d2,norm1,extinction"]),
    ("blend", "cones", &["cones.blend=over"]),
    ("cells of lpv", "lpv", &["lpv.edge=16,64", "lpv.cascades=3"]),
    ("steps of lpv", "lpv", &["lpv.iterations=8,16,64"]),
    ("beams of lpv", "lpv", &["lpv.sharpness=0.3,0.7", "lpv.lobe=cosine"]),
    ("occlusion of lpv", "lpv", &["lpv.occlusion=none"]),
    ("all bounces, lpv", "lpv", &["bounces=all"]),
    (
        "cones of photons",
        "photons",
        &[
            "image.interleave=1 photons.diffuse=1",
            "image.interleave=1 photons.diffuse=4",
            "image.interleave=1 photons.diffuse=16",
            "image.interleave=1 photons.diffuse=64",
        ],
    ),
    ("all bounces, photons", "photons", &["bounces=all"]),
    ("all three as in the talk", "cones", &["cones.fill=uniform cones.weights=d2 cones.blend=over"]),
    ("start", "cones", &["cones.start.diffuse_normal=0.5,2", "cones.start.diffuse_along=0,2"]),
    ("jitter", "cones", &["cones.jitter=true"]),
    ("roughness", "cones", &["cones.roughness_fit=linear"]),
    ("shadows", "corrected", &["lights.shadows=none,rays", "lights.shadows=rays cones.first_bounce_shadows=true"]),
    (
        "sets of the talk",
        "corrected",
        &["cones.set=6a", "cones.set=6a cones.ledger.d6=printed", "cones.set=16 cones.ledger.d26=printed"],
    ),
];

/// The name of the path tracer's lines, which stand last.
pub const PATHS_AXIS: &str = "path tracer";

/// The name of the presets' lines.
pub const PRESETS_AXIS: &str = "preset";

/// The axis's name and the setting of every line of the page's table. `sets`: applied after [`BASE`].
///
/// # Errors
/// An axis names a setting that is not there, or `sets` does.
pub fn lines(sets: &[String]) -> Result<Vec<(&'static str, Trial)>> {
    let base = |preset: &str| {
        let mut settings = Settings::preset(preset)?;
        let assignments = BASE.iter().copied().chain(sets.iter().map(String::as_str));
        assignments.into_iter().try_for_each(|assignment| settings.set(assignment))?;
        Ok(Trial::base(preset, settings))
    };
    let presets = PRESETS.iter().map(|preset| Ok((PRESETS_AXIS, base(preset.name)?)));
    let mut lines = presets.collect::<Result<Vec<_>>>()?;
    for (name, preset, tried) in AXES {
        // The first is the base itself, which the presets have.
        let swept = trials(&[base(preset)?], &values(tried)?)?.into_iter().skip(1);
        lines.extend(swept.map(|trial| (*name, trial)));
    }
    Ok(lines)
}

/// The values of an axis, each a list of `key=value`.
fn values(tried: &[&str]) -> Result<Vec<Vec<String>>> {
    let one = |text: &&str| match text.contains(' ') {
        true => Ok(vec![text.split(' ').map(str::to_owned).collect()]),
        false => sweep(text),
    };
    Ok(tried.iter().map(one).collect::<Result<Vec<_>>>()?.concat())
}

/// Every setting of `lines` once.
pub fn settings(lines: &[(&'static str, Trial)]) -> Vec<Trial> {
    distinct(lines.iter().map(|(_, trial)| trial.clone()))
}

/// A new page, without its tables.
pub const EMPTY: &str = include_str!("study.md");

/// Whether a text is such a page.
pub fn is_page(page: &str) -> bool {
    table::tables(page).is_ok_and(|tables| tables.iter().any(|(name, _)| name == "settings"))
}

/// The page with its tables filled. `sets`: as for [`lines`].
///
/// # Errors
/// A mark of a table in the page without an end.
pub fn document(chart: &Chart, lines: &[(&'static str, Trial)], sets: &[String], page: &str) -> Result<String> {
    table::fill(page, |name, old| {
        Ok(match name {
            "conditions" => conditions(chart, lines, sets),
            "settings" => settings_table(chart, lines),
            _ => old.to_owned(),
        })
    })
}

fn conditions(chart: &Chart, lines: &[(&'static str, Trial)], sets: &[String]) -> String {
    let base = BASE.iter().copied().chain(sets.iter().map(String::as_str)).collect::<Vec<_>>().join(" ");
    let axes = match lines.iter().any(|(axis, _)| *axis != PRESETS_AXIS) {
        true => ", then every axis by itself, on top of the preset that starts its line",
        false => "",
    };
    format!(
        "Measured is every preset{axes}; `{base}`, unless a line says otherwise.\n{}×{} pixels on {};\nthe references' own noise is {} %.",
        chart.width,
        chart.height,
        chart.devices(),
        100.0 * chart.reference_noise
    )
}

/// The pictures, and a line for every setting.
fn settings_table(chart: &Chart, lines: &[(&'static str, Trial)]) -> String {
    let columns: Vec<Columns> = chart.scenes.iter().map(|scene| Columns::new(chart, scene)).collect();
    let head = columns.iter().flat_map(|Columns { scene, errors, .. }| {
        std::iter::once(format!("{scene} ms")).chain(errors.iter().map(|error| error.title.clone()))
    });
    let head = ["axis", "setting", "method"].into_iter().map(str::to_owned).chain(head);
    let mut last = "";
    let mut line = |axis: &'static str, setting: String, method: &str, is_meant: &dyn Fn(&Row) -> bool| {
        let shown = if axis == last { "" } else { axis };
        last = axis;
        let cells = columns.iter().flat_map(|scene| scene.cells(is_meant)).collect::<Vec<_>>();
        [shown.to_owned(), setting, method.to_owned()].into_iter().chain(cells).collect::<Vec<_>>()
    };
    let mut rows = Vec::new();
    for (axis, trial) in lines {
        let mark = if terms::changes(&trial.settings).is_empty() { "" } else { "*" };
        let is_meant = |row: &Row| row.settings.as_ref().is_some_and(|own| own.means_same(&trial.settings));
        rows.push(line(axis, format!("`{}`{mark}", trial.name()), trial.settings.method.name(), &is_meant));
    }
    for paths in chart.rows.iter().filter_map(Row::paths).collect::<BTreeSet<u32>>() {
        let is_meant = |row: &Row| row.source == Source::PathTracer { paths };
        rows.push(line(PATHS_AXIS, format!("`{}`", Subject::Paths(paths).name()), "path tracer", &is_meant));
    }
    let picture = |scene: &SceneLine| format!("![{0}: error against time]({0}.svg)\n\n", scene.name);
    chart.scenes.iter().map(picture).collect::<String>() + &table::markdown(head, "---:", rows)
}

/// The table's columns for a scene: the time, then errors.
struct Columns<'a> {
    scene: &'a str,
    rows: Vec<&'a Row>,
    errors: Vec<Error>,
}

/// A column of errors.
struct Error {
    title: String,
    part: Part,
    reference: Reference,
    /// Keys of the rows on the frontier of time and `rel`.
    best: Vec<String>,
}

impl<'a> Columns<'a> {
    fn new(chart: &'a Chart, scene: &'a SceneLine) -> Self {
        let rows = chart.rows_of(&scene.name);
        let mut errors = Vec::new();
        for (part, name) in [(Part::Total, "whole"), (Part::Diffuse, "diffuse")] {
            for (reference, light) in [(Reference::Same, "same"), (Reference::Full, "all")] {
                let point = |row: &&Row| row.ms().zip(row.rel(reference, part)).unwrap_or((f64::NAN, f64::NAN));
                let places: Vec<_> = rows.iter().map(|row| row.place().filter(|_| !chart.mix_machines)).collect();
                let best = frontiers(&rows.iter().map(point).collect::<Vec<_>>(), &places);
                let best = best.concat().into_iter().map(|i| rows[i].key.clone()).collect();
                errors.push(Error { title: format!("{name}, {light}"), part, reference, best });
            }
        }
        Self { scene: &scene.name, rows, errors }
    }

    /// Time and errors of the row that is meant.
    fn cells(&self, is_meant: &dyn Fn(&Row) -> bool) -> Vec<String> {
        let row = self.rows.iter().find(|row| is_meant(row));
        let time = row.and_then(|row| Some(format!("{:.0}", row.ms()?)));
        let error = |Error { part, reference, best, .. }: &Error| {
            let row = row?;
            let bold = if best.contains(&row.key) { "**" } else { "" };
            Some(format!("{bold}{:.3}{bold}", row.rel(*reference, *part)?))
        };
        let cells = std::iter::once(time).chain(self.errors.iter().map(error));
        cells.map(|cell| cell.unwrap_or(table::MISSING.to_owned())).collect()
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::super::row::Measured;
    use super::*;

    #[test]
    fn every_axis_exists_and_no_line_is_there_twice() {
        let lines = lines(&[]).unwrap();
        for (name, _, tried) in AXES {
            let found = lines.iter().filter(|(axis, _)| axis == name).count();
            assert_eq!(found, values(tried).unwrap().len(), "{name}: a value is the base's own, or there twice");
        }
        assert_eq!(settings(&lines).len(), lines.len(), "two lines are the same setting");
    }

    #[test]
    fn every_scene_has_the_errors_of_the_whole_and_of_diffuse_surfaces() {
        let lines = lines(&[]).unwrap();
        let spread = json!({ "median": 7.0, "min": 7.0, "max": 7.0 });
        let metrics = |rel: f64| json!({ "energy": 1.0, "rel": rel, "relmse": 0.0, "p95": 0.0 });
        let errors = |rel: f64| {
            let (total, indirect, diffuse) = (metrics(9.0), metrics(rel), metrics(rel / 2.0));
            json!({ "noise": 0.0, "noise_in_rel": { "total": 0.0 }, "flip": 0.0, "total": total, "indirect": indirect, "diffuse": diffuse })
        };
        let measured = json!({
            "frames": 5, "frame_gpu_ms": spread, "frame_wall_ms": spread, "passes": [], "memory_bytes": 0, "nonfinite": 0,
            "equal_terms": [], "full": errors(0.4), "same": errors(0.2)
        });
        let measured: Measured = serde_json::from_value(measured).unwrap();
        let line = |name: &str, all_diffuse| SceneLine {
            name: name.into(),
            hash: String::new(),
            triangles: 0,
            camera: String::new(),
            all_diffuse,
            command: String::new(),
        };
        let row = |scene: &str| Row {
            measured: Some(measured.clone()),
            ..Row::new(scene.into(), scene, &Subject::Settings(lines[0].1.clone()))
        };
        let rows = vec![row("box"), row("room")];
        let chart = Chart { scenes: vec![line("box", true), line("room", false)], rows, ..Chart::default() };
        let page = document(&chart, &lines[..2], &[], EMPTY).unwrap();
        let table: Vec<_> = page.lines().filter(|line| line.starts_with('|')).collect();
        let four = "whole, same | whole, all | diffuse, same | diffuse, all |";
        assert_eq!(table[0], format!("| axis | setting | method | box ms | {four} room ms | {four}"));
        let cells = "| 7 | **9.000** | **9.000** | **0.100** | **0.200** |".repeat(2).replace("||", "|");
        assert!(table[2].ends_with(&cells), "{}", table[2]);
        assert!(table[3].ends_with(&"| – | – | – | – | – |".repeat(2).replace("||", "|")), "{}", table[3]);
        assert!(table.iter().all(|line| line.matches('|').count() == 14), "{table:?}");
    }

    #[test]
    fn what_people_write_is_kept() {
        let chart = Chart::default();
        let page = EMPTY.replace("Nothing is written here yet.", "Nothing did.");
        let filled = document(&chart, &[], &[], &page).unwrap();
        assert!(filled.contains("Nothing did.") && filled.contains("| axis | setting | method |"), "{filled}");
        assert_eq!(document(&chart, &[], &[], &filled).unwrap(), filled);
        assert!(is_page(&filled) && !is_page("# My own page"));
    }
}
