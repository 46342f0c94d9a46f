//! The file of `render --json`. `docs/json.md` documents the keys.

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::{Value, json};
use twobounce::frame::Counters;
use twobounce::measure::timing::{PassTiming, Spread, Timings};
use twobounce::output::display::ToneMap;
use twobounce::profile::Run;
use twobounce::settings::Settings;
use twobounce::stage::Staged;
use twobounce::vk::Context;

use crate::say;

/// The version of the form. It increases when a key changes its name, unit or meaning.
const VERSION: u32 = 1;

/// The file of `render --json`. Times are in milliseconds, sizes in bytes, and image sizes in pixels.
#[derive(Default, Serialize)]
pub struct RenderReport {
    /// [`VERSION`]
    version: u32,
    device: String,
    /// The driver's name and version, as the driver describes it.
    driver: String,
    /// Vulkan version of the device, `major.minor.patch`.
    api_version: String,
    width: u32,
    height: u32,
    /// The number of measured frames.
    frames: usize,
    /// The number of frames before the measured ones.
    warm_up_frames: usize,
    frame_gpu_ms: Spread,
    frame_wall_ms: Spread,
    passes_gpu_ms: Spread,
    passes: Vec<PassTiming>,
    counters: BTreeMap<&'static str, u32>,
    /// Relative noise of the image; null with a single pass.
    noise: Option<f64>,
    memory: Value,
    scene: Value,
    method: &'static str,
    /// The settings, with `image.passes` as the number of passes that were made.
    pub settings: Settings,
    /// Tone curve of a .png or .jpg; null for an .exr.
    pub tonemap: Option<ToneMap>,
    /// Its exposure in stops.
    pub exposure_ev: Option<f32>,
}

impl RenderReport {
    /// The report with everything that is known before the first frame.
    pub fn new(opened: &Staged, settings: &Settings, context: &Context) -> Self {
        let (scene, (major, minor, patch)) = (&opened.scene, context.api_version);
        Self {
            version: VERSION,
            device: context.name.clone(),
            driver: context.driver.clone(),
            api_version: format!("{major}.{minor}.{patch}"),
            width: opened.size.0,
            height: opened.size.1,
            memory: json!({ "budget_bytes": context.memory_budget() }),
            scene: json!({
                "name": scene.name,
                "hash": scene.hash,
                "triangles": scene.triangle_count(),
                "camera": opened.camera,
                "time_s": opened.shot.time_s(0.0),
            }),
            method: settings.method.name(),
            settings: settings.clone(),
            ..Self::default()
        }
    }

    /// Adds the results of frames.
    pub fn add(&mut self, Run { timings, plan, allocated_bytes }: &Run) {
        self.frames = timings.frames().len();
        self.warm_up_frames = timings.warm_up();
        self.frame_gpu_ms = timings.frame_gpu_ms();
        self.frame_wall_ms = timings.frame_wall_ms();
        self.passes_gpu_ms = timings.passes_gpu_ms();
        self.passes = timings.passes();
        self.counters = counters(timings);
        self.noise = timings.all().last().and_then(|frame| frame.noise);
        self.memory["planned_bytes"] = plan.total().into();
        self.memory["allocated_bytes"] = (*allocated_bytes).into();
        self.memory["resources"] =
            plan.rows.iter().map(|(name, bytes)| json!({ "name": name, "bytes": bytes })).collect();
    }
}

/// The last frame's counters by name, and how often frames were repeated in total.
pub fn counters(timings: &Timings) -> BTreeMap<&'static str, u32> {
    let Some(last) = timings.all().last() else { return BTreeMap::new() };
    BTreeMap::from([
        ("triangles", last.counters.triangles),
        ("degenerate_triangles", last.counters.degenerate),
        ("list_items", last.counters.list_items),
        ("occupied_voxels", last.counters.occupied_voxels),
        ("frames_repeated", timings.all().iter().map(|frame| frame.repeats).sum()),
    ])
}

/// Prints once that a first run compiles shaders and later ones do not.
pub fn say_compiled(context: &Context) {
    if let Some(pipelines) = context.compiled_anew() {
        say!("compiled {pipelines} pipelines, once: later runs find them in the cache");
    }
}

/// The counters as text.
pub fn counters_text(timings: &Timings) -> String {
    let Counters { triangles, degenerate, list_items, occupied_voxels } =
        timings.all().last().map(|frame| frame.counters).unwrap_or_default();
    let mut text = format!(
        "recorded triangles {triangles} (dropped without area {degenerate}), list items {list_items}, occupied voxels {occupied_voxels}\n"
    );
    let repeats: u32 = timings.all().iter().map(|frame| frame.repeats).sum();
    if repeats > 0 {
        text += &format!("frames repeated because a buffer had to grow: {repeats}\n");
    }
    text
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use twobounce::ground::memory_plan::MemoryPlan;
    use twobounce::renderer::FrameReport;
    use twobounce::vk::{ZoneTiming, ZoneTimings};

    /// Every path to a value, with `[]` for an element of a list.
    fn paths(json: &Value, path: &str, found: &mut BTreeSet<String>) {
        match json {
            Value::Object(map) => map.iter().for_each(|(key, value)| {
                paths(value, &if path.is_empty() { key.clone() } else { format!("{path}.{key}") }, found);
            }),
            Value::Array(list) => list.iter().for_each(|value| paths(value, &format!("{path}[]"), found)),
            _ => {
                found.insert(path.to_owned());
            }
        }
    }

    /// Compares the keys of a file with its part of `docs/json.md`, so that a changed key is documented and the version
    /// is reviewed. `elsewhere` names objects that another part explains.
    pub fn assert_documented(file: &impl Serialize, version: u32, title: &str, elsewhere: &[&str]) {
        let mut written = BTreeSet::new();
        paths(&serde_json::to_value(file).unwrap(), "", &mut written);
        let key = |path: &String| {
            let whole = elsewhere.iter().find(|whole| path.starts_with(&format!("{whole}.")));
            // Spreads and percentiles are explained once.
            let spread = || [".median", ".min", ".max", ".p99"].iter().find_map(|end| path.strip_suffix(end));
            whole.copied().or_else(spread).unwrap_or(path).to_owned()
        };
        let written: BTreeSet<String> = written.iter().map(key).collect();
        let page = include_str!("../../docs/json.md").trim_start_matches("# ");
        let part = page.split("\n# ").find(|part| part.starts_with(title)).expect("a part");
        let cell = |line: &str| line.strip_prefix("- `").and_then(|rest| rest.split('`').next()).map(str::to_owned);
        assert_eq!(written, part.lines().filter_map(cell).collect());
        assert!(part.contains(&format!("`version` is {version}")));
    }

    fn frame(triangles: u32, repeats: u32) -> FrameReport {
        let (cpu_ms, wall_ms) = (Some(2.0), Some(1.5));
        let zone = ZoneTiming { gpu_ms: 1.0, cpu_ms, wall_ms, steps_ms: vec![0.5], ..ZoneTiming::default() };
        let timings = ZoneTimings { zones: vec![zone], gpu_ms: 1.0, wall_ms: 2.0 };
        let counters = Counters { triangles, degenerate: 1, list_items: 9, occupied_voxels: 4 };
        FrameReport { timings, counters, repeats, ..FrameReport::default() }
    }

    pub fn report() -> RenderReport {
        let mut timings = Timings::new(0);
        [frame(1, 2), frame(7, 1)].into_iter().for_each(|frame| timings.push(frame));
        let scene = json!({ "name": "s", "hash": "h", "triangles": 1, "camera": "c", "time_s": 0.0 });
        let memory = json!({ "budget_bytes": 6 });
        let mut report = RenderReport {
            tonemap: Some(ToneMap::Agx),
            exposure_ev: Some(0.5),
            scene,
            memory,
            ..RenderReport::default()
        };
        report.add(&Run { timings, plan: MemoryPlan { rows: vec![("lights", 4)] }, allocated_bytes: 5 });
        report
    }

    #[test]
    fn the_keys_are_those_of_the_page() {
        assert_documented(&report(), VERSION, "The file that `twobounce render", &["settings"]);
    }

    #[test]
    fn repeats_add_up_and_the_rest_is_the_last_frames() {
        let counted = report().counters;
        assert_eq!((counted["triangles"], counted["frames_repeated"]), (7, 3));
    }
}
