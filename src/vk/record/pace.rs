//! Splits work into short submissions, whose amount is learned from earlier times. Desktop systems kill long
//! submissions, and a program cannot react while one runs.

use super::recorder::Recorder;
use crate::Result;
use std::collections::HashMap;
use std::ops::Range;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The target time of a submission in milliseconds: well below 100 on a GPU, because predictions are inexact. On a CPU
/// device, more submissions would shade vertices more often.
const AIM_MS: f64 = 50.0;
const AIM_CPU_MS: f64 = 1000.0;
/// The target time on a CPU device if a window waits for the submission: other waits take longer there than on a GPU.
const AIM_RESPONSIVE_CPU_MS: f64 = 25.0;
/// Work of unknown cost begins with this share of it.
const FIRST_SHARE: u32 = 64;
const FIRST_CPU_SHARE: u32 = 16;
/// Work takes at most this share until it was done once, because the next pixels may cost far more than the previous
/// ones.
const LARGEST_UNKNOWN_SHARE: u32 = 8;
/// The minimum share of a submission on a CPU device. If other programs use the processor, waiting takes longer than
/// the work, and smaller parts would only add waits.
const LEAST_CPU_SHARE: u32 = 64;
/// The weight of a measurement relative to the next one.
const FORGET: f64 = 0.7;

/// Progress of the current work.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    pub pass: &'static str,
    /// How often the pass occurred before in these commands: once for every band of an image.
    pub turn: u32,
    /// The finished share of this pass, 0 to 1.
    pub share: f64,
}

/// A function that is called after every submission; its error ends the frame.
pub type Watch = Arc<dyn Fn(Step) -> Result<()> + Send + Sync>;

/// A pass and the index of a work within it.
type WorkKey = (&'static str, u32);

/// The index for a pass that is one work.
const WHOLE: u32 = u32::MAX;

/// Measured costs of passes over frames, shared by recorders.
pub struct Pace {
    aim_ms: f64,
    first_share: u32,
    least_share: Option<u32>,
    watch: Option<Watch>,
    costs: HashMap<WorkKey, LinearCost>,
    /// Recorded work that is not yet submitted: units, and expected milliseconds.
    waiting: Vec<(WorkKey, f64, f64)>,
}

impl Pace {
    /// `responsive` requests submissions on a CPU device that are as short as on a GPU or shorter.
    pub fn new(on_cpu: bool, responsive: bool, watch: Option<Watch>) -> Arc<Mutex<Self>> {
        let (aim_ms, first_share) = match (on_cpu, responsive) {
            (false, _) => (AIM_MS, FIRST_SHARE),
            (true, true) => (AIM_RESPONSIVE_CPU_MS, FIRST_SHARE),
            (true, false) => (AIM_CPU_MS, FIRST_CPU_SHARE),
        };
        let least_share = on_cpu.then_some(LEAST_CPU_SHARE);
        Arc::new(Mutex::new(Self {
            aim_ms,
            first_share,
            least_share,
            watch,
            costs: HashMap::new(),
            waiting: Vec::new(),
        }))
    }

    fn expected_ms(&self) -> f64 {
        self.waiting.iter().map(|work| work.2).sum()
    }

    /// Whether `units` of a work still fit into a submission with the waiting work.
    fn fits(&self, key: WorkKey, units: f64) -> bool {
        let known = self.costs.get(&key).map(|cost| cost.ms(units));
        self.waiting.is_empty() || known.is_some_and(|ms| self.expected_ms() + ms <= self.aim_ms)
    }

    /// The number of units of `all` for the next submission, after `last` units before; at least one.
    fn units(&self, key: WorkKey, all: f64, last: Option<f64>) -> f64 {
        let least = all / f64::from(self.first_share);
        let (Some(cost), Some(last)) = (self.costs.get(&key), last.or(Some(0.5 * least))) else { return least };
        let most = cost.units(self.aim_ms - self.expected_ms(), self.aim_ms);
        let most = most.max(self.least_share.map_or(0.0, |share| all / f64::from(share)));
        match cost.parts.len() {
            _ if cost.done_once => most,
            // Parts of two sizes determine the fixed cost of a submission.
            0 | 1 => 2.0 * last,
            _ => most.max(least).min(2.0 * last).min(all / f64::from(LARGEST_UNKNOWN_SHARE)),
        }
    }

    /// Adds work to the waiting work. Returns whether it should be submitted now.
    fn add(&mut self, key: WorkKey, units: f64) -> bool {
        let known = self.costs.get(&key).filter(|cost| cost.done_once);
        self.waiting.push((key, units, known.map_or(0.0, |cost| cost.ms(units))));
        known.is_none() || self.expected_ms() >= self.aim_ms
    }

    /// Reports that the waiting work took `ms`.
    pub(in crate::vk) fn measured(&mut self, ms: f64) {
        let expected = self.expected_ms();
        let equal = 1.0 / self.waiting.len() as f64;
        for (key, units, own) in std::mem::take(&mut self.waiting) {
            let share = if expected > 0.0 { own / expected } else { equal };
            let cost = self.costs.entry(key).or_default();
            cost.learn(units, share * ms);
            if key.1 == WHOLE {
                cost.done();
            }
        }
    }
}

/// A linear fit of measured times: a cost per submission and a cost per unit.
#[derive(Debug, Default)]
struct LinearCost {
    /// Sums over measurements with decaying weights: number, units, milliseconds, units², units · milliseconds.
    sums: [f64; 5],
    /// Units and milliseconds of the parts so far.
    parts: Vec<(f64, f64)>,
    /// Milliseconds per unit of the most expensive part when the work was last done.
    dearest: f64,
    done_once: bool,
}

impl LinearCost {
    fn learn(&mut self, units: f64, ms: f64) {
        let new = [1.0, units, ms, units * units, units * ms];
        self.sums.iter_mut().zip(new).for_each(|(sum, new)| *sum = *sum * FORGET + new);
        self.parts.push((units, ms));
    }

    /// Reports that the work is complete for this frame.
    fn done(&mut self) {
        let (fixed, slope) = self.line();
        self.dearest = self.parts.drain(..).map(|(units, ms)| (ms - fixed) / units).fold(slope, f64::max);
        self.done_once = true;
    }

    /// Milliseconds per submission, and on average per unit.
    fn line(&self) -> (f64, f64) {
        let [n, u, t, uu, ut] = self.sums;
        let (mean, spread) = (t / u, n * uu - u * u);
        // Measurements of one size do not determine both costs, and parts of different cost may give nonsense.
        let slope = if spread > 1e-3 * u * u { (n * ut - u * t) / spread } else { mean };
        let slope = slope.clamp(0.1 * mean, mean);
        ((t - slope * u) / n, slope)
    }

    fn ms(&self, units: f64) -> f64 {
        let (fixed, slope) = self.most();
        fixed + slope * units
    }

    /// Milliseconds per submission, and per unit of the most expensive part.
    fn most(&self) -> (f64, f64) {
        let (fixed, slope) = self.line();
        (fixed, slope.max(self.dearest))
    }

    /// The number of units that take `room_ms`, or at most as much as a submission itself.
    fn units(&self, room_ms: f64, aim_ms: f64) -> f64 {
        let (fixed, slope) = self.most();
        let room = if fixed > 0.5 * aim_ms { fixed } else { room_ms - fixed };
        if slope > 0.0 { room / slope } else { f64::INFINITY }
    }
}

/// The progress of a recorder's passes.
pub(in crate::vk) struct Pacing {
    pub(in crate::vk) pace: Arc<Mutex<Pace>>,
    /// The number of works that the current pass has begun.
    works: u32,
    /// How often each pass has ended.
    ended: HashMap<&'static str, u32>,
}

impl Pacing {
    pub(in crate::vk) fn pace(&self) -> MutexGuard<'_, Pace> {
        self.pace.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Recorder {
    /// Splits later recordings into short submissions and waits for each. A host's command buffer is not split.
    #[must_use]
    pub fn paced(mut self, pace: &Arc<Mutex<Pace>>) -> Self {
        pace.lock().unwrap_or_else(PoisonError::into_inner).waiting.clear(); // left over from a frame that failed
        self.pacing = Some(Pacing { pace: pace.clone(), works: 0, ended: HashMap::new() });
        self
    }

    /// Records a pass's work over `units`, such as rows, in parts that are multiples of `step` and may each be a
    /// submission, or at once.
    pub fn in_parts(&mut self, units: u32, step: u32, mut record: impl FnMut(&mut Self, Range<u32>)) {
        let (Some((pass, _)), Some(pacing)) = (self.zone, &mut self.pacing) else { return record(self, 0..units) };
        let key = (pass, pacing.works);
        pacing.works += 1;
        let (mut at, mut last) = (0, None);
        while at < units && self.goes_on() {
            let Some(pacing) = &self.pacing else { break };
            if !pacing.pace().fits(key, f64::from(step)) {
                self.cut(pass, f64::from(at) / f64::from(units));
                continue;
            }
            let rough = pacing.pace().units(key, f64::from(units), last);
            let count = ((rough / f64::from(step)).min(1e9) as u32).max(1).saturating_mul(step).min(units - at);
            record(self, at..at + count);
            (at, last) = (at + count, Some(f64::from(count)));
            if self.pacing.as_ref().is_some_and(|pacing| pacing.pace().add(key, f64::from(count))) {
                self.cut(pass, f64::from(at) / f64::from(units));
            }
        }
        if let Some(pacing) = &self.pacing
            && let Some(cost) = pacing.pace().costs.get_mut(&key)
        {
            cost.done();
        }
    }

    /// Begins a pass. Waiting work is submitted first if both together would take too long.
    pub(in crate::vk) fn pace_pass(&mut self, pass: &'static str) {
        let Some(pacing) = &mut self.pacing else { return };
        pacing.works = 0;
        if !pacing.pace().fits((pass, WHOLE), 1.0) {
            self.cut(pass, 0.0);
        }
    }

    /// Ends a pass. A pass without parts is one work.
    pub(in crate::vk) fn pace_pass_end(&mut self, pass: &'static str) {
        let Some(pacing) = &self.pacing else { return };
        if pacing.works == 0 && pacing.pace().add((pass, WHOLE), 1.0) {
            self.cut(pass, 1.0);
        }
        if let Some(pacing) = &mut self.pacing {
            *pacing.ended.entry(pass).or_default() += 1;
        }
    }

    /// Submits the recording, waits, and asks the watching function whether to continue.
    fn cut(&mut self, pass: &'static str, share: f64) {
        let Some(ms) = self.flush() else { return };
        let Some(pacing) = &self.pacing else { return };
        let watch = {
            let mut pace = pacing.pace();
            pace.measured(ms);
            pace.watch.clone()
        };
        let turn = pacing.ended.get(pass).copied().unwrap_or_default();
        if let Some(Err(error)) = watch.map(|watch| watch(Step { pass, turn, share })) {
            self.fail(error);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The submissions of a work with `ms(at)` per unit and `fixed` per part: units and milliseconds of each.
    fn submissions(pace: &Mutex<Pace>, fixed: f64, ms: impl Fn(u32) -> f64) -> Vec<(u32, f64)> {
        const UNITS: u32 = 1024;
        let mut pace = pace.lock().unwrap();
        let (key, mut at, mut last, mut done) = (("gather", 0), 0, None, Vec::new());
        let mut waiting = (0, 0.0);
        while at < UNITS {
            let count = (pace.units(key, f64::from(UNITS), last) as u32).clamp(1, UNITS - at);
            let took = fixed + (at..at + count).map(&ms).sum::<f64>();
            waiting = (waiting.0 + count, waiting.1 + took);
            if pace.add(key, f64::from(count)) || at + count == UNITS {
                pace.measured(waiting.1);
                done.push(std::mem::take(&mut waiting));
            }
            (at, last) = (at + count, Some(f64::from(count)));
        }
        pace.costs.get_mut(&key).unwrap().done();
        done
    }

    #[test]
    fn what_was_done_before_is_cut_by_what_it_took() {
        let pace = Pace::new(false, true, None);
        submissions(&pace, 0.1, |_| 0.5);
        let done = submissions(&pace, 0.1, |_| 0.5);
        assert!(done.iter().all(|(_, ms)| *ms < 1.2 * AIM_MS), "{done:?}");
        assert!(done.len() <= 13, "512 ms make ten or eleven submissions: {done:?}");
    }

    #[test]
    fn unknown_work_begins_small_and_does_not_run_away() {
        // The first rows show the sky, and later pixels cost 400 times as much.
        let ms = |at: u32| if at < 512 { 0.001 } else { 0.4 };
        let pace = Pace::new(false, true, None);
        let first = submissions(&pace, 0.05, ms);
        assert_eq!(first[0].0, 1024 / FIRST_SHARE);
        assert!(first.iter().all(|(units, ms)| *units <= 128 && *ms < 1.2 * AIM_MS), "{first:?}");
        let second = submissions(&pace, 0.05, ms);
        assert!(second.iter().all(|(_, ms)| *ms < 1.2 * AIM_MS) && second.len() < 12, "{second:?}");
    }

    #[test]
    fn light_work_is_one_part_once_it_is_known() {
        let pace = Pace::new(false, true, None);
        submissions(&pace, 0.01, |_| 0.001);
        assert_eq!(submissions(&pace, 0.01, |_| 0.001).len(), 1);
    }

    /// If other programs use the processor, a submission may wait for a second by chance. Later parts must not become
    /// ever smaller.
    #[test]
    fn waits_for_a_busy_processor_do_not_shorten_parts_without_end() {
        let pace = Pace::new(true, true, None);
        let busy = |at: u32| if at.is_multiple_of(100) { 1000.0 } else { 0.1 };
        (0..20).for_each(|_| drop(submissions(&pace, 60.0, busy)));
        let done = submissions(&pace, 60.0, busy);
        assert!(done.len() <= 64, "{} submissions", done.len());
    }

    #[test]
    fn what_a_submission_costs_by_itself_is_not_paid_over_and_over() {
        let pace = Pace::new(false, true, None);
        submissions(&pace, 200.0, |_| 0.01);
        let done = submissions(&pace, 200.0, |_| 0.01);
        assert!(done.len() <= 8, "cutting does not shorten this: {done:?}");
    }
}
