//! Work in submissions that are short: how much goes into one is learned from how long the same work took before.
//! Desktop devices kill what runs for seconds, and nobody is heard while it runs.

use super::recorder::Recorder;
use crate::Result;
use std::collections::HashMap;
use std::ops::Range;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Time that a submission should take, in milliseconds: well below 100 on a GPU, because guesses are not exact. A CPU
/// device would pay for more submissions with vertices that are shaded again in each.
const AIM_MS: f64 = 50.0;
const AIM_CPU_MS: f64 = 1000.0;
/// Time for a CPU device where a window waits for the submission: other waits take longer there than on a GPU.
const AIM_RESPONSIVE_CPU_MS: f64 = 25.0;
/// Work of unknown cost begins with so small a share of it,
const FIRST_SHARE: u32 = 64;
const FIRST_CPU_SHARE: u32 = 16;
/// and takes no larger one than this before it has been done once: the next pixels may cost far more than those before.
const LARGEST_UNKNOWN_SHARE: u32 = 8;
/// On a CPU device no submission is a smaller share than this of its work: where other programs hold the processor,
/// waiting takes longer than the work, and ever smaller parts would only be waited for more often.
const LEAST_CPU_SHARE: u32 = 64;
/// Weight of an older measurement relative to the next.
const FORGET: f64 = 0.7;

/// Progress of the work under way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    pub pass: &'static str,
    /// How often the pass came before in these commands: once for every band of an image.
    pub turn: u32,
    /// Of this pass, 0 to 1.
    pub share: f64,
}

/// Asked after every submission; an error ends the frame.
pub type Watch = Arc<dyn Fn(Step) -> Result<()> + Send + Sync>;

/// A pass, and which of the works that it consists of.
type WorkKey = (&'static str, u32);

/// A pass that is one work.
const WHOLE: u32 = u32::MAX;

/// Measured costs of passes, from frame to frame; shared by the recorders that use it.
pub struct Pace {
    aim_ms: f64,
    first_share: u32,
    least_share: Option<u32>,
    watch: Option<Watch>,
    costs: HashMap<WorkKey, LinearCost>,
    /// Recorded and not submitted yet: units of work, and the milliseconds that these are expected to take.
    waiting: Vec<(WorkKey, f64, f64)>,
}

impl Pace {
    /// `responsive`: as short on a CPU device as on a GPU, and shorter.
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

    /// Whether `units` of a work, whose cost may be unknown, still go into a submission with what waits.
    fn fits(&self, key: WorkKey, units: f64) -> bool {
        let known = self.costs.get(&key).map(|cost| cost.ms(units));
        self.waiting.is_empty() || known.is_some_and(|ms| self.expected_ms() + ms <= self.aim_ms)
    }

    /// How many units of `all` go into the next submission, after `last` before; at least one.
    fn units(&self, key: WorkKey, all: f64, last: Option<f64>) -> f64 {
        let least = all / f64::from(self.first_share);
        let (Some(cost), Some(last)) = (self.costs.get(&key), last.or(Some(0.5 * least))) else { return least };
        let most = cost.units(self.aim_ms - self.expected_ms(), self.aim_ms);
        let most = most.max(self.least_share.map_or(0.0, |share| all / f64::from(share)));
        match cost.parts.len() {
            _ if cost.done_once => most,
            // Parts of two sizes tell what a submission costs by itself.
            0 | 1 => 2.0 * last,
            _ => most.max(least).min(2.0 * last).min(all / f64::from(LARGEST_UNKNOWN_SHARE)),
        }
    }

    /// Adds work to what waits. Returns whether it is to be submitted now.
    fn add(&mut self, key: WorkKey, units: f64) -> bool {
        let known = self.costs.get(&key).filter(|cost| cost.done_once);
        self.waiting.push((key, units, known.map_or(0.0, |cost| cost.ms(units))));
        known.is_none() || self.expected_ms() >= self.aim_ms
    }

    /// Records that the waiting work took `ms`.
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

/// A line through measured times: so much per submission and so much per unit.
#[derive(Debug, Default)]
struct LinearCost {
    /// Sums over measurements, the older the less they count: number, units, milliseconds, units², units ·
    /// milliseconds.
    sums: [f64; 5],
    /// Units and milliseconds of the parts so far.
    parts: Vec<(f64, f64)>,
    /// Milliseconds per unit of the dearest part, of the last time that it was done.
    dearest: f64,
    done_once: bool,
}

impl LinearCost {
    fn learn(&mut self, units: f64, ms: f64) {
        let new = [1.0, units, ms, units * units, units * ms];
        self.sums.iter_mut().zip(new).for_each(|(sum, new)| *sum = *sum * FORGET + new);
        self.parts.push((units, ms));
    }

    /// The work is done for this time.
    fn done(&mut self) {
        let (fixed, slope) = self.line();
        self.dearest = self.parts.drain(..).map(|(units, ms)| (ms - fixed) / units).fold(slope, f64::max);
        self.done_once = true;
    }

    /// Milliseconds per submission and, in the mean, per unit.
    fn line(&self) -> (f64, f64) {
        let [n, u, t, uu, ut] = self.sums;
        let (mean, spread) = (t / u, n * uu - u * u);
        // Measurements of one size do not tell the two apart, and places that differ in cost may tell nonsense.
        let slope = if spread > 1e-3 * u * u { (n * ut - u * t) / spread } else { mean };
        let slope = slope.clamp(0.1 * mean, mean);
        ((t - slope * u) / n, slope)
    }

    fn ms(&self, units: f64) -> f64 {
        let (fixed, slope) = self.most();
        fixed + slope * units
    }

    /// Milliseconds per submission and, where it is dearest, per unit.
    fn most(&self) -> (f64, f64) {
        let (fixed, slope) = self.line();
        (fixed, slope.max(self.dearest))
    }

    /// Units that take `room_ms`, or at most as much as a submission costs by itself.
    fn units(&self, room_ms: f64, aim_ms: f64) -> f64 {
        let (fixed, slope) = self.most();
        let room = if fixed > 0.5 * aim_ms { fixed } else { room_ms - fixed };
        if slope > 0.0 { room / slope } else { f64::INFINITY }
    }
}

/// How far the recorder's passes are.
pub(in crate::vk) struct Pacing {
    pub(in crate::vk) pace: Arc<Mutex<Pace>>,
    /// Works that the open pass has begun.
    works: u32,
    /// How often passes came to their end.
    ended: HashMap<&'static str, u32>,
}

impl Pacing {
    pub(in crate::vk) fn pace(&self) -> MutexGuard<'_, Pace> {
        self.pace.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Recorder {
    /// Cuts what is recorded from now on into short submissions and waits for each. A host's command buffer is not cut.
    #[must_use]
    pub fn paced(mut self, pace: &Arc<Mutex<Pace>>) -> Self {
        pace.lock().unwrap_or_else(PoisonError::into_inner).waiting.clear(); // of a frame that failed
        self.pacing = Some(Pacing { pace: pace.clone(), works: 0, ended: HashMap::new() });
        self
    }

    /// Records a pass's work over `units` of anything, such as rows, in parts that are multiples of `step` and may each
    /// be a submission, or at once.
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

    /// A pass begins: what waits is submitted first where both would take too long.
    pub(in crate::vk) fn pace_pass(&mut self, pass: &'static str) {
        let Some(pacing) = &mut self.pacing else { return };
        pacing.works = 0;
        if !pacing.pace().fits((pass, WHOLE), 1.0) {
            self.cut(pass, 0.0);
        }
    }

    /// A pass is over; one that has no parts is a work of its own.
    pub(in crate::vk) fn pace_pass_end(&mut self, pass: &'static str) {
        let Some(pacing) = &self.pacing else { return };
        if pacing.works == 0 && pacing.pace().add((pass, WHOLE), 1.0) {
            self.cut(pass, 1.0);
        }
        if let Some(pacing) = &mut self.pacing {
            *pacing.ended.entry(pass).or_default() += 1;
        }
    }

    /// Submits what was recorded, waits, and asks whether to go on.
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

    /// Submissions of a work whose unit costs `ms(at)`, and which costs `fixed` per part: units and milliseconds of
    /// each.
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
        // A sky above, then pixels that cost 400 times as much.
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

    /// Where other programs hold the processor a submission may wait for a second, by chance: later parts are not cut
    /// to nothing.
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
