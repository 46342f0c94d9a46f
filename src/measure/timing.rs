//! The times of passes over many frames, and the table that shows them.

use serde::{Deserialize, Serialize};

use crate::Result;
use crate::renderer::{FrameReport, Renderer};
use crate::scene::{Pose, View};
use crate::vk::{ZoneKind, ZoneTiming, ZoneTimings};

/// Median, minimum and maximum of one quantity over the frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    pub median: f64,
    pub min: f64,
    pub max: f64,
}

impl Spread {
    /// All zero without values.
    pub fn of_values(values: impl IntoIterator<Item = f64>) -> Self {
        let mut values: Vec<f64> = values.into_iter().collect();
        values.sort_by(f64::total_cmp);
        let (Some(&min), Some(&max)) = (values.first(), values.last()) else { return Self::default() };
        let (low, high) = (values[(values.len() - 1) / 2], values[values.len() / 2]);
        Self { median: (low + high) / 2.0, min, max }
    }
}

/// Minimum, median and 99th percentile of one quantity, each that of one frame (nearest rank).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Percentiles {
    pub min: f64,
    pub median: f64,
    pub p99: f64,
}

impl Percentiles {
    /// All zero without values.
    pub fn of_values(values: impl IntoIterator<Item = f64>) -> Self {
        let mut values: Vec<f64> = values.into_iter().collect();
        values.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let rank = (share * values.len() as f64).ceil().max(1.0) as usize;
            values.get(rank - 1).copied().unwrap_or_default()
        };
        Self { min: at(0.0), median: at(0.5), p99: at(0.99) }
    }
}

/// One pass over all frames. If a frame runs a pass several times, the times are added.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
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
    /// Milliseconds of device time of each level of mips, or step of propagation (median); empty unless they were
    /// timed.
    pub steps_ms: Vec<f64>,
    /// Milliseconds of device time in each frame that ran the pass.
    #[serde(skip)]
    pub frames_gpu_ms: Vec<f64>,
}

/// The number of frames to time.
#[derive(Clone, Copy, Debug)]
pub struct Count {
    /// Warm-up frames, which come first.
    pub warm_up: usize,
    pub least: usize,
    pub most: usize,
    /// No further frame is timed once the measured ones took this many milliseconds together, because long frames vary
    /// little.
    pub enough_ms: f64,
}

impl Count {
    /// Whether another frame is timed after frames that took `wall_ms`.
    pub fn goes_on(&self, wall_ms: impl ExactSizeIterator<Item = f64>) -> bool {
        let timed = wall_ms.len();
        timed < self.least || (timed < self.most && wall_ms.sum::<f64>() < self.enough_ms)
    }

    /// Renders frames, each of which rebuilds lists and light as after motion. `go_on` is called before each.
    ///
    /// # Errors
    /// Errors of `go_on` and of a frame.
    pub fn frames(
        &self,
        renderer: &mut Renderer,
        pose: &Pose,
        view: &View,
        go_on: &dyn Fn() -> Result<()>,
    ) -> Result<Timings> {
        let mut timings = Timings::new(self.warm_up);
        while self.goes_on(timings.frames().map(|frame| frame.wall_ms)) {
            go_on()?;
            renderer.make_anew();
            timings.push(renderer.render(pose, view)?);
        }
        Ok(timings)
    }
}

/// Reports of a run's frames: their times, without those of the warm-up frames.
#[derive(Clone, Debug, Default)]
pub struct Timings {
    warm_up: usize,
    reports: Vec<FrameReport>,
}

impl Timings {
    /// Excludes the first `warm_up` frames, which compile shaders and fill caches.
    pub fn new(warm_up: usize) -> Self {
        Self { warm_up, reports: Vec::new() }
    }

    /// The times of these frames, without warm-up.
    pub fn of_reports(reports: impl IntoIterator<Item = FrameReport>) -> Self {
        Self { warm_up: 0, reports: reports.into_iter().collect() }
    }

    pub fn push(&mut self, frame: FrameReport) {
        self.reports.push(frame);
    }

    /// The number of warm-up frames that were rendered.
    pub fn warm_up(&self) -> usize {
        self.warm_up.min(self.reports.len())
    }

    /// Every frame, warm-up frames first.
    pub fn all(&self) -> &[FrameReport] {
        &self.reports
    }

    /// The times of the measured frames.
    pub fn frames(&self) -> impl ExactSizeIterator<Item = &ZoneTimings> + Clone {
        self.reports[self.warm_up()..].iter().map(|frame| &frame.timings)
    }

    /// Milliseconds of device time from a frame's first timestamp to its last.
    pub fn frame_gpu_ms(&self) -> Spread {
        Spread::of_values(self.frames().map(|frame| frame.gpu_ms))
    }

    /// Milliseconds from the start of recording to the end of the wait.
    pub fn frame_wall_ms(&self) -> Spread {
        Spread::of_values(self.frames().map(|frame| frame.wall_ms))
    }

    /// Milliseconds of device time, summed over a frame's passes.
    pub fn passes_gpu_ms(&self) -> Spread {
        Spread::of_values(self.frames().map(|frame| frame.zones.iter().map(|zone| zone.gpu_ms).sum()))
    }

    /// Milliseconds of processor time of a frame, if the system reports it.
    pub fn frame_cpu_ms(&self) -> Option<Spread> {
        let reports = &self.reports[self.warm_up()..];
        reports.iter().map(|frame| frame.cpu_ms).collect::<Option<Vec<f64>>>().map(Spread::of_values)
    }

    /// One row per pass, in the order in which they first ran.
    pub fn passes(&self) -> Vec<PassTiming> {
        let mut rows: Vec<PassTiming> = vec![];
        for zone in self.frames().flat_map(|frame| &frame.zones) {
            if rows.iter().all(|row| (row.name, row.kind) != (zone.name, zone.kind)) {
                rows.push(self.pass(zone.name, zone.kind));
            }
        }
        let total: f64 = rows.iter().map(|row| row.gpu_ms.median).sum();
        for row in &mut rows {
            row.share = if total > 0.0 { row.gpu_ms.median / total } else { 0.0 };
        }
        rows
    }

    fn pass(&self, name: &'static str, kind: ZoneKind) -> PassTiming {
        let is_it = |zone: &&ZoneTiming| (zone.name, zone.kind) == (name, kind);
        let frames = self.frames().map(|frame| frame.zones.iter().filter(is_it).collect::<Vec<_>>());
        let frames: Vec<_> = frames.filter(|zones| !zones.is_empty()).collect();
        let sums = |ms: fn(&ZoneTiming) -> Option<f64>| -> Option<Vec<f64>> {
            frames.iter().map(|zones| zones.iter().map(|zone| ms(zone)).sum()).collect()
        };
        let frames_gpu_ms = sums(|zone| Some(zone.gpu_ms)).unwrap_or_default();
        let steps = frames.iter().map(|zones| zones.iter().flat_map(|zone| zone.steps_ms.iter().copied()).collect());
        let steps: Vec<Vec<f64>> = steps.collect();
        let count = steps.iter().map(Vec::len).max().unwrap_or(0);
        let step = |k: usize| Spread::of_values(steps.iter().filter_map(|steps| steps.get(k).copied())).median;
        PassTiming {
            name,
            kind,
            steps_ms: (0..count).map(step).collect(),
            gpu_ms: Spread::of_values(frames_gpu_ms.iter().copied()),
            share: 0.0,
            cpu_ms: sums(|zone| zone.cpu_ms).map(Spread::of_values),
            wall_ms: sums(|zone| zone.wall_ms).map(Spread::of_values),
            bytes: frames.last().map_or(0, |zones| zones.iter().map(|zone| zone.bytes).sum()),
            frames_gpu_ms,
        }
    }

    /// The table that `--timings` prints: a row per pass, then the sum of the passes and the frame.
    pub fn table(&self) -> String {
        let passes = self.passes();
        let with_cpu = passes.iter().any(|row| row.cpu_ms.is_some());
        let width = passes.iter().map(|row| row.name.len()).max().unwrap_or(0).max("sum of passes".len());
        let ms = |ms: f64| format!("{ms:.3}");
        let line = |[name, kind, median, min, max, share, cpu, bytes]: [String; 8]| {
            let cpu = if with_cpu { format!("  {cpu:>9}") } else { String::new() };
            let line = format!("{name:width$}  {kind:8}  {median:>9}  {min:>9}  {max:>9}  {share:>6}{cpu}  {bytes:>9}");
            line.trim_end().to_owned() + "\n"
        };
        let row = |name: &str, kind: &str, time: Spread, [share, cpu, bytes]: [String; 3]| {
            let [median, min, max] = [time.median, time.min, time.max].map(ms);
            line([name.to_owned(), kind.to_owned(), median, min, max, share, cpu, bytes])
        };
        let mut text = line(["pass", "kind", "GPU ms", "min", "max", "share", "CPU ms", "bytes"].map(String::from));
        for pass in &passes {
            let cpu = pass.cpu_ms.map_or(String::new(), |cpu| ms(cpu.median));
            let more = [format!("{:.1}%", pass.share * 100.0), cpu, short_bytes(pass.bytes)];
            text += &row(pass.name, &format!("{:?}", pass.kind).to_lowercase(), pass.gpu_ms, more);
            for (k, step) in pass.steps_ms.iter().enumerate() {
                let cells = [&format!("  step {}", k + 1), "", &ms(*step), "", "", "", "", ""];
                text += &line(cells.map(String::from));
            }
        }
        let cpu_sum: Option<f64> = passes.iter().map(|row| row.cpu_ms.map(|cpu| cpu.median)).sum();
        let cpu_sum = cpu_sum.map_or(String::new(), ms);
        text += &row("sum of passes", "", self.passes_gpu_ms(), [String::new(), cpu_sum, String::new()]);
        text += &row("frame", "", self.frame_gpu_ms(), Default::default());
        let (frames, wall) = (self.frames().len(), self.frame_wall_ms().median);
        text + &format!(
            "{frames} frame(s) after {} to warm up; {wall:.3} ms of wall clock each (median)\n",
            self.warm_up()
        )
    }
}

/// A size such as `12.3 MiB`, `4.0 KiB` or `17 B`.
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

    fn zone(name: &'static str, start_ms: f64, gpu_ms: f64, cpu_ms: Option<f64>) -> ZoneTiming {
        ZoneTiming { name, start_ms, gpu_ms, cpu_ms, bytes: 1 << 20, ..ZoneTiming::default() }
    }

    fn report(zones: Vec<ZoneTiming>) -> FrameReport {
        let gpu_ms = zones.iter().map(|zone| zone.gpu_ms).sum();
        FrameReport { timings: ZoneTimings { zones, gpu_ms, wall_ms: gpu_ms + 1.0 }, ..FrameReport::default() }
    }

    fn four_frames() -> Timings {
        let mut timings = Timings::new(1);
        for (record, render) in [(500.0, 900.0), (1.0, 30.0), (3.0, 10.0), (2.0, 20.0)] {
            timings.push(report(vec![zone("record", 0.0, record, None), zone("render", record, render, None)]));
        }
        timings
    }

    #[test]
    fn the_median_of_an_even_count_lies_between() {
        assert_eq!(Spread::of_values([4.0, 1.0, 3.0, 2.0]), Spread { median: 2.5, min: 1.0, max: 4.0 });
        assert_eq!(Spread::of_values([]), Spread::default());
    }

    #[test]
    fn percentiles_are_nearest_ranks() {
        let hundred = Percentiles::of_values((1..=200).rev().map(f64::from));
        assert_eq!(hundred, Percentiles { min: 1.0, median: 100.0, p99: 198.0 });
        assert_eq!(Percentiles::of_values([7.0]), Percentiles { min: 7.0, median: 7.0, p99: 7.0 });
        assert_eq!(Percentiles::of_values([]), Percentiles { min: 0.0, median: 0.0, p99: 0.0 });
    }

    #[test]
    fn slow_settings_are_timed_over_fewer_frames() {
        let count = Count { warm_up: 0, least: 2, most: 5, enough_ms: 2000.0 };
        let timed = |ms: f64| (0..).find(|&n| !count.goes_on(std::iter::repeat_n(ms, n))).unwrap();
        assert_eq!([1.0, 450.0, 550.0, 700.0, 1900.0, 60e3].map(timed), [5, 5, 4, 3, 2, 2]);
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
        timings.push(report(vec![zone("mips", 0.0, 2.0, Some(5.0)), zone("mips", 2.0, 3.0, Some(6.0))]));
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
}
