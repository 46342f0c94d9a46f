//! The default study: every preset, and every axis by itself from a named base. `docs/study/README.md` is made from it.

use std::fmt::Write as _;

use super::export::{Chart, SceneLine};
use super::frontier::frontier;
use super::plan::{Axis, Base, Trial, trials};
use super::row::{Metric, Part, Row, Truth};
use crate::Result;
use crate::settings::{PRESETS, Settings};

/// The scenes, from the project's root.
pub const SCENES: &[&str] = &["assets/cornell-area.glb", "assets/cornell-point.glb", "assets/gallery.glb"];

/// Set in every preset first, so that the study can be run on a processor; 128³ is on an axis of its own.
pub const BASE: &[&str] = &["voxels=64"];

/// One axis: values that are tried one after the other on top of a preset.
#[derive(Clone, Copy, Debug)]
pub struct StudyAxis {
    pub name: &'static str,
    /// The preset to start from.
    pub base: &'static str,
    /// Each a list of `key=value`, separated by spaces. What the base already has is left out.
    pub values: &'static [&'static str],
}

const fn axis(name: &'static str, base: &'static str, values: &'static [&'static str]) -> StudyAxis {
    StudyAxis { name, base, values }
}

/// To add an axis, add a line here.
pub const AXES: &[StudyAxis] = &[
    axis("grid", "balanced", &["voxels=32", "voxels=128"]),
    axis("grid, fast", "fast", &["voxels=32", "voxels=128"]),
    axis("all bounces, fast", "fast", &["bounces=all"]),
    axis("all bounces", "balanced", &["bounces=all", "bounces=1"]),
    axis("all bounces, accurate", "accurate", &["bounces=all"]),
    axis("rays of the image", "balanced", &["rays.diffuse=4", "rays.diffuse=16", "rays.diffuse=64"]),
    axis("rays of the voxels", "balanced", &["rays.bounce=1", "rays.bounce=8"]),
    axis("lamps of the voxels", "balanced", &["lights.voxel_lamp_points=1", "lights.voxel_lamp_points=16"]),
    axis("shared directions", "balanced", &["image.interleave=1"]),
    axis("gathered pixels", "balanced", &["image.gather_resolution=full", "image.gather_resolution=quarter"]),
    axis("lamps", "balanced", &["lights.lamps=gathered", "lights.lamp_points=64"]),
    axis("samples", "balanced", &["image.samples=1", "image.direct=samples"]),
    axis("method", "balanced", &["method=none", "method=cones"]),
    axis(
        "cone set",
        "cones",
        &[
            "cones.set=1",
            "cones.set=5",
            "cones.set=6a",
            "cones.set=6b",
            "cones.set=16",
            "cones.set=g8",
            "cones.set=g32",
        ],
    ),
    axis("passes", "cones", &["cones.passes=layered"]),
    axis("shared cones", "cones", &["image.interleave=4 cones.set=g8 image.gather_resolution=half"]),
    axis("cone step", "cones", &["cones.step=0.5", "cones.step=2"]),
    axis("aperture", "cones", &["cones.aperture=0.7", "cones.aperture=1.4"]),
    axis("fill", "cones", &["cones.fill=uniform", "cones.fill=facing", "cones.fill=coverage"]),
    axis("face weights", "cones", &["cones.weights=d2", "cones.weights=norm1", "cones.weights=extinction"]),
    axis("blend", "cones", &["cones.blend=over"]),
    axis("all three as in the talk", "cones", &["cones.fill=uniform cones.weights=d2 cones.blend=over"]),
    axis(
        "start",
        "cones",
        &[
            "cones.start.diffuse_normal=0.5",
            "cones.start.diffuse_normal=2",
            "cones.start.diffuse_along=0",
            "cones.start.diffuse_along=2",
        ],
    ),
    axis("jitter", "cones", &["cones.jitter=true"]),
    axis("roughness", "cones", &["cones.roughness_fit=linear"]),
    axis(
        "shadows",
        "corrected",
        &["lights.shadows=none", "lights.shadows=rays", "lights.shadows=rays cones.first_bounce_shadows=true"],
    ),
    axis(
        "ledger",
        "corrected",
        &[
            "cones.ledger.d1=printed",
            "cones.ledger.d2=printed",
            "cones.ledger.d10=printed",
            "cones.ledger.d11=printed",
            "cones.ledger.d17=printed",
            "cones.ledger.d18=printed",
            "cones.ledger.d21=printed",
            "cones.ledger.d22=printed",
            "cones.ledger.d12=printed",
            "cones.ledger.d13=printed",
            "cones.ledger.d15=printed",
            "cones.ledger.d19=printed",
            "cones.ledger.d30=printed",
            "cones.set=6a",
            "cones.set=6a cones.ledger.d6=printed",
            "cones.set=16",
            "cones.set=16 cones.ledger.d26=printed",
        ],
    ),
];

/// Around what is written by hand in the page, which is kept when the page is written anew.
const HAND: [&str; 2] = ["<!-- by hand, and kept: from here -->\n", "<!-- to here -->\n"];

/// The axis's name and the setting of every line of the page's table. `sets`: applied after [`BASE`].
///
/// # Errors
/// An axis names a setting that is not there, or `sets` does.
pub fn lines(sets: &[String]) -> Result<Vec<(&'static str, Trial)>> {
    let base = |preset: &str| {
        let mut settings = Settings::preset(preset)?;
        let assignments = BASE.iter().copied().chain(sets.iter().map(String::as_str));
        assignments.into_iter().try_for_each(|assignment| settings.set(assignment))?;
        Ok(Base { preset: preset.to_owned(), settings })
    };
    let mut lines = Vec::new();
    for preset in PRESETS {
        lines.extend(trials(&[base(preset.name)?], &[])?.into_iter().map(|trial| ("preset", trial)));
    }
    for StudyAxis { name, base: preset, values } in AXES {
        let values = values.iter().map(|value| value.split(' ').map(str::to_owned).collect()).collect();
        // The first is the base itself, which stands among the presets.
        let swept = trials(&[base(preset)?], &[Axis { values }])?.into_iter().skip(1);
        lines.extend(swept.map(|trial| (*name, trial)));
    }
    Ok(lines)
}

/// Every setting of `lines` once.
pub fn settings(lines: &[(&'static str, Trial)]) -> Vec<Trial> {
    let mut all: Vec<Trial> = Vec::new();
    for (_, trial) in lines {
        if all.iter().all(|other| !other.settings.means_same(&trial.settings)) {
            all.push(trial.clone());
        }
    }
    all
}

/// What stands between the marks of an earlier page; `None` for a text that is no such page.
pub fn by_hand(page: &str) -> Option<&str> {
    let (_, rest) = page.split_once(HAND[0])?;
    Some(rest.split_once(HAND[1])?.0)
}

/// The page. `sets`: as for [`lines`]; `by_hand`: what to keep of an earlier page.
pub fn document(chart: &Chart, lines: &[(&'static str, Trial)], sets: &[String], by_hand: &str) -> String {
    let (device, driver, noise) = (&chart.device, &chart.driver, 100.0 * chart.reference_noise);
    let base = BASE.iter().copied().chain(sets.iter().map(String::as_str)).collect::<Vec<_>>().join(" ");
    let mut page = format!(
        "# What each setting buys and costs\n\n\
         Written by `twobounce study`, which is run again whenever a method changes: every preset, then every axis by itself, on\n\
         top of the preset that its line opens with. `{base}`, unless a line says otherwise. Measured at {}×{} pixels on\n\
         {device} ({driver}). `ms` is the GPU time of a frame. The other columns are `rel`, mean |error| over mean reference: `same`\n\
         against light of as many bounces, `all` against all of it; the references' own noise is {noise} %. *Indirect* says that it is\n\
         of the indirect light alone, *diffuse* of that in pixels without metal, glass and sky, *whole* that lamps light the scene\n\
         through cones and nothing tells the two apart. **Bold**: no other setting here is both faster and nearer. [rows.csv](rows.csv)\n\
         has every number.\n\n## What surprised\n\n{}{by_hand}{}\n",
        chart.width, chart.height, HAND[0], HAND[1]
    );
    for scene in &chart.scenes {
        let _ = writeln!(page, "![{0}: error against time]({0}.svg)\n", scene.name);
    }
    page += "| axis | setting |";
    let columns: Vec<Column> = chart.scenes.iter().map(|scene| Column::new(chart, scene)).collect();
    for column in &columns {
        let _ = write!(page, " {} ms |", column.scene);
        for (part, ..) in &column.errors {
            let part = match part {
                Part::Total => "whole",
                Part::Indirect => "indirect",
                Part::Diffuse => "diffuse",
            };
            let _ = write!(page, " {part}, same | {part}, all |");
        }
    }
    let numbers: usize = columns.iter().map(|column| 1 + 2 * column.errors.len()).sum();
    let _ = writeln!(page, "\n|---|---|{}", "---:|".repeat(numbers));
    let mut last = "";
    for (name, trial) in lines {
        let _ = write!(page, "| {} | `{}` |", if *name == last { "" } else { name }, trial.name());
        last = name;
        columns.iter().for_each(|column| page += &column.cells(trial));
        page += "\n";
    }
    page
}

/// What the table says of a scene.
struct Column<'a> {
    scene: &'a str,
    rows: Vec<&'a Row>,
    /// The parts whose errors are shown, each with the keys of the rows on its frontiers, same and all.
    errors: Vec<(Part, [Vec<&'a str>; 2])>,
}

impl<'a> Column<'a> {
    fn new(chart: &'a Chart, scene: &'a SceneLine) -> Self {
        let rows: Vec<&Row> = chart.rows.iter().filter(|row| row.scene == scene.name).collect();
        let part = chart.part(&scene.name);
        let mixed = part == Part::Indirect && !scene.all_diffuse;
        let parts = std::iter::once(part).chain(mixed.then_some(Part::Diffuse));
        let errors = parts.map(|part| (part, TRUTHS.map(|truth| best(&rows, truth, part)))).collect();
        Self { scene: &scene.name, rows, errors }
    }

    /// Time and errors of one setting.
    fn cells(&self, trial: &Trial) -> String {
        let row = self.rows.iter().find(|row| row.settings.means_same(&trial.settings));
        let missing = || "–".to_owned();
        let mut cells = vec![row.and_then(|row| row.gpu_ms()).map_or_else(missing, |ms| format!("{ms:.0}"))];
        for (part, best) in &self.errors {
            cells.extend(TRUTHS.iter().zip(best).map(|(truth, best)| {
                let found = row.and_then(|row| Some((row.key.as_str(), row.error(*truth, *part, Metric::Rel)?)));
                found.map_or_else(missing, |(key, error)| {
                    let bold = if best.contains(&key) { "**" } else { "" };
                    format!("{bold}{error:.3}{bold}")
                })
            }));
        }
        format!(" {} |", cells.join(" | "))
    }
}

/// In the order of a part's two columns.
const TRUTHS: [Truth; 2] = [Truth::Same, Truth::Full];

/// Keys of the rows on the frontier of time and `rel`.
fn best<'a>(rows: &[&'a Row], truth: Truth, part: Part) -> Vec<&'a str> {
    let point = |row: &&Row| row.gpu_ms().zip(row.error(truth, part, Metric::Rel));
    let points: Vec<_> = rows.iter().map(|row| point(row).unwrap_or((f64::NAN, f64::NAN))).collect();
    frontier(&points).into_iter().map(|i| rows[i].key.as_str()).collect()
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::super::row::Measured;
    use super::*;

    #[test]
    fn every_axis_exists_and_no_line_is_there_twice() {
        let lines = lines(&[]).unwrap();
        for StudyAxis { name, values, .. } in AXES {
            let found = lines.iter().filter(|(axis, _)| axis == name).count();
            assert_eq!(found, values.len(), "{name}: a value is the base's own, or there twice");
        }
        assert_eq!(settings(&lines).len(), lines.len(), "two lines are the same setting");
    }

    #[test]
    fn scenes_with_metal_or_glass_have_the_errors_of_diffuse_surfaces_too() {
        let lines = lines(&[]).unwrap();
        let spread = json!({ "median": 7.0, "min": 7.0, "max": 7.0 });
        let metrics = |rel: f64| json!({ "energy": 1.0, "rel": rel, "relmse": 0.0, "p95": 0.0 });
        let errors = |rel: f64| {
            let (total, indirect, diffuse) = (metrics(9.0), metrics(rel), metrics(rel / 2.0));
            json!({ "noise": 0.0, "flip": 0.0, "total": total, "indirect": indirect, "diffuse": diffuse })
        };
        let measured = json!({
            "frames": 5, "frame_gpu_ms": spread, "frame_wall_ms": spread, "passes": [], "memory_bytes": 0, "nonfinite": 0,
            "own_direct": true, "full": errors(0.4), "same": errors(0.2)
        });
        let measured: Measured = serde_json::from_value(measured).unwrap();
        let line = |name: &str, all_diffuse| SceneLine {
            name: name.into(),
            hash: String::new(),
            triangles: 0,
            camera: String::new(),
            all_diffuse,
        };
        let row = |scene: &str| Row { measured: Some(measured.clone()), ..Row::new(scene.into(), scene, &lines[0].1) };
        let rows = vec![row("box"), row("room")];
        let chart = Chart { scenes: vec![line("box", true), line("room", false)], rows, ..Chart::default() };
        let page = document(&chart, &lines[..2], &[], "");
        let table: Vec<_> = page.lines().filter(|line| line.starts_with('|')).collect();
        let two = "indirect, same | indirect, all |";
        assert_eq!(
            table[0],
            format!("| axis | setting | box ms | {two} room ms | {two} diffuse, same | diffuse, all |")
        );
        let cells = "| 7 | **0.200** | **0.400** | 7 | **0.200** | **0.400** | **0.100** | **0.200** |";
        assert!(table[2].ends_with(cells), "{}", table[2]);
        assert!(table[3].ends_with("| – | – | – | – | – | – | – | – |"), "{}", table[3]);
        assert!(table.iter().all(|line| line.matches('|').count() == 11), "{table:?}");
    }

    #[test]
    fn what_is_written_by_hand_is_kept() {
        let chart = Chart::default();
        let page = document(&chart, &[], &[], "Nothing did.\n");
        assert_eq!(by_hand(&page), Some("Nothing did.\n"));
        assert_eq!(document(&chart, &[], &[], by_hand(&page).unwrap()), page);
        assert_eq!(by_hand("# My own page"), None);
    }
}
