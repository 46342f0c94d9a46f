//! The results of one recording. Their capacity is reused by the next one.

use super::bind::Infos;
use super::counting::Counting;
use super::frame_log::FrameLog;
use super::zone::{ZoneTiming, ZoneTimings};
use crate::Result;
use crate::vk::device::context::Context;
use ash::vk;
use std::any::Any;
use std::ops::RangeInclusive;
use std::sync::Arc;

/// A finished zone.
pub(in crate::vk) struct Zone {
    /// Its times, whose device times are filled in later.
    pub(in crate::vk) timing: ZoneTiming,
    /// The range of its timestamps.
    pub(in crate::vk) timestamps: RangeInclusive<u32>,
    /// The timestamps at the ends of its steps.
    pub(in crate::vk) steps: Vec<u32>,
}

#[derive(Default)]
pub(in crate::vk) struct Recorded {
    /// Resources that the commands use, kept alive until the commands have finished.
    pub(in crate::vk) keep: Vec<Arc<dyn Any + Send + Sync>>,
    pub(in crate::vk) zones: Vec<Zone>,
    /// The number of timestamps since the last submission.
    pub(in crate::vk) timestamps: u32,
    /// Ticks of earlier submissions, and the end of each.
    pub(in crate::vk) ticks: Vec<u64>,
    pub(in crate::vk) ends: Vec<usize>,
    /// The log, which is empty unless it was requested.
    pub(in crate::vk) log: FrameLog,
    /// The counts, on a context that counts.
    pub(in crate::vk) counting: Option<Counting>,
    pub(in crate::vk) infos: Infos,
}

impl Recorded {
    /// Clears everything and keeps the capacity.
    pub(in crate::vk) fn clear(&mut self) {
        self.keep.clear();
        self.zones.clear();
        self.timestamps = 0;
        self.ticks.clear();
        self.ends.clear();
        self.log.zones.clear();
        if let Some(counting) = &mut self.counting {
            counting.zones = 0;
        }
    }

    /// The number of the next submission's first timestamp over all submissions.
    pub(in crate::vk) fn first_timestamp(&self) -> u32 {
        self.ticks.len() as u32
    }

    /// Reads the timestamps of a finished submission.
    pub(in crate::vk) fn take_ticks(&mut self, context: &Context, pool: vk::QueryPool) -> Result<()> {
        if let Some(ticks) = self.read(context, pool, vk::QueryResultFlags::WAIT)? {
            self.ticks.extend(ticks);
            self.ends.push(self.ticks.len());
        }
        self.timestamps = 0;
        Ok(())
    }

    /// The zones' times; `None` if the device has not written all timestamps yet and `flags` do not wait.
    pub(in crate::vk) fn timings(
        &self,
        context: &Context,
        pool: vk::QueryPool,
        flags: vk::QueryResultFlags,
        wall_ms: f64,
    ) -> Result<Option<ZoneTimings>> {
        let last = self.read(context, pool, flags)?;
        Ok(last.map(|last| self.timings_of(context, &[&self.ticks[..], &last].concat(), wall_ms)))
    }

    /// The timestamps since the last submission.
    fn read(&self, context: &Context, pool: vk::QueryPool, flags: vk::QueryResultFlags) -> Result<Option<Vec<u64>>> {
        let mut ticks = vec![0_u64; self.timestamps as usize];
        let flags = flags | vk::QueryResultFlags::TYPE_64;
        // SAFETY: the pool is alive and has that many queries.
        match unsafe { context.device().get_query_pool_results(pool, 0, &mut ticks, flags) } {
            Ok(()) => Ok(Some(ticks)),
            Err(vk::Result::NOT_READY) => Ok(None),
            Err(result) => Err(context.error("reading the timestamps", result)),
        }
    }

    fn timings_of(&self, context: &Context, ticks: &[u64], wall_ms: f64) -> ZoneTimings {
        let ms = |ticks: u64| ticks as f64 * f64::from(context.limits.timestamp_period) * 1e-6;
        let between = |from: usize, to: usize| ticks[to].saturating_sub(ticks[from]);
        // Device time before a timestamp in ticks, without the time between submissions.
        let before = |timestamp: usize| {
            let mut start = 0;
            let mut sum = 0;
            for &end in self.ends.iter().take_while(|end| **end <= timestamp) {
                sum += between(start, end - 1);
                start = end;
            }
            sum + between(start, timestamp)
        };
        let counts = |index| self.counting.as_ref().map_or_else(Vec::new, |counting| counting.read(index));
        let timing = |(index, zone): (usize, &Zone)| {
            let [start, end] = [*zone.timestamps.start(), *zone.timestamps.end()].map(|at| before(at as usize));
            let mut begun = start;
            let step = |&end: &u32| {
                let ended = before(end as usize);
                ms(ended - std::mem::replace(&mut begun, ended))
            };
            let steps_ms = zone.steps.iter().map(step).collect();
            let (start_ms, gpu_ms, counts) = (ms(start), ms(end - start), counts(index));
            ZoneTiming { start_ms, gpu_ms, steps_ms, counts, ..zone.timing.clone() }
        };
        let zones = self.zones.iter().enumerate().map(timing).collect();
        ZoneTimings { zones, gpu_ms: ms(before(ticks.len().saturating_sub(1))), wall_ms }
    }
}
