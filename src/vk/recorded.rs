//! What one recording leaves behind. Its capacity serves the next one.

use super::bind::Infos;
use super::context::Context;
use super::counting::Counting;
use super::frame_log::FrameLog;
use super::zone::{ZoneKind, ZoneTiming, ZoneTimings};
use crate::Result;
use ash::vk;
use std::any::Any;
use std::sync::Arc;

/// A zone that is over: its second timestamp follows its first.
pub(super) struct Zone {
    pub(super) name: &'static str,
    pub(super) kind: ZoneKind,
    pub(super) bytes: u64,
    pub(super) first_timestamp: u32,
    pub(super) cpu_ms: Option<f64>,
    pub(super) wall_ms: Option<f64>,
}

#[derive(Default)]
pub(super) struct Recorded {
    /// What the commands use, kept alive until they are over.
    pub(super) keep: Vec<Arc<dyn Any + Send + Sync>>,
    pub(super) zones: Vec<Zone>,
    /// How many were written.
    pub(super) timestamps: u32,
    /// Empty unless it was asked for.
    pub(super) log: FrameLog,
    /// On a context that counts.
    pub(super) counting: Option<Counting>,
    pub(super) infos: Infos,
}

impl Recorded {
    /// Forgets everything but the capacity.
    pub(super) fn clear(&mut self) {
        self.keep.clear();
        self.zones.clear();
        self.timestamps = 0;
        self.log.zones.clear();
        if let Some(counting) = &mut self.counting {
            counting.restart();
        }
    }

    /// The zones' times. `None` where the device has not written all timestamps yet and `flags` do not wait.
    pub(super) fn timings(
        &self,
        context: &Context,
        pool: vk::QueryPool,
        flags: vk::QueryResultFlags,
        wall_ms: f64,
    ) -> Result<Option<ZoneTimings>> {
        let mut ticks = vec![0_u64; self.timestamps as usize];
        let flags = flags | vk::QueryResultFlags::TYPE_64;
        // SAFETY: the pool is alive and has that many queries.
        match unsafe { context.device().get_query_pool_results(pool, 0, &mut ticks, flags) } {
            Ok(()) => Ok(Some(self.timings_of(context, &ticks, wall_ms))),
            Err(vk::Result::NOT_READY) => Ok(None),
            Err(result) => Err(context.error("reading the timestamps", result)),
        }
    }

    fn timings_of(&self, context: &Context, ticks: &[u64], wall_ms: f64) -> ZoneTimings {
        let ms = |from: u32, to: u32| {
            let ticks = ticks[to as usize].saturating_sub(ticks[from as usize]);
            ticks as f64 * f64::from(context.limits.timestamp_period) * 1e-6
        };
        let counts = |index| self.counting.as_ref().map_or_else(Vec::new, |counting| counting.read(index));
        let timing = |(index, zone): (usize, &Zone)| ZoneTiming {
            name: zone.name,
            kind: zone.kind,
            start_ms: ms(0, zone.first_timestamp),
            gpu_ms: ms(zone.first_timestamp, zone.first_timestamp + 1),
            cpu_ms: zone.cpu_ms,
            wall_ms: zone.wall_ms,
            bytes: zone.bytes,
            counts: counts(index),
        };
        let zones = self.zones.iter().enumerate().map(timing).collect();
        ZoneTimings { zones, gpu_ms: ms(0, self.timestamps.saturating_sub(1)), wall_ms }
    }
}
