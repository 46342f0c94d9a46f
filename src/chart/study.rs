//! The default study: every preset, and every axis by itself on top of a preset. `docs/study/README.md` is made from it.

use std::collections::BTreeSet;

use super::export::{Chart, SceneLine};
use super::frontier::frontiers;
use super::plan::{Trial, distinct, sweep, trials};
use super::row::{Part, Reference, Row};
use super::subject::{Source, Subject};
use crate::Result;
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

/// The marks around the handwritten part of the page, which is kept when the page is written again.
const HANDWRITTEN: [&str; 2] = ["<!-- by hand, and kept: from here -->\n", "<!-- to here -->\n"];

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

/// The part between the marks of an earlier page; `None` for a text that is no such page.
pub fn handwritten(page: &str) -> Option<&str> {
    let (_, rest) = page.split_once(HANDWRITTEN[0])?;
    Some(rest.split_once(HANDWRITTEN[1])?.0)
}

/// The page. `sets`: as for [`lines`]; `handwritten`: the part to keep of an earlier page.
pub fn document(chart: &Chart, lines: &[(&'static str, Trial)], sets: &[String], handwritten: &str) -> String {
    let (devices, noise) = (chart.devices(), 100.0 * chart.reference_noise);
    let paths: BTreeSet<u32> = chart.rows.iter().filter_map(Row::paths).collect();
    let traced = match paths.is_empty() {
        true => "",
        false => "; of the path tracer, which stands last, the wall time on the processor",
    };
    let base = BASE.iter().copied().chain(sets.iter().map(String::as_str)).collect::<Vec<_>>().join(" ");
    let [title, flag, axes] = match lines.iter().any(|(axis, _)| *axis != PRESETS_AXIS) {
        true => ["setting", "", ", then every axis by itself, on\ntop of the preset that starts its line"],
        false => ["preset", " --presets-only", ""],
    };
    let mut page = format!(
        "# Error and time of every {title}\n\n\
         Written by `twobounce study{flag}`; it is run again whenever a method changes. It measures every preset{axes}. `{base}`, \
         unless a line says otherwise. Measured at {}×{} pixels on\n\
         {devices}. `ms` is the GPU time of a frame{traced}. The other columns are `rel`, mean |error| over mean reference: `same`\n\
         against light of as many bounces, `all` against all light; the references' own noise is {noise} %. *Whole* is `rel` of the whole\n\
         image, *diffuse* that of the indirect light on diffuse surfaces, on equal terms: direct light and lamps are the exact ones\n\
         (`docs/accuracy.md` defines both). Lines marked * were measured for that with what rows.csv names in its column\n\
         `equal_terms`. **Bold**: no other setting is both faster and more accurate. [rows.csv](rows.csv)\n\
         has every number.\n\n## Surprises\n\n{}{handwritten}{}\n",
        chart.width, chart.height, HANDWRITTEN[0], HANDWRITTEN[1]
    );
    for scene in &chart.scenes {
        page += &format!("![{0}: error against time]({0}.svg)\n\n", scene.name);
    }
    page += "| axis | setting | method |";
    let columns: Vec<Columns> = chart.scenes.iter().map(|scene| Columns::new(chart, scene)).collect();
    for Columns { scene, errors, .. } in &columns {
        page += &format!(" {scene} ms |");
        errors.iter().for_each(|error| page += &format!(" {} |", error.title));
    }
    let numbers: usize = columns.iter().map(|scene| 1 + scene.errors.len()).sum();
    page += &format!("\n|---|---|---|{}\n", "---:|".repeat(numbers));
    let mut last = "";
    for (name, trial) in lines {
        let axis = if *name == last { "" } else { name };
        let mark = if terms::changes(&trial.settings).is_empty() { "" } else { "*" };
        page += &format!("| {axis} | `{}`{mark} | {} |", trial.name(), trial.settings.method);
        last = name;
        let is_meant = |row: &Row| row.settings.as_ref().is_some_and(|own| own.means_same(&trial.settings));
        columns.iter().for_each(|scene| page += &scene.cells(&is_meant));
        page += "\n";
    }
    for (i, paths) in paths.iter().enumerate() {
        let axis = if i == 0 { PATHS_AXIS } else { "" };
        page += &format!("| {axis} | `{}` | path tracer |", Subject::Paths(*paths).name());
        let is_meant = |row: &Row| row.source == Source::PathTracer { paths: *paths };
        columns.iter().for_each(|scene| page += &scene.cells(&is_meant));
        page += "\n";
    }
    page
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
    fn cells(&self, is_meant: &dyn Fn(&Row) -> bool) -> String {
        let row = self.rows.iter().find(|row| is_meant(row));
        let time = row.and_then(|row| Some(format!("{:.0}", row.ms()?)));
        let error = |Error { part, reference, best, .. }: &Error| {
            let row = row?;
            let bold = if best.contains(&row.key) { "**" } else { "" };
            Some(format!("{bold}{:.3}{bold}", row.rel(*reference, *part)?))
        };
        let cells = std::iter::once(time).chain(self.errors.iter().map(error));
        cells.map(|cell| format!(" {} |", cell.unwrap_or("–".to_owned()))).collect()
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
        let page = document(&chart, &lines[..2], &[], "");
        let table: Vec<_> = page.lines().filter(|line| line.starts_with('|')).collect();
        let four = "whole, same | whole, all | diffuse, same | diffuse, all |";
        assert_eq!(table[0], format!("| axis | setting | method | box ms | {four} room ms | {four}"));
        let cells = "| 7 | **9.000** | **9.000** | **0.100** | **0.200** |".repeat(2).replace("||", "|");
        assert!(table[2].ends_with(&cells), "{}", table[2]);
        assert!(table[3].ends_with(&"| – | – | – | – | – |".repeat(2).replace("||", "|")), "{}", table[3]);
        assert!(table.iter().all(|line| line.matches('|').count() == 14), "{table:?}");
    }

    #[test]
    fn the_handwritten_part_is_kept() {
        let chart = Chart::default();
        let page = document(&chart, &[], &[], "Nothing did.\n");
        assert_eq!(handwritten(&page), Some("Nothing did.\n"));
        assert_eq!(document(&chart, &[], &[], handwritten(&page).unwrap()), page);
        assert_eq!(handwritten("# My own page"), None);
    }
}
