//! The default study: every preset, and every axis on top of a preset. It fills the tables of
//! `docs/notes/study/README.md`.

use std::collections::BTreeSet;
use std::sync::LazyLock;

use serde::Deserialize;

use super::export::Chart;
use super::frontier::frontiers;
use super::marks::mark;
use super::outline::SceneLine;
use super::plan::{sweep, trials};
use super::row::{Reference, Row};
use crate::Result;
use crate::lab::table;
use crate::measure::metrics::Part;
use crate::measure::terms;
use crate::settings::{PRESETS, Settings};

/// Paths of the scenes from the project's root.
pub const SCENES: &[&str] = &["assets/cornell-area.glb", "assets/cornell-point.glb", "assets/gallery.glb"];

/// Settings for every preset, so that the study can run on a CPU; 128³ has its own axis.
pub const BASE: &[&str] = &["voxels=64"];

/// An axis of the study, a line of `src/chart/study.toml`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Axis {
    name: String,
    /// The base preset.
    base: String,
    /// The values to try: a sweep, or `key=value` of several keys at once, separated by spaces.
    values: Vec<String>,
}

fn axes() -> &'static [Axis] {
    #[derive(Deserialize)]
    struct Axes {
        axis: Vec<Axis>,
    }
    static AXES: LazyLock<Axes> =
        LazyLock::new(|| toml::from_str(include_str!("study.toml")).expect("a test reads the file"));
    &AXES.axis
}

/// The name of the path tracer's lines, which come last.
pub const PATHS_AXIS: &str = "path tracer";

/// The name of the presets' lines.
pub const PRESETS_AXIS: &str = "preset";

/// The axis's name and the setting of every line of the page's table. `sets` are applied after [`BASE`].
///
/// # Errors
/// An axis or `sets` names a setting that does not exist.
pub fn lines(sets: &[String]) -> Result<Vec<(&'static str, Row)>> {
    let base = |preset: &str| {
        let mut settings = Settings::preset(preset)?;
        let assignments = BASE.iter().copied().chain(sets.iter().map(String::as_str));
        assignments.into_iter().try_for_each(|assignment| settings.set(assignment))?;
        Ok(Row::of_settings(preset, &[], settings))
    };
    let presets = PRESETS.iter().map(|preset| Ok((PRESETS_AXIS, base(preset.name)?)));
    let mut lines = presets.collect::<Result<Vec<_>>>()?;
    for axis in axes() {
        // The first value is the base itself, which is a row of the presets.
        let swept = trials(&[base(&axis.base)?], &axis.swept()?)?.into_iter().skip(1);
        lines.extend(swept.map(|trial| (axis.name.as_str(), trial)));
    }
    Ok(lines)
}

impl Axis {
    /// Its values, each a list of `key=value`.
    fn swept(&self) -> Result<Vec<Vec<String>>> {
        let one = |text: &String| match text.contains(' ') {
            true => Ok(vec![text.split(' ').map(str::to_owned).collect()]),
            false => sweep(text),
        };
        Ok(self.values.iter().map(one).collect::<Result<Vec<_>>>()?.concat())
    }
}

/// A new page, without its tables.
pub const EMPTY: &str = include_str!("study.md");

/// Whether a text is a page of the study.
pub fn is_page(page: &str) -> bool {
    table::tables(page).is_ok_and(|tables| tables.iter().any(|(name, _)| name == "settings"))
}

/// The page with its tables filled. `sets` are as for [`lines`].
///
/// # Errors
/// The page has a mark of a table without an end.
pub fn document(chart: &Chart, lines: &[(&'static str, Row)], sets: &[String], page: &str) -> Result<String> {
    table::fill(page, |name, old| {
        Ok(match name {
            "conditions" => conditions(chart, lines, sets),
            "settings" => settings_table(chart, lines),
            _ => old.to_owned(),
        })
    })
}

fn conditions(chart: &Chart, lines: &[(&'static str, Row)], sets: &[String]) -> String {
    let base = BASE.iter().copied().chain(sets.iter().map(String::as_str)).collect::<Vec<_>>().join(" ");
    let axes = match lines.iter().any(|(axis, _)| *axis != PRESETS_AXIS) {
        true => ", then every axis by itself, on top of the preset that starts its line",
        false => "",
    };
    format!(
        "Measured is every preset{axes}; `{base}`, unless a line says otherwise.\n{}×{} pixels on {};\nthe references' own noise is {} %.",
        chart.outline.width,
        chart.outline.height,
        chart.devices(),
        100.0 * chart.outline.reference_noise
    )
}

/// The errors of each scene in the table.
const ERRORS: [(&str, Part, Reference); 4] = [
    ("whole, same", Part::Total, Reference::Same),
    ("whole, all", Part::Total, Reference::Full),
    ("diffuse, same", Part::Diffuse, Reference::Same),
    ("diffuse, all", Part::Diffuse, Reference::Full),
];

/// The pictures, and a line for every setting: for each scene the time and errors. Errors on a frontier of time and
/// error are bold.
fn settings_table(chart: &Chart, lines: &[(&'static str, Row)]) -> String {
    let mut head = ["axis", "setting", "method"].map(str::to_owned).to_vec();
    let mut table: Vec<Vec<String>> = Vec::new();
    let mut last = "";
    for (axis, trial) in lines {
        let is_changed = trial.settings.as_ref().is_some_and(|settings| !terms::changes(settings).is_empty());
        let star = if is_changed { "*" } else { "" };
        let shown = if *axis == last { "" } else { axis };
        last = axis;
        table.push(vec![shown.to_owned(), format!("`{}`{star}", trial.name), mark(trial).method.to_owned()]);
    }
    let traced: BTreeSet<u32> = chart.rows().filter_map(Row::paths).collect();
    for (i, paths) in traced.iter().enumerate() {
        let axis = if i == 0 { PATHS_AXIS } else { "" };
        table.push(vec![axis.to_owned(), format!("`{}`", Row::of_paths(*paths).name), "path tracer".to_owned()]);
    }
    for SceneLine { name, .. } in chart.scenes() {
        let rows = chart.rows_of(name);
        let is_of = |row: &&Row, trial: &Row| {
            row.settings.as_ref().zip(trial.settings.as_ref()).is_some_and(|(own, meant)| own.means_same(meant))
        };
        let of_line = lines.iter().map(|(_, trial)| rows.iter().position(|row| is_of(row, trial)));
        let of_paths = traced.iter().map(|paths| rows.iter().position(|row| row.paths() == Some(*paths)));
        let found: Vec<Option<usize>> = of_line.chain(of_paths).collect();
        let mut column = |title: String, cell: &dyn Fn(usize) -> Option<String>| {
            head.push(title);
            for (line, row) in table.iter_mut().zip(&found) {
                line.push(row.and_then(cell).unwrap_or(table::MISSING.to_owned()));
            }
        };
        column(format!("{name} ms"), &|row| Some(format!("{:.0}", rows[row].ms()?)));
        let places: Vec<_> = rows.iter().map(|row| row.place().filter(|_| !chart.mix_machines)).collect();
        for (title, part, reference) in ERRORS {
            let point = |row: &&Row| row.ms().zip(row.rel(reference, part)).unwrap_or((f64::NAN, f64::NAN));
            let best = frontiers(&rows.iter().map(point).collect::<Vec<_>>(), &places).concat();
            column(title.to_owned(), &|row| {
                let bold = if best.contains(&row) { "**" } else { "" };
                Some(format!("{bold}{:.3}{bold}", rows[row].rel(reference, part)?))
            });
        }
    }
    let picture = |scene: &SceneLine| format!("![{0}: error against time]({0}.svg)\n\n", scene.name);
    chart.scenes().map(picture).collect::<String>() + &table::markdown(head, "---:", table)
}

#[cfg(test)]
mod tests {
    use super::super::outline::Sketch;
    use super::super::plan::distinct;
    use super::super::row::{Errors, Measured};
    use super::*;
    use crate::lab::store::Stored;
    use crate::measure::metrics::{Metrics, Parts};
    use crate::measure::timing::Spread;

    #[test]
    fn every_axis_exists_and_no_line_is_there_twice() {
        let lines = lines(&[]).unwrap();
        for axis in axes() {
            let found = lines.iter().filter(|(name, _)| *name == axis.name).count();
            assert_eq!(found, axis.swept().unwrap().len(), "{}: a value is the base's own, or there twice", axis.name);
        }
        assert_eq!(
            distinct(lines.iter().map(|line| line.1.clone())).len(),
            lines.len(),
            "two lines are the same setting"
        );
    }

    #[test]
    fn every_scene_has_the_errors_of_the_whole_and_of_diffuse_surfaces() {
        let lines = lines(&[]).unwrap();
        let metrics = |rel: f64| Metrics { rel, ..Metrics::default() };
        let errors = |rel: f64| {
            let metrics =
                Parts { total: metrics(9.0), indirect: Some(metrics(rel)), diffuse: Some(metrics(rel / 2.0)) };
            Errors { metrics, ..Errors::default() }
        };
        let measured = Measured {
            frame_gpu_ms: Some(Spread { median: 7.0, min: 7.0, max: 7.0 }),
            full: errors(0.4),
            same: errors(0.2),
            ..Measured::default()
        };
        let mut chart = Chart::default();
        for (name, all_diffuse) in [("box", true), ("room", false)] {
            let (hash, camera, command) = (String::new(), String::new(), String::new());
            let line = SceneLine { name: name.into(), hash, triangles: 0, camera, all_diffuse, command };
            chart.outline.scenes.push(Sketch { line, truths: vec![] });
            let row = Row { measured: Some(measured.clone()), scene: name.into(), ..lines[0].1.clone() };
            chart.rows.push(Stored { version: 0, program: String::new(), row, pictures: None });
        }
        let page = document(&chart, &lines[..2], &[], EMPTY).unwrap();
        let table: Vec<_> = page.lines().filter(|line| line.starts_with('|')).collect();
        let four = "whole, same | whole, all | diffuse, same | diffuse, all |";
        assert_eq!(table[0], format!("| axis | setting | method | box ms | {four} room ms | {four}"));
        let cells = "| 7 | **9.000** | **9.000** | **0.100** | **0.200** |".repeat(2).replace("||", "|");
        assert!(table[2].ends_with(&cells), "{}", table[2]);
        assert!(table[3].ends_with(&"| – | – | – | – | – |".repeat(2).replace("||", "|")), "{}", table[3]);
        assert!(table.iter().all(|line| line.matches('|').count() == 14), "{table:?}");
    }
}
