//! What `--timings`, `--json` and `--trace` say about a render. `docs/json.md` documents the keys.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;
use twobounce::ground::memory_plan::MemoryPlan;
use twobounce::measure::timing::{MemoryReport, ResourceBytes, TimingReport};
use twobounce::output::file;
use twobounce::renderer::FrameReport;
use twobounce::settings::Settings;

/// The file that `--json` writes.
#[derive(Serialize)]
pub struct RenderReport<'a> {
    #[serde(flatten)]
    pub timings: TimingReport,
    pub scene: SceneReport,
    pub method: &'static str,
    pub settings: &'a Settings,
    /// What a .png was exposed with; null for an .exr.
    pub exposure_ev: Option<f32>,
}

/// What was rendered.
#[derive(Clone, Serialize)]
pub struct SceneReport {
    pub name: String,
    pub hash: String,
    pub triangles: usize,
    pub camera: String,
    pub time_s: f64,
}

impl RenderReport<'_> {
    /// Writes the report to `path`, whole or not at all.
    pub fn write(&self, path: &Path) -> anyhow::Result<()> {
        let text = serde_json::to_string_pretty(self)?;
        Ok(file::write(path, (text + "\n").as_bytes())?)
    }
}

/// The last frame's counters by name, and how often frames were repeated in all.
pub fn counters(frames: &[FrameReport]) -> BTreeMap<String, u64> {
    let Some(last) = frames.last() else { return BTreeMap::new() };
    let counts = &last.counters;
    let repeats: u32 = frames.iter().map(|f| f.repeats).sum();
    [
        ("triangles", counts.triangles),
        ("degenerate_triangles", counts.degenerate),
        ("list_items", counts.list_items),
        ("occupied_voxels", counts.occupied_voxels),
        ("frames_repeated", repeats),
    ]
    .into_iter()
    .map(|(name, count)| (name.to_owned(), count.into()))
    .collect()
}

/// The plan beside what the driver gave. `budget_bytes`: what the device had left before.
pub fn memory(plan: &MemoryPlan, allocated_bytes: u64, budget_bytes: u64) -> MemoryReport {
    let resources = plan.rows.iter().map(|&(name, bytes)| ResourceBytes { name: name.to_owned(), bytes }).collect();
    MemoryReport { planned_bytes: plan.total(), allocated_bytes, budget_bytes, resources }
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use twobounce::frame::Counters;
    use twobounce::measure::timing::{Spread, Timings, VERSION};
    use twobounce::vk::{ZoneKind, ZoneTiming, ZoneTimings};

    /// Every path to a value, `[]` for an element of a list.
    pub fn paths(json: &serde_json::Value, path: &str, found: &mut BTreeSet<String>) {
        match json {
            serde_json::Value::Object(map) => map.iter().for_each(|(key, value)| {
                paths(value, &if path.is_empty() { key.clone() } else { format!("{path}.{key}") }, found);
            }),
            serde_json::Value::Array(list) => list.iter().for_each(|value| paths(value, &format!("{path}[]"), found)),
            _ => {
                found.insert(path.to_owned());
            }
        }
    }

    pub fn report(settings: &Settings) -> RenderReport<'_> {
        let zone = ZoneTiming {
            name: "record",
            kind: ZoneKind::Raster,
            start_ms: 0.0,
            gpu_ms: 1.0,
            cpu_ms: Some(2.0),
            wall_ms: Some(1.5),
            bytes: 64,
            counts: Vec::new(),
        };
        let frame = ZoneTimings { zones: vec![zone], gpu_ms: 1.0, wall_ms: 2.0 };
        let mut timings = Timings::new(0);
        timings.push(frame.clone());
        let counted = Counters { triangles: 36, degenerate: 1, list_items: 9, occupied_voxels: 4 };
        let plan = MemoryPlan { rows: vec![("lights", 4)] };
        RenderReport {
            scene: SceneReport { name: "s".into(), hash: "h".into(), triangles: 1, camera: "c".into(), time_s: 0.0 },
            method: "cones",
            settings,
            exposure_ev: Some(0.5),
            timings: TimingReport {
                version: VERSION,
                device: "d".into(),
                driver: "m".into(),
                api_version: "1.3.0".into(),
                width: 4,
                height: 2,
                frames: 1,
                warm_up_frames: 0,
                frame_gpu_ms: Spread::default(),
                frame_wall_ms: Spread::default(),
                passes_gpu_ms: Spread::default(),
                passes: timings.passes(),
                counters: counters(&[FrameReport { timings: frame, counters: counted, repeats: 2, settling: 0 }]),
                memory: Some(memory(&plan, 5, 6)),
            },
        }
    }

    /// A key that is renamed, added or dropped must be so in the page too, and its version looked at.
    #[test]
    fn the_keys_are_those_of_the_page() {
        let settings = Settings::default();
        let mut written = BTreeSet::new();
        paths(&serde_json::to_value(report(&settings)).unwrap(), "", &mut written);
        // The settings have a page of their own, which another test holds against the tree.
        written.retain(|path| !path.starts_with("settings."));
        written.insert("settings".into());
        let spread = |path: &String| {
            let start = path.strip_suffix(".median").or(path.strip_suffix(".min")).or(path.strip_suffix(".max"));
            start.unwrap_or(path).to_owned()
        };
        let written: BTreeSet<String> = written.iter().map(spread).collect();
        let page = include_str!("../../docs/json.md").split("\n# ").next().expect("a first part");
        let cell = |line: &str| line.strip_prefix("| `").and_then(|rest| rest.split('`').next()).map(str::to_owned);
        let documented: BTreeSet<String> = page.lines().filter_map(cell).collect();
        assert_eq!(written, documented);
        assert!(page.contains(&format!("`version` is {VERSION}")));
    }

    #[test]
    fn repeats_add_up_and_the_rest_is_the_last_frames() {
        let frame = |triangles, repeats| FrameReport {
            timings: ZoneTimings::default(),
            counters: Counters { triangles, degenerate: 0, list_items: 0, occupied_voxels: 0 },
            repeats,
            settling: 0,
        };
        let counted = counters(&[frame(1, 2), frame(7, 1)]);
        assert_eq!((counted["triangles"], counted["frames_repeated"]), (7, 3));
    }
}
