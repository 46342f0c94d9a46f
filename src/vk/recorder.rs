//! Recording one frame: zones with timestamps and labels; then one wait. Its commands are in `commands.rs`.

use super::context::Context;
use super::counting::Counting;
use super::frame_log::{CommandLog, FrameLog};
use super::recorded::{Recorded, Zone};
use super::submit::{Commands, MAX_TIMESTAMPS};
use super::zone::{ZoneKind, ZoneTimings, process_cpu_ms};
use crate::{Error, Result};
use ash::vk;
use std::any::Any;
use std::sync::Arc;
use std::time::Instant;

/// How to submit what is recorded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RecorderOptions {
    /// One submission per zone, each waited for: this also gives CPU and wall times per zone.
    pub per_pass: bool,
    /// Keep a [`FrameLog`] of every command, for tests: it costs text and lists for each.
    pub log: bool,
}

/// Records commands, then submits them and waits. Recording cannot fail: errors come from [`Recorder::finish`].
pub struct Recorder {
    context: Arc<Context>,
    // Declared before what its commands use.
    commands: Commands,
    options: RecorderOptions,
    zone: Option<(&'static str, ZoneKind)>,
    pub(super) recorded: Recorded,
    error: Option<Error>,
    started: Instant,
}

impl Recorder {
    /// Starts to record. What earlier submissions wrote is visible to everything recorded.
    pub fn new(context: &Arc<Context>, options: RecorderOptions) -> Result<Self> {
        let commands = Commands::begin(context)?;
        let counting = context.counting.then(|| Counting::new(context)).transpose()?;
        let mut this = Self {
            context: context.clone(),
            commands,
            options,
            zone: None,
            recorded: Recorded { counting, ..Recorded::default() },
            error: None,
            started: Instant::now(),
        };
        let set = this.commands.set();
        // SAFETY: the buffer is recording; the pool is not in use.
        unsafe { context.device().cmd_reset_query_pool(set.commands, set.timestamps, 0, MAX_TIMESTAMPS) };
        this.timestamp();
        Ok(this)
    }

    pub fn context(&self) -> &Arc<Context> {
        &self.context
    }

    /// What was recorded so far; empty without [`RecorderOptions::log`].
    pub fn frame_log(&self) -> &FrameLog {
        &self.recorded.log
    }

    pub(super) fn handle(&self) -> vk::CommandBuffer {
        self.commands.set().commands
    }

    pub(super) fn keep(&mut self, used: Arc<dyn Any + Send + Sync>) {
        self.recorded.keep.push(used);
    }

    /// Logs what `command` makes, where a log is kept; else it is not called.
    pub(super) fn log(&mut self, command: impl FnOnce() -> CommandLog) {
        if self.options.log {
            self.recorded.log.push(self.zone, command());
        }
    }

    pub(super) fn logs(&self) -> bool {
        self.options.log
    }

    /// Records `record` as one pass called `name`, timed and labelled. `bytes_written` is the pass's own estimate.
    /// Zones do not nest.
    pub fn zone(&mut self, name: &'static str, kind: ZoneKind, bytes_written: u64, record: impl FnOnce(&mut Self)) {
        assert!(self.zone.is_none(), "zone {name} inside of zone {:?}", self.zone);
        if self.options.per_pass {
            self.flush();
        }
        self.recorded.log.close();
        self.start_counts();
        let (cpu, wall) = if self.options.per_pass { (process_cpu_ms(), Some(Instant::now())) } else { (None, None) };
        self.zone = Some((name, kind));
        let first_timestamp = self.timestamp();
        self.context.begin_label(self.handle(), name);
        record(self);
        self.context.end_label(self.handle());
        self.timestamp();
        self.zone = None;
        self.recorded.log.close();
        self.keep_counts();
        if self.options.per_pass {
            self.flush();
        }
        self.recorded.zones.push(Zone {
            name,
            kind,
            bytes: bytes_written,
            first_timestamp,
            cpu_ms: cpu.and_then(|before| Some(process_cpu_ms()? - before)),
            wall_ms: wall.map(|before| before.elapsed().as_secs_f64() * 1e3),
        });
    }

    /// Submits, waits and reads the times.
    pub fn finish(mut self) -> Result<ZoneTimings> {
        self.timestamp();
        match self.error.take() {
            Some(error) => return Err(error),
            None => self.commands.submit_and_wait("rendering")?,
        }
        let (pool, wait) = (self.commands.set().timestamps, vk::QueryResultFlags::WAIT);
        let wall_ms = self.started.elapsed().as_secs_f64() * 1e3;
        let timings = self.recorded.timings(&self.context, pool, wait, wall_ms)?;
        Ok(timings.expect("the query waits"))
    }

    /// Writes the next timestamp, once everything before is done; returns its index.
    fn timestamp(&mut self) -> u32 {
        let index = self.recorded.timestamps;
        assert!(index < MAX_TIMESTAMPS, "more than {} zones in one recording", MAX_TIMESTAMPS / 2 - 1);
        self.recorded.timestamps += 1;
        let set = self.commands.set();
        let stage = vk::PipelineStageFlags::BOTTOM_OF_PIPE;
        // SAFETY: the query was reset and not written since.
        unsafe { self.context.device().cmd_write_timestamp(set.commands, stage, set.timestamps, index) };
        index
    }

    /// Submits what was recorded, waits, and goes on recording. The first error is kept for `finish`.
    fn flush(&mut self) {
        if self.error.is_none() {
            let waited = self.commands.submit_and_wait("rendering").and_then(|()| self.commands.begin_again());
            self.error = waited.err();
        }
    }
}
