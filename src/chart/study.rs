//! The default study: every preset, and every axis by itself from a named base. `docs/study/README.md` is made from it.

use std::fmt::Write as _;

use super::export::Chart;
use super::frontier::frontier;
use super::plan::{Base, Trial, trials};
use super::row::{Metric, Part, Row, Truth};
use crate::Result;
use crate::settings::{PRESETS, Settings};

/// The scenes, from the project's root.
pub const SCENES: &[&str] = &["assets/cornell-area.glb", "assets/cornell-point.glb", "assets/gallery.glb"];

/// Set in every preset first, so that the study can be run on a processor; 128³ is on an axis of its own.
pub const BASE: &[&str] = &["voxels=64"];

/// Settings to vary that are no preset: a preset and what is changed in it, separated by spaces.
const BASES: &[(&str, &str, &str)] = &[(
    "cones",
    "fast",
    "gather=cones cones=g16 shade.cones=auto interleave=1 gather_resolution=full image.direct=samples emitter_samples=16",
)];

/// One axis: values that are tried one after the other on top of a base.
#[derive(Clone, Copy, Debug)]
pub struct StudyAxis {
    pub name: &'static str,
    /// What to start from: a preset, or one of `BASES`.
    pub base: &'static str,
    /// Each a list of `key=value`, separated by spaces; none is the base's own.
    pub values: &'static [&'static str],
}

const fn axis(name: &'static str, base: &'static str, values: &'static [&'static str]) -> StudyAxis {
    StudyAxis { name, base, values }
}

/// To add an axis, add a line here.
pub const AXES: &[StudyAxis] = &[
    axis("grid", "fast", &["voxels=32", "voxels=128"]),
    axis("rays", "fast", &["cones=g4", "cones=g16", "cones=g32"]),
    axis("voxels' rays", "fast", &["shade.cones=g8", "shade.cones=g16"]),
    axis("gathered pixels", "fast", &["gather_resolution=half", "gather_resolution=full"]),
    axis("sharing", "fast", &["interleave=1", "interleave=2"]),
    axis("lamps", "fast", &["emitters=cones", "emitter_samples=2", "emitter_samples=32"]),
    axis("bounces", "fast", &["bounces=1", "bounces=all"]),
    axis("gather", "fast", &["gather=cones"]),
    axis("direct light", "fast", &["image.direct=samples", "image.samples=1"]),
    axis("lists", "fast", &["lists=rebuild"]),
    axis("jitter", "fast", &["jitter=true"]),
    axis("cones", "cones", &[""]),
    axis("cones' grid", "cones", &["voxels=32", "voxels=128"]),
    axis(
        "cone set",
        "cones",
        &["cones=1", "cones=5", "cones=6a", "cones=6b", "cones=16", "cones=g8", "cones=g32", "cones=g64"],
    ),
    axis("aperture", "cones", &["aperture=0.5", "aperture=0.75"]),
    axis("step", "cones", &["step=0.5", "step=1", "step=2"]),
    axis("exit margin", "cones", &["exit_margin=0"]),
    axis("fill", "cones", &["fill=uniform", "fill=facing", "fill=coverage"]),
    axis("face weights", "cones", &["weights=d2", "weights=norm1", "weights=extinction"]),
    axis("blend", "cones", &["blend=over"]),
    axis("all three as in the talk", "cones", &["fill=uniform weights=d2 blend=over"]),
    axis("start along the normal", "cones", &["start.diffuse_normal=0.5", "start.diffuse_normal=2"]),
    axis("start along the cone", "cones", &["start.diffuse_along=0", "start.diffuse_along=2"]),
    axis("shadows", "cones", &["shadows=none", "shadows=cones", "first_bounce_shadows=false"]),
    axis("roughness", "cones", &["roughness_fit=power", "roughness_fit=linear"]),
    axis(
        "ledger",
        "corrected",
        &[
            "ledger.d1=printed",
            "ledger.d2=printed",
            "ledger.d10=printed",
            "ledger.d11=printed",
            "ledger.d17=printed",
            "ledger.d18=printed",
            "ledger.d21=printed",
            "ledger.d22=printed",
            "shadows=cones",
            "shadows=cones ledger.d12=printed",
            "shadows=cones ledger.d13=printed",
            "shadows=cones ledger.d15=printed",
            "cones=6a",
            "cones=6a ledger.d6=printed",
            "cones=16",
            "cones=16 ledger.d26=printed",
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
    let mut lines = Vec::new();
    for preset in PRESETS {
        lines.extend(trials(&[base(preset.name, sets)?], &[])?.into_iter().map(|trial| ("preset", trial)));
    }
    for StudyAxis { name, base: preset, values } in AXES {
        let base = base(preset, sets)?;
        for value in *values {
            let mut trial =
                Trial { preset: base.preset.clone(), swept: assignments(value), settings: base.settings.clone() };
            trial.swept.iter().try_for_each(|assignment| trial.settings.set(assignment))?;
            lines.push((*name, trial));
        }
    }
    Ok(lines)
}

fn base(name: &str, sets: &[String]) -> Result<Base> {
    let (preset, changes) = BASES.iter().find(|b| b.0 == name).map_or((name, ""), |b| (b.1, b.2));
    let mut settings = Settings::preset(preset)?;
    let own = assignments(changes);
    let all = own.iter().map(String::as_str).chain(BASE.iter().copied()).chain(sets.iter().map(String::as_str));
    all.into_iter().try_for_each(|assignment| settings.set(assignment))?;
    Ok(Base { preset: name.to_owned(), settings })
}

fn assignments(text: &str) -> Vec<String> {
    text.split_whitespace().map(str::to_owned).collect()
}

/// Every setting of `lines` once.
pub fn settings(lines: &[(&'static str, Trial)]) -> Vec<Trial> {
    let mut all: Vec<Trial> = Vec::new();
    for (_, trial) in lines {
        if all.iter().all(|other| other.settings != trial.settings) {
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
    let bases: Vec<_> =
        BASES.iter().map(|(name, preset, changes)| format!("`{name}` (`{preset}` with `{changes}`)")).collect();
    let bases = bases.join(", ");
    let mut page = format!(
        "# What each setting buys and costs\n\n\
         Written by `twobounce study`, which is run again whenever a method changes: every preset, then every axis by itself, on\n\
         top of what its line opens with: a preset, or {bases}. `{base}`, unless a line says otherwise. Measured at {}×{} pixels on\n\
         {device} ({driver}). `ms` is the GPU time of a frame. The other columns are `rel`, mean |error| over mean reference: `same`\n\
         against light of as many bounces, `all` against all of it; the references' own noise is {noise} %. *Indirect* says that it is\n\
         of the indirect light alone, *whole* that lamps light the scene through cones and nothing tells the two apart. **Bold**: no\n\
         other setting here is both faster and nearer. [rows.csv](rows.csv) has every number.\n\n## What surprised\n\n{}{by_hand}{}\n",
        chart.width, chart.height, HAND[0], HAND[1]
    );
    for scene in &chart.scenes {
        let _ = writeln!(page, "![{0}: error against time]({0}.svg)\n", scene.name);
    }
    page += "| axis | setting |";
    let columns: Vec<Column> = chart.scenes.iter().map(|scene| Column::new(chart, &scene.name)).collect();
    for column in &columns {
        let part = if column.part == Part::Indirect { "indirect" } else { "whole" };
        let _ = write!(page, " {} ms | {part}, same | {part}, all |", column.scene);
    }
    let _ = writeln!(page, "\n|---|---|{}", "---:|".repeat(3 * columns.len()));
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
    part: Part,
    rows: Vec<&'a Row>,
    /// Keys of the rows on the frontiers, same and all.
    best: [Vec<&'a str>; 2],
}

impl<'a> Column<'a> {
    fn new(chart: &'a Chart, scene: &'a str) -> Self {
        let part = chart.part(scene);
        let rows: Vec<&Row> = chart.rows.iter().filter(|row| row.scene == scene).collect();
        let best = [Truth::Same, Truth::Full].map(|truth| {
            let point = |row: &&Row| row.gpu_ms().zip(row.error(truth, part, Metric::Rel));
            let points: Vec<_> = rows.iter().map(|row| point(row).unwrap_or((f64::NAN, f64::NAN))).collect();
            frontier(&points).into_iter().map(|i| rows[i].key.as_str()).collect()
        });
        Self { scene, part, rows, best }
    }

    /// Time and both errors of one setting.
    fn cells(&self, trial: &Trial) -> String {
        let row = self.rows.iter().find(|row| row.settings == trial.settings);
        let missing = || "–".to_owned();
        let ms = row.and_then(|row| row.gpu_ms()).map_or_else(missing, |ms| format!("{ms:.0}"));
        let [same, all] = [(Truth::Same, &self.best[0]), (Truth::Full, &self.best[1])].map(|(truth, best)| {
            let found = row.and_then(|row| Some((row.key.as_str(), row.error(truth, self.part, Metric::Rel)?)));
            found.map_or_else(missing, |(key, error)| {
                let bold = if best.contains(&key) { "**" } else { "" };
                format!("{bold}{error:.3}{bold}")
            })
        });
        format!(" {ms} | {same} | {all} |")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_axis_exists_and_no_line_is_there_twice() {
        let lines = lines(&[]).unwrap();
        for (i, (axis, trial)) in lines.iter().enumerate() {
            let twin = lines[..i].iter().find(|(_, other)| other.settings == trial.settings);
            assert!(twin.is_none(), "{axis}, {}: the same as {}", trial.name(), twin.unwrap().1.name());
        }
        assert_eq!(settings(&lines).len(), lines.len());
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
