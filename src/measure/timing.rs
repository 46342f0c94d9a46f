//! The times of passes over many frames, as a table and as JSON.

use crate::vk::{Context, ZoneKind, ZoneTimings};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// The version of the JSON form. It must grow when a key changes its name, unit or meaning.
pub const VERSION: u32 = 1;

/// Median, minimum and maximum of one quantity over the frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    pub median: f64,
    pub min: f64,
    pub max: f64,
}

impl Spread {
    /// All zero without values.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let mut values: Vec<f64> = values.into_iter().collect();
        values.sort_by(f64::total_cmp);
        let (Some(&min), Some(&max)) = (values.first(), values.last()) else { return Self::default() };
        let (low, high) = (values[(values.len() - 1) / 2], values[values.len() / 2]);
        Self { median: (low + high) / 2.0, min, max }
    }
}

/// One pass over all frames. If a frame runs a pass several times, the times are added.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PassTiming {
    /// The zone's name: also its debug label and its name in the trace.
    pub name: &'static str,
    /// `raster`, `compute` or `transfer`.
    pub kind: ZoneKind,
    /// Milliseconds of device time between the timestamps at the start and the end of the pass.
    pub gpu_ms: Spread,
    /// The median's share of the sum of all passes' medians, 0 to 1.
    pub share: f64,
    /// Milliseconds of processor time of all threads of the process; null unless each pass was submitted separately.
    pub cpu_ms: Option<Spread>,
    /// Milliseconds from before the submission to after the wait; null unless each pass was submitted separately.
    pub wall_ms: Option<Spread>,
    /// Bytes that the pass writes in one frame, by its own estimate.
    pub bytes: u64,
}

/// The planned size of one resource.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ResourceBytes {
    pub name: String,
    pub bytes: u64,
}

/// Device memory, planned and allocated.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct MemoryReport {
    /// Bytes planned for all resources together.
    pub planned_bytes: u64,
    /// Bytes allocated from the driver after the last frame.
    pub allocated_bytes: u64,
    /// Free bytes of the device before the allocation.
    pub budget_bytes: u64,
    pub resources: Vec<ResourceBytes>,
}

/// The JSON form of a run's timings. Times in milliseconds, sizes in bytes, image sizes in pixels.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TimingReport {
    /// [`VERSION`].
    pub version: u32,
    /// The device's name.
    pub device: String,
    /// The driver's name and version, as the driver describes it.
    pub driver: String,
    /// Vulkan version of the device, `major.minor.patch`.
    pub api_version: String,
    /// Pixels of the image.
    pub width: u32,
    pub height: u32,
    /// Measured frames.
    pub frames: usize,
    /// Frames before the measured ones.
    pub warm_up_frames: usize,
    /// Milliseconds of device time from a frame's first timestamp to its last.
    pub frame_gpu_ms: Spread,
    /// Milliseconds from the start of recording to the end of the wait.
    pub frame_wall_ms: Spread,
    /// Milliseconds of device time, summed over a frame's passes; about `frame_gpu_ms`.
    pub passes_gpu_ms: Spread,
    /// In the order of the frame.
    pub passes: Vec<PassTiming>,
    /// Counts of the last frame, such as recorded triangles, by name.
    pub counters: BTreeMap<String, u64>,
    pub memory: Option<MemoryReport>,
}

/// The times of a run's frames without the warm-up frames.
#[derive(Clone, Debug, Default)]
pub struct Timings {
    warm_up: usize,
    seen: usize,
    frames: Vec<ZoneTimings>,
}

impl Timings {
    /// Leaves out the first `warm_up` frames, which compile shaders and fill caches.
    pub fn new(warm_up: usize) -> Self {
        Self { warm_up, ..Self::default() }
    }

    pub fn push(&mut self, frame: ZoneTimings) {
        self.seen += 1;
        if self.seen > self.warm_up {
            self.frames.push(frame);
        }
    }

    /// The measured frames.
    pub fn frames(&self) -> &[ZoneTimings] {
        &self.frames
    }

    /// One row per pass in the order of the frame.
    pub fn passes(&self) -> Vec<PassTiming> {
        let mut names = Vec::new();
        for zone in self.frames.iter().flat_map(|frame| &frame.zones) {
            if !names.contains(&(zone.name, zone.kind)) {
                names.push((zone.name, zone.kind));
            }
        }
        let mut rows: Vec<_> = names.into_iter().map(|(name, kind)| self.pass(name, kind)).collect();
        let total: f64 = rows.iter().map(|row| row.gpu_ms.median).sum();
        for row in &mut rows {
            row.share = if total > 0.0 { row.gpu_ms.median / total } else { 0.0 };
        }
        rows
    }

    fn pass(&self, name: &'static str, kind: ZoneKind) -> PassTiming {
        let zones = |frame: &ZoneTimings| {
            frame.zones.iter().filter(|zone| zone.name == name && zone.kind == kind).cloned().collect::<Vec<_>>()
        };
        let frames: Vec<_> = self.frames.iter().map(zones).filter(|zones| !zones.is_empty()).collect();
        let cpu: Option<Vec<f64>> = frames.iter().map(|zones| zones.iter().map(|zone| zone.cpu_ms).sum()).collect();
        let wall: Option<Vec<f64>> = frames.iter().map(|zones| zones.iter().map(|zone| zone.wall_ms).sum()).collect();
        PassTiming {
            name,
            kind,
            gpu_ms: Spread::of(frames.iter().map(|zones| zones.iter().map(|zone| zone.gpu_ms).sum())),
            share: 0.0,
            cpu_ms: cpu.map(Spread::of),
            wall_ms: wall.map(Spread::of),
            bytes: frames.last().map_or(0, |zones| zones.iter().map(|zone| zone.bytes).sum()),
        }
    }

    /// The report of the run, for `--json`.
    pub fn report(
        &self,
        context: &Context,
        (width, height): (u32, u32),
        counters: BTreeMap<String, u64>,
        memory: Option<MemoryReport>,
    ) -> TimingReport {
        let (major, minor, patch) = context.api_version;
        TimingReport {
            version: VERSION,
            device: context.name.clone(),
            driver: context.driver.clone(),
            api_version: format!("{major}.{minor}.{patch}"),
            width,
            height,
            frames: self.frames.len(),
            warm_up_frames: self.seen.min(self.warm_up),
            frame_gpu_ms: Spread::of(self.frames.iter().map(|frame| frame.gpu_ms)),
            frame_wall_ms: Spread::of(self.frames.iter().map(|frame| frame.wall_ms)),
            passes_gpu_ms: Spread::of(self.frames.iter().map(sum_of_passes)),
            passes: self.passes(),
            counters,
            memory,
        }
    }

    /// The table that `--timings` prints: a row per pass, then the sum of the passes and the frame.
    pub fn table(&self) -> String {
        let passes = self.passes();
        let with_cpu = passes.iter().any(|row| row.cpu_ms.is_some());
        let width = passes.iter().map(|row| row.name.len()).max().unwrap_or(0).max("sum of passes".len());
        let mut text =
            format!("{:width$}  {:8}  {:>9}  {:>9}  {:>9}  {:>6}", "pass", "kind", "GPU ms", "min", "max", "share");
        text += if with_cpu { "     CPU ms      bytes\n" } else { "      bytes\n" };
        let cpu_column = |cpu: Option<f64>| match (with_cpu, cpu) {
            (false, _) => String::new(),
            (true, Some(ms)) => format!("  {ms:>9.3}"),
            (true, None) => format!("  {:>9}", ""),
        };
        for row in &passes {
            let kind = format!("{:?}", row.kind).to_lowercase();
            let Spread { median, min, max } = row.gpu_ms;
            let (share, cpu, bytes) = (row.share * 100.0, cpu_column(row.cpu_ms.map(|cpu| cpu.median)), row.bytes);
            writeln!(
                text,
                "{:width$}  {kind:8}  {median:>9.3}  {min:>9.3}  {max:>9.3}  {share:>5.1}%{cpu}  {:>9}",
                row.name,
                short_bytes(bytes)
            )
            .expect("writing to a string");
        }
        let cpu_sum: Option<f64> = passes.iter().map(|row| row.cpu_ms.map(|cpu| cpu.median)).sum();
        let totals = [
            ("sum of passes", Spread::of(self.frames.iter().map(sum_of_passes)), cpu_sum.filter(|_| with_cpu)),
            ("frame", Spread::of(self.frames.iter().map(|frame| frame.gpu_ms)), None),
        ];
        for (name, Spread { median, min, max }, cpu) in totals {
            let line =
                format!("{name:width$}  {:8}  {median:>9.3}  {min:>9.3}  {max:>9.3}  {:6}{}", "", "", cpu_column(cpu));
            writeln!(text, "{}", line.trim_end()).expect("writing to a string");
        }
        let wall = Spread::of(self.frames.iter().map(|frame| frame.wall_ms)).median;
        let (frames, warm_up) = (self.frames.len(), self.seen.min(self.warm_up));
        writeln!(text, "{frames} frame(s) after {warm_up} to warm up; {wall:.3} ms of wall clock each (median)")
            .expect("writing to a string");
        text
    }
}

fn sum_of_passes(frame: &ZoneTimings) -> f64 {
    frame.zones.iter().map(|zone| zone.gpu_ms).sum()
}

/// `12.3 MiB`, `4.0 KiB` or `17 B`.
pub fn short_bytes(bytes: u64) -> String {
    let value = bytes as f64;
    match bytes {
        0..1024 => format!("{bytes} B"),
        1024..1_048_576 => format!("{:.1} KiB", value / 1024.0),
        1_048_576..1_073_741_824 => format!("{:.1} MiB", value / 1_048_576.0),
        _ => format!("{:.2} GiB", value / 1_073_741_824.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vk::ZoneTiming;

    fn zone(name: &'static str, start_ms: f64, gpu_ms: f64, cpu_ms: Option<f64>) -> ZoneTiming {
        ZoneTiming {
            name,
            kind: ZoneKind::Raster,
            start_ms,
            gpu_ms,
            cpu_ms,
            wall_ms: cpu_ms,
            bytes: 1 << 20,
            counts: vec![],
        }
    }

    fn frame(record: f64, render: f64) -> ZoneTimings {
        let zones = vec![zone("record", 0.0, record, None), zone("render", record, render, None)];
        ZoneTimings { zones, gpu_ms: record + render, wall_ms: record + render + 1.0 }
    }

    fn four_frames() -> Timings {
        let mut timings = Timings::new(1);
        for (record, render) in [(500.0, 900.0), (1.0, 30.0), (3.0, 10.0), (2.0, 20.0)] {
            timings.push(frame(record, render));
        }
        timings
    }

    #[test]
    fn the_median_of_an_even_count_lies_between() {
        assert_eq!(Spread::of([4.0, 1.0, 3.0, 2.0]), Spread { median: 2.5, min: 1.0, max: 4.0 });
        assert_eq!(Spread::of([]), Spread::default());
    }

    #[test]
    fn warm_up_is_left_out_and_shares_add_up() {
        let timings = four_frames();
        let rows = timings.passes();
        assert_eq!(rows.iter().map(|row| row.name).collect::<Vec<_>>(), ["record", "render"]);
        assert_eq!(rows[0].gpu_ms, Spread { median: 2.0, min: 1.0, max: 3.0 });
        assert_eq!(rows[1].gpu_ms, Spread { median: 20.0, min: 10.0, max: 30.0 });
        assert_eq!(rows.iter().map(|row| row.share).sum::<f64>(), 1.0);
        assert_eq!(rows[0].cpu_ms, None);
    }

    #[test]
    fn a_pass_that_runs_twice_in_a_frame_adds_up() {
        let mut timings = Timings::new(0);
        let zones = vec![zone("mips", 0.0, 2.0, Some(5.0)), zone("mips", 2.0, 3.0, Some(6.0))];
        timings.push(ZoneTimings { zones, gpu_ms: 5.0, wall_ms: 6.0 });
        let rows = timings.passes();
        assert_eq!(rows.len(), 1);
        assert_eq!((rows[0].gpu_ms.median, rows[0].cpu_ms.unwrap().median, rows[0].bytes), (5.0, 11.0, 2 << 20));
    }

    #[test]
    fn the_table_shows_passes_sum_and_frame() {
        let table = four_frames().table();
        let lines: Vec<_> = table.lines().collect();
        assert_eq!(lines[0], "pass           kind         GPU ms        min        max   share      bytes");
        assert_eq!(lines[2], "render         raster       20.000     10.000     30.000   90.9%    1.0 MiB");
        assert_eq!(lines[3], "sum of passes               22.000     13.000     31.000");
        assert_eq!(lines[4], "frame                       22.000     13.000     31.000");
        assert_eq!(lines[5], "3 frame(s) after 1 to warm up; 23.000 ms of wall clock each (median)");
    }

    /// Every path to a value in `json`, with `[]` for an element of a list.
    fn keys(json: &serde_json::Value, path: &str, found: &mut Vec<String>) {
        match json {
            serde_json::Value::Object(map) => {
                map.iter().for_each(|(key, value)| keys(value, &format!("{path}.{key}"), found));
            }
            serde_json::Value::Array(list) => list.iter().for_each(|value| keys(value, &format!("{path}[]"), found)),
            _ => found.push(path.to_owned()),
        }
    }

    #[test]
    fn the_keys_of_the_json_are_pinned() {
        let mut timings = Timings::new(0);
        let zones = vec![zone("record", 0.0, 2.0, Some(5.0))];
        timings.push(ZoneTimings { zones, gpu_ms: 2.0, wall_ms: 6.0 });
        let resources = vec![ResourceBytes { name: "heads".into(), bytes: 4 }];
        let report = TimingReport {
            version: VERSION,
            device: "d".into(),
            driver: "m".into(),
            api_version: "1.3.230".into(),
            width: 4,
            height: 2,
            frames: 1,
            warm_up_frames: 0,
            frame_gpu_ms: Spread::default(),
            frame_wall_ms: Spread::default(),
            passes_gpu_ms: Spread::default(),
            passes: timings.passes(),
            counters: BTreeMap::from([("triangles".to_owned(), 36)]),
            memory: Some(MemoryReport { planned_bytes: 4, allocated_bytes: 4, budget_bytes: 9, resources }),
        };
        let mut found = Vec::new();
        keys(&serde_json::to_value(&report).unwrap(), "", &mut found);
        found.sort();
        // Change this list together with `VERSION`.
        let spread = |key: &str| ["max", "median", "min"].map(|part| format!("{key}.{part}"));
        let mut expected: Vec<String> = [".passes[].gpu_ms", ".passes[].cpu_ms", ".passes[].wall_ms"]
            .iter()
            .chain(&[".frame_gpu_ms", ".frame_wall_ms", ".passes_gpu_ms"])
            .flat_map(|key| spread(key))
            .collect();
        let plain = ".api_version .counters.triangles .device .driver .frames .height .memory.allocated_bytes \
            .memory.budget_bytes .memory.planned_bytes .memory.resources[].bytes .memory.resources[].name \
            .passes[].bytes .passes[].kind .passes[].name .passes[].share .version .warm_up_frames .width";
        expected.extend(plain.split_whitespace().map(str::to_owned));
        expected.sort();
        assert_eq!((VERSION, found), (1, expected));
    }
}
